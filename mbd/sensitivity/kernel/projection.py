"""Positions and velocities put onto the rows, nearest in the metric of M, with their derivatives.

    M(q̃) W + R ν = 0,   h(q̃ + W) = 0;    M (v − ṽ) + R κ = 0,   ḣ(v) = 0

Each is differentiated as the implicit function that it is. How ``M W + R ν`` changes with W, ν held is what
derivatives of the balance at rates W and multipliers ν have beside those at zero.
"""

from __future__ import annotations

from mbd.kernel.algebra.linear import factor, solve
from mbd.kernel.hooks import call_on
from mbd.kernel.records import Integers, Model, Reals
from mbd.sensitivity.kernel.charts import compose, enter, leave
from mbd.sensitivity.kernel.directions import add, clear, solve_all
from mbd.sensitivity.kernel.entries import saddle
from mbd.sensitivity.kernel.sizes import (
    ALL_ROWS,
    AT_LAM,
    AT_RATE,
    AT_X,
    AT_Y,
    COLUMN,
    ENTRIES,
    EQUATION,
    PARTS,
    PLACE,
    PLACES,
    RATES,
    ROWS,
    WIDTH,
)

__all__ = ["on_rows"]

MOST = 4
"""Newton corrections of positions onto the rows after a step; one or two [-]."""


def on_rows(
    K: Model, program: int, S: Integers, rows: Integers, fast: Integers, entries: Integers, block: Reals, at: Reals,
    out: Reals, other: Reals, Z: Reals, A: Reals, M: Reals, B: Reals, b: Reals, W: Reals, pivots: Integers,
    turns: Reals, own: Reals,
) -> int:  # fmt: skip
    """q and y in the block, x and y in Z become those on the rows; 1 where a matrix is singular.

    program : the number of `steps` among the programs, behind which those of `charts` are; at : another block; A, M
    (n + m)², B (n + m, D), b, W (n + m); turns, own : room for charts
    """
    for i in range(S[RATES]):
        block[S[AT_RATE] + i] = 0.0
    for i in range(S[ALL_ROWS]):
        block[S[AT_LAM] + i] = 0.0
    for i in range(S[AT_LAM] + S[ALL_ROWS]):
        at[i] = block[i]
    enter(S, Z, 0)
    call_on(K, program, block, out)
    clear(M, (S[RATES] + S[ROWS]) * (S[RATES] + S[ROWS]))
    saddle(S, entries, out, M)
    if not positions(K, program, S, rows, fast, entries, block, out, A, M, b, W, pivots):
        return 1
    if not of_positions(K, program, S, rows, fast, entries, at, out, other, Z, A, M, B, W, pivots):
        return 1
    leave(K, program + 1, S, block, turns, Z, 0, own)
    compose(K, program + 1, S, block, turns)
    return velocities(K, program, S, rows, entries, block, at, out, other, Z, A, M, B, W, pivots)


def positions(
    K: Model, program: int, S: Integers, rows: Integers, fast: Integers, entries: Integers, block: Reals, out: Reals,
    A: Reals, M: Reals, b: Reals, W: Reals, pivots: Integers,
) -> bool:  # fmt: skip
    """q in the block onto the rows, by W and ν; M is the first matrix, `out` the program there, then here."""
    n = S[RATES]
    size = n + S[ROWS]
    clear(W, size)
    for i in range(size * size):
        A[i] = M[i]
    for _ in range(MOST):
        clear(b, n)
        for i in range(S[ROWS]):
            b[n + i] = -out[n + rows[i]] if fast[i] == 0 else 0.0
        if factor(A, size, pivots) != 0:
            return False
        solve(A, size, pivots, b)
        moved = 0.0
        largest = 1.0
        for i in range(size):
            W[i] += b[i]
        for i in range(S[PLACES]):
            block[S[AT_X] + i] += b[i]
            moved = max(moved, abs(b[i]))
            largest = max(largest, abs(block[S[AT_X] + i]))
        call_on(K, program, block, out)
        if moved <= 1e-15 * largest:
            break
        clear(A, size * size)
        saddle(S, entries, out, A)
    return True


