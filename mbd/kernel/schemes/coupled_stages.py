"""Newton's corrections of all stages at once, each with the matrices of its own.

One pair of matrices for all stages assumes that they differ little. They do not where friction that slides at the first
stage holds at the last, where a spring meets its stop within the step, or where bodies turn by radians. There

    M_i δW_i + h Σ a_ij C_i δW_j + h² Σ (A²)_ij K_i δW_j + R_i δλ_i = −r_i
    Σ a_ij B_i δW_j + h Σ (A²)_ij (∂ḣ/∂x)_i δW_j = −ḣ_i / h

is solved as it stands, with three times as many unknowns.
"""

from mbd.kernel.algebra.linear import factor, solve
from mbd.kernel.algebra.redundancy import sharing
from mbd.kernel.codes import NOT_CONVERGED, NOT_FINITE, SINGULAR
from mbd.kernel.records import Kernel, Memory, SingularSteps, Steps
from mbd.kernel.schemes.iteration import MAX_ITERATIONS, MAX_RATE_ERROR, MIN_RATE_SHARE, note_fastest
from mbd.kernel.schemes.radau_end import complete
from mbd.kernel.schemes.stage_layout import A2_, A_, BALANCES, CHANGES, E_, MU_REAL, STAGE_RATES, stage_place
from mbd.kernel.schemes.stage_matrices import factor_stages, tangent_of_stage
from mbd.kernel.schemes.stages import (
    apply_changes,
    correct_positions_where_off,
    evaluate_stages,
    hold_block,
    keep_shared_loads,
    load_stage,
    predict_stages,
    retreat_stages,
)
from mbd.kernel.tangent_rules import is_differentiated, solve_plain

MIN_CORRECTION_PART = 1e-3
"""Part of a correction below which none reduces the residuals [-]."""
MIN_DECREASE = 0.1
"""Part of the residual that a correction removes at least, for each part of it that is made (Armijo 1966) [-]."""


def coupled_step(K: Kernel, h: float, t1: float, m: int) -> int:
    """The candidate of a step whose stages are corrected at once by Newton's method, each with matrices of its own.

    Of a correction that does not reduce the residuals a part is made.
    """
    c = K.stages[MU_REAL] * h
    hold_block(K)
    predict_stages(K, h, m)
    K.near_singular = 0
    K.failure_time = t1
    K.failure_step = h
    left = 1e300
    for iteration in range(MAX_ITERATIONS):
        tolerance = 1e-3 * K.tolerance
        error = evaluate_stages(K, h, t1, m, tolerance, c, c * c, True)
        part = 1.0 if iteration > 0 else 0.0
        while part > MIN_CORRECTION_PART and (
            error < 0.0 or (error > 1.0 and error > (1.0 - MIN_DECREASE * part) * left)
        ):
            part *= 0.5
            retreat_stages(K, m, 0.5)
            error = evaluate_stages(K, h, t1, m, tolerance, c, c * c, True)
        if error < 0.0:
            return NOT_FINITE
        K.failure_size = error
        if error <= 1.0 or 0.0 < part <= MIN_CORRECTION_PART:
            if evaluate_stages(K, h, t1, m, K.tolerance, c, c * c, True) <= 1.0:
                status = complete(K, h, t1, m, True, True)
                return NOT_CONVERGED if status == 0 and is_another_solution(K, h) else status
            return NOT_CONVERGED
        left = error
        if not factor_stages(K, K.n + m):
            return SINGULAR
        correct_positions_where_off(K, m, h, True)
        couple_stages(K, m, h, t1)
        if factor(K.coupled, 3 * (K.n + m), K.coupled_pivots) != 0:
            return SINGULAR
        K.n_factorizations += 1
        if sharing(K):
            keep_shared_loads(K, h, t1)
        correct_coupled_rates(K, m, h)
    return NOT_CONVERGED


def is_another_solution(K: Steps, h: float) -> bool:
    """Whether accelerations at the start have little to do with those of the stages, so that any solution may be found.

    ``μ h v̇₀ + Σ e_i (V_i − v₀)``, the embedded estimate of the error of v without its filter, is over `MAX_RATE_ERROR`
    of a rate: stiff components count.
    """
    S = K.stages
    o_W = stage_place(K, STAGE_RATES)
    note_fastest(K, True)
    for j in range(K.n):
        error = S[MU_REAL] * h * K.rate[j]
        for i in range(3):
            for k in range(3):
                error += S[E_ + i] * h * S[A_ + 3 * i + k] * S[o_W + k * K.n + j]
        size = max(K.rest_speed, MIN_RATE_SHARE * K.fastest[K.cluster[j]])
        if abs(error) > MAX_RATE_ERROR * max(size, max(abs(K.y[j]), abs(K.y1[j]))):
            return True
    return False


def correct_coupled_rates(K: SingularSteps, m: int, h: float) -> float:
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
    c = K.stages[MU_REAL] * h
    K.coupled[: 9 * size * size] = 0.0
    for i in range(3):
        for turn in range(3):
            load_stage(K, i, h, t1)
            K.block_c_C = -c if turn == 2 else c
            K.block_c_K = c * c if turn == 0 else 0.0
            tangent_of_stage(K, m)
            for j in range(3):
                part = stage_weight(K, i, j, turn, False)
                row_part = stage_weight(K, i, j, turn, True)
                for k in range(size):
                    weight = part if k < n else row_part
                    o = (i * size + k) * 3 * size + j * size
                    for other in range(n):
                        K.coupled[o + other] += weight * K.out[k * size + other]
                    if turn == 0 and i == j:
                        for other in range(n, size):
                            K.coupled[o + other] = K.out[k * size + other]
    K.n_tangents += 9


def stage_weight(K: Memory, i: int, j: int, turn: int, is_row: bool) -> float:
    """What F, P or L of stage i (turn 0, 1, 2) weighs in its balance, or its rows, by changes of stage j."""
    S = K.stages
    mu = S[MU_REAL]
    slope = S[A_ + 3 * i + j]
    stiffness = S[A2_ + 3 * i + j] / (mu * mu)
    if is_row:
        return float(mu * stiffness if turn == 0 else (slope - mu * stiffness if turn == 1 else 0.0))
    if turn == 0:
        return float(stiffness)
    own = 0.5 if i == j else 0.0
    damping = 0.5 * slope / mu
    return float(own + damping - stiffness if turn == 1 else own - damping)
