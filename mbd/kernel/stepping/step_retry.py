"""Where the next step ends, and what is tried until there is a candidate."""

from mbd.equal import NOMINAL_RTOL
from mbd.kernel.codes import (
    GAINED,
    LAST,
    LEAPT,
    NOT_CONVERGED,
    NOT_FINITE,
    OUTGROWN,
    SINGULAR,
    SINGULAR_ROWS_MOVE,
    STAGNATED,
    TOO_NEAR,
)
from mbd.kernel.contact.nonsmooth_cones import hold_all
from mbd.kernel.records import Balance, Guards, Kernel, SchemeAbilities, State
from mbd.kernel.schemes.iteration import MIN_RETRY_SHARE
from mbd.kernel.singular.step_pairs import ALONE, FIRST, LONG_PART, SECOND, SHORT_PART, may_pair
from mbd.kernel.singular.step_size import is_resolved, is_too_noisy, singular_step_size
from mbd.kernel.stepping.control import controlled_step
from mbd.kernel.stepping.resolution import judge_change
from mbd.kernel.stepping.restart import consistent, lower_scales
from mbd.kernel.stepping.trial_step import try_step

MIN_TURNING_SHARE = 1e-3
"""The same of a step that is too long for how friction in a plane turns with a slow γ [-]."""
RETRY_FACTOR = 0.6180339887498949
"""Golden ratio: what is left of a step whose Newton iteration failed, for the next try [-].

No power of it is a simple fraction, so that tries do not meet a configuration that repeats with the grid again.
"""


def is_shortened(K: SchemeAbilities, status: int) -> bool:
    """Whether a step that ended so is tried again with another size; an explicit one beyond its stability is not."""
    stalled = status == NOT_CONVERGED or status == STAGNATED or status == SINGULAR
    return stalled or status == TOO_NEAR or (status == GAINED and K.explicit == 0)


def strays(K: Balance, h: float) -> bool:
    """Whether forces that are not finite within a step are so for where it strayed to, not for the time of its end."""
    return bool(consistent(K, K.time + h, K.q, K.y) == 0)


def judged_step(K: Kernel, h: float, t1: float) -> int:
    """A candidate at t1 = t + h that may be a continuation of the motion."""
    K.changes_little = 0.0
    status = try_step(K, h, t1)
    if status != 0 or (K.changes_little == 1.0 and K.estimates == 0):
        return status
    return judge_change(K, h, t1)


def step_end(K: State) -> float:
    """Where the next step of the grid ends; the second of a pair has its own size."""
    if K.paired_step == SECOND:
        return float(K.time + LONG_PART * K.step)
    return float(K.grid_start + (K.grid_steps + 1) * K.step)


def part_end(K: Guards, on_grid: float) -> float:
    """Where the next step ends: on the grid, or after the part of a step in which a guard may have fired."""
    if K.in_substeps == 1:
        near = K.time + K.substep
        if near < on_grid - 1e-6 * K.substep:
            return float(near)
    return on_grid


def tried_step(K: Kernel, h: float, t1: float) -> int:
    """A candidate at t1, or earlier where Newton's method or the allowed error asks for it; K.step_taken its step.

    A singular configuration is stepped over by a pair of steps, or a shortened one; stiff places get smaller.
    """
    if K.scales_raised == 1:
        lower_scales(K)
    if K.adaptive == 1:
        return controlled_step(K, h)
    if K.paired_step == FIRST or K.paired_step == ALONE:  # the step is taken once more
        K.paired_step = 0
    full = h
    step = K.step
    if K.singular_size == 1 and K.n_active > 0:
        status = step_past_singularity(K, h)
        h = K.step_taken
        if status == LAST or status == SINGULAR_ROWS_MOVE:
            return status
        full = h
    else:
        status = judged_step(K, h, t1)
    if status == TOO_NEAR and may_pair(K, h):
        if K.time + (SHORT_PART + LONG_PART) * step < K.until - NOMINAL_RTOL * step:
            h = SHORT_PART * step
            full = h
            K.paired_step = FIRST
            status = judged_step(K, h, K.time + h)
        elif K.until >= K.end:
            return LAST
    if K.n_cones > 0 and K.strategy == 1 and (is_shortened(K, status) or is_rough(status)) and hold_all(K):
        status = judged_step(K, h, K.time + h)
    K.too_near = 1 if status == TOO_NEAR else 0
    while h > MIN_RETRY_SHARE * full and (is_shortened(K, status) or (status == NOT_FINITE and strays(K, h))):
        h *= RETRY_FACTOR
        status = judged_step(K, h, K.time + h)
    if K.n_cones > 0 and is_rough(status) and K.strategy == 0:
        status = step_while_turning(K, h)
        h = K.step_taken
    if h < full and (K.paired_step == FIRST or K.paired_step == ALONE):
        K.paired_step = 0
    K.step_taken = h
    return status


def is_rough(status: int) -> bool:
    """Whether a step seems to be too long for what forces do in it."""
    return status == OUTGROWN or status == LEAPT


def step_while_turning(K: Kernel, h: float) -> int:
    """A candidate after a shorter step, judged by itself, where friction in a plane turns with a slow γ: K.step_taken.

    What it would do in a whole step of dt says nothing: soon γ is another, or nothing slides.
    """
    shortest = MIN_TURNING_SHARE * h
    status = OUTGROWN
    if h > 0.999 * K.step:
        h *= RETRY_FACTOR
    while is_rough(status) and h > shortest:
        K.step_taken = h
        K.turning_step = h
        status = judged_step(K, h, K.time + h)
        h *= RETRY_FACTOR
    K.turning_step = 0.0
    return status


def step_past_singularity(K: Kernel, unit: float) -> int:
    """A candidate of a scheme of several stages after a step of this size, or another near a singularity: K.step_taken.

    A step over the singularity that is longer than others must be resolved like these; else they lead up to it.
    """
    h = singular_step_size(K, unit, K.longest_over)
    if h > unit:
        if K.time + h > K.until - NOMINAL_RTOL * unit:
            if K.until >= K.end:
                return LAST
            h = singular_step_size(K, unit, 1.0)
        else:
            status = judged_step(K, h, K.time + h)
            K.step_taken = h
            K.paired_step = ALONE
            if status == 0 and is_resolved(K, h):
                return status
            h = singular_step_size(K, unit, 1.0)
    K.step_taken = h
    K.paired_step = ALONE if h != unit else 0
    if is_too_noisy(K, h):
        return SINGULAR_ROWS_MOVE
    return judged_step(K, h, K.time + h)
