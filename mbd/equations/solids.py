"""What pictures of spatial mechanisms show of bodies and joints: how bodies are turned, where hinges lie.

A planar mechanism has none of it. The results are not listed, and traced when a picture asks for them.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from functools import partial

from mbd.bodies.algebra import dot, rotate
from mbd.bodies.base import Body, Frame
from mbd.bodies.ground import Ground
from mbd.bodies.link import Link
from mbd.bodies.mass import inertia_matrix
from mbd.bodies.scope import Scope, Triple
from mbd.bodies.values import Vector3
from mbd.constraints.disks import DiskTouchdown
from mbd.constraints.rolling import Rolling
from mbd.constraints.sphere_touchdown import SphereTouchdown
from mbd.constraints.turning_measures import Cone
from mbd.equations.outputs import AXES, Outputs
from mbd.equations.shapes import Shape, drawn
from mbd.joints.base import Joint
from mbd.topology.description import Description

LIKE = (0.5, 1.3)
"""Radius of the uniform ball of a body's mean moment of inertia, over that with which it touches, if it is a ball: from
one whose mass lies deep inside to a shell, √(5/3) [-].
"""


def solids_of(model: Description) -> tuple[Shape, ...]:
    """Bodies with moments of inertia about all axes, links among them, and the axes about which joints turn."""
    forms = _forms_by_contacts(model)
    bodies = [
        Shape("limb" if isinstance(body, Link) else "solid", body.name, place=body.center.full_name,
              numbers=(mass, *moments), form=getattr(body, "form", "") or forms.get(body.name, ""))
        for body, mass, moments in _solids(model)
    ]  # fmt: skip
    hinges = (Shape("hinge", name, place=frame.full_name) for name, frame, _ in _hinges(model.joints))
    stops = (
        Shape("cone", name, place=cone.joint.parent.full_name, numbers=(cone.limit,)) for name, cone in _cones(model)
    )
    return (*bodies, *hinges, *stops)


def offer_solids(outputs: Outputs, scope: Scope, model: Description) -> None:
    """The first and second axis of each body, the axis of each hinge, in ground axes."""

    def direction(frame: Frame, axis: Vector3) -> Triple:
        return rotate(scope.frame(frame).rotation, axis)

    for body in (each for each, _, _ in _solids(model) if not isinstance(each, Link)):
        for what, axis in (("first", (1.0, 0.0, 0.0)), ("second", (0.0, 1.0, 0.0))):
            outputs.triple(drawn(body.name, what), partial(direction, body.origin, axis), AXES, listed=False)
    for name, frame, axis in _hinges(model.joints):
        outputs.triple(drawn(name, "axis"), partial(direction, frame, axis), AXES, listed=False)
    for name, cone in _cones(model):
        outputs.triple(drawn(name, "axis"), partial(direction, cone.joint.parent, _middle(cone)), AXES, listed=False)


def _cones(model: Description) -> list[tuple[str, Cone]]:
    """Name and measure of every stop that is a cone of directions."""
    words = ((word, getattr(word, "measure", None)) for word in model.constraints)
    return [(word.name, measure) for word, measure in words if isinstance(measure, Cone)]


def _middle(cone: Cone) -> Vector3:
    """The middle of a cone in the parent's frame, on the side on which the child has its center, if any."""
    child = cone.joint.child
    (cx, cy, cz), (ox, oy, oz) = child.body.frames.get("center", child).offset, child.offset
    axis = rotate(child.rotation, cone.axis) if child.rotation is not None else cone.axis
    along = dot(axis, (cx - ox, cy - oy, cz - oz))
    x, y, z = cone.direction
    return (-x, -y, -z) if isinstance(along, float) and along < 0.0 else (x, y, z)


def _solids(model: Description) -> Iterable[tuple[Body, float, tuple[float, ...]]]:
    """Body, mass and (Ixx, Iyy, Izz, Ixy, Ixz, Iyz) about its center."""
    for body in model.bodies.values():
        fields, inertia = body.fields(), getattr(body, "inertia", 0.0)
        if isinstance(body, Ground) or isinstance(inertia, float):
            continue
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia_matrix(inertia, fields.__getitem__)
        yield body, fields["mass"], tuple(float(moment) for moment in (xx, yy, zz, xy, xz, yz))


def _forms_by_contacts(model: Description) -> dict[str, str]:
    """'ball' and 'cylinder' of the bodies whose center touches a ground as a ball or a disk does, or rolls.

    So is a ball whose center of mass lies anywhere in it, as that of a tippe-top, if it has the inertia of a ball of
    `LIKE` its radius, and touches as no other.
    """
    found = {}
    masses = {body.name: (mass, moments) for body, mass, moments in _solids(model)}
    balls = Counter(center.body.name for center in {each.center for each in _balls(model)})
    for each in _balls(model):
        (mass, moments), body = masses.get(each.center.body.name, (0.0, ())), each.center.body
        away = math.dist(each.center.offset, body.center.offset)
        if mass > 0.0 and balls[body.name] == 1 and away < each.radius:
            size = math.sqrt(max(5.0 * sum(moments[:3]) / 6.0 / mass, 0.0)) / each.radius
            if LIKE[0] <= size <= LIKE[1]:
                found[body.name] = "ball"
    for word in model.constraints:
        holder = getattr(word, "measure", None) if not isinstance(word, Rolling) else word
        if isinstance(holder, SphereTouchdown | DiskTouchdown | Rolling):
            body = holder.center.body
            if holder.center.offset == body.center.offset:
                is_ball = isinstance(holder, SphereTouchdown) or (isinstance(holder, Rolling) and holder.ball)
                found[body.name] = "ball" if is_ball else "cylinder"
    return found


def _balls(model: Description) -> list[SphereTouchdown]:
    """How balls touch."""
    measures = (getattr(word, "measure", None) for word in model.constraints)
    return [each for each in measures if isinstance(each, SphereTouchdown)]


def _hinges(joints: Iterable[Joint]) -> Iterable[tuple[str, Frame, Vector3]]:
    """Name, frame and direction in it of every axis about which a joint turns; of a cross joint both."""
    for joint in joints:
        axis, second = getattr(joint, "axis", None), getattr(joint, "second_axis", None)
        if axis is not None and any(label.unit == "rad" for label in joint.labels):
            yield (joint.name if second is None else f"{joint.name}.first"), joint.parent, axis
        if second is not None:
            yield f"{joint.name}.second", joint.child, second
