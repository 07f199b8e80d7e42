"""Many steps of an explicit formula, each differentiated stage by stage (`mbd.sensitivity.runge_kutta`).

X (n + m, D) has the derivatives of rates and multipliers at a row; Z those of the state, Z1 of a stage. Slopes of the
stages are kept in V, F (stages, n), velocities and rates, and their derivatives in of_V, of_F (stages, n, D). Programs:
0 `consistent`, 1 `steps`, whose sizes are S, S1; where coordinates do not add, those of `charts` from 2 on: stages are
then in the chart around the start of the step.
"""

from __future__ import annotations

from mbd.kernel.records import Integers, Model, Reals
from mbd.sensitivity.kernel.balance import consistent
from mbd.sensitivity.kernel.charts import compose, enter, leave, rates_of
from mbd.sensitivity.kernel.directions import add
from mbd.sensitivity.kernel.entries import place_row
from mbd.sensitivity.kernel.projection import on_rows
from mbd.sensitivity.kernel.sizes import (
    ALL_ROWS,
    AT_LAM,
    AT_Q,
    AT_RATE,
    AT_X,
    AT_Y,
    COORDINATES,
    GROUPS,
    PLACES,
    RATES,
    ROWS,
    WIDTH,
)

__all__ = ["SAME", "runge_kutta_steps"]

SAME = 1e-9
"""Distance of a row from where the pass says that it is, over the size of the state, that is round-off [-]."""


def runge_kutta_steps(
    K: Model, S: Integers, S1: Integers, tableau: Reals, stages: int, steps: int, checked: int, time: Reals, q: Reals,
    y: Reals, rate: Reals, lam: Reals, rows: Integers, fast: Integers, entries: Integers, entries1: Integers,
    block: Reals, at: Reals, out: Reals, other: Reals, V: Reals, F: Reals, of_V: Reals, of_F: Reals, X: Reals, Z: Reals,
    Z1: Reals, dh: Reals, A: Reals, M: Reals, B: Reals, b: Reals, W: Reals, pivots: Integers, turns: Reals, room: Reals,
    own: Reals,
) -> int:  # fmt: skip
    """Take Z and X over the steps between rows 0 … `steps`; how many ended at their rows, and were regular.

    tableau : weights of the end (stages,), nodes, weights of the stages; checked : 0 where row 1 is not known and is to
    be found; dh (D,) : derivatives of the size of each step
    """
    n = S[RATES]
    size = n + S[ROWS]
    w = S[WIDTH]
    for k in range(steps):
        h = time[k + 1] - time[k]
        first_stage(S, k, y, rate, V, F, of_V, of_F, X, Z)
        place_row(S, block, k, time, q, y, rate, lam)
        for s in range(1, stages):
            moved(S, tableau, (s + 2) * stages, s, tableau[stages + s], k, h, q, y, V, F, of_V, of_F, Z, Z1, dh, block)
            block[0] = time[k] + tableau[stages + s] * h
            if consistent(K, 0, S, rows, entries, block, out, Z1, A, B, b, pivots) != 0:
                return k
            for i in range(n):
                V[s * n + i] = block[S[AT_Y] + i]
                F[s * n + i] = block[S[AT_RATE] + i]
                for j in range(w):
                    of_V[(s * n + i) * w + j] = Z1[(S[PLACES] + i) * w + j]
                    of_F[(s * n + i) * w + j] = B[i * w + j]
            rates_of(K, 2, S, block, turns, Z1, s, V, of_V)
        moved(S, tableau, 0, stages, 1.0, k, h, q, y, V, F, of_V, of_F, Z, Z1, dh, block)
        block[0] = time[k + 1]
        leave(K, 2, S, block, turns, Z1, 0, own)
        compose(K, 2, S, block, turns)
        if S[ROWS] > 0:
            if (
                on_rows(K, 1, S1, rows, fast, entries1, block, at, out, other, Z1, A, M, B, b, W, pivots, turns, own)
                != 0
            ):
                return k
        if checked == 0:
            for i in range(S[COORDINATES]):
                q[(k + 1) * S[COORDINATES] + i] = block[S[AT_Q] + i]
            for i in range(n):
                y[(k + 1) * n + i] = block[S[AT_Y] + i]
        elif not is_at(S, k + 1, q, y, block):
            return k
        place_row(S, block, k + 1, time, q, y, rate, lam)
        if consistent(K, 0, S, rows, entries, block, out, Z1, A, B, b, pivots) != 0:
            return k
        if checked == 0:
            for i in range(n):
                rate[(k + 1) * n + i] = block[S[AT_RATE] + i]
            for i in range(S[ROWS]):
                lam[(k + 1) * S[ALL_ROWS] + rows[i]] = block[S[AT_LAM] + rows[i]]
        for i in range((S[PLACES] + n) * w):
            Z[i] = Z1[i]
        t = (S[PLACES] + n + size) * w
        for j in range(w):
            Z[t + j] = Z1[t + j]
        for i in range(size * w):
            X[i] = B[i]
    return steps


