"""One step of an explicit Runge–Kutta formula with its embedded error estimate (Hairer, Nørsett & Wanner
1993, II; coefficients in K.tableau, of `mbd.kernel.schemes.tableau`, of as many stages as the scheme has nodes).

    x_i = h Σ_j a_ij ẋ_j,   y_i = y₀ + h Σ_j a_ij rate_j,   rate_i = rate(t₀ + c_i h, q₀ ⊕ x_i, y_i)

with accelerations that satisfy the balance and the rows at acceleration level. Positions and velocities at the end are
projected onto the rows in the metric of M, whose rates and multipliers are the consistent ones of that state. Where
positions add, ẋ = v; else ``ẋ = D(x)⁻¹ v`` of the increments x in the chart of the step, which form the vector space
that the formula needs (Munthe-Kaas 1999, Appl. Numer. Math. 29:115).
"""

from __future__ import annotations

from mbd.kernel.algebra.linear import solve_definite, sum_of_sizes
from mbd.kernel.algebra.ordered import LOSS_AT_ONCE, solve_kkt
from mbd.kernel.algebra.redundancy import sharing
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.algebra.saddle import factor_saddle
from mbd.kernel.codes import EPS, INCREMENT_RATES, NOT_CONVERGED, NOT_FINITE, PASSING, SINGULAR
from mbd.kernel.contact.contact_modes import STILL
from mbd.kernel.hooks import call, call_on
from mbd.kernel.records import Balance, DependentRows, Equations, Kernel, Memory, SingularSteps, Steps
from mbd.kernel.schemes.contract import Abilities, Scheme
from mbd.kernel.schemes.dormand_prince import EIGHTH_ORDER
from mbd.kernel.schemes.memory import accept_step, forget_steps
from mbd.kernel.schemes.tableau import Tableau
from mbd.kernel.singular.newmark_step import CONTINUOUS
from mbd.kernel.singular.step_size import accept_row_norms, forget_row_norms, note_row_norms
from mbd.kernel.stepping.free_rates import NOT_CLEAR, free_rates, rates_in_block
from mbd.kernel.stepping.mass_ratios import LOSS, is_uneven, polish_rates, polish_with_rows
from mbd.kernel.stepping.restart import (
    compose,
    consistent,
    displace,
    evaluate,
    fill_block,
    measure_accepted,
    raise_scales,
)
from mbd.kernel.tangent_rules import follow_factors, follow_move, follow_rates, follow_solution, is_differentiated

__all__ = ["SCHEME", "explicit_scheme", "runge_kutta_accept", "runge_kutta_start", "runge_kutta_step"]


def runge_kutta_start(K: SingularSteps) -> int:
    """Sizes of forces and rows at the consistent state; the scheme remembers nothing but its rates."""
    forget_steps(K)
    forget_row_norms(K)
    evaluate(K, K.time, K.q, K.y)
    note_uneven(K)
    find_sizes(K)
    return 0


def note_uneven(K: DependentRows) -> None:
    """Whether stages with rows are corrected by the balance, by the masses in K.acc; not with rows that share loads."""
    m = K.n_active
    K.uneven_masses = 0
    if m > 0 and K.n_frictions == 0 and K.n_dropped == 0 and is_uneven(K, m):
        K.uneven_masses = 1


def find_sizes(K: DependentRows) -> None:
    """Sizes at the accepted state; those of a candidate that is refused must not excuse the next one."""
    measure_accepted(K)


def runge_kutta_step(K: Kernel, h: float, t1: float) -> int:
    """Candidate state (q1, y1, rate1, lam1) and K.error after a step of size h; the accepted state is untouched."""
    n = K.n
    n_v = K.n_v
    width = n_v + n
    stages = K.n_nodes
    at_end = stages * stages
    at_nodes = at_end + stages
    K.failure_time = t1
    K.failure_size = 0.0
    K.failure_step = h
    K.stage_pull = 0.0
    for i in range(n):
        K.stages[n_v + i] = K.rate[i]
        if i < n_v:
            K.stages[i] = K.y[i]
    free = K.treelike == 1 and K.n_active == 0 and K.n_frictions == 0 and not is_differentiated()
    if free:
        fill_block(K, K.time, K.q, K.y)
    for s in range(1, stages):
        t = K.time + K.tableau[at_nodes + s] * h
        explicit_move(K, h, s * stages, s)
        if not (free and stage_in_chart(K, t, s)):
            place_in_chart(K, s)
            status = follow_rates(K, t) if is_differentiated() else explicit_rates(K, t)
            if status != 0:
                return status
        for i in range(n):
            K.stages[s * width + n_v + i] = K.jump[i]
            if i < n_v and K.vector == 1:
                K.stages[s * width + i] = K.y1[i]
    explicit_move(K, h, at_end, stages)
    place_in_chart(K, stages)
    if K.n_active > 0:
        status = return_to_rows(K, t1)
        if status != 0:
            find_sizes(K)
            return status
    if is_differentiated():
        status = follow_rates(K, t1)
    elif K.n_active == 0 and K.n_frictions == 0:
        status = explicit_rates(K, t1)
        K.impulse[: K.n_rows] = 0.0
    else:
        status = rates_at_end(K, t1)
        note_uneven(K)
        if status == 0 and K.uneven_masses == 1 and factor_saddle(K, K.n_active, False, LOSS_AT_ONCE):
            polish_with_rows(K, K.n_active)
    if status != 0:
        return status
    for i in range(n):
        K.rate1[i] = K.jump[i]
        K.aux1[i] = K.jump[i]
        K.block[K.o_a + i] = K.jump[i]
        K.stages[stages * width + n_v + i] = K.jump[i]
        if i < n_v and K.vector == 1:
            K.stages[stages * width + i] = K.y1[i]
    for k in range(K.n_rows):
        K.lam1[k] = K.impulse[k]
        K.block[K.o_lam + k] = K.impulse[k]
    if K.n_active > 0:
        note_row_norms(K)
    explicit_error(K, h)
    if K.near_singular == PASSING and not hold_error(K):
        return SINGULAR
    for i in range(n_v):  # an angle that is wrong by half a radian is not resolved at all
        if K.unit[i] == 1 and not abs(K.error[i]) <= 0.5:
            K.failure_size = -1.0
            find_sizes(K)
            return NOT_CONVERGED
    return 0


