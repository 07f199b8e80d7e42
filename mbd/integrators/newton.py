"""One step of the Newmark family by Newton's method: the readable twin of the compiled kernel.

The equations are those of `mbd.integrators.family`; the unknowns are the true accelerations v̇₁, the multipliers λ₁ and,
where the form is stabilized, the position correction U.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from mbd.arrays import Vector
from mbd.integrators.base import Point, StepReport, StepResult, System, Terms, completed, composed
from mbd.integrators.coefficients import Coefficients
from mbd.integrators.singular import (
    CONTINUOUS,
    WHOLE,
    WITHIN,
    Distance,
    counted_inertia,
    distance_to_singularity,
)
from mbd.kernel.codes import LEFT, PASSING
from mbd.state import Mode, State

__all__ = ["EPS", "MAX_ITERATIONS", "NewmarkMemory", "Step"]

EPS = float(np.finfo(float).eps)
MAX_ITERATIONS = 50
"""Newton iterations, halvings included, after which a step counts as failed; one that converges takes one to three."""
MOST_HALVINGS = 10
"""How often a Newton correction is halved before the iteration goes on from where it is."""
FAR = 1e4
"""Residual over its tolerance above which a correction that does not reduce it is halved."""


@dataclass(frozen=True)
class NewmarkMemory:
    """What the scheme keeps between steps.

    rate (n,) true v̇ and ż; aux (n,) the auxiliary a for steps of size `step`; lam (m,) multipliers;
    slope, lam_slope: their last rates of change, which predict the next step; shift (n_v,) the position correction and
    shift_change what it changed by in the last step; near 1 within a few steps of a singular configuration, and 2
    just beyond it, where the scheme is started again; whole: the dt that steps have unless they must not [s]; drift
    (n_v,) ẋ − v at the end of the last step, in its chart: zero where positions add.
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
    drift: Vector | float = 0.0


class NewmarkScheme(Protocol):
    """What a step asks of its scheme."""

    tolerance: float

    @property
    def coefficients(self) -> Coefficients:
        """α_m, α_f, β, γ."""

    @property
    def exact(self) -> bool:
        """Whether Newton iterates until round-off."""

    @property
    def stabilized(self) -> bool:
        """Whether ḣ is held beside h."""


class Step:
    """The unknowns of one step while Newton iterates."""

    def __init__(
        self, scheme: NewmarkScheme, system: System, state: State, dt: float, mode: Mode, memory: NewmarkMemory
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
        self.shift = self.predicted_shift = (memory.shift + stretch * memory.shift_change) * cube
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
        parts = [np.abs(terms.r) / (max(tolerance, terms.blur) * np.maximum(scale_r, 1e-200))]
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
                    why = "a singular configuration is too close"
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
            stuck = not (error <= FAR or imbalance <= 0.9 * left or (terms.shared and np.isfinite(error)))
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
        """How many whole steps a singular configuration is away."""
        assert terms.S is not None
        assert terms.H is not None
        assert terms.turning is not None
        scale = np.ones(len(terms.h)) if terms.scale_h is None else terms.scale_h
        n_v = self.n_v
        B = terms.H[:, :n_v] - self.c_K / self.c_C * terms.turning
        mass, system = np.abs(np.diag(terms.S))[:n_v], completed(self.system)
        if not system.is_vector:
            mass = counted_inertia(mass, system.angles)
        return distance_to_singularity(
            B, terms.turning, mass, self.y[:n_v], scale, self.memory.whole or self.memory.step
        )

    def _hold_positions(self) -> None:
        """Hold h alone in this step, with the last correction of positions: see `mbd.kernel.singular.newmark_step`."""
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

    def _part_of_change(self) -> float:
        """Part of the last change of the position correction that the next prediction goes on with.

        None of it where the correction is its own prediction, whose part along the motion shows nowhere.
        """
        if np.array_equal(self.shift, self.predicted_shift):
            return 0.0
        return 1.0 if np.any(self.memory.shift_change) else 0.5

    def _drift(self) -> Vector | float:
        """ẋ − v at the end of the step."""
        system, v = completed(self.system), self.y[: self.n_v]
        return 0.0 if system.is_vector else system.increment_rates(self.x, v) - v

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
            self._part_of_change() * (self.shift - memory.shift),
            dt,
            self.near,
            memory.whole,
            self._drift(),
        )
        old = self.state
        state = State(
            t1, composed(self.system, old.q, self.x), self.y[:n_v], self.y[n_v:], old.mode, old.armed, old.anchors,
            old.names, old.velocity_names, {}, old.parameters,
        )  # fmt: skip
        return StepResult(state, after, report)
