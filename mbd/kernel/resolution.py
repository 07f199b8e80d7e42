"""Whether a step of fixed size resolves what it changes: its estimated error, judged by the forces themselves.

A step has found *a* solution of its equations, which need not be the motion: beyond a pole of the forces, or where a
Newton iterate was thrown far away, there are others. A cheap look compares the estimated error of each rate with the
rate. Where that is large, accelerations are asked for again, by two tests that stiff forces pass at any step:

- *growth*: the change D of (v, z) that the previous accelerations did not predict, and what accelerations a owe to it,
  ``ζ = h D·M (a(y₁) − a(y₁ − D)) / D·M D``. A force that depends on time has ζ = 0, a stiff spring or damper ζ < 0,
  ``v̇ = c v`` has ζ = c h: more than `GROWTH` grows by more than e in a step, which no scheme of order 2 follows;
- *gain*: along the way from the old to the new state the forces do at most the work W⁺ = Σ_i ∫ max(v_i (M a)_i, 0) dt.
  Where more than half of the new kinetic energy is neither the old one nor that, it comes from nowhere.
"""

from __future__ import annotations

from mbd.kernel.candidate import carry
from mbd.kernel.charts import whole_step
from mbd.kernel.codes import COMPOSE, GAINED, LEAPT, NOT_FINITE, OUTGROWN
from mbd.kernel.hooks import call, scheme_error
from mbd.kernel.poles import leaps
from mbd.kernel.records import Equations, Guards, Kernel, SchemeAbilities, Steps, Switching
from mbd.kernel.redundancy import sharing
from mbd.kernel.restart import compose, consistent, evaluate, fill_block, stepping_rows
from mbd.kernel.saddle import solve_rows
from mbd.kernel.scales import still_energy
from mbd.kernel.schemes.iteration import BENT, BYSTANDER, LOOK_TWICE, is_small

__all__ = ["judge_change"]

GROWTH = 0.8
"""ζ in a whole step that the trapezoidal rule still follows; less where the error of a scheme is larger [-]."""
TRAPEZOID = 1.0 / 12.0
"""Constant of its error, in h³ times the rate of accelerations [-]."""
COARSE = 0.2
"""Estimated error of a rate, over the rate, above which the work of the forces is asked for [-]."""
UNEXPLAINED = 0.5
"""Part of the kinetic energy at the end of a step that may be neither old nor work of forces [-]."""
LEAST_GAIN = 0.085
"""Energy of the change of velocities over the kinetic one below which less than `UNEXPLAINED` is new, (1 − √½)² [-]."""
FEWEST = 1.0 / 4096.0
"""Least part of D that is tried where accelerations are not finite at its other end [-]."""


def judge_change(K: Kernel, h: float, t1: float) -> int:
    """0 where the candidate may be a continuation of the motion, OUTGROWN, GAINED or LEAPT where it cannot."""
    whole = whole_step(K)
    if K.turning_step > 0.0:
        whole = min(whole, K.turning_step)
    stretch = max(1.0, whole / h)
    if K.estimates == 0 and changes_little(K, h, stretch):
        return 0
    worst = largest_share(K, h, stretch)
    if (worst <= LOOK_TWICE and not bends(K, h)) or K.near_singular > 0 or sharing(K):
        return 0
    if worst > LOOK_TWICE:  # then stages have seen nothing that counts
        K.stage_pull = 0.0
    return look_closer(K, h, t1, stretch, worst > K.look_twice)


def changes_little(K: Steps, h: float, stretch: float) -> bool:
    """Whether the errors of all rates are small beside a part of the fastest one, and none `bends`: in most steps."""
    largest = 0.0
    most = 0.0
    fastest = 0.0
    for i in range(K.n_v):
        most = max(most, abs(K.rate1[i] - K.rate[i]))
        largest = max(largest, abs(K.rate1[i] - K.rate[i] - h * K.slope[i]))
        fastest = max(fastest, abs(K.y1[i]))
    for i in range(K.n_v, K.n):
        largest = max(largest, abs(K.rate1[i] - K.rate[i] - h * K.slope[i]))
    return is_small(K, h, stretch, most, largest, fastest)


def bends(K: Equations, h: float) -> bool:
    """Whether accelerations change so much that a pole may lie between, even if so predicted; K.failure_index whose."""
    most = 0.0
    fastest = 0.0
    who = 0
    for i in range(K.n_v):
        if abs(K.rate1[i] - K.rate[i]) > most:
            most = abs(K.rate1[i] - K.rate[i])
            who = i
        fastest = max(fastest, abs(K.y1[i]))
    if h * most > BENT * max(K.rest_speed, fastest):
        K.failure_index = who
        return True
    return False


