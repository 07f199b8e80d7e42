"""Where a ball meets the ground, on which it rolls, slips and spins."""

from collections.abc import Sequence
from dataclasses import field
from typing import Any

from mbd.bodies.algebra import scaled, total
from mbd.bodies.base import Frame
from mbd.bodies.domains import Domain, positive
from mbd.bodies.ground import Ground
from mbd.bodies.scope import Scope, Triple
from mbd.bodies.values import number
from mbd.constraints.balls import Ball
from mbd.constraints.disks import slip_along
from mbd.constraints.measure import Measure
from mbd.constraints.round_on_surface import NO_CONTACT_POINT, ball_on
from mbd.constraints.surfaces import Plane, Surface, spin_about, surface_of
from mbd.dataclass import dataclass
from mbd.forces.base import frame_of
from mbd.forces.quantities import Mention
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class SphereTouchdown(Measure):
    """``g = n · s_C − r`` of a ball, and the velocity ``v_C − ω × r n − v_P`` of its lowest point against the ground.

    Where that velocity is zero the ball rolls; no posture tells that, so that its rows are rows on velocities. On a
    height function n and the place of contact are those of `mbd.constraints.round_on_surface`.
    """

    center: Frame
    radius: float
    ground: Plane | Surface | Ball = field(default_factory=Plane)

    unit = "m"
    has_slip_velocities = True
    has_spin = True

    def gap(self, scope: Scope) -> Scalar:
        """n · s_C − r."""
        p, radius = scope.frame(self.center).position, self._radius(scope)
        if isinstance(self.ground, Surface):
            return ball_on(self.ground, p, radius, scope)[0]
        return self.ground.gap(p, scope) - radius

    @property
    def undefined(self) -> str:
        """On a height function: no single place of contact."""
        return NO_CONTACT_POINT if isinstance(self.ground, Surface) else ""

    def slip_velocities(self, scope: Scope) -> Sequence[tuple[str, Scalar]]:
        """Forward and sideways, without the one in which nothing moves (in a planar model sideways)."""
        return slip_along(self.ground, self.center, self.arm(scope), scope)

    def arm(self, scope: Scope) -> Triple:
        """From the center to the point nearest to the ground, −r n, in ground axes [m]."""
        p, radius = scope.frame(self.center).position, self._radius(scope)
        if isinstance(self.ground, Surface):
            return ball_on(self.ground, p, radius, scope)[1]
        return scaled(-1.0 * radius, self.ground.normal_at(p, scope))

    def spin(self, scope: Scope) -> Scalar:
        """n · (ω − ω_ground)."""
        p = scope.frame(self.center).position
        if isinstance(self.ground, Surface):
            p = total(p, self.arm(scope))
        return spin_about(self.ground.normal_at(p, scope), self.center, self.ground.frame, scope)

    def mentions(self) -> list[Mention]:
        """Its center, and the frame of the plane."""
        return [self.center] if self.ground.frame is None else [self.center, self.ground.frame]

    def faults(self, owner: str) -> list[str]:
        """A ball of the ground, or of the body that it touches, or one that does not fit into a hollow one."""
        found = []
        if isinstance(self.center.body, Ground):
            found = [
                f"'{owner}': its ball '{self.center.full_name}' is the ground; give a frame of the body that rolls"
            ]
        elif self.ground.frame is not None and self.ground.frame.body is self.center.body:
            what = "what it touches" if isinstance(self.ground, Ball) else "its plane"
            found = [f"'{owner}': its ball and {what} are both on '{self.center.body.name}' and never move apart"]
        if isinstance(self.ground, Ball) and self.ground.hollow and self.radius >= self.ground.radius:
            sizes = f"{self.radius:g} m does not fit into a hollow one of {self.ground.radius:g} m"
            found.append(f"'{owner}': a ball of radius {sizes}; make it smaller, or the other one larger")
        return found

    def parameters(self) -> dict[str, float]:
        """The radius, under the name of the center; that of a ball that it touches."""
        found = {f"{self.center.full_name}.radius": self.radius}
        if isinstance(self.ground, Ball):
            found[f"{self.ground.center.full_name}.radius"] = self.ground.radius
        return found

    def domains(self) -> dict[str, Domain]:
        """A radius > 0."""
        return {name: positive(unit="m") for name in self.parameters()}

    def _radius(self, scope: Scope) -> Scalar:
        return scope.parameter(self.center.full_name, "radius", self.radius)


def sphere_touchdown(center: Frame, radius: float, ground: Any = None) -> SphereTouchdown:
    """Height of a ball over a plane, a height function or another ball, on which it rolls, slips and spins.

    In a `Unilateral` with friction=None it rolls without slip while it is closed, with μ it slides against the velocity
    of its lowest point, grips and slips again, with 0 it slides freely. Nothing resists its spin about the normal.

    Parameters
    ----------
    center : the middle of the ball, a frame of a body that turns
    radius : r > 0, the run-time parameter '<center>.radius' [m]
    ground : None for y = 0; a `Plane`, which may lie on another body, or run; or the ground's height y = H, a function
        or sympy expression of x, or x and z, and of t where it moves. A valley must be wider than the ball: where it is
        not, the run ends by name; or a `Ball` of another body, hollow or not

    Raises
    ------
    ModelError
        where the center is no frame, the radius no number, or the ground none of these.
    """
    frame_of(center, "sphere_touchdown: its center")
    on = ground if isinstance(ground, Ball) else surface_of(ground, "sphere_touchdown", "a mbd.Ball, ")
    return SphereTouchdown(center, number(radius, "radius of sphere_touchdown"), on)
