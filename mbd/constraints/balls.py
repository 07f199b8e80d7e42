"""A ball of a body as what another ball touches, from outside or inside."""

from mbd.bodies.algebra import cross, difference, dot, scaled, total
from mbd.bodies.base import Frame
from mbd.bodies.scope import Scope, Triple
from mbd.bodies.values import number
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.base import frame_of
from mbd.tape.functions import sqrt
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class Ball:
    """A sphere ``‖p − C‖ = R`` fixed on a body, on which another ball rolls, slips and strikes.

    ``g = ‖p − C‖ − R`` and the normal ``n = (p − C)/‖p − C‖`` away from C; of a hollow one ``g = R − ‖p − C‖`` with n
    towards it. Both balls are pushed, with ±(p n + friction) where they touch.

    Along the surface 'forward' is the direction into which x turns as y turns to n the shortest way, 'sideways' that of
    z; straight below a ball (above, in a hollow one) there is no such way: name the lower ball as the ground.

    Parameters
    ----------
    center : C, a frame of the body
    radius : R > 0, the run-time parameter '<center>.radius' [m]
    hollow : whether what touches it is inside

    Raises
    ------
    ModelError
        where a value is not what it should be.
    """

    center: Frame
    radius: float
    hollow: bool = False

    def __post_init__(self) -> None:
        frame_of(self.center, "center of a Ball")
        object.__setattr__(self, "radius", number(self.radius, "radius of a Ball"))
        if self.radius <= 0.0:
            raise ModelError(f"radius of a Ball must be positive, got {self.radius:g} m; a hollow one has hollow=True")
        if not isinstance(self.hollow, bool):
            raise ModelError(f"hollow of a Ball is True or False, got {self.hollow!r}")

    @property
    def frame(self) -> Frame:
        """Its center, whose body carries it."""
        return self.center

    @property
    def is_moving(self) -> bool:
        """True."""
        return True

    def gap(self, p: Triple, scope: Scope) -> Scalar:
        """‖p − C‖ − R, or R − ‖p − C‖."""
        radius = scope.parameter(self.center.full_name, "radius", self.radius)
        arm = difference(p, scope.frame(self.center).position)
        distance: Scalar = sqrt(dot(arm, arm))
        return radius - distance if self.hollow else distance - radius

    def normal_at(self, p: Triple, scope: Scope) -> Triple:
        """n in ground axes, away from the surface on the open side."""
        arm = difference(p, scope.frame(self.center).position)
        return scaled((-1.0 if self.hollow else 1.0) / sqrt(dot(arm, arm)), arm)

    def turned(self, direction: Triple, scope: Scope) -> Triple:
        """A direction, which is in ground axes."""
        return direction

    def directions(self, held: Triple, scope: Scope) -> tuple[Triple, Triple]:
        """Forward and sideways at a place of the surface (Frisvad 2012, about y)."""
        x, y, z = self.normal_at(held, scope)
        share = 1.0 / (1.0 + y)
        both = x * z * share
        return (1.0 - x * x * share, -x, -both), (-both, -z, 1.0 - z * z * share)

    def velocity_at(self, p: Triple, scope: Scope) -> Triple:
        """Velocity of its material at a place, ``v_C + ω × (p − C)`` [m/s]."""
        motion = scope.frame(self.center)
        return total(motion.velocity, cross(motion.angular_velocity, difference(p, motion.position)))
