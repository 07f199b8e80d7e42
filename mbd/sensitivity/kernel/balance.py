"""Consistent accelerations of one state with their derivatives (`mbd.sensitivity.balance`)."""

from __future__ import annotations

from mbd.kernel.algebra.linear import factor, solve
from mbd.kernel.hooks import call_on
from mbd.kernel.records import Integers, Model, Reals
from mbd.sensitivity.kernel.directions import clear, solve_all
from mbd.sensitivity.kernel.entries import balance, changes
from mbd.sensitivity.kernel.sizes import ALL_ROWS, AT_LAM, AT_RATE, RATES, ROWS, WIDTH

__all__ = ["consistent", "consistent_rates"]

SETTLED = 1e-12
"""Change of rates and multipliers, over the largest of them, after which they are known [-]."""
MOST = 8
"""Newton iterations for rates and multipliers; one or two where forces depend on multipliers linearly [-]."""


def consistent_rates(
    K: Model, S: Integers, rows: Integers, entries: Integers, block: Reals, out: Reals, Z: Reals, A: Reals, B: Reals,
    b: Reals, pivots: Integers,
) -> int:  # fmt: skip
    """`consistent` by program 0."""
    return consistent(K, 0, S, rows, entries, block, out, Z, A, B, b, pivots)


def consistent(
    K: Model, program: int, S: Integers, rows: Integers, entries: Integers, block: Reals, out: Reals, Z: Reals,
    A: Reals, B: Reals, b: Reals, pivots: Integers,
) -> int:  # fmt: skip
    """Rates and multipliers in the block become those of ``r = 0``, ``ḧ = 0``, B (n + m, D) their derivatives by Z.

    1 where the matrix is singular. `program` : the number of `consistent` among the programs
    """
    n = S[RATES]
    m = S[ROWS]
    size = n + m
    for _ in range(MOST):
        call_on(K, program, block, out)
        clear(A, size * size)
        balance(S, entries, out, 0.0, 0.0, size, A)
        for i in range(n):
            b[i] = out[i]
        for i in range(m):
            b[n + i] = out[n + rows[i]]
        if factor(A, size, pivots) != 0:
            return 1
        solve(A, size, pivots, b)
        step = 0.0
        largest = 1.0
        for i in range(n):
            block[S[AT_RATE] + i] -= b[i]
            step = max(step, abs(b[i]))
            largest = max(largest, abs(block[S[AT_RATE] + i]))
        for i in range(m):
            block[S[AT_LAM] + rows[i]] -= b[n + i]
            step = max(step, abs(b[n + i]))
        for i in range(S[ALL_ROWS]):
            largest = max(largest, abs(block[S[AT_LAM] + i]))
        if step <= SETTLED * largest:
            break
    clear(B, size * S[WIDTH])
    changes(S, entries, out, B, Z)
    solve_all(A, size, pivots, B, S[WIDTH])
    return 0
