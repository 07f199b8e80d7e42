"""Newton's method for the unknowns of one step of the Newmark family (`newmark`): rates, multipliers.

The tangent K is that of the compiled model at the iterate, or factors of it and the first correction made by
straight-line code. The stabilized form corrects positions by U first, then the rates, in the metric of the same matrix.
"""

from mbd.equal import HALF_PRECISION_RTOL
from mbd.kernel.algebra.linear import factor
from mbd.kernel.algebra.ordered import OF_TANGENT, clear_tangent, columns_at, factor_ordered, order_at, solve_kkt
from mbd.kernel.algebra.redundancy import sharing
from mbd.kernel.codes import EPS, NOT_CONVERGED, NOT_FINITE, SINGULAR, STAGNATED, TOO_NEAR, TOO_TIGHT
from mbd.kernel.hooks import call, call_on
from mbd.kernel.records import DependentRows, Equations, Kernel, Reals, Report, SingularSteps
from mbd.kernel.schemes.iteration import (
    MAX_ITERATIONS,
    MIN_HALVED_RESIDUAL,
    finish,
    is_below_floors,
    overturns,
    residual_size,
    roughly,
    runs_away,
    soundness_at,
    weigh_by_accelerations,
)
from mbd.kernel.singular.newmark_step import (
    MAX_STEPS_AWAY,
    misses,
    singular_newmark_step,
    steps_by_pivot,
    steps_to_singularity,
)
from mbd.kernel.singular.step_pairs import is_whole
from mbd.kernel.stepping.mass_ratios import has_settled
from mbd.kernel.stepping.restart import (
    add_shares,
    note_scales,
    raise_scales,
    restore_scales,
    retain_scales,
    share_loads,
)
from mbd.kernel.tangent_rules import (
    NOT_FOLLOWED,
    follow_matrix,
    follow_newton,
    further_corrections,
    is_differentiated,
    note_matrix,
    note_solution,
)

MAX_FIXED_ORDER = 2
"""Tangents of a step that straight-line code may factor: where it takes more, pivots are searched for."""
PIVOTS_SEARCHED = MAX_FIXED_ORDER + 1
"""More than `MAX_FIXED_ORDER`: counted as the tangents before the first of a step whose pivots are all searched for."""
BAD_FACTORS = -1
"""Result of `solve_step` where factors in a fixed order led to a correction that is no solution at all."""


