"""Stages of an implicit step at several points at once: their block, prediction, residuals and Newton correction.

With W_i the rates (v̇, ż) at the points c_i of a step of size h, and U_i corrections of positions,

    Y_i = y₀ + h Σ a_ij W_j,   X_i = h Σ a_ij V_j + U_i,   r(X_i, Y_i, W_i, λ_i) = 0,   h(X_i) = 0,   ḣ(X_i, V_i) = 0

Where positions do not add, D(X_j)⁻¹ V_j = V_j + E_j takes the place of V_j in X_i; E_j are found by iteration, which
Newton's matrices leave out.

U_i stay in the range of the rows in the metric of the Newton matrix, Z = the columns of its inverse that belong to
rows: with x' = v − Z η this is the stabilized form of Gear, Gupta & Leimkuhler (1985), whose metric may be any that is
held over the step. Newton's matrices come from one transformation of A = (a_ij) (Hairer & Wanner 1996, IV.8): for each
eigenvalue μ of A the matrix of a one-stage step with ∂v/∂v̇ = hμ and ∂x/∂v̇ = (hμ)². The real one is the compiled
tangent itself; that of the pair is put together from three of them.
"""

from __future__ import annotations

from mbd.kernel.codes import EPS, INCREMENT_RATES, PASSING
from mbd.kernel.complex_linear import factor_complex, solve_complex
from mbd.kernel.hooks import call
from mbd.kernel.linear import factor
from mbd.kernel.ordered import LOSS_OF_STEP, OF_TANGENT, factor_ordered, order_at, solve_kkt
from mbd.kernel.ordered_complex import factor_pair_ordered, solve_pair_ordered
from mbd.kernel.records import DependentRows, Kernel, Settings, SingularSteps, Steps
from mbd.kernel.redundancy import sharing
from mbd.kernel.restart import add_shares, share_loads
from mbd.kernel.schemes.iteration import residual_size

__all__ = [
    "correct_rates", "correct_stages", "evaluate_stages", "factor_stages", "hold_block", "load_stage", "matrices",
    "predict_stages", "retreat_stages", "stage_place",
]  # fmt: skip

# where the numbers of the method lie in K.stages (see `mbd.kernel.schemes.collocation`)
C_, A_, A2_, MU_REAL, MU_RE, MU_IM, T_REAL, S_REAL, T_RE, T_IM, S_RE, S_IM, E_, N_NUMBERS = (
    0, 3, 12, 21, 22, 23, 24, 27, 30, 33, 36, 39, 42, 45,
)  # fmt: skip
# parts of K.stages behind them
(
    STAGE_RATES, STAGE_LAM, STAGE_SHIFT, CHANGES, BALANCES, HEIGHTS, HELD, MASS_PART, STIFF_PART, PAIR, PAIR_PIVOTS,
    PAIR_RHS, STAGE_BEND, STAGES_END,
) = range(14)  # fmt: skip


MOST_BENDS = 60
"""Rounds of the iteration for E_j: it converges by a factor of half the largest increment or so [-]."""
MOST_STRETCHED = 4.0
"""Size of a step over that of the last above which its stages predict nothing: a parabola would go far astray [-]."""


def stage_place(K: Settings, part: int) -> int:
    """Where a part of K.stages begins.

    W (3, n) | λ (3, rows) | U (3, n_v) | last changes of W and λ | r and ḣ of each stage | h | H U | M | c² K |
    complex matrix | its pivots | its right-hand side | E (3, n_v) where positions do not add
    """
    size = K.n + K.n_rows
    place = N_NUMBERS
    if part > STAGE_RATES:
        place += 3 * K.n
    if part > STAGE_LAM:
        place += 3 * K.n_rows
    if part > STAGE_SHIFT:
        place += 3 * K.n_v
    if part > CHANGES:
        place += 3 * size
    if part > BALANCES:
        place += 3 * size
    if part > HEIGHTS:
        place += 3 * K.n_rows
    if part > HELD:
        place += 3 * K.n_rows
    if part > MASS_PART:
        place += K.n * K.n
    if part > STIFF_PART:
        place += K.n * K.n
    if part > PAIR:
        place += 2 * size * size
    if part > PAIR_PIVOTS:
        place += size
    if part > PAIR_RHS:
        place += 2 * size
    if part > STAGE_BEND and K.vector == 0:
        place += 3 * K.n_v
    return int(place)


