"""Accelerations at a state with their derivatives, and what explicit steps make of them."""

from mbd.kernel.algebra.linear import factor, solve
from mbd.kernel.hooks import call
from mbd.kernel.records import Kernel, Reals
from mbd.kernel.stepping.restart import consistent, evaluate, fill_block
from mbd.sensitivity.tangent.words import derivative_of, is_differentiated, solve_plain, solved_program, without_tangent

BALANCE = 9
"""The function behind those of `mbd.kernel.codes`: M v̇ + f + R λ and B v̇ + γ of all rows, of derivatives alone."""


def prepare_rates(K: Kernel, t: float, m: int) -> int:
    """Factors of ``[M R; B 0]`` at (q1, y1), with (v̇, λ) in K.rhs; 0, or that it is singular."""
    n = K.n
    size = n + m
    evaluate(K, t, K.q1, K.y1)
    if not factors_at(K, m, False):
        return 1
    for i in range(n):
        K.rhs[i] = -K.acc[K.acc_f + i]
    for k in range(m):
        K.rhs[n + k] = -K.acc[K.acc_bias + K.rows[k]]
    solve_plain(K.kkt, size, K.pivots, K.rhs, 0)
    return 0


def follow_rates(K: Kernel, t: float, again: bool) -> int:
    """Consistent rates of (q1, y1) in K.jump, multipliers in K.impulse: `consistent` where friction follows λ, else

    ``[M R; B 0] (δv̇, δλ) = −δ(M v̇ + f + R λ, B v̇ + γ)`` with v̇ and λ held.

    again : whether the block is that of an earlier stage of the step, but for its time, positions and velocities
    """
    if not is_differentiated():
        return 0
    n = K.n
    m = K.n_active
    if K.n_frictions > 0 or K.loaded > 0 or K.loads_act == 1 or K.n_dropped > 0:
        return consistent(K, t, K.q1, K.y1)
    if again and K.vector == 1:
        K.block[0] = t
        K.block[K.o_q : K.o_q + K.n_q] = K.q1[: K.n_q]
        K.block[K.o_v : K.o_v + K.n] = K.y1[: K.n]
    else:
        fill_block(K, t, K.q1, K.y1)
    if K.correction_program == 0 and solve_straight_rates(K, m):
        return 0
    if prepare_rates(K, t, m) != 0:
        return consistent(K, t, K.q1, K.y1)
    fill_block(K, t, K.q1, K.y1)
    K.block[K.o_lam : K.o_lam + K.n_rows] = 0.0
    K.impulse[: K.n_rows] = 0.0
    for i in range(n):
        K.jump[i] = without_tangent(K.rhs[i])
        K.block[K.o_a + i] = K.jump[i]
    for k in range(m):
        K.impulse[K.rows[k]] = without_tangent(K.rhs[n + k])
        K.block[K.o_lam + K.rows[k]] = K.impulse[K.rows[k]]
    call(K, BALANCE, K.out)
    for i in range(n):
        K.rhs[i] = -derivative_of(K.out[i])
    for k in range(m):
        K.rhs[n + k] = -derivative_of(K.out[n + K.rows[k]])
    solve_plain(K.kkt, n + m, K.pivots, K.rhs, 0)
    for i in range(n):
        K.jump[i] += K.rhs[i]
    for k in range(m):
        K.impulse[K.rows[k]] += K.rhs[n + k]
    return 0


def solve_straight_rates(K: Kernel, m: int) -> bool:
    """The same by straight-line code (`systems.rates`) from the block; false where a pivot is too small."""
    n = K.n
    call(K, solved_program(K), K.out)
    if without_tangent(K.out[n + m]) != 1.0:
        return False
    for i in range(n):
        K.jump[i] = K.out[i]
    K.impulse[: K.n_rows] = 0.0
    for k in range(m):
        K.impulse[K.rows[k]] = K.out[n + k]
    return True


def follow_stage(K: Kernel, h: float, t: float, stage: int) -> bool:
    """The rates of a stage in K.stages, from the block of an earlier one; false where straight-line code fails."""
    if stage < 2 or K.vector == 0 or K.correction_program != 0 or not is_differentiated():
        return False
    if K.n_frictions > 0 or K.loaded > 0 or K.loads_act == 1 or K.n_dropped > 0:
        return False
    n = K.n
    K.block[0] = t
    weigh_rates(K, h, stage * K.n_nodes, stage, K.block, K.o_q, K.o_v)
    for i in range(n):
        K.block[K.o_v + i] += K.y[i]
        if i < K.n_v:
            K.block[K.o_q + i] += K.q[i]
    call(K, solved_program(K), K.out)
    if without_tangent(K.out[n + K.n_active]) != 1.0:
        return False
    o = stage * (K.n_v + n) + K.n_v
    for i in range(n):
        K.stages[o + i] = K.out[i]
    return True


