"""Steps of the Newmark family, each differentiated as the implicit function that it is at its converged solution.

    (1−α_m) a₁ + α_m a₀ = (1−α_f) v̇₁ + α_f v̇₀,   v₁ = v₀ + h ((1−γ) a₀ + γ a₁)
    q₁ = q₀ + h v₀ + h² ((½−β) a₀ + β a₁) + U,   r = 0,   h = 0 (and ḣ = 0 with U, stabilized)

U = W of positions is normal to the rows in the metric of Newton's matrix: ``S W + R ν = 0``, and ``B̃ W = 0`` for rows
on velocities. Its derivative needs that of S, along W alone: a central difference of compiled first derivatives along
it, which is exact where r is linear and errs by a part h² of U, itself of order h³, else.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.sensitivity.balance import consistent_rates
from mbd.sensitivity.held_directions import with_held_directions
from mbd.sensitivity.kernel.newmark_prediction import FOLLOWED
from mbd.sensitivity.motion import Mode, Motion, Rates, Tangent, solved
from mbd.sensitivity.programs import Columns, Programs
from mbd.sensitivity.run_data import unknown
from mbd.sensitivity.schemes import Memory

__all__ = ["NewmarkSteps"]

BRIEF, BRIEFEST = 1e-3, 1e-9
"""Parts of a full step below which the kernel takes one of Heun's method, with rows and without them [-]."""


@dataclass(frozen=True)
class Prediction:
    """The end of a step but for its unknowns: a₀ over the step, x, v with δv̇₁ = 0; changes by unknowns are c_K, c_C."""

    a0: Vector
    of_a0: Matrix
    of_aux: Matrix
    of_x: Matrix
    of_y: Matrix
    c_C: float
    c_K: float


