"""Accelerations to all their digits where masses differ by many orders of magnitude.

A mass matrix adds up masses: of a light link above a heavy one, M₁₁ = m₁ l₁² + m₂ (…) keeps m₁ to ε m₂ only, and
elimination takes M₁₁ − M₁₂²/M₂₂ = m₁ l₁² + m₂ l₁² sin²φ from it, whose relative round-off is ε m₂/m₁ where the links
are in line. The balance r = M v̇ + f + R λ itself, body by body, adds up no masses: corrections by it,
``v̇ ← v̇ − M⁻¹ r(v̇)`` (Wilkinson's iterative refinement), leave round-off of single forces. Each takes the round-off by
the factor that elimination has lost, so one or two suffice. Where nothing is lost none is made.
"""

from mbd.equal import DIRECT_PIVOT_RTOL, EQUAL_RTOL, HALF_PRECISION_RTOL
from mbd.kernel.algebra.linear import solve_again, solve_definite
from mbd.kernel.algebra.ordered import order_at, solve_kkt
from mbd.kernel.hooks import call
from mbd.kernel.records import Balance, Equations, Motion

MAX_FORCE_RATIO = 1e6
"""Terms of forces over inertia forces and multipliers above which corrections are looked at as well [-]."""


def has_settled(moved: float, last: float, enough: float) -> bool:
    """Whether a correction of residuals that pass was small, or as small as round-off lets it be.

    Masses that differ by 10⁶ make a change of 10⁻³ in the rates of the light one of residuals of 10⁻⁹.

    Parameters
    ----------
    moved, last : the largest change of a rate by the correction and by that before, over the fastest rate; 1e300 and 0
        where there was none
    enough : what is small beside the error of the step [-]
    """
    return moved <= max(HALF_PRECISION_RTOL, enough) or (last > 0.0 and moved > 0.5 * last)


def excuses_much(K: Motion) -> bool:
    """Whether terms of forces are so much larger than what moves that small residuals do not tell small errors.

    Next to half a turn terms of a twist, which cancel, grow as a power of 1/distance. M is in K.acc.
    """
    force = 0.0
    for row in range(K.n_rows):
        force = max(force, abs(K.lam[row]))
    largest = 0.0
    for i in range(K.n_v):
        inertia = 0.0
        for j in range(K.n_v):
            inertia += abs(K.acc[i * K.n + j] * K.rate[j])
        force = max(force, inertia)
        largest = max(largest, K.scale[i])
    return largest > MAX_FORCE_RATIO * force


def is_uneven(K: Equations, m: int) -> bool:
    """Whether a pivot of M, which is in K.acc, is far below the largest diagonal entry of its unit; with m active rows.

    Where M is singular its diagonal entries are compared.

    Matrices that are eliminated in an order chosen beforehand keep four digits as it is, or pivots are searched for.
    """
    if order_at(K, m) > 0:
        return False
    n = K.n
    K.kkt[: n * n] = K.acc[: n * n]
    K.rhs[:n] = 0.0
    definite = solve_definite(K.kkt, n, K.rhs, K.spare) > 0.0  # rows may carry what no mass moves with
    for unit in range(2):
        big = 0.0
        least = 1e300
        for i in range(K.n_v):
            entry = K.acc[i * n + i]
            if K.unit[i] == unit and entry > 0.0:
                big = max(big, entry)
                least = min(least, 1.0 / K.kkt[i * n + i] if definite else entry)
        if least < DIRECT_PIVOT_RTOL * big:
            return True
    return False


def polish_rates(K: Balance, kept: float) -> None:
    """K.jump corrected by the balance at the state in the block; pivots of the factors in K.acc keep `kept`.

    Where much was lost a correction leaves a part of the error: they go on until they grow small, or no smaller.
    """
    n = K.n
    before = 1e300
    for _ in range(8 if kept < HALF_PRECISION_RTOL else 1):
        find_imbalance(K)
        for i in range(n):
            K.rhs[i] = -K.out[i]
        solve_again(K.acc, n, K.rhs)
        change = 0.0
        size = 0.0
        for i in range(n):
            K.jump[i] += K.rhs[i]
            change = max(change, abs(K.rhs[i]))
            size = max(size, abs(K.jump[i]))
        if change < EQUAL_RTOL * size or change > 0.5 * before:
            break
        before = change


def polish_with_rows(K: Balance, m: int) -> None:
    """The same of K.jump and of K.impulse for the m rows in K.rows, with the factors of `[M R; B 0]` in K.kkt."""
    n = K.n
    K.block[K.o_lam : K.o_lam + K.n_rows] = K.impulse[: K.n_rows]
    find_imbalance(K)
    for i in range(n):
        K.rhs[i] = -K.out[i]
    for k in range(m):
        row = K.rows[k]
        off = K.acc[K.acc_bias + row]
        for i in range(n):
            off += K.acc[K.acc_B + row * n + i] * K.jump[i]
        K.rhs[n + k] = -off
    solve_kkt(K, n + m, K.rhs)
    for i in range(n):
        K.jump[i] += K.rhs[i]
    for k in range(m):
        K.impulse[K.rows[k]] += K.rhs[n + k]


def find_imbalance(K: Balance) -> None:
    """r of the mode at the state in the block, with the rates in K.jump, into K.out."""
    K.block[K.o_a : K.o_a + K.n] = K.jump[: K.n]
    call(K, K.residual_program, K.out)
    K.n_residuals += 1
