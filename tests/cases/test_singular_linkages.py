"""Cases j3, j3b, b2, b2b: linkages that pass poses in which their rows lose rank, and where branches meet.

Position level is passed at second order. The stabilized schemes keep their branch and their energy too, but near such
a pose they are accurate to some 1e-5 rad only, and may end with an error that says so.
"""

from __future__ import annotations

import numpy as np
import pytest

import mbd
from mbd.integrators.family import NewmarkFamily
from tests.cases.linkages import equal_slider_crank, four_bar, four_bars, upright
from tests.cases.schemes import INDEX_3, SCHEMES, WITH_ROWS, name_of
from tests.helpers import assert_second_order
from tests.problems import case

J3, J3B = case("j3-slider-crank-equal-lengths"), case("j3b-fourbar-flattening")
B2, B2B = case("b2-iftomm-a02-fourbar-N2"), case("b2b-iftomm-a02-fourbar-N40")
QUARTER = 0.5 * np.pi

CRANK = equal_slider_crank(J3.definition["L"], J3.definition["m_each"])
CRANK_START = mbd.assemble(
    CRANK,
    position={"main.angle": J3.start["crank_angle"] + QUARTER, "pin.angle": -2.0 * J3.start["crank_angle"]},
    velocity={"main.rate": J3.start["crank_rate"]},
)
FLAT = four_bar((1.0, 1.0, 1.0), 1.0)
SWUNG = J3B.start["theta_from_downward"]
FLAT_START = mbd.assemble(
    FLAT,
    position={"a.angle": SWUNG, "b.angle": QUARTER - SWUNG, "d.angle": SWUNG},
    velocity={"a.rate": J3B.start["thetadot"]},
)
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
@pytest.mark.parametrize("scheme", INDEX_3, ids=name_of)
def test_the_slider_crank_passes_its_folded_poses_to_second_order(scheme: NewmarkFamily) -> None:
    angle, place = J3["crank angle"], J3["slider position"]

    def errors(dt: float) -> np.ndarray:
        moments = mbd.simulate(CRANK, CRANK_START, scheme, dt=dt, until=angle.t[-1]).at(angle.t)
        found = moments["main.angle"] - QUARTER - angle.value, moments["guide.displacement"] - place.value
        return np.concatenate(found)

    assert_second_order(errors, 2e-3, halvings=2)


@pytest.mark.parametrize("scheme", WITH_ROWS, ids=name_of)
@pytest.mark.parametrize("dt", [1e-3, 3.7e-4, 2e-4])
def test_the_slider_crank_stays_on_its_branch_or_stops_with_an_error(scheme: NewmarkFamily, dt: float) -> None:
    run = mbd.simulate(CRANK, CRANK_START, scheme, dt=dt, until=2.0, on_failure="return")
    angle = run["main.angle"] - QUARTER
    assert np.max(np.abs(run["guide.displacement"] - 2.0 * np.cos(angle))) < 1e-6
    assert run["kinetic_energy"][0] + run["potential_energy"][0] == pytest.approx(J3["energy"].value, abs=1e-11)
    assert np.max(energy_jumps(run, angle)) < 1e-6
    assert run.success or "rank" in run.message


def test_the_rate_at_the_folded_pose_follows_from_the_energy() -> None:
    run = mbd.simulate(CRANK, CRANK_START, INDEX_3[0], dt=2e-4, until=0.6)
    moment = run.at(J3["time of first singular passage"].value)
    assert moment["main.angle"] == pytest.approx(np.pi, abs=1e-6)
    assert moment["main.rate"] == pytest.approx(J3["crank rate at the first"].value, abs=1e-6)


# j3b ----------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("scheme", INDEX_3, ids=name_of)
def test_the_parallelogram_passes_its_flat_poses_to_second_order(scheme: NewmarkFamily) -> None:
    angle = J3B["crank angle"]

    def errors(dt: float) -> np.ndarray:
        run = mbd.simulate(FLAT, FLAT_START, scheme, dt=dt, until=angle.t[-1])
        assert np.sum(np.diff(np.sign(np.cos(run["a.angle"]))) != 0) == J3B["flat positions"].value
        return run.at(angle.t)["a.angle"] - angle.value

    assert_second_order(errors, 1e-3, halvings=2)


@pytest.mark.parametrize("scheme", WITH_ROWS, ids=name_of)
@pytest.mark.parametrize("dt", [1e-3, 3.7e-4, 2e-4])
def test_the_parallelogram_stays_one_or_stops_with_an_error(scheme: NewmarkFamily, dt: float) -> None:
    run = mbd.simulate(FLAT, FLAT_START, scheme, dt=dt, until=1.0, on_failure="return")
    assert np.max(np.abs(run["d.angle"] - run["a.angle"])) < 1e-6
    assert np.max(energy_jumps(run, run["a.angle"])) < 1e-6
    assert run.success or "rank" in run.message


# b2 -----------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("scheme", INDEX_3[1:], ids=name_of)
def test_two_parallelograms_pass_ten_flat_poses_to_second_order(scheme: NewmarkFamily) -> None:
    angle, place = B2["crank angle from upright"], B2["B0"]

    def errors(dt: float) -> np.ndarray:
        run = mbd.simulate(BARS, BARS_START, scheme, dt=dt, until=10.0, store=5)
        turned = np.pi - run["base 0.angle"]
        assert np.sum(np.diff(np.sign(np.cos(turned))) != 0) == B2["number of singular passages"].value
        moments = run.at(angle.t)
        miss = np.linalg.norm(moments["crank 0.end"][:, :2] - place.value, axis=1)
        return np.concatenate([np.pi - moments["base 0.angle"] - angle.value, miss])

    assert_second_order(errors, 1e-3, halvings=2)


def test_the_speed_at_the_flat_pose_follows_from_the_energy() -> None:
    run = mbd.simulate(BARS, BARS_START, INDEX_3[1], dt=2e-4, until=1.0)
    moment = run.at(B2["first passage"].value)
    assert np.pi - moment["base 0.angle"] == pytest.approx(QUARTER, abs=1e-6)
    assert -moment["base 0.rate"] == pytest.approx(B2["thetadot"].value, abs=1e-6)


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


# b2b ----------------------------------------------------------------------------------------------------------------
@pytest.mark.slow
def test_forty_parallelograms_pass_ten_flat_poses_to_second_order() -> None:
    model = four_bars(40)
    start = upright(model, 40)
    angle = B2B["crank angle from upright"]

    def errors(dt: float) -> np.ndarray:
        run = mbd.simulate(model, start, INDEX_3[1], dt=dt, until=10.0, store=10)
        parallel = max(np.max(np.abs(run[f"base {k}.angle"] - run["base 0.angle"])) for k in range(1, 41))
        assert parallel < 1e-9 and run.energy.drift < 1e-4
        return np.pi - run.at(angle.t)["base 0.angle"] - angle.value

    assert_second_order(errors, 2e-3, halvings=2)
