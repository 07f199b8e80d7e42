"""Poses to start from."""

import math
from collections.abc import Mapping, Sequence

from mbd.bodies.algebra import IDENTITY, ZERO, Rotation, Triple, difference, product, rotate, scaled, total, transpose
from mbd.bodies.base import Body
from mbd.bodies.values import Vector3
from mbd.errors import ModelError
from mbd.joints.base import Joint
from mbd.parts.whole_body.segments import SIDES

Position = float | tuple[float, ...]
"""A coordinate, or a quaternion as a whole."""


def standing(prefix: str, bodies: Mapping[str, Body], joints: Sequence[Joint], knees: float) -> dict[str, Position]:
    """Positions of joints: upright over level ground at y = 0, knees flexed, ankles under the hips, soles level.

    Of legs that differ the longer one reaches the ground; one whose knee is held stays straight.
    """
    made, reaches = {joint.name: joint for joint in joints}, []
    found: dict[str, Position] = {}
    for side, (a, b, down) in _legs(bodies).items():
        joints_of_leg = {name: made.get(f"{prefix}{side} {name}") for name in ("hip", "knee", "ankle")}
        knee = joints_of_leg["knee"]
        bend = 0.0 if knee is not None and not knee.labels else knees  # one that is held stays straight
        hip = math.atan2(b * math.sin(bend), a + b * math.cos(bend))
        reaches.append(a * math.cos(hip) + b * math.cos(bend - hip) + down)
        for name, angle in {"hip": hip, "knee": -bend, "ankle": bend - hip}.items():
            joint = joints_of_leg[name]
            if joint is not None and bend != 0.0:
                found |= _bent(joint, angle)
    height: dict[str, Position] = {f"{prefix}trunk.y": max(reaches, default=0.0)} if f"{prefix}trunk" in made else {}
    return {**height, **found}


def hips_over_ground(bodies: Mapping[str, Body]) -> float:
    """Height of the hips of who stands with straight legs; of legs that differ, of the longer one [m]."""
    return max((sum(lengths) for lengths in _legs(bodies).values()), default=0.0)


def _legs(bodies: Mapping[str, Body]) -> dict[str, tuple[float, ...]]:
    """Lengths of thigh and shank, and how far the sole is below the ankle, of each whole leg [m]."""
    found, parts = {}, (("thigh", "end"), ("shank", "end"), ("foot", "sole"))
    for side in SIDES:
        own = [bodies.get(f"{side} {name}") for name, _ in parts]
        if all(body is not None for body in own):
            found[side] = tuple(_reach(body, end) for body, (_, end) in zip(own, parts, strict=True))
    return found


def _bent(joint: Joint, angle: float) -> dict[str, Position]:
    """A turn about z."""
    if joint.orientation is not None:
        return {f"{joint.name}.orientation": (math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle))}
    x, y, z = getattr(joint, "axis", (0.0, 0.0, 0.0))
    if not joint.labels or x != 0.0 or y != 0.0:
        raise ModelError(
            f"standing with bent knees turns '{joint.name}' about z, which it does not allow; weld the knee of that "
            "leg too, or name the positions one by one"
        )
    return {joint.coordinate_names[0]: math.copysign(angle, angle * z)}


def _reach(body: Body | None, end: str) -> float:
    """How far down a point is; of a body without it, such as a blade in place of a foot, the lowest of its others."""
    assert body is not None
    points = body.frames | {frame.name: frame for frame in body.points.values()}
    if end in points:
        return -points[end].offset[1]
    down = max(-frame.offset[1] for name, frame in points.items() if name != "center")
    if down <= 0.0:
        raise ModelError(
            f"standing needs to know how far '{body.name}' reaches down; name the point, such as "
            f"body.point(0.0, -0.08, name={end!r})"
        )
    return down


def origins(root: str, bodies: Mapping[str, Body], joints: Sequence[Joint]) -> dict[str, tuple[Rotation, Triple]]:
    """How the axes of all bodies lie with every joint at zero, against those of the first: R, and p [m]."""
    found: dict[str, tuple[Rotation, Triple]] = {bodies[root].name: (IDENTITY, ZERO)}
    for joint in joints:
        if joint.parent.body.name in found:
            R, p = found[joint.parent.body.name]
            R = product(R, joint.parent.rotation or IDENTITY)
            R = product(R, transpose(joint.child.rotation or IDENTITY))
            out = rotate(found[joint.parent.body.name][0], joint.parent.offset)
            found[joint.child.body.name] = R, difference(total(p, out), rotate(R, joint.child.offset))
    return found


def place_of(point: Vector3, body: tuple[Rotation, Triple]) -> Triple:
    """Where a point of a body is, whose axes lie so [m]."""
    return total(body[1], rotate(body[0], point))


def center_of_mass(places: Mapping[str, tuple[Rotation, Triple]], bodies: Mapping[str, Body]) -> tuple[float, Vector3]:
    """Mass [kg] and center of mass [m] with every joint at zero."""
    masses = {name: body.fields()["mass"] for name, body in bodies.items()}
    mass = sum(masses.values())
    moments = [scaled(masses[name], place_of(body.center.offset, places[body.name])) for name, body in bodies.items()]
    x, y, z = (float(sum(parts)) / mass for parts in zip(*moments, strict=True))
    return mass, (x, y, z)
