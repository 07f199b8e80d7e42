"""The Newmark family: Newmark, HHT and generalized-α as one scheme with four numbers.

True accelerations v̇ satisfy the balance and the rows at t₁; an auxiliary a carries the algorithmic average
(Arnold & Brüls 2007, Multibody Syst. Dyn. 18:185, eqs. 5–7)::

    (1−α_m) a₁ + α_m a₀ = (1−α_f) v̇₁ + α_f v̇₀
    q₁ = q₀ ⊕ [ dt v₀ + dt² ((½−β) a₀ + β a₁) + U ],   v₁ = v₀ + dt ((1−γ) a₀ + γ a₁)

First-order states follow the velocity formula with their own rates. With rows: index 3 enforces h(q₁) = 0;
the stabilized form (Gear, Gupta & Leimkuhler 1985) enforces ḣ = 0 as well, by a position correction U that is
normal to the rows in the metric of the Newton matrix. Rows on velocities are enforced as they are in both.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from mbd.arrays import Vector
from mbd.bodies.values import is_number
from mbd.errors import CapabilityError
from mbd.integrators.base import Integrator, Point, StepReport, StepResult, System, Terms, consistent_rates
from mbd.integrators.passage import CONTINUOUS, WHOLE, WITHIN, Distance, distance_to_pose
from mbd.kernel.fields import LEFT, PASSING
from mbd.state import Mode, State

__all__ = ["Coefficients", "DEFAULT_TOLERANCE", "Formulation", "NewmarkFamily", "NewmarkMemory", "Starting"]

EPS = float(np.finfo(float).eps)
DEFAULT_TOLERANCE = 1e-9
"""Largest residual of the balance, relative to the sum of its terms, at which Newton stops.

