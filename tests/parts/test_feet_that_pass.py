"""Swing feet of straight legs that pass the ground: `only_while` of feet, and what a summary says of one that sinks."""

import pytest

import mbd
from mbd import parts


def rocker(only_while, slope=0.02):
    """A compass walker on round feet, whose feet touch the ground only ahead of the other one, or whenever."""
    model = mbd.Model("rocker", gravity=mbd.on_slope(slope))
    hip = mbd.PointMass("hip", mass=10.0)
    model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
    legs = {side: mbd.Link(f"{side} leg", mass=2.0, length=1.0, center=0.5, inertia=0.1) for side in ("left", "right")}
    for side, other in ("left", "right"), ("right", "left"):
        model.connect(mbd.Revolute(f"{side} hip", hip.origin, legs[side].start))
        ahead = mbd.measure(lambda this, that: this[0] - that[0], legs[side].end, legs[other].end, unit="m")
        parts.arc_foot(
            model, f"{side} foot", legs[side].point(0.0, -0.7, name="arc"), 0.3, release=f"{other} foot",
            only_while=ahead if only_while else None,
        )  # fmt: skip
    return model


BEGIN = {
    "closed": "left foot", "position": {"left hip.angle": 0.25, "right hip.angle": -0.25},
    "velocity": {"left hip.angle": -1.2, "right hip.angle": -0.5},
}  # fmt: skip


def test_a_straight_leg_swings_past_the_ground_only_where_its_foot_is_let_pass():
    passing, scuffing = (rocker(only_while) for only_while in (True, False))
    strikes = []
    for model in passing, scuffing:
        run = mbd.simulate(model, mbd.assemble(model, **BEGIN), dt=2e-3, until=0.8)
        strikes.append([event.time for event in run.events if event.kind == "closed"])
        if model is passing:
            assert run["right foot.gap"].min() < -1e-3  # it is below the ground as it passes
    assert not strikes[0] and strikes[1] and strikes[1][0] < 0.8


@pytest.mark.parametrize("kind", ["point_foot", "arc_foot", "heel_and_toe", "capsule_foot", "polygon_foot"])
def test_every_foot_takes_only_while(kind):
    model = mbd.Model("foot")
    body = mbd.RigidBody("body", 1.0, 0.01)
    model.connect(mbd.Planar("base", model.ground.origin, body.origin))
    points = [body.point(-0.1, -0.1), body.point(0.1, -0.1)]
    places = {
        "point_foot": points[:1], "arc_foot": (points[0], 0.1), "heel_and_toe": points,
        "capsule_foot": (*points, 0.02), "polygon_foot": (points,),
    }  # fmt: skip
    ahead = mbd.measure(lambda x: x, "base.x", unit="m")
    getattr(parts, kind)(model, "foot", *places[kind], only_while=ahead)
    assert all(word.only_while is ahead for word in model.constraints) and model.check() == []


def test_a_walker_whose_ignored_foot_sinks_has_fallen():
    model = rocker(True, slope=0.0)
    start = mbd.assemble(model, **BEGIN)
    with pytest.warns(mbd.MbdWarning, match="pulled"):
        run = mbd.simulate(model, start, dt=2e-3, until=5.0)
    assert "below its surface" in run.summary() and "fell at" in run.summary()
