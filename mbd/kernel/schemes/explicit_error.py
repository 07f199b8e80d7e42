"""The local error of an explicit step by its embedded formulas."""

from mbd.equal import DIRECT_PIVOT_RTOL
from mbd.kernel.algebra.ordered import solve_kkt
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.algebra.saddle import factor_saddle
from mbd.kernel.records import Memory, Steps


def explicit_error(K: Memory, h: float) -> None:
    """K.error: local error by the embedded formulas, ``h e₅ · |e₅| / √(|e₅|² + |e₃|²/100)`` (Hairer et al., II.10).

    The sizes |e| are the largest over positions and h times velocities; first-order states have sizes of their own.
    A formula with one estimate has e₃ = 0.
    """
    n_v = K.n_v
    width = n_v + K.n
    stages = K.n_nodes
    fifth = stages * stages + 2 * stages
    third = fifth + stages + 1
    five = 0.0
    three = 0.0
    for i in range(width):
        e5 = 0.0
        e3 = 0.0
        for j in range(stages + 1):
            slope = K.stages[j * width + i]
            e5 += K.tableau[fifth + j] * slope
            e3 += K.tableau[third + j] * slope
        K.error[i] = h * e5
        if i >= 2 * n_v:
            K.error[i] *= part_of(abs(e5), abs(e3))
            continue
        weight = 1.0 if i < n_v else h
        five = max(five, weight * abs(e5))
        three = max(three, weight * abs(e3))
    share = part_of(five, three)
    for i in range(2 * n_v):
        K.error[i] *= share


def part_of(five: float, three: float) -> float:
    """``e₅ / √(e₅² + e₃²/100)`` of sizes whose squares overflow, as in a step into a steep wall, or underflow.

    Straight sliding in space has sideways errors of some 1e-200.
    """
    large = max(five, three)
    if large == 0.0:
        return 0.0
    if not 1e-150 < large < 1e150:
        five /= large
        three /= large
    return five / sqrt(five * five + 0.01 * three * three)


def hold_error(K: Steps) -> bool:
    """K.error less what the projection onto the rows takes of it, in the metric of M; false if that is singular.

    Stages next to a singular configuration err across the rows, most of which is gone at the end of the step.
    """
    n = K.n
    n_v = K.n_v
    m = K.n_active
    if not factor_saddle(K, m, True, DIRECT_PIVOT_RTOL):
        return False
    for level in range(2):
        K.rhs[:n] = 0.0
        for k in range(m):
            row = K.rows[k]
            off = 0.0
            for j in range(n if level == 1 else n_v):
                off += K.acc[K.acc_B + row * n + j] * K.error[level * n_v + j]
            K.rhs[n + k] = 0.0 if level == 0 and K.row_level[row] == 1 else -off
        solve_kkt(K, n + m, K.rhs)
        for i in range(n_v):
            K.error[level * n_v + i] += K.rhs[i]
    return True