def look_closer(K: Kernel, h: float, t1: float, stretch: float, rough_enough: bool) -> int:
    """The same of a candidate that a glance does not clear, which is left as it was; if not rough, `leaps` alone."""
    rough = K.failure_size
    blocked = K.failure_index
    at_y = carry(K.q1, K.inside, 0, K.n_q, True)
    at_D = carry(K.y1, K.inside, at_y, K.n, True)
    status = 0
    if rough_enough and outgrows(K, h, t1, stretch, at_y, at_D):
        status = OUTGROWN
    elif rough_enough and rough > COARSE and gains(K, h, t1, at_y, at_D):
        status = GAINED
    elif leaps(K, h, at_y):
        status = LEAPT
    carry(K.q1, K.inside, 0, K.n_q, False)
    carry(K.y1, K.inside, at_y, K.n, False)
    if status == 0 and rough_enough and K.strategy == 0:
        if K.estimates == 0:
            rough = uncertainty(K, h, t1, at_D)
        if rough > COARSE:
            note_coarse(K, t1, rough)
    if K.n_dropped > 0:
        evaluate(K, t1, K.q1, K.y1)
    fill_block(K, t1, K.q1, K.y1)
    K.block[K.o_a : K.o_a + K.n] = K.rate1[: K.n]
    K.block[K.o_lam : K.o_lam + K.n_rows] = K.lam1[: K.n_rows]
    if status != 0:
        K.failure_index = blocked
        K.failure_time = t1
        K.failure_step = h
    return status


def uncertainty(K: Kernel, h: float, t1: float, at_D: int) -> float:
    """Largest part of a rate that a candidate of the Newmark family may be off, by two estimates that rows leave open.

    The error of the trapezoidal rule, as `largest_share` has it, and what misses ``h (a₀ + a₁)/2`` as the auxiliary a
    of the scheme lags behind v̇: strong numerical damping carries the a of a steep start on for some steps. Rates that
    rows hold, as those of a drive, are known however accelerations change.
    """
    worst = 0.0
    holds = K.n_active > 0 and K.stabilized == 1
    if holds:
        evaluate(K, t1, K.q1, K.y1)
    for turn in range(2):
        for i in range(K.n):
            missed = h / 12.0 * (K.rate1[i] - K.rate[i] - h * K.slope[i])
            if turn == 1:
                missed = K.y1[i] - K.y[i] - 0.5 * h * (K.rate[i] + K.rate1[i])
            K.inside[at_D + i] = missed
        if holds:
            leave_rows_alone(K, at_D)
        worst = max(worst, share_of_rates(K, at_D))
    return worst


def share_of_rates(K: Guards, at_D: int) -> float:
    """Largest part of a rate that is in K.inside from `at_D` on; of one far below the fastest, over a part of that."""
    fastest = 0.0
    for i in range(K.n_v):
        fastest = max(fastest, max(abs(K.y[i]), abs(K.y1[i])))
    floor = max(K.rest_speed, BYSTANDER * fastest)
    worst = 0.0
    for i in range(K.n):
        worst = max(worst, abs(K.inside[at_D + i]) / max(floor, max(abs(K.y[i]), abs(K.y1[i]))))
    return worst


def note_coarse(K: Equations, t1: float, rough: float) -> None:
    """Count a step to t1 that forces changed within, once however often it is tried, for a note of the run."""
    if K.n_coarse > 0 and K.coarse_start == K.time:
        return
    K.n_coarse += 1
    K.coarse_start = K.time
    if K.n_coarse == 1 or rough > K.coarsest_change:
        K.coarsest_change = rough
        K.coarsest_end = t1


def largest_share(K: Kernel, h: float, stretch: float) -> float:
    """Largest estimated error of a rate over that rate, as if after a whole step; in K.failure_size after this one.

    K.failure_index tells which. Rates below the rest speed count as that, those far below the fastest as a part of it.
    """
    fastest = 0.0
    for i in range(K.n_v):
        fastest = max(fastest, max(abs(K.y[i]), abs(K.y1[i])))
    floor = max(K.rest_speed, BYSTANDER * fastest)
    cube = stretch * stretch * stretch
    twelfth = h / 12.0
    worst = 0.0
    who = 0
    if K.estimates == 1:
        scheme_error(K, h)
    for i in range(K.n):
        if K.estimates == 0:
            error = twelfth * abs(K.rate1[i] - K.rate[i] - h * K.slope[i])
        else:
            error = abs(K.error[K.n_v + i])
        share = error / max(floor, max(abs(K.y[i]), abs(K.y1[i])))
        if share > worst:
            worst = share
            who = i
    if worst * cube > LOOK_TWICE:
        K.failure_index = who
        K.failure_size = worst
    return worst * cube


def outgrows(K: Kernel, h: float, t1: float, stretch: float, at_y: int, at_D: int) -> bool:
    """Whether the change that was not predicted feeds itself by more than `GROWTH`; (q₁, y₁) are in K.inside."""
    n = K.n
    if consistent(K, t1, K.q1, K.y1) != 0:
        return False
    for i in range(n):
        K.trial_jump[i] = K.jump[i]  # as exact as can be: the step's own rates err by its tolerance
        K.inside[at_D + i] = K.inside[at_y + i] - K.y[i] - h * (K.rate[i] + 0.5 * h * K.slope[i])
    if K.n_active > 0:
        leave_rows_alone(K, at_D)
    part = 1.0
    while part >= FEWEST:
        for i in range(n):
            K.y1[i] = K.inside[at_y + i] - part * K.inside[at_D + i]
        if K.vector == 1:
            for i in range(K.n_q):
                K.q1[i] = K.inside[i] - 0.5 * h * part * K.inside[at_D + i]
        else:
            K.block[K.o_q : K.o_q + K.n_q] = K.inside[: K.n_q]
            for i in range(K.n_v):
                K.block[K.o_x + i] = -0.5 * h * part * K.inside[at_D + i]
            call(K, COMPOSE, K.q1)
        if consistent(K, t1, K.q1, K.y1) == 0:
            moved = growth_between(K, h, stretch, part, at_D, 0, K.n_v)
            states = growth_between(K, h, stretch, part, at_D, K.n_v, n)
            K.unforeseen_change = max(moved, states)
            return max(moved, states) > resolved_growth(K)
        part *= 0.0625
    return False


