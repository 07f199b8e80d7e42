"""Directions of bodies in the plane as sums of coordinates, which count turns where a rotation cannot.

A rotation matrix gives the angle between two bodies modulo a turn only. In a planar mechanism every body has a
heading φ, the sum of the angles on its way from the ground, and the angle of a cut joint is the difference of two.
"""

import math
from typing import NamedTuple

from mbd.bodies.algebra import IDENTITY
from mbd.bodies.base import Frame
from mbd.bodies.scope import Scope
from mbd.equations.kinematics import Moving
from mbd.equations.placement import Heading
from mbd.joints.base import Joint
from mbd.joints.reversed import Reversed
from mbd.tape.node import Node, Scalar


class Spin(NamedTuple):
    """How a planar joint turns its child: by ``offset + Σ slope · coordinate`` [rad]."""

    slopes: tuple[float, ...]
    offset: float


def direction(frame: Frame) -> float:
    """The angle of a frame's x axis in its body [rad], between −π and π."""
    R = IDENTITY if frame.rotation is None else frame.rotation
    return math.atan2(R[1][0], R[0][0])


def spin(joint: Joint, scope: Scope) -> Spin | None:
    """The spin of a joint whose angles enter with plain numbers; None for any other."""
    if isinstance(joint, Reversed):
        inner = spin(joint.joint, scope)
        return None if inner is None else Spin(tuple(-slope for slope in inner.slopes), -inner.offset)
    if not joint.is_vector:
        return None
    size = len(joint.labels)
    columns = joint.subspace([scope.tape.input("virtual", k) for k in range(size)], scope)
    slopes = [_number(angular[2]) for angular, _ in columns]
    R, _ = joint.transform([0.0] * size, scope)
    cosine, sine = _number(R[0][0]), _number(R[1][0])
    if cosine is None or sine is None or None in slopes:
        return None
    return Spin(tuple(slope for slope in slopes if slope is not None), math.atan2(sine, cosine))


def _number(value: Scalar) -> float | None:
    """A plain number, None for anything that varies."""
    if isinstance(value, Node):
        return value.data if value.op == "const" else None
    return float(value)


class Headings:
    """The headings of the bodies of a planar tree, made where something asks."""

    def __init__(self, scope: Scope) -> None:
        self._scope = scope
        self._known: dict[Moving, Heading | None] = {}

    def of(self, body: Moving) -> Heading | None:
        """Its heading; None behind a joint that turns by more than sums of its coordinates."""
        if body not in self._known:
            self._known[body] = self._made(body)
        return self._known[body]

    def _made(self, body: Moving) -> Heading | None:
        if body.parent is None or body.edge is None:
            return Heading(body, 0.0)
        joint, before = body.edge.joint, self.of(body.parent)
        turns = spin(joint, self._scope)
        if before is None or turns is None:
            return None
        angle = before.angle + (direction(joint.parent) + turns.offset - direction(joint.child))
        for slope, value in zip(turns.slopes, body.edge.values, strict=True):
            angle = angle + slope * value
        return Heading(body, angle)
