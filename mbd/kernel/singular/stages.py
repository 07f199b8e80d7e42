"""Stages of an implicit step on both sides of a singular configuration: each is held to its own rows.

Across the motion stages do not wait for each other: h = 0 makes y_i = 0 at each, ḣ = 0 makes ẏ_i = 0 (see
`mbd.kernel.singular`). So, at given rates W_i, positions go onto the rows by the correction U_i that is least in the
metric of M_i, multipliers are those that leave least of the balance, and s_i is the least change of velocities that
does away with ḣ:

    [M_i B_iᵀ; B_i 0] (U_i, ·) = −(0, h),   [M_i B_iᵀ; B_i 0] (s_i, ·) = −(0, ḣ),
    [M_i R_i; B_i 0] (·, λ_i) = −(M_i W_i + f_i, 0)

What is left is a correction of W_i along the motion, where everything is smooth, and of velocities by s_i: that of
Newton's method with the matrices of the middle stage, its rows ``B₂ δV_i = B₂ s_i`` and h left alone. It converges
linearly, the faster the shorter the step.
"""

from mbd.equal import HALF_PRECISION_RTOL
from mbd.kernel.algebra.ordered import solve_kkt
from mbd.kernel.algebra.redundancy import sharing
from mbd.kernel.algebra.saddle import factor_saddle
from mbd.kernel.codes import EPS, NOT_FINITE, PASSING, SINGULAR
from mbd.kernel.records import DependentRows, Kernel, Memory, Steps
from mbd.kernel.schemes.stage_layout import A2_, CHANGES, PAIR, STAGE_LAM, STAGE_RATES, STAGE_SHIFT, stage_place
from mbd.kernel.schemes.stages import hold_block, load_stage
from mbd.kernel.stepping.restart import compose, evaluate

MAX_STEPS_AWAY = 2.0
"""Steps to or from a singularity within which rows change too much from stage to stage for one matrix [-]."""
MAX_NOISY_STEPS_AWAY = 1000.0
"""The same within which round-off of rows may keep the residuals of a step with one matrix from falling [-]."""


def spans_singularity(K: DependentRows, h: float) -> bool:
    """Whether a step of size h goes over a singular configuration, or close by it."""
    return bool(K.near_singular == PASSING and K.loaded == 0 and not sharing(K)) or is_beside_singularity(
        K, h, MAX_STEPS_AWAY
    )


def is_beside_singularity(K: DependentRows, h: float, steps: float) -> bool:
    """Whether a step of size h lies so near to the singularity found last; not where loads are shared out."""
    away = K.singular_time - K.time
    return bool(-steps * h < away < (1.0 + steps) * h) and K.loaded == 0 and not sharing(K)


def solve_singular_stages(K: Kernel, h: float, t1: float, m: int, afresh: bool) -> int:
    """U_i and λ_i of all stages at their rates, s_i into the changes; 0, or a failure. The block is overwritten.

    Where not `afresh`, the last correction of rates has moved stages: U_i takes back what that is across their rows. So
    round-off of h, which is large across the motion, does not become another one each time, and stiff forces with it.
    """
    if not afresh:
        keep_moves(K, h, m)
    for i in range(3):
        status = solve_singular_stage(K, i, h, t1, m, afresh)
        if status != 0:
            return status
    hold_block(K)
    return 0


def keep_moves(K: Memory, h: float, m: int) -> None:
    """What the last correction of rates moves positions, ``h² Σ a²_ij ΔW_j``, in the place of the pair's matrix."""
    S = K.stages
    o_D = stage_place(K, CHANGES)
    o_P = stage_place(K, PAIR)
    for i in range(3):
        for j in range(K.n_v):
            move = 0.0
            for k in range(3):
                move += S[A2_ + 3 * i + k] * S[o_D + k * (K.n + m) + j]
            S[o_P + i * K.n_v + j] = h * h * move


