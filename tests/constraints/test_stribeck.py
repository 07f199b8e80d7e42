"""Friction that falls as sliding sets in: a block that sticks and slips on a belt, a puck, a hinge."""

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


def test_a_hinge_comes_to_rest_where_the_larger_friction_holds_it():
    model = mbd.Model("hinge", gravity=(0.0, -G, 0.0))
    bar = mbd.Link("bar", mass=1.0, length=1.0, center=0.5, inertia=0.1)
    model.connect(mbd.Revolute("hinge", model.ground.origin, bar.start, loss=mbd.Stribeck(1.0, 0.5, 0.2)))
    start = mbd.assemble(model, {"hinge.angle": 0.0}, {"hinge.angle": 3.0})
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=5e-3, until=6.0)
    assert run.events[-1].kind == "stuck"
    assert abs(run["hinge.friction"][-1]) <= 1.0 + 1e-9
    assert abs(run.energy.numerical[-1]) < 1e-6


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


def test_an_impact_with_the_static_size_says_so():
    model = mbd.Model("thrown")
    ball = mbd.PointMass("ball", mass=1.0)
    model.connect(mbd.Translation("place", model.ground.origin, ball.origin))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(ball.origin), friction=mbd.Stribeck(0.6, 0.3, 0.1)))
    start = mbd.assemble(model, position={"place.y": 0.1}, velocity={"place.x": 2.0})
    run = mbd.simulate(model, start, dt=1e-3, until=0.2)
    normal, forward = run.events[0].impulse
    assert forward == pytest.approx(-0.6 * normal)
    assert [note for note in run.stats["notes"] if note.startswith("impacts of 'foot' had the static size")]
