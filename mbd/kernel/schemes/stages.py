"""Stages of an implicit step at several points at once: their block, prediction, residuals and Newton correction.

With W_i the rates (v̇, ż) at the points c_i of a step of size h, and U_i corrections of positions,

    Y_i = y₀ + h Σ a_ij W_j,   X_i = h Σ a_ij V_j + U_i,   r(X_i, Y_i, W_i, λ_i) = 0,   h(X_i) = 0,   ḣ(X_i, V_i) = 0

Where positions do not add, D(X_j)⁻¹ V_j = V_j + E_j takes the place of V_j in X_i; E_j are found by iteration, which
Newton's matrices leave out.

U_i stay in the range of the rows in the metric of the Newton matrix, Z = the columns of its inverse that belong to
rows: with x' = v − Z η this is the stabilized form of Gear, Gupta & Leimkuhler (1985), whose metric may be any that is
held over the step. Newton's matrices are those of `stage_matrices`.
"""

from mbd.kernel.algebra.ordered import solve_held
from mbd.kernel.algebra.redundancy import sharing
from mbd.kernel.codes import EPS, INCREMENT_RATES
from mbd.kernel.contact.cones import fill_slips
from mbd.kernel.hooks import call
from mbd.kernel.records import Kernel, SingularSteps, Steps
from mbd.kernel.schemes.iteration import residual_size
from mbd.kernel.schemes.stage_layout import (
    A2_,
    A_,
    BALANCES,
    C_,
    CHANGES,
    HEIGHTS,
    HELD,
    MU_REAL,
    PAIR_RHS,
    STAGE_BEND,
    STAGE_LAM,
    STAGE_RATES,
    STAGE_SHIFT,
    STIFF_PART,
    T_IM,
    T_RE,
    T_REAL,
    stage_place,
)
from mbd.kernel.schemes.stage_matrices import matrices, solve_pair, solve_real
from mbd.kernel.stepping.restart import share_loads

MAX_EXTRAPOLATION = 4.0
"""Size of a step over that of the last above which its stages predict nothing: a parabola would go far astray [-]."""


def hold_block(K: SingularSteps) -> None:
    """What all stages of a step share, into the block: the center of the chart, anchors, sliding."""
    K.block[K.o_q : K.o_q + K.n_q] = K.q[: K.n_q]
    K.block[K.o_anchor : K.o_anchor + K.n_anchors] = K.anchors[: K.n_anchors]
    fill_slips(K)
    if K.vector == 0:
        o_E = stage_place(K, STAGE_BEND)
        K.stages[o_E : o_E + 3 * K.n_v] = 0.0


def predict_stages(K: Steps, h: float, m: int) -> None:
    """W_i, λ_i and U_i from the parabola through those of the last step, as they are now after one far shorter."""
    S = K.stages
    P = K.past_stages
    n = K.n
    o_W = stage_place(K, STAGE_RATES)
    o_L = stage_place(K, STAGE_LAM)
    o_U = stage_place(K, STAGE_SHIFT)
    stretch = h / K.aux_step
    for i in range(3):
        s = 1.0 + stretch * S[C_ + i]
        l0 = (s - S[C_ + 1]) * (s - S[C_ + 2]) / ((S[C_] - S[C_ + 1]) * (S[C_] - S[C_ + 2]))
        l1 = (s - S[C_]) * (s - S[C_ + 2]) / ((S[C_ + 1] - S[C_]) * (S[C_ + 1] - S[C_ + 2]))
        l2 = 1.0 - l0 - l1
        if stretch > MAX_EXTRAPOLATION:
            l0 = 0.0
            l1 = 0.0
            l2 = 1.0
        for j in range(n):
            S[o_W + i * n + j] = l0 * P[j] + l1 * P[n + j] + l2 * P[2 * n + j]
        S[o_L + i * K.n_rows : o_L + i * K.n_rows + K.n_rows] = K.lam[: K.n_rows]
        for k in range(m):
            row = K.rows[k]
            o = 3 * n + row
            S[o_L + i * K.n_rows + row] = l0 * P[o] + l1 * P[o + K.n_rows] + l2 * P[o + 2 * K.n_rows]
        o = 3 * n + 3 * K.n_rows + i * K.n_v
        for j in range(K.n_v):
            shift = stretch * stretch * stretch * stretch * P[o + j]
            S[o_U + i * K.n_v + j] = shift if stretch <= MAX_EXTRAPOLATION else 0.0


def load_stage(K: Kernel, i: int, h: float, t1: float) -> None:
    """Stage i into the block."""
    if K.vector == 0:
        bend_stages(K, h)
    load_state(K, i, h)
    S = K.stages
    o_L = stage_place(K, STAGE_LAM) + i * K.n_rows
    K.block[0] = t1 if i == 2 else K.time + S[C_ + i] * h
    K.block[K.o_lam : K.o_lam + K.n_rows] = S[o_L : o_L + K.n_rows]
    if sharing(K):
        share_loads(K, K.n_active, False)


