"""Derivatives of many steps of the Newmark family at once, between rows that are known (`newmark` takes one alone).

Each step gives a matrix from the derivatives (q₀, y₀, v̇₀, a₀, t, anchors, p) to those at its end, which the pass
multiplies by one after the other. Sizes of these steps do not change.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.sensitivity.motion import Mode, Motion
from mbd.sensitivity.newmark import FOLLOWED, NewmarkSteps
from mbd.sensitivity.programs import State
from mbd.sensitivity.schemes import Memory

__all__ = ["ImplicitSteps"]

Cube = NDArray[np.float64]
"""Matrices of many steps (N, rows, columns)."""


@dataclass
class ImplicitSteps:
    """Steps between N + 1 rows (t, q, y) with their rates and multipliers.

    Parameters
    ----------
    steps : the scheme; motion : holds the anchors; mode : what acts
    memory : of the scheme at the first row
    """

    steps: NewmarkSteps
    motion: Motion
    mode: Mode
    t: Vector
    q: Matrix
    y: Matrix
    rate: Matrix
    lam: Matrix
    memory: Memory

    def __post_init__(self) -> None:
        s = self.steps
        self.c = c = s.programs.columns
        self.n, self.n_v, self.rows, self.h = c.n, c.n_v, list(self.mode.rows), np.diff(self.t)
        self.stretch = self.h / np.concatenate([[self.memory.step], self.h[:-1]])
        self.inputs = np.r_[c.x, c.y, c.t, c.anchor, c.p]
        self.mean = (1.0 - s.alpha_f) / (1.0 - s.alpha_m)
        self.c_C, self.c_K = s.gamma * self.h * self.mean, s.beta * self.h**2 * self.mean
        self.auxiliary()

    def auxiliary(self) -> None:
        """a at all rows (N + 1, n), and a₀ of each step."""
        s, rate, count = self.steps, self.rate, len(self.h)
        self.a, self.a0 = np.empty((count + 1, self.n)), np.empty((count, self.n))
        self.a[0] = self.memory.aux
        fixed = ((1.0 - s.alpha_f) * rate[1:] + s.alpha_f * rate[:-1]) / (1.0 - s.alpha_m)
        if s.alpha_m == 0.0:
            self.a[1:] = fixed
            self.a0[:] = rate[:-1] + self.stretch[:, np.newaxis] * (self.a[:-1] - rate[:-1])
            return
        part = s.alpha_m / (1.0 - s.alpha_m)
        for k in range(count):
            self.a0[k] = rate[k] + self.stretch[k] * (self.a[k] - rate[k])
            self.a[k + 1] = fixed[k] - part * self.a0[k]

    def followed(self) -> int:
        """How many of the steps, from the first on, end with the velocities of the rows."""
        s, h = self.steps, self.h[:, np.newaxis]
        way = h * ((1.0 - s.gamma) * self.a0 + s.gamma * self.a[1:])
        size = np.max(np.abs(self.y[1:]), axis=1, initial=0.0)
        size = size + self.h * np.max(np.abs(self.a0) + np.abs(self.a[1:]), axis=1, initial=0.0)
        off = np.max(np.abs(self.y[:-1] + way - self.y[1:]), axis=1, initial=0.0)
        good = off <= FOLLOWED * self.h * size / s.full + 1e-14 * size
        return len(good) if good.all() else int(np.argmin(good))

    def predictions(self) -> tuple[Matrix, Matrix, Matrix, Matrix]:
        """q, y, rates and multipliers where the kernel predicts the ends, at which its metric of corrections is."""
        s, n_v, memory, h, stretch = (
            self.steps,
            self.n_v,
            self.memory,
            self.h[:, np.newaxis],
            self.stretch[:, np.newaxis],
        )
        shift = self.shifts()
        none = np.zeros(n_v)
        first, change = (none if each is None else each for each in (memory.shift, memory.shift_change))
        last = np.vstack([first, shift[:-1]])
        growth = np.vstack([change, np.diff(last, axis=0)])
        slope = np.zeros(self.n) if memory.slope is None else memory.slope
        lam_slope = np.zeros(self.c.rows) if memory.lam_slope is None else memory.lam_slope
        before = self.h[:-1, np.newaxis]
        slopes = np.vstack([slope, np.diff(self.rate, axis=0)[:-1] / before])
        lam_slopes = np.vstack([lam_slope, np.diff(self.lam, axis=0)[:-1] / before])
        rate, lam = self.rate[:-1] + h * slopes, self.lam[:-1] + h * lam_slopes
        a1 = ((1.0 - s.alpha_f) * rate + s.alpha_f * self.rate[:-1] - s.alpha_m * self.a0) / (1.0 - s.alpha_m)
        y = self.y[:-1] + h * ((1.0 - s.gamma) * self.a0 + s.gamma * a1)
        x = h * self.y[:-1, :n_v] + h * h * ((0.5 - s.beta) * self.a0 + s.beta * a1)[:, :n_v]
        return self.q[:-1] + x + (last + stretch * growth) * stretch**3, y, rate, lam

    def shifts(self) -> Matrix:
        """U of each step (N, n_v)."""
        s, h, n_v = self.steps, self.h[:, np.newaxis], self.n_v
        shift = np.diff(self.q, axis=0) - h * self.y[:-1, :n_v]
        return np.asarray(shift - h * h * ((0.5 - s.beta) * self.a0 + s.beta * self.a[1:])[:, :n_v])

    def evaluated(
        self, at: tuple[Matrix, Matrix, Matrix, Matrix], along: tuple[Matrix, Matrix, Matrix] | None, sign: float
    ) -> Cube:
        """Derivatives of r, h, ḣ (N, n + 2R, columns) at places, or moved along (W, ν, 1/size) in both signs."""
        programs, held = self.steps.programs, list(self.mode.held)
        q, y, rate = at[:3]
        lam = np.zeros_like(at[3])
        lam[:, held] = at[3][:, held]
        if along is not None:
            W, nu, scale = along
            scale = sign * scale
            q = q + scale * self.c_K[:, np.newaxis] * W[:, : self.n_v]
            y, rate, lam = y + scale * self.c_C[:, np.newaxis] * W, rate + scale * W, lam + scale * nu
        blocks = np.zeros((len(self.h), programs.layout.size))
        programs.fill(blocks, State(0.0, q, y, rate, lam, self.motion.anchors, self.mode.switch, self.mode.slip))
        blocks[:, 0] = self.t[1:]
        return programs.many("steps", blocks, self.n + 2 * self.c.rows)[1]

    def by_rates(self, level: Cube) -> Cube:
        """∂/∂v̇ + c_C ∂/∂v + c_K ∂/∂x."""
        c, c_C, c_K = self.c, self.c_C[:, np.newaxis, np.newaxis], self.c_K[:, np.newaxis, np.newaxis]
        found = level[:, :, c.rate] + c_C * level[:, :, c.y]
        found[:, :, : self.n_v] += c_K * level[:, :, c.x]
        return np.asarray(found)

    def response(self) -> tuple[Cube, Cube, Cube]:
        """Derivatives of v̇₁, λ and of x₁ beside its prediction, by (x, y, t, anchors, p) of the prediction."""
        c, n, n_v, rows, m, R = self.c, self.n, self.n_v, self.rows, len(self.rows), self.c.rows
        J = self.evaluated((self.q[1:], self.y[1:], self.rate[1:], self.lam[1:]), None, 0.0)
        of_r, of_h, of_rate = J[:, :n], J[:, n : n + R][:, rows], J[:, n + R :][:, rows]
        equations, count = self.steps.programs.equations, len(self.h)
        fast = np.array([equations.rows[k].is_velocity for k in rows], dtype=bool)[:, np.newaxis]
        S, B = self.by_rates(of_r), of_r[:, :, c.lam][:, :, rows]
        size = n + m
        if not (self.steps.stabilized and m):
            level = np.where(fast, of_rate, of_h)
            A = np.zeros((count, size, size))
            A[:, :n, :n], A[:, :n, n:], A[:, n:, :n] = S, B, self.by_rates(level)
            found = -np.linalg.solve(A, np.concatenate([of_r, level], 1)[:, :, self.inputs])
            return found[:, :n], found[:, n:], np.zeros((count, n_v, len(self.inputs)))
        both = np.concatenate([of_r, of_rate], 1)
        ahead = self.predictions()
        near = self.evaluated(ahead, None, 0.0)
        metric, near_B, near_rate = (
            self.by_rates(near[:, :n]),
            near[:, :n, c.lam][:, :, rows],
            near[:, n + R :][:, rows],
        )
        turned = self.turned(ahead, metric, near_B, near_rate, fast)
        A = np.zeros((count, 2 * size, 2 * size))
        A[:, :size, :n], A[:, :n, n:size] = self.by_rates(both), B
        A[:, :size, size : size + n_v] = both[:, :, c.x]
        A[:, size : size + n, size : size + n] = metric
        A[:, size : size + n, size + n :] = near_B
        A[:, size + n :, :n] = np.where(fast, 0.0, self.by_rates(of_h))
        A[:, size + n :, size : size + n_v] = np.where(fast, self.tilted(near_rate)[:, :, :n_v], of_h[:, :, c.x])
        width, moving = len(self.inputs), n_v + n
        right = np.zeros((count, 2 * size, width + moving + size))  # by the inputs; x, y, rates and λ of the prediction
        right[:, :size, :width] = both[:, :, self.inputs]
        lower = np.concatenate([turned[:, :n], np.where(fast, turned[:, n:], of_h)], 1)
        right[:, size:, :width] = lower[:, :, self.inputs]
        right[:, size : size + n, width : width + moving] = right[:, size : size + n, :moving]
        right[:, size : size + n, width + moving : width + moving + n] = turned[:, :n, c.rate]
        right[:, size : size + n, width + moving + n :] = turned[:, :n, c.lam][:, :, rows]
        right[:, size + n :, width : width + moving] = np.where(fast, right[:, size + n :, :moving], 0.0)
        right[:, size : size + n, :moving] = 0.0
        right[:, size + n :, :moving] = np.where(fast, 0.0, right[:, size + n :, :moving])
        found = -np.linalg.solve(A, right)
        return np.asarray(found[:, :n]), np.asarray(found[:, n:size]), np.asarray(found[:, size : size + n_v])

    def tilted(self, of_rate: Cube) -> Cube:
        """``B̃ = ∂ḣ/∂v + (c_K/c_C) ∂ḣ/∂x``."""
        found = of_rate[:, :, self.c.y].copy()
        found[:, :, : self.n_v] += (self.c_K / self.c_C)[:, np.newaxis, np.newaxis] * of_rate[:, :, self.c.x]
        return np.asarray(found)

    def turned(self, at: tuple[Matrix, Matrix, Matrix, Matrix], S: Cube, B: Cube, of_rate: Cube, fast: Matrix) -> Cube:
        """Derivatives (N, n + m, columns) of ``S W + R ν`` and of ``B̃ W`` with W, ν held."""
        n, n_v, m, h, shift = self.n, self.n_v, len(self.rows), self.h, self.shifts()
        tilted = self.tilted(of_rate)
        K, right = np.zeros((len(h), n + m, n + m)), np.zeros((len(h), n + m, 1))
        K[:, :n, :n], K[:, :n, n:], K[:, n:, :n] = S, B, tilted
        right[:, n:] = tilted[:, :, :n_v] @ shift[:, :, np.newaxis]
        found = np.asarray(np.linalg.solve(K, right)[:, :, 0], dtype=float)
        W, nu = found[:, :n].copy(), np.zeros((len(h), self.c.rows))
        W[:, :n_v], nu[:, self.rows] = shift, found[:, n:]
        large = np.max(np.abs(W), axis=1, initial=0.0)[:, np.newaxis]
        scale = np.asarray(1.0 / np.where(large > 0.0, large, 1.0), dtype=float)
        ahead, back = (self.evaluated(at, (W, nu, scale), sign) for sign in (1.0, -1.0))
        turned = (ahead - back) / (2.0 * scale[:, :, np.newaxis])
        rates = turned[:, n + self.c.rows :][:, self.rows] / self.c_C[:, np.newaxis, np.newaxis]
        return np.concatenate([turned[:, :n], np.where(fast, rates, 0.0)], 1)

    def matrices(self) -> tuple[Cube, Cube]:
        """From (q₀, y₀, v̇₀, a₀, σ, U, ΔU, λ, its slope, t, anchors, p) to the same at the end (N, d, d); λ (N, m, d).

        σ, U, ΔU are the slope of rates, the position correction and its change, of the stabilized form with rows alone.
        """
        s, n, n_v, h = self.steps, self.n, self.n_v, self.h
        of_rate, of_lam, of_x = self.response()
        more = of_rate.shape[2] - len(self.inputs)  # n_v + n in the stabilized form
        rest = len(self.inputs) - n_v - n
        m = len(self.rows)
        parts = np.cumsum([0, n_v, n, n, n, *((n, n_v, n_v, m, m) if more else (0, 0, 0, 0, 0)), rest])
        at_q, at_y, at_rate, at_aux, at_slope, at_shift, at_change, at_lam, at_lam_slope, others = map(
            slice, parts[:-1], parts[1:]
        )
        place = np.zeros((len(h), len(self.inputs) + more, parts[-1]))
        x, y = slice(0, n_v), slice(n_v, n_v + n)
        first = n_v + n + rest
        ahead_x, ahead_y = slice(first, first + n_v), slice(first + n_v, first + n_v + n)
        place[:, n_v + n : n_v + n + rest, others] = np.eye(rest)
        stretch, mean = self.stretch, 1.0 / (1.0 - s.alpha_m)
        a0 = {at_rate.start: 1.0 - stretch, at_aux.start: stretch}
        last = {k: mean * ((s.alpha_f if k == at_rate.start else 0.0) - s.alpha_m * each) for k, each in a0.items()}
        later = {at_rate.start: last[at_rate.start] + self.mean, at_aux.start: last[at_aux.start]}
        self.moved(place, x, y, (at_q, at_y), a0, last)
        if more:
            self.moved(place, ahead_x, ahead_y, (at_q, at_y), a0, later)
            spread = np.eye(n) * h[:, np.newaxis, np.newaxis]
            place[:, ahead_y, at_slope] = self.c_C[:, np.newaxis, np.newaxis] * spread
            place[:, ahead_x, at_slope] = self.c_K[:, np.newaxis, np.newaxis] * spread[:, :n_v]
            place[:, ahead_y.stop : ahead_y.stop + n, at_rate] = np.eye(n)
            place[:, ahead_y.stop : ahead_y.stop + n, at_slope] = spread
            place[:, ahead_y.stop + n :, at_lam] = np.eye(m)
            place[:, ahead_y.stop + n :, at_lam_slope] = np.eye(m) * h[:, np.newaxis, np.newaxis]
            cube = (stretch**3)[:, np.newaxis, np.newaxis]
            place[:, ahead_x, at_shift] = cube * np.eye(n_v)
            place[:, ahead_x, at_change] = cube * stretch[:, np.newaxis, np.newaxis] * np.eye(n_v)
        change, shift = of_rate @ place, of_x @ place
        out = np.zeros((len(h), parts[-1], parts[-1]))
        out[:, at_q] = place[:, x] + self.c_K[:, np.newaxis, np.newaxis] * change[:, :n_v] + shift
        out[:, at_y] = place[:, y] + self.c_C[:, np.newaxis, np.newaxis] * change
        out[:, at_rate], out[:, at_aux] = change, self.mean * change
        of_multipliers = of_lam @ place
        for first, each in last.items():
            out[:, at_aux, first : first + n] += each[:, np.newaxis, np.newaxis] * np.eye(n)
        if more:
            out[:, at_slope] = change / h[:, np.newaxis, np.newaxis]
            out[:, at_slope, at_rate] -= np.eye(n) / h[:, np.newaxis, np.newaxis]
            out[:, at_shift], out[:, at_change] = shift, shift
            out[:, at_change, at_shift] -= np.eye(n_v)
            out[:, at_lam], out[:, at_lam_slope] = of_multipliers, of_multipliers / h[:, np.newaxis, np.newaxis]
            out[:, at_lam_slope, at_lam] -= np.eye(m) / h[:, np.newaxis, np.newaxis]
        out[:, others, others] = np.eye(rest)
        return out, of_multipliers

    def moved(
        self, place: Cube, x: slice, y: slice, known: tuple[slice, slice], a0: dict[int, Vector], a1: dict[int, Vector]
    ) -> None:
        """Derivatives of a place and its velocities by q, y and, from these columns on, rates and auxiliary ones."""
        s, n, n_v, h = self.steps, self.n, self.n_v, self.h
        place[:, x, known[0]], place[:, y, known[1]] = np.eye(n_v), np.eye(n)
        place[:, x, known[1].start : known[1].start + n_v] = h[:, np.newaxis, np.newaxis] * np.eye(n_v)
        for first in a0:
            speed = h * ((1.0 - s.gamma) * a0[first] + s.gamma * a1[first])
            way = h * h * ((0.5 - s.beta) * a0[first] + s.beta * a1[first])
            place[:, y, first : first + n] = speed[:, np.newaxis, np.newaxis] * np.eye(n)
            place[:, x, first : first + n] = way[:, np.newaxis, np.newaxis] * np.eye(n)[:n_v]