def of_positions(
    K: Model, program: int, S: Integers, rows: Integers, fast: Integers, entries: Integers, at: Reals, out: Reals,
    other: Reals, Z: Reals, A: Reals, M: Reals, B: Reals, W: Reals, pivots: Integers,
) -> bool:  # fmt: skip
    """x in Z becomes that on the rows; `at` : where they were not yet on them, `out` : where they are."""
    n = S[RATES]
    n_v = S[PLACES]
    size = n + S[ROWS]
    for i in range(size * size):
        A[i] = M[i] if i < n * size else 0.0
    clear(B, size * S[WIDTH])
    for e in range(S[ENTRIES]):  # rows on positions, where they are on them
        i = entries[e * PARTS + EQUATION] - size
        j = entries[e * PARTS + COLUMN]
        if i >= 0 and fast[i] == 0 and (j < n_v or j >= n_v + n + size):
            value = out[entries[e * PARTS + PLACE]]
            if j < n_v:
                A[(n + i) * size + j] += value
            add(B, n + i, -value, Z, j, S[WIDTH])
    for i in range(S[ROWS]):
        if fast[i] == 1:
            for j in range(n):
                A[(n + i) * size + j] = M[(n + i) * size + j]
    for i in range(n):
        at[S[AT_Y] + i] = 0.0
    call_on(K, program, at, other)
    loaded(K, program, S, rows, at, out, W, True)
    for e in range(S[ENTRIES]):
        i = entries[e * PARTS + EQUATION]
        j = entries[e * PARTS + COLUMN]
        if (i < n or (i < size and fast[i - n] == 1)) and (j < n_v or j >= n_v + n + size):
            change = out[entries[e * PARTS + PLACE]] - other[entries[e * PARTS + PLACE]]
            if change != 0.0:
                add(B, i, -change, Z, j, S[WIDTH])
    if factor(A, size, pivots) != 0:
        return False
    solve_all(A, size, pivots, B, S[WIDTH])
    for i in range(n_v):
        add(Z, i, 1.0, B, i, S[WIDTH])
    return True


def loaded(K: Model, program: int, S: Integers, rows: Integers, at: Reals, out: Reals, W: Reals, moving: bool) -> None:
    """What the program gives with W for rates, and for velocities where `moving`, and ν for multipliers."""
    for i in range(S[RATES]):
        at[S[AT_RATE] + i] = W[i]
        if moving:
            at[S[AT_Y] + i] = W[i]
    for i in range(S[ROWS]):
        at[S[AT_LAM] + rows[i]] = W[S[RATES] + i]
    call_on(K, program, at, out)


def velocities(
    K: Model, program: int, S: Integers, rows: Integers, entries: Integers, block: Reals, at: Reals, out: Reals,
    other: Reals, Z: Reals, A: Reals, M: Reals, B: Reals, W: Reals, pivots: Integers,
) -> int:  # fmt: skip
    """y in the block and in Z become those that the rows allow."""
    n = S[RATES]
    n_v = S[PLACES]
    w = S[WIDTH]
    size = n + S[ROWS]
    call_on(K, program, block, out)
    clear(M, size * size)
    saddle(S, entries, out, M)
    for i in range(size * size):
        A[i] = M[i]
    clear(W, n)
    for i in range(S[ROWS]):
        W[n + i] = -out[n + S[ALL_ROWS] + rows[i]]
    if factor(A, size, pivots) != 0:
        return 1
    solve(A, size, pivots, W)
    for i in range(n):
        block[S[AT_Y] + i] += W[i]
    for i in range(S[AT_LAM] + S[ALL_ROWS]):
        at[i] = block[i]
    call_on(K, program, block, other)
    loaded(K, program, S, rows, at, out, W, False)
    clear(B, size * w)
    for e in range(S[ENTRIES]):
        i = entries[e * PARTS + EQUATION]
        j = entries[e * PARTS + COLUMN]
        if i < size and (j < n_v or j >= n_v + n + size):
            change = out[entries[e * PARTS + PLACE]]
            if i < n:
                change -= other[entries[e * PARTS + PLACE]]
            if change != 0.0:
                add(B, i, -change, Z, j, w)
    for i in range(n):
        for j in range(n):
            if M[i * size + j] != 0.0:
                add(B, i, M[i * size + j], Z, n_v + j, w)
    solve_all(A, size, pivots, B, w)
    for i in range(n):
        for j in range(w):
            Z[(n_v + i) * w + j] = B[i * w + j]
    return 0
