"""Stages of the Radau IIA method in the chart around the start of a step, where coordinates do not add (see `radau`).

    X_i = h Σ a_ij ẋ_j + P_i,   ẋ_j = D(X_j)⁻¹ V_j = V_j + E_j

E (3, n_v) are found by iteration. With G = ∂(D⁻¹ v)/∂x, N = (1 − h a G)⁻¹ of all three stages of a joint together,

    δX = N (h a D⁻¹ δV + δP + δh Σ a ẋ)

so that ∂X/∂W = N h a D⁻¹ h a and ∂X/∂P = N: `ways` has the two (3 d)² of each joint, `moved` (3, outputs of `moves`)
what charts give at the stages. Programs: from 2 on those of `charts`.
"""

from __future__ import annotations

from mbd.kernel.algebra.linear import factor, solve
from mbd.kernel.hooks import call_on
from mbd.kernel.records import Integers, Model, Reals
from mbd.sensitivity.kernel.directions import add
from mbd.sensitivity.kernel.sizes import (
    AT_Q,
    AT_X,
    AT_Y,
    COLUMNS,
    COORDINATES,
    GROUPS,
    LISTED,
    PLACES,
    RATES,
    ROWS,
    WIDTH,
)

__all__ = ["bend", "end_in_chart", "is_in_chart", "of_chart_stages", "place_motion", "turn", "ways_by"]

WEIGHTS = 3
SQUARE = 12
"""Where `numbers` has A and A A, behind c."""
MOST = 60
"""Rounds of the iteration for E."""
SETTLED = 1e-15
"""Change of E over the largest speed that ends it [-]."""


def place_motion(
    S: Integers, c: Reals, k: int, h: float, s: int, q: Reals, y: Reals, block: Reals, stages: Reals, E: Reals
) -> None:
    """q₀, X_s and V_s into the block."""
    n = S[RATES]
    n_v = S[PLACES]
    for i in range(S[COORDINATES]):
        block[S[AT_Q] + i] = q[k * S[COORDINATES] + i]
    for i in range(n_v):
        speed = 0.0
        way = 0.0
        bends = 0.0
        for t in range(3):
            speed += c[WEIGHTS + 3 * s + t] * stages[t * n + i]
            way += c[SQUARE + 3 * s + t] * stages[t * n + i]
            bends += c[WEIGHTS + 3 * s + t] * E[t * n_v + i]
        block[S[AT_Y] + i] = y[k * n + i] + h * speed
        x = h * c[s] * y[k * n + i] + h * h * way + h * bends
        block[S[AT_X] + i] = x + stages[3 * (n + S[ROWS]) + s * n + i]


def bend(
    K: Model, S: Integers, c: Reals, k: int, h: float, q: Reals, y: Reals, block: Reals, stages: Reals, E: Reals,
    moved: Reals, turns: Reals,
) -> None:  # fmt: skip
    """E of all stages, and what charts give there."""
    n_v = S[PLACES]
    outputs = 0
    for g in range(S[GROUPS]):
        size = S[LISTED + 2 * g + 1]
        outputs += 4 * size * size + size
    for _ in range(MOST if S[GROUPS] > 0 else 0):
        change = 0.0
        fastest = 0.0
        for s in range(3):
            place_motion(S, c, k, h, s, q, y, block, stages, E)
            call_on(K, 2, block, turns)
            for i in range(outputs):
                moved[s * outputs + i] = turns[i]
            place = 0
            for g in range(S[GROUPS]):
                first = S[LISTED + 2 * g]
                size = S[LISTED + 2 * g + 1]
                for i in range(size):
                    rate = turns[place + 4 * size * size + i]
                    found = rate - block[S[AT_Y] + first + i]
                    change = max(change, abs(found - E[s * n_v + first + i]))
                    fastest = max(fastest, abs(rate))
                    E[s * n_v + first + i] = found
                place += 4 * size * size + size
        if change <= SETTLED * fastest:
            break


