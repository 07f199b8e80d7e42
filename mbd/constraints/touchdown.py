"""Where a foot meets the ground."""

from collections.abc import Sequence
from dataclasses import field
from typing import Any

from mbd.bodies.algebra import dot
from mbd.bodies.base import Frame
from mbd.bodies.scope import Scope, Triple
from mbd.constraints.measure import Measure
from mbd.constraints.surfaces import Plane, Surface, spin_about, surface_of
from mbd.dataclass import dataclass
from mbd.forces.base import frame_of
from mbd.forces.quantities import Mention
from mbd.tape.node import Node, Scalar


@dataclass(frozen=True)
class Touchdown(Measure):
    """Height of a point over the ground, and the two directions in which it sticks there.

    ``g`` of the ground, anchors = the place of touchdown p̂ on it, tangent rows ``t_a(p̂) · (p − p̂) = 0``. On ground
    that moves p̂ moves with it: g, the rows and their rates are those of the motion against the ground.
    """

    point: Frame
    ground: Plane | Surface = field(default_factory=Plane)

    unit = "m"
    has_tangents = True
    has_spin = True

    def gap(self, scope: Scope) -> Scalar:
        """Height over the ground."""
        return self.ground.gap(scope.frame(self.point).position, scope)

    @property
    def carrier(self) -> Frame | None:
        """The frame that carries the ground, if it is one of a body."""
        return self.ground.frame if isinstance(self.ground, Plane) else None

    def mentions(self) -> list[Mention]:
        """Its point, and the frame of the plane."""
        return [self.point] if self.carrier is None else [self.point, self.carrier]

    def faults(self, owner: str) -> list[str]:
        """A point of the body that carries the plane."""
        if self.carrier is None or self.point.body is not self.carrier.body:
            return []
        return [
            f"'{owner}': its point '{self.point.full_name}' and its plane are both on '{self.point.body.name}' and "
            "never move apart; give a point of another body, or the plane another frame"
        ]

    def spin(self, scope: Scope) -> Scalar:
        """n · (ω − ω_ground)."""
        p = scope.frame(self.point).position
        return spin_about(self.ground.normal_at(p, scope), self.point, self.carrier, scope)

    def captured(self, scope: Scope) -> Sequence[Scalar]:
        """The place of touchdown, those components that can change (in a planar model z cannot)."""
        place = self.ground.place(scope.frame(self.point).position, scope)
        return [place[k] for k in _moving(place)]

    def tangents(self, scope: Scope, anchors: Sequence[Scalar]) -> Sequence[tuple[str, Scalar]]:
        """Forward and sideways, without the one in which the point cannot move."""
        p = scope.frame(self.point).position
        held = list(self.ground.place(p, scope))
        for k, value in zip(_moving(held), anchors, strict=True):
            held[k] = value
        place: Triple = (held[0], held[1], held[2])
        slip = self.ground.slip(p, place, scope)
        directions = self.ground.directions(place, scope)
        rows = [(part, dot(t, slip)) for part, t in zip(("forward", "sideways"), directions, strict=True)]
        return [(part, row) for part, row in rows if not _is_constant(row)]


def touchdown(point: Frame, ground: Any = None) -> Touchdown:
    """Height of a foot over the ground; the foot can stick where it comes down.

    Parameters
    ----------
    point : the foot, such as shank.end
    ground : None for y = 0; a `Plane`, which may lie on another body or run like a belt; or the ground's height y = H,
        a function or sympy expression of x, or x and z, and of t where it moves (told by these names)

    Raises
    ------
    ModelError
        where the point is no frame, or the ground none of these.
    """
    return Touchdown(frame_of(point, "touchdown: its point"), surface_of(ground, "touchdown"))


def _is_constant(value: Scalar) -> bool:
    return not isinstance(value, Node) or value.is_constant


def _moving(p: Sequence[Scalar]) -> list[int]:
    return [k for k in range(3) if not _is_constant(p[k])]
