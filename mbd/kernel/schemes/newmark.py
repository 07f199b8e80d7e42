"""One implicit step of the Newmark family, and its start (Arnold & Brüls 2007, Multibody Syst. Dyn. 18:185).

Newton's method (`newton`) on (v̇₁, ż₁, λ) with the exact tangent S = M + c_C C_t + c_K K_t; the stabilized form adds
the position correction U in the metric of the same matrix (Gear, Gupta & Leimkuhler 1985). First-order states z follow
the velocity formulas of the scheme with their own rate ż, of order 2 as well (Jansen, Whiting & Hulbert 2000).
"""

from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.codes import PASSING
from mbd.kernel.contact.cones import HOLD_DIRECTION, follows, friction_size
from mbd.kernel.records import Balance, Guards, Kernel, Steps
from mbd.kernel.schemes.contract import Scheme
from mbd.kernel.schemes.direction_continuation import (
    NO_HOLD,
    begin_continuation,
    continue_directions,
    wants_continuation,
)
from mbd.kernel.schemes.iteration import predict, shift_growth
from mbd.kernel.schemes.memory import accept_step, forget_steps, look_a_step_ahead, start_step
from mbd.kernel.schemes.newton import BAD_FACTORS, PIVOTS_SEARCHED, solve_step
from mbd.kernel.singular.newmark_step import singular_newmark_step
from mbd.kernel.stepping.charts import find_chart_end
from mbd.kernel.stepping.conditioning import is_ill_conditioned, refine_accelerations
from mbd.kernel.stepping.mass_ratios import excuses_much, is_uneven
from mbd.kernel.stepping.restart import (
    compose,
    consistent,
    fill_block,
    lower_to_step,
    measure_accepted,
    take_consistent,
)

MAX_MULTIPLIER_ERROR_RATIO = 16.0
"""Error of multipliers of a step, over their change in it, that is taken into account [-].

Errors of some ten times were found where forces rise and fall by much of themselves from step to step.
"""


def newmark_start(K: Kernel) -> int:
    """Memory of the scheme at a consistent state: a₀ = v̇₀ + (α_m − α_f) dt j₀, j₀ by a difference (or a₀ = v̇₀).

    What forces are behind their next jump in time tells nothing of the jerk before it.
    """
    full = start_step(K)
    step = full / 16.0
    t = K.time
    forget_steps(K)
    fill_block(K, t, K.q, K.y)
    for i in range(K.n_v):  # a little later along the tangent: a parabola would blow stiff forces up by (ω dt)²
        K.block[K.o_x + i] = step * K.y[i]
    compose(K, K.q1)
    for i in range(K.n):
        K.y1[i] = K.y[i] + step * K.rate[i]
    status = consistent(K, t + step, K.q1, K.y1)
    if status == 0 and is_ill_conditioned(K):
        status = refine_accelerations(K)
    for i in range(K.n):
        K.slope[i] = (K.jump[i] - K.rate[i]) / step if status == 0 else 0.0
        K.aux[i] = K.rate[i] + (K.jerk * (K.alpha_m - K.alpha_f) * full) * K.slope[i]
    for k in range(K.n_rows):
        K.lam_slope[k] = (K.impulse[k] - K.lam[k]) / step if status == 0 else 0.0
    measure_accepted(K)
    K.uneven_masses = 0
    if K.vector == 0 and status == 0 and (excuses_much(K) or is_uneven(K, K.n_active)):
        K.uneven_masses = 1
    if unresolved(K) or t < K.next_jump < t + step:
        for i in range(K.n):
            K.slope[i] = 0.0
            K.aux[i] = K.rate[i]
    look_a_step_ahead(K)
    K.scales_of_start = 1
    return 0


def unresolved(K: Steps) -> bool:
    """Whether accelerations would change within dt to a hundred times what all terms of the balance make up now.

    A jerk like that (a stiff contact that closes, shorter than dt) is no start for anything: a₀ = v̇₀ then.
    """
    change = 0.0
    known = 0.0
    for i in range(K.n_v):
        change = max(change, abs(K.slope[i]) * start_step(K))
        known = max(known, abs(K.rate[i]))
        if K.acc[i * K.n + i] > 0.0:
            known = max(known, K.scale[i] / K.acc[i * K.n + i])
    return change > 100.0 * known


def newmark_step(K: Kernel, h: float, t1: float) -> int:
    """Candidate state (q1, y1, rate1, aux1, lam1) after a step of size h; the accepted state is untouched."""
    if K.near_singular == PASSING:
        return singular_newmark_step(K, h, t1)
    c = (1.0 - K.alpha_f) / (1.0 - K.alpha_m)
    c_C = K.gamma * h * c
    c_K = K.beta * h * h * c
    tangents = 0
    hold = NO_HOLD
    while True:  # called from one place, the iteration stays in one piece with the step
        if hold == NO_HOLD or hold == HOLD_DIRECTION:
            predict(K, h, t1, c_C, c_K)
        status = solve_step(K, h, t1, c_C, c_K, tangents)
        if status == BAD_FACTORS and hold == NO_HOLD:
            tangents = (
                PIVOTS_SEARCHED  # pivots in a fixed order were round-off: from the prediction again, with a search
            )
        elif hold == NO_HOLD and wants_continuation(K, status):
            tangents = PIVOTS_SEARCHED
            hold = begin_continuation(K)
        elif hold > 0.0:
            hold = continue_directions(K, hold, status)
            if status != 0:
                return status
        elif not (status == 0 and K.scales_of_start == 1 and lower_to_step(K)):
            if status == 0 and K.driven == 1 and K.n_active > 0 and (K.adaptive == 1 or may_switch(K)):
                balance_end(K, t1)
            return status
        else:
            hold = NO_HOLD


