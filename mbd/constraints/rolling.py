"""A wheel, a disk or a ball that rolls without slip."""

from collections.abc import Sequence
from dataclasses import field
from typing import Any

from mbd.bodies.algebra import cross, difference, dot, scaled, total
from mbd.bodies.base import Frame
from mbd.bodies.domains import Domain, positive
from mbd.bodies.ground import Ground
from mbd.bodies.scope import Scope, Triple
from mbd.bodies.values import flag, name_of, number, unit_vector
from mbd.constraints.base import VelocityConstraint
from mbd.constraints.disks import slip_along, to_edge
from mbd.constraints.surfaces import Plane
from mbd.dataclass import dataclass
from mbd.errors import CapabilityError, ModelError
from mbd.forces.base import frame_of
from mbd.forces.quantities import Mention
from mbd.tape.node import Node, Scalar


@dataclass(frozen=True)
class Rolling(VelocityConstraint):
    """``t · (v_C + ω × (−r n) − v_P) = 0``: the point of a wheel that touches a plane does not slip along it.

    n is the plane's normal and t the direction forward along it (x on level ground), r the radius, C the center, v_P
    the velocity of the plane there, where it lies on another body (which then feels the friction) or runs. Only
    the slip is held at zero; the wheel stays on the plane by what you give it: a joint, ``Bilateral`` on
    ``touchdown(center, Plane(offset=radius))``, or ``Unilateral`` there without friction, named in `only_while`.

    Parameters
    ----------
    name : its name
    center : the center of the wheel, a frame of the body that turns
    radius : r, the run-time parameter 'name.radius' [m]
    ground : the plane it rolls on, y = 0 by default
    only_while : name of the `Unilateral` contact that presses the wheel onto the plane: it rolls while that is closed,
        and takes part in its impacts without slip; None: it rolls at all times, also where it has left the plane. Where
        rolling needs grip although nothing presses any more, a run ends with an error; use friction instead
    axis : a of a thin disk that may lean any way in space, in the axes of `center`. It touches with the point of its
        edge nearest to the plane, C + r ((n·a) a − n)/|n × a|, which has two rows, 'forward' and 'sideways' along the
        plane; `Bilateral` or `Unilateral` on `disk_touchdown` keeps it there. None: a ball, or a wheel that turns
        about z of a planar mechanism, with the one row along t
    ball : True for a sphere, which touches at C − r n however it has turned, with the rows 'forward' and 'sideways'; it
        may spin about the normal, and its center of mass lie anywhere. `Bilateral` or `Unilateral` on
        `sphere_touchdown` keeps it on the plane

    'name.force' is the friction on the wheel along t [N], −λ; 'name.residual' the slip [m/s].

    Raises
    ------
    CapabilityError
        where the wheel turns about other axes than z and has no axis=: one that tilts touches the ground elsewhere.

    Examples
    --------
    >>> import mbd
    >>> model, body = mbd.Model("ball"), mbd.RigidBody("ball", 0.2, (3e-5,) * 3)
    >>> model.connect(mbd.Free("fly", model.ground.origin, body.origin))
    >>> height = mbd.sphere_touchdown(body.origin, 0.02)
    >>> model.constrain(mbd.Bilateral("height", height), mbd.Rolling("grip", body.origin, 0.02, ball=True))
    """

    name: str
    center: Frame
    radius: float
    ground: Plane = field(default_factory=Plane)
    only_while: str | None = None
    axis: Any = None
    ball: bool = False

    unit = "m"

    def __post_init__(self) -> None:
        name_of(self.name, "Rolling")
        frame_of(self.center, f"center of Rolling '{self.name}'")
        object.__setattr__(self, "radius", number(self.radius, f"radius of '{self.name}'"))
        if not isinstance(self.ground, Plane):
            uneven = (
                "; on ground that is a function or another ball roll by a contact: "
                f"mbd.Unilateral({self.name!r}, mbd.sphere_touchdown(center, radius, ground)) with friction=None, or "
                "mbd.rolling_touchdown in the plane"
            )
            raise ModelError(f"ground of Rolling '{self.name}' is a mbd.Plane, got {self.ground!r}{uneven}")
        if self.only_while is not None and not isinstance(self.only_while, str):
            raise ModelError(f"only_while of Rolling '{self.name}' is the name of a contact, got {self.only_while!r}")
        object.__setattr__(self, "ball", flag(self.ball, f"ball of Rolling '{self.name}'"))
        if self.ball and self.axis is not None:
            raise ModelError(f"Rolling '{self.name}' is a ball, which needs no axis=; leave out one of the two")
        if self.axis is not None:
            object.__setattr__(self, "axis", unit_vector(self.axis, f"axis of Rolling '{self.name}'"))
        if self.axis is None and not self.ball:
            self._in_the_plane()

    def _in_the_plane(self) -> None:
        """The ground of a planar wheel, whose normal and frame lie in the x-y plane."""
        if self.ground.normal[2] != 0.0:
            raise ModelError(
                f"ground of Rolling '{self.name}': its normal must lie in the x-y plane, in which the wheel rolls, "
                f"got {self.ground.normal}"
            )
        if self.ground.frame is not None and not self.ground.frame.is_planar:
            raise ModelError(
                f"ground of Rolling '{self.name}': the wheel rolls in the x-y plane, but its frame "
                f"'{self.ground.frame.full_name}' is tilted out of it; turn the frame about z only"
            )

    @property
    def contact(self) -> str | None:
        """The contact of `only_while`."""
        return self.only_while

    @property
    def others(self) -> tuple[str, ...]:
        """The contact of `only_while`."""
        return () if self.only_while is None else (self.only_while,)

    def rates(self, scope: Scope) -> Sequence[tuple[str, Scalar]]:
        """Velocity of the touching point along the plane."""
        if self.ball or self.axis is not None:
            return slip_along(self.ground, self.center, self.arm(scope), scope)
        motion = scope.frame(self.center)
        if any(isinstance(part, Node) and not part.is_zero for part in motion.angular_velocity[:2]):
            raise CapabilityError(
                f"Rolling '{self.name}' serves wheels of planar mechanisms, which turn about z only; of a disk that "
                "tilts in space give its axis=, of a sphere ball=True; the rows of other shapes can be written with "
                "mbd.Nonholonomic"
            )
        ground, arm = self.ground, self.arm(scope)
        slip = total(motion.velocity, cross(motion.angular_velocity, arm))
        if ground.is_moving:
            slip = difference(slip, ground.velocity_at(total(motion.position, arm), scope))
        forward, _ = ground.directions(motion.position, scope)
        return [("", dot(ground.turned(forward, scope), slip))]

    def arm(self, scope: Scope) -> Triple:
        """From the center to the touching point, in ground axes [m]: −r n, or to the edge of a disk."""
        radius = scope.parameter(self.name, "radius", self.radius)
        if self.axis is not None:
            return to_edge(self.center, self.axis, radius, self.ground, scope)
        return scaled(-radius, self.ground.turned(self.ground.normal, scope))

    def mentions(self) -> list[Mention]:
        """Its center, and the frame of the plane."""
        return [self.center] if self.ground.frame is None else [self.center, self.ground.frame]

    def parameters(self) -> dict[str, float]:
        """`radius`."""
        return {f"{self.name}.radius": self.radius}

    def domains(self) -> dict[str, Domain]:
        """A radius > 0."""
        return {f"{self.name}.radius": positive(unit="m")}

    @property
    def known_as(self) -> str:
        """ "Rolling 'wheel'"."""
        return f"Rolling '{self.name}'"

    def faults(self) -> list[str]:
        """A radius that is not positive, a wheel that is the ground, or that rolls on itself."""
        found = super().faults()
        if isinstance(self.center.body, Ground):
            found.append(f"Rolling '{self.name}' has its center on the ground; give a frame of the wheel")
        elif self.ground.frame is not None and self.ground.frame.body is self.center.body:
            found.append(
                f"Rolling '{self.name}': its plane lies on the wheel '{self.center.body.name}' itself; give the "
                "plane a frame of another body"
            )
        return found
