"""The three-stage Radau IIA method of order 5 (Hairer & Wanner 1996, Solving ODEs II, IV.8; rows: VII.4).

With rates W_i = (v̇, ż) at the points c_i of a step and U_i a correction of positions, at each of three stages::

    Y_i = y₀ + h Σ a_ij W_j,   X_i = h Σ a_ij V_j + U_i
    r(X_i, Y_i, W_i, λ_i) = 0,   h(X_i) = 0,   ḣ(X_i, V_i) = 0

The last stage is the end of the step. U_i lie in the range of the rows in the metric of the Newton matrix, which makes
this the stabilized form of Gear, Gupta & Leimkuhler (1985).
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.integrators.base import Point, StepReport, StepResult, System, Terms, completed, consistent_rates
from mbd.kernel.schemes.collocation import RADAU
from mbd.kernel.schemes.radau import FAR_OFF, MOST_RETREATS, PATIENT, SLOW, has_converged
from mbd.kernel.schemes.stages import MOST_BENDS, MOST_STRETCHED
from mbd.state import Mode, State

__all__ = ["EPS", "MAX_ITERATIONS", "RadauMemory", "RadauStep", "infinite_unless_number"]

EPS = float(np.finfo(float).eps)
MAX_ITERATIONS = 50
"""Newton iterations, halvings included, after which a step counts as failed; one that converges takes three to six."""
TURNED = 0.5
"""How much rows may change from one stage to another before each stage is held to its own, relative [-]."""
HALF_TURN = 0.5
"""Estimated error of an angle above which a step does not resolve the motion at all [rad]."""


@dataclass(frozen=True)
class RadauMemory:
    """What the scheme keeps between steps.

    rate (n,) v̇ and ż, lam (m,) multipliers at the end of the step; rates (3, n), multipliers (3, m), shifts (3, n_v) of
    its stages, which predict the next; slope, lam_slope : rates of change over the step; step : its size [s];
    error (n_v + n) : estimate of order 3
    """

    rate: Vector
    lam: Vector
    rates: Matrix
    multipliers: Matrix
    shifts: Matrix
    slope: Vector
    lam_slope: Vector
    step: float
    error: Vector


@dataclass
class _Matrices:
    """Newton's matrices: real and of the pair, (n+m)²; M (n, n), c² K (n, n_v), ∂ḣ/∂x (m, n_v), H (m, n_v)."""

    real: Matrix
    pair: Any
    M: Matrix
    stiff: Matrix
    turning: Matrix
    H: Matrix


