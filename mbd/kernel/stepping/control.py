"""Step-size control: the local error of a step against the one allowed, and the next step.

What a scheme owes to it: in a run with K.adaptive = 1, `scheme_step` leaves an estimate of its local error in K.error,
(n_v + n,): that of the increment x of positions [m, rad], then that of (v, z); `scheme_error` fills it in where a
scheme finds it from its memory. K.error_order is the power of the step with which that error per second falls. A scheme
takes any step, without a fixed grid: the present full step is K.step (K.dt is a short time that stands for
nothing else in such a run), and the state it keeps tells the size of its own last step (as K.aux_step does).

The error is controlled per unit of time: positions may err by K.allowed per second, and by their round-off in each
step, ``err = max |e| / (allowed h + round-off)``, where e is also h times the error of velocities and, relative to
the largest size that they had so far, that of first-order states: one that passes through zero is as accurate there as
elsewhere, and one that begins at zero is measured by what longer tries made of it. A step is taken again where
``0.9 err^(−1/p) < 0.8``, p = K.error_order, else this factor, between 0.2 and 5 (2 where the scheme remembers the
step), gives the next one; schemes with memory or factors keep their step between 0.8 and 1.25.
"""

from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.codes import (
    EPS,
    NOT_CONVERGED,
    NOT_FINITE,
    SINGULAR,
    SINGULAR_ROWS_MOVE,
    STAGNATED,
    TOO_NEAR,
    TOO_SMALL,
)
from mbd.kernel.hooks import scheme_error
from mbd.kernel.records import Balance, Kernel, SchemeAbilities, SingularSteps, State, Steps
from mbd.kernel.singular.step_size import is_too_noisy, noise_share, singular_step_size
from mbd.kernel.stepping.restart import compose, consistent, fill_block, lower_scales
from mbd.kernel.stepping.trial_step import try_step

MIN_STEP_RATIO = 1e-10
"""Shortest step over the longest [-]."""
SAFETY_FACTOR = 0.9
"""Part of the step that would just be allowed [-]."""
MIN_FACTOR = 0.2
"""Least factor from one step to the next try [-]."""
MAX_UNCHANGED_GROWTH = 1.25
"""Growth below which a scheme that remembers its step keeps it [-]."""
RETRY_FACTOR = 0.8
"""Factor below which a step is taken again [-]."""
POSITION_ULPS = 4.0
"""Error of positions, over the distance between neighbouring numbers, that is round-off [-]."""
INCREMENT_ULPS = 64.0
"""The same for what a step adds to them: stages and estimates are sums in which large terms cancel [-]."""
MAX_STATE_ERROR = 0.1
"""Error of a first-order state, over its size, up to which an explicit step tells that size [-]."""


def smallest_step(K: State) -> float:
    """Below it the clock does not move, or a run would never end: a motion that turns ever faster."""
    return float(max(64.0 * EPS * max(abs(K.time), K.longest), MIN_STEP_RATIO * K.longest))


def error_ratio(K: SingularSteps, h: float) -> float:
    """err of the module's text for the candidate."""
    n_v = K.n_v
    far = 0.0
    fast = 0.0
    for i in range(K.n_q):
        far = max(far, abs(K.q1[i]))
    for i in range(n_v):
        fast = max(fast, abs(K.y1[i]))
    floor = EPS * (POSITION_ULPS * far + INCREMENT_ULPS * h * fast)
    if K.singular_size == 1 and K.n_active > 0:
        floor += noise_share(K, h) * h * fast
    largest = 0.0
    for i in range(n_v):
        error = max(abs(K.error[i]), h * abs(K.error[n_v + i]))
        if not error < 1e300:
            return 1e300
        largest = max(largest, error)
    ratio = largest / (K.allowed * h + floor)
    for i in range(n_v, K.n):
        size = max(largest_state(K, i), h * max(abs(K.rate[i]), abs(K.rate1[i])))
        if size > 0.0:
            ratio = max(ratio, abs(K.error[n_v + i]) / size / (K.allowed * h + INCREMENT_ULPS * EPS))
    return ratio if ratio < 1e300 else 1e300


