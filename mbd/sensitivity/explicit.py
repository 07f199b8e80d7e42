"""Derivatives of many Runge–Kutta steps at once: all of a segment between two starts of the scheme.

The steps begin at rows that are known, so that stage s of all of them is evaluated together. Each step gives a matrix
from the derivatives (x₀, y₀, t₀, anchors, p, h) to those of (x₁, y₁), which the pass multiplies by.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.kernel.schemes.dormand_prince import END, NODES, STAGES, WEIGHTS
from mbd.sensitivity.motion import Mode, Motion
from mbd.sensitivity.programs import Programs, State

__all__ = ["ExplicitSteps"]

Cube = NDArray[np.float64]
"""Matrices of many steps (N, rows, columns)."""
MOST = 4
"""Newton corrections of positions onto the rows after a step [-]."""


@dataclass
class ExplicitSteps:
    """Steps from rows at the times t, with sizes h (N,), from (q, y) with rates and multipliers.

    Parameters
    ----------
    motion : holds the anchors of the segment; mode : what acts in it
    """

    programs: Programs
    motion: Motion
    mode: Mode
    t: Vector
    h: Vector
    q: Matrix
    y: Matrix
    rate: Matrix
    lam: Matrix

    def __post_init__(self) -> None:
        c = self.programs.columns
        self.rows, self.n, self.n_v, self.count = list(self.mode.rows), c.n, c.n_v, len(self.t)
        self.inputs = np.r_[c.x, c.y, c.t, c.anchor, c.p]  # columns of the derivatives of stages
        self.width = len(self.inputs) + 1  # and h
        self.blocks = np.zeros((self.count, self.programs.layout.size))
        self.spread = np.zeros((self.count, self.width, self.width))
        self.spread[:] = np.eye(self.width)

    def blocks_at(self, t: Vector, q: Matrix, y: Matrix, rate: Matrix, lam: Matrix) -> Matrix:
        """Inputs of programs."""
        active, held = np.zeros_like(lam), list(self.mode.held)
        active[:, held] = lam[:, held]
        at = State(0.0, q, y, rate, active, self.motion.anchors, self.mode.switch, self.mode.slip)
        self.programs.fill(self.blocks, at)
        self.blocks[:, 0] = t
        return self.blocks

    def response(self, t: Vector, q: Matrix, y: Matrix, rate: Matrix, lam: Matrix) -> Cube:
        """Derivatives of consistent rates and multipliers by the inputs (N, n + m, inputs)."""
        c, n, m = self.programs.columns, self.n, len(self.rows)
        _, J = self.programs.many("consistent", self.blocks_at(t, q, y, rate, lam), n + c.rows)
        J = J[:, [*range(n), *(n + k for k in self.rows)]]
        A = np.zeros((self.count, n + m, n + m))
        A[:, :, :n] = J[:, :, c.rate]
        A[:, :n, n:] = J[:, :n, c.lam][:, :, self.rows]
        return np.asarray(-np.linalg.solve(A, J[:, :, self.inputs]), dtype=float)

    def consistent(self, t: Vector, q: Matrix, y: Matrix) -> tuple[Matrix, Matrix]:
        """Rates (N, n) and multipliers (N, R)."""
        n, rows, R = self.n, self.rows, self.programs.columns.rows
        zero = np.zeros((self.count, n)), np.zeros((self.count, R))
        out = self.programs.accelerations(self.blocks_at(t, q, y, *zero))
        A, m = np.zeros((self.count, n + len(rows), n + len(rows))), n * n + n
        A[:, :n, :n] = out[:, : n * n].reshape(self.count, n, n)
        A[:, :n, n:] = out[:, m : m + n * R].reshape(self.count, n, R)[:, :, rows]
        A[:, n:, :n] = out[:, m + n * R : m + 2 * n * R].reshape(self.count, R, n)[:, rows]
        bias = out[:, m + 2 * n * R + 2 * R : m + 2 * n * R + 3 * R][:, rows]
        found = -np.linalg.solve(A, np.concatenate([out[:, n * n : m], bias], axis=1)[:, :, np.newaxis])[:, :, 0]
        lam = np.zeros((self.count, R))
        lam[:, rows] = found[:, n:]
        return found[:, :n], lam

    def taken(self) -> tuple[Matrix, Matrix, Cube, Cube]:
        """(q₁, y₁), their derivatives (N, n_v + n, width), and those of rates and multipliers at the starts."""
        n_v = self.n_v
        x, y = self.spread[:, :n_v].copy(), self.spread[:, n_v : n_v + self.n].copy()
        first = self.padded(self.response(self.t, self.q, self.y, self.rate, self.lam))
        slopes, of_slopes = (
            [np.hstack([self.y[:, :n_v], self.rate])],
            [np.concatenate([y[:, :n_v], first[:, : self.n]], 1)],
        )
        for s in range(1, STAGES):
            moved, of_moved = self.moved(WEIGHTS[s], slopes, of_slopes)
            t, q1, y1 = self.t + NODES[s] * self.h, self.q + moved[:, :n_v], self.y + moved[:, n_v:]
            rate, lam = self.consistent(t, q1, y1)
            place = self.placed(x + of_moved[:, :n_v], y + of_moved[:, n_v:], NODES[s])
            of_rate = self.response(t, q1, y1, rate, lam)[:, : self.n] @ place
            slopes.append(np.hstack([y1[:, :n_v], rate]))
            of_slopes.append(np.concatenate([y[:, :n_v] + of_moved[:, n_v : 2 * n_v], of_rate], 1))
        moved, of_moved = self.moved(END, slopes, of_slopes)
        q1, y1, x, y = self.q + moved[:, :n_v], self.y + moved[:, n_v:], x + of_moved[:, :n_v], y + of_moved[:, n_v:]
        if self.rows:
            q1, y1, x, y = self.on_rows(self.t + self.h, q1, y1, x, y)
        return q1, y1, np.concatenate([x, y], 1), first

    def padded(self, found: Cube) -> Cube:
        """With the column of h, by which nothing at the start changes."""
        return np.concatenate([found, np.zeros((*found.shape[:2], 1))], 2)

    def moved(self, weights: Vector, slopes: list[Matrix], of_slopes: list[Cube]) -> tuple[Matrix, Cube]:
        """h times the weighted slopes, and its derivatives."""
        used = [(w, k) for k, w in enumerate(weights[: len(slopes)]) if w != 0.0]
        total, of_total = sum(w * slopes[k] for w, k in used), sum(w * of_slopes[k] for w, k in used)
        of_total = self.h[:, np.newaxis, np.newaxis] * of_total
        of_total[:, :, -1] += total
        return self.h[:, np.newaxis] * np.asarray(total), np.asarray(of_total)

    def placed(self, x: Cube, y: Cube, node: float) -> Cube:
        """Derivatives of the inputs of a stage (N, inputs, width)."""
        place = self.spread[:, :-1].copy()
        place[:, : self.n_v], place[:, self.n_v : self.n_v + self.n] = x, y
        place[:, self.n_v + self.n, -1] = node
        return place

    def on_rows(self, t: Vector, q: Matrix, y: Matrix, x: Cube, of_y: Cube) -> tuple[Matrix, Matrix, Cube, Cube]:
        """Positions, then velocities on the rows, nearest in the metric of M, and their derivatives."""
        c, n, n_v, rows, R = self.programs.columns, self.n, self.n_v, self.rows, self.programs.columns.rows
        zero, none, m = np.zeros_like(y), np.zeros((self.count, R)), len(self.rows)

        def steps(q: Matrix, y: Matrix, rate: Matrix, lam: Matrix) -> tuple[Matrix, Cube]:
            return self.programs.many("steps", self.blocks_at(t, q, y, rate, lam), n + 2 * R)

        def saddle(J: Cube) -> Cube:
            A = np.zeros((self.count, n + m, n + m))
            A[:, :n, :n], A[:, :n, n:] = J[:, :n, c.rate], J[:, :n, c.lam][:, :, rows]
            A[:, n:, :n] = J[:, n + R :][:, rows][:, :, c.y]
            return A

        values, J = steps(q, zero, zero, none)
        A0, start, q0 = saddle(J), np.zeros((self.count, n + m)), q
        for _ in range(MOST):
            right = np.zeros((self.count, n + m, 1))
            right[:, n:, 0] = values[:, n : n + R][:, rows]
            step = -np.linalg.solve(saddle(J), right)[:, :, 0]
            start, q = start + step, q + step[:, :n_v]
            values, J = steps(q, zero, zero, none)
            if np.max(np.abs(step[:, :n_v]), initial=0.0) <= 1e-15 * np.max(np.abs(q), initial=1.0):
                break
        place, nu = self.placed(x, np.zeros_like(of_y), 1.0), none.copy()
        nu[:, rows] = start[:, n:]
        turned = steps(q0, zero, start[:, :n], nu)[1] - steps(q0, zero, zero, none)[1]
        right = np.concatenate([turned[:, :n, self.inputs], J[:, n : n + R][:, rows][:, :, self.inputs]], 1) @ place
        A0[:, n:] = 0.0
        A0[:, n:, :n_v] = J[:, n : n + R][:, rows][:, :, c.x]
        x = x - np.linalg.solve(A0, right)[:, :n_v]
        place = self.placed(x, np.zeros_like(of_y), 1.0)
        values, J = steps(q, y, zero, none)
        A, level = saddle(J), np.zeros((self.count, n + m, 1))
        level[:, n:, 0] = values[:, n + R :][:, rows]
        found = -np.linalg.solve(A, level)[:, :, 0]
        jump, kappa = np.asarray(found[:, :n], dtype=float), none.copy()
        kappa[:, rows] = found[:, n:]
        loaded = steps(q, y + jump, jump, kappa)[1].copy()
        bare = steps(q, y + jump, zero, none)[1]
        forces = (loaded[:, :n] - bare[:, :n])[:, :, self.inputs] @ place - A[:, :n, :n] @ of_y
        speeds = loaded[:, n + R :][:, rows][:, :, self.inputs] @ place
        of_y = -np.linalg.solve(A, np.concatenate([forces, speeds], 1))[:, :n]
        return q, y + jump, x, of_y