def solve_step(K: Kernel, h: float, t1: float, c_C: float, c_K: float, tangents: int) -> int:
    """The candidate from the prediction in the block; 0, or why there is none; `BAD_FACTORS`.

    Newton's method, its corrections halved where the residual grows: one tangent, then residuals with its factors; a
    new tangent where the residual falls by less than a factor of three. Factors in a fixed order are tried where fewer
    than `MAX_FIXED_ORDER` `tangents` were counted; a pivot of round-off passes for one of its own size, so it is the
    residual that judges them.
    """
    if is_differentiated():
        status = follow_newton(K, h, t1, c_C, c_K)
        if status != NOT_FOLLOWED:
            return status
    m = K.n_active
    tolerance = min(4.0 * EPS, K.tolerance) if K.exact == 1 else 1e-3 * K.tolerance
    before = 1e300
    left = 1e300  # the error where the last correction started
    halvings = 0
    fixed = False  # whether the last correction came from pivots in a fixed order
    straight = False  # whether the factors at hand are those of straight-line code
    fresh = False
    together = sharing(K)
    first = 0.0  # what the first correction changed, the last and the one before, of the fastest rate
    moved = 1e300
    last = 0.0
    further = 0
    for iteration in range(MAX_ITERATIONS + further_corrections()):
        tangent = not fresh
        if together:
            share_loads(K, m, iteration > 10)  # shares that go round and round with the loads would never end
        if tangent:
            straight = renew(K, m, tangents)
            note_matrix(K)
            tangents += 1
        else:
            call(K, K.residual_program, K.out)
            K.n_residuals += 1
        o_r = (K.n + m) * (K.n + m) if tangent and not straight else 0
        error = residual_size(K, o_r, m, c_C, c_K, tolerance, K.stabilized)
        # shares that follow loads change it as well
        grown = error > MIN_HALVED_RESIDUAL and error > 0.9 * left and not together
        if grown and m > 0:
            vanishing = weigh_by_accelerations(K)
            if vanishing or K.stabilized == 0:  # of index 3 the rows alone ask for accelerations
                size = residual_size(K, o_r, m, c_C, c_K, tolerance, K.stabilized)
                grown = size > MIN_HALVED_RESIDUAL and size > 0.9 * size_before(K, m, c_C, c_K, tolerance)
            restore_scales(K)
        if halvings < 10 and iteration > 0 and (error < 0.0 or grown):
            if fixed:
                K.inverse_pivot = 0.0
                return BAD_FACTORS
            retreat(K, m, c_C, c_K)  # a full Newton step jumped over a steep place
            halvings += 1
            continue
        if error < 0.0:
            return no_candidate(K, h, t1, NOT_FINITE)
        K.failure_size = error
        if error > 1.0 and iteration >= 2 and error > 0.5 * before:
            error = second_look(K, o_r, m, c_C, c_K, tolerance, iteration)
            if error < 0.0:
                return no_candidate(K, h, t1, int(-error))
        whole = last if halvings == 0 else 0.0  # what is left of a correction by half is no round-off
        if error <= 1.0 and (K.uneven_masses == 0 or has_settled(moved, whole, 1e-4 * first)):
            if further == further_corrections():
                return conclude_step(K, h, t1)
            further += 1
        if not tangent and error > max(1.0, 0.3 * before):
            fresh = False  # the old tangent has done its work: renew it at the same iterate
            before = 1e300
            continue
        before = K.failure_size  # as measured: one that passes as round-off is no bound for the next
        left = K.failure_size
        halvings = 0
        ready = tangent and straight  # the correction has come with the tangent
        shifting = ready and take_shift(K, m)
        if not ready or (m > 0 and K.stabilized == 1 and not shifting):
            ready = False
            shifting = right_hand_sides(K, o_r, m, c_C, c_K, tangent, straight)
        if tangent and not straight and not factorize(K, K.n + m, tangents):
            return no_candidate(K, h, t1, SINGULAR)
        if iteration == 0 and m > 0 and K.stabilized == 1 and not is_differentiated():
            status = pass_singularity(K, h, t1, m, c_C, c_K, straight)
            if status >= 0:
                return status
        if not ready:
            solve_corrections(K, m, c_C, tangent, shifting, straight)
        fixed = straight or K.order_start > 0
        last = moved
        moved = correct(K, m, c_C, c_K, ready, shifting)
        if iteration == 0:
            first = moved
            if K.exact == 0:  # the predictor's error measures that of the step: stay far below it
                tolerance = min(K.tolerance, max(1e-4 * moved, tolerance))
        fresh = tangent or error > 1.0 or moved <= 0.3 * last or further > 0
        last = last if tangent else 0.0  # an old tangent leaves much of an error too: only a new one tells round-off
    return no_candidate(K, h, t1, NOT_CONVERGED)


def no_candidate(K: Report, h: float, t1: float, status: int) -> int:
    """The status, after noting which step has none."""
    K.failure_time = t1
    K.failure_step = h
    return status


def conclude_step(K: Kernel, h: float, t1: float) -> int:
    """The iterate becomes the candidate, unless the step is far too long for it."""
    note_solution(K)
    if finish(K, h):
        K.changes_little = 1.0
    elif overturns(K, h):
        K.failure_size = -1.0
        return no_candidate(K, h, t1, NOT_CONVERGED)
    return 0


