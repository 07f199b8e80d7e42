"""The end of a step of the Newmark family of any size, solved for: numbers alone (arrays: see `newmark`)."""

from __future__ import annotations

from mbd.kernel.algebra.linear import factor, solve
from mbd.kernel.hooks import call_on
from mbd.kernel.records import Integers, Model, Reals
from mbd.sensitivity.kernel.charts import place_in_chart
from mbd.sensitivity.kernel.directions import clear
from mbd.sensitivity.kernel.entries import balance, metric, place_row
from mbd.sensitivity.kernel.newmark_prediction import (
    ALPHA_F,
    ALPHA_M,
    BETA,
    GAMMA,
    averages,
    predicted_place,
)
from mbd.sensitivity.kernel.sizes import (
    ALL_ROWS,
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
    STABILIZED,
)

__all__ = ["newmark_end"]

MOST = 12
"""Newton iterations for the end of a step at an event [-]."""


def newmark_end(
    K: Model, S: Integers, numbers: Reals, time: Reals, q: Reals, y: Reals, rate: Reals, lam: Reals, rows: Integers,
    fast: Integers, entries: Integers, block: Reals, near: Reals, out: Reals, memory: Reals, A: Reals, M: Reals,
    b: Reals, U: Reals, pivots: Integers, orders: Integers, work: Reals, x: Reals, out1: Reals,
) -> int:  # fmt: skip
    """Solve for row 1, the end of a step from row 0, from its rates and multipliers on; 1 if it cannot be solved for.

    A, M (n + m)²; U (n_v) and U of the iteration before; x (n_v), out1 (n_q): room for steps in charts
    """
    n = S[RATES]
    m = S[ROWS]
    twofold = S[STABILIZED] == 1 and m > 0
    h = time[1] - time[0]
    c_C = numbers[GAMMA] * h * (1.0 - numbers[ALPHA_F]) / (1.0 - numbers[ALPHA_M])
    c_K = c_C * h * numbers[BETA] / numbers[GAMMA]
    clear(U, 2 * S[PLACES])
    averages(S, numbers, 0, h, y, rate, memory, work)
    if twofold:
        predicted_place(S, numbers, 0, h, time, q, y, rate, lam, memory, near, work)
        call_on(K, 0, near, out)
        clear(M, (n + m) * (n + m))
        metric(S, entries, out, c_K, c_C, M)
        if factor(M, n + m, orders) != 0:
            return 1
    for _ in range(MOST):
        end_of(S, numbers, h, q, y, U, x, work)
        place_row(S, block, 1, time, q, y, rate, lam)
        place_in_chart(S, block, 0, q, x)
        call_on(K, 0, block, out)
        clear(A, (n + m) * (n + m))
        if twofold:
            corrected(S, rows, fast, entries, out, c_K, c_C, M, orders, b, U)
            metric(S, entries, out, c_K, c_C, A)
        else:
            balance(S, entries, out, c_K, c_C, n + m, A)
            for i in range(m):
                b[n + i] = out[n + rows[i]] if fast[i] == 0 else out[n + S[ALL_ROWS] + rows[i]]
        for i in range(n):
            b[i] = out[i]
        if factor(A, n + m, pivots) != 0:
            return 1
        solve(A, n + m, pivots, b)
        if renewed(S, numbers, h, rows, y, rate, lam, memory, b, U, work):
            break
    end_of(S, numbers, h, q, y, U, x, work)
    if S[GROUPS] > 0:
        place_in_chart(S, block, 0, q, x)
        call_on(K, 2, block, out1)
        for i in range(S[COORDINATES]):
            q[S[COORDINATES] + i] = out1[i]
    return 0


def end_of(S: Integers, c: Reals, h: float, q: Reals, y: Reals, U: Reals, x: Reals, work: Reals) -> None:
    """q, or x where coordinates do not add, and y of row 1 by a₀, a₁ and U."""
    n = S[RATES]
    for i in range(n):
        y[n + i] = y[i] + h * ((1.0 - c[GAMMA]) * work[i] + c[GAMMA] * work[n + i])
    for i in range(S[PLACES]):
        way = h * y[i] + h * h * ((0.5 - c[BETA]) * work[i] + c[BETA] * work[n + i])
        if S[GROUPS] > 0:
            x[i] = way + U[i]
        else:
            q[S[COORDINATES] + i] = q[i] + way + U[i]


def corrected(
    S: Integers, rows: Integers, fast: Integers, entries: Integers, out: Reals, c_K: float, c_C: float, M: Reals,
    orders: Integers, b: Reals, U: Reals,
) -> None:  # fmt: skip
    """U that brings positions onto the rows; the last lines of b become what velocities are then off, over c_C."""
    n = S[RATES]
    n_v = S[PLACES]
    m = S[ROWS]
    clear(b, n)
    for i in range(m):
        off = out[n + rows[i]] - c_K / c_C * out[n + S[ALL_ROWS] + rows[i]]
        b[n + i] = off if fast[i] == 0 else 0.0
    solve(M, n + m, orders, b)
    for i in range(n_v):
        U[n_v + i] = -b[i]
        U[i] -= b[i]
    for i in range(m):
        b[n + i] = out[n + S[ALL_ROWS] + rows[i]]
    for e in range(S[ENTRIES]):
        i = entries[e * PARTS + EQUATION]
        j = entries[e * PARTS + COLUMN]
        if n <= i < n + m and j < n_v:
            b[i] += out[entries[e * PARTS + PLACE]] * U[n_v + j]
    for i in range(m):
        b[n + i] /= c_C


def renewed(
    S: Integers, c: Reals, h: float, rows: Integers, y: Reals, rate: Reals, lam: Reals, memory: Reals, b: Reals,
    U: Reals, work: Reals,
) -> bool:  # fmt: skip
    """Rates and multipliers of row 1 less the step b; whether that was round-off."""
    n = S[RATES]
    size = 1e-300
    step = 0.0
    moved = 0.0
    for i in range(n):
        rate[n + i] -= b[i]
        size = max(size, abs(rate[n + i]))
        step = max(step, abs(b[i]))
    for i in range(S[ROWS]):
        lam[S[ALL_ROWS] + rows[i]] -= b[n + i]
    for i in range(S[PLACES]):
        moved = max(moved, abs(U[S[PLACES] + i]))
    averages(S, c, 0, h, y, rate, memory, work)
    return bool(step <= 1e-13 * size and moved <= 1e-13 * h * h * size)
