"""Where a foot meets the ground."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from mbd.bodies.algebra import basis, cross, derivatives_at, difference, dot, scaled
from mbd.bodies.base import Frame
from mbd.bodies.values import Vector3, number, unit_vector
from mbd.constraints.base import Measure
from mbd.errors import ModelError
from mbd.forces.base import frame_of
from mbd.forces.quantities import Mention
from mbd.scope import Scope, Triple
from mbd.tape.functions import sqrt
from mbd.tape.node import Node, Scalar
from mbd.tape.tracing import traced_scalar

__all__ = ["Plane", "Touchdown", "touchdown"]


@dataclass(frozen=True)
class Plane:
    """A plane ``n · p = offset`` with the open side along n.

    Parameters
    ----------
    normal : n in ground axes, of any length; y by default
    offset : distance of the plane from the ground's origin along n [m]
    """

    normal: Vector3 = (0.0, 1.0, 0.0)
    offset: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "normal", unit_vector(self.normal, "normal of a Plane"))
        object.__setattr__(self, "offset", number(self.offset, "offset of a Plane"))

    def gap(self, p: Triple, scope: Scope) -> Scalar:
        """n · p − offset."""
        return dot(self.normal, p) - self.offset

    def directions(self, p: Triple, scope: Scope) -> tuple[Triple, Triple]:
        """Forward and sideways; x and z on level ground."""
        n = self.normal
        if abs(n[2]) > 0.999:
            return basis(n)
        flat = (1.0 - n[2] * n[2]) ** 0.5
        sideways = (-n[2] * n[0] / flat, -n[2] * n[1] / flat, flat)
        return cross(n, sideways), sideways


@dataclass(frozen=True)
class Surface:
    """A height function ``y = H(x)`` or ``y = H(x, z)``: a Python function, or a sympy expression of x and z.

    ``g = (y − H)/√(1 + H_x² + H_z²)``, which is the distance to first order.
    """

    function: Any

    @property
    def is_profile(self) -> bool:
        """Whether it is the same for every z."""
        if hasattr(self.function, "free_symbols"):
            return "z" not in {str(symbol) for symbol in self.function.free_symbols}
        return len(inspect.signature(self.function).parameters) == 1

    def slopes(self, p: Triple, scope: Scope) -> tuple[Scalar, Scalar, Scalar]:
        """H, ∂H/∂x, ∂H/∂z."""
        names = "x" if self.is_profile else "xz"

        def height(*places: Scalar) -> Scalar:
            return traced_scalar(
                self.function, list(zip(names, places, strict=True)), "height of the ground", scope.tape
            )

        value, slopes = derivatives_at(height, [p[0]] if self.is_profile else [p[0], p[2]], scope.tape)
        return value, slopes[0], 0.0 if self.is_profile else slopes[1]

    def gap(self, p: Triple, scope: Scope) -> Scalar:
        """(y − H)/√(1 + H_x² + H_z²)."""
        H, along, across = self.slopes(p, scope)
        scale: Scalar = sqrt(1.0 + along * along + across * across)
        return (p[1] - H) / scale

    def directions(self, p: Triple, scope: Scope) -> tuple[Triple, Triple]:
        """Forward (1, H_x, 0) and sideways, across it and the normal."""
        _, along, across = self.slopes(p, scope)
        forward = scaled(1.0 / sqrt(1.0 + along * along), (1.0, along, 0.0))
        normal = scaled(1.0 / sqrt(1.0 + along * along + across * across), (-along, 1.0, -across))
        return forward, cross(forward, normal)


@dataclass(frozen=True)
class Touchdown(Measure):
    """Height of a point over the ground, and the two directions in which it sticks there.

    ``g`` of the ground, anchors = the place of touchdown p̂, tangent rows ``t_a(p̂) · (p − p̂) = 0``.
    """

    point: Frame
    ground: Plane | Surface = Plane()

    def gap(self, scope: Scope) -> Scalar:
        """Height over the ground."""
        return self.ground.gap(scope.frame(self.point).position, scope)

    @property
    def unit(self) -> str:
        """'m'."""
        return "m"

    def mentions(self) -> list[Mention]:
        """Its point."""
        return [self.point]

    @property
    def has_tangents(self) -> bool:
        """True."""
        return True

    def captured(self, scope: Scope) -> Sequence[Scalar]:
        """The place of touchdown, those components that can change (in a planar model z cannot)."""
        p = scope.frame(self.point).position
        return [p[k] for k in _moving(p)]

    def tangents(self, scope: Scope, anchors: Sequence[Scalar]) -> Sequence[tuple[str, Scalar]]:
        """Forward and sideways, without the one in which the point cannot move."""
        p = scope.frame(self.point).position
        anchor = list(p)
        for k, value in zip(_moving(p), anchors, strict=True):
            anchor[k] = value
        place: Triple = (anchor[0], anchor[1], anchor[2])
        slip = difference(p, place)
        directions = self.ground.directions(place, scope)
        rows = [(part, dot(t, slip)) for part, t in zip(("forward", "sideways"), directions, strict=True)]
        return [(part, row) for part, row in rows if not _is_constant(row)]


def touchdown(point: Frame, ground: Any = None) -> Touchdown:
    """Height of a foot over the ground; the foot can stick where it comes down.

    Parameters
    ----------
    point : the foot, such as shank.end
    ground : None for y = 0, a `Plane`, or the ground's height y = H(x) or H(x, z) as a function or sympy expression
    """
    frame_of(point, "touchdown: its point")
    if ground is None:
        return Touchdown(point)
    if isinstance(ground, Plane | Surface):
        return Touchdown(point, ground)
    if callable(ground) or hasattr(ground, "free_symbols"):
        return Touchdown(point, Surface(ground))
    raise ModelError(f"touchdown: the ground is a Plane or a height function y = H(x), got {ground!r}")


def _is_constant(value: Scalar) -> bool:
    return not isinstance(value, Node) or value.is_constant


def _moving(p: Triple) -> list[int]:
    return [k for k in range(3) if not _is_constant(p[k])]