class RadauStep:
    """The stages of one step while Newton iterates."""

    at_singularity: ClassVar[bool] = False
    """Whether stages are held to rows of their own."""

    def __init__(
        self, tolerance: float, system: System, state: State, dt: float, mode: Mode, memory: RadauMemory
    ) -> None:
        self.system, self.state, self.dt, self.mode, self.memory = completed(system), state, dt, mode, memory
        self.c = RADAU.real * dt
        self.y0, self.n_v = np.concatenate([state.v, state.z]), len(state.v)
        self.upper, self.tolerance = tolerance, 1e-3 * tolerance
        stretch = dt / memory.step
        far = stretch > MOST_STRETCHED
        weights = np.tile([0.0, 0.0, 1.0], (3, 1)) if far else _lagrange(1.0 + stretch * RADAU.c)
        self.W, self.lam = weights @ memory.rates, weights @ memory.multipliers
        self.U = (0.0 if far else stretch**4) * memory.shifts
        point = Point(state.time, state.q, np.zeros(self.n_v), self.y0, memory.rate, memory.lam)
        scale = system.evaluate(point, mode, None).scale_r
        self.size_at_start = np.zeros(len(self.y0)) if scale is None else scale
        self.bend = np.zeros((3, self.n_v))
        self.last: tuple[Any, Any] = np.zeros_like(self.W), np.zeros_like(self.lam)

    def run(self) -> StepResult:
        """Newton: evaluate all stages, judge them, correct rates, multipliers and position shifts."""
        before, left, error, retreats, renew = np.inf, np.inf, np.inf, 0, True
        first = moved = 0.0  # what the first correction changed, and the last
        for iteration in range(MAX_ITERATIONS):
            terms = [self._terms(i) for i in range(3)]
            if renew:
                matrices = self._matrices(len(terms[0].h))
            sizes = [infinite_unless_number(self._error(i, each)) for i, each in enumerate(terms)]
            error = max(sizes)
            shared = np.isfinite(error) and any(each.shared for each in terms)
            if retreats < MOST_RETREATS and iteration > 0 and not (error <= FAR_OFF or error <= 0.9 * left or shared):
                self._retreat()
                retreats += 1
                continue
            if not np.isfinite(error):
                self._terms(sizes.index(error))  # the system remembers what it was evaluated at last
                return self._failed(iteration, error, "a force or a row is not finite")
            floor = 4096.0 * EPS / self.tolerance
            passes = error <= 1.0 or (iteration >= 2 and error > 0.5 * before and error <= max(1.0, floor))
            if not passes and self._was_enough(iteration, error, left):
                return self._completed(matrices, iteration, error)
            if not passes and not renew and error > SLOW * before:
                renew, before = True, np.inf
                continue
            before, left, retreats, last = error, error, 0, moved
            try:  # residuals that pass are there too: what they still correct costs little
                moved = self._correct(terms, matrices, renew)
            except np.linalg.LinAlgError:
                return self._failed(iteration, error, "the Newton matrix is singular")
            if passes and has_converged(moved, last, first):
                return self._completed(matrices, iteration, error)
            if iteration == 0 and not passes:  # the predictor is of order 3, the step of order 5: stay below its error
                first = moved
                self.tolerance = min(self.upper, max(1e-3 * first**2, self.tolerance))
            renew = False
        return self._failed(MAX_ITERATIONS, error, "Newton did not converge")

    def rows_turn(self) -> bool:
        """Whether the rows change so much from stage to stage that one matrix does not serve all three.

        Eigenvalues of what makes rows of the middle stage of those of another: they do not ask for units.
        """
        try:
            first, middle, last = (self._rows(self._terms(i, (0.0, 0.0))) for i in range(3))
            turns = [np.linalg.lstsq(each.T, middle.T, rcond=None)[0] for each in (first, last)]
            return max(float(np.max(np.abs(np.linalg.eigvals(turn) - 1.0))) for turn in turns) > TURNED
        except (np.linalg.LinAlgError, ValueError):  # a mass is missing, or a force is not finite: the step tells
            return False

    def _rows(self, terms: Terms) -> Matrix:
        """B in the metric of M: scaled by the roots of its diagonal."""
        mass = np.abs(np.diag(np.asarray(terms.S)))
        B = np.asarray(terms.H)
        return np.asarray(B / np.sqrt(np.where(mass > 0.0, mass, 1.0))[: B.shape[1]])

    # stages -------------------------------------------------------------------------------------------------------
    def _point(self, i: int) -> Point:
        t = self.state.time + (self.dt if i == 2 else RADAU.c[i] * self.dt)
        y = self.y0 + self.dt * RADAU.A[i] @ self.W
        x = self.dt * RADAU.A[i] @ self._increment_rates() + self.U[i]
        return Point(t, self.state.q, x, y, self.W[i], self.lam[i])

    def _increment_rates(self) -> Matrix:
        """ẋ of all stages (3, n_v): v where positions add, else by iteration."""
        speeds = (self.y0 + self.dt * RADAU.A @ self.W)[:, : self.n_v]
        if self.system.is_vector:
            return np.asarray(speeds)
        rates = speeds + self.bend
        for _ in range(MOST_BENDS):
            before = rates
            x = self.dt * RADAU.A @ rates + self.U
            rates = np.array([self.system.increment_rates(*pair) for pair in zip(x, speeds, strict=True)])
            if not np.max(np.abs(rates - before), initial=0.0) > 4.0 * EPS * np.max(np.abs(rates), initial=0.0):
                break
        self.bend = rates - speeds
        return np.asarray(rates)

    def _terms(self, i: int, tangent: tuple[float, float] | None = None) -> Terms:
        return self.system.evaluate(self._point(i), self.mode, tangent)

    def _error(self, i: int, terms: Terms) -> float:
        """Largest residual of a stage over its tolerance, each block apart."""
        point, tolerance, c = self._point(i), self.tolerance, self.c
        scale = terms.scale_r
        if scale is None:  # a system that does not tell: inertia forces and what the accelerations add to the others
            S = np.abs(np.asarray(self._terms(i, (c, c * c)).S))
            largest = S @ np.maximum(np.abs(point.rate), np.abs(self.memory.rate))
            scale = np.full(len(terms.r), np.max(largest, initial=0.0))
        least = max(tolerance, terms.blur)
        parts = [np.abs(terms.r) / (least * np.maximum(np.maximum(scale, self.size_at_start), 1e-200))]
        if len(terms.h):
            size = np.ones(len(terms.h)) if terms.scale_h is None else terms.scale_h
            fast = np.ones(len(terms.h)) if terms.scale_rate is None else terms.scale_rate
            speed = float(np.max(np.abs(point.y[: self.n_v]), initial=0.0))
            fastest = float(np.max(np.abs(point.rate[: self.n_v]), initial=0.0))
            limit = np.maximum(16.0 * EPS * size, tolerance * np.minimum(c * speed, size))
            parts.append(np.abs(terms.h) / (limit + 1e-300))
            parts.append(np.abs(terms.rate) / (np.maximum(16.0 * EPS * fast, tolerance * c * fastest) + 1e-300))
        return float(np.max(np.concatenate(parts)))

    def _matrices(self, m: int) -> _Matrices:
        """Matrices of the middle stage from three tangents: (c, c²), (c, 0) and (2c, 0), in which S is affine."""
        c, n_v = self.c, self.n_v
        ratio = RADAU.pair / RADAU.real
        full, part, double = (self._terms(1, factors) for factors in ((c, c * c), (c, 0.0), (2.0 * c, 0.0)))
        S, linear, twice = (np.asarray(each.S) for each in (full, part, double))
        M, damping, stiff = 2.0 * linear - twice, twice - linear, S - linear
        pair = M + ratio * damping + ratio**2 * stiff
        if not m:
            return _Matrices(S, pair, M, stiff[:, :n_v], np.zeros((0, n_v)), np.zeros((0, n_v)))
        H, B, zero = np.asarray(full.H), np.asarray(part.H), np.zeros((m, m))
        R, turning = np.asarray(full.R), (H - B)[:, :n_v] / c
        if self.at_singularity:
            H = B
        real = np.block([[S, R], [H, zero]])
        pair = np.block([[pair, R], [B + ratio * (H - B), zero]])
        return _Matrices(real, pair, M, stiff[:, :n_v], turning, H[:, :n_v])

    # Newton -------------------------------------------------------------------------------------------------------
    def _correct(self, terms: list[Terms], matrices: _Matrices, whole: bool) -> float:
        """One simplified Newton correction of all stages; its size relative to the largest rate."""
        m = len(terms[0].h)
        r, rates = np.array([each.r for each in terms]), np.array([each.rate for each in terms])
        if m:
            self._correct_positions(terms, matrices, r, rates, whole)
        elif not self.system.is_vector:  # see `mbd.kernel.schemes.stage_masses`
            with suppress(np.linalg.LinAlgError):
                r = np.array([matrices.M @ np.linalg.solve(self._mass(i), each) for i, each in enumerate(r)])
        return self._correct_rates(r, rates, matrices)

    def _mass(self, i: int) -> Matrix:
        """M of a stage: S at (c, 0) and (2c, 0)."""
        part, double = (np.asarray(self._terms(i, (factor * self.c, 0.0)).S) for factor in (1.0, 2.0))
        return np.asarray(2.0 * part - double)

    def _correct_rates(self, r: Matrix, rates: Matrix, matrices: _Matrices) -> float:
        n = len(self.y0)
        right = -np.hstack([r, rates])
        real, pair = RADAU.s_real @ right, RADAU.s_pair @ right
        real[n:] /= self.c
        pair[n:] /= RADAU.pair * self.dt
        found, other = np.linalg.solve(matrices.real, real), np.linalg.solve(matrices.pair, pair)
        change = np.outer(RADAU.t_real, found) + 2.0 * np.outer(RADAU.t_pair, other).real
        self.last = change[:, :n], change[:, n:]
        biggest = float(np.max(np.abs(change[:, :n])) / max(np.max(np.abs(self.W)), 1e-100))
        self.W, self.lam = self.W + change[:, :n], self.lam + change[:, n:]
        return biggest

    def _correct_positions(self, terms: list[Terms], matrices: _Matrices, r: Any, rates: Any, whole: bool) -> None:
        """New U_i; what they change of r and ḣ is added to these, which the rates make good."""
        n, n_v = len(self.y0), self.n_v
        h = np.array([each.h for each in terms])
        floor = 16.0 * EPS * (np.ones(h.shape[1]) if terms[0].scale_h is None else terms[0].scale_h)
        if not whole and not np.any(np.abs(h) > floor):
            return
        goal = self.dt * RADAU.A @ rates - h
        if whole:
            goal += self.U @ matrices.H.T
        if terms[0].velocity is not None:  # corrections of positions go along these rows, not against them
            goal[:, np.asarray(terms[0].velocity, dtype=bool)] = 0.0
        right = np.vstack([np.zeros((n, 3)), goal.T])
        found = np.linalg.solve(matrices.real, right)[:n_v].T
        change = found - self.U if whole else found
        self.U = self.U + change
        r += change @ matrices.stiff.T / self.c**2
        rates += change @ matrices.turning.T

    def _was_enough(self, iteration: int, error: float, left: float) -> bool:
        """Whether residuals meet the tolerance asked for, if not that of the step: now, or before they grew."""
        grown = error > left and np.isfinite(left)
        if not grown and iteration < PATIENT:
            return False
        tight, now = self.tolerance, (self.W, self.lam)
        self.tolerance = self.upper
        if grown:
            self.W, self.lam = self.W - self.last[0], self.lam - self.last[1]
        enough = all(self._error(i, self._terms(i)) <= 1.0 for i in range(3))
        self.tolerance = tight
        if not enough:
            self.W, self.lam = now
        return enough

    def _retreat(self) -> None:
        """Take back half of the last correction: a full Newton step jumped over a steep place."""
        self.last = self.last[0] / 2.0, self.last[1] / 2.0
        self.W, self.lam = self.W - self.last[0], self.lam - self.last[1]

    # ends ---------------------------------------------------------------------------------------------------------
    def _local_error(self, matrices: _Matrices) -> Vector:
        """``μ h f(y₀) + Σ e_i (Y_i − y₀)`` of x and (v, z), filtered by (1 − hμ ∂f/∂y)⁻¹ along the rows."""
        dt, c, n_v, e = self.dt, self.c, self.n_v, RADAU.e
        along = c * self.memory.rate + e @ (dt * RADAU.A @ self.W)
        moved = c * self.y0[:n_v] + e @ (dt * RADAU.A @ self._increment_rates())
        right = np.concatenate([matrices.M @ along - matrices.stiff @ moved / c, -matrices.turning @ moved])
        found = np.linalg.solve(matrices.real, right)[: len(self.y0)]
        return np.concatenate([moved + c * found[:n_v], found])

    def _failed(self, iterations: int, error: float, message: str) -> StepResult:
        return StepResult(self.state, self.memory, StepReport(False, iterations, error, message))

    def _completed(self, matrices: _Matrices, iterations: int, residual: float) -> StepResult:
        """The last stage as the end of the step, with consistent rates and multipliers where rows are active."""
        old, dt, n_v, memory = self.state, self.dt, self.n_v, self.memory
        try:
            error = self._local_error(matrices)
        except np.linalg.LinAlgError:
            return self._failed(iterations, residual, "the Newton matrix is singular")
        units = self.system.angles
        if units is not None and not np.all(np.abs(error[:n_v][units]) <= HALF_TURN):
            return self._failed(iterations, residual, "an angle would be missed by more than half a radian")
        point = self._point(2)
        q = self.system.compose(old.q, point.x)
        rate, lam = point.rate, point.lam
        if len(lam):
            with suppress(np.linalg.LinAlgError):  # else those of the stage
                rate, lam = consistent_rates(self.system, point.t, q, point.y, self.mode)
        slopes = (rate - memory.rate) / dt, (lam - memory.lam) / dt
        after = RadauMemory(rate, lam, self.W, self.lam, self.U, *slopes, dt, error)
        state = State(
            point.t, q, point.y[:n_v], point.y[n_v:], old.mode, old.armed, old.anchors,
            old.names, old.velocity_names, {}, old.parameters,
        )  # fmt: skip
        return StepResult(state, after, StepReport(True, iterations + 1, residual))


def _lagrange(places: Vector) -> Matrix:
    """Weights (len(places), 3) of values at the points c of a step, for the parabola through them at other places."""
    c = RADAU.c
    others = [[c[k] for k in range(3) if k != j] for j in range(3)]
    return np.array(
        [[(s - a) * (s - b) / ((c[j] - a) * (c[j] - b)) for j, (a, b) in enumerate(others)] for s in places]
    )


def infinite_unless_number(error: float) -> float:
    """NaN counts as the largest."""
    return error if error == error else np.inf
