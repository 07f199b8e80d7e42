"""One implicit step of the Newmark family, and its start (Arnold & Brüls 2007, Multibody Syst. Dyn. 18:185).

Newton on (v̇₁, ż₁, λ) with the exact tangent S = M + c_C C_t + c_K K_t; the stabilized form adds the position
correction U in the metric of the same matrix (Gear, Gupta & Leimkuhler 1985). First-order states z follow the
velocity formulas of the scheme with their own rate ż, which is of order 2 as well (Jansen, Whiting & Hulbert 2000).
"""

from __future__ import annotations

from typing import Any

from mbd.kernel.careful import careful_correction
from mbd.kernel.fields import (
    AUX_STEP,
    BLOCKED,
    CAREFUL,
    CORRECTED,
    EPS,
    FACTORIZATIONS,
    ITERATIONS,
    MODE,
    NEAR,
    NOT_CONVERGED,
    NOT_FINITE,
    NOW,
    RESIDUALS,
    ROWS,
    SINGULAR,
    STAGNATED,
    STAGNATIONS,
    TANGENTS,
    TOO_TIGHT,
    USUAL,
)  # fmt: skip
from mbd.kernel.hooks import call
from mbd.kernel.linear import factor, solve
from mbd.kernel.restart import compose, consistent, fill_block, raise_scales, refresh_scales

__all__ = ["newmark_accept", "newmark_start", "newmark_step"]

MOST_HALVINGS = 10
"""How often a Newton correction is halved before the iteration goes on from where it is."""
CONTINUOUS = 0.05
"""Part of the speed by which a careful step may differ from its prediction: branches are continuous in velocity [-].

And no more than twenty times what the last ordinary step was corrected by.
"""
WATCHFUL = 20
"""Steps after a careful one in which every step must continue its branch."""
FAR = 1e4
"""Residual over its tolerance above which a correction that does not reduce it is halved."""


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


def residual_size(K: Any, o_r: int, m: int, c_C: float, c_K: float, tolerance: float) -> float:
    """Largest residual over its tolerance: balance, h and (stabilized) ḣ, each block apart; −1 if not finite."""
    size = 0.0
    finite = 0.0
    fastest = 0.0
    for i in range(K.n):
        r = abs(K.out[o_r + i])
        finite += r
        size = max(size, r / (tolerance * K.scale[i]))
    speed = 0.0
    for i in range(K.n_v):
        fastest = max(fastest, abs(K.block[K.o_a + i]))
        speed = max(speed, abs(K.block[K.o_v + i]))
    o_h = o_r + K.n
    for k in range(m):
        row = K.rows[k]
        h = abs(K.out[o_h + k])
        finite += h
        limit = tolerance * c_K * fastest
        floor = 16.0 * EPS * K.scale[K.n + row]
        if K.stabilized == 1:
            limit = tolerance * c_C * speed
        elif K.row_level[row] == 1:  # a rate stands in the place of h
            limit = tolerance * c_C * fastest
            floor = 16.0 * EPS * K.scale[K.n + K.n_rows + row]
        size = max(size, h / (max(floor, limit) + 1e-300))
        if K.stabilized == 1:
            rate = abs(K.out[o_h + m + k])
            finite += rate
            floor = 16.0 * EPS * K.scale[K.n + K.n_rows + row]
            size = max(size, rate / (max(floor, tolerance * c_C * fastest) + 1e-300))
    if not finite < 1e300:
        return -1.0
    return size


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
    predict(K, h, t1, c_C, c_K)
    if K.state[NEAR] > 0:
        for i in range(K.n):
            K.y1[i] = K.block[K.o_v + i]
    tolerance = 4.0 * EPS if K.exact == 1 else 1e-3 * K.tolerance
    before = 1e300
    left = 1e300  # the error where the last correction started
    halvings = 0
    fresh = False
    status = NOT_CONVERGED
    for iteration in range(K.max_iterations):
        tangent = not fresh
        if tangent:
            call(K, K.mode_code[2 * K.state[MODE]], K.out)
            K.counts[TANGENTS] += 1
        else:
            call(K, K.mode_code[2 * K.state[MODE] + 1], K.out)
            K.counts[RESIDUALS] += 1
        o_r = size * size if tangent else 0
        error = residual_size(K, o_r, m, c_C, c_K, tolerance)
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
            error = residual_size(K, o_r, m, c_C, c_K, tolerance)
            if error > 1.0 and residual_size(K, o_r, m, 0.0, 0.0, 256.0 * EPS) <= 16.0:
                if residual_size(K, o_r, m, c_C, c_K, K.tolerance) > 1.0:
                    K.detail[0] = t1
                    K.detail[2] = h
                    return TOO_TIGHT
                K.counts[STAGNATIONS] += 1
                error = 1.0
            elif iteration >= 6 and K.exact == 0 and residual_size(K, o_r, m, 0.0, 0.0, 1e5 * EPS) <= 1e3:
                status = STAGNATED
                break
        if error <= 1.0:
            if K.state[NEAR] > 0:
                if leaves_branch(K):
                    break
                K.state[NEAR] -= 1
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
        shifting = right_hand_sides(K, o_r, m, c_C, c_K, tangent)
        if tangent and not factorize(K, size):
            status = SINGULAR
            break
        biggest = correct(K, m, c_C, c_K, tangent, shifting)
        if iteration == 0 and K.state[NEAR] == 0:
            K.detail[USUAL] = K.detail[CORRECTED]
        if iteration == 0 and K.exact == 0:  # the predictor's error measures that of the step: stay far below it
            tolerance = min(K.tolerance, max(1e-4 * biggest, tolerance))
        fresh = True
    if m > 0 and K.stabilized == 1 and status != NOT_FINITE and careful_step(K, h, t1, c_C, c_K):
        return 0
    K.detail[0] = t1
    K.detail[2] = h
    return status


