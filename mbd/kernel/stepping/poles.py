"""Whether a step has leapt over a place where forces are far beyond those at its ends, such as the pole of 1/x².

Both ends of such a step may look alike, and the scheme has seen nothing of what lies between. Along the way from the
old to the new state the largest accelerations are looked for, by halving the part of the way around the largest found:
at a pole they grow at each halving, at a bump that the step does not resolve they become many times those at the ends.

An explicit scheme of twelve stages whose estimated error is small has looked at as many places itself, a seventh of the
step from any other at most; next to an end it has not. In space, without rows, that is enough.
"""

from mbd.equal import DIRECT_PIVOT_RTOL
from mbd.kernel.algebra.linear import solve_definite
from mbd.kernel.codes import ACCELERATIONS, NOT_FINITE
from mbd.kernel.hooks import call
from mbd.kernel.records import Balance, Guards, Switching
from mbd.kernel.stepping.free_rates import NOT_CLEAR, rates_in_block
from mbd.kernel.stepping.restart import compose, consistent, evaluate, fill_block
from mbd.kernel.stepping.scales import still_energy

MIN_RISE = 1.5
"""Accelerations within a step over those at its ends below which there is nothing to be found [-]."""
MAX_RISE = 100.0
"""Accelerations within a step over those at its ends that no scheme can have seen [-]."""
END_SHARE = 1.0 / 256.0
"""Part of a step at the end of larger accelerations, over which they are looked at for a rise [-]."""
MIN_SQUARED_RISE = 16.0
"""Relative rise of squares of accelerations over a step, were it to go on, above which a pole may be near [-]."""


def peaks_within(K: Switching, h: float, at_y: int, cluster: int) -> bool:
    """Whether accelerations of a cluster within the step are `MAX_RISE` those at its ends, and decide on its motion.

    The new state is in K.inside, its velocities from `at_y` on; K.q1, K.y1 and the block are overwritten.
    """
    low = 0.0
    width = 0.25  # between the places that are looked at: five, of which two ends
    first = pull_at(K, h, 0.0, at_y, cluster)
    last = pull_at(K, h, 1.0, at_y, cluster)
    if first == NOT_CLEAR or last == NOT_CLEAR:
        return False
    ends = max(first, last)
    close = pull_at(K, h, END_SHARE if first >= last else 1.0 - END_SHARE, at_y, cluster)
    rises = (
        close > (1.0 + END_SHARE * MIN_SQUARED_RISE) * ends
    )  # a pole next to that end, which halves of the way would miss
    free = K.n_rows == 0 and K.n_frictions == 0 and K.n_clusters == 1
    if free and not rises and 0.0 < K.stage_pull < MIN_RISE * MIN_RISE * ends:
        return False
    a0 = first
    a2 = NOT_CLEAR
    a4 = last
    for halving in range(12):
        a1 = pull_at(K, h, low + width, at_y, cluster)
        if a2 == NOT_CLEAR:
            a2 = pull_at(K, h, low + 2.0 * width, at_y, cluster)
        a3 = pull_at(K, h, low + 3.0 * width, at_y, cluster)
        if a1 == NOT_CLEAR or a2 == NOT_CLEAR or a3 == NOT_CLEAR:
            return False
        most = max(max(a1, a2), max(a3, max(a0, a4)))
        if most > MAX_RISE * MAX_RISE * ends:
            return h * h * most > max(motion_at(K, at_y, cluster), 2.0 * still_energy(K))
        # halvings after which the largest accelerations must be beyond those at the ends by `MIN_RISE` to go on
        if halving >= 3 and not rises and most < MIN_RISE * MIN_RISE * ends:
            return False
        if most == a0 or most == a1:  # the part around the largest: two of the four intervals
            a4 = a2
            a2 = a1
        elif most == a2:
            low += width
            a0 = a1
            a4 = a3
        else:
            low += 2.0 * width
            a0 = a2
            a2 = a3
        width *= 0.5
    return False


def pull_at(K: Switching, h: float, part: float, at_y: int, cluster: int) -> float:
    """v̇·M v̇ of a cluster at a part of the way.

    As good as infinite where it is not finite, `NOT_CLEAR` where it cannot be found.
    """
    t = K.time + h * part
    fill_block(K, t, K.q, K.y)
    for i in range(K.n):
        start = K.y[i]
        change = K.inside[at_y + i] - start
        K.y1[i] = start + part * change
        if i < K.n_v:
            way = h * (start + 0.5 * change)
            if K.vector == 1:
                way = K.inside[i] - K.q[i]
            K.block[K.o_x + i] = part * way  # straight: a curve through both velocities would leave the places between
        K.block[K.o_v + i] = K.y1[i]
    free = K.n_rows == 0 and K.n_frictions == 0
    if free and K.n_clusters == 1:
        pull = rates_in_block(K)
        if pull != NOT_CLEAR:
            return pull
    compose(K, K.q1)
    if free:
        quick = pull_without_rows(K, t, cluster)
        if quick != NOT_CLEAR:
            return quick
    status = consistent(K, t, K.q1, K.y1)
    if status == NOT_FINITE:
        return 1e300
    if status != 0:
        return NOT_CLEAR
    total = 0.0
    for i in range(K.n_v):
        for j in range(K.n_v if K.cluster[i] == cluster else 0):
            total += K.jump[i] * K.acc[i * K.n + j] * K.jump[j]
    return float(total)


def pull_without_rows(K: Balance, t: float, cluster: int) -> float:
    """The same at (q1, y1) where nothing is held, ``−v̇·f``; `NOT_CLEAR` where M is not clearly positive definite."""
    n = K.n
    evaluate(K, t, K.q1, K.y1)
    finite = 0.0
    for i in range(n):
        K.jump[i] = -K.acc[K.acc_f + i]
        finite += abs(K.jump[i])
    if not finite < 1e300:
        return NOT_CLEAR
    if solve_definite(K.acc, n, K.jump, K.spare) < DIRECT_PIVOT_RTOL:
        return NOT_CLEAR
    total = 0.0
    for i in range(K.n_v):
        if K.cluster[i] == cluster:
            total -= K.jump[i] * K.acc[K.acc_f + i]
    return float(total)


def motion_at(K: Guards, at_y: int, cluster: int) -> float:
    """v·M v of a cluster in the new state, with masses of the place that was looked at last, which is in the block."""
    call(K, ACCELERATIONS, K.acc)
    total = 0.0
    for i in range(K.n_v):
        for j in range(K.n_v if K.cluster[i] == cluster else 0):
            total += K.inside[at_y + i] * K.acc[i * K.n + j] * K.inside[at_y + j]
    return total
