"""Rows of derivatives in many directions: sums of them, and linear systems with many right sides."""

from __future__ import annotations

from mbd.kernel.records import Integers, Reals

__all__ = ["add", "clear", "solve_all"]


def clear(A: Reals, last: int) -> None:
    """Zeros up to a place."""
    for k in range(last):
        A[k] = 0.0


def add(A: Reals, i: int, part: float, B: Reals, k: int, width: int) -> None:
    """Row i of A plus `part` times row k of B; rows have a multiple of four places."""
    a = i * width
    b = k * width
    for j in range(0, width, 4):  # four at once, which become one instruction
        a0 = A[a + j] + part * B[b + j]
        a1 = A[a + j + 1] + part * B[b + j + 1]
        a2 = A[a + j + 2] + part * B[b + j + 2]
        a3 = A[a + j + 3] + part * B[b + j + 3]
        A[a + j] = a0
        A[a + j + 1] = a1
        A[a + j + 2] = a2
        A[a + j + 3] = a3


def solve_all(A: Reals, n: int, pivots: Integers, B: Reals, width: int) -> None:
    """B ← A⁻¹ B (n, width) with the factors of `mbd.kernel.algebra.linear.factor`."""
    for k in range(n):
        p = pivots[k]
        if p != k:
            for j in range(width):
                swap = B[k * width + j]
                B[k * width + j] = B[p * width + j]
                B[p * width + j] = swap
    for i in range(1, n):
        for k in range(i):
            if A[i * n + k] != 0.0:
                add(B, i, -A[i * n + k], B, k, width)
    for c in range(n):
        i = n - 1 - c
        for k in range(i + 1, n):
            if A[i * n + k] != 0.0:
                add(B, i, -A[i * n + k], B, k, width)
        for j in range(width):
            B[i * width + j] *= A[i * n + i]
