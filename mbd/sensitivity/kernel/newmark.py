"""Many steps of the Newmark family, each differentiated as the implicit function that it is: `mbd.sensitivity.newmark`.

What the scheme remembers stands in two arrays: numbers in `memory`,

    a (n) | slope of rates (n) | slope of λ (R) | U (n_v) | ΔU (n_v) | last step,

their derivatives in X, as rows

    rates (n) | a (n) | λ (m); where the stabilized form has rows, rates (n) | a (n) | slope (n) | U (n_v) | ΔU (n_v) |
    λ (m) | slope of λ (m).

Z has the derivatives of the state by the columns of `sizes`: x | y | rates | λ | t | anchors | parameters; rates and λ
are not used. Z1 has them where the kernel predicts the end of a step. Unknowns are v̇₁ (n), λ (m), and then, of
the stabilized form, U = W (n), ν (m). `work` has a₀ (n) | a₁ (n) | W (n) | ν (m) | ∂/∂h of their equations (n + m).
"""

from __future__ import annotations

from mbd.kernel.hooks import call_on
from mbd.kernel.linear import factor, solve
from mbd.kernel.records import Integers, Model, Reals
from mbd.sensitivity.kernel.directions import add, clear, solve_all
from mbd.sensitivity.kernel.entries import balance, changes, metric, place_row
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
    NEAR,
    PARTS,
    PLACE,
    PLACES,
    RATES,
    ROWS,
    STABILIZED,
    WIDTH,
)

__all__ = ["newmark_end", "newmark_steps"]

FOLLOWED = 1e-9
"""Distance of a row from the end of its step, over how far the step went, up to which the step is known [-]."""
MOST = 12
"""Newton iterations for the end of a step at an event [-]."""
ALPHA_M = 0
ALPHA_F = 1
BETA = 2
GAMMA = 3
FULL = 4


def newmark_steps(
    K: Model, S: Integers, numbers: Reals, steps: int, time: Reals, q: Reals, y: Reals, rate: Reals, lam: Reals,
    rows: Integers, entries: Integers, block: Reals, near: Reals, out: Reals, other: Reals, memory: Reals, X: Reals,
    Z: Reals, Z1: Reals, dh: Reals, A: Reals, B: Reals, M: Reals, b: Reals, pivots: Integers, work: Reals,
) -> int:  # fmt: skip
    """Take Z, X and memory over the steps between rows 0 … `steps`; how many were those of the scheme, and regular.

    numbers : α_m, α_f, β, γ, full step; dh (D,) : derivatives of the size of each step
    """
    twofold = S[STABILIZED] == 1 and S[ROWS] > 0
    size = (2 if twofold else 1) * (S[RATES] + S[ROWS])
    for k in range(steps):
        h = time[k + 1] - time[k]
        if not averages(S, numbers, k, h, y, rate, memory, work):
            return k
        correction_of(S, numbers, k, h, q, y, work)
        c_C = numbers[GAMMA] * h * (1.0 - numbers[ALPHA_F]) / (1.0 - numbers[ALPHA_M])
        c_K = c_C * h * numbers[BETA] / numbers[GAMMA]
        if twofold:
            predicted_place(S, numbers, k, h, time, q, y, rate, lam, memory, near, work)
        predict(S, numbers, k, h, y, rate, memory, X, Z, Z1, dh, work)
        if twofold:
            predict_more(S, numbers, k, h, c_K, c_C, y, rate, rows, memory, X, Z, Z1, dh, work)
        place_row(S, block, k + 1, time, q, y, rate, lam)
        clear(A, size * size)
        clear(B, size * S[WIDTH])
        call_on(K, 0, block, out)
        balance(S, entries, out, c_K, c_C, size, A)
        changes(S, entries, out, B, Z)
        if twofold and not corrections(
            K, S, rows, entries, block, near, out, other, c_K, c_C, h, A, B, Z1, dh, M, b, pivots, work
        ):
            return k
        if factor(A, size, pivots) != 0:
            return k
        solve_all(A, size, pivots, B, S[WIDTH])
        take(S, numbers, k, h, c_K, c_C, rate, lam, rows, memory, X, Z, B, dh, work)
    return steps


