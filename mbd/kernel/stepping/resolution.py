"""Whether a step of fixed size resolves what it changes: its estimated error, judged by the forces themselves.

A step has found *a* solution of its equations, which need not be the motion: beyond a pole of the forces, or where a
Newton iterate was thrown far away, there are others. A cheap look compares the estimated error of each rate with the
rate. Where that is large, accelerations are asked for again, by tests that implicit steps in stiff forces pass:

- *growth*: whether a change that was not predicted feeds itself (`growth`);
- *gain*: along the way from the old to the new state the forces do at most the work W⁺ = Σ_i ∫ max(v_i (M a)_i, 0) dt.
  Where more than half of the new kinetic energy is neither the old one nor that, it comes from nowhere;
- *stability*: whether forces are so stiff along a change that was not predicted that an explicit step amplifies it.
"""

from mbd.kernel.algebra.redundancy import sharing
from mbd.kernel.codes import GAINED, LEAPT, NOT_FINITE, OUTGROWN, UNSTABLE
from mbd.kernel.hooks import scheme_error
from mbd.kernel.records import Equations, Guards, Kernel, Motion, Steps, Switching
from mbd.kernel.schemes.iteration import (
    MAX_CURVATURE,
    MAX_RATE_ERROR,
    MAX_UNCHECKED_ERROR,
    MIN_RATE_SHARE,
    is_small,
    note_fastest,
)
from mbd.kernel.stepping.barriers import crosses_barrier
from mbd.kernel.stepping.candidate import carry
from mbd.kernel.stepping.charts import whole_step
from mbd.kernel.stepping.growth import is_unstable, leave_rows_alone, note_unforeseen, outgrows
from mbd.kernel.stepping.poles import peaks_within
from mbd.kernel.stepping.restart import compose, consistent, evaluate, fill_block
from mbd.kernel.stepping.scales import still_energy

BULGE_SHARE = 0.5
"""Error of a rate over dt times the largest way of slopes from a line, where forces begin within a step [-]."""
MAX_UNEXPLAINED_ENERGY = 0.5
"""Part of the kinetic energy at the end of a step that may be neither old nor work of forces [-]."""
MIN_CHANGE_ENERGY = 0.085
"""Energy of the change of velocities over the kinetic one below which less than half of it is new, (1 − √½)² [-]."""


def judge_change(K: Kernel, h: float, t1: float) -> int:
    """0 where the candidate may be a continuation of the motion; OUTGROWN, UNSTABLE, GAINED or LEAPT elsewhere."""
    whole = whole_step(K)
    if K.turning_step > 0.0:
        whole = min(whole, K.turning_step)
    stretch = max(1.0, whole / h)
    if K.estimates == 0 and is_small(K, h, stretch):
        return 0
    worst = largest_share(K, h, stretch)
    unseen = (K.second_look == 1 or (K.second_look == 2 and worst > MAX_UNCHECKED_ERROR)) and unseen_change(K, h)
    if (worst <= MAX_UNCHECKED_ERROR and not unseen and not bends(K, h)) or K.near_singular > 0 or sharing(K):
        return 0
    if worst > MAX_UNCHECKED_ERROR:  # then stages have seen nothing that counts
        K.stage_pull = 0.0
    return look_closer(K, h, t1, stretch, worst > K.look_twice or unseen)


def unseen_change(K: Steps, h: float) -> bool:
    """Whether stages have met forces that the estimate may not see, such as a wall's; K.failure_size tells how large.

    An estimate of few stages may be zero though a force begins, ends or acts for a part of the step: how far slopes at
    stages are from a straight line between those at its ends tells, which is ½ of a force that begins, ¼ of one that
    grows from zero with t². Of many stages the second estimate does, of low order. Either is compared with the rate
    itself, as fast as it was or as forces make it in a step, and with a part of the fastest of its cluster, which
    `largest_share` has noted.
    """
    n_v = K.n_v
    width = n_v + K.n
    stages = K.n_nodes
    end = stages * width
    third = stages * stages + 3 * stages + 1
    worst = MAX_RATE_ERROR
    for i in range(n_v):
        first = K.stages[n_v + i]
        last = K.stages[end + n_v + i]
        error = 0.0
        for j in range(stages + 1 if K.second_look == 2 else 0):
            error += h * K.tableau[third + j] * K.stages[j * width + n_v + i]
        for j in range(1, stages if K.second_look == 1 else 0):
            slope = K.stages[j * width + n_v + i]
            error = max(error, BULGE_SHARE * h * abs(slope - first - K.nodes[j] * (last - first)))
        error = abs(error)
        if error <= worst * abs(K.y1[i]):  # most steps
            continue
        largest = 0.0
        for j in range(stages + 1):
            largest = max(largest, abs(K.stages[j * width + n_v + i]))
        size = max(max(K.peak[i], h * largest), max(abs(K.y[i]), abs(K.y1[i])))
        size = max(size, max(K.rest_speed, MIN_RATE_SHARE * K.fastest[K.cluster[i]]))
        if error > worst * size:
            worst = error / size
            K.failure_index = i
    K.failure_size = max(K.failure_size, worst if worst > MAX_RATE_ERROR else 0.0)
    return worst > MAX_RATE_ERROR


