"""Rules of the tangent pass that are more than arithmetic, in place of `mbd.kernel.tangent_rules`.

Steps are tried, judged and located by values alone. The candidate that is accepted, or that an event takes over, is
taken once more for its derivatives, at values that are known: explicit formulas operation by operation, implicit ones
by the implicit function theorem, ``J δz = −δr`` at the solution z of ``r(z) = 0`` with one factorization of J (Griewank
& Walther 2008, Evaluating Derivatives, ch. 15). Values stay those of the run to the bit.
"""

from __future__ import annotations

from mbd.kernel.algebra.linear import factor, solve
from mbd.kernel.algebra.ordered import solve_kkt
from mbd.kernel.algebra.redundancy import sharing
from mbd.kernel.codes import CLOSE, CROSS, CROSS_BACK, STICK
from mbd.kernel.contact.cone_steps import across, keeps_direction
from mbd.kernel.contact.cones import along
from mbd.kernel.contact.islands import saddle_entry
from mbd.kernel.events.guards import guard_value, watch
from mbd.kernel.events.transitions import is_due
from mbd.kernel.hooks import call, call_on
from mbd.kernel.records import Integers, Kernel, Reals
from mbd.kernel.schemes.iteration import finish
from mbd.kernel.schemes.radau_end import complete
from mbd.kernel.schemes.stage_layout import (
    CHANGES,
    HELD,
    MU_REAL,
    STAGE_BEND,
    STAGE_RATES,
    STAGE_SHIFT,
    stage_place,
)
from mbd.kernel.schemes.stage_masses import exchange_masses
from mbd.kernel.schemes.stage_matrices import factor_stages, matrices
from mbd.kernel.schemes.stages import (
    correct_positions_of_stages,
    correct_rates,
    evaluate_stages,
    hold_block,
    load_stage,
    predict_stages,
)
from mbd.kernel.stepping.accept_restart import event_at_start, event_candidate
from mbd.kernel.stepping.candidate import carry
from mbd.kernel.stepping.restart import compose, consistent, evaluate, fill_block
from mbd.kernel.stepping.trial_step import try_step

__all__ = [
    "at_root", "every_row_place", "follow_candidate", "follow_event", "follow_factors", "follow_matrix", "follow_move",
    "follow_newton", "follow_rates", "follow_solution", "follow_stages", "follows_rows", "further_corrections",
    "is_differentiated", "note_matrix", "note_solution", "note_step", "seeded", "takes_part", "without_tangent",
]  # fmt: skip

BALANCE = 9
"""The function behind those of `mbd.kernel.codes`: M v̇ + f + R λ and B v̇ + γ of all rows."""
NOT_FOLLOWED = -3
"""Result of `follow_newton` and `follow_stages` where they leave the step to Newton's method."""
FOLLOWED = 1e-12
"""Derivatives of a correction of rates, over the largest of the rates, at which they are those of the solution [-]."""
STALLED = 0.9
"""Part of the last correction of derivatives above which the next one is round-off [-]."""
MAX_CORRECTIONS = 12
"""Corrections of derivatives with matrices that are not quite those of the solution [-]."""


def is_differentiated() -> bool:
    """Whether this code carries derivatives (see `printer`)."""
    return False


def seeded(h: float) -> float:
    """A step size that is differentiated by, in the last direction (see `printer`)."""
    return h


def at_root(h: float, value: float) -> float:
    """The step size h at which a value is zero, with its derivatives ``−g'/ġ`` (see `printer`)."""
    return h


def seed_rate(value: float) -> float:
    """The derivative of a value in the last direction (see `printer`)."""
    return 1.0


def without_tangent(value: float) -> float:
    """The value alone (see `printer`)."""
    return value


def largest_derivative(value: float) -> float:
    """The largest size of the derivatives of a value (see `printer`)."""
    return 0.0


def takes_part(value: float) -> bool:
    """Whether a value or one of its derivatives is not 0: a matrix passes through entries of 0 (see `printer`)."""
    return value != 0.0


# where numbers lie in K.starts: inputs of the last of Newton's matrices | W | the block of the solution | what is noted
# of a step (2), and of the run (1) | the candidate | columns of K₀⁻¹ or stages


