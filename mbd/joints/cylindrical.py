"""A sleeve on a shaft."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, field

from mbd.bodies.algebra import ZERO, axis_rotation, dot, scaled
from mbd.bodies.base import Frame
from mbd.bodies.scope import Rotation, Scope, Triple
from mbd.bodies.values import Vector3, unit_vector
from mbd.dataclass import dataclass
from mbd.joints.base import Joint, JointLoss, Label
from mbd.joints.parts import Z, across_rows, align_rows, angle_about
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class Cylindrical(Joint):
    """A sleeve on a shaft: ``R = exp(angle [axis]×)``, ``p = displacement · axis``.

    Parameters
    ----------
    name, parent, child : its name and its two frames
    axis : direction in the parent frame; z by default
    loss : by label, such as {'angle': Viscous(0.1)}

    Coordinates: `angle` [rad], `displacement` [m].
    """

    name: str
    parent: Frame
    child: Frame
    axis: Vector3 = Z
    _: KW_ONLY
    loss: JointLoss = field(default=None, hash=False)

    is_planar = False  # it turns about the direction in which it shifts

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", unit_vector(self.axis, f"axis of '{self.name}'"))
        self.validate()

    @property
    def labels(self) -> tuple[Label, ...]:
        """`angle`, `displacement`."""
        return (Label("angle", "rad"), Label("displacement", "m"))

    def transform(self, q: Sequence[Scalar], scope: Scope) -> tuple[Rotation, Triple]:
        """A turn about the axis and a shift along it."""
        return axis_rotation(self.axis, q[0]), scaled(q[1], self.axis)

    def subspace(self, q: Sequence[Scalar], scope: Scope) -> Sequence[tuple[Triple, Triple]]:
        """ω = axis, v = axis."""
        return [(self.axis, ZERO), (ZERO, self.axis)]

    def rows(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[tuple[str, Scalar]]:
        """No place across the axis, the axes align."""
        return [*across_rows(p, self.axis), *align_rows(R, self.axis)]

    def recover(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[Scalar]:
        """Angle about the axis, place along it."""
        return [angle_about(R, self.axis), dot(self.axis, p)]
