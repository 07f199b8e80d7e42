"""What every Newton iteration of a step shares: prediction, size of the residual, acceptance."""

from mbd.equal import NOMINAL_RTOL
from mbd.kernel.algebra.ordered import clear_tangent
from mbd.kernel.algebra.redundancy import clear_dependent
from mbd.kernel.codes import EPS
from mbd.kernel.contact.cones import fill_slips
from mbd.kernel.hooks import call
from mbd.kernel.records import Equations, Model, Motion, Reals, Settings, SingularSteps, Steps
from mbd.kernel.stepping.restart import compose, note_scales
from mbd.kernel.stepping.scales import FORCE_ULPS, add_force_floors

MAX_ITERATIONS = 50
"""Newton iterations, halvings included, after which a step counts as failed; one that converges takes one to three."""
MAX_UNCHECKED_ERROR = 0.01
"""Estimated error of a rate, over the rate, up to which a step needs no closer look, whatever the scheme [-]."""
MAX_RATE_ERROR = 0.2
"""The same above which forces along the way are asked whether it can be the motion [-]."""
MIN_RETRY_SHARE = 0.1
"""Part of a step below which a failing step is not shortened any further [-]."""
MAX_UNEXPLAINED_CHANGE = 0.5
"""Part of a change of velocities by which accelerations miss it that asks for a look along it [-]."""
MAX_CURVATURE = 0.1
"""Change of accelerations in a step, times its size, over the fastest rate, above which poles are looked for [-]."""
MIN_RATE_SHARE = 0.01
"""Part of the fastest rate below which another one hardly takes part in the motion [-]."""
MIN_HALVED_RESIDUAL = 1e4
"""Residual over its tolerance above which a correction that does not reduce it is halved."""


def predict(K: SingularSteps, h: float, t1: float, c_C: float, c_K: float) -> None:
    """The block at t₁ with rates, multipliers and position correction extrapolated."""
    block = K.block
    stretch = h / K.aux_step
    cube = shift_growth(K, h)
    mean = 1.0 / (1.0 - K.alpha_m)
    by_rate = (1.0 - K.alpha_f) * mean
    by_last = K.alpha_f * mean
    by_aux = K.alpha_m * mean
    block[0] = t1
    block[1] = c_C
    block[2] = c_K
    block[K.o_q : K.o_q + K.n_q] = K.q[: K.n_q]
    for k in range(K.n_rows):
        block[K.o_lam + k] = K.lam[k] + h * K.lam_slope[k]
    block[K.o_anchor : K.o_anchor + K.n_anchors] = K.anchors[: K.n_anchors]
    fill_slips(K)
    for i in range(K.n):
        last = K.rate[i]
        a0 = last + stretch * (K.aux[i] - last)
        rate = last + h * K.slope[i]
        a1 = by_rate * rate + by_last * last - by_aux * a0
        block[K.o_a + i] = rate
        block[K.o_v + i] = K.y[i] + h * ((1.0 - K.gamma) * a0 + K.gamma * a1)
        if i < K.n_v:
            shift = (K.shift[i] + stretch * K.shift_change[i]) * cube
            K.shift1[i] = shift
            block[K.o_x + i] = h * K.y[i] + h * h * ((0.5 - K.beta) * a0 + K.beta * a1) + shift


def shift_growth(K: Steps, h: float) -> float:
    """The factor by which a position correction, that of order h³, grows from the last step to this one."""
    if h > (1.0 + NOMINAL_RTOL) * K.step:  # the longer of a pair: round-off of the shorter does not grow
        return 1.0
    stretch = h / K.aux_step
    return float(stretch * stretch * stretch)


def soundness_at(K: Settings, m: int) -> int:
    """Where the output of straight-line factors goes on behind r, h, ḣ, ∂ḣ/∂x: sound, weakest, the correction."""
    if K.stabilized == 0:
        return int(K.n + m)
    return int(K.n + 2 * m + m * K.n_v)