def n_inputs(K: Kernel) -> int:
    """How many numbers the inputs of Newton's matrix are."""
    return int(K.o_slip + K.n_frictions + K.n_v)


def solution_place(K: Kernel) -> int:
    """Where the block of the solution begins in K.starts."""
    return int(n_inputs(K) + K.n + K.n_rows + K.n_v)


def step_place(K: Kernel) -> int:
    """Where what is noted of a step begins in K.starts."""
    return int(solution_place(K) + n_inputs(K))


def every_row_place(K: Kernel) -> int:
    """Where K.starts says whether all rows are stored with their derivatives."""
    return int(step_place(K) + 2)


def follows_rows(K: Kernel) -> bool:
    """Whether rows between events are stored with their derivatives; those at events are in any case."""
    return bool(K.starts[every_row_place(K)] == 1.0)


def note_step(K: Kernel) -> None:
    """Whether a singular configuration is near as the step begins."""
    K.starts[step_place(K)] = float(K.near_singular)


def keep_candidate(K: Kernel) -> None:
    """The values of the candidate into K.starts."""
    K.starts[step_place(K) + 1] = float(K.near_singular)
    carry_candidate(K, True)


def restore_candidate(K: Kernel) -> None:
    """The values that the candidate had, which those of `follow_candidate` differ from by round-off."""
    K.near_singular = int(K.starts[step_place(K) + 1])
    carry_candidate(K, False)


def carry_candidate(K: Kernel, out: bool) -> None:
    """The values of the candidate there or back."""
    o = carry(K.q1, K.starts, every_row_place(K) + 1, K.n_q, out)
    o = carry(K.y1, K.starts, o, K.n, out)
    o = carry(K.rate1, K.starts, o, K.n, out)
    o = carry(K.aux1, K.starts, o, K.n, out)
    o = carry(K.lam1, K.starts, o, K.n_rows, out)
    o = carry(K.shift1, K.starts, o, K.n_v, out)
    o = carry(K.guards1, K.starts, o, K.n_watched, out)
    carry(K.limit, K.starts, o, K.n_frictions, out)


def metric_place(K: Kernel) -> int:
    """Where columns of K₀⁻¹, or stages, begin in K.starts."""
    kept = K.n_q + 3 * K.n + K.n_rows + K.n_v + K.n_watched + K.n_frictions
    return int(every_row_place(K) + 1 + kept)


def follow_candidate(K: Kernel, h: float, t1: float) -> int:
    """The candidate once more, with its derivatives; the end of a step of the grid that a timer ends moves with it."""
    if K.n_machines > 0 and is_due(K, t1):
        t1 = without_tangent(t1) + derivative_of(K.due_time)
        h = without_tangent(h) + derivative_of(K.due_time - K.time)
    keep_candidate(K)
    K.near_singular = int(without_tangent(K.starts[step_place(K)]))
    status = try_step(K, h, t1)
    restore_candidate(K)
    return status


def take_again(K: Kernel, h: float) -> int:
    """The candidate of an event by values: the solution of its step is known then."""
    return event_candidate(K, h, K.time + h)


def follow_event(K: Kernel) -> int:
    """The candidate at the event once more: ``δh = −(g_y δy + g_p δp)/ġ``, and with it all that the step leaves.

    The derivative ġ is that of the guard by the size of the step, as the scheme takes it.
    """
    h = without_tangent(K.event_after)
    kind = K.event_kind
    if h <= 0.0 and kind != CLOSE and kind != CROSS and kind != CROSS_BACK:
        K.event_after = h
        return 0
    keep_candidate(K)
    if h > 0.0:
        status = take_again(K, h)
        if status != 0:
            return status
    if h > 0.0 and kind == STICK and keeps_direction(K, K.event_index):
        status = follow_rest(K, h)
        restore_candidate(K)
        return status
    status = candidate_after(K, seeded(h))
    if status != 0:
        return status
    K.event_after = at_root(h, guard_value(K, kind, K.event_index, K.time + seeded(h)))
    status = candidate_after(K, K.event_after)
    restore_candidate(K)
    return status


