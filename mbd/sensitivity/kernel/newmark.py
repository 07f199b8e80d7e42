"""Many steps of the Newmark family, each differentiated as the implicit function that it is: `mbd.sensitivity.newmark`.

What the scheme remembers stands in two arrays: numbers in `memory`,

    a (n) | slope of rates (n) | slope of λ (R) | U (n_v) | ΔU (n_v) | last step,

their derivatives in X, as rows

    rates (n) | a (n) | λ (m); where the stabilized form has rows, rates (n) | a (n) | slope (n) | U (n_v) | ΔU (n_v) |
    λ (m) | slope of λ (m).

Z has the derivatives of the state by the columns of `sizes`: x | y | rates | λ | t | anchors | parameters; rates and λ
are not used. Z1 has them where the kernel predicts the end of a step. Unknowns are v̇₁ (n), λ (m), and then, of
the stabilized form, U = W (n), ν (m). `work` has a₀ (n) | a₁ (n) | W (n) | ν (m) | ∂/∂h of their equations (n + m).
Where coordinates do not add, all of a step is in the chart around its start, U too (`charts`); programs behind `steps`
are theirs, `turns` and `room` for them, `own` (n_v, D).
"""

from __future__ import annotations

from mbd.kernel.algebra.linear import factor
from mbd.kernel.hooks import call_on
from mbd.kernel.records import Integers, Model, Reals
from mbd.sensitivity.kernel.charts import enter, increment, leave, place_in_chart
from mbd.sensitivity.kernel.directions import clear, solve_all
from mbd.sensitivity.kernel.entries import balance, changes, place_row
from mbd.sensitivity.kernel.newmark_corrections import corrections
from mbd.sensitivity.kernel.newmark_prediction import (
    ALPHA_F,
    ALPHA_M,
    BETA,
    GAMMA,
    REACH,
    averages,
    correction_of,
    predict,
    predict_more,
    predicted_place,
)
from mbd.sensitivity.kernel.sizes import (
    ALL_ROWS,
    GROUPS,
    PLACES,
    RATES,
    ROWS,
    STABILIZED,
    WIDTH,
)

__all__ = ["newmark_steps"]


def newmark_steps(
    K: Model, S: Integers, numbers: Reals, steps: int, time: Reals, q: Reals, y: Reals, rate: Reals, lam: Reals,
    rows: Integers, entries: Integers, block: Reals, near: Reals, out: Reals, other: Reals, memory: Reals, X: Reals,
    Z: Reals, Z1: Reals, dh: Reals, A: Reals, B: Reals, M: Reals, b: Reals, pivots: Integers, work: Reals,
    turns: Reals, room: Reals, own: Reals,
) -> int:  # fmt: skip
    """Take Z, X and memory over the steps between rows 0 … `steps`; how many were those of the scheme, and regular.

    −1 − their number where a singular step is behind them, which leaves nothing of what they made.

    numbers : α_m, α_f, β, γ, full step, largest rate of differences; dh (D,) : derivatives of the size of each step
    """
    twofold = S[STABILIZED] == 1 and S[ROWS] > 0
    size = (2 if twofold else 1) * (S[RATES] + S[ROWS])
    for k in range(steps):
        h = time[k + 1] - time[k]
        if not averages(S, numbers, k, h, y, rate, memory, work):
            return k
        if S[GROUPS] > 0:
            increment(K, 1, S, k, q, room, turns)
            enter(S, Z, 0)
        correction_of(S, numbers, k, h, q, y, turns, work)
        c_C = numbers[GAMMA] * h * (1.0 - numbers[ALPHA_F]) / (1.0 - numbers[ALPHA_M])
        c_K = c_C * h * numbers[BETA] / numbers[GAMMA]
        if twofold:
            predicted_place(S, numbers, k, h, time, q, y, rate, lam, memory, near, work)
        predict(S, numbers, k, h, y, rate, memory, X, Z, Z1, dh, work)
        if twofold:
            predict_more(S, numbers, k, h, c_K, c_C, y, rate, rows, memory, X, Z, Z1, dh, work)
        place_row(S, block, k + 1, time, q, y, rate, lam)
        place_in_chart(S, block, k, q, turns)
        clear(A, size * size)
        clear(B, size * S[WIDTH])
        call_on(K, 0, block, out)
        balance(S, entries, out, c_K, c_C, size, A)
        changes(S, entries, out, B, Z)
        if twofold and not corrections(
            K, S, rows, entries, block, near, out, other, c_K, c_C, h, numbers[REACH], A, B, Z1, dh, M, b, pivots, work
        ):
            return -1 - k
        if factor(A, size, pivots) != 0:
            return -1 - k
        solve_all(A, size, pivots, B, S[WIDTH])
        take(S, numbers, k, h, c_K, c_C, rate, lam, rows, memory, X, Z, B, dh, work)
        place_in_chart(S, block, k, q, turns)
        leave(K, 1, S, block, turns, Z, 0, own)
    return steps