def second_look(K: Equations, o_r: int, m: int, c_C: float, c_K: float, tolerance: float, iteration: int) -> float:
    """A residual that falls no more, over its tolerance with sizes of forces as they are here; 1 if it is round-off.

    −status where the iteration is to end, and K.failure_size is what is left over what was asked for.
    """
    note_scales(K)
    raise_scales(K, True)
    if runs_away(K, m):
        restore_scales(K)
        return -float(NOT_CONVERGED)
    error = residual_size(K, o_r, m, c_C, c_K, tolerance, K.stabilized)
    left = 0.0
    if error > 1.0:
        if residual_size(K, o_r, m, 0.0, 0.0, 256.0 * EPS, K.stabilized) <= roughly(K):
            left = residual_size(K, o_r, 0, c_C, c_K, K.tolerance, K.stabilized)  # rows at round-off hold
            if left > 1.0:
                error = -float(TOO_TIGHT)
            else:
                K.n_stagnations += 1
                error = 1.0
        elif iteration >= 6 and K.exact == 0:
            if residual_size(K, o_r, m, 0.0, 0.0, 1e5 * EPS, K.stabilized) <= 1e3:
                left = residual_size(K, o_r, m, c_C, c_K, K.tolerance, K.stabilized)
                error = -float(STAGNATED)
        if (error > 1.0 or error == -float(STAGNATED)) and is_below_floors(K, o_r, m, K.stabilized):
            K.n_stagnations += 1
            error = 1.0
        elif error < 0.0:
            K.failure_size = left
    if 0.0 <= error <= 1.0:
        retain_scales(K)
    else:
        restore_scales(K)
    return error


def pass_singularity(K: Kernel, h: float, t1: float, m: int, c_C: float, c_K: float, straight: bool) -> int:
    """−1 where no singular configuration is near; else how a step that passes it ends, or that this must not."""
    fall = steps_by_pivot(K, m, straight)
    if not fall < MAX_STEPS_AWAY + 2.0:
        return -1
    if not straight and order_of_tangent(K, m) > 0:  # all of the rows and of how they turn
        clear_tangent(K, m, K.out)
        call(K, K.tangent_program, K.out)
        o = (K.n + m) * (K.n + m) + K.n + 2 * m
        K.turning[: m * K.n_v] = K.out[o : o + m * K.n_v]
    away = steps_to_singularity(K, m, h, c_K / c_C, straight) * h / K.step
    if misses(K, away, h):
        K.inverse_pivot = 0.0
        return TOO_NEAR
    if fall < MAX_STEPS_AWAY and away < MAX_STEPS_AWAY and (away < 1.0 or is_whole(K, h)):
        known = K.near_singular
        status = singular_newmark_step(K, h, t1)
        if status != 0 and K.adaptive == 1:  # a step that is half as long is judged by itself
            K.near_singular = known
        return status
    return -1


def renew(K: DependentRows, m: int, tangents: int) -> bool:
    """Residual and tangent in K.out; whether its factors and the correction are there instead of it.

    Straight-line code exchanges no rows: where a pivot is too small, or the correction was not what it should be, the
    tangent itself is asked for and pivots are searched for.
    """
    K.n_tangents += 1
    first = K.correction_program
    if first > 0 and not is_differentiated():
        if tangents < MAX_FIXED_ORDER:
            call(K, first, K.out)
            if K.out[soundness_at(K, m)] == 1.0:
                K.n_factorizations += 1
                return True
        K.n_pivoted += 1
    if tangents >= MAX_FIXED_ORDER or order_of_tangent(K, m) == 0:  # pivots are searched for in all of it
        clear_tangent(K, m, K.out)
    call(K, K.tangent_program, K.out)
    return False


def order_of_tangent(K: DependentRows, m: int) -> int:
    """Where the order begins in which the tangent of this step is eliminated, 0 if pivots are searched for."""
    return 0 if sharing(K) else order_at(K, m)