def solve_singular_stage(K: Kernel, i: int, h: float, t1: float, m: int, afresh: bool) -> int:
    """The same of stage i."""
    n = K.n
    S = K.stages
    o_W = stage_place(K, STAGE_RATES) + i * n
    o_L = stage_place(K, STAGE_LAM) + i * K.n_rows
    o_s = stage_place(K, CHANGES) + i * (n + m)
    status = project_stage_positions(K, i, h, t1, m, afresh)
    if status != 0:
        return status
    K.rhs[:n] = 0.0
    for k in range(m):
        row = K.rows[k]
        rate = K.acc[K.acc_rate + row]
        below = not afresh and abs(rate) <= 16.0 * EPS * K.scale[n + K.n_rows + row]
        K.rhs[n + k] = 0.0 if below else -rate
    solve_kkt(K, n + m, K.rhs)
    S[o_s : o_s + n] = K.rhs[:n]
    if K.n_frictions > 0 and not factor_saddle(K, m, False, HALF_PRECISION_RTOL):
        return SINGULAR
    for j in range(n):
        load = K.acc[K.acc_f + j]
        for k in range(n):
            load += K.acc[j * n + k] * S[o_W + k]
        K.rhs[j] = -load
    K.rhs[n : n + m] = 0.0
    solve_kkt(K, n + m, K.rhs)
    for k in range(m):
        S[o_L + K.rows[k]] = K.rhs[n + k]
    return 0


def project_stage_positions(K: Kernel, i: int, h: float, t1: float, m: int, afresh: bool) -> int:
    """U_i, with K.acc at the stage and the factors of [M Bᵀ; B 0] there."""
    n = K.n
    o_U = stage_place(K, STAGE_SHIFT) + i * K.n_v
    for j in range(K.n_v):
        K.stages[o_U + j] *= 0.0 if afresh else 1.0
    before = 1e300
    for turn in range(8):  # Newton corrections of positions onto the rows of a stage; it takes one or two
        hold_block(K)
        load_stage(K, i, h, t1)
        compose(K, K.q1)
        K.y1[:n] = K.block[K.o_v : K.o_v + n]
        evaluate(K, K.block_time, K.q1, K.y1)
        size = 0.0
        for j in range(n):
            K.rhs[j] = 0.0
            if not abs(K.acc[K.acc_f + j]) < 1e300:
                return NOT_FINITE
        for k in range(m):
            row = K.rows[k]
            off = 0.0 if K.row_level[row] == 1 else K.acc[K.acc_h + row]
            if not abs(off) < 1e300:
                return NOT_FINITE
            K.rhs[n + k] = -off
            size = max(size, abs(off) / (16.0 * EPS * K.scale[n + row] + 1e-300))
        if not factor_saddle(K, m, True, HALF_PRECISION_RTOL):
            return SINGULAR
        if turn == 0 and not afresh:
            take_back(K, i, m)
        elif (turn > 0 and size <= 1.0) or size >= before:  # once more: what is left of h counts in velocities
            break
        else:
            before = size
        solve_kkt(K, n + m, K.rhs)
        for j in range(K.n_v):
            K.stages[o_U + j] += K.rhs[j]
    return 0


def take_back(K: Steps, i: int, m: int) -> None:
    """−B Δx into the right-hand side, with Δx what `keep_moves` kept of stage i."""
    n = K.n
    o_x = stage_place(K, PAIR) + i * K.n_v
    for k in range(m):
        row = K.rows[k]
        across = 0.0
        if K.row_level[row] == 0:
            for j in range(K.n_v):
                across += K.acc[K.acc_B + row * n + j] * K.stages[o_x + j]
        K.rhs[n + k] = -across


def replace_row_rates(K: Steps, o_r: int, m: int) -> None:
    """``−B₂ s_i`` in place of ḣ_i in the residuals, which begin at o_r; B₂ are the rows of the matrix in K.kkt."""
    size = K.n + m
    o_s = stage_place(K, CHANGES)
    for i in range(3):
        for k in range(m):
            total = 0.0
            for j in range(K.n):
                total -= K.kkt[(K.n + k) * size + j] * K.stages[o_s + i * size + j]
            K.stages[o_r + i * size + K.n + k] = total