def bends(K: Equations, h: float) -> bool:
    """Whether accelerations change so much that a pole may lie between, even if so predicted; K.failure_index whose."""
    note_fastest(K, False)
    worst = MAX_CURVATURE
    for i in range(K.n_v):
        change = h * abs(K.rate1[i] - K.rate[i])
        size = max(K.rest_speed, K.fastest[K.cluster[i]])
        if change > worst * size:
            worst = change / size
            K.failure_index = i
    return worst > MAX_CURVATURE


def look_closer(K: Kernel, h: float, t1: float, stretch: float, rough_enough: bool) -> int:
    """The same of a candidate that a glance does not clear, left as it was; `peaks_within` alone if not rough."""
    rough = K.failure_size
    blocked = K.failure_index
    at_y = carry(K.q1, K.inside, 0, K.n_q, True)
    at_D = carry(K.y1, K.inside, at_y, K.n, True)
    status = 0
    coarse = rough_enough and rough > MAX_RATE_ERROR
    # friction in a plane is stiff where it turns at a slow γ, for an instant only
    stiff = K.explicit == 1 and K.n_cones == 0 and (coarse or may_amplify(K, h))
    known = (rough_enough or stiff) and note_unforeseen(K, h, t1, at_y, at_D)
    if rough_enough and known and outgrows(K, h, t1, stretch, at_y, at_D):
        status = OUTGROWN
    elif stiff and known and is_unstable(K, h, t1, at_y, at_D):
        status = UNSTABLE
    for c in range(K.n_clusters if status == 0 else 0):  # one that is worse may hide another
        if status != 0:
            continue
        if coarse and gains(K, h, t1, at_y, at_D, c):
            status = GAINED
        elif peaks_within(K, h, at_y, c):
            status = LEAPT
        for i in range(K.n_v if status != 0 else 0):
            if K.cluster[i] == c and K.cluster[blocked] != c:
                blocked = i
    uneven = K.explicit == 0 and K.changes_little == 0.0 and (coarse or K.estimates == 1)
    if status == 0 and uneven and crosses_barrier(K, h, t1, at_y, at_D):
        status = GAINED
    carry(K.q1, K.inside, 0, K.n_q, False)
    carry(K.y1, K.inside, at_y, K.n, False)
    if status == 0 and rough_enough and K.strategy == 0:
        if K.estimates == 0:
            rough = uncertainty(K, h, t1, at_D)
        if rough > MAX_RATE_ERROR:
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


def may_amplify(K: Motion, h: float) -> bool:
    """Whether rates have doubled, or changed as by forces too stiff for an explicit step: beyond its stability either.

    An estimated error may vanish by chance where a step multiplies all that there is. Each cluster is judged alone.
    """
    for c in range(K.n_clusters):
        old = 0.0
        new = 0.0
        most = 0.0
        for i in range(K.n_v):
            if K.cluster[i] == c:
                old = max(old, abs(K.y[i]))
                new = max(new, abs(K.y1[i]))
                most = max(most, abs(K.rate1[i] - K.rate[i]))
        if new > 2.0 * old or h * most > K.stability * new:
            return True
    return False


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
    note_fastest(K, True)
    worst = 0.0
    for i in range(K.n):
        floor = max(K.rest_speed, MIN_RATE_SHARE * K.fastest[K.cluster[i]])
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
    note_fastest(K, True)
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
        floor = max(K.rest_speed, MIN_RATE_SHARE * K.fastest[K.cluster[i]])
        share = error / max(floor, max(abs(K.y[i]), abs(K.y1[i])))
        if share > worst:
            worst = share
            who = i
    if worst * cube > MAX_UNCHECKED_ERROR:
        K.failure_index = who
        K.failure_size = worst
    return worst * cube


def gains(K: Switching, h: float, t1: float, at_y: int, at_D: int, cluster: int) -> bool:
    """Whether more than half of a cluster's kinetic energy at the end is neither old nor work of forces along the way.

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
                if K.cluster[i] == cluster:
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
    if not (new > max(1.1 * old, still_energy(K)) and new - old - most > MAX_UNEXPLAINED_ENERGY * new):
        return False
    if K.n_active == 0:
        return True
    for i in range(K.n):
        K.inside[at_D + i] = K.inside[at_y + i] - K.y[i]
    leave_rows_alone(K, at_D)
    free = 0.0
    for i in range(K.n_v):
        for j in range(K.n_v if K.cluster[i] == cluster else 0):
            free += 0.5 * K.inside[at_D + i] * K.acc[i * K.n + j] * K.inside[at_D + j]
    return free > MIN_CHANGE_ENERGY * new
