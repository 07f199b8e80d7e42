"""A hydraulic damper whose oil is compressed before it flows: the hysteresis of its valves."""

from typing import Any

from mbd.bodies.domains import Domain, positive
from mbd.bodies.scope import Scope
from mbd.bodies.values import number
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.joints.losses.base import DISSIPATES, Loss, StateRates
from mbd.tape.functions import sqrt
from mbd.tape.node import Scalar

LEAKS = positive("is not positive, so that nothing flows at small forces; give the leakage beside the orifice")
STIFF = positive("is not positive; give the stiffness of the oil, or mbd.Quadratic for oil that is not compressed")


@dataclass(frozen=True)
class CompressibleDamper(Loss):
    """``F = k z``, ``ż = v − w``, w the rate at which oil flows: ``F = c w + b |w| w``.

    An orifice b with leakage c in series with the oil's compressibility k: the force lags behind the rate by c/k (less
    at large forces), so that force over rate is a loop with two different forces at the same rate, and a reversal takes
    the travel F/k. Slow motion has the force ``c v + b |v| v``. It stores ``½ k z²`` and takes ``F w ≥ 0``. Different
    valves for each direction are ``mbd.Valves(backward=…, forward=…)``. C. J. Besinger, D. Cebon & D. J. Cole, Damper
    models for heavy vehicle ride dynamics, Vehicle System Dynamics 24 (1995) 35: a nonlinear damper in series with a
    spring.

    Parameters
    ----------
    viscous : c > 0, leakage and laminar flow [N m s/rad or N s/m]
    quadratic : b ≥ 0, of the orifice [N m s²/rad² or N s²/m²]
    stiffness : k > 0, of the oil and hoses [N m/rad or N/m]; explicit schemes must resolve c/k

    The state is 'owner.deflection' [rad or m], 0 unless `assemble` says otherwise.
    """

    viscous: float
    quadratic: float
    stiffness: float

    def __post_init__(self) -> None:
        for field in ("viscous", "quadratic", "stiffness"):
            object.__setattr__(self, field, number(getattr(self, field), f"{field} of CompressibleDamper"))
        faults = [fault for field, domain in self.domains().items()
                  for fault in domain.faults("CompressibleDamper", field, self.fields()[field])]  # fmt: skip
        if faults:
            raise ModelError(faults)

    def fields(self) -> dict[str, float]:
        """`viscous`, `quadratic`, `stiffness`."""
        return {"viscous": self.viscous, "quadratic": self.quadratic, "stiffness": self.stiffness}

    def domains(self) -> dict[str, Domain]:
        """c > 0, b ≥ 0, k > 0."""
        return {"viscous": LEAKS, "quadratic": DISSIPATES, "stiffness": STIFF}

    def force(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """k z."""
        return scope.parameter(owner, "stiffness", self.stiffness) * scope.state(owner, "deflection", 0.0)

    def rates(self, rate: Scalar, scope: Scope, owner: str) -> StateRates:
        """``ż = v − w`` with ``w = 2 F/(c + √(c² + 4 b |F|))``."""
        force: Any = self.force(rate, scope, owner)
        viscous = scope.parameter(owner, "viscous", self.viscous)
        quadratic = scope.parameter(owner, "quadratic", self.quadratic)
        flow = 2.0 * force / (viscous + sqrt(viscous * viscous + 4.0 * quadratic * abs(force)))
        return [(scope.state(owner, "deflection", 0.0), rate - flow)]

    def elastic(self, scope: Scope, owner: str) -> Scalar:
        """½ k z²."""
        z = scope.state(owner, "deflection", 0.0)
        return 0.5 * scope.parameter(owner, "stiffness", self.stiffness) * z * z
