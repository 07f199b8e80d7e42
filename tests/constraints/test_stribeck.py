"""Friction that falls as sliding sets in: blocks on belts, pucks, impacts, and non-smooth steps."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mbd
from mbd.joints.losses import LossSum

FRICTION = mbd.Stribeck(0.6, 0.4, 0.05)
G, BELT, STIFFNESS = 9.81, 0.1, 20.0


def coefficient(speed):
    return 0.4 + 0.2 * math.exp(-((speed / 0.05) ** 2))


def fallen(slope, start, until, stops):
    """A motion by hand, to the instant at which it stops."""
    stops.terminal = True
    found = solve_ivp(slope, (0.0, until), start, method="DOP853", rtol=1e-12, atol=1e-14, events=stops)
    return found.t_events[0][0], found.y_events[0][0]


@pytest.mark.parametrize(
    ("scheme", "allowed"), [(mbd.RungeKutta853(), 1e-7), (mbd.RadauIIA(), 1e-7), (mbd.HHT(), 1e-4)]
)
def test_a_block_on_a_belt_sticks_and_slips(scheme, allowed):
    model = mbd.Model("belt", gravity=(0.0, -G, 0.0))
    block = mbd.PointMass("block", 1.0)
    model.connect(mbd.Translation("p", model.ground.origin, block.origin))
    foot = mbd.touchdown(block.origin, mbd.Plane(velocity=(BELT, 0.0, 0.0)))
    model.constrain(mbd.Unilateral("foot", foot, friction=FRICTION))
    model.apply(mbd.Spring("spring", model.ground.point(-1.0, 0.0), block.origin, STIFFNESS, length=1.0))
    start = mbd.assemble(model, {"p.x": 0.0, "p.y": 0.0}, {"p.x": BELT}, closed="foot")
    run = mbd.simulate(model, start, scheme, dt=2e-3, until=4.5)
    breaks = 0.6 * G / STIFFNESS
    duration, _ = fallen(
        lambda t, y: [y[1], -STIFFNESS * y[0] + coefficient(y[1] - BELT) * G], [breaks, BELT], 2.0,
        lambda t, y: y[1] - BELT if t > 0.1 else -1.0,
    )  # fmt: skip
    assert [event.kind for event in run.events] == ["slipped", "stuck"]
    np.testing.assert_allclose(run.events[0].time, breaks / BELT, atol=1e-9)
    np.testing.assert_allclose(run.events[1].time - run.events[0].time, duration, atol=allowed)


@pytest.mark.parametrize("turn", [0.0, 0.7, 2.1])
def test_a_puck_slides_straight_on_whatever_its_direction(turn):
    model = mbd.Model("puck", gravity=(0.0, -G, 0.0))
    puck = mbd.RigidBody("puck", 0.5, (0.1, 0.1, 0.1))
    model.connect(mbd.Translation("p", model.ground.origin, puck.origin, axes="xyz"))
    model.constrain(mbd.Unilateral("sole", mbd.touchdown(puck.origin), friction=FRICTION + mbd.Viscous(0.1)))
    way = np.array([math.cos(turn), 0.0, math.sin(turn)])
    velocity = dict(zip(("p.x", "p.y", "p.z"), (1.0 * way).tolist(), strict=True))
    start = mbd.assemble(model, {"p.x": 0.0, "p.y": 0.0, "p.z": 0.0}, velocity, closed="sole")
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=2e-3, until=0.5)
    time, (distance, _) = fallen(
        lambda t, y: [y[1], -G * (coefficient(y[1]) + 0.1 * y[1])], [0.0, 1.0], 1.0, lambda t, y: y[1]
    )
    np.testing.assert_allclose(run.events[0].time, time, atol=1e-8)
    np.testing.assert_allclose(run.final.q, distance * way, atol=1e-9)


def test_a_scene_without_the_friction_has_nothing_of_it():
    model = mbd.Model("hinge")
    bar = mbd.Link("bar", mass=1.0, length=1.0, center=0.5, inertia=0.1)
    loss = mbd.Viscous(0.1) + mbd.Stribeck(1.0, 0.5, 0.2)
    hinge = mbd.Revolute("hinge", model.ground.origin, bar.start, loss=loss)
    assert hinge.frictions() == {"hinge friction": LossSum((mbd.Viscous(0.1),))}


def test_words_that_make_no_friction_are_refused():
    with pytest.raises(mbd.ModelError, match="speed over which friction falls"):
        mbd.Stribeck(0.6, 0.4, 0.0)
    model = mbd.Model("hinge")
    bar = mbd.Link("bar", mass=1.0, length=1.0, center=0.5, inertia=0.1)
    model.connect(mbd.Revolute("hinge", model.ground.origin, bar.start, loss=mbd.Stribeck(-1.0, 0.5, 0.2)))
    with pytest.raises(mbd.ModelError, match="static"):
        mbd.assemble(model, {"hinge.angle": 0.0})


def thrown(law, speed, space):
    """A ball that falls on the floor from 0.1 m, at this speed along it."""
    model = mbd.Model("thrown", gravity=(0.0, -9.81, 0.0))
    ball = mbd.PointMass("ball", mass=1.0)
    model.connect(mbd.Translation("place", model.ground.origin, ball.origin, axes="xyz" if space else "xy"))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(ball.origin), friction=law))
    velocity = {"place.x": -0.6 * speed, "place.z": 0.8 * speed} if space else {"place.x": -speed}
    return model, mbd.assemble(model, position={"place.y": 0.1}, velocity=velocity)


@pytest.mark.parametrize("space", [False, True], ids=["plane", "space"])
@pytest.mark.parametrize("speed", [0.05, 0.9, 1.0, 3.0])
def test_an_impact_has_the_size_of_the_slip_before_it(space, speed):
    """It sticks where μ(v) p ≥ m v, else it takes μ(v) p against the slip."""
    law = mbd.Stribeck(0.9, 0.6, 1.5)
    model, start = thrown(law, speed, space)
    run = mbd.simulate(model, start, dt=1e-3, until=0.145)
    push = np.sqrt(2.0 * 9.81 * 0.1)
    mu = 0.6 + 0.3 * np.exp(-((speed / 1.5) ** 2))
    impulse = run.events[0].impulse
    assert impulse[0] == pytest.approx(push, rel=1e-9)
    assert np.linalg.norm(impulse[1:]) == pytest.approx(min(mu * push, speed), rel=1e-9)
    against = impulse[1:] / np.linalg.norm(impulse[1:])
    assert against == pytest.approx([0.6, -0.8] if space else [1.0], abs=1e-9)


@pytest.mark.parametrize("space", [False, True], ids=["plane", "space"])
def test_derivatives_of_an_impact_follow_the_size_of_its_slip(space):
    law = mbd.Stribeck(0.8, 0.4, 1.5)
    ends = []
    for change in (-1e-4, 1e-4):
        model, start = thrown(law, 2.0, space)
        speeds = {"place.x": start["place.x.rate"] + change, **({"place.z": 1.6} if space else {})}
        start = mbd.assemble(model, position={"place.y": 0.1}, velocity=speeds)
        ends.append(mbd.simulate(model, start, mbd.RadauIIA(), dt=1e-3, until=0.16)["place.x"][-1])
    model, start = thrown(law, 2.0, space)
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=1e-3, until=0.16, wrt=["place.x.rate"])
    slope = (ends[1] - ends[0]) / 2e-4
    assert run.sensitivities["place.x", "place.x.rate"] == pytest.approx(slope, rel=1e-6)


@pytest.mark.parametrize("space", [False, True], ids=["plane", "space"])
def test_what_falls_and_slides_in_non_smooth_steps_has_the_size_of_its_slip(space):
    """The place where it stops is that of located events, but for O(dt)."""
    for law in mbd.Stribeck(0.8, 0.4, 0.5), mbd.Coulomb(0.4) + mbd.Viscous(0.1):
        model, start = thrown(law, 3.0, space)
        runs = [mbd.simulate(model, start, dt=1e-3, until=0.9, contact=how) for how in ("nonsmooth", "events")]
        way = [np.hypot(run["place.x"], run["place.z"] if space else 0.0)[-1] for run in runs]
        assert way[0] == pytest.approx(way[1], abs=5e-4)


@pytest.mark.parametrize(
    "law", [mbd.Stribeck(0.6, 0.3, 0.3), mbd.Coulomb(0.3) + mbd.Viscous(0.1), mbd.Viscous(0.2)], ids=str
)
def test_non_smooth_steps_come_to_the_motion_of_located_events_with_dt(law):
    """A box on four corners slides and turns until it stops: its place is off by O(dt), friction only takes energy."""
    model = mbd.Model("box", gravity=(0.0, -9.81, 0.0))
    body = mbd.RigidBody("body", 2.0, (0.02, 0.03, 0.02))
    model.connect(mbd.Free("float", model.ground.origin, body.origin))
    corners = [body.point(x, -0.05, z) for x in (-0.1, 0.1) for z in (-0.08, 0.08)]
    names = [contact.name for contact in mbd.parts.polygon_foot(model, "sole", corners, friction=law)]
    speed = {"float.x": 1.2, "float.z": 0.5, "float.angular_velocity.y": 2.0}
    start = mbd.assemble(model, position={"float.y": 0.05}, velocity=speed, closed=names)
    exact = mbd.simulate(model, start, mbd.RadauIIA(), dt=2e-3, until=0.5)
    for dt in (2e-3, 5e-4):
        run = mbd.simulate(model, start, mbd.HHT(0.05), dt=dt, until=0.5, contact="nonsmooth")
        for name in ("float.x", "float.z", "float.rotation_vector.y"):
            assert run[name][-1] == pytest.approx(exact[name][-1], abs=0.5 * dt)
        taken = sum(run.energy[f"{name} friction"][-1] for name in names)
        assert taken < 0.0 and run["float.y"][-1] == pytest.approx(0.05, abs=1e-9)
