"""Many steps with switching: step, judge, accept or switch, observe."""

from mbd.kernel.codes import (
    DONE,
    EVENT,
    FULL,
    LAST,
    NEW_MODE,
    PAUSE,
)
from mbd.kernel.contact.cone_steps import (
    ONSET_STEP_GROWTH,
    ONSET_STEP_RATIO,
    approached_end,
    slides_at_first,
    slides_on,
)
from mbd.kernel.contact.contact_log import room_to_log
from mbd.kernel.contact.nonsmooth_cones import hold_for_step
from mbd.kernel.events.guard_sides import next_crossing, settle_sides
from mbd.kernel.events.transitions import find_due, has_happened, is_due, settle_fresh, take_transitions
from mbd.kernel.records import Kernel
from mbd.kernel.singular.step_pairs import ALONE, FIRST
from mbd.kernel.stepping.charts import divides_further, turned_end
from mbd.kernel.stepping.judge_step import MAX_SHORTENINGS, end_crossing, end_timer, judge_step
from mbd.kernel.stepping.observe import is_awaited, store_row
from mbd.kernel.stepping.starting import find_mode, restart
from mbd.kernel.stepping.step_retry import is_shortened, part_end, step_end, tried_step
from mbd.kernel.tangent_rules import held_at_end


def begin(K: Kernel) -> int:
    """What comes before a step: room for its rows, a start of the scheme, code of the mode; −1 if it can be taken."""
    status = start_again(K)
    while status < 0 and K.n_guards > 0 and next_crossing(K) >= 0:
        status = end_crossing(K, next_crossing(K))
        if status < 0:
            status = start_again(K)
    if status >= 0:
        return status
    near = 1e-12 * K.dt
    if K.until >= K.end:
        near = max(near, K.near_end)
    if K.time >= K.until - near:
        status = end_timers(K)
        return DONE if status < 0 else status
    if K.mode_id < 0:
        K.mode_id = find_mode(K)
        if K.mode_id < 0:
            return NEW_MODE
    return -1


def end_timers(K: Kernel) -> int:
    """What is due at the accepted state, one after the other; −1, or a status for the caller."""
    status = -1
    while status < 0 and K.n_machines > 0:
        find_due(K)
        if not is_due(K, K.time):
            return -1
        status = end_timer(K, 0.0)
        if status < 0:
            status = start_again(K)
    return status


def start_again(K: Kernel) -> int:
    """Room for the rows of a step, and a start of the scheme where one is due; −1, or a status for the caller."""
    if K.n_stored + 4 + 2 * K.n_guards > K.capacity or K.n_logged + room_to_log(K) > K.event_capacity:
        return FULL
    while K.restart_due > 0:
        visible = K.restart_due == 1
        if visible:  # somebody may have changed the state or a parameter
            K.looks_ahead = 0
        first = K.n_logged
        if K.n_machines > 0:
            status = take_transitions(K)
            if status != 0:
                return status
        status = restart(K)
        if status != 0:
            return status
        K.restart_due = 0
        if K.n_guards > 0:
            settle_sides(K)
        if K.n_machines > 0:
            settle_fresh(K)
            if has_happened(K):  # contacts that opened or closed for want of consistent forces
                K.restart_due = 1
        if visible or K.n_logged > first:
            store_row(K)
        if is_awaited(K, first):
            return EVENT
    return -1


def advance(K: Kernel) -> int:
    """Step until `until`, a full store, a mode without code, an event to report, or a failure."""
    steps = 0
    while True:
        status = begin(K)
        if status >= 0:
            return status
        if steps >= K.chunk:
            return PAUSE
        steps += 1
        status = take_step(K)
        if status >= 0:
            return status


def take_step(K: Kernel) -> int:
    """One step: to where it is to end, tried, and judged; −1 where the run goes on."""
    t = K.time
    on_grid = step_end(K)
    t1 = part_end(K, on_grid)
    within = t1 < on_grid  # the step ends inside one of the grid, where guards are looked at
    cut = t1 > K.until - 1e-6 * K.step
    if cut and K.until >= K.end:
        if abs(t1 - K.until) > K.near_end:  # the caller decides: a step of the grid as in a longer run, or one cut
            return LAST
        cut = False
    t1 = K.until if cut else held_at_end(K, t1)
    # shorter where a joint turns far, sliding comes to rest or a timer is due
    wanted = t1
    if K.vector == 0:
        t1 = min(t1, turned_end(K, t1))
    if K.n_cones > 0 and K.strategy == 0:
        t1 = min(t1, approached_end(K, t1))
    if K.n_machines > 0:
        find_due(K)
        if is_due(K, t):
            return end_timer(K, 0.0)
        if K.due_guard >= 0:
            t1 = min(t1, K.due_time)
    if t1 < wanted:
        within = True
        cut = False
    # the candidate
    h = t1 - t
    if K.halvings > 0:
        h *= 0.5**K.halvings
        t1 = t + h
        cut = False
    full = h
    if K.n_cones > 0 and K.strategy == 1:
        hold_for_step(K, h)
    begun = K.begun_step / ONSET_STEP_GROWTH
    status = tried_step(K, h, t1)
    # sliding that begins or comes to rest in the step is followed by shorter ones
    if K.n_cones > 0 and K.strategy == 0:
        released = False
        for _ in range(MAX_SHORTENINGS):
            if status == 0:
                if not slides_on(K):
                    break
                if not released:  # what was to rest in the whole step may slide on in half of it: let go at the same h
                    h = min(0.5 * h, K.step_taken)
                released = True
            elif is_shortened(K, status) and slides_at_first(K, ONSET_STEP_RATIO * h):
                h *= ONSET_STEP_RATIO
                K.begun_step = h
            else:
                break
            full = h
            t1 = t + h
            within = True
            cut = False
            status = tried_step(K, h, t1)
    if status != 0:
        return status
    # what was tried may have become shorter
    if K.step_taken != h:
        within = within or (K.step_taken < h and K.adaptive == 0 and divides_further(K, K.step_taken))
        if K.n_cones > 0 and K.strategy == 0 and K.step_taken < h and slides_at_first(K, K.step_taken):
            within = True
            K.begun_step = K.step_taken
        h = K.step_taken
        t1 = t + h
        cut = cut and h >= full
    if 0.0 < K.begun_step <= begun:  # they do not grow: short ones may fail by round-off where a whole one does not
        K.begun_step = 0.0
    if K.adaptive == 1 or K.paired_step == FIRST or K.paired_step == ALONE:
        full = h
    K.n_steps += 1
    return judge_step(K, h, full, t1, cut, within)
