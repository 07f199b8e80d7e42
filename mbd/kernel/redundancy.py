"""Rows that depend on others: found in order, left out of the solve, their multipliers of least norm."""

from __future__ import annotations

from typing import Any

from mbd.kernel.fields import N_DROPPED
from mbd.kernel.linear import factor, solve

__all__ = ["find_dependent", "spread"]

DEPENDENCE = 1e-9
"""What is left of a row beside the earlier ones, relative, below which it depends on them [-]."""

LEAST_SHARE = 1e-4
"""Part of the largest limit of friction that even one without load counts as, where several hold together [-]."""


def find_dependent(K: Any, m: int) -> None:
    """Mark rows among the m in K.rows that depend on earlier ones in K.dropped, with B_d = C B_kept in K.mix.

    Gram–Schmidt in the order of the rows, on columns scaled by √M_ii; B is that of K.acc.
    """
    n = K.n
    o_B = n * n + n + n * K.n_rows
    kept = 0
    K.state[N_DROPPED] = 0
    for k in range(K.n_rows):
        K.dropped[k] = 0
    for k in range(m):
        row = K.rows[k]
        base = kept * n
        size = 0.0
        for j in range(n):
            weight = K.acc[j * n + j]
            K.basis[base + j] = K.acc[o_B + row * n + j] / (weight**0.5 if weight > 0.0 else 1.0)
            size += K.basis[base + j] * K.basis[base + j]
        for i in range(kept):
            K.lower[kept * K.n_rows + i] = 0.0
        for _ in range(2):
            for i in range(kept):
                part = 0.0
                for j in range(n):
                    part += K.basis[i * n + j] * K.basis[base + j]
                K.lower[kept * K.n_rows + i] += part
                for j in range(n):
                    K.basis[base + j] -= part * K.basis[i * n + j]
        left = 0.0
        for j in range(n):
            left += K.basis[base + j] * K.basis[base + j]
        if left > DEPENDENCE * DEPENDENCE * size and size > 0.0:
            left = left**0.5
            K.lower[kept * K.n_rows + kept] = left
            for j in range(n):
                K.basis[base + j] /= left
            K.columns[kept] = row
            kept += 1
            continue
        K.dropped[row] = 1
        K.state[N_DROPPED] += 1
        for i in range(K.n_rows):
            K.mix[row * K.n_rows + i] = 0.0
        for back in range(kept):  # c L = coefficients of the row in the basis
            i = kept - 1 - back
            value = K.lower[kept * K.n_rows + i]
            for j in range(i + 1, kept):
                value -= K.mix[row * K.n_rows + K.columns[j]] * K.lower[j * K.n_rows + i]
            K.mix[row * K.n_rows + K.columns[i]] = value / K.lower[i * K.n_rows + i]


def share(K: Any, row: int, largest: float) -> float:
    """Size W by which a multiplier counts: parallel frictions then share their load in the ratio of their limits."""
    f = K.row_friction[row]
    if f < 0 or largest == 0.0:
        return 1.0
    return float(max(K.limit[f] / largest, LEAST_SHARE))


def spread(K: Any, lam: Any) -> None:
    """The multipliers of least norm with the same forces: λ_d = y, λ_kept = μ − Cᵀ y.

    (W_d⁻¹ + C W⁻¹ Cᵀ) y = C W⁻¹ μ, with W of `share`.
    """
    count = 0
    for d in range(K.n_rows):
        if K.dropped[d] == 1:
            K.columns[count] = d
            count += 1
    if count == 0:
        return
    largest = 0.0
    for f in range(K.n_frictions):
        largest = max(largest, K.limit[f])
    for i in range(K.n_rows):
        if K.dropped[i] == 0:
            for d in range(count):
                lam[i] += K.mix[K.columns[d] * K.n_rows + i] * lam[K.columns[d]]
    for a in range(count):
        K.rhs[a] = 0.0
        for b in range(count):
            K.kkt[a * count + b] = 1.0 / share(K, K.columns[a], largest) if a == b else 0.0
        for i in range(K.n_rows):
            left = K.mix[K.columns[a] * K.n_rows + i]
            if K.dropped[i] == 1 or left == 0.0:
                continue
            left /= share(K, i, largest)
            K.rhs[a] += left * lam[i]
            for b in range(count):
                K.kkt[a * count + b] += left * K.mix[K.columns[b] * K.n_rows + i]
    if factor(K.kkt, count, K.pivots) != 0:
        return
    solve(K.kkt, count, K.pivots, K.rhs)
    for d in range(count):
        lam[K.columns[d]] = K.rhs[d]
        for i in range(K.n_rows):
            if K.dropped[i] == 0:
                lam[i] -= K.mix[K.columns[d] * K.n_rows + i] * K.rhs[d]
