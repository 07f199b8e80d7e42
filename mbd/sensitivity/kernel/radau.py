"""Many steps of the three-stage Radau IIA method, differentiated as the implicit function of all stages together.

Unknowns of stage i are rates W_i (n) and multipliers (m), where rows act position corrections P_i (n) with what belongs
to them, ν_i (m): rows hold positions and velocities, ``S P_i + R ν_i = 0`` in the metric of the middle stage. Runs do
not store stages: they are solved for again. `stages` has W (3, n) | λ (3, m) | P (3, n) | ν (3, m); `outs` (3, outputs)
what the program `steps` gives at each; out, other (outputs). Z1
(3, columns, D) has the derivatives of the stages with W, P held. Programs: 0 `consistent`, 1 `steps`. Where coordinates
do not add, stages are in the chart around the start of the step (`radau_charts`: turns … orders).
"""

from __future__ import annotations

from mbd.kernel.algebra.linear import factor, solve
from mbd.kernel.hooks import call_on
from mbd.kernel.records import Integers, Model, Reals
from mbd.sensitivity.kernel.balance import consistent
from mbd.sensitivity.kernel.charts import compose, enter, leave
from mbd.sensitivity.kernel.directions import add, clear, solve_all
from mbd.sensitivity.kernel.entries import place_row
from mbd.sensitivity.kernel.radau_charts import end_in_chart, is_in_chart, of_chart_stages, place_motion, turn
from mbd.sensitivity.kernel.radau_equations import (
    REACH,
    REAL,
    SQUARE,
    WEIGHTS,
    evaluate,
    line,
    matrix,
    middle,
    place_stage,
    residual,
    through,
)
from mbd.sensitivity.kernel.runge_kutta import is_at
from mbd.sensitivity.kernel.sizes import (
    ALL_ROWS,
    AT_LAM,
    AT_Q,
    AT_RATE,
    AT_X,
    AT_Y,
    COLUMN,
    COLUMNS,
    COORDINATES,
    ENTRIES,
    EQUATION,
    GROUPS,
    PARTS,
    PLACE,
    PLACES,
    RATES,
    ROWS,
    WIDTH,
)

__all__ = ["radau_steps"]

MOST = 12
"""Newton iterations for the stages of a step [-]."""
FRESH = 2
"""Those of them that make their own matrix [-]."""


def radau_steps(
    K: Model, S: Integers, S0: Integers, numbers: Reals, steps: int, checked: int, outputs: int, time: Reals, q: Reals,
    y: Reals, rate: Reals, lam: Reals, rows: Integers, fast: Integers, entries: Integers, entries0: Integers,
    block: Reals, out: Reals, outs: Reals, other: Reals, stages: Reals, X: Reals, Z: Reals, Z1: Reals, dh: Reals,
    A: Reals, B: Reals, b: Reals, M: Reals, pivots: Integers, turns: Reals, column: Reals, own: Reals, E: Reals,
    moved: Reals, ways: Reals, small: Reals, orders: Integers,
) -> int:  # fmt: skip
    """Take Z and X (n + m, D) over the steps between rows 0 … `steps`; how many ended at their rows, and were regular.

    checked : 0 where row 1 is not known and is to be found; dh (D,) : derivatives of the size of each step
    """
    n = S[RATES]
    m = S[ROWS]
    size = (n + m) * (2 if m > 0 else 1)
    for k in range(steps):
        h = time[k + 1] - time[k]
        guess(S, numbers, k, rate, lam, rows, stages)
        for number in range(MOST):
            evaluate(K, S, numbers, k, h, outputs, time, q, y, rows, block, out, outs, stages, E, moved, turns)
            middle(S, numbers, h, outputs, entries, outs, M)
            if number < FRESH:
                if not turn(S, numbers, h, moved, ways, small, orders, column):
                    return k
                clear(A, 9 * size * size)
                matrix(S, numbers, h, outputs, entries, fast, outs, M, A, ways)
                if factor(A, 3 * size, pivots) != 0:
                    return k
            residual(S, outputs, rows, fast, outs, M, stages, b)
            solve(A, 3 * size, pivots, b)
            if renewed(S, b, stages):
                break
        evaluate(K, S, numbers, k, h, outputs, time, q, y, rows, block, out, outs, stages, E, moved, turns)
        middle(S, numbers, h, outputs, entries, outs, M)
        if not turn(S, numbers, h, moved, ways, small, orders, column):
            return k
        clear(A, 9 * size * size)
        matrix(S, numbers, h, outputs, entries, fast, outs, M, A, ways)
        clear(B, 3 * size * S[WIDTH])
        of_stages(S, numbers, k, h, y, stages, Z, Z1, dh)
        of_chart_stages(S, numbers, h, moved, ways, Z1, dh, own)
        of_equations(S, outputs, entries, fast, outs, Z1, B)
        if m > 0:
            of_corrections(
                K, S, numbers, k, h, outputs, time, q, y, rows, entries, block, out, outs, other, stages, Z1, dh, A, B,
                E, ways,
            )  # fmt: skip
        if factor(A, 3 * size, pivots) != 0:
            return k
        solve_all(A, 3 * size, pivots, B, S[WIDTH])
        ended(S, numbers, k, h, q, y, stages, Z1, B, block, E, ways)
        leave(K, 2, S, block, turns, Z1, 2 * S[COLUMNS], own)
        compose(K, 2, S, block, turns)
        if checked == 0:
            for i in range(S[COORDINATES]):
                q[(k + 1) * S[COORDINATES] + i] = block[S[AT_Q] + i]
            for i in range(n):
                y[(k + 1) * n + i] = block[S[AT_Y] + i]
        elif not is_at(S, k + 1, q, y, block):
            return k
        place_row(S, block, k + 1, time, q, y, rate, lam)
        third = 2 * S[COLUMNS] * S[WIDTH]
        for i in range(S[COLUMNS] * S[WIDTH]):
            Z1[i] = Z1[third + i]
        if consistent(K, 0, S0, rows, entries0, block, out, Z1, A, B, b, pivots) != 0:
            return k
        if checked == 0:
            for i in range(n):
                rate[(k + 1) * n + i] = block[S[AT_RATE] + i]
            for i in range(m):
                lam[(k + 1) * S[ALL_ROWS] + rows[i]] = block[S[AT_LAM] + rows[i]]
        for i in range(S[COLUMNS] * S[WIDTH]):
            Z[i] = Z1[i]
        for i in range((n + m) * S[WIDTH]):
            X[i] = B[i]
    return steps


