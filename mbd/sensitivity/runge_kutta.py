"""Steps of the Runge–Kutta formulas of order 8, differentiated stage by stage.

    x_i = h Σ a_ij v_j,   y_i = y₀ + h Σ a_ij rate_j,   rate_i consistent at (t₀ + c_i h, q₀ + x_i, y_i)

At the end positions and velocities are put on the rows: ``M(q̃) W + R ν = 0``, ``h(q̃ + W) = 0``, then
``M (v − ṽ) + R κ = 0``, ``ḣ(v) = 0``. Stages are evaluated again, as runs do not store them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.kernel.schemes.dormand_prince import END, NODES, STAGES, WEIGHTS
from mbd.sensitivity.balance import consistent_rates, on_rows, saddle
from mbd.sensitivity.motion import Mode, Motion, Rates, solved
from mbd.sensitivity.schemes import Memory, SchemeSteps

__all__ = ["RungeKuttaSteps"]

MOST = 4
"""Newton corrections of positions onto the rows after a step; one or two [-]."""


class RungeKuttaSteps(SchemeSteps):
    """Derivatives of explicit steps."""

    def start(self, motion: Motion, mode: Mode, rates: Rates) -> Memory:
        """It remembers nothing but its rates."""
        return Memory.of_rates(rates, 0.0)

    def along(
        self, motion: Motion, memory: Memory, mode: Mode, row: int, dh: Vector, fresh: bool
    ) -> tuple[Motion, Memory]:
        """A step to a row."""
        end, rates = self.ended(motion, memory, mode, row, dh)
        return end, Memory.of_rates(rates, 0.0)

    def reached(
        self, motion: Motion, memory: Memory, mode: Mode, time: float, dh: Vector, row: int
    ) -> Iterator[tuple[Motion, Rates]]:
        """All steps are alike."""
        n_v = self.programs.columns.n_v
        h = time - motion.t
        speeds, rates = [motion.y[:n_v]], [memory.rates.rate]
        of_speeds, of_rates = [motion.tangent.y[:n_v]], [memory.rates.of_rate]
        last = memory.rates
        for stage in range(1, STAGES):
            at = self._moved(motion, h, dh, WEIGHTS[stage], (speeds, rates, of_speeds, of_rates), NODES[stage])
            last = consistent_rates(self.programs, at, mode, last)
            speeds.append(at.y[:n_v])
            rates.append(last.rate)
            of_speeds.append(at.tangent.y[:n_v])
            of_rates.append(last.of_rate)
        end = self._moved(motion, h, dh, END, (speeds, rates, of_speeds, of_rates), 1.0)
        end = replace(end, t=time)
        if mode.rows:
            end = self._on_rows(end, mode)
        yield end, consistent_rates(self.programs, end, mode, last)

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