def load_state(K: Steps, i: int, h: float) -> None:
    """X_i, Y_i and W_i into the block."""
    S = K.stages
    n = K.n
    block = K.block
    o_W = stage_place(K, STAGE_RATES)
    o_U = stage_place(K, STAGE_SHIFT) + i * K.n_v
    for j in range(n):
        w0 = S[o_W + j]
        w1 = S[o_W + n + j]
        w2 = S[o_W + 2 * n + j]
        block[K.o_a + j] = S[o_W + i * n + j]
        block[K.o_v + j] = K.y[j] + h * (S[A_ + 3 * i] * w0 + S[A_ + 3 * i + 1] * w1 + S[A_ + 3 * i + 2] * w2)
        if j < K.n_v:
            bend = S[A2_ + 3 * i] * w0 + S[A2_ + 3 * i + 1] * w1 + S[A2_ + 3 * i + 2] * w2
            block[K.o_x + j] = h * (S[C_ + i] * K.y[j] + h * bend) + S[o_U + j]
    if K.vector == 0:
        o_E = stage_place(K, STAGE_BEND)
        for j in range(K.n_v):
            for k in range(3):
                block[K.o_x + j] += h * S[A_ + 3 * i + k] * S[o_E + k * K.n_v + j]


def bend_stages(K: Steps, h: float) -> None:
    """E_j of all stages at their rates, by iteration; it takes as many rounds as the increments are large."""
    o_E = stage_place(K, STAGE_BEND)
    # rounds of the iteration for E_j: it converges by a factor of half the largest increment or so
    for _ in range(60):
        change = 0.0
        speed = 0.0
        for i in range(3):
            load_state(K, i, h)
            call(K, INCREMENT_RATES, K.spare)
            for j in range(K.n_v):
                bend = K.spare[j] - K.block[K.o_v + j]
                change = max(change, abs(bend - K.stages[o_E + i * K.n_v + j]))
                speed = max(speed, abs(K.spare[j]))
                K.stages[o_E + i * K.n_v + j] = bend
        if not change > 4.0 * EPS * speed:  # NaN ends it too: the stage tells
            return


def evaluate_stages(
    K: Kernel, h: float, t1: float, m: int, tolerance: float, c_C: float, c_K: float, renew: bool
) -> float:
    """r, ḣ and h of all stages into K.stages; the largest over its tolerance (see `residual_size`), −1 if not finite.

    With `renew` the matrices are those of the middle stage.
    """
    n = K.n
    largest = 0.0
    o_r = stage_place(K, BALANCES)
    o_h = stage_place(K, HEIGHTS)
    for i in range(3):
        load_stage(K, i, h, t1)
        o = 0
        if renew and i == 1:
            matrices(K, m, h)
            o = (n + m) * (n + m)
        else:
            call(K, K.residual_program, K.out)
            K.n_residuals += 1
        size = residual_size(K, o, m, c_C, c_K, tolerance, 1)
        if size < 0.0:  # the stage stays in the block, which tells why
            return -1.0
        largest = max(largest, size)
        K.stages[o_r + i * (n + m) : o_r + i * (n + m) + n] = K.out[o : o + n]
        for k in range(m):
            K.stages[o_h + i * m + k] = K.out[o + n + k]
            K.stages[o_r + i * (n + m) + n + k] = K.out[o + n + m + k]
    return largest


def is_off(K: Steps, m: int) -> bool:
    """Whether rows on positions are above round-off at a stage: below, correcting would only stir the velocities."""
    o_h = stage_place(K, HEIGHTS)
    for i in range(3):
        for k in range(m):
            row = K.rows[k]
            if K.row_level[row] == 0 and abs(K.stages[o_h + i * m + k]) > 16.0 * EPS * K.scale[K.n + row]:
                return True
    return False


