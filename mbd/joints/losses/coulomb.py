"""Dry friction, truly sticking or smoothed."""

from mbd.bodies.domains import Domain, positive
from mbd.bodies.scope import Scope
from mbd.bodies.values import number
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.joints.losses.base import DissipationFunction, Loss
from mbd.tape.functions import sqrt
from mbd.tape.node import Scalar

SMOOTHING = positive("is not positive; try 0.01 rad/s, or None to truly stick")


@dataclass(frozen=True)
class Coulomb(DissipationFunction):
    """Dry friction ``F ∈ T Sgn(v)``: it sticks while ``|F| ≤ T`` and resists with T in motion.

    Set-valued, it holds the joint exactly where it comes to rest; stick and slip follow each other at located instants.
    With a smoothing ε > 0 it is ``D = T (√(v² + ε²) − ε)``, ``F = T v/√(v² + ε²)`` instead, a force like any other: far
    from rest it lacks a part ε²/(2 v²), at rest it creeps with the viscous coefficient T/ε.

    Parameters
    ----------
    torque : T ≥ 0, the friction torque or force [N m or N]
    smoothing : None, or the rate ε over which it sets in [rad/s or m/s]
    """

    torque: float
    smoothing: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "torque", number(self.torque, "torque of Coulomb"))
        if self.smoothing is None:
            return
        object.__setattr__(self, "smoothing", number(self.smoothing, "smoothing of Coulomb"))
        faults = SMOOTHING.faults("Coulomb", "smoothing", self.smoothing)
        if faults:
            raise ModelError(faults)

    @property
    def smooth(self) -> Loss | None:
        """Itself with a smoothing, else nothing."""
        return None if self.smoothing is None else self

    def fields(self) -> dict[str, float]:
        """`torque`, and `smoothing` if there is one."""
        return {"torque": self.torque} | ({} if self.smoothing is None else {"smoothing": self.smoothing})

    def domains(self) -> dict[str, Domain]:
        """T ≥ 0, ε > 0."""
        return super().domains() | ({} if self.smoothing is None else {"smoothing": SMOOTHING})

    def dissipation(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """T (√(v² + ε²) − ε); 0 where it truly sticks."""
        if self.smoothing is None:
            return 0.0
        T, eps = (scope.parameter(owner, field, value) for field, value in self.fields().items())
        root: Scalar = sqrt(rate * rate + eps * eps)
        return T * (root - eps)

    def force(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """T v/√(v² + ε²), the derivative of D in its shortest form; 0 where it truly sticks."""
        if self.smoothing is None:
            return 0.0
        T, eps = (scope.parameter(owner, field, value) for field, value in self.fields().items())
        root: Scalar = sqrt(rate * rate + eps * eps)
        return T * rate / root

    def dry(self, load: Scalar, scope: Scope, owner: str) -> Scalar:
        """T, where it truly sticks."""
        return scope.parameter(owner, "torque", self.torque) if self.smoothing is None else 0.0