def follow_rest(K: Kernel, h: float) -> int:
    """The candidate at which a friction in a plane, with its direction e held, comes to rest: δh and the turn δθ of e.

    Both velocities are zero there, that along e and that across it, ``a = 0`` and ``c = 0``:

        a_h δh + a_θ δθ = −δa   c_h δh + c_θ δθ = −δc

    Where several come to rest at one instant, the run has no derivative (`margins`).
    """
    f = K.event_index
    status = candidate_after(K, seeded(h))
    if status != 0:
        return status
    a = along(K, f, K.guards1[K.at_slip + f], K.guards1[K.at_slip + K.partner[f]])
    c = across(K, f)
    turn(K, f, seeded(0.0))
    status = candidate_after(K, h)
    if status != 0:
        return status
    turned_a = along(K, f, K.guards1[K.at_slip + f], K.guards1[K.at_slip + K.partner[f]])
    turned_c = across(K, f)
    turn(K, f, -seeded(0.0))
    K.event_after = at_root(h, seed_rate(turned_c) * a - seed_rate(turned_a) * c)
    turn(K, f, at_root(0.0, seed_rate(a) * turned_c - seed_rate(c) * turned_a))
    return candidate_after(K, K.event_after)


def turn(K: Kernel, f: int, angle: float) -> None:
    """Turn the direction in which friction f and its partner slide."""
    p = K.partner[f]
    x = K.slip[f] - angle * K.slip[p]
    K.slip[p] += angle * K.slip[f]
    K.slip[f] = x


def candidate_after(K: Kernel, h: float) -> int:
    """The candidate of an event after a step of this size; one without length moves it along the motion."""
    if h > 0.0:
        return event_candidate(K, h, K.time + h)
    event_at_start(K)
    fill_block(K, K.time, K.q, K.y)
    for i in range(K.n_v):
        K.block[K.o_x + i] = h * K.y[i]
    compose(K, K.q1)
    for i in range(K.n):
        K.y1[i] += h * K.rate[i]
    if consistent(K, K.time + h, K.q1, K.y1) == 0:
        for i in range(K.n):
            K.rate1[i] = without_tangent(K.rate1[i]) + (K.jump[i] - without_tangent(K.jump[i]))
        for k in range(K.n_rows):
            K.lam1[k] = without_tangent(K.lam1[k]) + (K.impulse[k] - without_tangent(K.impulse[k]))
    watch(K, K.time + h, K.q1, K.y1, K.rate1, K.lam1, K.guards1)
    return 0


# one implicit step at a time ------------------------------------------------------------------------------------------
def note_matrix(K: Kernel) -> None:
    """The inputs that Newton's matrix is made from, into K.starts."""
    size = n_inputs(K)
    K.starts[:size] = K.block[:size]


def note_solution(K: Kernel) -> None:
    """The block of a solution, into K.starts."""
    size = n_inputs(K)
    o = solution_place(K)
    K.starts[o : o + size] = K.block[:size]


def turned_program(K: Kernel) -> int:
    """The number of the program whose derivative is that of Newton's matrix times a given W (see `programs`)."""
    return int(K.residual_program + (3 if K.correction_program > 0 else 1))


def moved(value: float, goal: float) -> float:
    """A value brought to another one, with the derivatives that it has."""
    return value + (without_tangent(goal) - without_tangent(value))


def derivative_of(value: float) -> float:
    """0 with the derivatives of a value."""
    return value - without_tangent(value)


def solve_plain(plain_A: Reals, n: int, pivots: Integers, b: Reals) -> None:
    """b ← A⁻¹ b with the factors of `mbd.kernel.algebra.linear.factor`, which have no derivatives here."""
    for k in range(n):
        p = pivots[k]
        if p != k:
            swap = b[k]
            b[k] = b[p]
            b[p] = swap
    for i in range(1, n):  # by rows: a sum of vectors stays in registers
        total = b[i]
        for k in range(i):
            total -= plain_A[i * n + k] * b[k]
        b[i] = total
    for c in range(n):
        i = n - 1 - c
        total = b[i]
        for k in range(i + 1, n):
            total -= plain_A[i * n + k] * b[k]
        b[i] = total * plain_A[i * n + i]


