"""Poses to start from."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from mbd.bodies.base import Body
from mbd.bodies.values import Vector3
from mbd.errors import ModelError
from mbd.joints.base import Joint
from mbd.parts.whole_body.segments import SIDES

__all__ = ["Position", "center_of_mass", "hips_over_ground", "origins", "standing"]

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
            found[side] = tuple(_length(body, end) for body, (_, end) in zip(own, parts, strict=True))
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


def _length(body: Body | None, end: str) -> float:
    """How far down a point is."""
    assert body is not None
    points = {frame.name: frame for frame in body.points.values()} | body.frames
    return -points[end].offset[1] if end in points else 0.0


def origins(root: str, bodies: Mapping[str, Body], joints: Sequence[Joint]) -> dict[str, Vector3]:
    """Where the axes of all bodies lie with every joint at zero, against those of the first [m]."""
    found = {bodies[root].name: (0.0, 0.0, 0.0)}
    for joint in joints:
        parent = found.get(joint.parent.body.name)
        if parent is not None:
            out, back = joint.parent.offset, joint.child.offset
            x, y, z = (p + a - b for p, a, b in zip(parent, out, back, strict=True))
            found[joint.child.body.name] = (x, y, z)
    return found


def center_of_mass(places: Mapping[str, Vector3], bodies: Mapping[str, Body]) -> tuple[float, Vector3]:
    """Mass [kg] and center of mass [m] with every joint at zero."""
    mass, moment = 0.0, [0.0, 0.0, 0.0]
    for body in bodies.values():
        m, place, center = body.fields()["mass"], places[body.name], body.center.offset
        mass += m
        moment = [total + m * (p + c) for total, p, c in zip(moment, place, center, strict=True)]
    x, y, z = (part / mass for part in moment)
    return mass, (x, y, z)
