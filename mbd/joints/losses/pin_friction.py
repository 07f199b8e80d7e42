"""Dry friction of a pin in its bore."""

from mbd.bodies.scope import Scope
from mbd.bodies.values import number
from mbd.dataclass import dataclass
from mbd.joints.losses.base import Loss
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class PinFriction(Loss):
    """``F ∈ μ r N Sgn(v)`` with the resultant N of the force in the joint: it sticks while ``|F| ≤ μ r N``.

    N contains what friction itself adds to it, solved together with the motion. The joint is cut, so that multipliers
    carry its force. In an impact the impulse in the joint takes the place of N.

    Parameters
    ----------
    mu : coefficient of friction μ ≥ 0 between pin and bore [-]
    radius : of the pin, r ≥ 0 [m]
    """

    mu: float
    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "mu", number(self.mu, "mu of PinFriction"))
        object.__setattr__(self, "radius", number(self.radius, "radius of PinFriction"))

    @property
    def needs_reaction(self) -> bool:
        """Whether there is any: without, the joint need not be cut."""
        return self.mu != 0.0 and self.radius != 0.0

    def fields(self) -> dict[str, float]:
        """`mu` and `radius`; nothing where one is 0 and the joint is not cut, so that a run cannot change it."""
        return {"mu": self.mu, "radius": self.radius} if self.needs_reaction else {}

    def force(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """0: all of it sticks."""
        return 0.0

    def dry(self, load: Scalar, scope: Scope, owner: str) -> Scalar:
        """μ r N."""
        if not self.needs_reaction:
            return 0.0
        mu, radius = (scope.parameter(owner, field, value) for field, value in self.fields().items())
        return mu * radius * load
