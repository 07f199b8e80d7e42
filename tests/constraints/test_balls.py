"""Balls that strike, roll on and slip along balls: closed forms, and momentum of both."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

import mbd

MASSES, RADII = (1.0, 0.3), (0.1, 0.04)
WEIGHT = np.array([0.0, -9.81, 0.0])


def moment(k):
    return 0.4 * MASSES[k] * RADII[k] ** 2


def balls(friction, restitution=0.0, fixed=False, hollow=False, gravity=(0.0, -9.81, 0.0), spin_friction=0.0):
    """A small ball on a large one, which floats or is fixed."""
    model = mbd.Model("balls", gravity=gravity)
    small = mbd.RigidBody("small", MASSES[1], (moment(1),) * 3)
    model.connect(mbd.Free("fly", model.ground.origin, small.origin))
    center = model.ground.point(0.0, 0.0, 0.0, name="middle")
    if not fixed:
        large = mbd.RigidBody("large", MASSES[0], (moment(0),) * 3)
        model.connect(mbd.Free("float", model.ground.origin, large.origin))
        center = large.origin
    touch = mbd.sphere_touchdown(small.origin, RADII[1], mbd.Ball(center, RADII[0], hollow=hollow))
    law = {"friction": friction, "restitution": restitution, "spin_friction": spin_friction}
    model.constrain(mbd.Unilateral("touch", touch, **law))
    return model


@pytest.mark.parametrize("angle", [0.05, 0.3])
@pytest.mark.parametrize(
    ("scheme", "bound"), [(mbd.RungeKutta853(), 1e-9), (mbd.RadauIIA(), 1e-8), (mbd.HHT(0.05), 1e-4)]
)
def test_a_ball_that_rolls_down_a_fixed_one_leaves_it_at_ten_seventeenths(scheme, bound, angle):
    """Its height over the middle is then 10/17 of that from which it began, whatever the radii."""
    reach = RADII[0] + RADII[1]
    begin = {"fly.x": reach * np.sin(angle), "fly.y": reach * np.cos(angle)}
    model = balls(None, fixed=True)
    start = mbd.assemble(model, begin, closed="touch")
    run = mbd.simulate(model, start, scheme, dt=2e-3, until=0.7)
    (leaves,) = run.events
    assert leaves.kind == "opened"
    assert run["fly.y"][leaves.row] == pytest.approx(10.0 / 17.0 * reach * np.cos(angle), rel=bound)


@pytest.mark.parametrize("friction", [0.02, 0.3])
@pytest.mark.parametrize("impact", ["newton", "poisson"])
def test_a_cut_shot_throws_the_other_ball_as_far_as_friction_can(friction, impact):
    """Tangential impulse: μ times the normal one, or 2/7 of what would stop the slip of points, where that is less."""
    model = balls(friction, restitution=0.9, gravity=(0.0, 0.0, 0.0))
    way = np.array([0.8, 0.3, 0.52])
    way /= np.linalg.norm(way)
    across = np.cross(way, [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    reach = sum(RADII)
    place = dict(zip(("fly.x", "fly.y", "fly.z"), -(reach + 0.02) * way, strict=True))
    speed = dict(zip(("fly.x", "fly.y", "fly.z"), 2.0 * way, strict=True))
    spin = 12.0 * np.cross(way, across)  # turns its surface along `across` where it touches
    start = mbd.assemble(model, place, {**speed, "fly.angular_velocity": tuple(spin)})
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=2e-3, until=0.02, impact=impact)
    (blow, *_) = run.events
    mass = 1.0 / (1.0 / MASSES[0] + 1.0 / MASSES[1])
    push = mass * (1.0 + 0.9) * 2.0
    slip = RADII[1] * np.cross(spin, way)
    drag = min(friction * push, mass * np.linalg.norm(slip) * 2.0 / 7.0)
    assert blow.impulse[0] == pytest.approx(push, rel=1e-12)
    assert np.hypot(*blow.impulse[1:]) == pytest.approx(drag, rel=1e-11)
    after = np.array([run[f"float.{axis}.rate"][-1] for axis in "xyz"])
    np.testing.assert_allclose(MASSES[0] * after, push * way + drag * slip / np.linalg.norm(slip), atol=1e-12)


@pytest.mark.parametrize("scheme", [mbd.RungeKutta853(), mbd.RadauIIA(), mbd.GeneralizedAlpha(0.9)], ids=repr)
@pytest.mark.parametrize("friction", [None, 0.2])
def test_only_weight_changes_the_momenta_of_balls_that_touch(friction, scheme):
    model = balls(friction, spin_friction=2e-3 if friction else 0.0)
    start = mbd.assemble(
        model,
        {"fly.y": sum(RADII), "fly.x": 0.02},
        {"float.y": 0.4, "float.angular_velocity": (3.0, 9.0, -4.0), "fly.angular_velocity": (-5.0, 2.0, 7.0)},
        closed="touch",
        project=friction is None,
    )
    run = mbd.simulate(model, start, scheme, dt=1e-3, until=0.15)
    bound = 1e-9 if scheme.order() > 2 else 1e-6
    momentum, turn, torque = 0.0, 0.0, 0.0
    for name, k in ("float", 0), ("fly", 1):
        place = np.stack([run[f"{name}.{axis}"] for axis in "xyz"], axis=1)
        rate = np.stack([run[f"{name}.{axis}.rate"] for axis in "xyz"], axis=1)
        momentum = momentum + MASSES[k] * rate
        turn = turn + MASSES[k] * np.cross(place, rate) + moment(k) * run[f"{name}.angular_velocity.ground"]
        torque = torque + MASSES[k] * np.cross(place, WEIGHT)
    fall = sum(MASSES) * run.time[:, None] * WEIGHT
    np.testing.assert_allclose(momentum - fall, np.broadcast_to(momentum[0], momentum.shape), atol=1e-9)
    given = cumulative_trapezoid(torque, run.time, axis=0, initial=0.0)
    np.testing.assert_allclose(turn - given, np.broadcast_to(turn[0], turn.shape), atol=2e-6)  # of the quadrature
    assert np.max(np.abs(run.energy.numerical)) < bound


def test_a_ball_in_a_hollow_one_rolls_as_a_pendulum_of_seven_fifths_its_length():
    model = balls(None, fixed=True, hollow=True)
    reach = RADII[0] - RADII[1]
    start = mbd.assemble(model, {"fly.x": reach * np.sin(0.6), "fly.y": -reach * np.cos(0.6)}, closed="touch")
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=2e-3, until=1.0)
    pendulum = mbd.Model("pendulum")
    bob = mbd.Link("rod", mass=1.0, length=1.4 * reach, center=1.4 * reach, inertia=0.0)
    pendulum.connect(mbd.Revolute("hinge", pendulum.ground.origin, bob.start))
    swing = mbd.simulate(
        pendulum, mbd.assemble(pendulum, {"hinge.angle": 0.6}), mbd.RungeKutta853(), dt=2e-3, until=1.0
    )
    angle = np.arctan2(run["fly.x"], -run["fly.y"])
    np.testing.assert_allclose(angle, swing["hinge.angle"], atol=1e-9)


def test_wrong_balls_are_named():
    model = mbd.Model("balls")
    body = mbd.RigidBody("body", 1.0, (1.0, 1.0, 1.0))
    model.connect(mbd.Free("fly", model.ground.origin, body.origin))
    with pytest.raises(mbd.ModelError, match="radius of a Ball must be positive"):
        mbd.Ball(body.origin, -0.1)
    with pytest.raises(mbd.ModelError, match=r"the ground is a mbd\.Ball, a mbd\.Plane"):
        mbd.sphere_touchdown(body.origin, 0.1, "table")
    model.constrain(
        mbd.Unilateral("self", mbd.sphere_touchdown(body.point(0.1, 0.0, 0.0), 0.1, mbd.Ball(body.origin, 0.2)))
    )
    tight = mbd.Ball(model.ground.origin, 0.05, hollow=True)
    model.constrain(mbd.Unilateral("tight", mbd.sphere_touchdown(body.origin, 0.1, tight)))
    found = "\n".join(map(str, model.check()))
    assert "both on 'body'" in found
    assert "does not fit into a hollow one" in found
