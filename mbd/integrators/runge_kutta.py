"""Explicit Runge–Kutta schemes; Dormand & Prince's of order 8 (1980, J. Comput. Appl. Math. 6:19)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.integrators.base import Integrator, Point, StepReport, StepResult, System, Terms, completed, consistent_rates
from mbd.kernel.schemes.dormand_prince import EIGHTH_ORDER
from mbd.kernel.schemes.tableau import Tableau
from mbd.state import Mode, State

__all__ = ["ExplicitRungeKutta", "RungeKutta853", "RungeKuttaMemory", "estimated_error"]

EPS = float(np.finfo(float).eps)
MOST_PROJECTIONS = 8
"""Newton corrections of positions onto the rows after a step; it takes one or two [-]."""


@dataclass(frozen=True)
class RungeKuttaMemory:
    """What the scheme keeps: consistent rates (n,) and multipliers (m,) at the state, and the error of the last step.

    error (n_v + n,): estimated local error of positions x [m, rad], then of (v, z)
    """

    rate: Vector
    lam: Vector
    error: Vector = field(default_factory=lambda: np.zeros(0))


class ExplicitRungeKutta(Integrator):
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
    between: ClassVar[str] = "stages"
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

    def start(self, system: System, state: State, mode: Mode, dt: float) -> RungeKuttaMemory:
        """Consistent rates and multipliers; the scheme remembers nothing else."""
        y = np.concatenate([state.v, state.z])
        rate, lam = consistent_rates(system, state.time, state.q, y, mode)
        return RungeKuttaMemory(rate, lam)

    def step(self, system: System, state: State, dt: float, mode: Mode, memory: RungeKuttaMemory) -> StepResult:
        """One step; the readable twin of the compiled kernel."""
        system, t1, n_v = completed(system), state.time + dt, len(state.v)
        y0 = np.concatenate([state.v, state.z])
        formula = self.tableau
        slopes = np.zeros((formula.stages + 1, n_v + len(y0)))
        slopes[0] = np.concatenate([state.v, memory.rate])
        try:
            for i in range(1, formula.stages):
                move = dt * (formula.weights[i, :i] @ slopes[:i])
                y = y0 + move[n_v:]
                q = system.compose(state.q, move[:n_v])
                rate, _ = consistent_rates(system, state.time + formula.nodes[i] * dt, q, y, mode)
                slopes[i] = np.concatenate([system.increment_rates(move[:n_v], y[:n_v]), rate])
            move = dt * (formula.end @ slopes[:-1])
            q1, y1 = system.compose(state.q, move[:n_v]), y0 + move[n_v:]
            if len(memory.lam):
                q1, y1 = projected(system, t1, q1, y1, len(memory.lam), mode)
            rate, lam = consistent_rates(system, t1, q1, y1, mode)
        except (np.linalg.LinAlgError, ArithmeticError) as failure:
            return StepResult(state, memory, StepReport(False, 1, np.inf, str(failure)))
        if not np.isfinite(np.concatenate([q1, y1, rate, lam])).all():
            return StepResult(state, memory, StepReport(False, 1, np.inf, "the state is not finite"))
        slopes[-1] = np.concatenate([system.increment_rates(move[:n_v], y1[:n_v]), rate])
        new = State(t1, q1, y1[:n_v], y1[n_v:], state.mode, state.armed, state.anchors, state.names,
                    state.velocity_names, {}, state.parameters)  # fmt: skip
        remembered = RungeKuttaMemory(rate, lam, estimated_error(formula, slopes, dt, n_v))
        return StepResult(new, remembered, StepReport(True, 1))

    def error_order(self) -> int:
        """One less than that of the formula: of order 8 the estimate falls with dt⁸ in a step."""
        return self.full_order - 1

    def check_tolerance(self, rows: int) -> str | None:
        """It follows any tolerance."""
        return None

    def local_error(self, old: Any, new: Any, dt: float) -> Vector:
        """The estimate made with the step."""
        return np.asarray(new.error)


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


def estimated_error(formula: Tableau, slopes: Matrix, dt: float, n_v: int) -> Vector:
    """Local error of a step by its embedded formulas, ``dt e₅ · |e₅| / √(|e₅|² + |e₃|²/100)`` (Hairer et al., II.10).

    The sizes |e| are the largest over positions and dt times velocities; first-order states have sizes of their own.
    """
    fifth, third = formula.error @ slopes, formula.second @ slopes
    n = (slopes.shape[1] - n_v) - n_v
    weights = np.concatenate([np.ones(n_v), np.full(n_v, dt), np.zeros(n)])
    parts = [weights > 0.0, *(np.arange(len(weights)) == k for k in range(2 * n_v, 2 * n_v + n))]
    error = np.zeros(len(weights))
    for part in parts:
        weight = np.where(weights[part] > 0.0, weights[part], 1.0)
        five, three = (float(np.max(weight * np.abs(e[part]), initial=0.0)) for e in (fifth, third))
        size = np.hypot(five, 0.1 * three)
        error[part] = dt * fifth[part] * (five / size if size > 0.0 else 0.0)
    return error


def projected(system: System, t: float, q: Vector, y: Vector, m: int, mode: Mode) -> tuple[Vector, Vector]:
    """The nearest positions with h = 0 and velocities with ḣ = 0, in the metric of M."""
    n, n_v, before = len(y), len(y) - system.n_z, np.inf
    for _ in range(MOST_PROJECTIONS):
        terms, matrix = _saddle(system, t, q, y, m, mode)
        held = np.zeros(m, dtype=bool) if terms.velocity is None else np.asarray(terms.velocity)
        h = np.where(held, 0.0, terms.h)
        floor = 16.0 * EPS * (1.0 if terms.scale_h is None else terms.scale_h)
        size = float(np.max(np.abs(h) / floor, initial=0.0))
        if size <= 1.0 or size >= before:
            break
        q = system.compose(q, -np.linalg.solve(matrix, np.concatenate([np.zeros(n), h]))[:n_v])
        before = size
    if size > 1e3:
        raise ArithmeticError(f"positions do not come back onto the rows: {size:.2g} times round-off is left")
    return q, y - np.linalg.solve(matrix, np.concatenate([np.zeros(n), terms.rate]))[:n]


def _saddle(system: System, t: float, q: Vector, y: Vector, m: int, mode: Mode) -> tuple[Terms, Matrix]:
    """``[M Bᵀ; B 0]`` and the terms, with zero accelerations and multipliers."""
    point = Point(t, q, np.zeros(len(y) - system.n_z), y, np.zeros(len(y)), np.zeros(m))
    terms = system.evaluate(point, mode, (0.0, 0.0))
    B = np.zeros((m, len(y)))
    H = np.asarray(terms.H)
    B[:, : H.shape[1]] = H
    return terms, np.block([[np.asarray(terms.S), B.T], [B, np.zeros((m, m))]])
