"""A nut on a thread."""

import math
from collections.abc import Sequence
from dataclasses import KW_ONLY, field

from mbd.bodies.algebra import axis_rotation, dot, scaled
from mbd.bodies.base import Frame
from mbd.bodies.domains import Domain
from mbd.bodies.scope import Rotation, Scope, Triple
from mbd.bodies.values import Vector3, number, unit_vector
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.joints.base import Joint, JointLoss, Label
from mbd.joints.parts import Z, across_rows, align_rows, sine_cosine
from mbd.tape.functions import atan2, cos, sin
from mbd.tape.node import Scalar

PITCH = Domain(excluded=(0.0,), problem="makes the thread a hinge; use mbd.Revolute", unit="m")


@dataclass(frozen=True)
class Screw(Joint):
    """A nut on a thread: ``R = exp(angle [axis]×)``, ``p = pitch · angle/2π · axis``.

    Parameters
    ----------
    name, parent, child : its name and its two frames
    pitch : advance per turn [m], negative for a left-handed thread
    axis : direction in the parent frame; z by default
    loss : friction torque of the rate [N m]
    stiffness, rest : of a torsion spring [N m/rad, rad]

    Coordinates: `angle` [rad], over any number of turns.
    """

    name: str
    parent: Frame
    child: Frame
    pitch: float
    axis: Vector3 = Z
    _: KW_ONLY
    loss: JointLoss = field(default=None, hash=False)
    stiffness: float = 0.0
    rest: float = 0.0

    is_planar = False  # it turns about the direction in which it shifts

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", unit_vector(self.axis, f"axis of '{self.name}'"))
        object.__setattr__(self, "pitch", number(self.pitch, f"pitch of '{self.name}'"))
        faults = PITCH.faults(f"Screw '{self.name}'", "pitch", self.pitch)
        if faults:
            raise ModelError(faults)
        self.validate()

    @property
    def labels(self) -> tuple[Label, ...]:
        """`angle`."""
        return (Label("angle", "rad"),)

    def parameters(self) -> dict[str, float]:
        """`pitch`, and those of spring and loss."""
        return {f"{self.name}.pitch": self.pitch, **super().parameters()}

    def domains(self) -> dict[str, Domain]:
        """A pitch that is not 0, and those of the spring."""
        return {f"{self.name}.pitch": PITCH, **super().domains()}

    def advance(self, scope: Scope) -> Scalar:
        """Shift per angle, pitch/2π [m/rad]."""
        return scope.parameter(self.name, "pitch", self.pitch) * (0.5 / math.pi)

    def transform(self, q: Sequence[Scalar], scope: Scope) -> tuple[Rotation, Triple]:
        """A turn about the axis and the shift that goes with it."""
        return axis_rotation(self.axis, q[0]), scaled(self.advance(scope) * q[0], self.axis)

    def subspace(self, q: Sequence[Scalar], scope: Scope) -> Sequence[tuple[Triple, Triple]]:
        """ω = axis, v = pitch/2π · axis."""
        return [(self.axis, scaled(self.advance(scope), self.axis))]

    def rows(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[tuple[str, Scalar]]:
        """No place across the axis, the axes align, and the turn is that which belongs to the shift."""
        return [*across_rows(p, self.axis), *align_rows(R, self.axis), ("turn about", self._thread(R, p, scope)[1])]

    def recover(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[Scalar]:
        """The angle of the turn, with as many full turns as belong to the shift.

        Its virtual displacement is that of turning, so that what acts on it is a torque about the axis, as in a tree.
        """
        shift, off = self._thread(R, p, scope)
        return [shift + off]

    def _thread(self, R: Rotation, p: Triple, scope: Scope) -> tuple[Scalar, Scalar]:
        """The angle that belongs to the shift, and how far the turn is from it, between −π and π [rad]."""
        sine, cosine = sine_cosine(R, self.axis)
        shift = dot(self.axis, p) / self.advance(scope)
        c, s = cos(shift), sin(shift)
        off: Scalar = atan2(sine * c - cosine * s, cosine * c + sine * s)
        return shift, off