def follow_newton(K: Kernel, h: float, t1: float, c_C: float, c_K: float) -> int:
    """The derivatives of the solution noted last, from those of the prediction in the block.

    With the position correction W in the metric of Newton's matrix K₀ at the noted inputs, ``K₀ W = (0, g)``, with K
    at the solution, and with r, h, ḣ as the prediction and ``−K₀⁻¹ δK₀ W`` change them,

        K (δv̇, δλ) + (r_x Z, ḣ_x Z/c_C) δg = −(δr, δḣ/c_C)   c_K B δv̇ + B Z δg = −δh   Z = K₀⁻¹ (0, 1)

    is one system. Where coordinates do not add, and with friction in a plane in space, K is nearly the derivative, and
    corrections follow.
    """
    if sharing(K):
        return NOT_FOLLOWED
    n = K.n
    m = K.n_active
    o = solution_place(K)
    at = n_inputs(K)
    # is the position correction another one than was predicted?
    corrects = False
    if m > 0 and K.stabilized == 1:
        for i in range(K.n_v):
            corrects = corrects or K.starts[o + at - K.n_v + i] != K.shift1[i]
    if corrects:
        if is_later_matrix(K):
            return NOT_FOLLOWED
        corrects = begin_corrections(K, m)
    # values of the solution, derivatives of the prediction
    for i in range(n):
        change = without_tangent(K.starts[o + K.o_a + i]) - without_tangent(K.block[K.o_a + i])
        K.block[K.o_a + i] += change
        K.block[K.o_v + i] += c_C * change
        if i < K.n_v:
            K.block[K.o_x + i] += c_K * change
    for k in range(m):
        place = K.o_lam + K.rows[k]
        K.block[place] = moved(K.block[place], K.starts[o + place])
    by_v = without_tangent(c_C)
    by_x = without_tangent(c_K)
    size = n + 2 * m if corrects else n + m
    if prepare_newton(K, m, size, by_v, by_x) != 0:
        return NOT_FOLLOWED
    o_Z = metric_place(K)
    exact = K.vector == 1 and K.n_cones == 0  # is the matrix the derivative itself?
    before = 1e300
    for _ in range(MAX_CORRECTIONS):
        call(K, K.residual_program, K.out)
        for i in range(n):
            K.rhs[i] = -derivative_of(K.out[i])
        for k in range(m):
            K.rhs[n + k] = right_hand_side(K, k, m, by_v, by_x)
        for k in range(size - n - m):
            K.rhs[n + m + k] = 0.0 if K.row_level[K.rows[k]] == 1 else -derivative_of(K.out[n + k])
        solve_plain(K.kkt, size, K.pivots, K.rhs)
        for i in range(K.n_v if corrects else 0):
            total = 0.0
            for k in range(m):
                total += without_tangent(K.starts[o_Z + k * (n + m) + i]) * K.rhs[n + m + k]
            K.shift1[i] += total
            K.block[K.o_x + i] += total
        change_of = 0.0
        largest = 0.0
        for i in range(n):
            K.block[K.o_a + i] += K.rhs[i]
            K.block[K.o_v + i] += by_v * K.rhs[i]
            if i < K.n_v:
                K.block[K.o_x + i] += by_x * K.rhs[i]
            if not exact:
                change_of = max(change_of, largest_derivative(K.rhs[i]))
                largest = max(largest, largest_derivative(K.block[K.o_a + i]))
        for k in range(m):
            K.block[K.o_lam + K.rows[k]] += K.rhs[n + k]
        if exact or change_of <= FOLLOWED * largest or change_of > STALLED * before:
            break
        before = change_of
    finish(K, h)
    return 0


def is_later_matrix(K: Kernel) -> bool:
    """Whether the matrix noted last is that of an iterate, whose derivatives are not those of the prediction."""
    later = False
    for i in range(n_inputs(K)):
        later = later or without_tangent(K.starts[i]) != without_tangent(K.block[i])
    return later


def right_hand_side(K: Kernel, k: int, m: int, c_C: float, c_K: float) -> float:
    """Of active row k in the equations of rates and multipliers, as `schemes.newton.right_hand_sides` has it."""
    if K.stabilized == 1:
        return -derivative_of(K.out[K.n + m + k]) / c_C
    return -derivative_of(K.out[K.n + k]) / (c_C if K.row_level[K.rows[k]] == 1 else c_K)


