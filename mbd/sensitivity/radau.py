"""Steps of the three-stage Radau IIA method, differentiated as the implicit function of all stages together.

    Y_i = y₀ + h Σ a_ij W_j,   X_i = h c_i v₀ + h² Σ (A²)_ij W_j + U_i,   r_i = 0,   h_i = 0,   ḣ_i = 0

U_i is normal to the rows in the metric of Newton's matrix of the middle stage, ``S W + R ν = 0`` with ∂v/∂v̇ = μh,
∂x/∂v̇ = (μh)² (see `mbd.kernel.schemes.stages`). Stages are solved for again, as runs do not store them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.kernel.schemes.collocation import RADAU
from mbd.sensitivity.balance import consistent_rates
from mbd.sensitivity.entries import stacked, system
from mbd.sensitivity.kernel.build import entry
from mbd.sensitivity.kernel.radau import radau_steps
from mbd.sensitivity.motion import Mode, Motion, Rates, reach, solved
from mbd.sensitivity.one_step import OneStepMethod
from mbd.sensitivity.programs import Columns, Programs
from mbd.sensitivity.run_data import Rows
from mbd.sensitivity.schemes import Memory

__all__ = ["RadauSteps"]

MOST = 12
"""Newton iterations for the stages of a step [-]."""
MIDDLE = 1
SQUARE = RADAU.A @ RADAU.A


@dataclass
class Stages:
    """Rates (3, n), multipliers (3, R) and position corrections with what belongs to them: P (3, n), ν (3, R)."""

    W: Matrix
    lam: Matrix
    P: Matrix
    nu: Matrix


class RadauSteps(OneStepMethod):
    """Derivatives of implicit steps of order 5."""

    def taken(
        self, motion: Motion, rates: Rates, mode: Mode, rows: Rows, dh: Vector, checked: bool = True
    ) -> tuple[int, Motion, Rates]:
        """By the kernel."""
        return taken(self.programs, motion, rates, mode, rows, dh, checked)

    def least(
        self, motion: Motion, memory: Memory, mode: Mode, time: float, dh: Vector, row: int
    ) -> tuple[Motion, Rates]:
        """A step in numpy, with least solutions of singular systems."""
        h, n_v = time - motion.t, self.programs.columns.n_v
        first, last = memory.rates, Rates(self.rows.rate[row], np.array(self.rows.record.lam[row]), *_NONE)
        part = RADAU.c[:, np.newaxis]
        stages = Stages(
            first.rate + part * (last.rate - first.rate), first.lam + part * (last.lam - first.lam),
            np.zeros((3, self.programs.columns.n)), np.zeros((3, self.programs.columns.rows)),
        )  # fmt: skip
        for _ in range(MOST):
            values, slopes = self._evaluated(motion, mode, stages, h)
            A, metric = self._matrix(slopes, mode, h, None)
            residual = self._residual(values, metric, mode, stages)
            if self._corrected(stages, -solved(A, residual), mode):
                break
        values, slopes = self._evaluated(motion, mode, stages, h)
        turned = [self._turned(motion, mode, stages, h, i) for i in range(3)] if mode.rows else None
        A, metric = self._matrix(slopes, mode, h, turned)
        places = [self._place(motion, stages, h, dh, i) for i in range(3)]
        found = -solved(A, self._changes(slopes, turned, metric, places, mode, stages, h, dh))
        of_W = np.array([found[i * self._size(mode) :][: self.programs.columns.n] for i in range(3)])
        q, y, _ = self._stage(motion, stages, h, 2)
        of_x, of_y = places[2].tangent.q, places[2].tangent.y
        of_x = of_x + h * h * np.tensordot(SQUARE[2], of_W[:, :n_v], 1)
        if mode.rows:
            at = 2 * self._size(mode) + self.programs.columns.n + len(mode.rows)
            of_x = of_x + found[at : at + n_v]
        of_y = of_y + h * np.tensordot(RADAU.A[2], of_W, 1)
        end = Motion(time, q, y, motion.anchors, replace(places[2].tangent, q=of_x, y=of_y))
        return end, consistent_rates(self.programs, end, mode, last)

    # parts --------------------------------------------------------------------------------------------------------
    def _size(self, mode: Mode) -> int:
        """Unknowns of a stage: W, λ, and P, ν where rows act."""
        m = len(mode.rows)
        return (self.programs.columns.n + m) * (2 if m else 1)

    def _stage(self, motion: Motion, stages: Stages, h: float, i: int) -> tuple[Vector, Vector, float]:
        """q, y, t of a stage."""
        n_v = self.programs.columns.n_v
        y = motion.y + h * RADAU.A[i] @ stages.W
        x = h * RADAU.c[i] * motion.y[:n_v] + h * h * (SQUARE[i] @ stages.W)[:n_v] + stages.P[i, :n_v]
        return motion.q + x, y, motion.t + float(RADAU.c[i]) * h

    def _evaluated(
        self, motion: Motion, mode: Mode, stages: Stages, h: float
    ) -> tuple[list[tuple[Vector, Vector, Vector]], list[tuple[Matrix, Matrix, Matrix]]]:
        """(r, h, ḣ) of each stage, and their derivatives."""
        values, slopes = [], []
        for i in range(3):
            q, y, t = self._stage(motion, stages, h, i)
            r, level, speed, *of = self.programs.steps(
                replace(motion, t=t, q=q, y=y).at(mode, stages.W[i], stages.lam[i])
            )
            values.append((r, level, speed))
            slopes.append((of[0], of[1], of[2]))
        return values, slopes

    def _through(self, slopes: Matrix, i: int, j: int, h: float) -> Matrix:
        """Derivatives of what has these slopes at stage i by W_j."""
        c = self.programs.columns
        found = h * RADAU.A[i, j] * slopes[:, c.y]
        found[:, : c.n_v] += h * h * SQUARE[i, j] * slopes[:, c.x]
        return np.asarray(found + slopes[:, c.rate] if i == j else found)

    def _fast(self, mode: Mode) -> Matrix:
        rows = self.programs.equations.rows
        return np.array([[rows[k].is_velocity] for k in mode.rows], dtype=bool).reshape(-1, 1)

    def _matrix(
        self, slopes: list[tuple[Matrix, Matrix, Matrix]], mode: Mode, h: float, turned: list[Matrix] | None
    ) -> tuple[Matrix, Matrix]:
        """The Jacobian of all stages; and ``[S R; B̃ 0]`` of the middle one."""
        c, rows = self.programs.columns, list(mode.rows)
        n, n_v, m, size = c.n, c.n_v, len(rows), self._size(mode)
        metric, fast = self._metric(slopes[MIDDLE], c, rows, h), self._fast(mode)
        A = np.zeros((3 * size, 3 * size))
        for i in range(3):
            of_r, of_h, of_speed = slopes[i][0], slopes[i][1][rows], slopes[i][2][rows]
            o = i * size
            for j in range(3):
                A[o : o + n, j * size : j * size + n] = self._through(of_r, i, j, h)
                A[o + n : o + n + m, j * size : j * size + n] = self._through(of_speed, i, j, h)
                if m:
                    level = np.where(fast, 0.0, self._through(of_h, i, j, h))
                    A[o + 2 * n + m : o + size, j * size : j * size + n] = level
            A[o : o + n, o + n : o + n + m] = of_r[:, c.lam][:, rows]
            if m:
                p = o + n + m
                A[o : o + n, p : p + n_v], A[o + n : o + n + m, p : p + n_v] = of_r[:, c.x], of_speed[:, c.x]
                A[p : p + n, p : p + n + m] = metric[:n]
                A[p + n : p + n + m, p : p + n] = np.where(fast, metric[n:, :n], 0.0)
                A[p + n : p + n + m, p : p + n_v] += np.where(fast, 0.0, of_h[:, c.x])
                if turned is not None:
                    self._add_turned(A, turned[i], p, mode, h)
        return A, metric

    def _add_turned(self, A: Matrix, turned: Matrix, p: int, mode: Mode, h: float) -> None:
        """How the metric of the middle stage follows the stages."""
        c, rows, size = self.programs.columns, list(mode.rows), self._size(mode)
        n, m, o = c.n, len(rows), MIDDLE * size
        for j in range(3):
            A[p : p + n, j * size : j * size + n] += self._through(turned, MIDDLE, j, h)
        A[p : p + n, o + n : o + n + m] += turned[:, c.lam][:, rows]
        A[p : p + n, o + n + m : o + n + m + c.n_v] += turned[:, c.x]

    def _metric(self, slopes: tuple[Matrix, Matrix, Matrix], c: Columns, rows: list[int], h: float) -> Matrix:
        """``[S R; B̃ 0]`` with ∂v/∂v̇ = μh, ∂x/∂v̇ = (μh)²."""
        n, m, step = c.n, len(rows), RADAU.real * h
        out = np.zeros((n + m, n + m))
        out[:n, :n] = slopes[0][:, c.rate] + step * slopes[0][:, c.y]
        out[:n, : c.n_v] += step * step * slopes[0][:, c.x]
        out[:n, n:] = slopes[0][:, c.lam][:, rows]
        out[n:, :n] = slopes[2][rows][:, c.y]
        out[n:, : c.n_v] += step * slopes[2][rows][:, c.x]
        return out

    def _residual(
        self, values: list[tuple[Vector, Vector, Vector]], metric: Matrix, mode: Mode, stages: Stages
    ) -> Vector:
        rows, fast = list(mode.rows), self._fast(mode)[:, 0]
        n, parts = self.programs.columns.n, []
        for i, (r, level, speed) in enumerate(values):
            parts += [r, speed[rows]]
            if rows:
                own = metric @ np.concatenate([stages.P[i], stages.nu[i, rows]])
                parts += [own[:n], np.where(fast, own[n:], level[rows])]
        return np.concatenate(parts)

    def _corrected(self, stages: Stages, step: Vector, mode: Mode) -> bool:
        """Take a correction; whether it was round-off."""
        rows, n, size = list(mode.rows), self.programs.columns.n, self._size(mode)
        m, change = len(rows), 0.0
        for i in range(3):
            own = step[i * size : (i + 1) * size]
            stages.W[i] += own[:n]
            stages.lam[i, rows] += own[n : n + m]
            if m:
                stages.P[i] += own[n + m : 2 * n + m]
                stages.nu[i, rows] += own[2 * n + m :]
            change = max(change, float(np.max(np.abs(own[:n]), initial=0.0)))
        return change <= 1e-13 * float(np.max(np.abs(stages.W), initial=1e-300))

    def _turned(self, motion: Motion, mode: Mode, stages: Stages, h: float, i: int) -> Matrix:
        """Derivatives of ``S P_i + R ν_i`` with P_i, ν_i held, by what the middle stage depends on."""
        c, step = self.programs.columns, RADAU.real * h
        P, nu = stages.P[i], stages.nu[i]
        large = float(np.max(np.abs(P), initial=0.0))
        if large == 0.0:
            return np.zeros((c.n, c.count))
        q, y, t = self._stage(motion, stages, h, MIDDLE)
        found = []
        for s in (1.0 / large, -1.0 / large):
            place = replace(motion, t=t, q=q + s * step * step * P[: c.n_v], y=y + s * step * P)
            at = place.at(mode, stages.W[MIDDLE] + s * P, stages.lam[MIDDLE] + s * nu)
            found.append(self.programs.steps(at)[3])
        return np.asarray(0.5 * large * (found[0] - found[1]))

    def _place(self, motion: Motion, stages: Stages, h: float, dh: Vector, i: int) -> Motion:
        """The motion at a stage, with the derivatives that it has while W, U do not change."""
        n_v, tangent = self.programs.columns.n_v, motion.tangent
        q, y, t = self._stage(motion, stages, h, i)
        speed = RADAU.c[i] * motion.y[:n_v] + 2.0 * h * (SQUARE[i] @ stages.W)[:n_v]
        moved = replace(
            tangent, t=tangent.t + RADAU.c[i] * dh,
            q=tangent.q + h * RADAU.c[i] * tangent.y[:n_v] + speed[:, np.newaxis] * dh,
            y=tangent.y + (RADAU.A[i] @ stages.W)[:, np.newaxis] * dh,
        )  # fmt: skip
        return Motion(t, q, y, motion.anchors, moved)

    def _changes(
        self, slopes: list[tuple[Matrix, Matrix, Matrix]], turned: list[Matrix] | None, metric: Matrix,
        places: list[Motion], mode: Mode, stages: Stages, h: float, dh: Vector,
    ) -> Matrix:  # fmt: skip
        """Derivatives of all equations while the unknowns do not change."""
        c, rows, fast, parts = self.programs.columns, list(mode.rows), self._fast(mode), []
        middle, step = places[MIDDLE].tangent.stacked(c), RADAU.real * h
        for i in range(3):
            Z = places[i].tangent.stacked(c)
            parts += [slopes[i][0] @ Z, slopes[i][2][rows] @ Z]
            if turned is not None:
                own, U = slopes[MIDDLE][0], stages.P[i, : c.n_v]
                by_step = (step * own[:, c.y] @ stages.P[i] + 2.0 * step * step * own[:, c.x] @ U) / h
                parts.append(turned[i] @ middle + by_step[:, np.newaxis] * dh)
                parts.append(np.where(fast, 0.0, slopes[i][1][rows] @ Z))
        return np.vstack(parts)


_NONE = np.zeros((0, 0)), np.zeros((0, 0))


def taken(
    programs: Programs, motion: Motion, rates: Rates, mode: Mode, rows: Rows, dh: Vector, checked: bool = True
) -> tuple[int, Motion, Rates]:
    """As many of the steps between these rows as the kernel takes from here; the state and rates after them.

    checked : false for one step whose end q, y is not known; rows then get it
    """
    known, level = system(programs, "consistent", mode, False), system(programs, "steps", mode, False)
    time, q, y, rate, lam = (np.ascontiguousarray(each) for each in rows)
    active = lam * known.held
    n, n_v, m, width = programs.columns.n, programs.columns.n_v, len(mode.rows), len(dh)
    Z = stacked(motion, known)
    w, size, unknowns = Z.shape[1], n + m, 3 * (n + m) * (2 if m else 1)
    X, by_size, block = np.zeros((size, w)), np.zeros(w), np.zeros(programs.layout.size)
    by_size[:width] = dh
    programs.fill(block, motion.at(mode, rate[0], lam[0]))
    numbers = np.concatenate([RADAU.c, np.ravel(RADAU.A), np.ravel(SQUARE), [RADAU.real, reach(mode)]])
    outputs = level.outputs
    done = entry(radau_steps)(
        [known.function, level.function, *programs.charts.programs()], programs.values,
        level.of_width(width), known.of_width(width), numbers,
        len(time) - 1, int(checked), outputs, time, q, y, rate, active, known.rows, known.fast, level.entries,
        known.entries, block, np.empty(max(known.outputs, outputs)), np.empty(3 * outputs), np.empty(outputs),
        np.empty(6 * size), X, Z, np.empty(3 * Z.size), by_size, np.empty(unknowns**2), np.empty(unknowns * w),
        np.empty(unknowns), np.empty(size**2), np.empty(unknowns, dtype=np.int64), *programs.charts.stage_room(w),
    )  # fmt: skip
    if done == 0:
        return 0, motion, rates
    tangent = replace(motion.tangent, t=Z[n_v + n + size, :width], q=Z[:n_v, :width], y=Z[n_v : n_v + n, :width])
    of_lam = np.zeros((programs.columns.rows, width))
    of_lam[known.rows] = X[n:, :width]
    end = Motion(float(time[done]), q[done].copy(), y[done].copy(), motion.anchors, tangent)
    return done, end, Rates(rate[done].copy(), lam[done] if checked else active[done], X[:n, :width], of_lam)
