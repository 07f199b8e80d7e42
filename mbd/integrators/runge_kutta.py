"""Explicit Runge–Kutta schemes; Dormand & Prince's of order 8 (1980, J. Comput. Appl. Math. 6:19)."""

from typing import ClassVar

from mbd.dataclass import dataclass
from mbd.integrators.base import CompiledIntegrator, Integrator, System, completed
from mbd.integrators.extension import STEPS_OF_ORDER_8, Extension
from mbd.kernel.schemes.dormand_prince import EIGHTH_ORDER
from mbd.kernel.schemes.tableau import Tableau


class ExplicitRungeKutta(CompiledIntegrator):
    """An explicit Runge–Kutta scheme with an embedded error estimate.

    ``ẋ = v``, ``(v̇, ż)`` from the balance and the rows at acceleration level, as often as the formula has stages::

        x_i = dt Σ_j a_ij ẋ_j,   y_i = y₀ + dt Σ_j a_ij rate_j,   rate_i = rate(t₀ + c_i dt, q₀ ⊕ x_i, y_i)
        q₁ = q₀ ⊕ dt Σ_i b_i ẋ_i,   y₁ = y₀ + dt Σ_i b_i rate_i

    with ẋ = v where positions add, else ``ẋ = D(x)⁻¹ v`` in the chart of the step (Munthe-Kaas 1999).

    Where rows are active, positions and velocities are projected onto them after each step, in the metric of M, which
    keeps the order (Hairer, Lubich & Wanner 2006, Geometric Numerical Integration, IV.4); accelerations and multipliers
    at the end are the consistent ones.
    """

    any_chart: ClassVar[bool] = True
    between: ClassVar[Extension | str] = STEPS_OF_ORDER_8
    """Between rows its steps are taken again."""
    tableau: ClassVar[Tableau]
    full_order: ClassVar[int]
    """Of the formula; its estimated error falls like that of a formula of one order less."""

    @classmethod
    def examples(cls) -> dict[str, tuple[Integrator, ...]]:
        """Those of the table of what goes with what."""
        return {cls.__name__: (cls(),)}

    def order(self, system: System | None = None) -> int:
        """That of the formula, with and without rows; 2 where positions do not add and a system does not tell ẋ."""
        return self.full_order if system is None or completed(system).follows_charts else 2

    def error_order(self) -> int:
        """One less than that of the formula: of order 8 the estimate falls with dt⁸ in a step."""
        return self.full_order - 1

    def check_tolerance(self, rows: int) -> str | None:
        """It follows any tolerance."""
        return None


@dataclass(frozen=True)
class RungeKutta853(ExplicitRungeKutta):
    """The explicit Runge–Kutta scheme of order 8 with embedded error estimates of orders 5 and 3.

    See `ExplicitRungeKutta`; it takes twelve accelerations a step. It suits smooth motion and tight tolerances. Stiff
    springs and dampers bound its step: with ω the largest frequency, ω dt < 5.96.

    It has no parameters: ``mbd.simulate(model, start, mbd.RungeKutta853(), tol=1e-9, until=10.0)``.
    """

    scheme: ClassVar[str | None] = "runge-kutta"
    tableau: ClassVar[Tableau] = EIGHTH_ORDER
    full_order: ClassVar[int] = 8
