"""LU factors of a small complex matrix, real and imaginary parts apart.

A complex N×N elimination takes half the operations of the real one of 2N × 2N, and the parts apart become vectors.
"""

from mbd.kernel.records import Reals
from mbd.kernel.tangent_rules import takes_part


def factor_complex(A: Reals, o: int, n: int, o_pivots: int) -> int:
    """LU factors in place of the matrix at A[o:], n² real parts and n² imaginary ones; 0, or 1 + the bad column.

    Inverse pivots are on the diagonal, numbers of the rows exchanged at A[o_pivots:].
    """
    o_im = o + n * n
    for k in range(n):
        p = k
        big = 0.0
        for i in range(k, n):
            size = abs(A[o + i * n + k]) + abs(A[o_im + i * n + k])
            if size > big:
                big = size
                p = i
        A[o_pivots + k] = float(p)
        if not (big > 1e-150 and big < 1e150):
            return k + 1
        if p != k:
            for j in range(n):
                swap = A[o + k * n + j]
                A[o + k * n + j] = A[o + p * n + j]
                A[o + p * n + j] = swap
                swap = A[o_im + k * n + j]
                A[o_im + k * n + j] = A[o_im + p * n + j]
                A[o_im + p * n + j] = swap
        re = A[o + k * n + k]
        im = A[o_im + k * n + k]
        size = re * re + im * im
        re /= size
        im = -im / size
        A[o + k * n + k] = re
        A[o_im + k * n + k] = im
        for i in range(k + 1, n):
            left = A[o + i * n + k] * re - A[o_im + i * n + k] * im
            left_im = A[o + i * n + k] * im + A[o_im + i * n + k] * re
            if takes_part(left) or takes_part(left_im):
                A[o + i * n + k] = left
                A[o_im + i * n + k] = left_im
                for j in range(k + 1, n):
                    above = A[o + k * n + j]
                    above_im = A[o_im + k * n + j]
                    A[o + i * n + j] -= left * above - left_im * above_im
                    A[o_im + i * n + j] -= left * above_im + left_im * above
    return 0


def solve_complex(plain_A: Reals, o: int, n: int, o_pivots: int, b: Reals, o_b: int) -> None:
    """b ← A⁻¹ b with the factors of `factor_complex`; b is at b[o_b:], n real parts and n imaginary ones."""
    o_im = o + n * n
    b_im = o_b + n
    for k in range(n):
        p = int(plain_A[o_pivots + k])
        if p != k:
            swap = b[o_b + k]
            b[o_b + k] = b[o_b + p]
            b[o_b + p] = swap
            swap = b[b_im + k]
            b[b_im + k] = b[b_im + p]
            b[b_im + p] = swap
    for k in range(n):
        re = b[o_b + k]
        im = b[b_im + k]
        for i in range(k + 1, n):
            b[o_b + i] -= plain_A[o + i * n + k] * re - plain_A[o_im + i * n + k] * im
            b[b_im + i] -= plain_A[o + i * n + k] * im + plain_A[o_im + i * n + k] * re
    for turn in range(n):
        k = n - 1 - turn
        re = b[o_b + k] * plain_A[o + k * n + k] - b[b_im + k] * plain_A[o_im + k * n + k]
        im = b[o_b + k] * plain_A[o_im + k * n + k] + b[b_im + k] * plain_A[o + k * n + k]
        b[o_b + k] = re
        b[b_im + k] = im
        for i in range(k):
            b[o_b + i] -= plain_A[o + i * n + k] * re - plain_A[o_im + i * n + k] * im
            b[b_im + i] -= plain_A[o + i * n + k] * im + plain_A[o_im + i * n + k] * re