class NewmarkSteps:
    """Derivatives of the steps of a run.

    Parameters
    ----------
    numbers : those of the integrator; full : its step [s]
    """

    def __init__(self, programs: Programs, numbers: Mapping[str, float], stabilized: bool, full: float) -> None:
        self.programs, self.stabilized, self.full = programs, stabilized, full
        self.alpha_m, self.alpha_f = float(numbers["alpha_m"]), float(numbers["alpha_f"])
        self.beta, self.gamma = float(numbers["beta"]), float(numbers["gamma"])
        self.jerk = float(numbers["jerk"]) * (self.alpha_m - self.alpha_f)

    def start(self, motion: Motion, mode: Mode, rates: Rates, full: float | None = None) -> Memory:
        """a₀ = v̇₀ + (α_m − α_f) h j₀ with the jerk j₀ from one difference of consistent accelerations."""
        full = self.full if full is None else full
        if self.jerk == 0.0 and not (self.stabilized and mode.rows):
            return Memory(rates, rates.rate.copy(), rates.of_rate.copy(), full)
        c, charts, ahead = self.programs.columns, self.programs.charts, full / 16.0
        if c.slips and np.any(mode.slip):
            mode, motion = with_held_directions(self.programs, motion, mode, rates)
        tangent = motion.tangent
        way = ahead * motion.y[: c.n_v]
        of_q = charts.carried(motion.q, way, tangent.q, ahead * tangent.y[: c.n_v])
        later = Motion(
            motion.t + ahead, charts.compose(motion.q, way), motion.y + ahead * rates.rate, motion.anchors,
            replace(tangent, q=of_q, y=tangent.y + ahead * rates.of_rate),
        )  # fmt: skip
        then = consistent_rates(self.programs, later, mode, rates)
        part = self.jerk * full / ahead
        aux = rates.rate + part * (then.rate - rates.rate)
        of_aux = rates.of_rate + part * (then.of_rate - rates.of_rate)
        slope, lam_slope, none = (then.rate - rates.rate) / ahead, (then.lam - rates.lam) / ahead, np.zeros(c.n_v)
        of_lam = (then.of_lam - rates.of_lam) / ahead
        of_slope, still = (then.of_rate - rates.of_rate) / ahead, np.zeros((c.n_v, of_aux.shape[1]))
        return Memory(rates, aux, of_aux, full, slope, lam_slope, none, none, of_slope, still, still, of_lam)

    # a step -------------------------------------------------------------------------------------------------------
    def follows(self, motion: Motion, memory: Memory, h: float, y1: Vector, rate1: Vector) -> bool:
        """Whether a row's velocities are those of a step from here that ends with its rates."""
        a0, a1 = self._averages(memory, h, rate1)
        way = h * ((1.0 - self.gamma) * a0 + self.gamma * a1)
        size = np.max(np.abs(y1), initial=0.0) + h * np.max(np.abs(a0) + np.abs(a1), initial=0.0)
        return bool(np.max(np.abs(motion.y + way - y1), initial=0.0) <= FOLLOWED * h * size / self.full + 1e-14 * size)

    def _averages(self, memory: Memory, h: float, rate1: Vector) -> tuple[Vector, Vector]:
        """a₀ and a₁ of a step."""
        rate0 = memory.rates.rate
        a0 = rate0 + h / memory.step * (memory.aux - rate0)
        return a0, ((1.0 - self.alpha_f) * rate1 + self.alpha_f * rate0 - self.alpha_m * a0) / (1.0 - self.alpha_m)

    def step(
        self, motion: Motion, memory: Memory, mode: Mode, end: tuple[float, Vector, Vector], rates: Rates, dh: Vector
    ) -> tuple[Motion, Memory]:
        """The motion after a step to the row (t₁, q₁, y₁) with these rates and multipliers; dh (D,) by its size.

        Raises
        ------
        CapabilityError
            where coordinates do not add: least solutions are known only where they do.
        """
        if not self.programs.charts.is_vector:
            raise unknown(f"the equations of the step to t = {end[0]:.9g} s are singular")
        c, h = self.programs.columns, end[0] - motion.t
        guess = self._predicted(motion, memory, h, rates.rate, dh)
        a0, a1 = self._averages(memory, h, rates.rate)
        shift = end[1] - motion.q - h * motion.y[: c.n_v]
        shift -= h * h * ((0.5 - self.beta) * a0 + self.beta * a1)[: c.n_v]
        tangent = Tangent(motion.tangent.t + dh, guess.of_x, guess.of_y, motion.tangent.anchors, motion.tangent.p)
        after = Motion(end[0], end[1], end[2], motion.anchors, tangent)
        ahead = self.predicted(motion, memory, h) if self.stabilized and mode.rows else None
        if ahead is not None:
            ahead = self._with_tangent(ahead, motion, memory, guess, h, dh)
        of_rate, of_lam, of_shift = self._implicit(after, mode, rates, guess, shift, h, dh, ahead)
        of_x = guess.c_K * of_rate[: c.n_v] + of_shift
        mean = (1.0 - self.alpha_f) / (1.0 - self.alpha_m)
        moved = after.with_tangent(q=guess.of_x + of_x, y=guess.of_y + guess.c_C * of_rate)
        found = Rates(rates.rate, rates.lam, of_rate, of_lam)
        last, before = memory.rates, np.zeros(c.n_v) if memory.shift is None else memory.shift
        slopes = (rates.rate - last.rate) / h, (rates.lam - last.lam) / h
        of_aux = guess.of_aux + mean * of_rate
        if ahead is None:
            return moved, Memory(found, a1, of_aux, h)
        of_slope = (of_rate - last.of_rate - slopes[0][:, np.newaxis] * dh) / h
        of_change = of_shift if memory.of_shift is None else of_shift - memory.of_shift
        return moved, Memory(
            found, a1, of_aux, h, *slopes, shift, shift - before, of_slope, of_shift, of_change,
            (of_lam - last.of_lam - slopes[1][:, np.newaxis] * dh) / h,
        )  # fmt: skip

    def _with_tangent(
        self, ahead: tuple[Motion, Rates], motion: Motion, memory: Memory, guess: Prediction, h: float, dh: Vector
    ) -> tuple[Motion, Rates]:
        """The prediction with the derivatives of its place and velocities."""
        n_v, rates, tangent = self.programs.columns.n_v, memory.rates, motion.tangent
        stretch, mean = h / memory.step, 1.0 / (1.0 - self.alpha_m)
        place, foreseen = ahead
        if (
            memory.of_slope is None
            or memory.of_shift is None
            or memory.of_change is None
            or memory.of_lam_slope is None
        ):
            return replace(place, tangent=replace(tangent, t=tangent.t + dh, q=guess.of_x, y=guess.of_y)), foreseen
        lam_slope = ((foreseen.lam - rates.lam) / h)[:, np.newaxis]
        of_lam = rates.of_lam + h * memory.of_lam_slope + lam_slope * dh
        slope = (foreseen.rate - rates.rate) / h
        of_rate = rates.of_rate + h * memory.of_slope + slope[:, np.newaxis] * dh
        last = self.alpha_f * rates.of_rate - self.alpha_m * guess.of_a0
        of_a1 = mean * ((1.0 - self.alpha_f) * of_rate + last)
        a0, a1 = self._averages(memory, h, foreseen.rate)
        speed, way = (1.0 - self.gamma) * a0 + self.gamma * a1, (0.5 - self.beta) * a0 + self.beta * a1
        of_y = tangent.y + h * ((1.0 - self.gamma) * guess.of_a0 + self.gamma * of_a1) + speed[:, np.newaxis] * dh
        of_x = tangent.q + h * tangent.y[:n_v] + h * h * ((0.5 - self.beta) * guess.of_a0 + self.beta * of_a1)[:n_v]
        of_x = of_x + (motion.y + 2.0 * h * way)[:n_v, np.newaxis] * dh
        of_x = of_x + stretch**3 * (memory.of_shift + stretch * memory.of_change)
        if memory.shift is not None and memory.shift_change is not None:
            growth = 3.0 * memory.shift + 4.0 * stretch * memory.shift_change
            of_x = of_x + (stretch * stretch / memory.step * growth)[:, np.newaxis] * dh
        moved = replace(tangent, t=tangent.t + dh, q=of_x, y=of_y)
        return replace(place, tangent=moved), Rates(foreseen.rate, foreseen.lam, of_rate, of_lam)

    def predicted(self, motion: Motion, memory: Memory, h: float) -> tuple[Motion, Rates]:
        """Where the kernel predicts the end of a step, and makes the tangent whose metric is that of U."""
        n_v, rates, stretch = self.programs.columns.n_v, memory.rates, h / memory.step
        slope = np.zeros_like(rates.rate) if memory.slope is None else memory.slope
        lam_slope = np.zeros_like(rates.lam) if memory.lam_slope is None else memory.lam_slope
        shift = np.zeros(n_v) if memory.shift is None else memory.shift
        change = np.zeros(n_v) if memory.shift_change is None else memory.shift_change
        rate = rates.rate + h * slope
        a0, a1 = self._averages(memory, h, rate)
        y = motion.y + h * ((1.0 - self.gamma) * a0 + self.gamma * a1)
        x = h * motion.y[:n_v] + h * h * ((0.5 - self.beta) * a0 + self.beta * a1)[:n_v]
        x = x + (shift + stretch * change) * stretch**3
        ahead = replace(motion, t=motion.t + h, q=motion.q + x, y=y)
        return ahead, replace(rates, rate=rate, lam=rates.lam + h * lam_slope)

    def _predicted(self, motion: Motion, memory: Memory, h: float, rate1: Vector, dh: Vector) -> Prediction:
        """Derivatives of the end of a step with δv̇₁ = 0, δU = 0."""
        n_v, mean = self.programs.columns.n_v, 1.0 / (1.0 - self.alpha_m)
        stretch, of_rate0 = h / memory.step, memory.rates.of_rate
        a0, a1 = self._averages(memory, h, rate1)
        by_h = ((memory.aux - memory.rates.rate) / memory.step)[:, np.newaxis] * dh
        of_a0 = of_rate0 + stretch * (memory.of_aux - of_rate0) + by_h
        of_a1 = mean * (self.alpha_f * of_rate0 - self.alpha_m * of_a0)
        speed, place = (1.0 - self.gamma) * a0 + self.gamma * a1, (0.5 - self.beta) * a0 + self.beta * a1
        of_y = motion.tangent.y + h * ((1.0 - self.gamma) * of_a0 + self.gamma * of_a1) + speed[:, np.newaxis] * dh
        of_x = motion.tangent.q + h * motion.tangent.y[:n_v]
        of_x = of_x + h * h * ((0.5 - self.beta) * of_a0 + self.beta * of_a1)[:n_v]
        of_x = of_x + (motion.y[:n_v] + 2.0 * h * place[:n_v])[:, np.newaxis] * dh
        c = mean * (1.0 - self.alpha_f)
        return Prediction(a0, of_a0, of_a1, of_x, of_y, self.gamma * h * c, self.beta * h * h * c)

    def _implicit(
        self,
        after: Motion,
        mode: Mode,
        rates: Rates,
        guess: Prediction,
        shift: Vector,
        h: float,
        dh: Vector,
        ahead: tuple[Motion, Rates] | None,
    ) -> tuple[Matrix, Matrix, Matrix]:
        """Derivatives of v̇₁, λ and U."""
        c, rows = self.programs.columns, list(mode.rows)
        n, n_v, m = c.n, c.n_v, len(rows)
        at = after.at(mode, rates.rate, rates.lam)
        _, _, _, of_r, of_h, of_rate = self.programs.steps(at)
        Z = after.tangent.stacked(c)
        fast = np.array([self.programs.equations.rows[k].is_velocity for k in rows], dtype=bool)
        S, R = self._by_rates(of_r, guess), of_r[:, c.lam][:, rows]
        if ahead is None:
            level = np.where(fast[:, np.newaxis], of_rate[rows], of_h[rows])
            A = np.block([[S, R], [self._by_rates(level, guess), np.zeros((m, m))]])
            found = -solved(A, np.vstack([of_r, level]) @ Z)
            return found[:n], self._spread(found[n:], rows), np.zeros((n_v, Z.shape[1]))
        place, foreseen = ahead
        near = self.programs.steps(place.at(mode, foreseen.rate, foreseen.lam))
        metric, near_R, near_rate = self._by_rates(near[3], guess), near[3][:, c.lam][:, rows], near[5][rows]
        parts = metric, near_R, near[3], near_rate
        turned, by_step = self._turned(place, mode, foreseen, guess, shift, parts, fast, h)
        W = np.zeros((n + m, n))
        W[:, :n_v] = np.vstack([of_r, of_rate[rows]])[:, c.x]
        column = fast[:, np.newaxis]
        of_levels = np.where(column, 0.0, self._by_rates(of_h[rows], guess))
        by_shift = np.where(column, guess_row(near_rate, c, guess)[:, :n_v], of_h[rows][:, c.x])
        A = np.zeros((2 * (n + m), 2 * (n + m)))
        A[: n + m, :n] = self._by_rates(np.vstack([of_r, of_rate[rows]]), guess)
        A[:n, n : n + m] = R
        A[: n + m, n + m : 2 * n + m] = W
        A[n + m : 2 * n + m, n + m : 2 * n + m] = metric
        A[n + m : 2 * n + m, 2 * n + m :] = near_R
        A[2 * n + m :, :n] = of_levels
        A[2 * n + m :, n + m : n + m + n_v] = by_shift
        near_Z = place.tangent.stacked(c, foreseen.of_rate, foreseen.of_lam)
        levels = np.where(column, turned[n:] @ near_Z, of_h[rows] @ Z)
        right = np.vstack([of_r @ Z, of_rate[rows] @ Z, turned[:n] @ near_Z, levels])
        right[n + m :] += by_step[:, np.newaxis] * dh
        found = -solved(A, right)
        return found[:n], self._spread(found[n : n + m], rows), found[n + m : n + m + n_v]

    def _by_rates(self, level: Matrix, guess: Prediction) -> Matrix:
        """Derivatives by v̇₁ through the formulas of the scheme: ∂/∂v̇ + c_C ∂/∂v + c_K ∂/∂x."""
        c = self.programs.columns
        found = level[:, c.rate] + guess.c_C * level[:, c.y]
        found[:, : c.n_v] += guess.c_K * level[:, c.x]
        return found

    def _spread(self, of_rows: Matrix, rows: list[int]) -> Matrix:
        out = np.zeros((self.programs.columns.rows, of_rows.shape[1]))
        out[rows] = of_rows
        return out

    def _turned(
        self, after: Motion, mode: Mode, rates: Rates, guess: Prediction, shift: Vector,
        parts: tuple[Matrix, Matrix, Matrix, Matrix], fast: Vector, h: float,
    ) -> tuple[Matrix, Vector]:  # fmt: skip
        """Derivatives (n + m, N) of ``S W + R ν`` and of ``B̃ W`` with W, ν held, and those by h."""
        c, rows = self.programs.columns, list(mode.rows)
        n, n_v, m = c.n, c.n_v, len(rows)
        S, R, of_r, of_rate = parts
        known = -S[:, :n_v] @ shift
        rest = np.linalg.lstsq(np.hstack([S[:, n_v:], R]), known, rcond=None)[0]
        W, nu = np.concatenate([shift, rest[: n - n_v]]), np.zeros(c.rows)
        nu[rows] = rest[n - n_v :]
        large = float(np.max(np.abs(W), initial=0.0))
        by_step = np.zeros(n + m)
        if large == 0.0:
            return np.zeros((n + m, c.count)), by_step
        s, found = 1.0 / large, []
        for sign in (s, -s):
            place = replace(
                after, q=after.q + sign * guess.c_K * shift, y=after.y + sign * guess.c_C * W
            )  # along (c_K, c_C, 1) W, the direction of the columns of S
            at = place.at(mode, rates.rate + sign * W, rates.lam + sign * nu)
            _, _, _, of_force, _, of_speed = self.programs.steps(at)
            found.append(np.vstack([of_force, of_speed[rows] / guess.c_C]))
        turned = (found[0] - found[1]) / (2.0 * s)
        turned[n:][np.logical_not(fast)] = 0.0
        by_step[:n] = (guess.c_C * of_r[:, c.y] @ W + 2.0 * guess.c_K * of_r[:, c.x] @ shift) / h
        by_step[n:][fast] = (guess.c_K / guess.c_C / h * (of_rate[:, c.x] @ shift))[fast]
        return turned, by_step

    # short steps ---------------------------------------------------------------------------------------------------
    def is_brief(self, h: float, mode: Mode) -> bool:
        """Whether the kernel takes a step of Heun's method in the place of one so short."""
        return h < BRIEF * self.full and (bool(mode.held) or h < BRIEFEST * self.full)

    def brief(self, motion: Motion, memory: Memory, mode: Mode, t1: float, dh: Vector) -> tuple[Motion, Memory]:
        """A step of Heun's method with consistent accelerations."""
        n_v, charts, h = self.programs.columns.n_v, self.programs.charts, t1 - motion.t
        first, last = memory.rates, memory.rates
        for _ in range(2):
            mean, of_mean = first.rate / 3.0 + last.rate / 6.0, first.of_rate / 3.0 + last.of_rate / 6.0
            way = h * (motion.y + h * mean)[:n_v]
            of_way = h * (motion.tangent.y + h * of_mean)[:n_v]
            of_way = of_way + (motion.y + 2.0 * h * mean)[:n_v, np.newaxis] * dh
            q, of_q = charts.compose(motion.q, way), charts.carried(motion.q, way, motion.tangent.q, of_way)
            sum_ = first.rate + last.rate
            y = motion.y + 0.5 * h * sum_
            of_y = motion.tangent.y + 0.5 * h * (first.of_rate + last.of_rate) + 0.5 * sum_[:, np.newaxis] * dh
            tangent = replace(motion.tangent, t=motion.tangent.t + dh, q=of_q, y=of_y)
            end = Motion(t1, q, y, motion.anchors, tangent)
            last = consistent_rates(self.programs, end, mode, last)
        return end, Memory(last, last.rate.copy(), last.of_rate.copy(), h)


def guess_row(of_rate: Matrix, c: Columns, guess: Prediction) -> Matrix:
    """``B̃ = ∂ḣ/∂v + (c_K/c_C) ∂ḣ/∂x``."""
    found = of_rate[:, c.y].copy()
    x = of_rate[:, c.x]
    found[:, : x.shape[1]] += guess.c_K / guess.c_C * x
    return found
