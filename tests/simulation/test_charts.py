"""Runs whose coordinates do not add: a ball joint by unit quaternion, four coordinates and three velocities."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mbd
from mbd.analysis.accuracy.reference import RungeKuttaReference
from mbd.results.units import unit
from tests.joints.quaternion_ball import CayleyBall, QuaternionBall, axis_angle, product, rotation

NAMES = ("ball.w", "ball.x", "ball.y", "ball.z")
SPINS = ("ball.spin x", "ball.spin y", "ball.spin z")
MASS, CENTER = 1.3, np.array([0.05, 0.1, -0.08])
INERTIA = np.array([[0.05, 0.004, 0.002], [0.004, 0.07, -0.003], [0.002, -0.003, 0.03]])
DOWN = np.array([0.0, -9.81, 0.0])


def named(q, names=NAMES):
    return dict(zip(names, map(float, q), strict=True))


@cache
def top(ball=QuaternionBall):
    """A heavy body of no symmetry that turns about a point."""
    model = mbd.Model("top")
    moments = (*np.diag(INERTIA), INERTIA[0, 1], INERTIA[0, 2], INERTIA[1, 2])
    body = mbd.RigidBody("body", MASS, tuple(map(float, moments)), center=tuple(CENTER))
    model.connect(ball("ball", model.ground.origin, body.origin))
    return model, mbd.assemble(model, velocity=named((3.0, -2.0, 4.0), SPINS))


@cache
def end_of_top(time):
    """(q, ω) by Euler's equations in the body's axes."""
    about = INERTIA + MASS * ((CENTER @ CENTER) * np.eye(3) - np.outer(CENTER, CENTER))

    def slope(t, y):
        q, w = y[:4], y[4:]
        torque = MASS * np.cross(CENTER, np.array(rotation(q / np.linalg.norm(q))).T @ DOWN)
        change = np.linalg.solve(about, torque - np.cross(w, about @ w))
        return np.concatenate([0.5 * np.array(product(q, [0.0, *w])), change])

    begin = [1.0, 0.0, 0.0, 0.0, 3.0, -2.0, 4.0]
    end = solve_ivp(slope, (0.0, time), begin, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    end[:4] /= np.linalg.norm(end[:4])
    return end


def off(state, exact):
    """Largest error of (q, ω), the quaternion up to its sign."""
    q = state.q if state.q @ exact[:4] > 0.0 else -state.q
    return float(np.max(np.abs(np.concatenate([q, state.v]) - exact)))


SECOND = [mbd.Newmark(), mbd.HHT(0.05), mbd.GeneralizedAlpha(0.8), mbd.GeneralizedAlpha(0.8, formulation="index3")]
SCHEMES = [*((scheme, (50, 100, 200)) for scheme in SECOND), (mbd.RadauIIA(tolerance=1e-12), (20, 40, 80)),
           (mbd.RungeKutta853(), (5, 10, 20))]  # fmt: skip


@pytest.mark.covering
@pytest.mark.parametrize(("scheme", "counts"), SCHEMES, ids=[repr(scheme) for scheme, _ in SCHEMES])
@pytest.mark.parametrize("backend", ["auto", "python"])
def test_every_scheme_has_its_order_on_a_heavy_body_that_turns_about_a_point(scheme, counts, backend):
    model, start = top()
    if backend == "python":  # but for steps that would turn the body so far that they are divided
        counts = counts[1:] if counts[0] < 10 else tuple(count // 2 for count in counts[:2])
    errors = []
    for count in counts:
        end = mbd.simulate(model, start, scheme, dt=1.0 / count, until=1.0, backend=backend).final
        assert end.q @ end.q == pytest.approx(1.0, abs=2e-15)
        errors.append(off(end, end_of_top(1.0)))
    orders = [np.log2(a / b) for a, b in pairwise(errors)]
    assert orders[-1] > scheme.order() - 0.15
    if scheme.order() < 8:  # whose last terms happen to be small here
        assert orders[-1] == pytest.approx(scheme.order(), abs=0.15)


@pytest.mark.parametrize("scheme", [mbd.GeneralizedAlpha(0.8), mbd.RadauIIA(tolerance=1e-12)], ids=repr)
def test_the_order_does_not_hang_on_the_chart(scheme):
    model, start = top(CayleyBall)
    counts = (40, 80, 160)
    errors = [off(mbd.simulate(model, start, scheme, dt=1.0 / n, until=1.0).final, end_of_top(1.0)) for n in counts]
    assert np.log2(errors[1] / errors[2]) == pytest.approx(scheme.order(), abs=0.15)


@cache
def bouncing(ball):
    """A pendulum in space, on a ball joint or a universal joint and a hinge, whose tip bounces on the ground."""
    model = mbd.Model("bouncing pendulum")
    bob = mbd.RigidBody("bob", 1.0, (0.02, 0.03, 0.01), center=(0.0, -0.5, 0.0))
    pivot = model.ground.point(0.0, 0.9, 0.0)
    if ball:
        model.connect(QuaternionBall("ball", pivot, bob.origin))
        start = named(product(axis_angle((1, 0, 0), 0.7), axis_angle((0, 0, 1), 0.9)))
    else:
        yoke = mbd.RigidBody("yoke", 0.0, (0.0, 0.0, 0.0))
        model.connect(mbd.Universal("cross", pivot, yoke.origin, axis=(1, 0, 0), second_axis=(0, 0, 1)))
        model.connect(mbd.Revolute("spin", yoke.origin, bob.origin, axis=(0, 1, 0)))
        start = {"cross.first": 0.7, "cross.second": 0.9}
    tip = bob.point(0.0, -1.0, 0.0, name="tip")
    model.constrain(mbd.Unilateral("floor", mbd.touchdown(tip), restitution=0.6, friction=0.0))
    return model, mbd.assemble(model, start)


@pytest.mark.parametrize("scheme", [mbd.RadauIIA(), mbd.RungeKutta853()], ids=repr)
def test_impacts_of_a_ball_joint_are_those_of_three_hinges(scheme):
    runs = [mbd.simulate(*bouncing(ball), scheme, dt=0.01, until=0.9) for ball in (True, False)]
    assert len(runs[0].events) >= 2
    assert [e.name for e in runs[0].events] == [e.name for e in runs[1].events]
    np.testing.assert_allclose(*[[e.time for e in run.events] for run in runs], atol=1e-8)
    np.testing.assert_allclose(runs[0].at(0.85)["bob.tip"], runs[1].at(0.85)["bob.tip"], atol=1e-7)
    assert np.max(np.abs(runs[0].energy.numerical)) < 1e-7


def test_non_smooth_steps_move_positions_along_the_joint():
    run = mbd.simulate(*bouncing(True), mbd.GeneralizedAlpha(0.8), dt=2e-3, until=0.9, contact="nonsmooth")
    np.testing.assert_allclose(np.sum(run.record.q**2, axis=1), 1.0, atol=4e-15)
    assert run["floor.gap"].min() > -1e-9
    located = mbd.simulate(*bouncing(True), mbd.RungeKutta853(), dt=0.01, until=0.3)
    np.testing.assert_allclose(run.at(0.25)["bob.tip"], located.at(0.25)["bob.tip"], atol=1e-3)


@cache
def held():
    """A body on a ball joint with a rod to the ground."""
    model = mbd.Model("body with a rod")
    body = mbd.RigidBody("body", 1.0, (0.2, 0.3, 0.1), center=(0.0, -0.5, 0.0))
    model.connect(QuaternionBall("ball", model.ground.origin, body.origin))
    ends = model.ground.point(1.0, 0.0, 0.3), body.point(0.1, -1.0, 0.2)
    model.constrain(mbd.Bilateral("rod", mbd.distance(*ends), 1.3))
    return model, mbd.assemble(model, velocity={"ball.spin x": 1.0, "ball.spin y": 2.0})


@pytest.mark.parametrize(("scheme", "counts"), [(mbd.GeneralizedAlpha(0.8), (80, 160)),
                                                (mbd.GeneralizedAlpha(0.8, formulation="index3"), (80, 160)),
                                                (mbd.RadauIIA(tolerance=1e-12), (20, 40))], ids=repr)  # fmt: skip
def test_rows_are_held_at_full_order_in_charts(scheme, counts):
    exact = mbd.simulate(*held(), mbd.RungeKutta853(), dt=0.005, until=1.0)
    wanted = np.concatenate([exact.final.q, exact.final.v])
    errors = []
    for count in counts:
        run = mbd.simulate(*held(), scheme, dt=1.0 / count, until=1.0)
        errors.append(off(run.final, wanted))
        assert run.violation.length < 1e-10
    assert np.log2(errors[0] / errors[1]) == pytest.approx(scheme.order(), abs=0.15)


@pytest.mark.parametrize(("scheme", "counts", "order"), [(mbd.HHT(0.05), (50, 100), 2),
                                                         (mbd.RadauIIA(tolerance=1e-12), (20, 40), 5),
                                                         (mbd.RungeKutta853(), (5, 10), 8)], ids=repr)  # fmt: skip
def test_a_run_is_as_accurate_between_its_rows_live_and_from_a_file(scheme, counts, order, tmp_path):
    model, start = top()
    between, exact, errors = 1.0 / 3.0, end_of_top(1.0 / 3.0), []
    for count in counts:
        run = mbd.simulate(model, start, scheme, dt=1.0 / count, until=1.0)
        found = np.array([run.at(between)[name] for name in (*NAMES, *SPINS)])
        errors.append(np.max(np.abs(found - exact)))
        assert found[:4] @ found[:4] == pytest.approx(1.0, abs=2e-15)
    assert np.log2(errors[0] / errors[1]) > order - 0.25
    run.save(tmp_path / "run.mbd")
    saved = mbd.load(tmp_path / "run.mbd")
    assert [saved.at(between)[name] for name in (*NAMES, *SPINS)] == pytest.approx(found.tolist(), rel=1e-14, abs=1e-14)
    assert unit("ball.spin x", saved.facts) == "rad/s"
    assert unit("ball.spin x.acceleration", saved.facts) == "rad/s²"


@pytest.mark.parametrize("spin", [0.0, 30.0])
def test_the_spectrum_of_a_sleeping_top_is_that_of_its_equations(spin):
    """``I s² − i J Ω s − m g l = 0`` in axes that stand, s − iΩ in those of the body."""
    model = mbd.Model("sleeping top")
    body = mbd.RigidBody("body", 1.2, (0.02, 0.008, 0.02), center=(0.0, 0.3, 0.0))
    model.connect(QuaternionBall("ball", model.ground.origin, body.origin))
    linear = mbd.linearize(model, mbd.assemble(model, velocity={"ball.spin y": spin}))
    assert linear.is_equilibrium
    assert len(set(linear.states)) == 6
    s = np.roots([0.02 + 1.2 * 0.09, -1j * 0.008 * spin, -1.2 * 9.81 * 0.3]) - 1j * spin
    expected = np.concatenate([s, s.conj(), [0.0, 0.0]])
    for value in expected:
        assert np.min(np.abs(linear.eigenvalues - value)) < 1e-6
    for value in linear.eigenvalues:
        assert np.min(np.abs(expected - value)) < 1e-6


def test_the_reference_of_the_accuracy_lab_turns_a_body_exactly():
    model, start = top()
    run = mbd.simulate(model, start, RungeKuttaReference(), dt=0.1, until=1.0)
    assert off(run.final, end_of_top(1.0)) < 1e-10


def test_a_state_whose_quaternion_is_none_is_refused_by_name():
    from dataclasses import replace

    model, start = top()
    with pytest.raises(mbd.ModelError, match="which no placement of joint 'ball' has; the nearest are 1, 0, 0, 0"):
        mbd.simulate(model, replace(start, q=np.array([2.0, 0.0, 0.0, 0.0])), dt=0.01, until=0.1)


def test_steps_that_turn_a_ball_joint_too_far_are_noted():
    model, start = top()
    near, far = (mbd.simulate(model, start, mbd.RungeKutta853(), dt=dt, until=1.0).stats["notes"] for dt in (0.1, 0.5))
    assert not any("turns by up to" in said for said in near)
    assert any("'ball' turns by up to" in said and "steps were divided" in said for said in far)
