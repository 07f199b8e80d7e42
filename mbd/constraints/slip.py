"""The velocity at which what touches the ground slips along it."""

from __future__ import annotations

from mbd.bodies.algebra import cross, difference, dot, total
from mbd.bodies.base import Frame
from mbd.bodies.scope import Scope, Triple
from mbd.constraints.balls import Ball
from mbd.constraints.surfaces import Plane, Surface
from mbd.tape.node import Node, Scalar

__all__ = ["slip_along"]


def slip_along(ground: Plane | Surface | Ball, center: Frame, arm: Triple, scope: Scope) -> list[tuple[str, Scalar]]:
    """``t · (v_C + ω × arm − v_P)`` forward and sideways, of the point of the body that is at C + arm now [m/s].

    v_P is the velocity of the ground there. A direction in which nothing can move, sideways in the plane, has no row.
    """
    motion = scope.frame(center)
    slip = total(motion.velocity, cross(motion.angular_velocity, arm))
    touched = total(motion.position, arm)
    if ground.is_moving:
        slip = difference(slip, ground.velocity_at(touched, scope))
    directions = zip(("forward", "sideways"), ground.directions(touched, scope), strict=True)
    rows = [(part, dot(ground.turned(direction, scope), slip)) for part, direction in directions]
    return [(part, row) for part, row in rows if isinstance(row, Node) and not row.is_constant]