def first_stage(
    S: Integers, k: int, y: Reals, rate: Reals, V: Reals, F: Reals, of_V: Reals, of_F: Reals, X: Reals, Z: Reals
) -> None:
    """The slope at row k."""
    n = S[RATES]
    w = S[WIDTH]
    for i in range(n):
        V[i] = y[k * n + i]
        F[i] = rate[k * n + i]
        for j in range(w):
            of_V[i * w + j] = Z[(S[PLACES] + i) * w + j]
            of_F[i * w + j] = X[i * w + j]


def moved(
    S: Integers, tableau: Reals, first: int, stages: int, node: float, k: int, h: float, q: Reals, y: Reals, V: Reals,
    F: Reals, of_V: Reals, of_F: Reals, Z: Reals, Z1: Reals, dh: Reals, block: Reals,
) -> None:  # fmt: skip
    """q, y in the block, t, x, y in Z1: moved from row k by h times the weighted slopes of the first stages."""
    n = S[RATES]
    n_v = S[PLACES]
    w = S[WIDTH]
    for i in range((n_v + n) * w):
        Z1[i] = Z[i]
    enter(S, Z1, 0)
    t = (n_v + 2 * n + S[ROWS]) * w
    for j in range(w):
        Z1[t + j] = Z[t + j] + node * dh[j]
    for i in range(S[COORDINATES] if S[GROUPS] > 0 else 0):
        block[S[AT_Q] + i] = q[k * S[COORDINATES] + i]
    for i in range(n):
        speed = 0.0
        rate = 0.0
        for s in range(stages):
            weight = tableau[first + s]
            if weight != 0.0:
                rate += weight * F[s * n + i]
                add(Z1, n_v + i, h * weight, of_F, s * n + i, w)
                if i < n_v:
                    speed += weight * V[s * n + i]
                    add(Z1, i, h * weight, of_V, s * n + i, w)
        block[S[AT_Y] + i] = y[k * n + i] + h * rate
        add(Z1, n_v + i, rate, dh, 0, w)
        if i < n_v:
            block[S[AT_X] + i] = h * speed if S[GROUPS] > 0 else q[k * S[COORDINATES] + i] + h * speed
            add(Z1, i, speed, dh, 0, w)


def is_at(S: Integers, k: int, q: Reals, y: Reals, block: Reals) -> bool:
    """Whether the state in the block is row k."""
    size = 1e-3
    off = 0.0
    for i in range(S[COORDINATES]):
        value = q[k * S[COORDINATES] + i]
        size = max(size, abs(value))
        off = max(off, abs(block[S[AT_Q] + i] - value))
    for i in range(S[RATES]):
        value = y[k * S[RATES] + i]
        size = max(size, abs(value))
        off = max(off, abs(block[S[AT_Y] + i] - value))
    return bool(off <= SAME * size)
