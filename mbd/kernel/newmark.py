"""One implicit step of the Newmark family, and its start (Arnold & Brüls 2007, Multibody Syst. Dyn. 18:185).

Newton on (v̇₁, ż₁, λ) with the exact tangent S = M + c_C C_t + c_K K_t; the stabilized form adds the position
correction U in the metric of the same matrix (Gear, Gupta & Leimkuhler 1985). First-order states z follow the
velocity formulas of the scheme with their own rate ż, which is of order 2 as well (Jansen, Whiting & Hulbert 2000).
"""

from __future__ import annotations

from typing import Any

from mbd.kernel.fields import (
    AUX_STEP,
    BLOCKED,
    EPS,
    FACTORIZATIONS,
    ITERATIONS,
    MODE,
    NEAR,
    NOT_CONVERGED,
    NOT_FINITE,
    NOW,
    ORDERED,
    PASSING,
    PIVOT,
    PIVOTED,
    RESIDUALS,
    ROWS,
    SINGULAR,
    STAGNATED,
    STAGNATIONS,
    STEP,
    TANGENTS,
    TOO_NEAR,
    TOO_TIGHT,
)  # fmt: skip
from mbd.kernel.hooks import call, call_on
from mbd.kernel.iteration import finish, overturns, predict, residual_size, runs_away, soundness_at
from mbd.kernel.linear import factor
from mbd.kernel.ordered import LOSS_OF_STEP, OF_TANGENT, factor_ordered, order_at, solve_kkt
from mbd.kernel.pairs import is_whole
from mbd.kernel.passage import WITHIN, misses, passing_step, steps_of_fall, steps_to_pose
from mbd.kernel.redundancy import sharing
from mbd.kernel.restart import add_shares, compose, consistent, fill_block, raise_scales, refresh_scales, share_loads

__all__ = ["newmark_accept", "newmark_resume", "newmark_start", "newmark_step"]

MOST_HALVINGS = 10
"""How often a Newton correction is halved before the iteration goes on from where it is."""
FAR = 1e4
"""Residual over its tolerance above which a correction that does not reduce it is halved."""
MOST_STRAIGHT = 2
"""Tangents of a step that straight-line code may factor: where it takes more, pivots are searched for."""


def newmark_start(K: Any) -> int:
    """Memory of the scheme at a consistent state: a₀ = v̇₀ + (α_m − α_f) dt j₀, j₀ by a difference (or a₀ = v̇₀)."""
    n = K.n
    step = K.dt / 16.0
    t = K.clock[NOW]
    fill_block(K, t, K.q, K.y)
    for i in range(K.n_v):  # a little later along the tangent: a parabola would blow stiff forces up by (ω dt)²
        K.block[K.o_x + i] = step * K.y[i]
    compose(K, K.q1)
    for i in range(n):
        K.y1[i] = K.y[i] + step * K.rate[i]
    status = consistent(K, t + step, K.q1, K.y1)
    for i in range(n):
        K.slope[i] = (K.jump[i] - K.rate[i]) / step if status == 0 else 0.0
        K.aux[i] = K.rate[i] + (K.jerk * (K.alpha_m - K.alpha_f) * K.dt) * K.slope[i]
        K.shift[i] = 0.0
        K.shift_change[i] = 0.0
    for k in range(K.n_rows):
        K.lam_slope[k] = (K.impulse[k] - K.lam[k]) / step if status == 0 else 0.0
    K.clock[AUX_STEP] = K.dt
    K.state[NEAR] = 0
    K.detail[PIVOT] = 0.0
    fill_block(K, t, K.q, K.y)
    refresh_scales(K)
    if unresolved(K):
        for i in range(n):
            K.slope[i] = 0.0
            K.aux[i] = K.rate[i]
    for i in range(n):  # a force that is zero just now has its size a step later
        K.block[K.o_a + i] += K.dt * K.slope[i]
        K.block[K.o_v + i] += K.dt * K.rate[i]
        if i < K.n_v:
            K.block[K.o_x + i] = K.dt * (K.y[i] + 0.5 * K.dt * K.rate[i])
    raise_scales(K, False)
    return 0


def unresolved(K: Any) -> bool:
    """Whether accelerations would change within dt to a hundred times what all terms of the balance make up now.

    A jerk like that (a stiff contact that closes, shorter than dt) is no start for anything: a₀ = v̇₀ then.
    """
    change = 0.0
    known = 0.0
    for i in range(K.n_v):
        change = max(change, abs(K.slope[i]) * K.dt)
        known = max(known, abs(K.rate[i]))
        if K.acc[i * K.n + i] > 0.0:
            known = max(known, K.scale[i] / K.acc[i * K.n + i])
    return change > 100.0 * known


