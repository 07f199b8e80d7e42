"""The explicit scheme of order 8: its coefficients, its order with and without rows, values between its steps."""

import functools
from dataclasses import replace

import numpy as np
import pytest

import mbd
from mbd.hardcases.governor import governor
from mbd.hardcases.user_force import pushed_particle
from mbd.integrators.runge_kutta import RungeKutta853
from mbd.kernel.schemes.dormand_prince import EIGHTH_ORDER
from mbd.kernel.schemes.tableau import FOURTH_ORDER
from mbd.results.interpolation import Grid
from mbd.results.polynomials import quintic
from mbd.simulation.simulate import prepared
from tests.integrators.test_order import double_pendulum
from tests.simulation.judging import explains
from tests.simulation.mechanisms import ball, kneed_walker, kneed_walker_start, pendulum, run
from tests.simulation.wild import wild_scene

SCHEME = mbd.RungeKutta853()
T = 1.0
"""Length of every run [s]."""
FINEST = 224
OPTIONS = {"contact": "auto", "impact": "newton", "locate": "root", "store": 1, "rest_speed": 1e-6, "backend": "auto"}


def forced():
    """A double pendulum driven by a motor in its lower joint, with friction in the upper."""
    model = mbd.Model("driven")
    rods = [mbd.Link(name, mass=1.0, length=1.0, center=0.5, inertia=0.1) for name in ("upper", "lower")]
    model.connect(
        mbd.Revolute("u", model.ground.origin, rods[0].start, loss=mbd.Viscous(0.5)),
        mbd.Revolute("w", rods[0].end, rods[1].start),
    )
    model.apply(mbd.Motor("motor", model.joints[1], torque=lambda t: 2.0 * mbd.sin(2.0 * t)))
    return model


SCENES = {
    "double pendulum": (double_pendulum, {"u.angle": 1.0, "w.angle": 0.5}, {"u.angle": 1.0, "w.angle": -2.0}),
    "driven and damped": (forced, {"u.angle": 1.0, "w.angle": 0.5}, {"u.angle": 1.0, "w.angle": -1.0}),
    "with rows": (
        lambda: double_pendulum("all"), {"upper floating.angle": 1.0, "lower floating.angle": 1.5},
        {"upper floating.angle": 1.0, "lower floating.angle": -1.0},
    ),
}  # fmt: skip


@functools.cache
def started(scene):
    make, position, velocity = SCENES[scene]
    model = make()
    return model, mbd.assemble(model, position, velocity)


@functools.cache
def fixed(scene, steps):
    model, start = started(scene)
    return mbd.simulate(model, start, SCHEME, dt=T / steps, until=T)


@pytest.mark.parametrize(("formula", "order", "estimates"), [(EIGHTH_ORDER, 8, (5, 3)), (FOURTH_ORDER, 4, (3, 9))])
def test_the_formulas_meet_the_conditions_that_are_linear_in_the_nodes(formula, order, estimates):
    np.testing.assert_allclose(formula.weights.sum(axis=1), formula.nodes, rtol=0, atol=1e-13)
    for power in range(order):  # quadrature
        assert formula.end @ formula.nodes**power == pytest.approx(1.0 / (power + 1), abs=1e-14)
    nodes = np.append(formula.nodes, 1.0)
    for weights, least in zip((formula.error, formula.second), estimates, strict=True):
        sums = [weights @ nodes**power for power in range(least)]
        assert np.max(np.abs(sums)) < 1e-13 and len(weights) == formula.stages + 1


@pytest.mark.parametrize("scene", SCENES)
def test_the_order_is_8_in_positions_rates_accelerations_and_multipliers(scene):
    exact = fixed(scene, FINEST).record
    for part in ("q", "v", "a", "lam"):
        errors = []
        for steps in (28, 56):
            record, every = fixed(scene, steps).record, FINEST // steps
            errors.append(np.max(np.abs(getattr(record, part) - getattr(exact, part)[::every]), initial=0.0))
        if part == "lam" and not exact.lam.size:
            continue
        assert np.log2(errors[0] / errors[1]) == pytest.approx(8.0, abs=0.15 if part == "q" else 0.3), (part, errors)


