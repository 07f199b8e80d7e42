"""Friction that rises or falls in proportion to the speed."""

from mbd.bodies.domains import Domain, positive
from mbd.bodies.scope import Scope
from mbd.bodies.values import number
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.joints.losses.base import Loss
from mbd.tape.functions import maximum, sqrt
from mbd.tape.node import Scalar

SMOOTHING = positive("is not positive; give the speed over which friction sets in")


@dataclass(frozen=True)
class AffineFriction(Loss):
    """``F = max(0, T + c s) v/s``, ``s = √(v² + ε²)``: the size T + c |v| against the motion, never along it.

    A damper told by its damping coefficient as ``T/|v| + c``. Where c is negative friction falls with speed and is 0
    beyond ``T/|c|``, where the straight line would feed energy in.

    Parameters
    ----------
    torque : T ≥ 0, of the slowest motion [N m or N]
    slope : c, of any sign [N m s/rad or N s/m]
    smoothing : ε, the speed over which friction sets in; at rest it creeps with about T/ε [rad/s or m/s]
    """

    torque: float
    slope: float
    smoothing: float

    def __post_init__(self) -> None:
        for field in ("torque", "slope", "smoothing"):
            object.__setattr__(self, field, number(getattr(self, field), f"{field} of AffineFriction"))
        faults = SMOOTHING.faults("AffineFriction", "smoothing", self.smoothing)
        if faults:
            raise ModelError(faults)

    def fields(self) -> dict[str, float]:
        """`torque`, `slope`, `smoothing`."""
        return {"torque": self.torque, "slope": self.slope, "smoothing": self.smoothing}

    def domains(self) -> dict[str, Domain]:
        """T ≥ 0, ε > 0, and any c: the friction is clamped at 0."""
        return super().domains() | {"slope": Domain(), "smoothing": SMOOTHING}

    def force(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """max(0, T + c s) v/s."""
        T, c, eps = (scope.parameter(owner, field, value) for field, value in self.fields().items())
        speed: Scalar = sqrt(rate * rate + eps * eps)
        size: Scalar = maximum(T + c * speed, 0.0)
        return size * rate / speed