It is tightened to 1e-4 of the first Newton correction, which measures the error of the step itself, down to 1e-3 of
this value: the iteration error stays invisible beside the step error at every dt."""
MAX_ITERATIONS = 50
"""Newton iterations, halvings included, after which a step counts as failed; one that converges takes one to three."""
MOST_HALVINGS = 10
"""How often a Newton correction is halved before the iteration goes on from where it is."""
FAR = 1e4
"""Residual over its tolerance above which a correction that does not reduce it is halved."""

Formulation: TypeAlias = Literal["ggl", "index3"]
Starting: TypeAlias = Literal["jerk", "consistent"]


@dataclass(frozen=True)
class Coefficients:
    """α_m, α_f, β, γ."""

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float

    @property
    def second_order(self) -> bool:
        """γ = ½ + α_f − α_m."""
        return abs(self.gamma - 0.5 - self.alpha_f + self.alpha_m) < 1e-12

    @property
    def undamped(self) -> bool:
        """Spectral radius 1 at infinite frequency (ρ∞ = 1): nothing damps the round-off of the multipliers."""
        return abs(self.rho_inf - 1.0) < 1e-9

    @property
    def rho_inf(self) -> float:
        """Spectral radius of the amplification matrix as ω dt → ∞."""
        beta, gamma = self.beta, self.gamma
        half, product = 0.5 * (0.5 + gamma - 2.0 * beta) / beta, (0.5 - gamma + beta) / beta
        split = half * half - product  # of the roots of z² + 2 half z + product; complex or double where it is not > 0
        pair = float(np.sqrt(product)) if split <= 1e-14 * half * half else abs(half) + float(np.sqrt(split))
        return max(abs(self.alpha_f / (1.0 - self.alpha_f)), pair)


@dataclass(frozen=True)
class NewmarkMemory:
    """What the scheme keeps between steps.

    rate (n,) true v̇ and ż; aux (n,) the auxiliary a for steps of size `step`; lam (m,) multipliers;
    slope, lam_slope: their last rates of change, which predict the next step; shift (n_v,) the position correction and
    shift_change what it changed by in the last step; near 1 within a few steps of a pose in which rows lose rank, and 2
    just beyond it, where the scheme is started again; whole: the dt that steps have unless they must not [s].
    """

    rate: Vector
    aux: Vector
    lam: Vector
    slope: Vector
    lam_slope: Vector
    shift: Vector
    shift_change: Vector
    step: float
    near: int = 0
    whole: float = 0.0


class NewmarkFamily(Integrator):
    """Base of the family: immutable values that print, compare and pickle by their parameters.

    Parameters
    ----------
    formulation : 'ggl' (default: position and velocity level) or 'index3' (position level only)
    start : 'jerk' (default: a₀ = v̇₀ + (α_m−α_f) dt j₀) or 'consistent' (a₀ = v̇₀, the textbook form)
    tolerance : of the balance, relative to the sum of its terms, at which Newton stops
    """

    formulation: Formulation
    starting: Starting
    tolerance: float

    def __init__(self, formulation: Formulation, start: Starting, tolerance: float, **own: Any) -> None:
        if formulation not in ("ggl", "index3"):
            raise CapabilityError(f"formulation is 'ggl' or 'index3', not {formulation!r}")
        if start not in ("jerk", "consistent"):
            raise CapabilityError(f"start is 'jerk' or 'consistent', not {start!r}")
        if not is_number(tolerance) or not 0.0 < tolerance < 1e-3:
            raise CapabilityError(
                f"tolerance must be a number between 0 and 1e-3, not {tolerance!r}; leave it out for 1e-9"
            )
        values = {**own, "formulation": formulation, "starting": start, "tolerance": float(tolerance)}
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"an integrator is a value; make a new {type(self).__name__} to change {name!r}")

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and vars(self) == vars(other)

    def __hash__(self) -> int:
        return hash((type(self), *sorted(vars(self).items())))

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
    def stabilized(self) -> bool:
        return self.formulation == "ggl"

    @property
    def exact(self) -> bool:
        """Without damping Newton iterates to round-off: a loose tolerance would bias energy over long runs."""
        return self.coefficients.undamped

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
        if self.order() < 2 or getattr(self, "form", "endpoint") != "endpoint":
            return f"{self!r} is of first order, which follows no tolerance; use dt=, or mbd.HHT(0.05)"
        if rows and not self.stabilized:
            return f"{self!r} diverges where steps change with rows on positions; use formulation='ggl', or dt="
        return None

    def local_error(self, old: NewmarkMemory, new: NewmarkMemory, dt: float) -> Vector:
        """``dt² (1/6 − β − (α_m − α_f)/2) (a₁ − a₀)`` of x; of (v, z) ``dt²/12`` times the change of slope."""
        c, n_v = self.coefficients, len(new.shift)
        a0 = old.rate + dt / old.step * (old.aux - old.rate)
        x = dt * dt * (1.0 / 6.0 - c.beta - 0.5 * (c.alpha_m - c.alpha_f)) * (new.aux - a0)[:n_v]
        return np.concatenate([x, dt * dt / 12.0 * ((new.rate - old.rate) / dt - old.slope)])

    def start(self, system: System, state: State, mode: Mode, dt: float) -> NewmarkMemory:
        """a₀ = v̇₀ + (α_m−α_f) dt j₀ with the jerk j₀ from one difference of consistent accelerations."""
        y = np.concatenate([state.v, state.z])
        n_v = len(state.v)
        rate, lam = consistent_rates(system, state.time, state.q, y, mode)
        ahead = dt / 16.0
        q = _compose(system, state.q, ahead * state.v)
        later, lam_later = consistent_rates(system, state.time + ahead, q, y + ahead * rate, mode)
        slope, lam_slope = (later - rate) / ahead, (lam_later - lam) / ahead
        c = self.coefficients
        jerk = (c.alpha_m - c.alpha_f) * dt if self.starting == "jerk" else 0.0
        return NewmarkMemory(rate, rate + jerk * slope, lam, slope, lam_slope, np.zeros(n_v), np.zeros(n_v), dt, 0, dt)

    def resume(self, system: System, state: State, mode: Mode, dt: float, memory: NewmarkMemory) -> NewmarkMemory:
        """A start, but that a keeps its distance from v̇, as beyond a pose in which rows lost rank."""
        fresh = self.start(system, state, mode, dt)
        return replace(fresh, aux=fresh.rate + (dt / memory.step) * (memory.aux - memory.rate))

    def step(self, system: System, state: State, dt: float, mode: Mode, memory: NewmarkMemory) -> StepResult:
        """One step by Newton's method; the readable twin of the compiled kernel."""
        if memory.near == LEFT:
            memory = self.resume(system, state, mode, memory.whole or dt, memory)
        return _Step(self, system, state, dt, mode, memory).run()