def overturns(K: Any, h: float) -> bool:
    """Whether the estimated error of an angle in this step exceeds half a radian: it is not resolved at all.

    ``e = h² |1/6 − β − (α_m − α_f)/2| |v̇₁ − v̇₀|``
    """
    share = abs(1.0 / 6.0 - K.beta - 0.5 * (K.alpha_m - K.alpha_f)) * h * h
    change = 0.0
    for i in range(K.n_v):
        if K.unit[i] == 1:
            change = max(change, abs(K.rate1[i] - K.rate[i]))
    return bool(share * change > 0.5)


def runs_away(K: Any, m: int) -> bool:
    """Whether multipliers fight each other: their forces cancel to less than 1e-7 of their size.

    Then r would vanish beside its terms whatever the motion, and a step must not be accepted for it.
    """
    size = K.n + m
    call(K, K.mode_code[2 * K.state[MODE]], K.spare)
    largest = 0.0
    total = 0.0
    for i in range(K.n):
        terms = 0.0
        force = 0.0
        for k in range(m):
            part = K.spare[i * size + K.n + k] * K.block[K.o_lam + K.rows[k]]
            terms += abs(part)
            force += part
        largest = max(largest, terms)
        total = max(total, abs(force))
    return largest > 1e7 * total and largest > 1e3 * K.work[0]


def leaves_branch(K: Any) -> bool:
    """Whether velocities are no continuation of those before the step (the predicted ones are in K.y1)."""
    fastest = 0.0
    change = 0.0
    for i in range(K.n_v):
        fastest = max(fastest, max(abs(K.y[i]), abs(K.y1[i])))
        change = max(change, abs(K.block[K.o_v + i] - K.y1[i]))
    usual = CONTINUOUS * fastest
    if K.detail[USUAL] > 0.0:
        usual = min(usual, 20.0 * K.detail[USUAL] + 1e-9 * fastest)
    return change > usual


def careful_step(K: Any, h: float, t1: float, c_C: float, c_K: float) -> bool:
    """The step once more with separate matrices for positions and velocities; whether it converged."""
    m = K.state[ROWS]
    size = K.n + m
    predict(K, h, t1, c_C, c_K)
    for i in range(K.n):
        K.y1[i] = K.block[K.o_v + i]
    before = 1e300
    for iteration in range(K.max_iterations):
        call(K, K.mode_code[2 * K.state[MODE]], K.out)
        K.counts[TANGENTS] += 1
        error = residual_size(K, size * size, m, c_C, c_K, K.tolerance)
        if error >= 0.0 and iteration >= 2 and error > 0.5 * before:
            raise_scales(K, True)
            if runs_away(K, m):
                return False
            error = residual_size(K, size * size, m, c_C, c_K, K.tolerance)
            if residual_size(K, size * size, m, 0.0, 0.0, 256.0 * EPS) <= 64.0:
                K.counts[STAGNATIONS] += 1
                error = min(error, 1.0)
        if 0.0 <= error <= 1.0:
            if leaves_branch(K):
                return False
            K.counts[CAREFUL] += 1
            K.state[NEAR] = WATCHFUL
            finish(K, h)
            return not overturns(K, h)
        before = error
        if error < 0.0 or not careful_correction(K, c_C, c_K):
            return False
    return False


