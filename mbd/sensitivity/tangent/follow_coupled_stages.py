"""The derivatives of all stages of an implicit step from one linear system, where its matrix is the derivative itself.

With the unknowns δW_i, δλ_i and δη_i of each stage, and positions corrected by ``U_i = h² Z η_i`` with Z held,

    M_i δW_i + h Σ a_ij C_i δW_j + h² Σ (A²)_ij K_i δW_j + R_i δλ_i + h² K_i Z δη_i = −δr_i
    Σ a_ij B_i δW_j + h Σ (A²)_ij (∂ḣ/∂x)_i δW_j + h (∂ḣ/∂x)_i Z δη_i = −δḣ_i / h
    Σ (A²)_ij B_i δW_j + B_i Z δη_i = −δh_i / h²

"""

from mbd.kernel.algebra.linear import factor
from mbd.kernel.algebra.ordered import solve_held
from mbd.kernel.records import Kernel
from mbd.kernel.schemes.coupled_stages import stage_weight
from mbd.kernel.schemes.stage_layout import (
    A2_,
    BALANCES,
    CHANGES,
    HEIGHTS,
    MU_REAL,
    STAGE_SHIFT,
    stage_place,
)
from mbd.kernel.schemes.stage_matrices import factor_stages, matrices, tangent_of_stage
from mbd.kernel.schemes.stages import apply_changes, load_stage
from mbd.sensitivity.tangent.words import metric_place, solve_plain, without_tangent

MAX_COUPLED = 96
"""Unknowns of all stages up to which one elimination takes less time than corrections stage by stage [-]."""


def follow_coupled_stages(K: Kernel, m: int, h: float) -> None:
    """The derivatives of the stages with the factors at hand, from residuals with derivatives in K.stages."""
    n = K.n
    size = n + m
    each = size + m
    S = K.stages
    o_r = stage_place(K, BALANCES)
    o_h = stage_place(K, HEIGHTS)
    for i in range(3):
        for j in range(size):
            r = S[o_r + i * size + j]
            K.coupled_rhs[i * each + j] = -r if j < n else -r / h
        for k in range(m):
            held = K.row_level[K.rows[k]] == 1
            K.coupled_rhs[i * each + size + k] = 0.0 if held else -S[o_h + i * m + k] / (h * h)
    solve_plain(K.coupled, 3 * each, K.coupled_pivots, K.coupled_rhs, 0)
    o_D = stage_place(K, CHANGES)
    o_U = stage_place(K, STAGE_SHIFT)
    o_Z = metric_of_stages(K)
    for i in range(3):
        S[o_D + i * size : o_D + i * size + size] = K.coupled_rhs[i * each : i * each + size]
        for j in range(K.n_v if m > 0 else 0):
            total = 0.0
            for k in range(m):
                total += without_tangent(K.starts[o_Z + k * K.n_v + j]) * K.coupled_rhs[i * each + size + k]
            S[o_U + i * K.n_v + j] = without_tangent(S[o_U + i * K.n_v + j]) + h * h * total
    apply_changes(K, m)


def metric_of_stages(K: Kernel) -> int:
    """Where what positions of stages are corrected with begins in K.starts, behind the values of the stages."""
    return int(metric_place(K) + 3 * (K.n + K.n_rows + K.n_v) + 3 * K.n_v)


def prepare_coupled_stages(K: Kernel, m: int, h: float, t1: float) -> bool:
    """Factors of the matrix of the module's equations, and Z in K.starts; false where a pivot is missing."""
    if m > 0 and not prepare_metric_of_stages(K, m, h, t1):
        return False
    fill_coupled(K, m, h, t1)
    return bool(factor(K.coupled, 3 * (K.n + 2 * m), K.coupled_pivots) == 0)


def prepare_metric_of_stages(K: Kernel, m: int, h: float, t1: float) -> bool:
    """Z (m × n_v), the columns of rows in the inverse of the matrix of the middle stage; false if it is singular."""
    load_stage(K, 1, h, t1)
    matrices(K, m, h)
    size = K.n + m
    if not factor_stages(K, size):
        return False
    o_Z = metric_of_stages(K)
    for k in range(m):
        K.work[:size] = 0.0
        K.work[K.n + k] = 1.0 if K.row_level[K.rows[k]] == 0 else 0.0
        solve_held(K, size, K.work)
        o = o_Z + k * K.n_v
        K.starts[o : o + K.n_v] = K.work[: K.n_v]
    return True


def fill_coupled(K: Kernel, m: int, h: float, t1: float) -> None:
    """The matrix, stage by stage, of the compiled tangents that `coupled_stages.couple_stages` describes."""
    n = K.n
    size = n + m
    each = size + m
    whole = 3 * each
    S = K.stages
    mu = S[MU_REAL]
    c = mu * h
    o_Z = metric_of_stages(K)
    K.coupled[: whole * whole] = 0.0
    for i in range(3):
        load_stage(K, i, h, t1)
        for turn in range(3):
            K.block_c_C = -c if turn == 2 else c
            K.block_c_K = c * c if turn == 0 else 0.0
            tangent_of_stage(K, m)
            for j in range(3):
                part = stage_weight(K, i, j, turn, False)
                row_part = stage_weight(K, i, j, turn, True)
                for k in range(size):
                    weight = part if k < n else row_part
                    o = (i * each + k) * whole + j * each
                    for other in range(n):
                        K.coupled[o + other] += weight * K.out[k * size + other]
                    if turn == 0 and i == j:
                        for other in range(n, size):
                            K.coupled[o + other] = K.out[k * size + other]
                    if turn == 1 and k >= n and K.row_level[K.rows[k - n]] == 0:
                        o += m * whole
                        for other in range(K.n_v):
                            K.coupled[o + other] = S[A2_ + 3 * i + j] * K.out[k * size + other]
            if turn == 2:
                continue
            sign = 1.0 if turn == 0 else -1.0
            for k in range(size):
                o = (i * each + k) * whole + i * each + size
                weight = sign / (mu * mu) if k < n else sign / mu
                for e in range(m):
                    pulled = 0.0
                    for other in range(K.n_v):
                        pulled += K.out[k * size + other] * K.starts[o_Z + e * K.n_v + other]
                    K.coupled[o + e] += weight * pulled
                    if turn == 1 and k >= n:
                        K.coupled[o + m * whole + e] = pulled
        for k in range(m):
            if K.row_level[K.rows[k]] == 1:  # such rows have no positions
                o = (i * each + size + k) * whole + i * each + size
                for e in range(m):
                    K.coupled[o + e] = 1.0 if e == k else 0.0