def residual_size(K: Motion, o_r: int, m: int, c_C: float, c_K: float, tolerance: float, both: int) -> float:
    """Largest residual over its tolerance: balance, h and, with `both`, ḣ, each block apart; −1 if not finite.

    That of the balance is K.blur at least. Rows are held as closely as the motion of their own cluster asks for.
    """
    size = 0.0
    finite = 0.0
    fastest = 0.0
    for i in range(K.n):
        r = abs(K.out[o_r + i])
        finite += r
        size = max(size, r * K.weight[i])
    size /= max(tolerance, K.blur)
    speed = 0.0
    for i in range(K.n_v):
        fastest = max(fastest, abs(K.block[K.o_a + i]))
        speed = max(speed, abs(K.block[K.o_v + i]))
    if K.n_clusters > 1:
        note_largest(K, K.o_a, K.fastest)
        note_largest(K, K.o_v, K.typical)
    o_h = o_r + K.n
    for k in range(m):
        row = K.rows[k]
        if K.n_clusters > 1:
            fastest = K.fastest[K.cluster[K.n + row]]
            speed = K.typical[K.cluster[K.n + row]]
        h = abs(K.out[o_h + k])
        finite += h
        limit = tolerance * min(c_K * fastest, K.scale[K.n + row])
        floor = 16.0 * EPS * K.scale[K.n + row]
        if both == 1:
            limit = tolerance * min(c_C * speed, K.scale[K.n + row])
        elif K.row_level[row] == 1:  # a rate stands in the place of h
            if K.stabilized == 1:
                h = abs(K.out[o_h + m + k])
            limit = tolerance * min(c_C * fastest, K.scale[K.n + K.n_rows + row])
            floor = 16.0 * EPS * K.scale[K.n + K.n_rows + row]
        size = max(size, h / (max(floor, limit) + 1e-300))
        if both == 1:
            rate = abs(K.out[o_h + m + k])
            finite += rate
            floor = 16.0 * EPS * K.scale[K.n + K.n_rows + row]
            size = max(size, rate / (max(floor, tolerance * c_C * fastest) + 1e-300))
    if not finite < 1e300:
        return -1.0
    return size


def note_largest(K: Model, first: int, largest: Reals) -> None:
    """The largest of the numbers of the block, from `first` on, of the coordinates of each cluster."""
    for c in range(K.n_clusters):
        largest[c] = 0.0
    for i in range(K.n_v):
        c = K.cluster[i]
        largest[c] = max(largest[c], abs(K.block[first + i]))


def roughly(K: Model) -> float:
    """Residuals over 256 times their round-off that pass for it; over K.blur, where that is more, only what it says."""
    return 16.0 if K.blur <= 256.0 * EPS else 1.0


def is_below_floors(K: Equations, o_r: int, m: int, both: int) -> bool:
    """Whether a residual that falls no more is round-off beside what `stepping.scales` tells of forces that vanish.

    Scales, which were raised to terms at the iterate, are those with their floors then.
    """
    add_force_floors(K, min(1.0, FORCE_ULPS * EPS / K.tolerance))
    if residual_size(K, o_r, m, 0.0, 0.0, 1.0, both) > 16.0:  # rows
        return False
    return residual_size(K, o_r, 0, 0.0, 0.0, K.tolerance, both) <= 1.0


def weigh_by_accelerations(K: Equations) -> bool:
    """Weigh residuals by forces as large as the accelerations at the iterate ask for, until `restore_scales`.

    Returns whether the scales that were noted are round-off beside them.

    Where little acted as scales were noted, a correction that meets the rows seems to make the balance far worse, which
    is small beside the forces that the rows ask for. So rows and balance are weighed against each other before and
    after it.

    A coordinate without inertia balances moments of forces alone, which have no arm where all points are at the origin:
    there the way in the step is one.
    """
    note_scales(K)
    add_force_floors(K, FORCE_ULPS * EPS)
    nothing = False
    force = 0.0
    way = K.extent
    for i in range(K.n_v):
        if K.unit[i] == 0:
            force = max(force, K.known[i])
            way = max(way, abs(K.block[K.o_x + i]))
    for unit in range(2):
        largest = 0.0
        for i in range(K.n_v):
            inertia = 0.0  # all of it: a body turns about a point that stays, where its frame may be
            for j in range(K.n_v):
                inertia += abs(K.acc[i * K.n + j] * K.block[K.o_a + j])
            if K.unit[i] == unit:
                largest = max(largest, inertia)
        for i in range(K.n_v):
            size = largest
            if unit == 1 and K.acc[i * K.n + i] == 0.0:
                size = max(size, force * way)
            if K.unit[i] == unit and size < 1e300:
                nothing = nothing or K.known[i] < K.scale[i] or K.known[i] < FORCE_ULPS * EPS * size
                K.weight[i] = 1.0 / max(K.scale[i], size)
    return nothing


