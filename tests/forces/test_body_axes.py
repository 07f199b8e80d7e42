"""Forces whose components lie along the axes of a body."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.integrate import quad

import mbd
from mbd.testing.forces import generalized, power
from mbd.testing.scope import FreeScope
from mbd.topology.check import require_valid

SHIP = mbd.RigidBody("ship", 2.0, (0.3, 0.4, 0.5))
TUG = mbd.RigidBody("tug", 1.0, 0.1)
triples = st.tuples(*[st.floats(-3.0, 3.0)] * 3)


@given(st.integers(0, 10**6), triples, triples, st.booleans())
@settings(max_examples=20)
def test_the_work_is_that_of_the_turned_components(seed, f, g, follows):
    """F = R f and T = R g by numbers, with the rotation of the ship itself or of another body, in turned axes."""
    turned = mbd.RigidBody("ship", 2.0, (0.3, 0.4, 0.5)).point(0.1, 0.2, 0.3).turned(0.7, (0.3, -0.5, 1.0))
    axes = turned if follows else TUG.origin.turned(-0.4, (1.0, 0.2, 0.1))
    nozzle = SHIP.point(0.4, -0.3, 0.2)
    force, scope = mbd.Applied("thrust", nozzle, force=f, torque=g, axes=axes), FreeScope()
    scope.frame(SHIP.origin), scope.frame(TUG.origin)
    action = force.act(scope)
    scope.scatter(np.random.default_rng(seed))
    R = np.array([scope.value(*row) for row in scope.frame(axes).rotation])
    motion = scope.frame(nozzle)
    velocity, spin = scope.value(*motion.velocity), scope.value(*motion.angular_velocity)
    assert scope.value(power(action, scope))[0] == pytest.approx(R @ f @ velocity + R @ g @ spin, abs=1e-9)
    work = np.array(scope.value(*generalized(action, scope)))
    assert work[:3] == pytest.approx(R @ f, abs=1e-9)  # along the ship's place
    assert np.max(np.abs(work[6:])) == 0.0  # the tug gives its axes, and feels nothing
    assert pytest.approx(np.eye(3)) == R @ R.T


def rocket(**given):
    model, body = mbd.Model("rocket", gravity=(0.0, 0.0, 0.0)), mbd.RigidBody("rocket", 3.0, 0.6)
    model.connect(mbd.Planar("flight", model.ground.origin, body.origin))
    model.apply(mbd.Applied("thrust", body.point(0.0, -0.5, name="nozzle"), axes=body.origin, **given))
    return model


def test_a_rocket_with_a_skew_nozzle_flies_a_spiral():
    """Constant f in body axes at −h: θ = h fx t²/(2 I), so that ẍ = (fx cos θ − fy sin θ)/m: Fresnel integrals."""
    model, until, (fx, fy) = rocket(force=(0.8, 5.0)), 2.0, (0.8, 5.0)
    run = mbd.simulate(model, mbd.assemble(model), mbd.RungeKutta853(), tol=1e-10, until=until)
    spin = 0.5 * fx / 0.6

    def push(t, along):
        turn = 0.5 * spin * t * t
        return (fx * math.cos(turn) - fy * math.sin(turn), fx * math.sin(turn) + fy * math.cos(turn))[along] / 3.0

    wanted = [quad(push, 0.0, until, (along,), epsabs=1e-12)[0] for along in (0, 1)]
    assert run["flight.angle"][-1] == pytest.approx(0.5 * spin * until**2, rel=1e-8)
    assert [run["flight.x.rate"][-1], run["flight.y.rate"][-1]] == pytest.approx(wanted, rel=1e-8)
    kinetic = run["kinetic_energy"]
    assert run.energy["thrust"][-1] == pytest.approx(kinetic[-1] - kinetic[0], rel=1e-8)
    assert kinetic[-1] > 10.0 and abs(run.energy.sums["numerical"]) < 1e-7


def test_axes_of_a_body_are_those_that_a_function_of_its_angle_gives():
    """In time and state, by samples, single torques; and axes of the ground that are turned."""
    thrust = mbd.Samples([0.0, 1.0, 2.0], [1.0, 4.0, 2.0])

    def turned(t, angle):
        f = (0.3 * t, 2.0 + angle)
        return (f[0] * mbd.cos(angle) - f[1] * mbd.sin(angle), f[0] * mbd.sin(angle) + f[1] * mbd.cos(angle))

    names = ("t", "flight.angle")
    own = rocket(force=lambda t, angle: (0.3 * t, 2.0 + angle), torque=(0.0, 0.0, 0.4), arguments=names)
    other = rocket(force=turned, torque=0.4, arguments=names)
    other.forces[0] = replace(other.forces[0], axes=None)
    slope, level = rocket(force=(0.0, thrust)), rocket(force=(0.0, thrust))
    slope.forces[0] = replace(slope.forces[0], axes=slope.ground.origin.turned(0.5, (0.0, 0.0, 1.0)))
    sine, cosine = -math.sin(0.5), math.cos(0.5)
    parts = [mbd.Samples(thrust.time, np.multiply(thrust.values, part)) for part in (sine, cosine)]
    level.forces[0] = replace(level.forces[0], axes=None, force=tuple(parts))
    for a, b in (own, other), (slope, level):
        runs = [mbd.simulate(model, mbd.assemble(model), dt=0.02, until=1.0) for model in (a, b)]
        for name in "flight.x", "flight.y", "flight.angle":
            assert runs[0][name] == pytest.approx(runs[1][name], abs=1e-9)
        assert abs(runs[0]["flight.x"][-1]) > 1e-3


def test_amplitudes_in_body_axes_are_inputs_of_linearizations():
    model = rocket(force=(0.0, 30.0))
    state = mbd.assemble(model, position={"flight.angle": 0.3})
    linear = mbd.linearize(model, state, inputs=["thrust.force.x", "thrust.force.y"], outputs=["flight.angle"])
    along = {name: linear.B[k] for k, name in enumerate(linear.states)}
    assert along["flight.x.rate"] == pytest.approx(np.array([math.cos(0.3), -math.sin(0.3)]) / 3.0)
    assert along["flight.angle.rate"] == pytest.approx([0.5 / 0.6, 0.0])
    push = linear.A[linear.states.index("flight.x.rate"), linear.states.index("flight.angle")]
    assert push == pytest.approx(-30.0 * math.cos(0.3) / 3.0)  # the force follows the turn


def test_axes_are_those_of_a_body_that_has_some():
    ball = mbd.PointMass("ball", 1.0)
    with pytest.raises(mbd.ModelError, match="'ball' is a point mass, which has no axes"):
        mbd.Applied("push", SHIP.origin, force=(1.0, 0.0), axes=ball.origin)
    with pytest.raises(mbd.ModelError, match="axes of Applied 'push' must be a frame such as .*got 'body'"):
        mbd.Applied("push", SHIP.origin, force=(1.0, 0.0), axes="body")
    model = rocket(force=(1.0, 0.0))
    model.forces[0] = replace(model.forces[0], axes=TUG.origin)
    with pytest.raises(mbd.ModelError, match="'tug'"):
        require_valid(model)