def take_shift(K: Equations, m: int) -> bool:
    """Whether positions need correcting by what has come with the tangent: the change of the shift, then in K.work."""
    if K.stabilized == 0:
        return False
    shifting = False
    for k in range(m):
        row = K.rows[k]
        if K.row_level[row] == 0 and abs(K.out[K.n + k]) > 16.0 * EPS * K.scale[K.n + row]:
            shifting = True
    if shifting:
        place = soundness_at(K, m) + 2 + K.n + m
        K.work[: K.n_v] = K.out[place : place + K.n_v]
    return shifting


def right_hand_sides(K: SingularSteps, o_r: int, m: int, c_C: float, c_K: float, tangent: bool, straight: bool) -> bool:
    """−r and −h/c_K (index 3) or −ḣ/c_C in K.rhs; for the stabilized form the position residual in K.work.

    Rows on velocities have −rate/c_C in both forms and take no part in the correction of positions.

    Returns whether positions need correcting: at round-off they stay, correcting would only stir the velocity rows.
    With a new tangent the whole correction U is solved for, so that it stays normal to the rows.
    """
    n = K.n
    o_h = o_r + n
    o = order_of_tangent(K, m) if tangent and not straight and m > 0 and K.stabilized == 1 else 0
    o_column = columns_at(K, o) if o > 0 else 0
    shifting = False
    for i in range(n):
        K.rhs[i] = -K.out[o_r + i]
        K.work[i] = 0.0
    for k in range(m):
        if K.stabilized == 0:
            K.rhs[n + k] = -K.out[o_h + k] / (c_C if K.row_level[K.rows[k]] == 1 else c_K)
            continue
        rate = K.out[o_h + m + k]
        K.rhs[n + k] = -rate / c_C
        if K.row_level[K.rows[k]] == 1:  # corrections of positions go along the row, not against it
            K.work[n + k] = 0.0
            continue
        h = K.out[o_h + k]
        if abs(h) > 16.0 * EPS * K.scale[n + K.rows[k]]:
            shifting = True
        h -= (c_K / c_C) * rate
        if o > 0:
            for e in range(K.orders[o_column + k], K.orders[o_column + k + 1]):
                j = K.orders[o_column + m + 1 + e]
                h -= K.out[(n + k) * (n + m) + j] * K.shift1[j]
        elif tangent and not straight:
            for j in range(K.n_v):
                h -= K.out[(n + k) * (n + m) + j] * K.shift1[j]
        K.work[n + k] = -h
    if o > 0:
        for k in range(m):
            for e in range(K.orders[o_column + k], K.orders[o_column + k + 1]):
                place = k * K.n_v + K.orders[o_column + m + 1 + e]
                K.turning[place] = K.out[o_h + 2 * m + place]
    elif tangent and K.stabilized == 1:
        K.turning[: m * K.n_v] = K.out[o_h + 2 * m : o_h + 2 * m + m * K.n_v]
    return shifting


def factorize(K: DependentRows, size: int, tangents: int) -> bool:
    """LU factors of the tangent in K.out; false where a pivot is missing.

    Those of a step's first few tangents keep to the order of the mode, if it has one and its pivots are sound.
    """
    m = size - K.n
    o = order_of_tangent(K, m)
    if o > 0 and tangents <= MAX_FIXED_ORDER:
        if factor_ordered(K, K.out, o, OF_TANGENT, HALF_PRECISION_RTOL):
            K.n_factorizations += 1
            return True
        clear_tangent(K, m, K.out)
        call(K, K.tangent_program, K.out)
    if o > 0:
        K.n_pivoted += 1
    K.order_start = 0
    K.kkt[: size * size] = K.out[: size * size]
    if sharing(K):
        add_shares(K, K.kkt, m)
    column = factor(K.kkt, size, K.pivots)
    K.n_factorizations += 1
    K.failure_index = column - 1
    return bool(column == 0)