def hold_block(K: SingularSteps) -> None:
    """What all stages of a step share, into the block: the center of the chart, anchors, sliding."""
    K.block[K.o_q : K.o_q + K.n_q] = K.q[: K.n_q]
    K.block[K.o_anchor : K.o_anchor + K.n_anchors] = K.anchors[: K.n_anchors]
    K.block[K.o_slip : K.o_slip + K.n_frictions] = K.slip[: K.n_frictions]
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
        if stretch > MOST_STRETCHED:
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
            S[o_U + i * K.n_v + j] = shift if stretch <= MOST_STRETCHED else 0.0


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
        share_loads(K, K.n_active)


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
    for _ in range(MOST_BENDS):
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


def matrices(K: SingularSteps, m: int, h: float) -> None:
    """The real and the complex matrix at the block, whose r, h and ḣ stay in K.out.

    ``P(c) = M + c C + c² K`` and the rows ``B + c ∂ḣ/∂x``: at c = μh, (c, 0) and (−c, 0) the compiled tangent gives
    ``M + c C + c² K``, ``M + c C`` and ``M − c C``. Next to a singular configuration they are B alone.
    """
    n = K.n
    size = n + m
    S = K.stages
    c = S[MU_REAL] * h
    o_M = stage_place(K, MASS_PART)
    o_K = stage_place(K, STIFF_PART)
    o_P = stage_place(K, PAIR)
    K.block_c_C = c
    K.block_c_K = c * c
    tangent_of_stage(K, m)
    K.kkt[: size * size] = K.out[: size * size]
    K.turning[: m * K.n_v] = K.out[size * size + n + 2 * m : size * size + n + 2 * m + m * K.n_v]
    K.block_c_K = 0.0
    tangent_of_stage(K, m)
    S[o_P : o_P + size * size] = K.out[: size * size]
    K.block_c_C = -c
    tangent_of_stage(K, m)
    K.n_tangents += 3
    inverse = 1.0 / S[MU_REAL]
    re = S[MU_RE] * inverse
    im = S[MU_IM] * inverse
    for i in range(size):
        for j in range(size):
            k = i * size + j
            full = K.kkt[k]
            part = S[o_P + k]
            if i >= n:
                if K.near_singular == PASSING:
                    K.kkt[k] = part
                    full = part
                S[o_P + k] = part + re * (full - part)
                S[o_P + size * size + k] = im * (full - part)
                continue
            mass = 0.5 * (part + K.out[k])
            damping = 0.5 * (part - K.out[k])
            stiffness = full - part
            S[o_P + k] = mass + re * damping + (re * re - im * im) * stiffness
            S[o_P + size * size + k] = im * damping + 2.0 * re * im * stiffness
            if j < n:
                S[o_M + i * n + j] = mass
                S[o_K + i * n + j] = stiffness
    keep_held(K, m)


def tangent_of_stage(K: DependentRows, m: int) -> None:
    """The tangent at the block in K.out, with what dependent rows bear where a friction slides."""
    call(K, K.tangent_program, K.out)
    if sharing(K):
        add_shares(K, K.out, m)


def keep_held(K: Steps, m: int) -> None:
    """H U_i with the new H, from which U_i are found again: they stay in the range of the rows in one metric."""
    size = K.n + m
    o_U = stage_place(K, STAGE_SHIFT)
    o_H = stage_place(K, HELD)
    for i in range(3):
        for k in range(m):
            total = 0.0
            for j in range(K.n_v):
                total += K.kkt[(K.n + k) * size + j] * K.stages[o_U + i * K.n_v + j]
            K.stages[o_H + i * m + k] = total