def runs_away(K: Equations, m: int) -> bool:
    """Whether multipliers fight each other: their forces cancel to less than 1e-7 of their size.

    Then r would vanish beside its terms whatever the motion, and a step must not be accepted for it.
    """
    size = K.n + m
    clear_tangent(K, m, K.spare)
    call(K, K.tangent_program, K.spare)
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


def finish(K: SingularSteps, h: float) -> bool:
    """The converged block becomes the candidate; whether it changes little, so that no other look at it is needed.

    That is: it neither `overturns` nor fails the first look of `stepping.resolution`, as in most steps of a motion.
    """
    compose(K, K.q1)
    most = 0.0
    unforeseen = 0.0
    fastest = 0.0
    stretch = h / K.aux_step
    mean = 1.0 / (1.0 - K.alpha_m)
    by_rate = (1.0 - K.alpha_f) * mean
    by_last = K.alpha_f * mean
    by_aux = K.alpha_m * mean
    for i in range(K.n):
        last = K.rate[i]
        a0 = last + stretch * (K.aux[i] - last)
        rate = K.block[K.o_a + i]
        speed = K.block[K.o_v + i]
        change = rate - last
        most = max(most, abs(change))
        unforeseen = max(unforeseen, abs(change - h * K.slope[i]))
        fastest = max(fastest, abs(speed))
        K.rate1[i] = rate
        K.y1[i] = speed
        K.aux1[i] = by_rate * rate + by_last * last - by_aux * a0
    K.lam1[: K.n_rows] = K.block[K.o_lam : K.o_lam + K.n_rows]
    clear_dependent(K, K.lam1)
    if K.n > K.n_v or error_share(K, h) * most > 0.5:
        return False
    whole = K.step / h if K.step > h else 1.0
    return is_little(K, h, whole, most, unforeseen, fastest) if K.n_clusters == 1 else is_small(K, h, whole)


def is_little(K: Settings, h: float, stretch: float, most: float, unforeseen: float, fastest: float) -> bool:
    """Whether changes of rates in a step, in all and unpredicted, are small beside the fastest of their cluster."""
    cube = stretch * stretch * stretch
    small = h * unforeseen * cube <= 12.0 * MAX_UNCHECKED_ERROR * max(K.rest_speed, MIN_RATE_SHARE * fastest)
    return bool(small and h * most <= MAX_CURVATURE * max(K.rest_speed, fastest))


def note_fastest(K: Motion, both: bool) -> None:
    """The fastest rate of each cluster at the candidate, or at `both` ends of the step, into K.fastest."""
    for c in range(K.n_clusters):
        K.fastest[c] = 0.0
    for i in range(K.n_v):
        c = K.cluster[i]
        K.fastest[c] = max(K.fastest[c], abs(K.y1[i]))
        if both:
            K.fastest[c] = max(K.fastest[c], abs(K.y[i]))


def is_small(K: Steps, h: float, stretch: float) -> bool:
    """Whether the changes of all rates are little, in most steps."""
    note_fastest(K, False)
    for i in range(K.n):
        change = K.rate1[i] - K.rate[i]
        unforeseen = abs(change - h * K.slope[i])
        if not is_little(K, h, stretch, abs(change) if i < K.n_v else 0.0, unforeseen, K.fastest[K.cluster[i]]):
            return False
    return True


def error_share(K: Settings, h: float) -> float:
    """Estimated error of a coordinate in a step over the change of its acceleration [s²]."""
    return abs(1.0 / 6.0 - K.beta - 0.5 * (K.alpha_m - K.alpha_f)) * h * h


def overturns(K: Motion, h: float) -> bool:
    """Whether the estimated error of an angle in this step exceeds half a radian: it is not resolved at all.

    ``e = h² |1/6 − β − (α_m − α_f)/2| |v̇₁ − v̇₀|``
    """
    share = error_share(K, h)
    change = 0.0
    for i in range(K.n_v):
        if K.unit[i] == 1:
            change = max(change, abs(K.rate1[i] - K.rate[i]))
    return bool(share * change > 0.5)
