"""Rates and multipliers at a stage of an explicit scheme, from the balance and the rows at acceleration level."""

from mbd.equal import DIRECT_PIVOT_RTOL
from mbd.kernel.algebra.linear import solve_definite, sum_of_sizes
from mbd.kernel.algebra.ordered import solve_kkt
from mbd.kernel.algebra.redundancy import sharing
from mbd.kernel.algebra.saddle import factor_saddle
from mbd.kernel.codes import NOT_FINITE, SINGULAR
from mbd.kernel.hooks import call_on
from mbd.kernel.records import Balance
from mbd.kernel.stepping.free_rates import NOT_CLEAR, free_rates
from mbd.kernel.stepping.mass_ratios import polish_rates, polish_with_rows
from mbd.kernel.stepping.restart import consistent, evaluate


def explicit_rates(K: Balance, t: float) -> int:
    """Rates at (q1, y1), in K.jump; where friction follows multipliers by the iteration of `consistent`."""
    n = K.n
    m = K.n_active
    if (K.loaded > 0 and (K.n_frictions > 0 or K.loads_act == 1)) or sharing(K):
        return consistent(K, t, K.q1, K.y1)
    K.n_residuals += 1
    if m == 0:
        pull = free_rates(K, t)
        if pull != NOT_CLEAR:
            if K.vector == 0:
                K.stage_pull = max(K.stage_pull, pull)
            return 0
    evaluate(K, t, K.q1, K.y1)
    finite = 0.0
    for i in range(n):
        finite += abs(K.acc[K.acc_f + i])
    if not finite < 1e300:
        return NOT_FINITE
    if m == 0:
        for i in range(n):
            K.jump[i] = -K.acc[K.acc_f + i]
        kept = solve_definite(K.acc, n, K.jump, K.spare)
        if K.vector == 0:
            if kept >= DIRECT_PIVOT_RTOL:
                note_pull(K)
            else:
                K.stage_pull = 1e300
        if kept == 0.0:
            return consistent(K, t, K.q1, K.y1)
        if kept < DIRECT_PIVOT_RTOL:
            polish_rates(K, kept)
        return 0
    if K.uneven_masses == 0 and solve_straight(K, m):
        return 0
    if not factor_saddle(K, m, False, DIRECT_PIVOT_RTOL):
        return SINGULAR
    for i in range(n):
        K.rhs[i] = -K.acc[K.acc_f + i]
    for k in range(m):
        K.rhs[n + k] = -K.acc[K.acc_bias + K.rows[k]]
    solve_kkt(K, n + m, K.rhs)
    K.jump[:n] = K.rhs[:n]
    if K.uneven_masses == 1:
        K.impulse[: K.n_rows] = 0.0
        for k in range(m):
            K.impulse[K.rows[k]] = K.rhs[n + k]
        polish_with_rows(K, m)
    return 0


def solve_straight(K: Balance, m: int) -> bool:
    """Rates in K.jump, multipliers in K.impulse, from K.acc by code of the mode; false where it has none for them."""
    if K.rates_program == 0:
        return False
    call_on(K, K.rates_program, K.acc, K.spare)
    if K.spare[0] != 1.0:
        return False
    n = K.n
    K.jump[:n] = K.spare[1 : n + 1]
    K.impulse[: K.n_rows] = 0.0
    for k in range(m):
        K.impulse[K.rows[k]] = K.spare[n + 1 + k]
    return True


def rates_at_end(K: Balance, t1: float) -> int:
    """Rates and multipliers at the candidate, in K.jump and K.impulse, as `consistent` finds them."""
    if K.n_frictions == 0 and K.n_dropped == 0 and K.loaded == 0 and K.rates_program > 0:
        evaluate(K, t1, K.q1, K.y1)
        if solve_straight(K, K.n_active) and sum_of_sizes(K.jump, K.n) < 1e300:
            return 0
    return int(consistent(K, t1, K.q1, K.y1))


def note_pull(K: Balance) -> None:
    """``v̇·M v̇ = −v̇·f`` of the rates in K.jump, if it is the largest of the step, for `mbd.kernel.stepping.poles`."""
    pull = 0.0
    for i in range(K.n_v):
        pull -= K.jump[i] * K.acc[K.acc_f + i]
    K.stage_pull = max(K.stage_pull, pull)