def turn(
    S: Integers, c: Reals, h: float, moved: Reals, ways: Reals, matrix: Reals, orders: Integers, column: Reals
) -> bool:
    """∂X/∂W, ∂X/∂P of each joint at the stages; false where they are singular. matrix, orders, column: room."""
    outputs = 0
    for g in range(S[GROUPS]):
        size = S[LISTED + 2 * g + 1]
        outputs += 4 * size * size + size
    place = 0
    at = 0
    for g in range(S[GROUPS]):
        d = S[LISTED + 2 * g + 1]
        wide = 3 * d
        for s in range(3):
            for i in range(d):
                for t in range(3):
                    for j in range(d):
                        G = moved[t * outputs + place + (3 * d + i) * d + j]
                        one = 1.0 if s == t and i == j else 0.0
                        matrix[(s * d + i) * wide + t * d + j] = one - h * c[WEIGHTS + 3 * s + t] * G
        if factor(matrix, wide, orders) != 0:
            return False
        for t in range(3):
            for j in range(d):
                for s in range(3):
                    for i in range(d):
                        total = 0.0
                        for u in range(3):
                            inverse = moved[u * outputs + place + (2 * d + i) * d + j]
                            total += c[WEIGHTS + 3 * s + u] * inverse * c[WEIGHTS + 3 * u + t]
                        column[s * d + i] = h * h * total
                solve(matrix, wide, orders, column)
                for i in range(wide):
                    ways[at + i * wide + t * d + j] = column[i]
                for i in range(wide):
                    column[i] = 1.0 if i == t * d + j else 0.0
                solve(matrix, wide, orders, column)
                for i in range(wide):
                    ways[at + (wide + i) * wide + t * d + j] = column[i]
        place += 4 * d * d + d
        at += 2 * wide * wide
    return True


def ways_by(S: Integers, s: int, j: int, line: int, value: float, A: Reals, ways: Reals) -> bool:
    """Line of A plus a derivative by X of stage s along the velocity j; false where the coordinate adds."""
    n = S[RATES]
    m = S[ROWS]
    size = (n + m) * (2 if m > 0 else 1)
    at = 0
    for g in range(S[GROUPS]):
        first = S[LISTED + 2 * g]
        d = S[LISTED + 2 * g + 1]
        wide = 3 * d
        if first <= j < first + d:
            own = at + (s * d + j - first) * wide
            for t in range(3):
                for i in range(d):
                    A[line * 3 * size + t * size + first + i] += value * ways[own + t * d + i]
                    if m > 0:
                        part = ways[own + wide * wide + t * d + i]
                        A[line * 3 * size + t * size + n + m + first + i] += value * part
            return True
        at += 2 * wide * wide
    return False


def of_chart_stages(
    S: Integers, c: Reals, h: float, moved: Reals, ways: Reals, Z1: Reals, dh: Reals, own: Reals
) -> None:
    """Derivatives of X while W, P do not change, from those of V. own (9, D): room"""
    w = S[WIDTH]
    n_v = S[PLACES]
    outputs = 0
    for g in range(S[GROUPS]):
        size = S[LISTED + 2 * g + 1]
        outputs += 4 * size * size + size
    place = 0
    at = 0
    for g in range(S[GROUPS]):
        first = S[LISTED + 2 * g]
        d = S[LISTED + 2 * g + 1]
        wide = 3 * d
        for i in range(wide * w):
            own[i] = 0.0
        for s in range(3):
            for i in range(d):
                for t in range(3):
                    weight = c[WEIGHTS + 3 * s + t]
                    add(own, s * d + i, weight * moved[t * outputs + place + 4 * d * d + i], dh, 0, w)
                    for j in range(d):
                        inverse = moved[t * outputs + place + (2 * d + i) * d + j]
                        add(own, s * d + i, h * weight * inverse, Z1, t * S[COLUMNS] + n_v + first + j, w)
        for s in range(3):
            for i in range(d):
                line = s * S[COLUMNS] + first + i
                for j in range(w):
                    Z1[line * w + j] = 0.0
                for j in range(wide):
                    add(Z1, line, ways[at + (wide + s * d + i) * wide + j], own, j, w)
        place += 4 * d * d + d
        at += 2 * wide * wide


def end_in_chart(S: Integers, ways: Reals, Z1: Reals, B: Reals) -> None:
    """Derivatives of X of the last stage in Z1 with those of W and P, which are in B."""
    n = S[RATES]
    m = S[ROWS]
    size = (n + m) * (2 if m > 0 else 1)
    at = 0
    for g in range(S[GROUPS]):
        first = S[LISTED + 2 * g]
        d = S[LISTED + 2 * g + 1]
        wide = 3 * d
        for i in range(d):
            line = 2 * S[COLUMNS] + first + i
            for t in range(3):
                for j in range(d):
                    own = at + (2 * d + i) * wide + t * d + j
                    add(Z1, line, ways[own], B, t * size + first + j, S[WIDTH])
                    if m > 0:
                        add(Z1, line, ways[own + wide * wide], B, t * size + n + m + first + j, S[WIDTH])
        at += 2 * wide * wide


def is_in_chart(S: Integers, j: int) -> bool:
    """Whether the coordinate that velocity j moves does not add."""
    found = False
    for g in range(S[GROUPS]):
        found = found or S[LISTED + 2 * g] <= j < S[LISTED + 2 * g] + S[LISTED + 2 * g + 1]
    return bool(found)
