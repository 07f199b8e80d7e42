"""Linkages of the cases j3, j3b and b2 at many steps: singular configurations, and where branches meet.

What `mbd hardcases` judges is not repeated here.

Position level is passed at second order. The stabilized schemes keep their branch and their energy too, but near such
a pose they are accurate to some 1e-5 rad only, and may end with an error that says so.
"""

import numpy as np
import pytest

import mbd
from mbd.hardcases.singular_poses import equal_slider_crank, parallelogram
from mbd.integrators.family import NewmarkFamily
from tests.cases.linkages import four_bars, upright
from tests.cases.schemes import SCHEMES, WITH_ROWS, name_of
from tests.problems import case

J3, B2 = case("j3-slider-crank-equal-lengths"), case("b2-iftomm-a02-fourbar-N2")
QUARTER = 0.5 * np.pi

CRANK, CRANK_START = equal_slider_crank()
FLAT, FLAT_START = parallelogram()
BARS = four_bars(2)
BARS_START = upright(BARS, 2)


def energy_jumps(run: mbd.Trajectory, angle: np.ndarray) -> np.ndarray:
    """Relative change of the energy across each pose at which cos(angle) = 0, over three stored rows."""
    energy = run["kinetic_energy"] + run["potential_energy"]
    passed = np.flatnonzero(np.diff(np.sign(np.cos(angle))) != 0)
    after, before = np.minimum(passed + 2, len(energy) - 1), np.maximum(passed - 1, 0)
    return np.abs(energy[after] - energy[before]) / abs(energy[0])


# where the rank drops -----------------------------------------------------------------------------------------------
def test_the_folded_slider_crank_is_singular_and_its_rows_are_named() -> None:
    assert not mbd.mobility(CRANK, CRANK_START).singular
    folded = mbd.assemble(CRANK, {"main.angle": 2.0 * QUARTER, "pin.angle": -2.0 * QUARTER})
    found = mbd.mobility(CRANK, folded)
    assert found.singular and (found.dof, found.rank, found.rank_here) == (1, 2, 1)
    assert "singular here: rank 1, 2 at postures nearby" in str(found)
    assert ["'wrist'" in row.row for row in found.lost] == [True]


@pytest.mark.parametrize("count", [1, 2, 5])
def test_flat_parallelograms_lose_a_row_each(count: int) -> None:
    model = four_bars(count)
    assert not mbd.mobility(model, upright(model, count)).singular
    found = mbd.mobility(model, upright(model, count, angle=QUARTER))
    assert found.singular and (found.dof, found.rank - found.rank_here) == (1, count)
    assert len(found.lost) == count and not found.dependent


# j3 -----------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("scheme", WITH_ROWS, ids=name_of)
@pytest.mark.parametrize("dt", [1e-3, 3.7e-4, 2e-4])
def test_the_slider_crank_stays_on_its_branch_or_stops_with_an_error(scheme: NewmarkFamily, dt: float) -> None:
    run = mbd.simulate(CRANK, CRANK_START, scheme, dt=dt, until=2.0, on_failure="return")
    angle = run["main.angle"] - QUARTER
    assert np.max(np.abs(run["guide.displacement"] - 2.0 * np.cos(angle))) < 1e-6
    assert run["kinetic_energy"][0] + run["potential_energy"][0] == pytest.approx(J3["energy"].value, abs=1e-11)
    assert np.max(energy_jumps(run, angle)) < 1e-6
    assert run.success or "rank" in run.message


# j3b ----------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("scheme", WITH_ROWS, ids=name_of)
@pytest.mark.parametrize("dt", [1e-3, 3.7e-4, 2e-4])
def test_the_parallelogram_stays_one_or_stops_with_an_error(scheme: NewmarkFamily, dt: float) -> None:
    run = mbd.simulate(FLAT, FLAT_START, scheme, dt=dt, until=1.0, on_failure="return")
    assert np.max(np.abs(run["d.angle"] - run["a.angle"])) < 1e-6
    assert np.max(energy_jumps(run, run["a.angle"])) < 1e-6
    assert run.success or "rank" in run.message


# b2 -----------------------------------------------------------------------------------------------------------------
@pytest.mark.covering
@pytest.mark.parametrize("scheme", WITH_ROWS, ids=name_of)
@pytest.mark.parametrize("count", [1, 2, 10])
def test_cranks_stay_parallel_and_keep_their_energy_or_stop_with_an_error(scheme: NewmarkFamily, count: int) -> None:
    model = four_bars(count)
    start = upright(model, count)
    for dt in (2e-3, 1e-3, 5e-4):
        run = mbd.simulate(model, start, scheme, dt=dt, until=10.0, store=20, on_failure="return")
        parallel = max(np.max(np.abs(run[f"base {k}.angle"] - run["base 0.angle"])) for k in range(1, count + 1))
        assert parallel < 1e-6, (dt, run.message)
        assert run.energy.drift < 1e-4
        assert run.success or "rank" in run.message


@pytest.mark.parametrize("scheme", SCHEMES, ids=name_of)
def test_the_stabilized_schemes_pass_ten_flat_poses_at_ordinary_steps(scheme: NewmarkFamily) -> None:
    run = mbd.simulate(BARS, BARS_START, scheme, dt=1e-3, until=10.0, store=20)
    assert abs(np.pi - run["base 0.angle"][-1] - B2["crank angle from upright"].value[-1]) < 1e-5
