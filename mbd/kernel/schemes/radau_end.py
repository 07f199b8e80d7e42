"""The end of a step of the Radau IIA method: consistent accelerations and multipliers, and the error estimate."""

from mbd.equal import DIRECT_PIVOT_RTOL
from mbd.kernel.algebra.ordered import solve_kkt
from mbd.kernel.algebra.redundancy import clear_dependent, sharing
from mbd.kernel.algebra.saddle import factor_saddle
from mbd.kernel.codes import NOT_CONVERGED, SINGULAR
from mbd.kernel.records import Balance, Kernel, Steps
from mbd.kernel.schemes.iteration import MAX_UNEXPLAINED_CHANGE
from mbd.kernel.schemes.stage_layout import (
    A_,
    C_,
    CHANGES,
    E_,
    MASS_PART,
    MU_REAL,
    STAGE_BEND,
    STAGE_LAM,
    STAGE_RATES,
    STIFF_PART,
    stage_place,
)
from mbd.kernel.schemes.stage_matrices import factor_stages, matrices
from mbd.kernel.schemes.stages import (
    load_stage,
)
from mbd.kernel.singular.step_size import note_row_norms
from mbd.kernel.stepping.restart import (
    compose,
    consistent,
    evaluate,
    fill_block,
    find_sliding_friction,
    holds_rows,
    load_accelerations,
)
from mbd.kernel.tangent_rules import follow_rates

CHECK_POINT = 0.4
"""Part of a step, amid the widest gap between stages, at which a second estimate looks at the balance [-]."""


def complete(K: Kernel, h: float, t1: float, m: int, renew: bool, slow: bool) -> int:
    """The converged last stage becomes the candidate, with consistent rates and multipliers where rows are active.

    So they are where the iteration was `slow`: its residual is small beside the largest forces that it met, which may
    be far above those at the end.
    """
    twice = K.estimates_twice == 1 and K.adaptive == 1 and K.near_singular == 0 and misses_balance(K, h)
    if twice:
        load_stage(K, 1, h, t1)
        matrices(K, m, h)
    if (renew or twice) and not factor_stages(K, K.n + m):
        return SINGULAR
    load_stage(K, 2, h, t1)
    o_W = stage_place(K, STAGE_RATES) + 2 * K.n
    o_L = stage_place(K, STAGE_LAM) + 2 * K.n_rows
    for i in range(K.n):
        K.y1[i] = K.block[K.o_v + i]
        K.rate1[i] = K.stages[o_W + i]
    K.lam1[: K.n_rows] = K.stages[o_L : o_L + K.n_rows]
    clear_dependent(K, K.lam1)
    K.changes_little = 1.0 if is_even(K, h) else 0.0
    estimate_error(K, h, m)
    if twice:
        raise_error(K, h, m)
    for i in range(K.n_v):
        if K.unit[i] == 1 and not abs(K.error[i]) <= 0.5:
            K.failure_size = -1.0
            return NOT_CONVERGED
    compose(K, K.q1)
    if m > 0 or K.n_frictions > 0 or slow:
        if end_rates(K, t1, m) and follow_rates(K, t1, False) == 0:
            K.rate1[: K.n] = K.jump[: K.n]
            K.lam1[: K.n_rows] = K.impulse[: K.n_rows]
        if m > 0:
            if not holds_rows(K, m):
                K.failure_size = 0.0
                return NOT_CONVERGED
            note_row_norms(K)
        K.block[K.o_lam : K.o_lam + K.n_rows] = K.lam1[: K.n_rows]
    for i in range(K.n):
        K.block[K.o_a + i] = K.rate1[i]
        K.aux1[i] = K.rate1[i]
    return 0


def is_even(K: Steps, h: float) -> bool:
    """Whether accelerations at the start and at all stages would each make about the change of velocities of the step.

    Then forces along it lead from its start to its end, and the look for places between is not needed.
    """
    o_W = stage_place(K, STAGE_RATES)
    for c in range(K.n_clusters):
        largest = 0.0
        missed = 0.0
        for j in range(K.n_v):
            if K.cluster[j] == c:
                change = K.y1[j] - K.y[j]
                largest = max(largest, abs(change))
                missed = max(missed, abs(h * K.rate[j] - change))
                for i in range(3):
                    missed = max(missed, abs(h * K.stages[o_W + i * K.n + j] - change))
        if missed > MAX_UNEXPLAINED_CHANGE * largest:
            return False
    return True


def end_rates(K: Balance, t1: float, m: int) -> bool:
    """Consistent rates and multipliers of the candidate in K.jump and K.impulse; false where there are none.

    Rows that were stepped with are independent, so that plain factors do for `consistent`, except where R follows
    multipliers. Frictions that feel rows left out, whose multipliers are known later, keep those of the stage.
    """
    together = sharing(K)
    if K.n_dropped > 0 and K.n_frictions > 0 and not together:
        evaluate(K, t1, K.q1, K.y1)
        return False
    if K.loaded > 0 or together:
        return bool(consistent(K, t1, K.q1, K.y1) == 0)
    n = K.n
    evaluate(K, t1, K.q1, K.y1)
    load_accelerations(K)
    if not factor_saddle(K, m, False, DIRECT_PIVOT_RTOL):
        return False
    for i in range(n):
        K.rhs[i] = -K.force[i]
    for k in range(m):
        K.rhs[n + k] = -K.bias[K.rows[k]]
    solve_kkt(K, n + m, K.rhs)
    K.impulse[: K.n_rows] = 0.0
    K.jump[:n] = K.rhs[:n]
    for k in range(m):
        K.impulse[K.rows[k]] = K.rhs[n + k]
    if K.n_frictions > 0:
        find_sliding_friction(K)
    return True


