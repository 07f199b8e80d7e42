"""Accelerations at a start where the mass matrix is ill-conditioned: corrected by the balance, or refused.

The joint angles of a long chain move everything outboard, so that a link's own inertia is a small difference of large
entries of M: elimination loses ε cond(M). The balance r = M v̇ + f + R λ, body by body, has no such cancellation.
How many digits a solution has is asked of one that is known: ``M x = r(x₀) − r(0)`` must give x₀ back. Its relative
error e is what each correction by the balance leaves of the error before (Wilkinson's iterative refinement; Higham
2002, Accuracy and Stability of Numerical Algorithms, ch. 12); with e near 1 nothing is left to correct with.
"""

from mbd.equal import DIRECT_PIVOT_RTOL
from mbd.kernel.algebra.ordered import solve_kkt
from mbd.kernel.algebra.redundancy import sharing
from mbd.kernel.algebra.saddle import factor_saddle
from mbd.kernel.codes import EPS, ILL_CONDITIONED
from mbd.kernel.records import Balance, Report
from mbd.kernel.stepping.mass_ratios import find_imbalance, polish_with_rows
from mbd.kernel.stepping.restart import stepping_rows

CORRECTED_PIVOT_RTOL = 1e-6
"""Smallest pivot of the scaled matrix below which solutions are corrected [-]."""
MAX_ERROR = 0.1
"""Relative error of accelerations known beforehand above which they are refused [-]."""


def is_ill_conditioned(K: Report) -> bool:
    """Whether a pivot of the scaled matrix of accelerations was so small that solutions lose digits."""
    return bool(K.least_pivot < CORRECTED_PIVOT_RTOL)


def refine_accelerations(K: Balance) -> int:
    """K.jump and K.impulse, solved for at the state in the block and in K.acc, corrected; 0 or ILL_CONDITIONED.

    The mode must have its code. Where friction slides or rows depend on others the solution stays as it is.
    """
    if K.n_frictions > 0 or K.n_dropped > 0 or K.mode_id < 0 or sharing(K):
        return 0
    n = K.n
    m = stepping_rows(K)
    if not factor_saddle(K, m, False, DIRECT_PIVOT_RTOL):
        K.failure_index = 0
        return ILL_CONDITIONED
    error = known_error(K, m)
    K.lost_digits = error
    if not error < MAX_ERROR:
        return ILL_CONDITIONED
    left = error
    for _ in range(14):  # corrections by the balance
        polish_with_rows(K, m)
        left *= error
        if left < EPS:
            break
    K.block[K.o_a : K.o_a + n] = K.jump[:n]
    return 0


def known_error(K: Balance, m: int) -> float:
    """Relative error of accelerations x₀ that are known, solved for with the factors at hand from r(x₀) − r(0).

    x₀ has no order, so that it has a part in every motion, and the size of the accelerations at hand or of those that
    the forces would give each coordinate alone. K.jump is kept; the worst coordinate is left in K.failure_index.
    """
    n = K.n
    K.trial_jump[:n] = K.jump[:n]
    for unit in range(3):
        size = 0.0
        for i in range(n):
            if K.unit[i] == unit:
                size = max(size, abs(K.jump[i]))
                if i < K.n_v and K.acc[i * n + i] > 0.0:
                    size = max(size, K.scale[i] / K.acc[i * n + i])
        if size == 0.0:
            size = 1.0
        part = 0.5
        for i in range(n):  # a Weyl sequence
            part += 0.6180339887498949
            if part >= 1.0:
                part -= 1.0
            if K.unit[i] == unit:
                K.jump[i] = size * (1.0 + part if i % 2 == 0 else -1.0 - part)
    K.force[:n] = K.jump[:n]
    for k in range(m):
        K.work[k] = 0.0
        for i in range(n):
            K.work[k] += K.acc[K.acc_B + K.rows[k] * n + i] * K.jump[i]
    find_imbalance(K)
    for i in range(n):
        K.rhs[i] = K.out[i]
        K.jump[i] = 0.0
    find_imbalance(K)
    for i in range(n):
        K.rhs[i] -= K.out[i]
    K.rhs[n : n + m] = K.work[:m]
    solve_kkt(K, n + m, K.rhs)
    worst = 0.0
    for i in range(n):
        error = abs(K.rhs[i] - K.force[i]) / abs(K.force[i])
        if not error <= worst:
            worst = error
            K.failure_index = i
        K.jump[i] = K.trial_jump[i]
    return float(worst)
