"""Equations of the position corrections of the stabilized form (arrays: see `newmark`)."""

from __future__ import annotations

from mbd.kernel.algebra.linear import factor, solve
from mbd.kernel.hooks import call_on
from mbd.kernel.records import Integers, Model, Reals
from mbd.sensitivity.kernel.directions import add, clear
from mbd.sensitivity.kernel.entries import metric
from mbd.sensitivity.kernel.sizes import (
    ALL_ROWS,
    AT_LAM,
    AT_Q,
    AT_RATE,
    AT_X,
    AT_Y,
    COLUMN,
    COORDINATES,
    ENTRIES,
    NEAR,
    PARTS,
    PLACE,
    PLACES,
    RATES,
    ROWS,
    WIDTH,
)

__all__ = ["corrections"]


def corrections(
    K: Model, S: Integers, rows: Integers, entries: Integers, block: Reals, near: Reals, out: Reals, other: Reals,
    c_K: float, c_C: float, h: float, reach: float, A: Reals, B: Reals, Z1: Reals, dh: Reals, M: Reals, b: Reals,
    pivots: Integers, work: Reals,
) -> bool:  # fmt: skip
    """Equations of U: ``S W + R ν = 0`` in the metric of the predicted place, and ``B̃ W`` of rows on velocities.

    reach : largest rate of the differences along W
    """
    n = S[RATES]
    n_v = S[PLACES]
    m = S[ROWS]
    size = 2 * (n + m)
    by_h = 3 * n + m
    call_on(K, 0, near, out)
    if not normal(S, entries, out, c_K, c_C, M, b, pivots, work):
        return False
    for i in range(n + m):
        work[by_h + i] = 0.0
    for e in range(S[ENTRIES]):
        i = entries[e * PARTS + NEAR]
        j = entries[e * PARTS + COLUMN]
        if i >= 0 and j < n_v + 2 * n + m:
            value = out[entries[e * PARTS + PLACE]]
            line = by_h + i - n - m
            if i >= 2 * n + m:  # of velocities
                if j < n_v:
                    A[i * size + n + m + j] += c_K / c_C * value
                    work[line] += c_K / c_C / h * value * work[2 * n + j]
                elif j < 2 * n_v:
                    A[i * size + n + m + j - n_v] += value
            elif j < n_v:
                A[i * size + n + m + j] += c_K * value
                work[line] += 2.0 * c_K / h * value * work[2 * n + j]
            elif j < n_v + n:
                A[i * size + n + m + j - n_v] += c_C * value
                work[line] += c_C / h * value * work[2 * n + j - n_v]
            else:
                A[i * size + m + j - n_v] += value  # rates, then λ
    for i in range(n + m):
        if work[by_h + i] != 0.0:
            add(B, n + m + i, -work[by_h + i], dh, 0, S[WIDTH])
    turned(K, S, rows, entries, block, near, out, other, c_K, c_C, reach, B, Z1, work)
    return True


def normal(
    S: Integers,
    entries: Integers,
    out: Reals,
    c_K: float,
    c_C: float,
    M: Reals,
    b: Reals,
    pivots: Integers,
    work: Reals,
) -> bool:
    """W = U with its part of first-order states, and ν, of ``S W + R ν = 0``."""
    n = S[RATES]
    n_v = S[PLACES]
    m = S[ROWS]
    size = n + m
    clear(M, size * size)
    clear(b, size)
    metric(S, entries, out, c_K, c_C, M)
    for i in range(m):
        for j in range(n_v):
            b[n + i] += M[(n + i) * size + j] * work[2 * n + j]
    if factor(M, size, pivots) != 0:
        return False
    solve(M, size, pivots, b)
    for i in range(n_v, n):
        work[2 * n + i] = b[i]
    for i in range(m):
        work[3 * n + i] = b[n + i]
    return True


def turned(
    K: Model, S: Integers, rows: Integers, entries: Integers, block: Reals, near: Reals, out: Reals, other: Reals,
    c_K: float, c_C: float, reach: float, B: Reals, Z1: Reals, work: Reals,
) -> None:  # fmt: skip
    """How ``S W + R ν`` and ``B̃ W`` change by Z1 with W, ν held: by differences along (c_K, c_C, 1) W."""
    n = S[RATES]
    m = S[ROWS]
    large = 0.0
    for i in range(n):
        large = max(large, abs(work[2 * n + i]))
    if large == 0.0:
        return
    large /= reach
    along(S, rows, block, near, c_K, c_C, 1.0 / large, work)
    call_on(K, 0, block, out)
    along(S, rows, block, near, c_K, c_C, -1.0 / large, work)
    call_on(K, 0, block, other)
    for e in range(S[ENTRIES]):
        i = entries[e * PARTS + NEAR]
        if i >= 0:
            place = entries[e * PARTS + PLACE]
            change = 0.5 * large * (out[place] - other[place])
            if i >= 2 * n + m:
                change /= c_C
            if change != 0.0:
                add(B, i, -change, Z1, entries[e * PARTS + COLUMN], S[WIDTH])


def along(
    S: Integers, rows: Integers, block: Reals, near: Reals, c_K: float, c_C: float, part: float, work: Reals
) -> None:
    """The predicted place, moved by a part of (c_K, c_C, 1) W and of ν."""
    n = S[RATES]
    block[0] = near[0]
    for i in range(S[COORDINATES]):
        block[S[AT_Q] + i] = near[S[AT_Q] + i]
    for i in range(n):
        if i < S[PLACES]:
            block[S[AT_X] + i] = near[S[AT_X] + i] + part * c_K * work[2 * n + i]
        block[S[AT_Y] + i] = near[S[AT_Y] + i] + part * c_C * work[2 * n + i]
        block[S[AT_RATE] + i] = near[S[AT_RATE] + i] + part * work[2 * n + i]
    for i in range(S[ALL_ROWS]):
        block[S[AT_LAM] + i] = near[S[AT_LAM] + i]
    for i in range(S[ROWS]):
        block[S[AT_LAM] + rows[i]] += part * work[3 * n + i]