def prepare_newton(K: Kernel, m: int, size: int, c_C: float, c_K: float) -> int:
    """Factors of the matrix of `follow_newton` at the block, with δg where it is that large; 0, or it is singular."""
    n = K.n
    whole = n + m
    call(K, K.tangent_program, K.out)
    if size == whole:
        K.kkt[: whole * whole] = K.out[: whole * whole]
    else:
        K.spare[: whole * whole] = K.out[: whole * whole]
        K.block_c_K = 0.0  # what K is less then is the part of it that positions make
        call(K, K.tangent_program, K.out)
        K.block_c_K = c_K
        enlarge(K, m, size, c_K)
    K.order_start = 0
    return factor(K.kkt, size, K.pivots)


def enlarge(K: Kernel, m: int, size: int, c_K: float) -> None:
    """``[K P; c_K B  B Z]`` with ``P = (r_x Z, ḣ_x Z/c_C)`` in K.kkt; K is in K.spare, what it is at c_K = 0 in K.out.

    A row on velocities corrects no positions: its part of δg is 0.
    """
    n = K.n
    whole = n + m
    o_Z = metric_place(K)
    inverse = 1.0 / c_K
    for i in range(whole):
        K.kkt[i * size : i * size + whole] = K.spare[i * whole : i * whole + whole]
        for j in range(K.n_v):
            K.spare[i * whole + j] = (K.spare[i * whole + j] - K.out[i * whole + j]) * inverse
        for k in range(m):
            total = 0.0
            for j in range(K.n_v):
                total += K.spare[i * whole + j] * K.starts[o_Z + k * whole + j]
            K.kkt[i * size + whole + k] = total
    for i in range(m):
        o = (whole + i) * size
        K.kkt[o : o + size] = 0.0
        if K.row_level[K.rows[i]] == 1:
            K.kkt[o + whole + i] = 1.0
        else:
            for j in range(K.n_v):
                K.kkt[o + j] = c_K * K.out[(n + i) * whole + j]
            for k in range(m):
                total = 0.0
                for j in range(K.n_v):
                    total += K.out[(n + i) * whole + j] * K.starts[o_Z + k * whole + j]
                K.kkt[o + whole + k] = total


def prepare_metric(K: Kernel, m: int) -> int:
    """Factors of K₀, columns Z of its inverse behind the candidate in K.starts, and W of `follow_newton` from them."""
    n = K.n
    size = n + m
    at = n_inputs(K)
    call_on(K, K.tangent_program, K.starts, K.out)
    K.kkt[: size * size] = K.out[: size * size]
    K.order_start = 0
    if factor(K.kkt, size, K.pivots) != 0:
        return 1
    shift = solution_place(K) + at - K.n_v
    K.starts[at : at + size + K.n_v] = 0.0  # what rows make of W is left to g
    o_Z = metric_place(K)
    for k in range(m):
        K.work[:size] = 0.0
        K.work[n + k] = 1.0
        solve(K.kkt, size, K.pivots, K.work)
        g = 0.0
        for j in range(K.n_v):
            g += K.out[(n + k) * size + j] * K.starts[shift + j]
        for i in range(size):
            K.starts[at + i] += K.work[i] * g
            K.starts[o_Z + k * size + i] = K.work[i]
        if K.row_level[K.rows[k]] == 1:  # those on velocities correct no positions
            K.starts[o_Z + k * size : o_Z + k * size + size] = 0.0
    return 0


def begin_corrections(K: Kernel, m: int) -> bool:
    """The position correction of the solution in the block, with the derivatives −K₀⁻¹ δK₀ W; whether K₀ is regular."""
    size = K.n + m
    at = n_inputs(K)
    shift = solution_place(K) + at - K.n_v
    for i in range(at):
        K.starts[i] = moved(K.block[i], K.starts[i])
    if prepare_metric(K, m) != 0:
        return False
    for i in range(size + K.n_v):
        K.starts[at + i] = without_tangent(K.starts[at + i])
    call_on(K, turned_program(K), K.starts, K.spare)
    for i in range(size):
        K.work[i] = -derivative_of(K.spare[i])
    solve_plain(K.kkt, size, K.pivots, K.work)
    for i in range(K.n_v):
        found = without_tangent(K.starts[shift + i]) + derivative_of(K.work[i])
        K.block[K.o_x + i] += found - K.shift1[i]
        K.shift1[i] = found
    return True


