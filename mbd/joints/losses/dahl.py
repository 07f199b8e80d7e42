"""Dry friction as a spring that yields: Dahl's model."""

from typing import Any

from mbd.bodies.domains import Domain, positive
from mbd.bodies.scope import Scope
from mbd.bodies.values import number
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.joints.losses.base import Loss, StateRates
from mbd.tape.node import Scalar

YIELDS = positive("is not positive; give the friction of steady sliding, or leave the loss out")
STIFF = positive("is not positive; give the stiffness before it slides, or mbd.Coulomb for none")


@dataclass(frozen=True)
class Dahl(Loss):
    """Friction that remembers: ``F = σ z``, ``ż = v − (σ/T) |v| z``, z the deflection of the surface.

    Small swings bend it like a spring σ, with a loop of hysteresis; over a travel T/σ it becomes ``T sign v``. It has
    no stick, no events and no rate: the loop of a motion is the same at every speed. It stores ``½ σ z²`` and takes
    ``σ² |v| z²/T ≥ 0``. P. R. Dahl, A solid friction model, Aerospace Corp. TOR-0158(3107-18)-1 (1968), with the
    exponent 1.

    Parameters
    ----------
    torque : T > 0, friction of steady sliding [N m or N]
    stiffness : σ > 0, at rest [N m/rad or N/m]; its motion is as fast as ``√(σ/m)``, which dt must resolve

    The state is 'owner.deflection' [rad or m], 0 unless `assemble` says otherwise.
    """

    torque: float
    stiffness: float

    def __post_init__(self) -> None:
        for field in ("torque", "stiffness"):
            object.__setattr__(self, field, number(getattr(self, field), f"{field} of Dahl"))
        faults = [fault for field, domain in self.domains().items()
                  for fault in domain.faults("Dahl", field, self.fields()[field])]  # fmt: skip
        if faults:
            raise ModelError(faults)

    def fields(self) -> dict[str, float]:
        """`torque`, `stiffness`."""
        return {"torque": self.torque, "stiffness": self.stiffness}

    def domains(self) -> dict[str, Domain]:
        """T > 0, σ > 0."""
        return {"torque": YIELDS, "stiffness": STIFF}

    def force(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """σ z."""
        return scope.parameter(owner, "stiffness", self.stiffness) * scope.state(owner, "deflection", 0.0)

    def rates(self, rate: Scalar, scope: Scope, owner: str) -> StateRates:
        """ż = v − |v| σ z/T."""
        share = self.force(rate, scope, owner) / scope.parameter(owner, "torque", self.torque)
        speed: Any = abs(rate)
        return [(scope.state(owner, "deflection", 0.0), rate - speed * share)]

    def elastic(self, scope: Scope, owner: str) -> Scalar:
        """½ σ z²."""
        z = scope.state(owner, "deflection", 0.0)
        return 0.5 * scope.parameter(owner, "stiffness", self.stiffness) * z * z
