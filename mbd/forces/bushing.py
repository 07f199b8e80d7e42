"""An elastic joint: springs and dampers in all six directions between two frames."""

from typing import Any

from mbd.bodies.algebra import cross, difference, product, rotate, scaled, total, transpose
from mbd.bodies.base import Frame
from mbd.bodies.domains import Domain, at_least_zero
from mbd.bodies.given import Numbers
from mbd.bodies.scope import Rotation, Scope, Triple
from mbd.bodies.values import is_number, name_of, number, shown, triple
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.base import Action, Force, Result, frame_of
from mbd.forces.quantities import Mention
from mbd.joints.quaternions import increment_rates, of_rotation, rotation_vector
from mbd.tape.functions import atan2
from mbd.tape.node import Node, Scalar

FIELDS = ("stiffness", "rotational_stiffness", "damping", "rotational_damping")


@dataclass(frozen=True)
class Bushing(Force):
    """Springs and dampers between two frames, along and about the axes of the first.

    ``V = ½ Σ k_i d_i² + ½ Σ κ_i φ_i²`` with ``d = R_aᵀ (p_b − p_a)`` and φ the rotation vector of ``R_aᵀ R_b``, half a
    turn long at most; ``D = ½ Σ c_i ḋ_i² + ½ Σ γ_i ω_i²`` with ḋ the rate of d and ω the angular velocity of b
    against a in the axes of a. In a planar mechanism it is two springs and one about z, of the angle between −π and π.

    Parameters
    ----------
    name : its name
    a, b : frames of two bodies, which coincide where it rests
    stiffness : k along x, y, z [N/m], one number for all three or a triple
    rotational_stiffness : κ about x, y, z [N m/rad], likewise
    damping : c [N s/m], likewise
    rotational_damping : γ [N m s/rad], likewise

    Results: 'name.force' [N] and 'name.torque' [N m] on b by a, at the origin of b, in ground axes; 'name.force.a' and
    'name.torque.a', the same in the axes of a, in which it is stiff; 'name.offset', d; 'name.rotation_vector', φ.
    Body a feels the opposite of both, at the same place.

    Raises
    ------
    ModelError
        for negative values, all of them at once.
    """

    name: str
    a: Frame
    b: Frame
    stiffness: float | Numbers = 0.0
    rotational_stiffness: float | Numbers = 0.0
    damping: float | Numbers = 0.0
    rotational_damping: float | Numbers = 0.0

    def __post_init__(self) -> None:
        name_of(self.name, "Bushing")
        frame_of(self.a, f"first frame of Bushing '{self.name}'")
        frame_of(self.b, f"second frame of Bushing '{self.name}'")
        for field in FIELDS:
            object.__setattr__(self, field, _three(getattr(self, field), f"{field} of '{self.name}'"))
        wrong = self.value_faults(self.parameters())
        if wrong:
            raise ModelError(wrong)

    @property
    def kind(self) -> str:
        """'potential', or 'loss' with dampers; the energy of its springs is kept apart from what these take."""
        dampers: tuple[Any, ...] = self.damping, self.rotational_damping
        return "loss" if any(map(any, dampers)) else "potential"

    def mentions(self) -> list[Mention]:
        """Its frames."""
        return [self.a, self.b]

    def parameters(self) -> dict[str, float]:
        """'name.stiffness.x', …, 'name.rotational_damping.z'."""
        return {
            f"{self.name}.{field}.{axis}": value
            for field in FIELDS
            for axis, value in zip("xyz", getattr(self, field), strict=True)
        }

    def domains(self) -> dict[str, Domain]:
        """All of them ≥ 0."""
        return {name: at_least_zero() for name in self.parameters()}

    @property
    def known_as(self) -> str:
        """ "bushing 'ankle'"."""
        return f"bushing '{self.name}'"

    def faults(self) -> list[str]:
        """Frames of one body."""
        faults = super().faults()
        if self.a.body is self.b.body:
            faults.append(f"bushing '{self.name}': both frames are on '{self.a.body.name}', so it does nothing")
        return faults

    def act(self, scope: Scope) -> Action:
        """Its potential and its dissipation."""
        k, turning = self._values(scope, "stiffness"), self._values(scope, "rotational_stiffness")
        c, slowing = self._values(scope, "damping"), self._values(scope, "rotational_damping")
        energy: Scalar = 0.0
        for stiffnesses, offsets in ((k, self._offset), (turning, self._turn)):
            if not all(each.is_zero for each in stiffnesses):
                energy = energy + _quadratic(stiffnesses, offsets(scope))
        loss: Scalar = 0.0
        for coefficients, rates in ((c, self._offset_rate), (slowing, self._turn_rate)):
            if not all(each.is_zero for each in coefficients):
                loss = loss + _quadratic(coefficients, rates(scope))
        return Action(
            potential=None if isinstance(energy, float) else energy,
            dissipation=None if isinstance(loss, float) else loss,
        )

    def results(self) -> dict[str, Result]:
        """'force' and 'torque' on b at its origin in ground axes, with '.a' in those of a; there too 'offset' d [m] and
        'rotation_vector' φ [rad].
        """
        parts = {
            "force": self._force,
            "torque": self._torque,
            "force.a": self._own_force,
            "torque.a": self._own_torque,
            "offset": self._offset,
            "rotation_vector": self._turn,
        }
        return {field: Result(value, is_vector=True) for field, value in parts.items()}

    def _values(self, scope: Scope, field: str) -> list[Node]:
        given = getattr(self, field)
        return [scope.parameter(f"{self.name}.{field}", axis, value) for axis, value in zip("xyz", given, strict=True)]

    def _force(self, scope: Scope) -> Triple:
        return rotate(scope.frame(self.a).rotation, self._own_force(scope))

    def _torque(self, scope: Scope) -> Triple:
        return rotate(scope.frame(self.a).rotation, self._own_torque(scope))

    def _own_force(self, scope: Scope) -> Triple:
        """−K d − C ḋ."""
        pull = _products(self._values(scope, "stiffness"), self._offset(scope))
        return scaled(-1.0, total(pull, _products(self._values(scope, "damping"), self._offset_rate(scope))))

    def _own_torque(self, scope: Scope) -> Triple:
        """−T⁻¹(φ) K φ − Γ ω: with φ̇ = T⁻ᵀ(φ) ω, ω in the axes of a, the first does the work of −K φ on φ̇."""
        turn = self._turn(scope)
        moment = _products(self._values(scope, "rotational_stiffness"), turn)
        if not (_is_zero(turn[0]) and _is_zero(turn[1])):
            x, y, z = increment_rates(turn, moment)
            moment = (x, y, z)
        slowing = _products(self._values(scope, "rotational_damping"), self._turn_rate(scope))
        return scaled(-1.0, total(moment, slowing))

    def _offset(self, scope: Scope) -> Triple:
        a, b = scope.frame(self.a), scope.frame(self.b)
        return rotate(transpose(a.rotation), difference(b.position, a.position))

    def _turn(self, scope: Scope) -> Triple:
        a, b = scope.frame(self.a), scope.frame(self.b)
        R = product(transpose(a.rotation), b.rotation)
        if _is_flat(R):
            return (0.0, 0.0, atan2(R[1][0], R[0][0]))
        x, y, z = rotation_vector(of_rotation(R))
        return (x, y, z)

    def _offset_rate(self, scope: Scope) -> Triple:
        a, b = scope.frame(self.a), scope.frame(self.b)
        carried = total(a.velocity, cross(a.angular_velocity, difference(b.position, a.position)))
        return rotate(transpose(a.rotation), difference(b.velocity, carried))

    def _turn_rate(self, scope: Scope) -> Triple:
        a, b = scope.frame(self.a), scope.frame(self.b)
        return rotate(transpose(a.rotation), difference(b.angular_velocity, a.angular_velocity))


def _three(value: Any, what: str) -> tuple[float, float, float]:
    """One number for all three axes, or three."""
    if is_number(value):
        one = number(value, what)
        return (one, one, one)
    if isinstance(value, str) or not hasattr(value, "__len__"):
        raise ModelError(f"{what} must be a number, or three along x, y, z; got {shown(value)}")
    if len(value) == 2:  # of a place the third would be 0
        raise ModelError(f"{what} must be a number, or three along x, y, z; got two: {shown(value)}")
    return triple(value, what)


def _quadratic(factors: list[Node], parts: Triple) -> Scalar:
    """½ Σ factor part²."""
    found: Scalar = 0.0
    for factor, part in zip(factors, parts, strict=True):
        found = found + 0.5 * factor * part * part
    return found


def _products(factors: list[Node], parts: Triple) -> Triple:
    """factor part, each."""
    x, y, z = (factor * part for factor, part in zip(factors, parts, strict=True))
    return (x, y, z)


def _is_zero(part: Scalar) -> bool:
    return part == 0.0 if isinstance(part, float) else part.is_zero


def _is_flat(R: Rotation) -> bool:
    """Whether a rotation is about z for certain."""
    return all(map(_is_zero, (R[0][2], R[1][2], R[2][0], R[2][1])))
