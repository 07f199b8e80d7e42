"""The end of a step of the Radau IIA method: consistent accelerations and multipliers, and the error estimate."""

from __future__ import annotations

from mbd.kernel.algebra.ordered import LOSS_AT_ONCE, solve_kkt
from mbd.kernel.algebra.saddle import factor_saddle
from mbd.kernel.codes import NOT_CONVERGED, SINGULAR
from mbd.kernel.records import Balance, Kernel, Steps
from mbd.kernel.schemes.stage_layout import (
    A_,
    E_,
    MASS_PART,
    MU_REAL,
    STAGE_BEND,
    STAGE_LAM,
    STAGE_RATES,
    STIFF_PART,
    stage_place,
)
from mbd.kernel.schemes.stage_matrices import factor_stages
from mbd.kernel.schemes.stages import (
    load_stage,
)
from mbd.kernel.singular.step_size import note_row_norms
from mbd.kernel.stepping.restart import (
    compose,
    consistent,
    evaluate,
    find_sliding_friction,
    holds_rows,
    load_accelerations,
)
from mbd.kernel.tangent_rules import follow_rates

__all__ = ["complete"]


def complete(K: Kernel, h: float, t1: float, m: int, renew: bool, slow: bool) -> int:
    """The converged last stage becomes the candidate, with consistent rates and multipliers where rows are active.

    So they are where the iteration was `slow`: its residual is small beside the largest forces that it met, which may
    be far above those at the end.
    """
    if renew and not factor_stages(K, K.n + m):
        return SINGULAR
    load_stage(K, 2, h, t1)
    o_W = stage_place(K, STAGE_RATES) + 2 * K.n
    o_L = stage_place(K, STAGE_LAM) + 2 * K.n_rows
    for i in range(K.n):
        K.y1[i] = K.block[K.o_v + i]
        K.rate1[i] = K.stages[o_W + i]
    K.lam1[: K.n_rows] = K.stages[o_L : o_L + K.n_rows]
    estimate_error(K, h, m)
    for i in range(K.n_v):
        if K.unit[i] == 1 and not abs(K.error[i]) <= 0.5:
            K.failure_size = -1.0
            return NOT_CONVERGED
    compose(K, K.q1)
    if m > 0 or K.n_frictions > 0 or slow:
        if end_rates(K, t1, m) and follow_rates(K, t1) == 0:
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


def end_rates(K: Balance, t1: float, m: int) -> bool:
    """Consistent rates and multipliers of the candidate in K.jump and K.impulse; false where there are none.

    Rows that were stepped with are independent, so that plain factors do for `consistent`, except where R follows
    multipliers. Frictions that feel rows left out, whose multipliers are known later, keep those of the stage.
    """
    if K.n_dropped > 0 and (K.n_frictions > 0 or K.rubs == 1):
        evaluate(K, t1, K.q1, K.y1)
        return False
    if K.loaded > 0:
        return bool(consistent(K, t1, K.q1, K.y1) == 0)
    n = K.n
    evaluate(K, t1, K.q1, K.y1)
    load_accelerations(K)
    if not factor_saddle(K, m, False, LOSS_AT_ONCE):
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


def stage_speed(K: Steps, k: int, j: int, h: float) -> float:
    """ẋ of component j at stage k."""
    S = K.stages
    o = stage_place(K, STAGE_RATES) + j
    n = K.n
    speed = K.y[j] + h * (S[A_ + 3 * k] * S[o] + S[A_ + 3 * k + 1] * S[o + n] + S[A_ + 3 * k + 2] * S[o + 2 * n])
    if K.vector == 0 and j < K.n_v:
        speed += S[stage_place(K, STAGE_BEND) + k * K.n_v + j]
    return float(speed)