def correct_positions_of_stages(K: Steps, m: int, h: float, whole: bool) -> None:
    """New U_i; what they change of ḣ and of the balance, the rates make good in the same iteration.

    What is left of h once the rates have done away with ḣ at all stages, ``h_i − h Σ a_ij ḣ_j``, is theirs.
    """
    n = K.n
    n_v = K.n_v
    size = n + m
    S = K.stages
    o_r = stage_place(K, BALANCES)
    o_h = stage_place(K, HEIGHTS)
    o_H = stage_place(K, HELD)
    o_U = stage_place(K, STAGE_SHIFT)
    for i in range(3):  # the rates of rows are used before they change
        for k in range(m):
            goal = 0.0
            if K.row_level[K.rows[k]] == 0:
                goal = -S[o_h + i * m + k]
                for j in range(3):
                    goal += h * S[A_ + 3 * i + j] * S[o_r + j * size + n + k]
                if whole:
                    goal += S[o_H + i * m + k]
            S[o_h + i * m + k] = goal
    o_K = stage_place(K, STIFF_PART)
    c = S[MU_REAL] * h
    for i in range(3):
        K.work[:n] = 0.0
        K.work[n : n + m] = S[o_h + i * m : o_h + i * m + m]
        solve_held(K, size, K.work)
        for j in range(n_v):
            before = S[o_U + i * n_v + j]
            S[o_U + i * n_v + j] = K.work[j] if whole else before + K.work[j]
            K.work[j] = S[o_U + i * n_v + j] - before
        for k in range(m):
            for j in range(n_v):
                S[o_r + i * size + n + k] += K.turning[k * n_v + j] * K.work[j]
        for k in range(n):
            pulled = 0.0
            for j in range(n_v):
                pulled += S[o_K + k * n + j] * K.work[j]
            S[o_r + i * size + k] += pulled / (c * c)


def correct_stages(K: SingularSteps, m: int, h: float, whole: bool) -> float:
    """One simplified Newton correction of all stages; its size relative to the largest rate."""
    correct_positions_where_off(K, m, h, whole)
    return correct_rates(K, m, h)


def correct_positions_where_off(K: Steps, m: int, h: float, whole: bool) -> None:
    """`correct_positions_of_stages` where rows act, as a whole or where they are above round-off."""
    if m > 0 and (whole or is_off(K, m)):
        correct_positions_of_stages(K, m, h, whole)


def correct_rates(K: SingularSteps, m: int, h: float) -> float:
    """The correction of rates and multipliers by the residuals in K.stages; its size relative to the largest rate."""
    size = K.n + m
    S = K.stages
    solve_real(K, m, h)
    solve_pair(K, m, h)
    o_D = stage_place(K, CHANGES)
    o_b = stage_place(K, PAIR_RHS)
    for i in range(3):
        for j in range(size):
            change = S[T_REAL + i] * K.rhs[j] + 2.0 * (S[T_RE + i] * S[o_b + j] - S[T_IM + i] * S[o_b + size + j])
            S[o_D + i * size + j] = change
    return apply_changes(K, m)


def apply_changes(K: SingularSteps, m: int) -> float:
    """The correction in K.stages to rates and multipliers; its size relative to the largest rate."""
    n = K.n
    size = n + m
    S = K.stages
    o_W = stage_place(K, STAGE_RATES)
    o_L = stage_place(K, STAGE_LAM)
    o_D = stage_place(K, CHANGES)
    K.n_iterations += 1
    biggest = 0.0
    fastest = 1e-300
    for i in range(3):
        for j in range(size):
            change = S[o_D + i * size + j]
            if j < n:
                biggest = max(biggest, abs(change))
                fastest = max(fastest, abs(S[o_W + i * n + j]))
                S[o_W + i * n + j] += change
            else:
                change_multiplier(K, o_L + i * K.n_rows, K.rows[j - n], change)
    return biggest / fastest


def retreat_stages(K: SingularSteps, m: int, part: float) -> None:
    """Take back a part of the last correction of rates and multipliers; all, 1, and then −1 does it again."""
    n = K.n
    size = n + m
    S = K.stages
    o_W = stage_place(K, STAGE_RATES)
    o_L = stage_place(K, STAGE_LAM)
    o_D = stage_place(K, CHANGES)
    for i in range(3):
        for j in range(size):
            change = part * S[o_D + i * size + j]
            if part == 0.5:
                S[o_D + i * size + j] = change
            if j < n:
                S[o_W + i * n + j] -= change
            else:
                change_multiplier(K, o_L + i * K.n_rows, K.rows[j - n], -change)


def keep_shared_loads(K: Kernel, h: float, t1: float) -> None:
    """Multipliers of dependent rows at all stages as loads are shared now: those which a correction changes."""
    for i in range(3):
        load_stage(K, i, h, t1)
        o_L = stage_place(K, STAGE_LAM) + i * K.n_rows
        K.stages[o_L : o_L + K.n_rows] = K.block[K.o_lam : K.o_lam + K.n_rows]


def change_multiplier(K: SingularSteps, o: int, row: int, change: float) -> None:
    """Add to the multiplier of a row in K.stages from o on, and to those of dependent rows what they share of it."""
    K.stages[o + row] += change
    if sharing(K):
        for d in range(K.n_rows):
            if K.dropped[d] == 1:
                K.stages[o + d] += K.shares[d * K.n_rows + row] * change
