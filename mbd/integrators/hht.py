"""Hilber, Hughes & Taylor's scheme (1977, Earthq. Eng. Struct. Dyn. 5:283)."""

from typing import ClassVar, Literal

from mbd.bodies.values import among, is_number, shown
from mbd.errors import CapabilityError
from mbd.integrators.averaged import AveragedStep, Coefficients
from mbd.integrators.base import Integrator, StepResult, System, completed
from mbd.integrators.family import DEFAULT_TOLERANCE, Formulation, NewmarkFamily, Starting
from mbd.integrators.stepping import SchemeMemory
from mbd.state import Mode, State


class HHT(NewmarkFamily):
    """The HHT scheme: α_m = 0, α_f = α, γ = ½ + α, β = (1+α)²/4.

    Parameters
    ----------
    alpha : α ∈ [0, 1/3], numerical damping of the fast modes; ρ∞ = (1−α)/(1+α) (default 0.05)
    form : 'endpoint' (default): balance and rows hold at t₁, order 2. 'averaged': the classical form that
        averages f and Bᵀλ over the step but not M(q); order 1 unless M is constant.

    Raises
    ------
    CapabilityError
        for α outside [0, 1/3].

    >>> HHT(alpha=0.05).coefficients
    Coefficients(alpha_m=0.0, alpha_f=0.05, beta=0.275625, gamma=0.55)
    """

    scheme: ClassVar[str | None] = "newmark"
    alpha: float
    form: Literal["endpoint", "averaged"]

    def __init__(
        self,
        alpha: float = 0.05,
        form: Literal["endpoint", "averaged"] = "endpoint",
        *,
        formulation: Formulation | None = None,
        start: Starting = "jerk",
        tolerance: float = DEFAULT_TOLERANCE,
    ) -> None:
        if not is_number(alpha) or not 0.0 <= alpha <= 1.0 / 3.0:
            raise CapabilityError(f"HHT needs alpha between 0 and 1/3, not {shown(alpha)}; 0.05 is common")
        if not among(form, ("endpoint", "averaged")):
            raise CapabilityError(f"form is 'endpoint' or 'averaged', not {form!r}")
        if form == "averaged" and formulation == "ggl":
            raise CapabilityError("HHT(form='averaged') enforces rows at position level; use formulation='index3'")
        chosen: Formulation = formulation if formulation is not None else ("index3" if form == "averaged" else "ggl")
        super().__init__(chosen, start, tolerance, alpha=float(alpha), form=form)

    @classmethod
    def examples(cls) -> dict[str, tuple[Integrator, ...]]:
        """Those of the table of what goes with what."""
        return {
            "ggl": (cls(0.05),),
            "index3, ρ∞ < 1": (cls(0.05, formulation="index3"),),
            "HHT averaged": (cls(0.05, form="averaged"),),
        }

    @property
    def coefficients(self) -> Coefficients:
        return Coefficients(0.0, self.alpha, 0.25 * (1.0 + self.alpha) ** 2, 0.5 + self.alpha)

    @property
    def compiled_scheme(self) -> str | None:
        """That of the family; the averaged form is written in Python only."""
        return super().compiled_scheme if self.form == "endpoint" else None

    def order(self, system: System | None = None) -> int:
        """2; the averaged form has 1 unless the system says that its mass matrix is constant."""
        constant = system is not None and completed(system).constant_mass
        if self.form == "averaged" and self.alpha > 0.0 and not constant:
            return 1
        return super().order(system)

    def step(self, system: System, state: State, dt: float, mode: Mode, memory: SchemeMemory) -> StepResult:
        """One step of the kernel's scheme; for the averaged form that of `AveragedStep`."""
        if self.form == "averaged":
            return AveragedStep(self.coefficients, self.tolerance, system, state, dt, mode, memory).run()
        return super().step(system, state, dt, mode, memory)
