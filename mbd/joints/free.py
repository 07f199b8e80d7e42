"""A body that floats."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, field

from mbd.bodies.algebra import IDENTITY, ZERO, rotate, transpose
from mbd.bodies.base import Frame
from mbd.bodies.scope import Rotation, Scope, Triple
from mbd.dataclass import dataclass
from mbd.joints import quaternions
from mbd.joints.base import Joint, JointLoss, Label
from mbd.joints.spherical import ANGULAR_VELOCITY, ORIENTATION
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class Free(Joint):
    """All six motions, as of a floating trunk: ``R = R(orientation)``, ``p = (x, y, z)``.

    Parameters
    ----------
    name, parent, child : its name and its two frames
    loss : by label, such as {'x': Viscous(2.0), 'angular_velocity.z': Viscous(0.1)}

    Coordinates: `x`, `y`, `z` of the child's frame in the parent's [m], `orientation` (w, x, y, z), a unit quaternion
    [-]. Velocities: `x.rate`, `y.rate`, `z.rate` [m/s], `angular_velocity` (x, y, z) of the child in its own axes
    [rad/s].
    """

    name: str
    parent: Frame
    child: Frame
    _: KW_ONLY
    loss: JointLoss = field(default=None, hash=False)

    orientation = 3
    adding = 3
    is_vector = False
    is_planar = False
    defaults = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        self.validate()

    @property
    def labels(self) -> tuple[Label, ...]:
        """`x`, `y`, `z`, `orientation.w`, `.x`, `.y`, `.z`."""
        return (*(Label(axis, "m") for axis in "xyz"), *ORIENTATION)

    @property
    def velocity_labels(self) -> tuple[Label, ...]:
        """`x.rate`, `y.rate`, `z.rate`, `angular_velocity.x`, `.y`, `.z`."""
        return (*(Label(f"{axis}.rate", "m/s") for axis in "xyz"), *ANGULAR_VELOCITY)

    def transform(self, q: Sequence[Scalar], scope: Scope) -> tuple[Rotation, Triple]:
        """A shift, then the rotation of the quaternion."""
        return quaternions.rotation_of(q[3:]), (q[0], q[1], q[2])

    def subspace(self, q: Sequence[Scalar], scope: Scope) -> Sequence[tuple[Triple, Triple]]:
        """v = Rᵀ x, Rᵀ y, Rᵀ z, and ω = x, y, z of the child."""
        back = transpose(quaternions.rotation_of(q[3:]))
        return [*((ZERO, rotate(back, axis)) for axis in IDENTITY), *((axis, ZERO) for axis in IDENTITY)]

    def rows(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[tuple[str, Scalar]]:
        """None."""
        return []

    def recover(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[Scalar]:
        """The place, and the quaternion of R."""
        return [*p, *quaternions.of_rotation(R)]

    # the chart ----------------------------------------------------------------------------------------------------
    def compose(self, q: Sequence[Scalar], x: Sequence[Scalar]) -> Sequence[Scalar]:
        """p + x, q ⊗ exp(x/2)."""
        return [*(a + b for a, b in zip(q[:3], x[:3], strict=True)), *quaternions.composed(q[3:], x[3:])]

    def difference(self, q: Sequence[Scalar], other: Sequence[Scalar]) -> Sequence[Scalar]:
        """The shift, and the rotation vector from q to the other."""
        return [*(b - a for a, b in zip(q[:3], other[:3], strict=True)), *quaternions.increment(q[3:], other[3:])]

    def normalise(self, q: Sequence[Scalar]) -> Sequence[Scalar]:
        """The place, and a quaternion of length 1."""
        return [*q[:3], *quaternions.normalised(q[3:])]

    def coordinate_rates(self, q: Sequence[Scalar], v: Sequence[Scalar]) -> Sequence[Scalar]:
        """ṗ, ½ q ⊗ ω."""
        return [*v[:3], *quaternions.quaternion_rates(q[3:], v[3:])]

    def increment_rates(self, x: Sequence[Scalar], v: Sequence[Scalar]) -> Sequence[Scalar]:
        """ṗ, T⁻¹(x) ω."""
        return [*v[:3], *quaternions.increment_rates(x[3:], v[3:])]

    def increment_velocities(self, x: Sequence[Scalar], rates: Sequence[Scalar]) -> Sequence[Scalar]:
        """ṗ, T(x) ẋ."""
        return [*rates[:3], *quaternions.increment_velocities(x[3:], rates[3:])]
