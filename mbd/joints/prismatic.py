"""The slider."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, field

from mbd.bodies.algebra import IDENTITY, ZERO, dot, scaled
from mbd.bodies.base import Frame
from mbd.bodies.scope import Rotation, Scope, Triple
from mbd.bodies.values import Vector3, unit_vector
from mbd.dataclass import dataclass
from mbd.joints.base import Joint, JointLoss, Label
from mbd.joints.parts import across_rows, turn_rows
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class Prismatic(Joint):
    """A slider: ``R = 1``, ``p = displacement · axis``.

    Parameters
    ----------
    name, parent, child : its name and its two frames
    axis : direction in the parent frame; x by default
    loss : friction force of the rate [N]
    stiffness, rest : of a spring along the axis [N/m, m]

    Coordinates: `displacement` [m].
    """

    name: str
    parent: Frame
    child: Frame
    axis: Vector3 = (1.0, 0.0, 0.0)
    _: KW_ONLY
    loss: JointLoss = field(default=None, hash=False)
    stiffness: float = 0.0
    rest: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", unit_vector(self.axis, f"axis of '{self.name}'"))
        self.validate()

    @property
    def labels(self) -> tuple[Label, ...]:
        """`displacement`."""
        return (Label("displacement", "m"),)

    @property
    def is_planar(self) -> bool:
        """Axis in x–y."""
        return self.axis[2] == 0.0

    def transform(self, q: Sequence[Scalar], scope: Scope) -> tuple[Rotation, Triple]:
        """A shift along the axis."""
        return IDENTITY, scaled(q[0], self.axis)

    def subspace(self, q: Sequence[Scalar], scope: Scope) -> Sequence[tuple[Triple, Triple]]:
        """v = axis."""
        return [(ZERO, self.axis)]

    def rows(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[tuple[str, Scalar]]:
        """No place across the axis, no turn."""
        return [*across_rows(p, self.axis), *turn_rows(R)]

    def recover(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[Scalar]:
        """The place along the axis."""
        return [dot(self.axis, p)]
