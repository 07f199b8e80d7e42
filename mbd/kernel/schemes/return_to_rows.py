"""The end of an explicit step is projected onto the rows, positions and velocities, in the metric of M."""

from mbd.equal import DIRECT_PIVOT_RTOL, REST_SPEED
from mbd.kernel.algebra.ordered import solve_kkt
from mbd.kernel.algebra.saddle import factor_saddle
from mbd.kernel.codes import EPS, NOT_CONVERGED, NOT_FINITE, SINGULAR
from mbd.kernel.hooks import call_on
from mbd.kernel.records import DependentRows, Equations
from mbd.kernel.schemes.iteration import note_fastest
from mbd.kernel.singular.newmark_step import VELOCITY_RTOL
from mbd.kernel.stepping.restart import displace, evaluate, raise_scales
from mbd.kernel.tangent_rules import follow_factors, follow_solution, is_differentiated


def return_to_rows(K: DependentRows, t1: float) -> int:
    """The nearest positions with h = 0 and velocities with ḣ = 0, in the metric of M, in place of (q1, y1)."""
    n = K.n
    m = K.n_active
    o_h = K.acc_h
    before = 1e300
    size = 0.0
    straight = False
    for _ in range(8):  # Newton corrections of positions onto the rows after a step; it takes one or two
        evaluate(K, t1, K.q1, K.y1)
        K.n_residuals += 1
        size = 0.0
        K.rhs[:n] = 0.0
        for k in range(m):
            row = K.rows[k]
            h = 0.0 if K.row_level[row] == 1 else K.acc[o_h + row]
            K.rhs[n + k] = -h
            if not abs(h) < 1e300:
                return NOT_FINITE
            size = max(size, abs(h) / (16.0 * EPS * K.scale[n + row]))
        straight = return_straight(K)
        if not straight and not factor_returns(K, m):
            return SINGULAR
        if size <= 1.0 or size >= before:
            break
        before = size
        if straight:
            K.rhs[:n] = K.spare[1 : n + 1]
        else:
            solve_returns(K, m)
        displace(K, K.q1, K.rhs)
    if size > 1e3:  # coordinates may have grown since their sizes were noted
        raise_scales(K, True)
        size = 0.0
        for k in range(m):
            size = max(size, abs(K.rhs[n + k]) / (16.0 * EPS * K.scale[n + K.rows[k]]))
    if size > 1e3:
        K.failure_size = size
        return NOT_CONVERGED
    if straight:  # of the last turn, at whose positions K.acc is
        K.rhs[:n] = K.spare[n + 1 : 2 * n + 1]
    else:
        K.rhs[:n] = 0.0
        for k in range(m):
            K.rhs[n + k] = -K.acc[o_h + K.n_rows + K.rows[k]]
        solve_returns(K, m)
    note_fastest(K, True)
    for i in range(K.n_v):
        limit = max(VELOCITY_RTOL * K.fastest[K.cluster[i]], K.rest_speed + REST_SPEED)
        if abs(K.rhs[i]) > limit:  # rows near a singular configuration take the branch for another
            K.failure_size = 0.0
            return NOT_CONVERGED
    for i in range(n):
        K.y1[i] += K.rhs[i]
    return 0


def return_straight(K: Equations) -> bool:
    """Corrections of positions and velocities by code of the mode, in K.spare; false where pivots are searched for."""
    if K.returns_program == 0 or is_differentiated():
        return False
    call_on(K, K.returns_program, K.acc, K.spare)
    return bool(K.spare[0] == 1.0)


def factor_returns(K: Equations, m: int) -> bool:
    """Factors of [M Bᵀ; B 0] from K.acc in K.kkt; false where a pivot is missing."""
    if is_differentiated():
        return follow_factors(K, m)
    return bool(factor_saddle(K, m, True, DIRECT_PIVOT_RTOL))


def solve_returns(K: Equations, m: int) -> None:
    """K.rhs ← [M Bᵀ; B 0]⁻¹ K.rhs."""
    if is_differentiated():
        follow_solution(K, m)
    else:
        solve_kkt(K, K.n + m, K.rhs)