def largest_state(K: Steps, i: int) -> float:
    """The largest size of the first-order state y_i in the run, this candidate among it.

    What an explicit scheme made of it in a step that is not taken counts if its estimate is right to `MAX_STATE_ERROR`:
    the step may have been far too long. If none counted, a state that grows from zero by a broken power of
    time would stay as inaccurate, relative to its own size, however short the steps become.
    """
    z = i - K.n_v
    K.largest[z] = max(K.largest[z], abs(K.y[i]))
    size = max(K.largest[z], abs(K.y1[i]))
    if K.explicit == 0 or abs(K.error[K.n_v + i]) <= MAX_STATE_ERROR * abs(K.y1[i]):
        K.largest[z] = size
    return float(size)


def growth(K: SchemeAbilities, ratio: float) -> float:
    """Factor from this step to the next."""
    factor = float(K.most_growth)
    if ratio > 0.0:
        factor = min(max(SAFETY_FACTOR * ratio ** (-1.0 / K.error_order), MIN_FACTOR), factor)
    if K.explicit == 0 and RETRY_FACTOR <= factor <= MAX_UNCHANGED_GROWTH:
        return 1.0
    return factor


def is_to_shorten(status: int) -> bool:
    """Whether a step that ended so is tried with half its size."""
    stalled = status == NOT_CONVERGED or status == STAGNATED
    return stalled or status == SINGULAR or status == TOO_NEAR or status == NOT_FINITE


def controlled_step(K: Kernel, h: float) -> int:
    """A candidate whose error is allowed, after a step of h or less: K.step_taken; K.next_step is the next step."""
    t = K.time
    while True:
        wanted = h
        if K.singular_size == 1 and K.n_active > 0:
            h = singular_step_size(K, wanted, 1.0)
            if is_too_noisy(K, h):
                return SINGULAR_ROWS_MOVE
        K.error[: K.n_v + K.n] = 0.0
        status = try_step(K, h, t + h)
        if status == 0:
            scheme_error(K, h)
            ratio = error_ratio(K, h)
            factor = growth(K, ratio)
            if factor >= RETRY_FACTOR:
                K.local_error = ratio * K.allowed * h
                K.step_taken = h
                following = h * factor
                if wanted < (1.0 - 1e-6) * K.step or h < wanted:  # it was cut: its error says little of longer ones
                    following = max(following, K.step)
                K.next_step = min(following, K.longest)
                return 0
            h *= factor
            K.estimates_twice = 1
            lower_scales(K)
        elif is_to_shorten(status):
            h *= 0.5  # a long step may also have left the region where forces are defined
        else:
            return status
        K.n_rejected += 1
        if h < smallest_step(K):
            if status == 0:
                K.failure_time = t + h
                K.failure_step = h
                return TOO_SMALL
            return status
        K.step = h  # no step is tiny beside the one that may be taken here


def first_step(K: Balance) -> None:
    """K.step at an accepted, consistent state (Hairer, Nørsett & Wanner 1993, II.4).

    ``h = (0.01 tol / max(|ẏ|, |ÿ|))^(1/(p+1))`` with y = (q, v) and ÿ by one difference.
    """
    n = K.n
    speed = 0.0
    force = 0.0
    for i in range(n):
        force = max(force, abs(K.rate[i]))
        if i < K.n_v:
            speed = max(speed, abs(K.y[i]))
    size = 10.0 * K.allowed * K.longest
    ahead = 1e-2 * (speed + sqrt(size * force)) / force if force > 0.0 else K.dt
    ahead = min(max(ahead, 1e-3 * K.dt), K.dt)
    t = K.time
    fill_block(K, t, K.q, K.y)
    for i in range(K.n_v):
        K.block[K.o_x + i] = ahead * K.y[i]
    compose(K, K.q1)
    for i in range(n):
        K.y1[i] = K.y[i] + ahead * K.rate[i]
    change = max(speed, force)
    if consistent(K, t + ahead, K.q1, K.y1) == 0:
        for i in range(n):
            change = max(change, abs(K.jump[i] - K.rate[i]) / ahead)
    fill_block(K, t, K.q, K.y)
    h = K.longest
    if change > 0.0 and change < 1e300:
        h = (0.01 * size / change) ** (1.0 / (K.error_order + 1.0))
    K.step = min(max(h, 4.0 * smallest_step(K)), K.longest)
    K.estimates_twice = 1