def leave_rows_alone(K: Switching, at_D: int) -> None:
    """Take from D what moves rows: no motion, but what index 3 leaves of velocities; K.acc is at the candidate."""
    K.force[: K.n] = 0.0
    for k in range(K.n_rows):
        K.bias[k] = 0.0
        for j in range(K.n):
            K.bias[k] += K.acc[K.acc_B + k * K.n + j] * K.inside[at_D + j]
    if solve_rows(K, stepping_rows(K), False) == 0:
        for i in range(K.n):
            K.inside[at_D + i] += K.jump[i]


def resolved_growth(K: SchemeAbilities) -> float:
    """`GROWTH`, less where the error of the scheme is larger than that of the trapezoidal rule."""
    error = abs(K.error_constant)
    return GROWTH * TRAPEZOID / error if error > TRAPEZOID else GROWTH


def growth_between(K: Switching, h: float, stretch: float, part: float, at_D: int, first: int, last: int) -> float:
    """ζ of the module's text over some components, over a whole step; K.trial_jump has a(y₁), K.jump a(y₁ − part D)."""
    fed = 0.0
    size = 0.0
    for i in range(first, last):
        for j in range(first, last):
            weight = K.inside[at_D + i] * K.acc[i * K.n + j]
            fed += weight * (K.trial_jump[j] - K.jump[j])
            size += weight * K.inside[at_D + j]
    if size <= (2.0 * still_energy(K) if first < K.n_v else 0.0):  # in a mechanism at rest round-off feeds itself
        return 0.0
    return float(h * stretch * fed / (part * size))


def gains(K: Switching, h: float, t1: float, at_y: int, at_D: int) -> bool:
    """Whether more than half of the kinetic energy at the end is neither old nor work of forces along the way.

    Forces may change with time at any instant of the step: of those of its start and of its end the larger work counts.
    What rows change of velocities, such as a drive's, is no gain: with it alone less than half would be unexplained.
    """
    old = 0.0
    new = 0.0
    most = 0.0
    for turn in range(2):
        t = K.time if turn == 0 else t1
        work = 0.0
        for node in range(5):  # Lobatto's formula
            s = 0.5
            weight = 16.0 / 45.0
            if node == 0 or node == 4:
                s = 0.25 * node
                weight = 0.05
            elif node != 2:
                s = 0.5 + (0.25 * node - 0.5) * 2.0 * 0.6546536707079771
                weight = 49.0 / 180.0
            fill_block(K, t, K.q, K.y)
            for i in range(K.n):
                change = K.inside[at_y + i] - K.y[i]
                K.y1[i] = K.y[i] + s * change
                if i < K.n_v:  # a cubic between both states
                    mean = 0.5 * (K.y[i] + K.inside[at_y + i]) + h * (K.rate[i] - K.rate1[i]) / 12.0
                    if K.vector == 1:
                        mean = (K.inside[i] - K.q[i]) / h
                    bulge = mean - 0.5 * (K.y[i] + K.inside[at_y + i])
                    K.block[K.o_x + i] = h * s * (K.y[i] + s * (0.5 * change + bulge * (3.0 - 2.0 * s)))
                    K.y1[i] += 6.0 * bulge * s * (1.0 - s)
            compose(K, K.q1)
            status = consistent(K, t, K.q1, K.y1)
            if status != 0:
                return status == NOT_FINITE
            energy = 0.0
            for i in range(K.n_v):
                force = 0.0
                momentum = 0.0
                for j in range(K.n_v):
                    force += K.acc[i * K.n + j] * K.jump[j]
                    momentum += K.acc[i * K.n + j] * K.y1[j]
                energy += 0.5 * momentum * K.y1[i]
                work += weight * h * max(K.y1[i] * force, 0.0)
            if node == 0:
                old = max(old, energy)
            if node == 4:
                new = energy
        most = max(most, work)
    if not (new > max(1.1 * old, still_energy(K)) and new - old - most > UNEXPLAINED * new):
        return False
    if K.n_active == 0:
        return True
    for i in range(K.n):
        K.inside[at_D + i] = K.inside[at_y + i] - K.y[i]
    leave_rows_alone(K, at_D)
    free = 0.0
    for i in range(K.n_v):
        for j in range(K.n_v):
            free += 0.5 * K.inside[at_D + i] * K.acc[i * K.n + j] * K.inside[at_D + j]
    return free > LEAST_GAIN * new
