"""The hinge."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, field

from mbd.bodies.algebra import ZERO, axis_rotation
from mbd.bodies.base import Frame
from mbd.bodies.scope import Rotation, Scope, Triple
from mbd.bodies.values import Vector3, unit_vector
from mbd.dataclass import dataclass
from mbd.joints.base import Joint, JointLoss, Label
from mbd.joints.parts import Z, align_rows, angle_about, place_rows
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class Revolute(Joint):
    """A hinge: ``R = exp(angle [axis]×)``, ``p = 0``.

    Parameters
    ----------
    name, parent, child : its name and its two frames
    axis : direction in the parent frame (and in the child's); a positive angle turns right-handed about it
    loss : friction torque of the rate [N m]
    stiffness, rest : of a torsion spring [N m/rad, rad]
    anatomy : the joint of the body that it is, such as 'left hip': results tell its angles by ISB, 'left hip.flexion'

    Coordinates: `angle` [rad].
    """

    name: str
    parent: Frame
    child: Frame
    axis: Vector3 = Z
    _: KW_ONLY
    loss: JointLoss = field(default=None, hash=False)
    stiffness: float = 0.0
    rest: float = 0.0
    anatomy: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", unit_vector(self.axis, f"axis of '{self.name}'"))
        self.validate()

    @property
    def labels(self) -> tuple[Label, ...]:
        """`angle`."""
        return (Label("angle", "rad"),)

    @property
    def is_planar(self) -> bool:
        """Axis along z."""
        return abs(self.axis[2]) == 1.0

    def transform(self, q: Sequence[Scalar], scope: Scope) -> tuple[Rotation, Triple]:
        """A turn about the axis."""
        return axis_rotation(self.axis, q[0]), ZERO

    def subspace(self, q: Sequence[Scalar], scope: Scope) -> Sequence[tuple[Triple, Triple]]:
        """ω = axis."""
        return [(self.axis, ZERO)]

    def rows(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[tuple[str, Scalar]]:
        """The points coincide, the axes align."""
        return [*place_rows(p), *align_rows(R, self.axis)]

    def recover(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[Scalar]:
        """The angle about the axis."""
        return [angle_about(R, self.axis)]
