"""The equations of all stages of a step of the Radau IIA method, and their matrix (arrays: see `radau`)."""

from __future__ import annotations

from mbd.kernel.hooks import call_on
from mbd.kernel.records import Integers, Model, Reals
from mbd.sensitivity.kernel.directions import clear
from mbd.sensitivity.kernel.radau_charts import bend, place_motion, ways_by
from mbd.sensitivity.kernel.sizes import (
    ALL_ROWS,
    AT_LAM,
    AT_Q,
    AT_RATE,
    AT_Y,
    COLUMN,
    COORDINATES,
    ENTRIES,
    EQUATION,
    GROUPS,
    PARTS,
    PLACE,
    PLACES,
    RATES,
    ROWS,
)

__all__ = [
    "REACH", "REAL", "SQUARE", "WEIGHTS", "evaluate", "line", "matrix", "middle", "place_stage", "residual", "through",
]  # fmt: skip

WEIGHTS = 3
SQUARE = 12
REAL = 21
REACH = 22
"""Where `numbers` has A, A A, the real eigenvalue and the largest rate of differences, behind c."""


def place_stage(
    S: Integers, c: Reals, k: int, h: float, s: int, time: Reals, q: Reals, y: Reals, rows: Integers, block: Reals,
    stages: Reals, E: Reals,
) -> None:  # fmt: skip
    """Stage s into the inputs of programs; E: see `radau_charts`."""
    if S[GROUPS] > 0:
        place_motion(S, c, k, h, s, q, y, block, stages, E)
    n = S[RATES]
    m = S[ROWS]
    block[0] = time[k] + c[s] * h
    for i in range(n):
        speed = 0.0
        way = 0.0
        for t in range(3):
            speed += c[WEIGHTS + 3 * s + t] * stages[t * n + i]
            way += c[SQUARE + 3 * s + t] * stages[t * n + i]
        block[S[AT_RATE] + i] = stages[s * n + i]
        block[S[AT_Y] + i] = y[k * n + i] + h * speed
        if i < S[PLACES] and S[GROUPS] == 0:
            x = h * c[s] * y[k * n + i] + h * h * way + stages[3 * (n + m) + s * n + i]
            block[S[AT_Q] + i] = q[k * S[COORDINATES] + i] + x
    for i in range(m):
        block[S[AT_LAM] + rows[i]] = stages[3 * n + s * m + i]


def evaluate(
    K: Model, S: Integers, c: Reals, k: int, h: float, outputs: int, time: Reals, q: Reals, y: Reals, rows: Integers,
    block: Reals, out: Reals, outs: Reals, stages: Reals, E: Reals, moved: Reals, turns: Reals,
) -> None:  # fmt: skip
    """All equations at the stages, with their derivatives."""
    bend(K, S, c, k, h, q, y, block, stages, E, moved, turns)
    for s in range(3):
        place_stage(S, c, k, h, s, time, q, y, rows, block, stages, E)
        call_on(K, 1, block, out)
        for i in range(outputs):
            outs[s * outputs + i] = out[i]


def middle(S: Integers, c: Reals, h: float, outputs: int, entries: Integers, outs: Reals, M: Reals) -> None:
    """[S R; B̃ 0] of the middle stage, with ∂v/∂v̇ = μh, ∂x/∂v̇ = (μh)²."""
    n = S[RATES]
    n_v = S[PLACES]
    size = n + S[ROWS]
    step = c[REAL] * h
    clear(M, size * size)
    for e in range(S[ENTRIES]):
        i = entries[e * PARTS + EQUATION]
        j = entries[e * PARTS + COLUMN]
        if i < size and j < n_v + n + size:
            value = outs[outputs + entries[e * PARTS + PLACE]]
            if j < n_v:
                M[i * size + j] += value * (step if i >= n else step * step)
            elif j < n_v + n:
                M[i * size + j - n_v] += value * (1.0 if i >= n else step)
            elif i < n:
                M[i * size + j - n_v - n] += value


def matrix(
    S: Integers, c: Reals, h: float, outputs: int, entries: Integers, fast: Integers, outs: Reals, M: Reals, A: Reals,
    ways: Reals,
) -> None:  # fmt: skip
    """The matrix of all stages."""
    n = S[RATES]
    m = S[ROWS]
    size = (n + m) * (2 if m > 0 else 1)
    for s in range(3):
        for e in range(S[ENTRIES]):
            i = line(S, entries[e * PARTS + EQUATION], fast)
            if i >= 0:
                value = outs[s * outputs + entries[e * PARTS + PLACE]]
                through(S, c, h, s, entries[e * PARTS + COLUMN], s * size + i, value, A, ways)
        if m > 0:
            o = s * size + n + m
            for i in range(n + m):
                if i < n or fast[i - n] == 1:
                    for j in range(n + m if i < n else n):
                        A[(o + i) * 3 * size + o + j] += M[i * (n + m) + j]


def line(S: Integers, i: int, fast: Integers) -> int:
    """Where an equation stands among those of its stage, −1: nowhere."""
    n = S[RATES]
    m = S[ROWS]
    if i < n + m:
        return i
    return n + i if fast[i - n - m] == 0 else -1


def through(S: Integers, c: Reals, h: float, s: int, j: int, i: int, value: float, A: Reals, ways: Reals) -> None:
    """Line i of A plus a derivative by column j at stage s, through the formulas of the method."""
    n = S[RATES]
    n_v = S[PLACES]
    m = S[ROWS]
    size = (n + m) * (2 if m > 0 else 1)
    if j < n_v:
        if ways_by(S, s, j, i, value, A, ways):
            return
        for t in range(3):
            A[i * 3 * size + t * size + j] += h * h * c[SQUARE + 3 * s + t] * value
        if m > 0:
            A[i * 3 * size + s * size + n + m + j] += value
    elif j < n_v + n:
        for t in range(3):
            A[i * 3 * size + t * size + j - n_v] += h * c[WEIGHTS + 3 * s + t] * value
    elif j < n_v + 2 * n + m:
        A[i * 3 * size + s * size + j - n_v - n] += value


def residual(
    S: Integers, outputs: int, rows: Integers, fast: Integers, outs: Reals, M: Reals, stages: Reals, b: Reals
) -> None:
    """All equations at the stages."""
    n = S[RATES]
    m = S[ROWS]
    size = (n + m) * (2 if m > 0 else 1)
    for s in range(3):
        o = s * size
        for i in range(n):
            b[o + i] = outs[s * outputs + i]
        for i in range(m):
            b[o + n + i] = outs[s * outputs + n + S[ALL_ROWS] + rows[i]]
        if m > 0:
            for i in range(n + m):
                total = 0.0
                for j in range(n):
                    total += M[i * (n + m) + j] * stages[3 * (n + m) + s * n + j]
                for j in range(m):
                    total += M[i * (n + m) + n + j] * stages[6 * n + 3 * m + s * m + j]
                if i >= n and fast[i - n] == 0:
                    total = outs[s * outputs + n + rows[i - n]]
                b[o + n + m + i] = total
