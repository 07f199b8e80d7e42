"""Steps of the Runge–Kutta formulas of order 8, differentiated stage by stage.

    x_i = h Σ a_ij v_j,   y_i = y₀ + h Σ a_ij rate_j,   rate_i consistent at (t₀ + c_i h, q₀ + x_i, y_i)

At the end positions and velocities are put on the rows: ``M(q̃) W + R ν = 0``, ``h(q̃ + W) = 0``, then
``M (v − ṽ) + R κ = 0``, ``ḣ(v) = 0``. Stages are evaluated again, as runs do not store them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.kernel.schemes.dormand_prince import END, NODES, STAGES, WEIGHTS
from mbd.sensitivity.balance import consistent_rates, on_rows, saddle
from mbd.sensitivity.explicit import ExplicitSteps
from mbd.sensitivity.motion import Mode, Motion, Rates, Tangent, solved
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.run_data import RunRows
from mbd.sensitivity.schemes import SAME, Memory, SchemeSteps

__all__ = ["RungeKuttaSteps"]

MOST = 4
"""Newton corrections of positions onto the rows after a step; one or two [-]."""


@dataclass(frozen=True)
class Known:
    """A step: derivatives of its end, and of rates and multipliers at its start, by `inputs`; what acts in it."""

    matrix: Matrix
    rates: Matrix
    mode: Mode


def inputs(tangent: Tangent, dh: Vector) -> Matrix:
    """Derivatives of x, y, t, anchors, p and h."""
    t = tangent.t[np.newaxis]
    return np.vstack([tangent.q, tangent.y, t, tangent.anchors, tangent.p, dh[np.newaxis]])


class RungeKuttaSteps(SchemeSteps):
    """Derivatives of explicit steps."""

    def __init__(self, rows: RunRows, programs: Programs) -> None:
        super().__init__(rows, programs)
        self.known: dict[int, Known] = {}

    def start(self, motion: Motion, mode: Mode, rates: Rates) -> Memory:
        """It remembers nothing but its rates."""
        return Memory.of_rates(rates, 0.0)

    def prepare(self, motion: Motion, mode: Mode, first: int, last: int) -> None:
        """All steps of a segment at once, where forces do not follow multipliers."""
        record, rows = self.rows.record, self.rows
        self.known = {}
        if last <= first or self.programs.equations.frictions or rows.manager.trivial:
            return
        time, here = np.asarray(record.time[first : last + 1]), slice(first, last)
        steps = ExplicitSteps(
            self.programs, motion, mode, time[:-1], np.diff(time), np.asarray(record.q[here]), rows.y[here],
            rows.rate[here], np.asarray(record.lam[here]),
        )  # fmt: skip
        try:
            q, y, matrices, rates = steps.taken()
        except np.linalg.LinAlgError:
            return
        ends = np.hstack([record.q[first + 1 : last + 1], rows.y[first + 1 : last + 1]])
        off = np.max(np.abs(np.hstack([q, y]) - ends), axis=1)
        good = off <= SAME * np.max(np.abs(ends), axis=1, initial=1e-3)
        self.known = {first + k: Known(matrices[k], rates[k], mode) for k in np.flatnonzero(good).tolist()}

    def along(
        self, motion: Motion, memory: Memory, mode: Mode, row: int, dh: Vector, fresh: bool
    ) -> tuple[Motion, Memory]:
        """A step to a row."""
        end = self._quick(motion, row, dh)
        if end is None:
            end, rates = super().ended(motion, memory, mode, row, dh)
            return end, Memory.of_rates(rates, 0.0)
        return end, Memory.of_rates(self._rates(end, mode, row), 0.0)

    def ended(self, motion: Motion, memory: Memory, mode: Mode, row: int, dh: Vector) -> tuple[Motion, Rates]:
        """The same at an event."""
        end = self._quick(motion, row, dh)
        if end is None:
            return super().ended(motion, memory, mode, row, dh)
        return end, self._rates(end, mode, row)

    def _quick(self, motion: Motion, row: int, dh: Vector) -> Motion | None:
        """The step to a row by its matrix; None where it is not known."""
        known = self.known.get(row - 1)
        if known is None or self.rows.begins_late(motion.t, row - 1):
            return None
        record, n_v, tangent = self.rows.record, self.programs.columns.n_v, motion.tangent
        found = known.matrix @ inputs(tangent, dh)
        moved = replace(tangent, t=tangent.t + dh, q=found[:n_v], y=found[n_v:])
        return Motion(float(record.time[row]), np.array(record.q[row]), self.rows.y[row], motion.anchors, moved)

    def _rates(self, motion: Motion, mode: Mode, row: int) -> Rates:
        """Rates at a row, consistent in the mode of the step to it."""
        c, record, known = self.programs.columns, self.rows.record, self.known.get(row)
        rate, lam = self.rows.rate[row], np.array(record.lam[row])
        if known is None or known.mode is not mode:
            none = np.zeros((c.n, len(motion.tangent.t))), np.zeros((c.rows, len(motion.tangent.t)))
            return consistent_rates(self.programs, motion, mode, Rates(rate, lam, *none))
        found = known.rates @ inputs(motion.tangent, np.zeros_like(motion.tangent.t))
        of_lam = np.zeros((c.rows, found.shape[1]))
        of_lam[list(mode.rows)] = found[c.n :]
        return Rates(rate, lam, found[: c.n], of_lam)

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
