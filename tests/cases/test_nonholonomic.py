"""Rows on velocities: what `mbd hardcases` does not judge of d1 (sleigh) and d2 (knife edge)."""

import numpy as np
import pytest

import mbd
from mbd.hardcases.sleighs import knife_edge
from mbd.integrators.family import NewmarkFamily
from tests.cases.schemes import INDEX_3, SCHEMES, name_of
from tests.cases.sleighs import Sleigh
from tests.helpers import assert_second_order
from tests.problems import case

D1, D2 = case("d1-chaplygin-sleigh"), case("d2-knife-edge-incline")
EVERY = [*SCHEMES, *INDEX_3, mbd.Newmark(formulation="index3"), mbd.HHT(0.05, form="averaged")]
"""Rows on velocities are held alike in both formulations, so that undamped index 3 serves them too."""
every_scheme = pytest.mark.parametrize("scheme", EVERY, ids=name_of)


# d1 -----------------------------------------------------------------------------------------------------------------
SLEIGH = Sleigh(D1.definition["m"], D1.definition["I_G"], D1.definition["a"])
BEGIN = D1.start["theta0"], D1.start["v_along_blade"], D1.start["thetadot0"]


def found_motion(run: mbd.Trajectory, times: np.ndarray) -> np.ndarray:
    """The same of a run."""
    at = run.at(times)
    angle = at["body.angle"]
    speed = at["body.x.rate"] * np.cos(angle) + at["body.y.rate"] * np.sin(angle)
    return np.column_stack([speed, at["body.angle.rate"], angle, at["body.x"], at["body.y"], at["blade.force"]])


def is_averaged(scheme: NewmarkFamily) -> bool:
    """The averaged form is of second order only where M is constant; that of the sleigh turns with it."""
    return getattr(scheme, "form", "endpoint") == "averaged"


@pytest.mark.sampled(2)
@every_scheme
def test_a_pulled_sleigh_of_other_sizes_follows_its_reduced_equations(scheme: NewmarkFamily) -> None:
    """All along, with the side force; by rows of a blade and by hand."""
    sleigh = Sleigh(mass=1.7, inertia=0.31, ahead=-0.23, pull=0.9)
    model = sleigh.model(by_hand=scheme.formulation == "index3")
    begin = (0.8, 0.5, -1.6)
    start = sleigh.start(model, *begin)

    def errors(dt: float) -> np.ndarray:
        run = mbd.simulate(model, start, scheme, dt=dt, until=3.0)
        assert np.abs(run["blade.residual"]).max() < 1e-10
        reference = sleigh.motion(*begin, run.time[1:])[:, [3, 4, 2, 0, 1, 5]]
        return np.abs(found_motion(run, run.time)[1:] - reference).max(axis=0)

    if is_averaged(scheme):
        assert errors(0.0025).max() < 0.02
    else:
        assert_second_order(errors, 0.02, halvings=4)


def test_the_sleighs_energy_error_is_that_of_the_scheme() -> None:
    """The blade does no work: what changes is 'numerical', and it falls with dt²."""
    model = SLEIGH.model()
    start = SLEIGH.start(model, *BEGIN)

    def gained(dt: float) -> float:
        energy = mbd.simulate(model, start, mbd.Newmark(), dt=dt, until=6.0).energy
        assert set(energy.sums) == {"numerical"}
        return float(np.abs(energy.numerical).max())

    assert_second_order(gained, 0.02)
    assert gained(1e-3) < 1e-6


# d2 -----------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("scheme", EVERY[-2:], ids=name_of)
def test_the_knife_edge_on_an_incline_meets_its_references(scheme: NewmarkFamily) -> None:
    model, start = knife_edge()
    place = D2["[x, y]"]

    def errors(dt: float) -> np.ndarray:
        run = mbd.simulate(model, start, scheme, dt=dt, until=5.0)
        assert np.abs(run["blade.residual"]).max() < 1e-10
        at = run.at(place.t)
        assert at["blade.multiplier"] == pytest.approx(D2["multiplier"].value, abs=0.3 * dt * dt)
        assert at["blade.force"] == pytest.approx(-at["blade.multiplier"])
        return np.linalg.norm(np.column_stack([at["body.x"], at["body.y"]]) - place.value, axis=0)

    # the averaged form is stepped in plain Python, some milliseconds each
    assert_second_order(errors, 0.04 if is_averaged(scheme) else 0.02, halvings=2 if is_averaged(scheme) else 4)
