"""The end of a step of the Newmark family but for its unknowns, with its derivatives (arrays: see `newmark`)."""

from __future__ import annotations

from mbd.kernel.records import Integers, Reals
from mbd.sensitivity.kernel.sizes import (
    ALL_ROWS,
    AT_LAM,
    AT_Q,
    AT_RATE,
    AT_X,
    AT_Y,
    BASE,
    COLUMNS,
    COORDINATES,
    GROUPS,
    PLACES,
    RATES,
    ROWS,
    WIDTH,
)

__all__ = [
    "ALPHA_F", "ALPHA_M", "BETA", "FOLLOWED", "FULL", "GAMMA", "REACH", "averages", "correction_of", "predict",
    "predict_more", "predicted_place",
]  # fmt: skip

FOLLOWED = 1e-9
"""Distance of a row from the end of its step, over how far the step went, up to which the step is known [-]."""
ALPHA_M = 0
ALPHA_F = 1
BETA = 2
GAMMA = 3
FULL = 4
REACH = 5
"""Places of the numbers of the scheme, the last ones its full step and the largest rate of differences."""


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


def correction_of(S: Integers, c: Reals, k: int, h: float, q: Reals, y: Reals, x: Reals, work: Reals) -> None:
    """U of a step into work; x: its increment, where coordinates do not add."""
    n = S[RATES]
    for i in range(S[PLACES]):
        way = h * y[k * n + i] + h * h * ((0.5 - c[BETA]) * work[i] + c[BETA] * work[n + i])
        if S[GROUPS] > 0:
            work[2 * n + i] = x[i] - way
        else:
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
    for i in range(S[BASE] * w, S[COLUMNS] * w):
        Z1[i] = Z[i]


def predict_more(
    S: Integers, c: Reals, k: int, h: float, c_K: float, c_C: float, y: Reals, rate: Reals, rows: Integers,
    memory: Reals, X: Reals, Z: Reals, Z1: Reals, dh: Reals, work: Reals,
) -> None:  # fmt: skip
    """x, y, rates and λ in Z1 become those of the place that the kernel predicts."""
    n = S[RATES]
    n_v = S[PLACES]
    m = S[ROWS]
    w = S[WIDTH]
    at = 2 * n + S[ALL_ROWS]
    last = memory[at + 2 * n_v]
    stretch = h / last
    cube = stretch * stretch * stretch
    for i in range(n):
        ahead = rate[k * n + i] + h * memory[n + i]
        a1 = (1.0 - c[ALPHA_F]) * ahead + c[ALPHA_F] * rate[k * n + i]
        a1 = (a1 - c[ALPHA_M] * work[i]) / (1.0 - c[ALPHA_M])
        by_h = memory[n + i]
        speed = (1.0 - c[GAMMA]) * work[i] + c[GAMMA] * a1
        way = y[k * n + i] + 2.0 * h * ((0.5 - c[BETA]) * work[i] + c[BETA] * a1)
        if i < n_v:
            way += (3.0 * memory[at + i] + 4.0 * stretch * memory[at + n_v + i]) * stretch * stretch / last
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
            near[S[AT_X] + i] = x if S[GROUPS] > 0 else q[k * S[COORDINATES] + i] + x
    if S[GROUPS] > 0:
        for i in range(S[COORDINATES]):
            near[S[AT_Q] + i] = q[k * S[COORDINATES] + i]
    for i in range(rows):
        near[S[AT_LAM] + i] = lam[k * rows + i] + h * memory[2 * n + i]
