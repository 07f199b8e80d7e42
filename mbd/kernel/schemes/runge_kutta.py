"""One step of an explicit Runge–Kutta formula with its embedded error estimate (Hairer, Nørsett & Wanner
1993, II; coefficients in K.tableau, of `mbd.kernel.schemes.tableau`, of as many stages as the scheme has nodes).

    x_i = h Σ_j a_ij ẋ_j,   y_i = y₀ + h Σ_j a_ij rate_j,   rate_i = rate(t₀ + c_i h, q₀ ⊕ x_i, y_i)

with accelerations that satisfy the balance and the rows at acceleration level. Positions and velocities at the end are
projected onto the rows in the metric of M, whose rates and multipliers are the consistent ones of that state. Where
positions add, ẋ = v; else ``ẋ = D(x)⁻¹ v`` of the increments x in the chart of the step, which form the vector space
that the formula needs (Munthe-Kaas 1999, Appl. Numer. Math. 29:115).
"""

from mbd.equal import DIRECT_PIVOT_RTOL
from mbd.kernel.algebra.saddle import factor_saddle
from mbd.kernel.codes import INCREMENT_RATES, NOT_CONVERGED, PASSING, SINGULAR
from mbd.kernel.hooks import call
from mbd.kernel.records import DependentRows, Equations, Kernel, SingularSteps, Steps
from mbd.kernel.schemes.contract import Abilities, Scheme
from mbd.kernel.schemes.determinant import STEPS_AGAIN, note_determinant
from mbd.kernel.schemes.dormand_prince import EIGHTH_ORDER
from mbd.kernel.schemes.explicit_error import explicit_error, hold_error
from mbd.kernel.schemes.explicit_rates import explicit_rates, rates_at_end
from mbd.kernel.schemes.memory import accept_step, forget_steps
from mbd.kernel.schemes.return_to_rows import return_to_rows
from mbd.kernel.schemes.tableau import Tableau
from mbd.kernel.singular.step_size import accept_row_norms, forget_row_norms, note_row_norms
from mbd.kernel.stepping.free_rates import NOT_CLEAR, rates_in_block
from mbd.kernel.stepping.mass_ratios import is_uneven, polish_with_rows
from mbd.kernel.stepping.restart import (
    compose,
    evaluate,
    fill_block,
    measure_accepted,
)
from mbd.kernel.tangent_rules import follow_move, follow_rates, follow_stage, is_differentiated


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
        if follow_stage(K, h, t, s):
            continue
        explicit_move(K, h, s * stages, s)
        if not (free and stage_in_chart(K, t, s)):
            place_in_chart(K, s)
            status = follow_rates(K, t, s > 1) if is_differentiated() else explicit_rates(K, t)
            if status != 0:
                return status
            if K.many == STEPS_AGAIN:
                note_determinant(K, s)
        for i in range(n):
            K.stages[s * width + n_v + i] = K.jump[i]
        note_velocities(K, s)
    explicit_move(K, h, at_end, stages)
    place_in_chart(K, stages)
    if K.n_active > 0:
        status = return_to_rows(K, t1)
        if status != 0:
            find_sizes(K)
            return status
    if is_differentiated():
        status = follow_rates(K, t1, False)
    elif K.n_active == 0 and K.n_frictions == 0:
        status = explicit_rates(K, t1)
        K.impulse[: K.n_rows] = 0.0
    else:
        status = rates_at_end(K, t1)
        note_uneven(K)
        if status == 0 and K.uneven_masses == 1 and factor_saddle(K, K.n_active, False, DIRECT_PIVOT_RTOL):
            polish_with_rows(K, K.n_active)
    if status != 0:
        return status
    for i in range(n):
        K.rate1[i] = K.jump[i]
        K.aux1[i] = K.jump[i]
        K.block[K.o_a + i] = K.jump[i]
        K.stages[stages * width + n_v + i] = K.jump[i]
    note_velocities(K, stages)
    for k in range(K.n_rows):
        K.lam1[k] = K.impulse[k]
        K.block[K.o_lam + k] = K.impulse[k]
    if is_differentiated():  # of the error only the values count, which were judged
        return 0
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


def note_velocities(K: Steps, stage: int) -> None:
    """The velocities at a stage as its slope of positions, where coordinates add."""
    for i in range(K.n_v if K.vector == 1 else 0):
        K.stages[stage * (K.n_v + K.n) + i] = K.y1[i]


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


def runge_kutta_accept(K: SingularSteps, h: float) -> None:
    """The candidate becomes the accepted state."""
    accept_step(K, h)
    if K.n_active > 0:
        accept_row_norms(K, h)


def explicit_scheme(name: str, tableau: Tableau, middle: float, stability: float, second_look: int) -> Scheme:
    """The entry of a formula; middle, stability, second_look : see `Abilities`."""
    return Scheme(
        name, runge_kutta_start, runge_kutta_step, runge_kutta_accept,
        abilities=Abilities(
            explicit=1, estimates=1, singular_size=1, look_twice=0.1, most_growth=5.0, middle=middle,
            stability=stability, second_look=second_look,
        ),
        nodes=tuple(tableau.nodes),
        programs="explicit",
        memory=lambda K: {"stages": (tableau.stages + 1) * (K.n_v + K.n), "tableau": len(tableau.flat())},
        coefficients=lambda: {"tableau": tableau.flat()},
    )  # fmt: skip


SCHEME = explicit_scheme("runge-kutta", EIGHTH_ORDER, 0.46666666666666667, 5.96, 2)
"""Its middle lies between the nodes at 1/3 and 3/5."""
