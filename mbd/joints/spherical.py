"""The ball and socket."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, field

from mbd.bodies.algebra import IDENTITY, ZERO, dot
from mbd.bodies.base import Frame
from mbd.bodies.domains import Domain
from mbd.bodies.scope import Rotation, Scope, Triple
from mbd.dataclass import dataclass
from mbd.joints import quaternions
from mbd.joints.base import Joint, JointLoss, Label
from mbd.joints.losses.base import Loss
from mbd.joints.losses.isotropic import isotropic
from mbd.joints.parts import place_rows
from mbd.tape.node import Scalar

ORIENTATION = tuple(Label(f"orientation.{part}", "") for part in "wxyz")
ANGULAR_VELOCITY = tuple(Label(f"angular_velocity.{axis}", "rad/s") for axis in "xyz")


@dataclass(frozen=True)
class Spherical(Joint):
    """A ball and socket, which turns freely: ``R = R(orientation)``, ``p = 0``.

    It has no singular position: its coordinates are a unit quaternion, whose chart moves along (`mbd.configuration`),
    its velocities the angular velocity of the child against the parent in the child's axes.

    Parameters
    ----------
    name, parent, child : its name and its two frames
    loss : friction torque against the angular velocity, ``F(‖ω‖) ω/‖ω‖`` [N m]; `mbd.Coulomb(T)` and others that truly
        stick hold the joint while the torque that this takes is ``‖T‖ ≤ T_max``, about whatever axis; or by label,
        about single axes of the child: {'angular_velocity.x': Coulomb(0.1)}
    stiffness : k of an isotropic spring [N m/rad], ``V = ½ k θ²`` with θ the angle of the rotation, 0 ≤ θ ≤ π; give the
        child's frame a rotation for a spring that rests elsewhere, and use `mbd.Potential` of
        '<name>.rotation_vector.x', … for one that is not isotropic
    anatomy : the joint of the body that it is, such as 'left hip': results tell its angles by ISB, 'left hip.flexion'

    Coordinates: `orientation` (w, x, y, z) [-]. Velocities: `angular_velocity` (x, y, z) [rad/s].
    """

    name: str
    parent: Frame
    child: Frame
    _: KW_ONLY
    loss: JointLoss = field(default=None, hash=False)
    stiffness: float = 0.0
    anatomy: str = ""

    labels = ORIENTATION
    velocity_labels = ANGULAR_VELOCITY
    orientation = 0
    is_vector = False
    is_planar = False
    is_elastic = True
    defaults = (1.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        self.validate()

    def resistance(self, rates: Sequence[Scalar], scope: Scope) -> list[Scalar]:
        """One loss acts against ω, losses by label about their axes."""
        if isinstance(self.loss, Loss):
            return isotropic(self.loss, rates, scope, f"{self.name} loss")
        return super().resistance(rates, scope)

    @property
    def is_isotropic(self) -> bool:
        """Whether it has one loss."""
        return isinstance(self.loss, Loss)

    def transform(self, q: Sequence[Scalar], scope: Scope) -> tuple[Rotation, Triple]:
        """The rotation of the quaternion."""
        return quaternions.rotation_of(q), ZERO

    def subspace(self, q: Sequence[Scalar], scope: Scope) -> Sequence[tuple[Triple, Triple]]:
        """ω = x, y, z of the child."""
        return [(axis, ZERO) for axis in IDENTITY]

    def rows(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[tuple[str, Scalar]]:
        """The points coincide."""
        return place_rows(p)

    def recover(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[Scalar]:
        """The quaternion of R."""
        return quaternions.of_rotation(R)

    def elastic_energy(self, q: Sequence[Scalar], scope: Scope) -> Scalar:
        """½ k θ² [J]."""
        x, y, z = quaternions.rotation_vector(q)
        stiffness = scope.parameter(f"{self.name} spring", "stiffness", self.stiffness)
        return 0.5 * stiffness * dot((x, y, z), (x, y, z))

    def parameters(self) -> dict[str, float]:
        """`stiffness` of its spring, and those of its loss."""
        return {f"{self.name} spring.stiffness": self.stiffness, **super().parameters()}

    def domains(self) -> dict[str, Domain]:
        """A stiffness ≥ 0."""
        problem = "is negative; give a value ≥ 0, or an mbd.Potential where it shall drive away from its rest"
        return {f"{self.name} spring.stiffness": Domain(low=0.0, problem=problem, called="stiffness")}

    # the chart ----------------------------------------------------------------------------------------------------
    def compose(self, q: Sequence[Scalar], x: Sequence[Scalar]) -> Sequence[Scalar]:
        """q ⊗ exp(x/2)."""
        return quaternions.composed(q, x)

    def difference(self, q: Sequence[Scalar], other: Sequence[Scalar]) -> Sequence[Scalar]:
        """The rotation vector from q to the other, in the child's axes at q."""
        return quaternions.increment(q, other)

    def normalise(self, q: Sequence[Scalar]) -> Sequence[Scalar]:
        """q/|q|."""
        return quaternions.normalised(q)

    def coordinate_rates(self, q: Sequence[Scalar], v: Sequence[Scalar]) -> Sequence[Scalar]:
        """½ q ⊗ ω."""
        return quaternions.quaternion_rates(q, v)

    def increment_rates(self, x: Sequence[Scalar], v: Sequence[Scalar]) -> Sequence[Scalar]:
        """T⁻¹(x) ω."""
        return quaternions.increment_rates(x, v)

    def increment_velocities(self, x: Sequence[Scalar], rates: Sequence[Scalar]) -> Sequence[Scalar]:
        """T(x) ẋ."""
        return quaternions.increment_velocities(x, rates)
