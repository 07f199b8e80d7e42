"""A blade, skate or sharp wheel that cannot slip sideways."""

from collections.abc import Sequence
from typing import Any

from mbd.bodies.algebra import dot, rotate
from mbd.bodies.base import Frame
from mbd.bodies.ground import Ground
from mbd.bodies.scope import Scope
from mbd.bodies.values import Vector3, name_of, unit_vector
from mbd.constraints.base import VelocityConstraint
from mbd.dataclass import dataclass
from mbd.forces.base import frame_of
from mbd.forces.quantities import Mention
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class KnifeEdge(VelocityConstraint):
    """``(R n) · v = 0``: the frame's origin does not move along n, a direction fixed in the frame.

    Parameters
    ----------
    name : its name
    frame : where the blade touches
    normal : n in the frame's axes, of any length; by default y, across a blade that points along x

    'name.force' is the side force on the body along n [N], −λ; 'name.residual' the slip [m/s].
    """

    name: str
    frame: Frame
    normal: Any = (0.0, 1.0, 0.0)

    unit = "m"

    def __post_init__(self) -> None:
        name_of(self.name, "KnifeEdge")
        frame_of(self.frame, f"frame of KnifeEdge '{self.name}'")
        normal: Vector3 = unit_vector(self.normal, f"normal of KnifeEdge '{self.name}'")
        object.__setattr__(self, "normal", normal)

    def rates(self, scope: Scope) -> Sequence[tuple[str, Scalar]]:
        """Velocity across the blade."""
        motion = scope.frame(self.frame)
        return [("", dot(rotate(motion.rotation, self.normal), motion.velocity))]

    def mentions(self) -> list[Mention]:
        """Its frame."""
        return [self.frame]

    def faults(self) -> list[str]:
        """A blade on the ground itself."""
        if isinstance(self.frame.body, Ground):
            return [f"KnifeEdge '{self.name}' is on the ground, which does not move; give a frame of a body"]
        return []
