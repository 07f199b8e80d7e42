"""Steps of explicit Runge–Kutta formulas, differentiated stage by stage.

    x_i = h Σ a_ij v_j,   y_i = y₀ + h Σ a_ij rate_j,   rate_i consistent at (t₀ + c_i h, q₀ + x_i, y_i)

At the end positions and velocities are put on the rows: ``M(q̃) W + R ν = 0``, ``h(q̃ + W) = 0``, then
``M (v − ṽ) + R κ = 0``, ``ḣ(v) = 0``. Stages are evaluated again, as runs do not store them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.kernel.schemes.tableau import Tableau
from mbd.sensitivity.balance import consistent_rates, on_rows, saddle
from mbd.sensitivity.entries import stacked, system
from mbd.sensitivity.kernel.build import entry
from mbd.sensitivity.kernel.runge_kutta import runge_kutta_steps
from mbd.sensitivity.motion import Mode, Motion, Rates, solved
from mbd.sensitivity.one_step import OneStepMethod
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.run_data import Rows, RunRows
from mbd.sensitivity.schemes import Memory

__all__ = ["RungeKuttaSteps"]

MOST = 4
"""Newton corrections of positions onto the rows after a step; one or two [-]."""


class RungeKuttaSteps(OneStepMethod):
    """Derivatives of explicit steps of a formula."""

    def __init__(self, rows: RunRows, programs: Programs, formula: Tableau) -> None:
        super().__init__(rows, programs)
        self.formula = formula

    def taken(
        self, motion: Motion, rates: Rates, mode: Mode, rows: Rows, dh: Vector, checked: bool = True
    ) -> tuple[int, Motion, Rates]:
        """By the kernel."""
        return taken(self.programs, motion, rates, mode, rows, dh, self.formula, checked)

    def least(
        self, motion: Motion, memory: Memory, mode: Mode, time: float, dh: Vector, row: int
    ) -> tuple[Motion, Rates]:
        """A step in numpy, with least solutions of singular systems."""
        n_v = self.programs.columns.n_v
        h = time - motion.t
        speeds, rates = [motion.y[:n_v]], [memory.rates.rate]
        of_speeds, of_rates = [motion.tangent.y[:n_v]], [memory.rates.of_rate]
        last, formula = memory.rates, self.formula
        for stage in range(1, formula.stages):
            slopes = speeds, rates, of_speeds, of_rates
            at = self._moved(motion, h, dh, formula.weights[stage], slopes, formula.nodes[stage])
            last = consistent_rates(self.programs, at, mode, last)
            speeds.append(at.y[:n_v])
            rates.append(last.rate)
            of_speeds.append(at.tangent.y[:n_v])
            of_rates.append(last.of_rate)
        end = self._moved(motion, h, dh, formula.end, (speeds, rates, of_speeds, of_rates), 1.0)
        end = replace(end, t=time)
        if mode.rows:
            end = self._on_rows(end, mode)
        return end, consistent_rates(self.programs, end, mode, last)

    def _moved(
        self, motion: Motion, h: float, dh: Vector, weights: Vector,
        slopes: tuple[list[Vector], list[Vector], list[Matrix], list[Matrix]], node: float,
    ) -> Motion:  # fmt: skip
        """The motion moved by h times the weighted slopes of the first stages."""
        speeds, rates, of_speeds, of_rates = slopes
        used = weights[: len(speeds)]
        speed, rate = used @ np.array(speeds), used @ np.array(rates)
        of_speed, of_rate = np.tensordot(used, np.array(of_speeds), 1), np.tensordot(used, np.array(of_rates), 1)
        tangent = replace(
            motion.tangent, t=motion.tangent.t + node * dh,
            q=motion.tangent.q + h * of_speed + speed[:, np.newaxis] * dh,
            y=motion.tangent.y + h * of_rate + rate[:, np.newaxis] * dh,
        )  # fmt: skip
        return Motion(motion.t + node * h, motion.q + h * speed, motion.y + h * rate, motion.anchors, tangent)

    def _on_rows(self, motion: Motion, mode: Mode) -> Motion:
        """Positions and velocities on the rows, nearest in the metric of M."""
        c, rows = self.programs.columns, list(mode.rows)
        n, n_v, m = c.n, c.n_v, len(rows)
        zero = np.zeros(n), np.zeros(c.rows)
        fast = np.array([self.programs.equations.rows[k].is_velocity for k in rows], dtype=bool)
        first = self.programs.steps(motion.at(mode, *zero))
        A = saddle(first[3], first[5][rows], first[5][rows][:, c.y], self.programs, rows)
        found, q, now, K = np.zeros(n + m), motion.q, first, A
        for _ in range(MOST):
            height = np.where(fast, 0.0, now[1][rows])
            step = solved(K, -np.concatenate([np.zeros(n), height]))
            q, found = q + step[:n_v], found + step
            now = self.programs.steps(replace(motion, q=q).at(mode, *zero))
            K = saddle(now[3], now[5][rows], now[5][rows][:, c.y], self.programs, rows)
            if np.max(np.abs(step[:n_v]), initial=0.0) <= 1e-15 * np.max(np.abs(q), initial=1.0):
                break
        nu = np.zeros(c.rows)
        nu[rows] = found[n:]
        pushed = self.programs.steps(replace(motion, y=found[:n]).at(mode, found[:n], nu))
        still = self.programs.steps(replace(motion, y=zero[0]).at(mode, *zero))
        bare = self.programs.steps(replace(motion, y=found[:n]).at(mode, *zero))
        Z = motion.with_tangent(y=np.zeros_like(motion.tangent.y)).tangent.stacked(c)
        level = np.where(fast[:, np.newaxis], (pushed[5] - still[5])[rows], now[4][rows])
        B = np.where(fast[:, np.newaxis], first[5][rows][:, c.y], np.zeros((m, n)))
        B[:, :n_v] = np.where(fast[:, np.newaxis], B[:, :n_v], now[4][rows][:, c.x])
        matrix = np.block([[A[:n]], [np.hstack([B, np.zeros((m, m))])]])
        of_W = -solved(matrix, np.vstack([(pushed[3] - bare[3]) @ Z, level @ Z]))[:n_v]
        moved = replace(motion, q=q).with_tangent(q=motion.tangent.q + of_W)
        return on_rows(self.programs, moved, mode, motion.y, motion.tangent.y)


def taken(
    programs: Programs, motion: Motion, rates: Rates, mode: Mode, rows: Rows, dh: Vector,
    formula: Tableau, checked: bool = True,
) -> tuple[int, Motion, Rates]:  # fmt: skip
    """As many of the steps between these rows as the kernel takes from here; the state and rates after them.

    checked : false for one step whose end q, y is not known; rows then get it
    """
    known, level = system(programs, "consistent", mode, False), system(programs, "steps", mode, False)
    time, q, y, rate, lam = (np.ascontiguousarray(each) for each in rows)
    active = lam * known.held
    n, n_v, m, width = programs.columns.n, programs.columns.n_v, len(mode.rows), len(dh)
    Z = stacked(motion, known)
    w, size = Z.shape[1], n + m
    X, by_size, block = np.zeros((size, w)), np.zeros(w), np.zeros((2, programs.layout.size))
    X[:n, :width], by_size[:width] = rates.of_rate, dh
    programs.fill(block, motion.at(mode, rate[0], lam[0]))
    tableau, stages = np.concatenate([formula.end, formula.nodes, np.ravel(formula.weights)]), formula.stages
    slopes, of_slopes = np.empty((2, stages * n)), np.empty((2, stages * n * w))
    done = entry(runge_kutta_steps)(
        [known.function, level.function, *programs.charts.programs()], programs.values,
        known.of_width(width), level.of_width(width), tableau, stages,
        len(time) - 1, int(checked), time, q, y, rate, active, known.rows, known.fast, known.entries,
        level.entries, block[0], block[1], np.empty(max(known.outputs, level.outputs)), np.empty(level.outputs),
        slopes[0], slopes[1], of_slopes[0], of_slopes[1], X, Z, Z.copy(), by_size, np.empty(size * size),
        np.empty(size * size), np.empty(size * w), np.empty(size), np.empty(size), np.empty(size, dtype=np.int64),
        *programs.charts.room(w),
    )  # fmt: skip
    if done == 0:
        return 0, motion, rates
    tangent = replace(motion.tangent, t=Z[n_v + n + size, :width], q=Z[:n_v, :width], y=Z[n_v : n_v + n, :width])
    of_lam = np.zeros((programs.columns.rows, width))
    of_lam[known.rows] = X[n:, :width]
    end = Motion(float(time[done]), q[done].copy(), y[done].copy(), motion.anchors, tangent)
    return done, end, Rates(rate[done].copy(), lam[done] if checked else active[done], X[:n, :width], of_lam)
