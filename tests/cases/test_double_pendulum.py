"""Case a2: two point masses on rods; minimal, partly cut, absolute and natural coordinates give one answer."""

import numpy as np
import pytest

import mbd
from mbd.integrators.family import NewmarkFamily
from tests.cases.double_pendulums import FORMS, WITH_ROWS, DoublePendulum
from tests.cases.schemes import INDEX_3, SCHEMES
from tests.helpers import assert_second_order
from tests.problems import case, double_pendulum, integrated

A2 = case("a2-double-pendulum")
START = [A2.start[name] for name in ("theta1", "theta2", "thetadot1", "thetadot2")]
PAIRS = [pytest.param(form, scheme, id=f"{form}, {scheme!r}") for form in FORMS for scheme in SCHEMES]
PAIRS += [pytest.param(form, scheme, id=f"{form}, {scheme!r}") for form in WITH_ROWS for scheme in INDEX_3]


def last(leg: DoublePendulum, start: mbd.State, scheme: NewmarkFamily, dt: float, until: float) -> mbd.Trajectory:
    """A run of equal steps of which only the end is looked at."""
    steps = round(until / dt)
    return mbd.simulate(leg.model, start, scheme, dt=until / steps, until=until, store=steps)


def first_step(scheme: NewmarkFamily, form: str) -> float:
    """dt of the first of four runs [s]; where multipliers are solved for, their round-off grows as dt falls."""
    if form not in WITH_ROWS:
        return 5e-4
    return 2e-3 if scheme.formulation == "index3" else 1e-3


@pytest.mark.sampled(2)
@pytest.mark.parametrize(("form", "scheme"), PAIRS)
def test_motion_and_rod_tensions_meet_the_references_to_second_order(form: str, scheme: NewmarkFamily) -> None:
    swing = FORMS[form]()
    start, angles, places, pulls = swing.start(START), A2["[theta1, theta2"], A2["[x1,z1,x2,z2"], A2["rod tensions"]

    def errors(dt: float) -> list[float]:
        runs = [last(swing, start, scheme, dt, t) for t in angles.t]
        found = np.array([[column[-1] for column in swing.motion(run)] for run in runs])
        end = last(swing, start, scheme, dt, places.t)
        bobs, tensions = (np.array([column[-1] for column in read(end)]) for read in (swing.bobs, swing.tensions))
        turned = [float(np.linalg.norm(each)) for each in (found - angles.value)]
        return [*turned, float(np.linalg.norm(bobs - places.value)), *(tensions - pulls.value)]

    assert_second_order(errors, first_step(scheme, form))


@pytest.mark.sampled(3)
@pytest.mark.parametrize(("form", "scheme"), PAIRS)
def test_unequal_rods_started_with_speed_follow_lagranges_equations(form: str, scheme: NewmarkFamily) -> None:
    sizes = {"m1": 0.8, "m2": 0.5, "L1": 1.3, "L2": 0.9, "g": 3.3}
    swing, initial, times = FORMS[form](**sizes), [1.1, -0.6, -0.5, 0.8], (1.0, 2.0, 3.0)
    start, reference = swing.start(initial), integrated(double_pendulum(**sizes), initial, times)
    exact = np.array([swing.cartesian(motion) for motion in reference])

    def errors(dt: float) -> list[float]:
        runs = [last(swing, start, scheme, dt, t) for t in times]
        found = np.array([[column[-1] for column in swing.bobs(run)] for run in runs])
        return [float(np.linalg.norm(each)) for each in found - exact]

    assert_second_order(errors, first_step(scheme, form))
