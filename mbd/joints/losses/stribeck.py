"""Dry friction that falls from its static to its kinetic size as sliding sets in."""

from mbd.bodies.domains import Domain, positive
from mbd.bodies.scope import Scope
from mbd.bodies.values import number
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.joints.losses.base import Loss
from mbd.tape.functions import exp
from mbd.tape.node import Scalar

SPEED = positive("is not positive; give the speed over which friction falls, or mbd.Coulomb for a constant one")


@dataclass(frozen=True)
class Stribeck(Loss):
    """Dry friction that sticks up to its static size and falls to its kinetic one as sliding sets in.

    ``|F| ≤ T_s`` at rest and ``F = (T_k + (T_s − T_k) e^{−(v/v_s)²}) v/|v|`` in motion (Armstrong-Hélouvry, Dupont &
    Canudas de Wit 1994, Automatica 30:1083, with the exponent 2). Where it falls steeply a drive through a soft spring
    sticks and slips. ``+ mbd.Viscous(c)`` lets it grow again.

    As ``friction=`` of a contact it is isotropic: T_s and T_k are coefficients per newton of normal force [-], v is the
    speed of the slip [m/s]. An impact has the coefficient of the slip before it.

    Parameters
    ----------
    static : T_s ≥ 0, the largest friction at rest [N m or N; -]
    kinetic : T_k ≥ 0, that of fast sliding [N m or N; -]
    speed : v_s > 0, over which one becomes the other [rad/s or m/s]
    """

    static: float
    kinetic: float
    speed: float

    def __post_init__(self) -> None:
        for field in ("static", "kinetic", "speed"):
            object.__setattr__(self, field, number(getattr(self, field), f"{field} of Stribeck"))
        faults = SPEED.faults("Stribeck", "speed", self.speed)
        if faults:
            raise ModelError(faults)

    def fields(self) -> dict[str, float]:
        """`static`, `kinetic`, `speed`."""
        return {"static": self.static, "kinetic": self.kinetic, "speed": self.speed}

    def domains(self) -> dict[str, Domain]:
        """T_s ≥ 0, T_k ≥ 0, v_s > 0."""
        return super().domains() | {"speed": SPEED}

    def force(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """0: all of it sticks, or slides as what had stuck."""
        return 0.0

    def dry(self, load: Scalar, scope: Scope, owner: str) -> Scalar:
        """T_s."""
        return scope.parameter(owner, "static", self.static)

    def sliding(self, load: Scalar, speed: Scalar, scope: Scope, owner: str) -> Scalar:
        """T_k + (T_s − T_k) e^{−(v/v_s)²}."""
        static, kinetic, rapid = (scope.parameter(owner, field, value) for field, value in self.fields().items())
        part: Scalar = exp(-(speed * speed) / (rapid * rapid))
        return kinetic + (static - kinetic) * part