def follow_move(K: Kernel, h: float, weights: int, count: int) -> None:
    """h times the weighted slopes of the first stages into K.spare, as `schemes.runge_kutta.explicit_move` has it."""
    if K.vector == 1:
        weigh_rates(K, h, weights, count, K.spare, 0, K.n_v)
        return
    width = K.n_v + K.n
    for i in range(width):
        total = 0.0
        for j in range(count):
            weight = K.tableau[weights + j]
            if weight != 0.0:
                total += weight * K.stages[j * width + i]
        K.spare[i] = h * total


def weigh_rates(K: Kernel, h: float, weights: int, count: int, out: Reals, o_x: int, o_y: int) -> None:
    """What stages move where coordinates add: ``x_i = h (c_i v + h Σ_j (a²)_ij v̇_j)``, and ``h Σ_j a_ij v̇_j`` of rates.

    As slopes of positions are velocities, rates alone carry derivatives from stage to stage (Hairer, Nørsett & Wanner
    1993, II.14).
    """
    n_v = K.n_v
    width = n_v + K.n
    stages = K.n_nodes
    squares = weights + stages * stages + 4 * stages + 2
    node = 1.0 if count == stages else K.tableau[stages * stages + stages + count]
    for i in range(K.n):
        own = 0.0
        twice = 0.0
        for j in range(count):
            weight = K.tableau[weights + j]
            square = K.tableau[squares + j]
            if weight != 0.0 or square != 0.0:
                own += weight * K.stages[j * width + n_v + i]
                twice += square * K.stages[j * width + n_v + i]
        out[o_y + i] = h * own
        if i < n_v:
            out[o_x + i] = h * (node * K.y[i] + h * twice)


def follow_factors(K: Kernel, m: int) -> bool:
    """LU factors of ``A = [M Bᵀ; B 0]`` from K.acc, which have no derivatives; false where a pivot is missing."""
    return factors_at(K, m, True)


def factors_at(K: Kernel, m: int, symmetric: bool) -> bool:
    """The same, or of ``[M R; B 0]``."""
    n = K.n
    size = n + m
    K.order_start = 0
    for i in range(n):
        K.kkt[i * size : i * size + n] = K.acc[i * n : i * n + n]
    for k in range(m):
        row = K.acc_B + K.rows[k] * n
        o = (n + k) * size
        K.kkt[o : o + size] = 0.0
        for i in range(n):
            K.kkt[o + i] = K.acc[row + i]
            K.kkt[i * size + n + k] = K.acc[row + i] if symmetric else K.acc[K.acc_R + i * K.n_rows + K.rows[k]]
    return bool(factor(K.kkt, size, K.pivots) == 0)


def solve_by_value(K: Kernel, size: int) -> None:
    """K.work ← A⁻¹ K.work with the factors in K.kkt."""
    solve(K.kkt, size, K.pivots, K.work)


def follow_solution(K: Kernel, m: int) -> None:
    """``A u = b → A δu = δb − δA u`` of b in K.rhs, with the factors of `follow_factors` and A from K.acc."""
    n = K.n
    size = n + m
    for i in range(size):
        K.work[i] = without_tangent(K.rhs[i])
    solve_by_value(K, size)
    for i in range(n):
        total = derivative_of(K.rhs[i])
        for j in range(n):
            total -= derivative_of(K.acc[i * n + j]) * without_tangent(K.work[j])
        for k in range(m):
            total -= derivative_of(K.acc[K.acc_B + K.rows[k] * n + i]) * without_tangent(K.work[n + k])
        K.rhs[i] = total
    for k in range(m):
        total = derivative_of(K.rhs[n + k])
        for j in range(n):
            total -= derivative_of(K.acc[K.acc_B + K.rows[k] * n + j]) * without_tangent(K.work[j])
        K.rhs[n + k] = total
    solve_plain(K.kkt, size, K.pivots, K.rhs, 0)
    for i in range(size):
        K.rhs[i] += without_tangent(K.work[i])