def factor_stages(K: SingularSteps, size: int) -> bool:
    """LU factors of both matrices; false where a pivot is missing."""
    o = 0 if sharing(K) else order_at(K, size - K.n)
    column = 0
    if o == 0 or not factor_ordered(K, K.kkt, o, OF_TANGENT, LOSS_OF_STEP):
        K.order_start = 0
        K.n_pivoted += 1 if o > 0 else 0
        column = factor(K.kkt, size, K.pivots)
    o_P = stage_place(K, PAIR_PIVOTS)
    if column == 0 and o > 0 and factor_pair_ordered(K, stage_place(K, PAIR), o, LOSS_OF_STEP):
        K.stages[o_P] = -float(o)  # in the place of a row, which is not negative
    elif column == 0:
        column = factor_complex(K.stages, stage_place(K, PAIR), size, o_P)
    K.n_factorizations += 1
    K.failure_index = column - 1
    return bool(column == 0)


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
        solve_kkt(K, size, K.work)
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


def correct_stages(K: Steps, m: int, h: float, whole: bool) -> float:
    """One simplified Newton correction of all stages; its size relative to the largest rate."""
    if m > 0 and (whole or is_off(K, m)):
        correct_positions_of_stages(K, m, h, whole)
    return correct_rates(K, m, h)


def correct_rates(K: Steps, m: int, h: float) -> float:
    """The correction of rates and multipliers by the residuals in K.stages; its size relative to the largest rate."""
    n = K.n
    size = n + m
    S = K.stages
    solve_real(K, m, h)
    solve_pair(K, m, h)
    K.n_iterations += 1
    o_W = stage_place(K, STAGE_RATES)
    o_L = stage_place(K, STAGE_LAM)
    o_D = stage_place(K, CHANGES)
    o_b = stage_place(K, PAIR_RHS)
    biggest = 0.0
    fastest = 1e-300
    for i in range(3):
        for j in range(size):
            change = S[T_REAL + i] * K.rhs[j] + 2.0 * (S[T_RE + i] * S[o_b + j] - S[T_IM + i] * S[o_b + size + j])
            S[o_D + i * size + j] = change
            if j < n:
                biggest = max(biggest, abs(change))
                fastest = max(fastest, abs(S[o_W + i * n + j]))
                S[o_W + i * n + j] += change
            else:
                S[o_L + i * K.n_rows + K.rows[j - n]] += change
    return biggest / fastest


def solve_real(K: Steps, m: int, h: float) -> None:
    """The component along the real eigenvector, into K.rhs."""
    size = K.n + m
    S = K.stages
    o_r = stage_place(K, BALANCES)
    inverse = 1.0 / (S[MU_REAL] * h)
    for j in range(size):
        total = 0.0
        for i in range(3):
            total -= S[S_REAL + i] * S[o_r + i * size + j]
        K.rhs[j] = total if j < K.n else total * inverse
    solve_kkt(K, size, K.rhs)


def solve_pair(K: Steps, m: int, h: float) -> None:
    """The component along one vector of the pair, into K.stages."""
    size = K.n + m
    S = K.stages
    o_r = stage_place(K, BALANCES)
    o_b = stage_place(K, PAIR_RHS)
    length = h * (S[MU_RE] * S[MU_RE] + S[MU_IM] * S[MU_IM])
    for j in range(size):
        re = 0.0
        im = 0.0
        for i in range(3):
            re -= S[S_RE + i] * S[o_r + i * size + j]
            im -= S[S_IM + i] * S[o_r + i * size + j]
        if j >= K.n:  # over h μ
            turned = (re * S[MU_RE] + im * S[MU_IM]) / length
            im = (im * S[MU_RE] - re * S[MU_IM]) / length
            re = turned
        S[o_b + j] = re
        S[o_b + size + j] = im
    o_P = stage_place(K, PAIR_PIVOTS)
    if S[o_P] < 0.0:
        solve_pair_ordered(K, stage_place(K, PAIR), int(-S[o_P]), o_b)
    else:
        solve_complex(S, stage_place(K, PAIR), size, o_P, o_b)


def retreat_stages(K: Steps, m: int, part: float) -> None:
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
                S[o_L + i * K.n_rows + K.rows[j - n]] -= change
