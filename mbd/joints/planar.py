"""Free motion in a plane."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, field

from mbd.bodies.algebra import IDENTITY, ZERO, axis_rotation, rotate, transpose
from mbd.bodies.base import Frame
from mbd.bodies.scope import Rotation, Scope, Triple
from mbd.dataclass import dataclass
from mbd.joints.base import Joint, JointLoss, Label
from mbd.joints.parts import Z, align_rows, angle_about
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class Planar(Joint):
    """Free motion in the parent's x–y plane: ``R = exp(angle [z]×)``, ``p = (x, y, 0)``.

    Parameters
    ----------
    name, parent, child : its name and its two frames
    loss : by label, such as {'angle': Viscous(0.1), 'x': Viscous(2.0)}

    Coordinates: `x`, `y` [m], `angle` [rad].
    """

    name: str
    parent: Frame
    child: Frame
    _: KW_ONLY
    loss: JointLoss = field(default=None, hash=False)

    is_planar = True

    def __post_init__(self) -> None:
        self.validate()

    @property
    def labels(self) -> tuple[Label, ...]:
        """`x`, `y`, `angle`."""
        return (Label("x", "m"), Label("y", "m"), Label("angle", "rad"))

    def transform(self, q: Sequence[Scalar], scope: Scope) -> tuple[Rotation, Triple]:
        """A shift in the plane, then a turn about z."""
        return axis_rotation(Z, q[2]), (q[0], q[1], 0.0)

    def subspace(self, q: Sequence[Scalar], scope: Scope) -> Sequence[tuple[Triple, Triple]]:
        """v = Rᵀ x, v = Rᵀ y, ω = z."""
        back = transpose(axis_rotation(Z, q[2]))
        return [(ZERO, rotate(back, IDENTITY[0])), (ZERO, rotate(back, IDENTITY[1])), (Z, ZERO)]

    def rows(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[tuple[str, Scalar]]:
        """The point stays in the plane, the z axes align."""
        return [("z", p[2]), *align_rows(R, Z)]

    def recover(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[Scalar]:
        """Place in the plane and angle about z."""
        return [p[0], p[1], angle_about(R, Z)]
