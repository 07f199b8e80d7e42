"""Entries of derivatives of a program: where each stands, and systems of equations made of them."""

from __future__ import annotations

from mbd.kernel.records import Integers, Reals
from mbd.sensitivity.kernel.directions import add
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
    PARTS,
    PLACE,
    PLACES,
    RATES,
    ROWS,
    TARGET,
    WIDTH,
)

__all__ = ["balance", "changes", "metric", "place_row", "saddle"]


def place_row(
    S: Integers, block: Reals, k: int, time: Reals, q: Reals, y: Reals, rate: Reals, lam: Reals
) -> None:  # fmt: skip
    """Row k of a run into the inputs of programs."""
    n = S[RATES]
    block[0] = time[k]
    for i in range(S[COORDINATES]):
        block[S[AT_Q] + i] = q[k * S[COORDINATES] + i]
    for i in range(n):
        block[S[AT_Y] + i] = y[k * n + i]
        block[S[AT_RATE] + i] = rate[k * n + i]
    for i in range(S[ALL_ROWS]):
        block[S[AT_LAM] + i] = lam[k * S[ALL_ROWS] + i]


def balance(S: Integers, entries: Integers, out: Reals, c_K: float, c_C: float, size: int, A: Reals) -> None:
    """A += ∂/∂v̇ + c_C ∂/∂v + c_K ∂/∂x, ∂/∂λ and, beyond n + m, ∂/∂x."""
    n = S[RATES]
    n_v = S[PLACES]
    m = S[ROWS]
    for e in range(S[ENTRIES]):
        i = entries[e * PARTS + TARGET]
        j = entries[e * PARTS + COLUMN]
        if i >= 0 and j < n_v + 2 * n + m:
            value = out[entries[e * PARTS + PLACE]]
            if j < n_v:
                A[i * size + j] += c_K * value
                if size > n + m:
                    A[i * size + n + m + j] += value
            elif j < n_v + n:
                A[i * size + j - n_v] += c_C * value
            else:
                A[i * size + j - n_v - n] += value


def changes(S: Integers, entries: Integers, out: Reals, B: Reals, Z: Reals) -> None:
    """B −= the changes by Z of all that is no rate and no multiplier."""
    n = S[RATES]
    n_v = S[PLACES]
    for e in range(S[ENTRIES]):
        i = entries[e * PARTS + TARGET]
        j = entries[e * PARTS + COLUMN]
        if i >= 0 and (j < n_v + n or j >= n_v + 2 * n + S[ROWS]):
            add(B, i, -out[entries[e * PARTS + PLACE]], Z, j, S[WIDTH])


def metric(S: Integers, entries: Integers, out: Reals, c_K: float, c_C: float, M: Reals) -> None:
    """M += [S R; B̃ 0]: ``S = ∂r/∂v̇ + c_C ∂r/∂v + c_K ∂r/∂x``, ``B̃ = ∂ḣ/∂v + (c_K/c_C) ∂ḣ/∂x``."""
    n = S[RATES]
    n_v = S[PLACES]
    m = S[ROWS]
    size = n + m
    for e in range(S[ENTRIES]):
        i = entries[e * PARTS + EQUATION]
        j = entries[e * PARTS + COLUMN]
        if i < size and j < n_v + 2 * n + m:
            value = out[entries[e * PARTS + PLACE]]
            if j < n_v:
                M[i * size + j] += c_K / c_C * value if i >= n else c_K * value
            elif j < n_v + n:
                M[i * size + j - n_v] += value if i >= n else c_C * value
            elif i < n:
                M[i * size + j - n_v - n] += value


def saddle(S: Integers, entries: Integers, out: Reals, M: Reals) -> None:
    """M += [M R; B 0]: ``∂r/∂v̇``, ``∂r/∂λ``, ``B = ∂ḣ/∂v``."""
    n = S[RATES]
    n_v = S[PLACES]
    size = n + S[ROWS]
    for e in range(S[ENTRIES]):
        i = entries[e * PARTS + EQUATION]
        j = entries[e * PARTS + COLUMN]
        if i < n:
            if n_v + n <= j < n_v + n + size:
                M[i * size + j - n_v - n] += out[entries[e * PARTS + PLACE]]
        elif i < size and n_v <= j < n_v + n:
            M[i * size + j - n_v] += out[entries[e * PARTS + PLACE]]
