"""Feet in space that are capsules and polygons, and bodies that touch bodies: balls, planes and faces that move."""

from functools import lru_cache

import numpy as np
import pytest

import mbd
from mbd import parts
from tests.helpers import one_body

RADAU = mbd.RadauIIA()


@lru_cache(maxsize=4)
def capsule(friction=0.4, restitution=0.0):
    model, body = one_body(mbd.RigidBody("body", 2.0, (0.004, 0.01, 0.01)), mbd.Free, "float", title="capsule")
    ends = body.point(-0.1, 0.0, 0.0), body.point(0.1, 0.0, 0.0)
    parts.capsule_foot(model, "foot", *ends, 0.03, friction=friction, restitution=restitution)
    return model


def test_a_level_capsule_lies_on_both_ends_and_rolls_like_a_cylinder():
    model = capsule()
    speed = {"float.z.rate": 0.3, "float.angular_velocity.x": 10.0}
    start = mbd.assemble(
        model, position={"float.y": 0.03}, velocity=speed, closed=["foot end 1", "foot end 2"], project=False
    )
    run = mbd.simulate(model, start, RADAU, dt=2e-3, until=0.2)
    assert run["foot end 1.force"] == pytest.approx(np.full(len(run.time), 9.81), rel=1e-9)
    assert run["foot end 2.force"] == pytest.approx(np.full(len(run.time), 9.81), rel=1e-9)
    free = 0.3 - 0.0  # slip v_z − ω_x r = 0: it rolls from the start
    assert run["float.z"][-1] == pytest.approx(0.2 * free, abs=1e-9)
    assert run["float.angular_velocity.x"][-1] == pytest.approx(10.0, abs=1e-9)


def test_a_tilted_capsule_strikes_with_its_lower_end_and_never_sinks():
    model = capsule(0.3, 0.4)
    place = {"float.y": 0.12, "float.orientation": ((0.0, 0.2, 1.0), 0.3)}
    start = mbd.assemble(model, position=place, velocity={"float.x": 0.5, "float.angular_velocity": (1.0, 2.0, -1.0)})
    run = mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-3, until=0.5)
    first = run.events[0]
    at = run.at(first.time)
    ends = [0.1 * run.at(first.time)[f"foot end {k}.gap"] for k in (1, 2)]
    assert first.name == f"foot end {1 + int(np.argmin(ends))}"
    assert at[f"{first.name}.gap"] == pytest.approx(0.0, abs=1e-10)
    for k in (1, 2):
        assert np.min(run[f"foot end {k}.gap"]) > -1e-9
    total = run.energy["total"]
    assert np.max(np.diff(total)) < 1e-8


@lru_cache(maxsize=4)
def box(friction, restitution=0.0):
    model, body = one_body(mbd.RigidBody("body", 2.0, (0.02, 0.03, 0.02)), mbd.Free, "float", title="box")
    corners = [body.point(x, -0.05, z) for x in (-0.1, 0.1) for z in (-0.08, 0.08)]
    parts.polygon_foot(model, "sole", corners, friction=friction, restitution=restitution)
    return model


def test_a_polygon_slides_flat_as_one_body_and_stops():
    model = box(0.3)
    names = [f"sole corner {k}" for k in range(1, 5)]
    start = mbd.assemble(model, position={"float.y": 0.05}, velocity={"float.x": 0.6, "float.z": 0.8}, closed=names)
    run = mbd.simulate(model, start, RADAU, dt=5e-3, until=0.5)
    stop = 1.0 / (0.3 * 9.81)
    stuck = [event for event in run.events if event.kind == "stuck"]
    assert stuck
    assert all(event.time == pytest.approx(stop, abs=1e-9) for event in stuck)
    way = 0.5 * stop
    assert (run["float.x"][-1], run["float.z"][-1]) == pytest.approx((0.6 * way, 0.8 * way), abs=1e-9)
    assert sum(run[f"{name}.force"][0] for name in names) == pytest.approx(2.0 * 9.81, rel=1e-12)


