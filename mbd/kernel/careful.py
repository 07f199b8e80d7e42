"""The stabilized step where the shared factorization fails: near poses in which rows lose rank.

The quick iteration corrects positions with the matrix of the velocity rows, H = B + (c_K/c_C) G with G = ∂ḣ/∂x, which
is close to B as long as the smallest singular value of B exceeds dt |G|. Near a singular pose it does not. Here the
position correction uses B itself, and the velocity rows and the balance see its effect, G ΔU and K_t ΔU; both come from
a second tangent at c_K = 0, as S and H are affine in the factors.
"""

from __future__ import annotations

from typing import Any

from mbd.kernel.fields import EPS, FACTORIZATIONS, ITERATIONS, MODE, ROWS, TANGENTS
from mbd.kernel.hooks import call
from mbd.kernel.linear import factor, solve

__all__ = ["careful_correction"]


def careful_correction(K: Any, c_C: float, c_K: float) -> bool:
    """One Newton correction of the block with separate matrices for positions and velocities; false if singular.

    K.out holds the tangent and residuals of the iterate.
    """
    n = K.n
    m = K.state[ROWS]
    size = n + m
    tangent = K.mode_code[2 * K.state[MODE]]
    o_h = size * size + n
    moves = False
    for k in range(m):
        if abs(K.out[o_h + k]) > 16.0 * EPS * K.scale[n + K.rows[k]]:
            moves = True
    K.block[2] = 0.0
    call(K, tangent, K.spare)
    K.block[2] = c_K
    K.counts[TANGENTS] += 1
    for i in range(n):
        K.jump[i] = 0.0
    if moves and not position_change(K, n, m):
        return False
    for i in range(n):
        force = K.out[size * size + i]
        for j in range(K.n_v):
            force += (K.out[i * size + j] - K.spare[i * size + j]) * K.jump[j] / c_K
        K.rhs[i] = -force
    for k in range(m):
        rate = K.out[o_h + m + k] / c_C
        for j in range(K.n_v):
            rate += (K.out[(n + k) * size + j] - K.spare[(n + k) * size + j]) * K.jump[j] / c_K
        K.rhs[n + k] = -rate
    for k in range(size * size):
        K.kkt[k] = K.out[k]
    if factor(K.kkt, size, K.pivots) != 0:
        return False
    solve(K.kkt, size, K.pivots, K.rhs)
    K.counts[FACTORIZATIONS] += 2
    K.counts[ITERATIONS] += 1
    for i in range(n):
        K.block[K.o_a + i] += K.rhs[i]
        K.block[K.o_v + i] += c_C * K.rhs[i]
        if i < K.n_v:
            K.block[K.o_x + i] += c_K * K.rhs[i] + K.jump[i]
            K.shift1[i] += K.jump[i]
    for k in range(m):
        K.block[K.o_lam + K.rows[k]] += K.rhs[n + k]
    return True


def position_change(K: Any, n: int, m: int) -> bool:
    """ΔU in K.jump: the whole correction U = −S⁻¹ R ν with B U = −h(U = 0), less the one there is."""
    size = n + m
    o_h = size * size + n
    for i in range(n):
        K.rhs[i] = 0.0
        for j in range(size):
            K.kkt[i * size + j] = K.out[i * size + j]
    for k in range(m):
        h = K.out[o_h + k]
        for j in range(size):
            K.kkt[(n + k) * size + j] = K.spare[(n + k) * size + j]
        for j in range(K.n_v):
            h -= K.spare[(n + k) * size + j] * K.shift1[j]
        K.rhs[n + k] = -h
    if factor(K.kkt, size, K.pivots) != 0:
        return False
    solve(K.kkt, size, K.pivots, K.rhs)
    for i in range(K.n_v):
        K.jump[i] = K.rhs[i] - K.shift1[i]
    return True