def further_corrections() -> int:
    """Those that derivatives need to follow the solution where `NOT_FOLLOWED`, as they lag behind it by one."""
    return 3 if is_differentiated() else 0


def follow_matrix(K: Kernel, m: int, x: Reals, whole: bool) -> None:
    """``K x = b → K δx = δb − δK x`` of a correction x, whose derivatives are all but −K⁻¹ δK x.

    ``δK x`` is the derivative of a program of the mode (see `programs`) that reads x behind the inputs of the matrix,
    and for the rows what is left of it without the position correction that was there, with `whole`.
    """
    size = K.n + m
    o = n_inputs(K)
    for i in range(size):
        K.starts[o + i] = without_tangent(x[i])
    for i in range(K.n_v):
        K.starts[o + size + i] = without_tangent(x[i])
        if whole:
            K.starts[o + size + i] -= without_tangent(K.shift1[i])
    call_on(K, turned_program(K), K.starts, K.spare)
    for i in range(size):
        K.spare[i] -= without_tangent(K.spare[i])
    solve_kkt(K, size, K.spare)
    for i in range(size):
        x[i] -= K.spare[i]


# accelerations at a state ---------------------------------------------------------------------------------------------
def prepare_rates(K: Kernel, t: float, m: int) -> int:
    """Factors of ``[M R; B 0]`` at (q1, y1), with (v̇, λ) in K.rhs; 0, or that it is singular."""
    n = K.n
    size = n + m
    evaluate(K, t, K.q1, K.y1)
    for i in range(size):
        for j in range(size):
            K.kkt[i * size + j] = saddle_entry(K, i, j, False)
    K.order_start = 0
    if factor(K.kkt, size, K.pivots) != 0:
        return 1
    for i in range(n):
        K.rhs[i] = -K.acc[K.acc_f + i]
    for k in range(m):
        K.rhs[n + k] = -K.acc[K.acc_bias + K.rows[k]]
    solve(K.kkt, size, K.pivots, K.rhs)
    return 0


def follow_rates(K: Kernel, t: float) -> int:
    """Consistent rates of (q1, y1) in K.jump, multipliers in K.impulse: `consistent` where friction follows λ, else

    ``[M R; B 0] (δv̇, δλ) = −δ(M v̇ + f + R λ, B v̇ + γ)`` with v̇ and λ held.
    """
    n = K.n
    m = K.n_active
    if K.n_frictions > 0 or K.loaded > 0 or K.rubs == 1 or K.n_dropped > 0 or prepare_rates(K, t, m) != 0:
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
    solve_plain(K.kkt, n + m, K.pivots, K.rhs)
    for i in range(n):
        K.jump[i] += K.rhs[i]
    for k in range(m):
        K.impulse[K.rows[k]] += K.rhs[n + k]
    return 0


# an explicit step -----------------------------------------------------------------------------------------------------
def follow_move(K: Kernel, h: float, weights: int, count: int) -> None:
    """h times the weighted slopes of the first stages into K.spare, as `schemes.runge_kutta.explicit_move` has it."""
    width = K.n_v + K.n
    for i in range(width):
        total = 0.0
        for j in range(count):
            if K.tableau[weights + j] != 0.0:
                total += K.tableau[weights + j] * K.stages[j * width + i]
        K.spare[i] = h * total


def follow_factors(K: Kernel, m: int) -> bool:
    """LU factors of ``A = [M Bᵀ; B 0]`` from K.acc, which have no derivatives; false where a pivot is missing."""
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
            K.kkt[i * size + n + k] = K.acc[row + i]
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
    solve_plain(K.kkt, size, K.pivots, K.rhs)
    for i in range(size):
        K.rhs[i] += without_tangent(K.work[i])


# a step of several stages ---------------------------------------------------------------------------------------------
def n_stage_numbers(K: Kernel) -> int:
    """How many numbers the unknowns of all stages are."""
    return int(3 * (K.n + K.n_rows + K.n_v))