def solve_corrections(K: SingularSteps, m: int, c_C: float, tangent: bool, shifting: bool, straight: bool) -> None:
    """The change of the position shift in K.work, the corrections of rates and multipliers in K.rhs."""
    if shifting:  # positions first: what that changes of ḣ, the accelerations make good in the same iteration
        solve_with_factors(K, m, K.work, straight)
        follow_matrix(K, m, K.work, tangent)
        for i in range(K.n_v if tangent else 0):
            K.work[i] -= K.shift1[i]
        inverse = 1.0 / c_C
        turning = soundness_at(K, m) - m * K.n_v
        o = 0 if straight else order_of_tangent(K, m)
        o_column = columns_at(K, o) if o > 0 else 0
        for k in range(m):
            turned = 0.0
            if o > 0:
                for e in range(K.orders[o_column + k], K.orders[o_column + k + 1]):
                    i = K.orders[o_column + m + 1 + e]
                    turned += K.turning[k * K.n_v + i] * K.work[i]
            else:
                for i in range(K.n_v):
                    entry = K.out[turning + k * K.n_v + i] if straight else K.turning[k * K.n_v + i]
                    turned += entry * K.work[i]
            K.rhs[K.n + k] -= turned * inverse
    solve_with_factors(K, m, K.rhs, straight)
    if m > 0 and K.stabilized == 1:
        follow_matrix(K, m, K.rhs, False)


def solve_with_factors(K: Equations, m: int, b: Reals, straight: bool) -> None:
    """b ← K⁻¹ b with the factors at hand."""
    size = K.n + m
    if straight:
        place = soundness_at(K, m) + 2
        K.out[place : place + size] = b[:size]
        call_on(K, K.solution_program, K.out, b)
    else:
        solve_kkt(K, size, b)


def correct(K: Equations, m: int, c_C: float, c_K: float, ready: bool, shifting: bool) -> float:
    """Apply a Newton correction to the block; its size relative to the largest rate."""
    n = K.n
    block = K.block
    biggest = 0.0
    fastest = 1e-300
    place = soundness_at(K, m) + 2
    if shifting:
        for i in range(K.n_v):
            K.shift1[i] += K.work[i]
            block[K.o_x + i] += K.work[i]
    K.n_iterations += 1
    for i in range(n):
        change = K.out[place + i] if ready else K.rhs[i]
        rate = block[K.o_a + i]
        biggest = max(biggest, abs(change))
        fastest = max(fastest, abs(rate))
        K.rhs[i] = change
        block[K.o_a + i] = rate + change
        block[K.o_v + i] += c_C * change
        if i < K.n_v:
            block[K.o_x + i] += c_K * change
    for k in range(m):
        change = K.out[place + n + k] if ready else K.rhs[n + k]
        K.rhs[n + k] = change
        block[K.o_lam + K.rows[k]] += change
    return biggest / fastest


def retreat(K: Equations, m: int, c_C: float, c_K: float) -> None:
    """Take back half of the last correction of rates, velocities, positions and multipliers."""
    for i in range(K.n + m):
        K.rhs[i] *= 0.5
    take_back(K, m, c_C, c_K, 1.0)


def take_back(K: Equations, m: int, c_C: float, c_K: float, part: float) -> None:
    """Take back a part of the correction in K.rhs."""
    n = K.n
    for i in range(n):
        change = part * K.rhs[i]
        K.block[K.o_a + i] -= change
        K.block[K.o_v + i] -= c_C * change
        if i < K.n_v:
            K.block[K.o_x + i] -= c_K * change
    for k in range(m):
        K.block[K.o_lam + K.rows[k]] -= part * K.rhs[n + k]


def size_before(K: Equations, m: int, c_C: float, c_K: float, tolerance: float) -> float:
    """The residual over its tolerance before the last correction, with the scales of now; K.out is left as it is."""
    count = K.n + 2 * m + 1
    K.spare[:count] = K.out[:count]
    take_back(K, m, c_C, c_K, 1.0)
    call(K, K.residual_program, K.out)
    size = residual_size(K, 0, m, c_C, c_K, tolerance, K.stabilized)
    take_back(K, m, c_C, c_K, -1.0)
    K.out[:count] = K.spare[:count]
    return size
