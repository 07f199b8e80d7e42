"""Derivatives of the end of a run are those of the numbers that it prints: differences of runs with equal steps."""

import numpy as np
import pytest

import mbd
from mbd.sensitivity.derivative import final_state_derivative
from mbd.testing.mechanisms import random_loop
from tests.sensitivity.differences import differences, off
from tests.simulation.mechanisms import ball, kneed_walker, kneed_walker_start, pendulum

SCHEMES = (
    mbd.HHT(alpha=0.05), mbd.GeneralizedAlpha(0.7), mbd.Newmark(), mbd.HHT(0.05, start="consistent"),
    mbd.RungeKutta853(), mbd.RadauIIA(tolerance=1e-12),
)  # fmt: skip
CONVERGED = (
    mbd.HHT(alpha=0.05, tolerance=1e-10), mbd.GeneralizedAlpha(0.7, tolerance=1e-10),
    mbd.HHT(alpha=0.05, formulation="index3", tolerance=1e-10),
    mbd.RungeKutta853(), mbd.RadauIIA(tolerance=1e-12),
)  # fmt: skip
"""Schemes whose steps differ from their converged solutions by round-off: these are what is differentiated."""

WALKER = kneed_walker()
START = kneed_walker_start(WALKER)


def compared(model, start, scheme, names, step=1e-4, **settings):
    run = mbd.simulate(model, start, scheme, **settings)
    state, time = final_state_derivative(run, names)
    wanted, _ = differences(model, start, scheme, names, step, **settings)
    return off(np.vstack([state, time]), wanted)


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_of_a_pendulum(scheme):
    model = pendulum()
    start = mbd.assemble(model, {"hinge.angle": 1.0})
    names = ["hinge.angle", "hinge.angle.rate", "rod.center", "gravity.y"]
    assert compared(model, start, scheme, names, dt=0.01, until=1.005).max() < 1e-9


@pytest.mark.parametrize("scheme", CONVERGED[:2], ids=repr)
def test_of_a_closed_loop_in_long_steps(scheme):
    """Corrections of positions are large there, in the metric of the tangent where each step is predicted."""
    model, place = random_loop(2)
    start = mbd.assemble(model, place, project=True)
    assert compared(model, start, scheme, ["bar 1.mass", "hinge 1.angle"], dt=0.02, until=0.5).max() < 1e-8


def test_of_a_bounce_in_closed_form():
    """A ball from the height h with the restitution e: the derivative by h has the shift of the impact in it."""
    model, e, h, t, g = ball(restitution=0.6), 0.6, 1.0, 0.8, 9.81
    run = mbd.simulate(model, mbd.assemble(model, {"fall.displacement": h}), mbd.Newmark(), dt=1e-3, until=t)
    state, _ = final_state_derivative(run, ["fall.displacement"])
    fall, speed = np.sqrt(2.0 * h / g), np.sqrt(2.0 * g * h)
    by_fall, by_speed = 0.5 * fall / h, 0.5 * speed / h
    left = t - fall
    place = e * by_speed * left - e * speed * by_fall + g * left * by_fall
    assert state[:, 0] == pytest.approx([place, e * by_speed + g * by_fall], rel=1e-9)


def walked(scheme, until):
    model, start = WALKER, START
    names = ["left hip.angle", "right hip.angle.rate", "right thigh.mass", "gravity.x"]
    assert compared(model, start, scheme, names, 1e-4, dt=0.005, until=until).max() < 1e-8


@pytest.mark.parametrize(("scheme", "until"), [(CONVERGED[0], 0.9), (CONVERGED[3], "right foot")], ids=repr)
def test_of_a_walker_with_locking_knees(scheme, until):
    walked(scheme, until)


@pytest.mark.slow
@pytest.mark.parametrize("scheme", CONVERGED, ids=repr)
@pytest.mark.parametrize("until", ["right foot", 0.9])
def test_of_a_walker_by_every_scheme(scheme, until):
    walked(scheme, until)


@pytest.mark.parametrize("scheme", [mbd.HHT(), mbd.RungeKutta853(), mbd.RadauIIA()], ids=repr)
def test_a_run_that_carries_derivatives_is_the_run_itself(scheme):
    """Rows, events and the state at the end are those of the run without derivatives, to the bit."""
    model = mbd.Model("stick")
    rod = mbd.Link("rod", mass=1.2, length=0.9, center=0.4, inertia=0.1)
    model.connect(mbd.Planar("free", model.ground.origin, rod.start))
    model.constrain(mbd.Unilateral("floor", mbd.touchdown(rod.end), restitution=0.4, friction=0.3))
    start = mbd.assemble(model, {"free.y": 1.2, "free.angle": -0.9}, {"free.x": 0.3})
    plain = mbd.simulate(model, start, scheme, dt=0.01, until=0.6, contact="events")
    carried = mbd.simulate(model, start, scheme, dt=0.01, until=0.6, wrt=["free.y", "rod.mass"])
    assert len(plain.events) > 0 and [e.time for e in carried.events] == [e.time for e in plain.events]
    for name in ("time", "q", "v", "a", "lam", "closed", "phase"):
        assert np.array_equal(getattr(carried.record, name), getattr(plain.record, name)), name
    again = final_state_derivative(plain, ["free.y", "rod.mass"], held=["free.y"])[0]
    table = np.array([carried.sensitivities[name] for name in (*start.names, *start.velocity_names)])
    assert np.allclose(table, again, rtol=1e-12, atol=1e-12)
    further = [mbd.simulate(model, run.final, scheme, dt=0.01, until=0.7, contact="events") for run in (plain, carried)]
    assert np.array_equal(further[0].record.q, further[1].record.q)