def guess(S: Integers, c: Reals, k: int, rate: Reals, lam: Reals, rows: Integers, stages: Reals) -> None:
    """Rates and multipliers of stages between those of the rows; no corrections."""
    n = S[RATES]
    m = S[ROWS]
    clear(stages, 6 * (n + m))
    for s in range(3):
        for i in range(n):
            first = rate[k * n + i]
            stages[s * n + i] = first + c[s] * (rate[(k + 1) * n + i] - first)
        for i in range(m):
            first = lam[k * S[ALL_ROWS] + rows[i]]
            stages[3 * n + s * m + i] = first + c[s] * (lam[(k + 1) * S[ALL_ROWS] + rows[i]] - first)


def renewed(S: Integers, b: Reals, stages: Reals) -> bool:
    """The stages less the step b; whether that was round-off."""
    n = S[RATES]
    m = S[ROWS]
    size = (n + m) * (2 if m > 0 else 1)
    step = 0.0
    largest = 1e-300
    for s in range(3):
        o = s * size
        for i in range(n):
            stages[s * n + i] -= b[o + i]
            step = max(step, abs(b[o + i]))
            largest = max(largest, abs(stages[s * n + i]))
        for i in range(m):
            stages[3 * n + s * m + i] -= b[o + n + i]
            stages[6 * n + 3 * m + s * m + i] -= b[o + 2 * n + m + i]
        if m > 0:
            for i in range(n):
                stages[3 * (n + m) + s * n + i] -= b[o + n + m + i]
    return bool(step <= 1e-13 * largest)


def of_stages(S: Integers, c: Reals, k: int, h: float, y: Reals, stages: Reals, Z: Reals, Z1: Reals, dh: Reals) -> None:
    """Derivatives of t, x, y of the stages while W, P do not change."""
    n = S[RATES]
    n_v = S[PLACES]
    w = S[WIDTH]
    for s in range(3):
        first = s * S[COLUMNS]
        for i in range(S[COLUMNS] * w):
            Z1[first * w + i] = Z[i]
        enter(S, Z1, first)
        add(Z1, first + n_v + 2 * n + S[ROWS], c[s], dh, 0, w)
        for i in range(n):
            speed = 0.0
            way = 0.0
            for t in range(3):
                speed += c[WEIGHTS + 3 * s + t] * stages[t * n + i]
                way += c[SQUARE + 3 * s + t] * stages[t * n + i]
            add(Z1, first + n_v + i, speed, dh, 0, w)
            if i < n_v:
                add(Z1, first + i, h * c[s], Z, n_v + i, w)
                add(Z1, first + i, c[s] * y[k * n + i] + 2.0 * h * way, dh, 0, w)


def of_equations(
    S: Integers, outputs: int, entries: Integers, fast: Integers, outs: Reals, Z1: Reals, B: Reals
) -> None:
    """B −= the changes of all equations but those of corrections by Z1."""
    n = S[RATES]
    n_v = S[PLACES]
    m = S[ROWS]
    size = (n + m) * (2 if m > 0 else 1)
    for s in range(3):
        for e in range(S[ENTRIES]):
            i = line(S, entries[e * PARTS + EQUATION], fast)
            j = entries[e * PARTS + COLUMN]
            if i >= 0 and (j < n_v + n or j >= n_v + 2 * n + m):
                value = outs[s * outputs + entries[e * PARTS + PLACE]]
                add(B, s * size + i, -value, Z1, s * S[COLUMNS] + j, S[WIDTH])


