"""The cross joint of Cardan and Hooke."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, field

from mbd.bodies.algebra import ZERO, axis_rotation, cross, dot, product, rotate, transpose
from mbd.bodies.base import Frame
from mbd.bodies.scope import Rotation, Scope, Triple
from mbd.bodies.values import Vector3, unit_vector
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.joints.base import Joint, JointLoss, Label
from mbd.joints.parts import Z, place_rows
from mbd.tape.functions import atan2
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class Universal(Joint):
    """A cross joint: ``R = exp(first [axis]×) exp(second [second_axis]×)``, ``p = 0``.

    Parameters
    ----------
    name, parent, child : its name and its two frames
    axis : of the first turn, fixed in the parent; z by default
    second_axis : of the second turn, fixed in the child and across the first; x by default
    loss : friction torque of each rate [N m], or by label: {'first': Viscous(0.1)}
    anatomy : the joint of the body that it is, such as 'left hip': results tell its angles by ISB, 'left hip.flexion'

    Coordinates: `first`, `second` [rad].
    """

    name: str
    parent: Frame
    child: Frame
    axis: Vector3 = Z
    second_axis: Vector3 = (1.0, 0.0, 0.0)
    _: KW_ONLY
    loss: JointLoss = field(default=None, hash=False)
    anatomy: str = ""

    is_planar = False

    def __post_init__(self) -> None:
        axis = unit_vector(self.axis, f"axis of '{self.name}'")
        second = unit_vector(self.second_axis, f"second axis of '{self.name}'")
        if abs(sum(a * b for a, b in zip(axis, second, strict=True))) > 1e-12:
            raise ModelError(f"Universal '{self.name}': its axes must be across each other, got {axis} and {second}")
        object.__setattr__(self, "axis", axis)
        object.__setattr__(self, "second_axis", second)
        self.validate()

    @property
    def labels(self) -> tuple[Label, ...]:
        """`first`, `second`."""
        return (Label("first", "rad"), Label("second", "rad"))

    def transform(self, q: Sequence[Scalar], scope: Scope) -> tuple[Rotation, Triple]:
        """Two turns."""
        return product(axis_rotation(self.axis, q[0]), axis_rotation(self.second_axis, q[1])), ZERO

    def subspace(self, q: Sequence[Scalar], scope: Scope) -> Sequence[tuple[Triple, Triple]]:
        """ω = R₂ᵀ axis, ω = second axis."""
        return [
            (rotate(transpose(axis_rotation(self.second_axis, q[1])), self.axis), ZERO),
            (self.second_axis, ZERO),
        ]

    def rows(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[tuple[str, Scalar]]:
        """The points coincide, the two axes stay across each other."""
        return [*place_rows(p), ("turn cross", dot(self.axis, rotate(R, self.second_axis)))]

    def recover(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[Scalar]:
        """``R second_axis`` turns by the first angle, ``Rᵀ axis`` by minus the second."""
        third = cross(self.axis, self.second_axis)
        arm, shaft = rotate(R, self.second_axis), rotate(transpose(R), self.axis)
        return [atan2(dot(third, arm), dot(self.second_axis, arm)), atan2(dot(third, shaft), dot(self.axis, shaft))]
