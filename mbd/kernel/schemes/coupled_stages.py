"""Newton's corrections of all stages at once, each with the matrices of its own.

One pair of matrices for all stages assumes that they differ little. They do not where friction that slides at the first
stage holds at the last, where a spring meets its stop within the step, or where bodies turn by radians. There

    M_i δW_i + h Σ a_ij C_i δW_j + h² Σ (A²)_ij K_i δW_j + R_i δλ_i = −r_i
    Σ a_ij B_i δW_j + h Σ (A²)_ij (∂ḣ/∂x)_i δW_j = −ḣ_i / h

is solved as it stands, with three times as many unknowns.
"""

from __future__ import annotations

from mbd.kernel.algebra.linear import factor, solve
from mbd.kernel.records import Kernel, Steps
from mbd.kernel.schemes.stage_layout import A2_, A_, BALANCES, CHANGES, MU_REAL, stage_place
from mbd.kernel.schemes.stage_matrices import tangent_of_stage
from mbd.kernel.schemes.stages import apply_changes, correct_positions_where_off, load_stage
from mbd.kernel.tangent_rules import is_differentiated, solve_plain

__all__ = ["correct_coupled_rates", "correct_coupled_stages", "couple_stages"]


def correct_coupled_stages(K: Kernel, m: int, h: float, t1: float, whole: bool) -> float:
    """One Newton correction of all stages; its size relative to the largest rate, 1e300 without factors.

    Positions are corrected as in `correct_stages`.
    """
    correct_positions_where_off(K, m, h, whole)
    couple_stages(K, m, h, t1)
    if factor(K.coupled, 3 * (K.n + m), K.coupled_pivots) != 0:
        return 1e300
    K.n_factorizations += 1
    return float(correct_coupled_rates(K, m, h))


def correct_coupled_rates(K: Steps, m: int, h: float) -> float:
    """The correction of rates and multipliers with the factors at hand; its size relative to the largest rate."""
    size = K.n + m
    o_r = stage_place(K, BALANCES)
    o_D = stage_place(K, CHANGES)
    for i in range(3):
        for j in range(size):
            r = K.stages[o_r + i * size + j]
            K.coupled_rhs[i * size + j] = -r if j < K.n else -r / h
    if is_differentiated():
        solve_plain(K.coupled, 3 * size, K.coupled_pivots, K.coupled_rhs, 0)
    else:
        solve(K.coupled, 3 * size, K.coupled_pivots, K.coupled_rhs)
    K.stages[o_D : o_D + 3 * size] = K.coupled_rhs[: 3 * size]
    return float(apply_changes(K, m))


def couple_stages(K: Kernel, m: int, h: float, t1: float) -> None:
    """The matrix of the module's equations, stage by stage, into K.coupled.

    With c = μh the compiled tangent gives ``F = M + c C + c² K`` and ``B + c ∂ḣ/∂x``, without K ``P = M + c C`` and B,
    at −c ``L = M − c C`` (see `stage_matrices.matrices`).
    """
    n = K.n
    size = n + m
    S = K.stages
    mu = S[MU_REAL]
    c = mu * h
    K.coupled[: 9 * size * size] = 0.0
    for i in range(3):
        for turn in range(3):
            load_stage(K, i, h, t1)
            K.block_c_C = -c if turn == 2 else c
            K.block_c_K = c * c if turn == 0 else 0.0
            tangent_of_stage(K, m)
            for j in range(3):
                own = 0.5 if i == j else 0.0
                damping = 0.5 * S[A_ + 3 * i + j] / mu
                stiffness = S[A2_ + 3 * i + j] / (mu * mu)
                part = stiffness  # of the balance
                row_part = mu * stiffness  # of rows
                if turn == 1:
                    part = own + damping - stiffness
                    row_part = S[A_ + 3 * i + j] - row_part
                elif turn == 2:
                    part = own - damping
                    row_part = 0.0
                for k in range(size):
                    weight = part if k < n else row_part
                    o = (i * size + k) * 3 * size + j * size
                    for other in range(n):
                        K.coupled[o + other] += weight * K.out[k * size + other]
                    if turn == 0 and i == j:
                        for other in range(n, size):
                            K.coupled[o + other] = K.out[k * size + other]
    K.n_tangents += 9