def of_corrections(
    K: Model, S: Integers, c: Reals, k: int, h: float, outputs: int, time: Reals, q: Reals, y: Reals, rows: Integers,
    entries: Integers, block: Reals, out: Reals, outs: Reals, other: Reals, stages: Reals, Z1: Reals, dh: Reals,
    A: Reals, B: Reals, E: Reals, ways: Reals,
) -> None:  # fmt: skip
    """How ``S P_i + R ν_i`` follows the middle stage and h: into A and B."""
    n = S[RATES]
    n_v = S[PLACES]
    m = S[ROWS]
    size = 2 * (n + m)
    step = c[REAL] * h
    for s in range(3):
        place = 3 * (n + m) + s * n
        large = 0.0
        for i in range(n):
            large = max(large, abs(stages[place + i]))
        if large > 0.0:
            large /= c[REACH]
            along(K, S, c, k, h, s, 1.0 / large, time, q, y, rows, block, other, stages, E)
            along(K, S, c, k, h, s, -1.0 / large, time, q, y, rows, block, out, stages, E)
            for e in range(S[ENTRIES]):
                i = entries[e * PARTS + EQUATION]
                j = entries[e * PARTS + COLUMN]
                if i < n:
                    o = s * size + n + m + i
                    at = entries[e * PARTS + PLACE]
                    change = 0.5 * large * (other[at] - out[at])
                    value = outs[outputs + at]
                    if change != 0.0:
                        through(S, c, h, 1, j, o, change, A, ways)
                        if j < n_v + n or j >= n_v + 2 * n + m:
                            add(B, o, -change, Z1, S[COLUMNS] + j, S[WIDTH])
                    if j < n_v:
                        add(B, o, -2.0 * step * step / h * value * stages[place + j], dh, 0, S[WIDTH])
                    elif j < n_v + n:
                        add(B, o, -step / h * value * stages[place + j - n_v], dh, 0, S[WIDTH])


def along(
    K: Model, S: Integers, c: Reals, k: int, h: float, s: int, part: float, time: Reals, q: Reals, y: Reals,
    rows: Integers, block: Reals, out: Reals, stages: Reals, E: Reals,
) -> None:  # fmt: skip
    """The program at the middle stage, moved by a part of ((μh)², μh, 1) P and of ν of stage s."""
    n = S[RATES]
    m = S[ROWS]
    step = c[REAL] * h
    place_stage(S, c, k, h, 1, time, q, y, rows, block, stages, E)
    for i in range(n):
        P = part * stages[3 * (n + m) + s * n + i]
        if i < S[PLACES]:
            block[S[AT_X] + i] += step * step * P
        block[S[AT_Y] + i] += step * P
        block[S[AT_RATE] + i] += P
    for i in range(m):
        block[S[AT_LAM] + rows[i]] += part * stages[6 * n + 3 * m + s * m + i]
    call_on(K, 1, block, out)


def ended(
    S: Integers, c: Reals, k: int, h: float, q: Reals, y: Reals, stages: Reals, Z1: Reals, B: Reals, block: Reals,
    E: Reals, ways: Reals,
) -> None:  # fmt: skip
    """q or x, y of the last stage into the block, their derivatives into the last of Z1."""
    n = S[RATES]
    n_v = S[PLACES]
    m = S[ROWS]
    size = (n + m) * (2 if m > 0 else 1)
    last = 2 * S[COLUMNS]
    for i in range(n):
        speed = 0.0
        way = 0.0
        for t in range(3):
            speed += c[WEIGHTS + 6 + t] * stages[t * n + i]
            way += c[SQUARE + 6 + t] * stages[t * n + i]
            add(Z1, last + n_v + i, h * c[WEIGHTS + 6 + t], B, t * size + i, S[WIDTH])
            if i < n_v and not is_in_chart(S, i):
                add(Z1, last + i, h * h * c[SQUARE + 6 + t], B, t * size + i, S[WIDTH])
        block[S[AT_Y] + i] = y[k * n + i] + h * speed
        if i < n_v:
            x = h * c[2] * y[k * n + i] + h * h * way + stages[3 * (n + m) + 2 * n + i]
            if S[GROUPS] == 0:
                block[S[AT_Q] + i] = q[k * S[COORDINATES] + i] + x
            if m > 0 and not is_in_chart(S, i):
                add(Z1, last + i, 1.0, B, 2 * size + n + m + i, S[WIDTH])
    if S[GROUPS] > 0:
        place_motion(S, c, k, h, 2, q, y, block, stages, E)
        end_in_chart(S, ways, Z1, B)