def take(
    S: Integers, c: Reals, k: int, h: float, c_K: float, c_C: float, rate: Reals, lam: Reals, rows: Integers,
    memory: Reals, X: Reals, Z: Reals, B: Reals, dh: Reals, work: Reals,
) -> None:  # fmt: skip
    """The end of the step with what the scheme remembers there, from the derivatives of unknowns in B."""
    n = S[RATES]
    n_v = S[PLACES]
    m = S[ROWS]
    w = S[WIDTH]
    twofold = S[STABILIZED] == 1 and m > 0
    mean = (1.0 - c[ALPHA_F]) / (1.0 - c[ALPHA_M])
    for i in range(n):
        memory[i] = work[n + i]
        memory[n + i] = (rate[(k + 1) * n + i] - rate[k * n + i]) / h
        for j in range(w):
            of_rate = B[i * w + j]
            if twofold:
                X[(2 * n + i) * w + j] = (of_rate - X[i * w + j] - memory[n + i] * dh[j]) / h
            X[i * w + j] = of_rate
            X[(n + i) * w + j] += mean * of_rate
            Z[(n_v + i) * w + j] += c_C * of_rate
            if i < n_v:
                Z[i * w + j] += c_K * of_rate
    for i in range(S[ALL_ROWS]):
        memory[2 * n + i] = (lam[(k + 1) * S[ALL_ROWS] + i] - lam[k * S[ALL_ROWS] + i]) / h
    for i in range(n_v):
        change = work[2 * n + i] - memory[2 * n + S[ALL_ROWS] + i]
        memory[2 * n + S[ALL_ROWS] + i] = work[2 * n + i]
        memory[2 * n + S[ALL_ROWS] + n_v + i] = change
    memory[2 * n + S[ALL_ROWS] + 2 * n_v] = h
    if twofold:
        take_more(S, h, rows, memory, X, Z, B, dh)
    else:
        for i in range(m):
            for j in range(w):
                X[(2 * n + i) * w + j] = B[(n + i) * w + j]


def take_more(S: Integers, h: float, rows: Integers, memory: Reals, X: Reals, Z: Reals, B: Reals, dh: Reals) -> None:
    """U, ΔU, λ and its slope."""
    n = S[RATES]
    n_v = S[PLACES]
    m = S[ROWS]
    w = S[WIDTH]
    for i in range(n_v):
        for j in range(w):
            U = B[(n + m + i) * w + j]
            X[(3 * n + n_v + i) * w + j] = U - X[(3 * n + i) * w + j]
            X[(3 * n + i) * w + j] = U
            Z[i * w + j] += U
    first = 3 * n + 2 * n_v
    for i in range(m):
        by_h = memory[2 * n + rows[i]]
        for j in range(w):
            of_lam = B[(n + i) * w + j]
            X[(first + m + i) * w + j] = (of_lam - X[(first + i) * w + j] - by_h * dh[j]) / h
            X[(first + i) * w + j] = of_lam