def keep_stages(K: Kernel) -> None:
    """The values of the stages behind the candidate in K.starts."""
    place = metric_place(K)
    o = stage_place(K, STAGE_RATES)
    for i in range(n_stage_numbers(K)):
        K.starts[place + i] = K.stages[o + i]
    if K.vector == 0:
        o = stage_place(K, STAGE_BEND)
        for i in range(3 * K.n_v):
            K.starts[place + n_stage_numbers(K) + i] = K.stages[o + i]


def restore_stages(K: Kernel) -> None:
    """The values that stages had."""
    place = metric_place(K)
    o = stage_place(K, STAGE_RATES)
    for i in range(n_stage_numbers(K)):
        K.stages[o + i] = K.starts[place + i]
    if K.vector == 0:
        o = stage_place(K, STAGE_BEND)
        for i in range(3 * K.n_v):
            K.stages[o + i] = K.starts[place + n_stage_numbers(K) + i]


def prepare_stages(K: Kernel, m: int, h: float, t1: float) -> int:
    """Newton's matrices at the middle stage, factored, their rows behind the stages; 0, or that one is singular."""
    load_stage(K, 1, h, t1)
    matrices(K, m, h)
    o = metric_place(K) + n_stage_numbers(K) + 3 * K.n_v
    for k in range(m):
        for j in range(K.n_v):
            K.starts[o + k * K.n_v + j] = K.kkt[(K.n + k) * (K.n + m) + j]
    return 0 if factor_stages(K, K.n + m) else 1


def follow_held(K: Kernel, m: int) -> None:
    """The derivatives of H U_i, with H held, for the first correction of positions (see `stage_matrices.keep_held`)."""
    o_U = stage_place(K, STAGE_SHIFT)
    o_H = stage_place(K, HELD)
    o_Z = metric_place(K) + n_stage_numbers(K) + 3 * K.n_v
    for i in range(3):
        for k in range(m):
            total = 0.0
            for j in range(K.n_v):
                total += without_tangent(K.starts[o_Z + k * K.n_v + j]) * derivative_of(K.stages[o_U + i * K.n_v + j])
            K.stages[o_H + i * m + k] = without_tangent(K.stages[o_H + i * m + k]) + total


def follow_stages(K: Kernel, h: float, t1: float, m: int) -> int:
    """The derivatives of the stages that are there, from those of their prediction.

    The matrices are those of the middle stage, as in the step itself: corrections are taken until they are round-off.
    """
    if sharing(K):
        return NOT_FOLLOWED
    n = K.n
    c = without_tangent(K.stages[MU_REAL] * h)
    keep_stages(K)
    hold_block(K)
    predict_stages(K, h, m)
    # values of the solution, derivatives of the prediction
    place = metric_place(K)
    o = stage_place(K, STAGE_RATES)
    for i in range(n_stage_numbers(K)):
        K.stages[o + i] = moved(K.stages[o + i], K.starts[place + i])
    if K.vector == 0:
        o_E = stage_place(K, STAGE_BEND)
        for i in range(3 * K.n_v):
            K.stages[o_E + i] = without_tangent(K.starts[place + n_stage_numbers(K) + i])
    if prepare_stages(K, m, h, t1) != 0:
        return NOT_FOLLOWED
    size = n + m
    for i in range(size * size):
        K.kkt[i] = without_tangent(K.kkt[i])
    o_D = stage_place(K, CHANGES)
    before = 1e300
    for iteration in range(MAX_CORRECTIONS):
        evaluate_stages(K, h, t1, m, 1.0, c, c * c, False)
        if K.vector == 0 and m == 0:
            exchange_masses(K, h, t1)
        if m > 0:
            if iteration == 0:
                follow_held(K, m)
            correct_positions_of_stages(K, m, h, iteration == 0)
        correct_rates(K, m, h)
        change = 0.0
        largest = 0.0
        for i in range(3):
            for j in range(n):
                change = max(change, largest_derivative(K.stages[o_D + i * size + j]))
                largest = max(largest, largest_derivative(K.stages[o + i * n + j]))
        if change <= FOLLOWED * largest or change > STALLED * before:
            break
        before = change
    status = complete(K, h, t1, m, False, False)
    restore_stages(K)
    return status