def explicit_move(K: Steps, h: float, weights: int, count: int) -> None:
    """h times the weighted slopes of the first stages: y1, and x in K.spare."""
    n_v = K.n_v
    width = n_v + K.n
    if is_differentiated():
        follow_move(K, h, weights, count)
    else:
        K.spare[:width] = 0.0
        for j in range(count):
            weight = h * K.tableau[weights + j]
            if weight != 0.0:
                for i in range(width):
                    K.spare[i] += weight * K.stages[j * width + i]
    for i in range(K.n):
        K.y1[i] = K.y[i] + K.spare[n_v + i]


def place_in_chart(K: Steps, stage: int) -> None:
    """q1 = q ⊕ x with x in K.spare; ẋ there as the slope of a stage."""
    n_v = K.n_v
    if K.vector == 1:
        for i in range(n_v):
            K.q1[i] = K.q[i] + K.spare[i]
        return
    move_in_block(K)
    compose(K, K.q1)
    call(K, INCREMENT_RATES, K.spare)
    begin = stage * (n_v + K.n)
    K.stages[begin : begin + n_v] = K.spare[:n_v]


def move_in_block(K: Equations) -> None:
    """x in K.spare and y1 into the block."""
    for i in range(K.n_v):
        K.block[K.o_x + i] = K.spare[i]
        K.block[K.o_v + i] = K.y1[i]


def stage_in_chart(K: Kernel, t: float, stage: int) -> bool:
    """Both slopes of a stage in the chart of the step, as `place_in_chart` and `explicit_rates` find them; or false.

    The block is that of the accepted state but for what changes within the step; x is in K.spare, which false leaves.
    """
    n_v = K.n_v
    K.block[0] = t
    K.block[K.o_q : K.o_q + K.n_q] = K.q[: K.n_q]
    move_in_block(K)
    pull = rates_in_block(K)
    if pull == NOT_CLEAR:
        K.spare[:n_v] = K.block[K.o_x : K.o_x + n_v]
        return False
    begin = stage * (n_v + K.n)
    K.stages[begin : begin + n_v] = K.spare[:n_v]
    if K.vector == 0:
        K.stage_pull = max(K.stage_pull, pull)
    K.n_residuals += 1
    return True


def explicit_rates(K: Balance, t: float) -> int:
    """Rates at (q1, y1), in K.jump; where friction follows multipliers by the iteration of `consistent`."""
    n = K.n
    m = K.n_active
    if (K.loaded > 0 and (K.n_frictions > 0 or K.rubs == 1)) or sharing(K):
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
            if kept >= LOSS:
                note_pull(K)
            else:
                K.stage_pull = 1e300
        if kept == 0.0:
            return consistent(K, t, K.q1, K.y1)
        if kept < LOSS:
            polish_rates(K, kept)
        return 0
    if K.uneven_masses == 0 and solve_straight(K, m):
        return 0
    if not factor_saddle(K, m, False, LOSS_AT_ONCE):
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
    fastest = 0.0
    change = 0.0
    for i in range(n):
        if i < K.n_v:
            change = max(change, abs(K.rhs[i]))
            fastest = max(fastest, max(abs(K.y[i]), abs(K.y1[i])))
        K.y1[i] += K.rhs[i]
    if change > max(
        CONTINUOUS * fastest, K.rest_speed + STILL
    ):  # rows near a singular configuration take the branch for another
        K.failure_size = 0.0
        return NOT_CONVERGED
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
    return bool(factor_saddle(K, m, True, LOSS_AT_ONCE))


def solve_returns(K: Equations, m: int) -> None:
    """K.rhs ← [M Bᵀ; B 0]⁻¹ K.rhs."""
    if is_differentiated():
        follow_solution(K, m)
    else:
        solve_kkt(K, K.n + m, K.rhs)


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
    if not factor_saddle(K, m, True, LOSS_AT_ONCE):
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


def runge_kutta_accept(K: SingularSteps, h: float) -> None:
    """The candidate becomes the accepted state."""
    accept_step(K, h)
    if K.n_active > 0:
        accept_row_norms(K, h)


def explicit_scheme(name: str, tableau: Tableau, middle: float, stability: float) -> Scheme:
    """The entry of a formula; middle, stability : see `Abilities`."""
    return Scheme(
        name, runge_kutta_start, runge_kutta_step, runge_kutta_accept,
        abilities=Abilities(
            explicit=1, estimates=1, singular_size=1, look_twice=0.1, most_growth=5.0, middle=middle,
            stability=stability,
        ),
        nodes=tuple(tableau.nodes),
        programs="explicit",
        memory=lambda K: {"stages": (tableau.stages + 1) * (K.n_v + K.n), "tableau": len(tableau.flat())},
        coefficients=lambda: {"tableau": tableau.flat()},
    )  # fmt: skip


SCHEME = explicit_scheme("runge-kutta", EIGHTH_ORDER, 0.46666666666666667, 5.96)
"""Its middle lies between the nodes at 1/3 and 3/5."""