@pytest.mark.parametrize("scene", SCENES)
def test_the_classical_scheme_has_order_4_and_an_estimate_that_falls_with_the_fourth_power(scene):
    model, start = started(scene)
    exact, errors, estimates = fixed(scene, FINEST).record, [], []
    for steps in (112, 224):
        record = mbd.simulate(model, start, mbd.RungeKutta4(), dt=T / steps, until=T).record
        errors.append(np.max(np.abs(record.q - exact.q[:: FINEST // steps])))
        one = prepared(model, start, mbd.RungeKutta4(), T / steps, T / steps, {}, OPTIONS)
        one.complete()
        estimates.append(np.max(np.abs(one.kernel.error)))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.1)
    assert np.log2(estimates[0] / estimates[1]) == pytest.approx(4.0, abs=0.3)


def test_rows_hold_to_round_off_on_both_levels():
    violation = fixed("with rows", 28).violation
    assert max(violation.length, violation.angle) < 1e-14 and violation.rate < 1e-13


@pytest.mark.parametrize("scene", SCENES)
def test_between_its_rows_a_run_is_as_accurate_as_at_them(scene):
    exact, coarse = fixed(scene, FINEST), fixed(scene, 28)
    names = [coordinate.name for coordinate in exact.record.equations.coordinates]
    for name in (*names, names[0] + ".rate"):
        error = np.abs(coarse.at(exact.time)[name] - exact[name])
        assert np.max(error) < 2.0 * np.max(error[:: FINEST // 28]) + 1e-13


# events -------------------------------------------------------------------------------------------------------------
def test_impacts_of_a_ball_are_located_to_round_off_by_steps_longer_than_its_flights():
    bouncing = run(ball(restitution=0.5), {"fall.displacement": 1.0}, integrator=SCHEME, dt=0.9, until=1.3)
    first = np.sqrt(2.0 / 9.81)
    instants = first * np.array([1.0, 2.0, 2.5, 2.75])
    np.testing.assert_allclose([event.time for event in bouncing.events[:4]], instants, rtol=0, atol=1e-14)


def test_a_step_over_a_whole_arc_sees_a_wall_within_it():
    """A pendulum that swings out and back in one step, with a stop beyond the half of its swing."""
    model = pendulum()
    model.constrain(mbd.Event("turn", mbd.extension(model.joints[0], offset=0.25)))
    start = mbd.assemble(model, {"hinge.angle": 0.0}, {"hinge.angle": 1.2})
    coarse, fine = (mbd.simulate(model, start, SCHEME, dt=dt, until=1.2) for dt in (0.6, 0.01))
    assert len(coarse.events) == len(fine.events) > 0
    np.testing.assert_allclose([e.time for e in coarse.events], [e.time for e in fine.events], atol=2e-4)


def test_a_walker_strikes_and_locks_at_the_same_instants_with_steps_of_a_twentieth():
    walker = kneed_walker()
    start = kneed_walker_start(walker)
    coarse, fine = (mbd.simulate(walker, start, SCHEME, dt=dt, until=1.0) for dt in (0.05, 0.005))
    assert [(e.name, e.kind) for e in coarse.events] == [(e.name, e.kind) for e in fine.events]
    np.testing.assert_allclose([e.time for e in coarse.events], [e.time for e in fine.events], rtol=0, atol=1e-8)
    assert len(coarse.events) == 5


def test_long_steps_are_looked_at_on_a_quintic():
    """Exact for the motion of degree 5 that meets both ends."""
    motion = np.polynomial.Polynomial(np.random.default_rng(3).normal(size=6))
    rows = [part(np.array([0.0, 0.4, 1.0]))[:, None] for part in (motion, motion.deriv(), motion.deriv(2))]
    instants = np.linspace(0.0, 1.0, 31)
    found = quintic(Grid(np.array([0.0, 0.4, 1.0])).places(instants), *rows)
    np.testing.assert_allclose(found[:, 0], motion(instants), rtol=0, atol=1e-14)


def test_it_is_a_value():
    assert RungeKutta853() == mbd.RungeKutta853() and repr(SCHEME) == "RungeKutta853()" and SCHEME.order() == 8


@pytest.mark.parametrize("dt", [1e-2, 2e-3, 1e-3])
def test_a_step_beyond_the_stable_ones_is_refused_and_says_so(dt):
    """Dampers of 8100/s allow 0.7 ms."""
    with pytest.raises(
        mbd.SimulationError,
        match=r"explicit scheme is stable for dt below 0\.00073 s only: use less, tol=, or mbd.RadauIIA",
    ):
        mbd.simulate(*governor(), SCHEME, dt=dt, until=1.0)


def test_a_force_that_is_none_is_not_the_fault_of_the_step():
    with pytest.raises(mbd.SimulationError, match="'push'.* is not finite") as caught:
        mbd.simulate(*pushed_particle(), SCHEME, dt=0.01, until=1.0)
    assert "explicit" not in str(caught.value)


def test_a_step_that_is_refused_excuses_no_other():
    """A block thrown hard, with steps of more than a second: rows hold at every row until the run ends."""
    wild = replace(wild_scene(388), integrator=SCHEME).run()
    assert wild.violation.length < 1e-9


@pytest.mark.parametrize("seed", [69, 121, 182, 278, 422])
def test_an_explicit_step_that_fails_names_what_moves_and_what_to_try(seed):
    message = replace(wild_scene(seed), integrator=SCHEME).run().message
    assert explains(message) and "'" in message.partition(";")[0]


def test_a_flat_pose_does_not_hold_a_linkage():
    """Cranks that come to lie in a line within a step: they go on, or the run says why it ends."""
    wild = replace(wild_scene(14), integrator=SCHEME).run()
    assert not wild.success or abs(wild["pin 0.angle.rate"][-1]) > 1e-3


def servo(stiffness, damping):
    """A link that follows a slow sine by a servo."""
    model = mbd.Model("servo")
    link = mbd.Link("link", 1.0, 1.0, 0.5, 0.1)
    hip = mbd.Revolute("hip", model.ground.origin, link.start)
    model.connect(hip)

    def law(t, angle, rate):
        return stiffness * (0.5 * mbd.sin(t) - angle) - damping * rate

    model.apply(mbd.Motor("servo", hip, torque=law, arguments=("t", "hip.angle", "hip.rate")))
    return model, mbd.assemble(model)


def stiff_notes(run):
    return [note for note in run.stats["notes"] if "stability bounds the steps" in note]


def test_steps_that_stability_bounds_are_told_with_the_rate_of_the_motion_and_a_scheme_for_it():
    """A servo with |s| = c/J, and as many steps as a motion that is followed takes."""
    stiff = mbd.simulate(*servo(1e4, 2e3), SCHEME, tol=1e-6, until=2.0)
    (note,) = stiff_notes(stiff)
    rate = 2e3 / (0.1 + 0.25)
    assert f"for a motion of {rate:.1e} 1/s" in note and "mbd.RadauIIA()" in note
    assert stiff.stats["steps"] > 1000
    followed = mbd.simulate(*servo(4e3, 0.0), SCHEME, tol=1e-6, until=30.0)
    assert followed.stats["steps"] > 1000 and not stiff_notes(followed)
    assert not stiff_notes(mbd.simulate(*servo(1e4, 2e3), mbd.RadauIIA(), tol=1e-6, until=2.0))