def newmark_end(
    K: Model, S: Integers, numbers: Reals, time: Reals, q: Reals, y: Reals, rate: Reals, lam: Reals, rows: Integers,
    fast: Integers, entries: Integers, block: Reals, near: Reals, out: Reals, memory: Reals, A: Reals, M: Reals,
    b: Reals, U: Reals, pivots: Integers, orders: Integers, work: Reals,
) -> int:  # fmt: skip
    """Solve for row 1, the end of a step from row 0, from its rates and multipliers on; 1 if it cannot be solved for.

    A, M (n + m)²; U (n_v) and U of the iteration before
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
        end_of(S, numbers, h, q, y, U, work)
        place_row(S, block, 1, time, q, y, rate, lam)
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
    end_of(S, numbers, h, q, y, U, work)
    return 0


def end_of(S: Integers, c: Reals, h: float, q: Reals, y: Reals, U: Reals, work: Reals) -> None:
    """q and y of row 1 by a₀, a₁ and U."""
    n = S[RATES]
    for i in range(n):
        y[n + i] = y[i] + h * ((1.0 - c[GAMMA]) * work[i] + c[GAMMA] * work[n + i])
    for i in range(S[PLACES]):
        way = h * y[i] + h * h * ((0.5 - c[BETA]) * work[i] + c[BETA] * work[n + i])
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


def averages(S: Integers, c: Reals, k: int, h: float, y: Reals, rate: Reals, memory: Reals, work: Reals) -> bool:
    """a₀ and a₁ of a step into work; whether the row is where it leads."""
    n = S[RATES]
    stretch = h / memory[2 * n + S[ALL_ROWS] + 2 * S[PLACES]]
    off = 0.0
    size = 0.0
    largest = 0.0
    for i in range(n):
        first = rate[k * n + i]
        a0 = first + stretch * (memory[i] - first)
        a1 = ((1.0 - c[ALPHA_F]) * rate[(k + 1) * n + i] + c[ALPHA_F] * first - c[ALPHA_M] * a0) / (1.0 - c[ALPHA_M])
        work[i] = a0
        work[n + i] = a1
        way = h * ((1.0 - c[GAMMA]) * a0 + c[GAMMA] * a1)
        off = max(off, abs(y[k * n + i] + way - y[(k + 1) * n + i]))
        size = max(size, abs(y[(k + 1) * n + i]))
        largest = max(largest, abs(a0) + abs(a1))
    size += h * largest
    return bool(off <= FOLLOWED * h * size / c[FULL] + 1e-14 * size)


def correction_of(S: Integers, c: Reals, k: int, h: float, q: Reals, y: Reals, work: Reals) -> None:
    """U of a step into work."""
    n = S[RATES]
    for i in range(S[PLACES]):
        way = h * y[k * n + i] + h * h * ((0.5 - c[BETA]) * work[i] + c[BETA] * work[n + i])
        work[2 * n + i] = q[(k + 1) * S[COORDINATES] + i] - q[k * S[COORDINATES] + i] - way


def predict(
    S: Integers, c: Reals, k: int, h: float, y: Reals, rate: Reals, memory: Reals, X: Reals, Z: Reals, Z1: Reals,
    dh: Reals, work: Reals,
) -> None:  # fmt: skip
    """t, x, y in Z and a in X become those of the end of the step with δv̇₁ = 0, δU = 0; Z1 has x, y where δh = 0."""
    n = S[RATES]
    n_v = S[PLACES]
    w = S[WIDTH]
    last = memory[2 * n + S[ALL_ROWS] + 2 * n_v]
    stretch = h / last
    mean = 1.0 / (1.0 - c[ALPHA_M])
    first = 1.0 - c[GAMMA]
    half = 0.5 - c[BETA]
    for i in range(n):
        speed = first * work[i] + c[GAMMA] * work[n + i]
        way = y[k * n + i] + 2.0 * h * (half * work[i] + c[BETA] * work[n + i])
        by_h = (memory[i] - rate[k * n + i]) / last
        for j in range(w):
            of_rate = X[i * w + j]
            of_a0 = of_rate + stretch * (X[(n + i) * w + j] - of_rate) + by_h * dh[j]
            of_a1 = mean * (c[ALPHA_F] * of_rate - c[ALPHA_M] * of_a0)
            of_y = Z[(n_v + i) * w + j]
            moved = of_y + h * (first * of_a0 + c[GAMMA] * of_a1)
            X[(n + i) * w + j] = of_a1
            Z1[(n_v + i) * w + j] = moved
            Z[(n_v + i) * w + j] = moved + speed * dh[j]
            if i < n_v:
                moved = Z[i * w + j] + h * of_y + h * h * (half * of_a0 + c[BETA] * of_a1)
                Z1[i * w + j] = moved
                Z[i * w + j] = moved + way * dh[j]
    t = (n_v + 2 * n + S[ROWS]) * w
    for j in range(w):
        Z[t + j] += dh[j]
        Z1[t + j] = Z[t + j]


def predict_more(
    S: Integers, c: Reals, k: int, h: float, c_K: float, c_C: float, y: Reals, rate: Reals, rows: Integers,
    memory: Reals, X: Reals, Z: Reals, Z1: Reals, dh: Reals, work: Reals,
) -> None:  # fmt: skip
    """x, y, rates and λ in Z1 become those of the place that the kernel predicts."""
    n = S[RATES]
    n_v = S[PLACES]
    m = S[ROWS]
    w = S[WIDTH]
    stretch = h / memory[2 * n + S[ALL_ROWS] + 2 * n_v]
    cube = stretch * stretch * stretch
    for i in range(n):
        ahead = rate[k * n + i] + h * memory[n + i]
        a1 = (1.0 - c[ALPHA_F]) * ahead + c[ALPHA_F] * rate[k * n + i]
        a1 = (a1 - c[ALPHA_M] * work[i]) / (1.0 - c[ALPHA_M])
        by_h = memory[n + i]
        speed = (1.0 - c[GAMMA]) * work[i] + c[GAMMA] * a1
        way = y[k * n + i] + 2.0 * h * ((0.5 - c[BETA]) * work[i] + c[BETA] * a1)
        for j in range(w):
            of_rate = X[i * w + j] + h * X[(2 * n + i) * w + j] + by_h * dh[j]
            Z1[(n_v + n + i) * w + j] = of_rate
            Z1[(n_v + i) * w + j] += c_C * of_rate + speed * dh[j]
            if i < n_v:
                U = X[(3 * n + i) * w + j] + stretch * X[(3 * n + n_v + i) * w + j]
                Z1[i * w + j] += c_K * of_rate + way * dh[j] + cube * U
    for i in range(m):
        by_h = memory[2 * n + rows[i]]
        for j in range(w):
            of_lam = X[(3 * n + 2 * n_v + i) * w + j] + h * X[(3 * n + 2 * n_v + m + i) * w + j]
            Z1[(n_v + 2 * n + i) * w + j] = of_lam + by_h * dh[j]


def predicted_place(
    S: Integers, c: Reals, k: int, h: float, time: Reals, q: Reals, y: Reals, rate: Reals, lam: Reals, memory: Reals,
    near: Reals, work: Reals,
) -> None:  # fmt: skip
    """Where the kernel predicts the end of a step, at which its metric of U is, as inputs of programs."""
    n = S[RATES]
    n_v = S[PLACES]
    rows = S[ALL_ROWS]
    stretch = h / memory[2 * n + rows + 2 * n_v]
    near[0] = time[k + 1]
    for i in range(n):
        first = rate[k * n + i]
        ahead = first + h * memory[n + i]
        a1 = (1.0 - c[ALPHA_F]) * ahead + c[ALPHA_F] * first
        a1 = (a1 - c[ALPHA_M] * work[i]) / (1.0 - c[ALPHA_M])
        near[S[AT_RATE] + i] = ahead
        near[S[AT_Y] + i] = y[k * n + i] + h * ((1.0 - c[GAMMA]) * work[i] + c[GAMMA] * a1)
        if i < n_v:
            U = memory[2 * n + rows + i] + stretch * memory[2 * n + rows + n_v + i]
            x = h * y[k * n + i] + h * h * ((0.5 - c[BETA]) * work[i] + c[BETA] * a1) + U * stretch * stretch * stretch
            near[S[AT_Q] + i] = q[k * S[COORDINATES] + i] + x
    for i in range(rows):
        near[S[AT_LAM] + i] = lam[k * rows + i] + h * memory[2 * n + i]


def corrections(
    K: Model, S: Integers, rows: Integers, entries: Integers, block: Reals, near: Reals, out: Reals, other: Reals,
    c_K: float, c_C: float, h: float, A: Reals, B: Reals, Z1: Reals, dh: Reals, M: Reals, b: Reals, pivots: Integers,
    work: Reals,
) -> bool:  # fmt: skip
    """Equations of U: ``S W + R ν = 0`` in the metric of the predicted place, and ``B̃ W`` of rows on velocities."""
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
    turned(K, S, rows, entries, block, near, out, other, c_K, c_C, B, Z1, work)
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
    c_K: float, c_C: float, B: Reals, Z1: Reals, work: Reals,
) -> None:  # fmt: skip
    """How ``S W + R ν`` and ``B̃ W`` change by Z1 with W, ν held: by differences along (c_K, c_C, 1) W."""
    n = S[RATES]
    m = S[ROWS]
    large = 0.0
    for i in range(n):
        large = max(large, abs(work[2 * n + i]))
    if large == 0.0:
        return
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
            block[S[AT_Q] + i] += part * c_K * work[2 * n + i]
        block[S[AT_Y] + i] = near[S[AT_Y] + i] + part * c_C * work[2 * n + i]
        block[S[AT_RATE] + i] = near[S[AT_RATE] + i] + part * work[2 * n + i]
    for i in range(S[ALL_ROWS]):
        block[S[AT_LAM] + i] = near[S[AT_LAM] + i]
    for i in range(S[ROWS]):
        block[S[AT_LAM] + rows[i]] += part * work[3 * n + i]


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