def test_a_polygon_lands_on_a_corner_and_tips():
    model = box(0.5)
    place = {"float.y": 0.15, "float.orientation": ((1.0, 0.0, 0.6), 0.2)}
    run = mbd.simulate(model, mbd.assemble(model, position=place), RADAU, dt=2e-3, until=0.25)
    assert run.events[0].kind == "closed"
    for k in range(1, 5):
        assert np.min(run[f"sole corner {k}.gap"]) > -1e-9
    assert np.max(np.diff(run.energy["total"])) < 1e-7


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda m, a, b: parts.polygon_foot(m, "foot", [a.origin]), "two at least, got 1"),
        (lambda m, a, b: parts.polygon_foot(m, "foot", a.origin), "points of a body"),
        (lambda m, a, b: parts.polygon_foot(m, "foot", [a.origin, b.origin]), "points of one body, got those of a, b"),
        (lambda m, a, b: parts.polygon_foot(m, "foot", [a.origin, a.origin]), "a corner twice"),
        (lambda m, a, b: parts.capsule_foot(m, "foot", a.origin, b.origin, 0.1), "two points of one body"),
        (lambda m, a, b: parts.capsule_foot(m, "foot", a.origin, a.center, -0.1), "must be positive"),
    ],
)
def test_what_is_no_foot_is_refused_by_name(make, said):
    model = mbd.Model("wrong")
    with pytest.raises(mbd.ModelError, match=said):
        make(model, mbd.RigidBody("a", 1.0, 1.0, center=(0.1, 0.0)), mbd.RigidBody("b", 1.0, 1.0))


def test_two_balls_collide_along_their_line_of_centers():
    """Frictionless: distance less radii as a measure; equal masses exchange the part along the line."""
    model = mbd.Model("balls", gravity=(0.0, 0.0, 0.0))
    one, two = mbd.PointMass("one", 1.0), mbd.PointMass("two", 1.0)
    for ball in (one, two):
        model.connect(mbd.Translation(f"{ball.name} at", model.ground.origin, ball.origin, axes="xyz"))

    def apart(p, q):
        square = sum((a - b) * (a - b) for a, b in zip(p, q, strict=True))
        return mbd.sqrt(square) - 0.2

    model.constrain(mbd.Unilateral("clack", mbd.measure(apart, one.origin, two.origin), restitution=0.9))
    start = mbd.assemble(
        model, position={"two at.x": 0.5, "two at.y": 0.1, "two at.z": -0.05}, velocity={"one at.x": 2.0}
    )
    run = mbd.simulate(model, start, RADAU, dt=5e-3, until=0.4)
    assert [event.kind for event in run.events] == ["closed"]
    along = np.array([np.sqrt(0.04 - 0.01 - 0.0025), 0.1, -0.05]) / 0.2
    after = 2.0 * along[0] * 0.5 * (1.0 + 0.9) * along
    assert [run[f"two at.{a}.rate"][-1] for a in "xyz"] == pytest.approx(after, abs=1e-9)
    assert [run[f"one at.{a}.rate"][-1] for a in "xyz"] == pytest.approx([2.0, 0.0, 0.0] - after, abs=1e-9)


@pytest.mark.parametrize("kind", ["point", "ball"])
def test_what_slides_on_a_face_of_a_body_pushes_it_back(kind):
    """A point, or a ball, on the top of a free slab: momentum stays, friction ends the slip, as for two masses."""
    model = mbd.Model("slab", gravity=(0.0, -9.81, 0.0))
    slab = mbd.RigidBody("slab", 3.0, (1.0, 1.0, 1.0))
    model.connect(mbd.Translation("ice", model.ground.origin, slab.origin, axes="xz"))
    rider = mbd.RigidBody("rider", 1.0, (4e-3, 4e-3, 4e-3))
    model.connect(mbd.Free("float", model.ground.origin, rider.origin))
    face = mbd.Plane(offset=0.1, frame=slab.origin)
    if kind == "ball":
        gap = mbd.sphere_touchdown(rider.origin, 0.1, face)
        model.constrain(mbd.Unilateral("grip", gap, friction=0.2))
    else:
        foot = mbd.touchdown(rider.point(0.0, -0.1, 0.0), face)
        model.constrain(mbd.Unilateral("grip", foot, friction=0.2))
        model.constrain(
            *(mbd.Bilateral(f"no {a}", mbd.measure(f"float.rotation_vector.{a}", unit="rad")) for a in "xyz")
        )
    speed = {"float.x.rate": 1.0, "float.z.rate": -0.5}
    start = mbd.assemble(model, position={"float.y": 0.2}, velocity=speed, closed="grip")
    run = mbd.simulate(model, start, RADAU, dt=5e-3, until=0.6)
    for a, whole in (("x", 1.0), ("z", -0.5)):
        momentum = 3.0 * run[f"ice.{a}.rate"] + run[f"float.{a}.rate"]
        assert np.max(np.abs(momentum - whole)) < 1e-10
    eases = 1.0 + 1.0 / 3.0 + (0.01 / 4e-3 if kind == "ball" else 0.0)  # of slip to a force at the point
    stop = np.hypot(1.0, 0.5) / (0.2 * 9.81 * eases)
    assert [event.kind for event in run.events] == ["stuck"]
    assert run.events[0].time == pytest.approx(stop, abs=1e-9)