def newmark_step(K: Any, h: float, t1: float) -> int:
    """Candidate state (q1, y1, rate1, aux1, lam1) after a step of size h; the accepted state is untouched.

    Newton's method, its corrections halved where the residual grows: one tangent, then residuals with its factors; a
    new tangent where the residual falls by less than a factor of three.
    """
    m = K.state[ROWS]
    size = K.n + m
    c = (1.0 - K.alpha_f) / (1.0 - K.alpha_m)
    c_C = K.gamma * h * c
    c_K = K.beta * h * h * c
    if K.state[NEAR] == PASSING:
        return passing_step(K, h, t1)
    predict(K, h, t1, c_C, c_K)
    tolerance = min(4.0 * EPS, K.tolerance) if K.exact == 1 else 1e-3 * K.tolerance
    before = 1e300
    left = 1e300  # the error where the last correction started
    halvings = 0
    tangents = 0
    straight = False  # whether the factors at hand are those of straight-line code
    fresh = False
    together = sharing(K)
    status = NOT_CONVERGED
    for iteration in range(K.max_iterations):
        tangent = not fresh
        if together:
            share_loads(K, m)
        if tangent:
            straight = renew(K, m, tangents)
            tangents += 1
        else:
            call(K, K.mode_code[4 * K.state[MODE] + 1], K.out)
            K.counts[RESIDUALS] += 1
        o_r = size * size if tangent and not straight else 0
        error = residual_size(K, o_r, m, c_C, c_K, tolerance, K.stabilized)
        if halvings < MOST_HALVINGS and iteration > 0 and (error < 0.0 or (error > FAR and error > 0.9 * left)):
            retreat(K, m, c_C, c_K)  # a full Newton step jumped over a steep place
            halvings += 1
            continue
        if error < 0.0:
            status = NOT_FINITE
            break
        K.detail[1] = error
        if error > 1.0 and iteration >= 2 and error > 0.5 * before:
            raise_scales(K, True)
            if runs_away(K, m):
                break
            error = residual_size(K, o_r, m, c_C, c_K, tolerance, K.stabilized)
            if error > 1.0 and residual_size(K, o_r, m, 0.0, 0.0, 256.0 * EPS, K.stabilized) <= 16.0:
                if residual_size(K, o_r, m, c_C, c_K, K.tolerance, K.stabilized) > 1.0:
                    K.detail[0] = t1
                    K.detail[2] = h
                    return TOO_TIGHT
                K.counts[STAGNATIONS] += 1
                error = 1.0
            elif iteration >= 6 and K.exact == 0 and residual_size(K, o_r, m, 0.0, 0.0, 1e5 * EPS, K.stabilized) <= 1e3:
                status = STAGNATED
                break
        if error <= 1.0:
            finish(K, h)
            if overturns(K, h):
                K.detail[1] = -1.0
                break
            return 0
        if not tangent and error > 0.3 * before:
            fresh = False  # the old tangent has done its work: renew it at the same iterate
            before = 1e300
            continue
        before = error
        left = error
        halvings = 0
        ready = tangent and straight  # the correction has come with the tangent
        shifting = ready and take_shift(K, m)
        if not ready or (m > 0 and K.stabilized == 1 and not shifting):
            ready = False
            shifting = right_hand_sides(K, o_r, m, c_C, c_K, tangent, straight)
        if tangent and not straight and not factorize(K, size, tangents):
            status = SINGULAR
            break
        if iteration == 0 and m > 0 and K.stabilized == 1:
            fall = steps_of_fall(K, m, straight)
            if fall < WITHIN + 2.0:
                away = steps_to_pose(K, m, h, c_K / c_C, straight) * h / K.clock[STEP]
                if misses(K, away, h):
                    K.detail[PIVOT] = 0.0
                    return TOO_NEAR
                if fall < WITHIN and away < WITHIN and (away < 1.0 or is_whole(K, h)):
                    return passing_step(K, h, t1)
        if not ready:
            solve_corrections(K, m, c_C, tangent, shifting, straight)
        biggest = correct(K, m, c_C, c_K, ready, shifting)
        if iteration == 0 and K.exact == 0:  # the predictor's error measures that of the step: stay far below it
            tolerance = min(K.tolerance, max(1e-4 * biggest, tolerance))
        fresh = True
    K.detail[0] = t1
    K.detail[2] = h
    return status


def renew(K: Any, m: int, tangents: int) -> bool:
    """Residual and tangent in K.out; whether its factors and the correction are there instead of it.

    Straight-line code exchanges no rows: where a pivot is too small, or the correction was not what it should be, the
    tangent itself is asked for and pivots are searched for.
    """
    K.counts[TANGENTS] += 1
    first = K.mode_code[4 * K.state[MODE] + 2]
    if first > 0:
        if tangents < MOST_STRAIGHT:
            call(K, first, K.out)
            if K.out[soundness_at(K, m)] == 1.0:
                K.counts[FACTORIZATIONS] += 1
                return True
        K.counts[PIVOTED] += 1
    call(K, K.mode_code[4 * K.state[MODE]], K.out)
    return False


def take_shift(K: Any, m: int) -> bool:
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
        for i in range(K.n_v):
            K.work[i] = K.out[place + i]
    return shifting