def _compose(system: System, q: Vector, x: Vector) -> Vector:
    own = getattr(system, "compose", None)
    return own(q, x) if own is not None else q + x


class _Step:
    """The unknowns of one step while Newton iterates."""

    def __init__(
        self, scheme: NewmarkFamily, system: System, state: State, dt: float, mode: Mode, memory: NewmarkMemory
    ) -> None:
        self.scheme, self.system, self.state, self.dt, self.mode, self.memory = scheme, system, state, dt, mode, memory
        k = self.k = scheme.coefficients
        c = (1.0 - k.alpha_f) / (1.0 - k.alpha_m)
        self.c_C, self.c_K = k.gamma * dt * c, k.beta * dt * dt * c
        stretch = dt / memory.step
        self.a0 = memory.rate + stretch * (memory.aux - memory.rate)
        y0 = self.y0 = np.concatenate([state.v, state.z])
        self.n_v = len(state.v)
        self.rate = memory.rate + dt * memory.slope
        self.lam = memory.lam + dt * memory.lam_slope
        self.size = dt / (memory.whole or memory.step)
        cube = stretch**3 if self.size <= 1.0 + WHOLE else 1.0  # in a pair round-off is not made larger
        self.shift = (memory.shift + stretch * memory.shift_change) * cube
        self.tolerance = 4.0 * EPS if scheme.exact else 1e-3 * scheme.tolerance
        a1 = self._aux()
        self.y = y0 + dt * ((1.0 - k.gamma) * self.a0 + k.gamma * a1)
        n_v = self.n_v
        self.size_at_start = self._size_at_start()
        self.x = dt * state.v + dt * dt * ((0.5 - k.beta) * self.a0[:n_v] + k.beta * a1[:n_v]) + self.shift

        self.both = scheme.stabilized  # h and ḣ are held, not h alone
        self.near = memory.near
        if self.near == PASSING:
            self._hold_positions()
        self.last: tuple[Any, Any] = np.zeros(len(y0)), np.zeros(len(self.lam))

    def _aux(self) -> Vector:
        k = self.k
        return ((1 - k.alpha_f) * self.rate + k.alpha_f * self.memory.rate - k.alpha_m * self.a0) / (1 - k.alpha_m)

    def _error(self, terms: Terms) -> float:
        """Largest residual over its tolerance, each block apart."""
        tolerance = self.tolerance
        fastest = float(np.max(np.abs(self.rate[: self.n_v]), initial=0.0))
        scale_r = terms.scale_r
        if scale_r is None:  # a system that does not tell: inertia forces and what the accelerations add to the others
            rate = np.maximum(np.abs(self.rate), np.abs(self.memory.rate))
            scale_r = np.full(len(terms.r), np.max(np.abs(np.asarray(terms.S)) @ rate, initial=0.0))
        scale_r = np.maximum(scale_r, self.size_at_start)
        parts = [np.abs(terms.r) / (tolerance * np.maximum(scale_r, 1e-200))]
        if len(terms.h):
            floor = 16.0 * EPS * (np.ones(len(terms.h)) if terms.scale_h is None else terms.scale_h)
            speed = float(np.max(np.abs(self.y[: self.n_v]), initial=0.0))
            limit = self.c_C * speed if self.both else self.c_K * fastest
            parts.append(np.abs(terms.h) / (np.maximum(floor, tolerance * limit) + 1e-300))
            held = self._held(terms)
            if np.any(held):
                scale = np.ones(len(terms.h)) if terms.scale_rate is None else terms.scale_rate
                limits = np.maximum(16.0 * EPS * scale, tolerance * self.c_C * fastest)
                parts.append((np.abs(terms.rate) / (limits + 1e-300))[held])
        return float(np.max(np.concatenate(parts)))

    def _held(self, terms: Terms) -> Any:
        """Which rows are held at velocity level, (m,) booleans."""
        if self.both or terms.velocity is None:
            return np.full(len(terms.h), self.both)
        return np.asarray(terms.velocity, dtype=bool)

    def _size_at_start(self) -> Vector:
        """Magnitude of the balance's terms before the step; where a force passes zero it has none of its own."""
        state, memory = self.state, self.memory
        point = Point(state.time, state.q, np.zeros(self.n_v), self.y0, memory.rate, memory.lam)
        scale = self.system.evaluate(point, self.mode, None).scale_r
        return np.zeros(len(memory.rate)) if scale is None else scale

    def run(self) -> StepResult:
        """Newton: evaluate, judge every block, correct accelerations, multipliers and the position shift."""
        t1 = self.state.time + self.dt
        before, error, left, halvings = np.inf, np.inf, np.inf, 0
        reference = self.size_at_start
        for iteration in range(MAX_ITERATIONS):
            point = Point(t1, self.state.q, self.x, self.y, self.rate, self.lam)
            terms = self.system.evaluate(point, self.mode, (self.c_C, self.c_K))
            if iteration == 0 and terms.turning is not None and len(terms.turning):
                away = self._distance(terms)
                if away.too_close(self.scheme.tolerance, self.near > 0, self.size):
                    why = "a pose in which rows lose rank is too close"
                    return self._result(t1, StepReport(False, 0, 0.0, why, too_near=self.near == 0))
                if self.near:
                    self.near = PASSING if away.steps < WITHIN else LEFT
                elif away.steps < WITHIN and (away.steps < 1.0 or abs(self.size - 1.0) <= WHOLE):
                    self._hold_positions()
                    terms = self.system.evaluate(replace(point, x=self.x, y=self.y), self.mode, (self.c_C, self.c_K))
            error = self._error(terms)
            if iteration == 0:
                reference = np.maximum(np.abs(terms.r), 1e-200) if terms.scale_r is None else terms.scale_r
            imbalance = float(np.max(np.abs(terms.r) / np.maximum(reference, 1e-200), initial=0.0))
            stuck = not (error <= FAR or imbalance <= 0.9 * left)
            if halvings < MOST_HALVINGS and iteration > 0 and stuck:
                self._retreat()
                halvings += 1
                continue
            if not np.isfinite(error):
                return self._result(t1, StepReport(False, iteration, error, "a force or a row is not finite"))
            floor = 4096.0 * EPS / self.tolerance
            if error <= 1.0 or (iteration >= 2 and error > 0.5 * before and error <= max(1.0, floor)):
                if self.near and self._leaves_branch():
                    return self._result(t1, StepReport(False, iteration, 0.0, "the step leaves its branch of motions"))
                return self._result(t1, StepReport(True, iteration, error))
            before, left, halvings = error, imbalance, 0
            try:
                self._correct(terms, iteration)
            except np.linalg.LinAlgError:
                return self._result(t1, StepReport(False, iteration, error, "the Newton matrix is singular"))
        return self._result(t1, StepReport(False, MAX_ITERATIONS, error, "Newton did not converge"))

    def _distance(self, terms: Terms) -> Distance:
        """How many whole steps a pose is away in which the rows lose rank."""
        assert terms.S is not None
        assert terms.H is not None
        assert terms.turning is not None
        scale = np.ones(len(terms.h)) if terms.scale_h is None else terms.scale_h
        n_v = self.n_v
        B = terms.H[:, :n_v] - self.c_K / self.c_C * terms.turning
        mass = np.abs(np.diag(terms.S))[:n_v]
        return distance_to_pose(B, terms.turning, mass, self.y[:n_v], scale, self.memory.whole or self.memory.step)

    def _hold_positions(self) -> None:
        """Hold h alone in this step, with the last correction of positions: see `mbd.kernel.passage`."""
        self.both, self.near, self.predicted = False, PASSING, self.y
        shift = self.memory.shift * min(self.dt / self.memory.step, 1.0) ** 3
        self.x = self.x - self.shift + shift
        self.shift = shift

    def _leaves_branch(self) -> bool:
        n_v = self.n_v
        before, predicted, now = self.y0[:n_v], self.predicted[:n_v], self.y[:n_v]
        speed = np.maximum(np.abs(before), np.abs(predicted)) + self.dt * np.abs(self.memory.rate[:n_v])
        return float(np.max(np.abs(now - predicted), initial=0.0)) > CONTINUOUS * float(np.max(speed, initial=0.0))

    def _correct(self, terms: Terms, iteration: int) -> None:
        n, m, n_v = len(terms.r), len(terms.h), self.n_v
        assert terms.S is not None
        if not m or terms.H is None:
            change = np.linalg.solve(terms.S, -terms.r)
        else:
            matrix = np.block([[terms.S, terms.R], [terms.H, np.zeros((m, m))]])
            stabilized = self.both
            if self.near and terms.turning is not None:
                matrix[n:, :n_v] -= self.c_K / self.c_C * terms.turning
            held = self._held(terms)
            goal = terms.h / self.c_K
            goal[held] = terms.rate[held] / self.c_C
            right = np.zeros((n + m, 2))
            right[:, 0] = np.concatenate([-terms.r, -goal])
            if stabilized:
                right[n:, 1] = -(terms.h - self.c_K / self.c_C * terms.rate - terms.H[:, :n_v] @ self.shift)
                if terms.velocity is not None:  # corrections of positions go along these rows, not against them
                    right[n:, 1][np.asarray(terms.velocity, dtype=bool)] = 0.0
            solved = np.linalg.solve(matrix, right)
            change = solved[:n, 0]
            self.lam = self.lam + solved[n:, 0]
            floor = 16.0 * EPS * (np.ones(m) if terms.scale_h is None else terms.scale_h)
            if stabilized and np.any(np.abs(terms.h) > floor):
                self.x = self.x + solved[:n_v, 1] - self.shift
                self.shift = solved[:n_v, 1]
        self.last = change, solved[n:, 0] if m else np.zeros(0)
        if iteration == 0 and not self.scheme.exact:
            relative = float(np.max(np.abs(change)) / max(np.max(np.abs(self.rate)), 1e-200))
            self.tolerance = min(self.scheme.tolerance, max(1e-4 * relative, self.tolerance))
        self.rate = self.rate + change
        self.y = self.y + self.c_C * change
        self.x = self.x + self.c_K * change[:n_v]

    def _retreat(self) -> None:
        """Take back half of the last correction: a full Newton step jumped over a steep place."""
        change, multiplier = self.last = self.last[0] / 2.0, self.last[1] / 2.0
        self.rate = self.rate - change
        self.y = self.y - self.c_C * change
        self.x = self.x - self.c_K * change[: self.n_v]
        self.lam = self.lam - multiplier

    def _result(self, t1: float, report: StepReport) -> StepResult:
        if not report.converged:
            return StepResult(self.state, self.memory, report)
        memory, dt, n_v = self.memory, self.dt, self.n_v
        after = NewmarkMemory(
            self.rate,
            self._aux(),
            self.lam,
            (self.rate - memory.rate) / dt,
            (self.lam - memory.lam) / dt,
            self.shift,
            self.shift - memory.shift,
            dt,
            self.near,
            memory.whole,
        )
        old = self.state
        state = State(
            t1, _compose(self.system, old.q, self.x), self.y[:n_v], self.y[n_v:], old.mode, old.armed, old.anchors,
            old.names, old.velocity_names, {}, old.parameters,
        )  # fmt: skip
        return StepResult(state, after, report)
