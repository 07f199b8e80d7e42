"""Newmark's scheme (Newmark 1959, J. Eng. Mech. Div. ASCE 85:67)."""

from mbd.bodies.values import is_number, shown
from mbd.errors import CapabilityError
from mbd.integrators.averaged import Coefficients
from mbd.integrators.base import Integrator
from mbd.integrators.family import DEFAULT_TOLERANCE, Formulation, NewmarkFamily, Starting

MAX_COEFFICIENT = 10.0
"""Coefficient above which the scheme is none: published ones have γ ≤ 3/2 and β ≤ 1 [-]."""


class Newmark(NewmarkFamily):
    """Newmark's scheme: α_m = α_f = 0.

    Parameters
    ----------
    beta : β > 0 (default ¼, the trapezoidal rule; 1/6 is linear acceleration)
    gamma : γ (default ½); order 2 only for ½, above it first-order damping

    Raises
    ------
    CapabilityError
        for γ < ½ (unstable), β ≤ 0, or either above 10.

    >>> Newmark().order()
    2
    >>> Newmark(beta=0.3025, gamma=0.6).order()
    1
    """

    beta: float
    gamma: float

    def __init__(
        self,
        beta: float = 0.25,
        gamma: float = 0.5,
        *,
        formulation: Formulation = "ggl",
        start: Starting = "jerk",
        tolerance: float = DEFAULT_TOLERANCE,
    ) -> None:
        good = is_number(beta) and is_number(gamma)
        if not good or not 0.5 <= gamma <= MAX_COEFFICIENT or not 0.0 < beta <= MAX_COEFFICIENT:
            raise CapabilityError(
                "Newmark needs gamma ≥ 1/2 (below it every step is unstable) and beta > 0, "
                f"neither above {MAX_COEFFICIENT:g}, not beta={shown(beta)}, gamma={shown(gamma)}; "
                "Newmark(0.25, 0.5) is the trapezoidal rule"
            )
        super().__init__(formulation, start, tolerance, beta=float(beta), gamma=float(gamma))

    @classmethod
    def examples(cls) -> dict[str, tuple[Integrator, ...]]:
        """Those of the table of what goes with what."""
        return {"ggl": (cls(), cls(0.31, 0.6)), "index3, ρ∞ = 1": (cls(formulation="index3"),)}

    @property
    def coefficients(self) -> Coefficients:
        return Coefficients(0.0, 0.0, self.beta, self.gamma)
