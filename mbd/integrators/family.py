"""The Newmark family: Newmark, HHT and generalized-α as one scheme with four numbers.

True accelerations v̇ satisfy the balance and the rows at t₁; an auxiliary a carries the algorithmic average
(Arnold & Brüls 2007, Multibody Syst. Dyn. 18:185, eqs. 5–7)::

    (1−α_m) a₁ + α_m a₀ = (1−α_f) v̇₁ + α_f v̇₀
    q₁ = q₀ ⊕ [ dt v₀ + dt² ((½−β) a₀ + β a₁) + U ],   v₁ = v₀ + dt ((1−γ) a₀ + γ a₁)

First-order states follow the velocity formula with their own rates. With rows: index 3 enforces h(q₁) = 0;
the stabilized form (Gear, Gupta & Leimkuhler 1985) enforces ḣ = 0 as well, by a position correction U that is
normal to the rows in the metric of the Newton matrix. Rows on velocities are enforced as they are in both.
"""

from abc import abstractmethod
from typing import Any, ClassVar, Literal, TypeAlias

from mbd.bodies.values import among, is_number, shown
from mbd.errors import CapabilityError
from mbd.integrators.averaged import Coefficients
from mbd.integrators.base import CompiledIntegrator, System

DEFAULT_TOLERANCE = 1e-9
"""Largest residual of the balance, relative to the sum of its terms, at which Newton stops.

It is tightened to 1e-4 of the first Newton correction, which measures the error of the step itself, down to 1e-3 of
this value: the iteration error stays invisible beside the step error at every dt."""

Formulation: TypeAlias = Literal["ggl", "index3"]
Starting: TypeAlias = Literal["jerk", "consistent"]


class NewmarkFamily(CompiledIntegrator):
    """Base of the family: immutable values that print, compare and pickle by their parameters.

    Parameters
    ----------
    formulation : 'ggl' (default: position and velocity level) or 'index3' (position level only)
    start : 'jerk' (default: a₀ = v̇₀ + (α_m−α_f) dt j₀) or 'consistent' (a₀ = v̇₀, the textbook form)
    tolerance : of the balance, relative to the sum of its terms, at which Newton stops
    """

    any_chart: ClassVar[bool] = True
    scheme: ClassVar[str | None] = "newmark"
    form: Literal["endpoint", "averaged"] = "endpoint"
    formulation: Formulation
    starting: Starting
    tolerance: float

    def __init__(self, formulation: Formulation, start: Starting, tolerance: float, **own: Any) -> None:
        if not among(formulation, ("ggl", "index3")):
            raise CapabilityError(f"formulation is 'ggl' or 'index3', not {formulation!r}")
        if not among(start, ("jerk", "consistent")):
            raise CapabilityError(f"start is 'jerk' or 'consistent', not {start!r}")
        if not is_number(tolerance) or not 0.0 < tolerance < 1e-3:
            raise CapabilityError(
                f"tolerance must be a number between 0 and 1e-3, not {shown(tolerance)}; leave it out for 1e-9"
            )
        values = {**own, "formulation": formulation, "starting": start, "tolerance": float(tolerance)}
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"an integrator is a value; make a new {type(self).__name__} to change {name!r}")

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and vars(self) == vars(other)

    def __hash__(self) -> int:
        return hash((type(self), frozenset(vars(self).items())))

    def __repr__(self) -> str:
        defaults = {"formulation": "ggl", "starting": "jerk", "tolerance": DEFAULT_TOLERANCE, "form": "endpoint"}
        shown = [(k, v) for k, v in vars(self).items() if defaults.get(k) != v]
        words = ", ".join(f"{'start' if k == 'starting' else k}={v!r}" for k, v in shown)
        return f"{type(self).__name__}({words})"

    @property
    @abstractmethod
    def coefficients(self) -> Coefficients:
        """α_m, α_f, β, γ of the scheme."""

    @property
    def stabilized(self) -> bool:  # type: ignore[override]
        return self.formulation == "ggl"

    @property
    def exact(self) -> bool:
        """Without damping Newton iterates to round-off: a loose tolerance would bias energy over long runs."""
        return self.coefficients.undamped

    def numbers(self) -> dict[str, float]:
        """Its coefficients, and how it starts and ends its iterations."""
        c = self.coefficients
        return {
            "alpha_m": c.alpha_m, "alpha_f": c.alpha_f, "beta": c.beta, "gamma": c.gamma, "tolerance": self.tolerance,
            "jerk": int(self.starting == "jerk"), "exact": int(self.exact),
            "error_constant": 1.0 / 6.0 - c.beta - 0.5 * (c.alpha_m - c.alpha_f),
        }  # fmt: skip

    def order(self, system: System | None = None) -> int:
        """2 if γ = ½ + α_f − α_m, else 1."""
        return 2 if self.coefficients.second_order else 1

    def check(self, rows: int) -> str | None:
        """Undamped index 3 is refused: nothing damps its multipliers, whose error grows without bound."""
        if rows and self.formulation == "index3" and self.coefficients.undamped:
            return (
                f"{self!r} has no damping at infinite frequency, and with formulation='index3' its multipliers grow "
                "without bound; use formulation='ggl', HHT(alpha=0.05) or GeneralizedAlpha(rho_inf=0.9)"
            )
        return None

    def check_tolerance(self, rows: int) -> str | None:
        """Steps that change need order 2, rows the stabilized form: index 3 diverges under changing steps."""
        if self.order() < 2 or self.form != "endpoint":
            return f"{self!r} is of first order, which follows no tolerance; use dt=, or mbd.HHT(0.05)"
        if rows and not self.stabilized:
            return f"{self!r} diverges where steps change with rows on positions; use formulation='ggl', or dt="
        return None