def predict(K: Any, h: float, t1: float, c_C: float, c_K: float) -> None:
    """The block at t₁ with rates, multipliers and position correction extrapolated."""
    block = K.block
    stretch = h / K.clock[AUX_STEP]
    block[0] = t1
    block[1] = c_C
    block[2] = c_K
    for i in range(K.n_q):
        block[K.o_q + i] = K.q[i]
    for k in range(K.n_rows):
        block[K.o_lam + k] = K.lam[k] + h * K.lam_slope[k]
    for k in range(K.n_anchors):
        block[K.o_anchor + k] = K.anchors[k]
    for f in range(K.n_frictions):
        block[K.o_slip + f] = K.slip[f]
    for i in range(K.n):
        a0 = K.rate[i] + stretch * (K.aux[i] - K.rate[i])
        rate = K.rate[i] + h * K.slope[i]
        a1 = ((1.0 - K.alpha_f) * rate + K.alpha_f * K.rate[i] - K.alpha_m * a0) / (1.0 - K.alpha_m)
        block[K.o_a + i] = rate
        block[K.o_v + i] = K.y[i] + h * ((1.0 - K.gamma) * a0 + K.gamma * a1)
        if i < K.n_v:
            K.shift1[i] = (K.shift[i] + stretch * K.shift_change[i]) * (stretch * stretch * stretch)
            block[K.o_x + i] = h * K.y[i] + h * h * ((0.5 - K.beta) * a0 + K.beta * a1) + K.shift1[i]


def right_hand_sides(K: Any, o_r: int, m: int, c_C: float, c_K: float, tangent: bool) -> bool:
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
        if tangent:
            for j in range(K.n_v):
                h -= K.out[(n + k) * (n + m) + j] * K.shift1[j]
        K.work[n + k] = -h
    if tangent and K.stabilized == 1:
        for k in range(m * K.n_v):
            K.turning[k] = K.out[o_h + 2 * m + k]
    return shifting


def factorize(K: Any, size: int) -> bool:
    """LU factors of the tangent in K.out; false where a pivot is missing."""
    for k in range(size * size):
        K.kkt[k] = K.out[k]
    column = factor(K.kkt, size, K.pivots)
    K.counts[FACTORIZATIONS] += 1
    K.state[BLOCKED] = column - 1
    return bool(column == 0)


def correct(K: Any, m: int, c_C: float, c_K: float, tangent: bool, shifting: bool) -> float:
    """Apply a Newton correction to the block; its size relative to the largest rate."""
    n = K.n
    block = K.block
    biggest = 0.0
    fastest = 1e-300
    if shifting:  # positions first: what that changes of ḣ, the accelerations make good in the same iteration
        solve(K.kkt, n + m, K.pivots, K.work)
        for i in range(K.n_v):
            shift = K.work[i] if tangent else K.shift1[i] + K.work[i]
            K.work[i] = shift - K.shift1[i]
            K.shift1[i] = shift
            block[K.o_x + i] += K.work[i]
        inverse = 1.0 / c_C
        for k in range(m):
            turned = 0.0
            for i in range(K.n_v):
                turned += K.turning[k * K.n_v + i] * K.work[i]
            K.rhs[n + k] -= turned * inverse
    solve(K.kkt, n + m, K.pivots, K.rhs)
    K.counts[ITERATIONS] += 1
    for i in range(n):
        change = K.rhs[i]
        biggest = max(biggest, abs(change))
        fastest = max(fastest, abs(block[K.o_a + i]))
        block[K.o_a + i] += change
        block[K.o_v + i] += c_C * change
        if i < K.n_v:
            block[K.o_x + i] += c_K * change
    for k in range(m):
        block[K.o_lam + K.rows[k]] += K.rhs[n + k]
    K.detail[CORRECTED] = c_C * biggest
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


def finish(K: Any, h: float) -> None:
    """The converged block becomes the candidate."""
    stretch = h / K.clock[AUX_STEP]
    for i in range(K.n):
        a0 = K.rate[i] + stretch * (K.aux[i] - K.rate[i])
        K.rate1[i] = K.block[K.o_a + i]
        K.y1[i] = K.block[K.o_v + i]
        K.aux1[i] = ((1.0 - K.alpha_f) * K.rate1[i] + K.alpha_f * K.rate[i] - K.alpha_m * a0) / (1.0 - K.alpha_m)
    for k in range(K.n_rows):
        K.lam1[k] = K.block[K.o_lam + k]
    compose(K, K.q1)


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