def right_hand_sides(K: Any, o_r: int, m: int, c_C: float, c_K: float, tangent: bool, straight: bool) -> bool:
    """−r and −h/c_K (index 3) or −ḣ/c_C in K.rhs; for the stabilized form the position residual in K.work.

    Rows on velocities have −rate/c_C in both forms and take no part in the correction of positions.

    Returns whether positions need correcting: at round-off they stay, correcting would only stir the velocity rows.
    With a new tangent the whole correction U is solved for, so that it stays normal to the rows.
    """
    n = K.n
    o_h = o_r + n
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
        if tangent and not straight:
            for j in range(K.n_v):
                h -= K.out[(n + k) * (n + m) + j] * K.shift1[j]
        K.work[n + k] = -h
    if tangent and K.stabilized == 1:
        for k in range(m * K.n_v):
            K.turning[k] = K.out[o_h + 2 * m + k]
    return shifting


def factorize(K: Any, size: int, tangents: int) -> bool:
    """LU factors of the tangent in K.out; false where a pivot is missing.

    Those of a step's first few tangents keep to the order of the mode, if it has one and its pivots are sound.
    """
    m = size - K.n
    o = 0 if sharing(K) else order_at(K, m)
    if o > 0 and tangents <= MOST_STRAIGHT:
        if factor_ordered(K, K.out, o, OF_TANGENT, LOSS_OF_STEP):
            K.counts[FACTORIZATIONS] += 1
            return True
    if o > 0:
        K.counts[PIVOTED] += 1
    K.state[ORDERED] = 0
    for k in range(size * size):
        K.kkt[k] = K.out[k]
    if sharing(K):
        add_shares(K, K.kkt, m)
    column = factor(K.kkt, size, K.pivots)
    K.counts[FACTORIZATIONS] += 1
    K.state[BLOCKED] = column - 1
    return bool(column == 0)


def solve_corrections(K: Any, m: int, c_C: float, tangent: bool, shifting: bool, straight: bool) -> None:
    """The change of the position shift in K.work, the corrections of rates and multipliers in K.rhs."""
    if shifting:  # positions first: what that changes of ḣ, the accelerations make good in the same iteration
        solve_with_factors(K, m, K.work, straight)
        for i in range(K.n_v if tangent else 0):
            K.work[i] -= K.shift1[i]
        inverse = 1.0 / c_C
        turning = soundness_at(K, m) - m * K.n_v
        for k in range(m):
            turned = 0.0
            for i in range(K.n_v):
                entry = K.out[turning + k * K.n_v + i] if straight else K.turning[k * K.n_v + i]
                turned += entry * K.work[i]
            K.rhs[K.n + k] -= turned * inverse
    solve_with_factors(K, m, K.rhs, straight)


def solve_with_factors(K: Any, m: int, b: Any, straight: bool) -> None:
    """b ← K⁻¹ b with the factors at hand."""
    size = K.n + m
    if straight:
        place = soundness_at(K, m) + 2
        for i in range(size):
            K.out[place + i] = b[i]
        call_on(K, K.mode_code[4 * K.state[MODE] + 3], K.out, b)
    else:
        solve_kkt(K, size, b)


def correct(K: Any, m: int, c_C: float, c_K: float, ready: bool, shifting: bool) -> float:
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
    K.counts[ITERATIONS] += 1
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


def retreat(K: Any, m: int, c_C: float, c_K: float) -> None:
    """Take back half of the last correction of rates, velocities, positions and multipliers."""
    n = K.n
    for i in range(n + m):
        K.rhs[i] *= 0.5
    for i in range(n):
        K.block[K.o_a + i] -= K.rhs[i]
        K.block[K.o_v + i] -= c_C * K.rhs[i]
        if i < K.n_v:
            K.block[K.o_x + i] -= c_K * K.rhs[i]
    for k in range(m):
        K.block[K.o_lam + K.rows[k]] -= K.rhs[n + k]


def newmark_accept(K: Any, h: float) -> None:
    """The candidate becomes the accepted state."""
    for i in range(K.n_q):
        K.q[i] = K.q1[i]
    inverse = 1.0 / h
    for i in range(K.n):
        K.y[i] = K.y1[i]
        K.slope[i] = (K.rate1[i] - K.rate[i]) * inverse
        K.rate[i] = K.rate1[i]
        K.aux[i] = K.aux1[i]
        if i < K.n_v:
            K.shift_change[i] = K.shift1[i] - K.shift[i]
            K.shift[i] = K.shift1[i]
    for k in range(K.n_rows):
        K.lam_slope[k] = (K.lam1[k] - K.lam[k]) * inverse
        K.lam[k] = K.lam1[k]
    K.clock[AUX_STEP] = h


def newmark_resume(K: Any, h: float) -> int:
    """Start from the accepted state, the end of a step of size h, with the rates in K.jump, multipliers in K.impulse.

    Only the auxiliary a is carried over: it keeps its distance from v̇, where a start would err by dt².
    """
    for i in range(K.n):
        K.aux1[i] = (K.aux[i] - K.rate[i]) * (K.dt / h)
        K.rate[i] = K.jump[i]
    for k in range(K.n_rows):
        K.lam[k] = K.impulse[k]
    status = newmark_start(K)
    for i in range(K.n):
        K.aux[i] = K.rate[i] + K.aux1[i]
    return status
