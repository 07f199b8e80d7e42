"""The generalized-α scheme (Chung & Hulbert 1993, J. Appl. Mech. 60:371)."""

from mbd.bodies.values import is_number, shown
from mbd.errors import CapabilityError
from mbd.integrators.averaged import Coefficients
from mbd.integrators.base import Integrator
from mbd.integrators.family import DEFAULT_TOLERANCE, Formulation, NewmarkFamily, Starting


class GeneralizedAlpha(NewmarkFamily):
    """The generalized-α scheme: the least low-frequency damping for a wanted damping of the fast modes.

    α_m = (2ρ−1)/(ρ+1), α_f = ρ/(ρ+1), γ = ½ + α_f − α_m, β = ¼(γ+½)² with ρ = ρ∞.

    Parameters
    ----------
    rho_inf : ρ∞ ∈ [0, 1], amplitude kept per step at infinite frequency (default 0.9); 1 damps nothing

    Raises
    ------
    CapabilityError
        for ρ∞ outside [0, 1].

    >>> GeneralizedAlpha(rho_inf=1.0).coefficients
    Coefficients(alpha_m=0.5, alpha_f=0.5, beta=0.25, gamma=0.5)
    """

    rho_inf: float

    def __init__(
        self,
        rho_inf: float = 0.9,
        *,
        formulation: Formulation = "ggl",
        start: Starting = "jerk",
        tolerance: float = DEFAULT_TOLERANCE,
    ) -> None:
        if not is_number(rho_inf) or not 0.0 <= rho_inf <= 1.0:
            raise CapabilityError(
                f"GeneralizedAlpha needs rho_inf between 0 and 1, not {shown(rho_inf)}; 0.9 is common"
            )
        super().__init__(formulation, start, tolerance, rho_inf=float(rho_inf))

    @classmethod
    def examples(cls) -> dict[str, tuple[Integrator, ...]]:
        """Those of the table of what goes with what."""
        return {
            "ggl": (cls(0.0), cls(1.0)),
            "index3, ρ∞ < 1": (cls(0.5, formulation="index3"),),
            "index3, ρ∞ = 1": (cls(1.0, formulation="index3"),),
        }

    @property
    def coefficients(self) -> Coefficients:
        rho = self.rho_inf
        alpha_m, alpha_f = (2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0)
        gamma = 0.5 + alpha_f - alpha_m
        return Coefficients(alpha_m, alpha_f, 0.25 * (gamma + 0.5) ** 2, gamma)