def estimate_error(K: Steps, h: float, m: int) -> None:
    """Error of order 3 of x and (v, z) over the step, into K.error (Hairer & Wanner 1996, eq. IV.8.20).

    ``μ h f(y₀) + Σ e_i (Y_i − y₀)``, along the rows, filtered by (1 − hμ ∂f/∂y)⁻¹: stiff components do not count.
    """
    n = K.n
    S = K.stages
    c = S[MU_REAL] * h
    o_W = stage_place(K, STAGE_RATES)
    o_M = stage_place(K, MASS_PART)
    o_K = stage_place(K, STIFF_PART)
    for j in range(n):
        raw = c * K.rate[j]
        bend = c * K.y[j] if j < K.n_v else 0.0
        for i in range(3):
            load = 0.0
            project_gaps = 0.0
            for k in range(3):
                load += S[A_ + 3 * i + k] * S[o_W + k * n + j]
                project_gaps += S[A_ + 3 * i + k] * stage_speed(K, k, j, h)
            raw += S[E_ + i] * h * load
            bend += S[E_ + i] * h * project_gaps if j < K.n_v else 0.0
        K.error[K.n_v + j] = raw
        if j < K.n_v:
            K.error[j] = bend
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += S[o_M + i * n + j] * K.error[K.n_v + j]
            if j < K.n_v:
                total -= S[o_K + i * n + j] / c * K.error[j]
        K.rhs[i] = total
    for k in range(m):
        total = 0.0
        for j in range(K.n_v):
            total -= K.turning[k * K.n_v + j] * K.error[j]
        K.rhs[n + k] = total
    solve_kkt(K, n + m, K.rhs)
    for i in range(n):
        K.error[K.n_v + i] = K.rhs[i]
        if i < K.n_v:
            K.error[i] += c * K.rhs[i]


def misses_balance(K: Kernel, h: float) -> bool:
    """What the parabola through the rates of the stages misses at `CHECK_POINT`, into K.stages; whether it is known.

    Positions and velocities there are integrals of that parabola and of the one through the velocities of the stages.
    The factors of the step are lost.
    """
    S = K.stages
    n = K.n
    o_W = stage_place(K, STAGE_RATES)
    o_D = stage_place(K, CHANGES)
    t = K.time + CHECK_POINT * h
    fill_block(K, t, K.q, K.y)
    for j in range(n):
        K.y1[j] = K.y[j]
        K.block[K.o_x + j] = 0.0 if j < K.n_v else K.block[K.o_x + j]
        S[o_D + j] = 0.0
    for i in range(3):
        a = S[C_ + (i + 1) % 3]
        b = S[C_ + (i + 2) % 3]
        over = 1.0 / ((S[C_ + i] - a) * (S[C_ + i] - b))
        value = (CHECK_POINT - a) * (CHECK_POINT - b) * over
        integral = CHECK_POINT * (CHECK_POINT * (CHECK_POINT / 3.0 - 0.5 * (a + b)) + a * b) * over
        for j in range(n):
            K.y1[j] += h * integral * S[o_W + i * n + j]
            S[o_D + j] -= value * S[o_W + i * n + j]
            if j < K.n_v:
                K.block[K.o_x + j] += h * integral * stage_speed(K, i, j, h)
    compose(K, K.q1)
    if consistent(K, t, K.q1, K.y1) != 0:
        return False
    for j in range(n):
        S[o_D + j] += K.jump[j]
    return True


def raise_error(K: Steps, h: float, m: int) -> None:
    """K.error is at least as large as by what `misses_balance` found: for smooth motions both are equally large.

    The estimate of the module, f(y₀) less the same parabola at 0, is one number for each coordinate: it vanishes by
    chance where forces that die away within the step pass through that parabola.
    """
    n = K.n
    S = K.stages
    c = S[MU_REAL] * h
    o_D = stage_place(K, CHANGES)
    o_M = stage_place(K, MASS_PART)
    part = 1.0  # of the same third difference, seen at 0 and seen between
    for i in range(3):
        part *= S[C_ + i] / (S[C_ + i] - CHECK_POINT)
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += S[o_M + i * n + j] * c * part * S[o_D + j]
        K.rhs[i] = total
    K.rhs[n : n + m] = 0.0
    solve_kkt(K, n + m, K.rhs)
    for i in range(n):
        K.error[K.n_v + i] = max(abs(K.error[K.n_v + i]), abs(K.rhs[i]))
        if i < K.n_v:
            K.error[i] = max(abs(K.error[i]), c * abs(K.rhs[i]))


def stage_speed(K: Steps, k: int, j: int, h: float) -> float:
    """ẋ of component j at stage k."""
    S = K.stages
    o = stage_place(K, STAGE_RATES) + j
    n = K.n
    speed = K.y[j] + h * (S[A_ + 3 * k] * S[o] + S[A_ + 3 * k + 1] * S[o + n] + S[A_ + 3 * k + 2] * S[o + 2 * n])
    if K.vector == 0 and j < K.n_v:
        speed += S[stage_place(K, STAGE_BEND) + k * K.n_v + j]
    return float(speed)
