"""Where a ball meets a plane, on which it rolls, slips and spins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from mbd.bodies.algebra import scaled
from mbd.bodies.base import Frame
from mbd.bodies.domains import Domain, positive
from mbd.bodies.ground import Ground
from mbd.bodies.values import number
from mbd.constraints.measure import Measure
from mbd.constraints.slip import slip_along
from mbd.constraints.surfaces import Plane, spin_about
from mbd.errors import ModelError
from mbd.forces.base import frame_of
from mbd.forces.quantities import Mention
from mbd.scope import Scope
from mbd.tape.node import Scalar

__all__ = ["SphereTouchdown", "sphere_touchdown"]


@dataclass(frozen=True)
class SphereTouchdown(Measure):
    """``g = n · s_C − r`` of a ball, and the velocity ``v_C − ω × r n − v_plane`` of its lowest point on the plane.

    Where that velocity is zero the ball rolls; no posture tells that, so that its rows are rows on velocities.
    """

    center: Frame
    radius: float
    ground: Plane = field(default_factory=Plane)

    def gap(self, scope: Scope) -> Scalar:
        """n · s_C − r."""
        return self.ground.gap(scope.frame(self.center).position, scope) - self._radius(scope)

    @property
    def unit(self) -> str:
        """'m'."""
        return "m"

    @property
    def has_slip_velocities(self) -> bool:
        """True."""
        return True

    def slip_velocities(self, scope: Scope) -> Sequence[tuple[str, Scalar]]:
        """Forward and sideways, without the one in which nothing moves (in a planar model sideways)."""
        arm = scaled(-1.0 * self._radius(scope), self.ground.turned(self.ground.normal, scope))
        return slip_along(self.ground, self.center, arm, scope)

    @property
    def has_spin(self) -> bool:
        """True."""
        return True

    def spin(self, scope: Scope) -> Scalar:
        """n · (ω − ω_plane)."""
        p = scope.frame(self.center).position
        return spin_about(self.ground.normal_at(p, scope), self.center, self.ground.frame, scope)

    def mentions(self) -> list[Mention]:
        """Its center, and the frame of the plane."""
        return [self.center] if self.ground.frame is None else [self.center, self.ground.frame]

    def faults(self, owner: str) -> list[str]:
        """A ball of the ground, or of the body that its plane is on."""
        if isinstance(self.center.body, Ground):
            return [f"'{owner}': its ball '{self.center.full_name}' is the ground; give a frame of the body that rolls"]
        if self.ground.frame is not None and self.ground.frame.body is self.center.body:
            return [f"'{owner}': its ball and its plane are both on '{self.center.body.name}' and never move apart"]
        return []

    def parameters(self) -> dict[str, float]:
        """The radius, under the name of the center."""
        return {f"{self.center.full_name}.radius": self.radius}

    def domains(self) -> dict[str, Domain]:
        """A radius > 0."""
        return {f"{self.center.full_name}.radius": positive(unit="m")}

    def _radius(self, scope: Scope) -> Scalar:
        return scope.parameter(self.center.full_name, "radius", self.radius)


def sphere_touchdown(center: Frame, radius: float, ground: Any = None) -> SphereTouchdown:
    """Height of a ball over a plane, on which it rolls, slips and spins.

    In a `Unilateral` with friction=None it rolls without slip while it is closed, with μ it slides against the velocity
    of its lowest point, grips and slips again, with 0 it slides freely. Nothing resists its spin about the normal.

    Parameters
    ----------
    center : the middle of the ball, a frame of a body that turns
    radius : r > 0, the run-time parameter '<center>.radius' [m]
    ground : None for y = 0, or a `Plane`, which may lie on another body, or run

    Raises
    ------
    ModelError
        where the center is no frame, the radius no number, or the ground no plane.
    """
    frame_of(center, "sphere_touchdown: its center")
    if ground is not None and not isinstance(ground, Plane):
        raise ModelError(f"sphere_touchdown: the ground is a mbd.Plane (what is round is the ball), got {ground!r}")
    return SphereTouchdown(center, number(radius, "radius of sphere_touchdown"), ground or Plane())
