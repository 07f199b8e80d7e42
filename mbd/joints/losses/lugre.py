"""Dry friction as bristles that bend and slip: the LuGre model."""

from typing import Any

from mbd.bodies.domains import Domain, positive
from mbd.bodies.scope import Scope
from mbd.bodies.values import number
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.joints.losses.base import DISSIPATES, Loss, StateRates
from mbd.tape.functions import exp
from mbd.tape.node import Node, Scalar

POSITIVE = positive()


@dataclass(frozen=True)
class LuGre(Loss):
    """Bristles: ``F = σ₀ z + σ₁ ż``, ``ż = v − σ₀ |v| z/g(v)``, ``g = T_k + (T_s − T_k) e^{−(v/v_s)²}``.

    z is their mean deflection. Before it slides the joint is a damped spring σ₀; it breaks away near T_s, later and
    higher the faster it is loaded, and its friction lags behind the speed. Steady sliding has the friction g(v) of
    `Stribeck`; a viscous part is ``+ mbd.Viscous(c)``. C. Canudas de Wit, H. Olsson, K. J. Åström & P. Lischinsky, A
    new model for control of systems with friction, IEEE Trans. Automat. Control 40 (1995) 419.

    With a constant σ₁ it takes energy along every motion only if ``c ≥ σ₁ (T_s − T_k)/T_k`` (N. Barahona & C. Canudas
    de Wit, ACC 2002), c the viscous coefficient beside it. With `damping_rate` v_d the damping is ``σ₁ e^{−(v/v_d)²}``
    and falls as it slides (H. Olsson, thesis, Lund 1996); short gains remain possible where v_d is not small.

    Parameters
    ----------
    static : T_s > 0, of slow sliding [N m or N]
    kinetic : T_k > 0, of fast sliding
    speed : v_s > 0, over which one becomes the other [rad/s or m/s]
    stiffness : σ₀ > 0 [N m/rad or N/m]
    damping : σ₁ ≥ 0 [N m s/rad or N s/m]
    damping_rate : None, or v_d > 0 [rad/s or m/s]

    The state is 'owner.deflection' [rad or m]. In steady sliding it relaxes with the rate σ₀ |v|/g, which dt must
    resolve in explicit schemes.
    """

    static: float
    kinetic: float
    speed: float
    stiffness: float
    damping: float = 0.0
    damping_rate: float | None = None

    def __post_init__(self) -> None:
        for field in ("static", "kinetic", "speed", "stiffness", "damping", "damping_rate"):
            if field != "damping_rate" or self.damping_rate is not None:
                object.__setattr__(self, field, number(getattr(self, field), f"{field} of LuGre"))
        faults = [fault for field, domain in self.domains().items()
                  for fault in domain.faults("LuGre", field, self.fields()[field])]  # fmt: skip
        if faults:
            raise ModelError(faults)

    def fields(self) -> dict[str, float]:
        """`static`, `kinetic`, `speed`, `stiffness`, `damping`, and `damping_rate` if there is one."""
        names = ("static", "kinetic", "speed", "stiffness", "damping")
        own = {name: float(getattr(self, name)) for name in names}
        return own | ({} if self.damping_rate is None else {"damping_rate": self.damping_rate})

    def domains(self) -> dict[str, Domain]:
        """σ₁ ≥ 0, all others > 0."""
        return dict.fromkeys(self.fields(), POSITIVE) | {"damping": DISSIPATES}

    def force(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """σ₀ z + σ₁ ż."""
        ((z, bending),) = self.rates(rate, scope, owner)
        damping: Scalar = scope.parameter(owner, "damping", self.damping)
        if self.damping_rate is not None:
            damping = damping * exp(-((rate / scope.parameter(owner, "damping_rate", self.damping_rate)) ** 2))
        return scope.parameter(owner, "stiffness", self.stiffness) * z + damping * bending

    def rates(self, rate: Scalar, scope: Scope, owner: str) -> StateRates:
        """ż = v − σ₀ |v| z/g(v)."""
        static, kinetic, speed, stiffness = (
            scope.parameter(owner, field, getattr(self, field)) for field in ("static", "kinetic", "speed", "stiffness")
        )
        z: Node = scope.state(owner, "deflection", 0.0)
        steady = kinetic + (static - kinetic) * exp(-((rate / speed) ** 2))
        fast: Any = abs(rate)
        return [(z, rate - stiffness * fast * z / steady)]

    def elastic(self, scope: Scope, owner: str) -> Scalar:
        """½ σ₀ z²."""
        z = scope.state(owner, "deflection", 0.0)
        return 0.5 * scope.parameter(owner, "stiffness", self.stiffness) * z * z
