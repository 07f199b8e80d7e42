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

__all__ = ["ImplicitSteps"]

Cube = NDArray[np.float64]
"""Matrices of many steps (N, rows, columns)."""


@dataclass
class ImplicitSteps:
    """Steps between N + 1 rows (t, q, y) with their rates and multipliers.

    Parameters
    ----------
    steps : the scheme; motion : holds the anchors; mode : what acts
    aux : auxiliary accelerations at the first row; before : size of the step before it
    """

    steps: NewmarkSteps
    motion: Motion
    mode: Mode
    t: Vector
    q: Matrix
    y: Matrix
    rate: Matrix
    lam: Matrix
    aux: Vector
    before: float

    def __post_init__(self) -> None:
        s = self.steps
        self.c = c = s.programs.columns
        self.n, self.n_v, self.rows, self.h = c.n, c.n_v, list(self.mode.rows), np.diff(self.t)
        self.stretch = self.h / np.concatenate([[self.before], self.h[:-1]])
        self.inputs = np.r_[c.x, c.y, c.t, c.anchor, c.p]
        self.mean = (1.0 - s.alpha_f) / (1.0 - s.alpha_m)
        self.c_C, self.c_K = s.gamma * self.h * self.mean, s.beta * self.h**2 * self.mean
        self.auxiliary()

    def auxiliary(self) -> None:
        """a at all rows (N + 1, n), and a₀ of each step."""
        s, rate, count = self.steps, self.rate, len(self.h)
        self.a, self.a0 = np.empty((count + 1, self.n)), np.empty((count, self.n))
        self.a[0] = self.aux
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

    def evaluated(self, along: tuple[Matrix, Matrix, Matrix] | None, sign: float) -> Cube:
        """Derivatives of r, h, ḣ (N, n + 2R, columns) at the ends, or moved along (W, ν, 1/size) in both signs."""
        programs, held = self.steps.programs, list(self.mode.held)
        q, y, rate, lam = self.q[1:], self.y[1:], self.rate[1:], np.zeros_like(self.lam[1:])
        lam[:, held] = self.lam[1:, held]
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
        J = self.evaluated(None, 0.0)
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
        turned = self.turned(S, B, of_rate, fast)
        level = np.where(fast, turned[:, n:], of_h)
        A = np.zeros((count, 2 * size, 2 * size))
        A[:, :size, :n], A[:, :n, n:size] = self.by_rates(both), B
        A[:, :size, size : size + n_v] = both[:, :, c.x]
        A[:, size : size + n, :n] = self.by_rates(turned[:, :n])
        A[:, size : size + n, n:size] = turned[:, :n, c.lam][:, :, rows]
        A[:, size : size + n, size : size + n] = S
        A[:, size : size + n, size : size + n_v] += turned[:, :n, c.x]
        A[:, size : size + n, size + n :] = B
        A[:, size + n :, :n] = self.by_rates(level)
        A[:, size + n :, size : size + n_v] = level[:, :, c.x] + np.where(fast, self.tilted(of_rate)[:, :, :n_v], 0.0)
        right = np.concatenate([both, turned[:, :n], level], 1)[:, :, self.inputs]
        found = -np.linalg.solve(A, right)
        return found[:, :n], found[:, n:size], found[:, size : size + n_v]

    def tilted(self, of_rate: Cube) -> Cube:
        """``B̃ = ∂ḣ/∂v + (c_K/c_C) ∂ḣ/∂x``."""
        found = of_rate[:, :, self.c.y].copy()
        found[:, :, : self.n_v] += (self.c_K / self.c_C)[:, np.newaxis, np.newaxis] * of_rate[:, :, self.c.x]
        return np.asarray(found)

    def turned(self, S: Cube, B: Cube, of_rate: Cube, fast: Matrix) -> Cube:
        """Derivatives (N, n + m, columns) of ``S W + R ν`` and of ``B̃ W`` with W, ν held."""
        s, n, n_v, m, h = self.steps, self.n, self.n_v, len(self.rows), self.h[:, np.newaxis]
        shift = np.diff(self.q, axis=0) - h * self.y[:-1, :n_v]
        shift -= h * h * ((0.5 - s.beta) * self.a0 + s.beta * self.a[1:])[:, :n_v]
        tilted = self.tilted(of_rate)
        K, right = np.zeros((len(h), n + m, n + m)), np.zeros((len(h), n + m, 1))
        K[:, :n, :n], K[:, :n, n:], K[:, n:, :n] = S, B, tilted
        right[:, n:] = tilted[:, :, :n_v] @ shift[:, :, np.newaxis]
        found = np.asarray(np.linalg.solve(K, right)[:, :, 0], dtype=float)
        W, nu = found[:, :n].copy(), np.zeros((len(h), self.c.rows))
        W[:, :n_v], nu[:, self.rows] = shift, found[:, n:]
        large = np.max(np.abs(W), axis=1, initial=0.0)[:, np.newaxis]
        scale = np.asarray(1.0 / np.where(large > 0.0, large, 1.0), dtype=float)
        ahead, back = (self.evaluated((W, nu, scale), sign) for sign in (1.0, -1.0))
        turned = (ahead - back) / (2.0 * scale[:, :, np.newaxis])
        rates = turned[:, n + self.c.rows :][:, self.rows] / self.c_C[:, np.newaxis, np.newaxis]
        return np.concatenate([turned[:, :n], np.where(fast, rates, 0.0)], 1)

    def matrices(self) -> tuple[Cube, Cube]:
        """From (q₀, y₀, v̇₀, a₀, t, anchors, p) to the same at the end (N, d, d), and to λ (N, m, d)."""
        s, n, n_v = self.steps, self.n, self.n_v
        of_rate, of_lam, of_x = self.response()
        rest = len(self.inputs) - n_v - n
        d, h, stretch, mean = n_v + 3 * n + rest, self.h, self.stretch, 1.0 / (1.0 - s.alpha_m)
        place, predicted = np.zeros((len(h), len(self.inputs), d)), np.zeros((len(h), n, d))
        a0, a1 = (
            ((1.0 - stretch), stretch),
            (mean * (s.alpha_f - s.alpha_m * (1.0 - stretch)), -mean * s.alpha_m * stretch),
        )
        eye, x, y = np.eye(n), slice(0, n_v), slice(n_v, n_v + n)
        at_rate, at_aux = slice(n_v + n, n_v + 2 * n), slice(n_v + 2 * n, n_v + 3 * n)
        place[:, x, :n_v], place[:, y, n_v : n_v + n] = np.eye(n_v), eye
        place[:, n_v + n :, n_v + 3 * n :] = np.eye(rest)
        place[:, x, n_v : 2 * n_v] = h[:, np.newaxis, np.newaxis] * np.eye(n_v)
        for columns, of_a0, of_a1 in ((at_rate, a0[0], a1[0]), (at_aux, a0[1], a1[1])):
            speed = h * ((1.0 - s.gamma) * of_a0 + s.gamma * of_a1)
            way = h * h * ((0.5 - s.beta) * of_a0 + s.beta * of_a1)
            place[:, y, columns] = speed[:, np.newaxis, np.newaxis] * eye
            place[:, x, columns] = way[:, np.newaxis, np.newaxis] * eye[:n_v]
            predicted[:, :, columns] = np.broadcast_to(of_a1[:, np.newaxis, np.newaxis], (len(h), 1, 1)) * eye
        change = of_rate @ place
        out = np.zeros((len(h), d, d))
        out[:, :n_v] = place[:, x] + self.c_K[:, np.newaxis, np.newaxis] * change[:, :n_v] + of_x @ place
        out[:, n_v : n_v + n] = place[:, y] + self.c_C[:, np.newaxis, np.newaxis] * change
        out[:, at_rate], out[:, at_aux] = change, predicted + self.mean * change
        out[:, n_v + 3 * n :, n_v + 3 * n :] = np.eye(rest)
        return out, of_lam @ place