def may_switch(K: Guards) -> bool:
    """Whether a contact may come to pull, or a friction to its limit, within the errors of the multipliers of a step.

    These are `MAX_MULTIPLIER_ERROR_RATIO` times what the step changes of them.

    Elsewhere nothing hangs on multipliers that alternate.
    The limit of a friction falls in the ratio of its contact force.
    """
    # contacts; the multipliers of those that push are negative
    for c in range(K.n_contacts):
        if K.closed[c] == 1 and K.kind[c] == 0 and K.opens[c] == 0 and K.normal[c] >= 0:
            row = K.normal[c]
            if K.lam1[row] + MAX_MULTIPLIER_ERROR_RATIO * abs(K.lam1[row] - K.lam[row]) > 0.0:
                return True
    # frictions, each group once
    for f in range(K.n_frictions):
        if K.sticks[f] == 1 and not follows(K, f):
            limit = K.guards0[K.at_limit + f]
            c = K.friction_contact[f]
            if c >= 0 and K.normal[c] >= 0:
                row = K.normal[c]
                limit -= MAX_MULTIPLIER_ERROR_RATIO * abs(K.lam1[row] - K.lam[row]) / (abs(K.lam[row]) + 1e-300) * limit
            elif K.loaded > 0:  # the limit may follow any multiplier
                return True
            square = 0.0
            for g in range(f, f + K.group_size[f]):
                change = K.lam1[K.friction_row[g]] - K.lam[K.friction_row[g]]
                square += change * change
            if friction_size(K, f, K.lam1) + MAX_MULTIPLIER_ERROR_RATIO * sqrt(square) > limit:
                return True
    return False


def balance_end(K: Balance, t1: float) -> None:
    """Rates and multipliers of the candidate are those of the balance there, ``B v̇ + γ = 0``, where there are any.

    Rows fix v₁ and with it a₁, ``a₁ = −(1 − γ)/γ a₀ + …``: an error of a, as each change of the step leaves, returns in
    the next step with its sign turned, and so in v̇ and λ. Across the rows v̇ satisfies the balance anyway and stays.
    """
    if consistent(K, t1, K.q1, K.y1) == 0:
        share = (1.0 - K.alpha_f) / (1.0 - K.alpha_m)
        for i in range(K.n):
            K.aux1[i] += share * (K.jump[i] - K.rate1[i])
            K.rate1[i] = K.jump[i]
        K.lam1[: K.n_rows] = K.impulse[: K.n_rows]
    for i in range(K.n):
        K.block[K.o_a + i] = K.rate1[i]
    K.block[K.o_lam : K.o_lam + K.n_rows] = K.lam1[: K.n_rows]


def newmark_accept(K: Steps, h: float) -> None:
    """The candidate becomes the accepted state."""
    part = part_of_change(K, h)
    for i in range(K.n_v):
        K.shift_change[i] = part * (K.shift1[i] - K.shift[i])
        K.shift[i] = K.shift1[i]
    accept_step(K, h)


def part_of_change(K: Steps, h: float) -> float:
    """Part of the last change of the position correction that the next prediction goes on with.

    Where h was below round-off, the correction is its own prediction, and a part of it along the motion shows nowhere:
    extrapolated again, such parts would grow. Then nothing of the change is used, and half of the next one.
    """
    if K.stabilized == 0 or K.n_active == 0:
        return 1.0
    stretch = h / K.aux_step
    cube = shift_growth(K, h)
    predicted = True
    known = False
    for i in range(K.n_v):
        predicted = predicted and K.shift1[i] == (K.shift[i] + stretch * K.shift_change[i]) * cube
        known = known or K.shift_change[i] != 0.0
        if known and not predicted:
            return 1.0
    return 0.0 if predicted else 0.5


def newmark_resume(K: Kernel, h: float) -> int:
    """Start from the accepted state, the end of a step of size h, with the rates in K.jump, multipliers in K.impulse.

    Only the auxiliary a is carried over: it keeps its distance from v̇, where a start would err by dt².
    """
    for i in range(K.n):
        K.aux1[i] = (K.aux[i] - K.rate[i]) * (start_step(K) / h)
    take_consistent(K)
    status = newmark_start(K)
    for i in range(K.n):
        K.aux[i] = K.rate[i] + K.aux1[i]
    return status


def newmark_error(K: Steps, h: float) -> None:
    """K.error: ``h² (1/6 − β − (α_m − α_f)/2) (a₁ − a₀)`` of positions, the first factor being K.error_constant.

    That of velocities and first-order states is ``h²/12`` times the change of the slope of their rates. Where positions
    do not add, ``ẋ = v`` leaves ``∫(ẋ − v) dt = h (ẋ₁ − v₁)/3`` as well, as ẋ − v grows with the square of time.
    """
    stretch = h / K.aux_step
    share = h * h * K.error_constant
    for i in range(K.n):
        a0 = K.rate[i] + stretch * (K.aux[i] - K.rate[i])
        if i < K.n_v:
            K.error[i] = share * (K.aux1[i] - a0)
        K.error[K.n_v + i] = h * h / 12.0 * ((K.rate1[i] - K.rate[i]) / h - K.slope[i])
    if K.vector == 0:
        find_chart_end(K)
        for i in range(K.n_v):
            K.error[i] += h / 3.0 * (K.chart_end[K.n_v + i] - K.y1[i])


SCHEME = Scheme(
    "newmark", newmark_start, newmark_step, newmark_accept, newmark_resume, newmark_error,
    programs="stepping",
)  # fmt: skip
