"""A thin disk that may lean any way, and where it touches a plane."""

from collections.abc import Sequence
from dataclasses import field
from typing import Any

from mbd.bodies.algebra import cross, difference, dot, rotate, scaled, total
from mbd.bodies.base import Frame
from mbd.bodies.domains import Domain, positive
from mbd.bodies.ground import Ground
from mbd.bodies.scope import Scope, Triple
from mbd.bodies.values import Vector3, number, unit_vector
from mbd.constraints.balls import Ball
from mbd.constraints.measure import Measure
from mbd.constraints.round_on_surface import NO_CONTACT_POINT, edge_on
from mbd.constraints.surfaces import Plane, Surface, spin_about, surface_of
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.base import frame_of
from mbd.forces.quantities import Mention
from mbd.tape.functions import sqrt
from mbd.tape.node import Node, Scalar


def steepness(center: Frame, axis: Vector3, ground: Plane, scope: Scope) -> Scalar:
    """|n × a|: 1 of an upright disk, 0 of one that lies flat."""
    a = rotate(scope.frame(center).rotation, axis)
    across = cross(ground.turned(ground.normal, scope), a)
    size: Scalar = sqrt(dot(across, across))
    return size


def to_edge(center: Frame, axis: Vector3, radius: Scalar, ground: Plane, scope: Scope) -> Triple:
    """From the center to the point of the edge nearest to the plane, ``r ((n·a) a − n)/|n × a|``, in ground axes."""
    a, n = rotate(scope.frame(center).rotation, axis), ground.turned(ground.normal, scope)
    across = cross(n, a)
    return scaled(radius / sqrt(dot(across, across)), difference(scaled(dot(n, a), a), n))


FLAT_DISK = "a disk that lies flat touches with all its edge (give it feet along the edge by mbd.touchdown to lie on)"
"""What a row that is no number means."""


@dataclass(frozen=True)
class DiskTouchdown(Measure):
    """``g = n · s_C − r |n × a|`` of the edge of a thin disk, and the slip ``v_C + ω × e − v_P`` of its lowest point.

    Where that velocity is zero the disk rolls; no posture tells that, so that its rows are rows on velocities.
    """

    center: Frame
    radius: float
    axis: Vector3
    ground: Plane | Surface = field(default_factory=Plane)

    unit = "m"
    has_slip_velocities = True
    has_spin = True

    def gap(self, scope: Scope) -> Scalar:
        """n · s_C − r |n × a|."""
        radius = scope.parameter(self.center.full_name, "radius", self.radius)
        if isinstance(self.ground, Surface):
            return self._edge_on(self.ground, scope)[0]
        lift = self.ground.gap(scope.frame(self.center).position, scope)
        return lift - radius * steepness(self.center, self.axis, self.ground, scope)

    @property
    def undefined(self) -> str:
        """It lies flat, or a height function has no single place of contact."""
        return f"{FLAT_DISK}, or {NO_CONTACT_POINT}" if isinstance(self.ground, Surface) else FLAT_DISK

    def slip_velocities(self, scope: Scope) -> Sequence[tuple[str, Scalar]]:
        """Forward and sideways on the plane, without the one in which nothing moves (in a planar model sideways)."""
        return slip_along(self.ground, self.center, self.edge_arm(scope), scope)

    def edge_arm(self, scope: Scope) -> Triple:
        """From the center to the lowest point of the edge, in ground axes [m]."""
        if isinstance(self.ground, Surface):
            return self._edge_on(self.ground, scope)[1]
        radius = scope.parameter(self.center.full_name, "radius", self.radius)
        return to_edge(self.center, self.axis, radius, self.ground, scope)

    def _edge_on(self, surface: Surface, scope: Scope) -> tuple[Scalar, Triple]:
        """Gap over a height function, and the arm to the point of the edge that is lowest over it."""
        radius = scope.parameter(self.center.full_name, "radius", self.radius)
        frame = scope.frame(self.center)
        return edge_on(surface, frame.position, rotate(frame.rotation, self.axis), radius, scope)

    def spin(self, scope: Scope) -> Scalar:
        """n · (ω − ω_ground)."""
        p = scope.frame(self.center).position
        if isinstance(self.ground, Surface):
            p = total(p, self.edge_arm(scope))
        return spin_about(self.ground.normal_at(p, scope), self.center, self.ground.frame, scope)

    def mentions(self) -> list[Mention]:
        """Its center, and the frame of the plane."""
        return [self.center] if self.ground.frame is None else [self.center, self.ground.frame]

    def parameters(self) -> dict[str, float]:
        """The radius, under the name of the center."""
        return {f"{self.center.full_name}.radius": self.radius}

    def domains(self) -> dict[str, Domain]:
        """A radius > 0."""
        return {f"{self.center.full_name}.radius": positive(unit="m")}

    def faults(self, owner: str) -> list[str]:
        """A disk on the ground, or on the body that its plane is on."""
        if isinstance(self.center.body, Ground):
            return [f"'{owner}': its disk is on the ground; give the frame of a body that rolls"]
        if self.ground.frame is not None and self.ground.frame.body is self.center.body:
            return [f"'{owner}': its disk and its plane are both on '{self.center.body.name}' and never move apart"]
        return []


def disk_touchdown(center: Frame, radius: float, axis: Any, ground: Any = None) -> DiskTouchdown:
    """Height of the edge of a thin disk over the ground, whichever way it leans: a coin, the wheel of a bicycle.

    ``g = n · s_C − r |n × a|`` with the place s_C of the center on the plane and the disk's axis a. A `Bilateral` keeps
    the edge on the plane, where a `Rolling` with the same axis makes it roll. A `Unilateral` lets it lift off: with
    friction=None it rolls while it is closed, with μ its lowest point slides, grips and slips, with 0 it slides freely.
    Lying flat, where it touches with all its edge, g has a kink: a run that comes there ends.

    Parameters
    ----------
    center : of the disk, a frame of the body
    radius : r > 0 [m]; the run-time parameter '<center>.radius'
    axis : a in the axes of that frame, of any length
    ground : None for y = 0; a `Plane`, which may lie on another body, or run; or the ground's height y = H, as of
        `touchdown`. A valley must be wider than the disk: where it is not, the run ends by name

    Raises
    ------
    ModelError
        where the center is no frame, the radius not positive, the axis no direction, or the ground none of these.

    >>> import mbd
    >>> model, coin = mbd.Model("coin"), mbd.RigidBody("coin", 0.01, (1e-6, 1e-6, 2e-6))
    >>> model.connect(mbd.Free("float", model.ground.origin, coin.origin))
    >>> axis, edge = (0, 0, 1), mbd.disk_touchdown(coin.origin, 0.012, axis=(0, 0, 1))
    >>> model.constrain(mbd.Bilateral("edge", edge), mbd.Rolling("grip", coin.origin, 0.012, axis=axis))
    >>> model.check()
    []
    """
    frame_of(center, "disk_touchdown: its center")
    size = number(radius, "radius of disk_touchdown")
    if size <= 0.0:
        raise ModelError(f"radius of disk_touchdown must be positive, got {size:g} m; for a point use mbd.touchdown")
    return DiskTouchdown(
        center, size, unit_vector(axis, "axis of disk_touchdown"), surface_of(ground, "disk_touchdown")
    )


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
