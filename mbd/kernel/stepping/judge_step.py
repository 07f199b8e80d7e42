"""A candidate is judged: the event in it is located and handled, or it is accepted and observed, or taken again."""

from mbd.kernel.codes import AT_POSE, CHATTER, CROSS, JUMPED, PAUSE, PULL, STICK
from mbd.kernel.contact.carried import slides_as_carried
from mbd.kernel.contact.cone_steps import (
    ONSET_STEP_RATIO,
    SLIDES_ON,
    come_to_zero,
    shorter_turn,
    slides_at_first,
    slides_on,
    slides_until_event,
    speeds_up,
)
from mbd.kernel.contact.cones import friction_size
from mbd.kernel.contact.nonsmooth import closes_below_surface, must_release
from mbd.kernel.events.crowding import crowds
from mbd.kernel.events.guard_sides import striking_contact
from mbd.kernel.events.guard_substeps import parts_to_take
from mbd.kernel.events.guards import is_quiet, judge
from mbd.kernel.events.handling import handle_event, land
from mbd.kernel.events.locate import find_jump, jumps_over_stop, locate
from mbd.kernel.events.transitions import is_due
from mbd.kernel.records import Events, Guards, Kernel, Mechanism, Switching
from mbd.kernel.singular.events import find_passed_events, log_passed_events, may_pass_events, refuses
from mbd.kernel.stepping.accept_restart import event_at_start, project_velocity
from mbd.kernel.stepping.charts import wants_row
from mbd.kernel.stepping.conclude_step import conclude
from mbd.kernel.stepping.observe import store_passed_row, store_row
from mbd.kernel.stepping.restart import active_rows, consistent, largest_force, take_consistent
from mbd.kernel.stepping.starting import still_dependent
from mbd.kernel.stepping.step_retry import is_shortened, tried_step
from mbd.kernel.stepping.trial_step import try_step
from mbd.kernel.tangent_rules import follow_candidate, follow_event, follows_rows

MAX_SHORTENINGS = 5
"""Tries of shorter steps as sliding begins or ends [-]."""
ESTIMATE_EXCESS = 10.0
"""An estimate of low order over the change of rates, times this, is a step's ratio to the time of a change [-].

The factor of Hairer, Norsett & Wanner 1993, II.10, between two estimates of a step.
"""


def has_spurious_reaction(K: Mechanism) -> bool:
    """Whether a step ends with a contact that pulls, or a friction that sticks beyond its limit, judged to do neither.

    The multipliers of a step belong to its own accelerations, which satisfy the constraints on average only: those of
    index 3 err for some steps after a start, and undamped ones alternate where dt is long for the motion. Consistent
    ones, by which such a row was judged, take the place of the step's.
    """
    for c in range(K.n_contacts):
        if K.closed[c] == 1 and K.kind[c] == 0 and K.opens[c] == 0 and K.lam1[K.normal[c]] > 0.0:
            if K.lam1[K.normal[c]] > PULL * largest_force(K, K.normal[c]):
                return True
    if K.strategy == 0:
        for f in range(K.n_frictions):
            excess = friction_size(K, f, K.lam1) - K.limit[f]
            if K.sticks[f] == 1 and excess > 0.0 and excess > PULL * largest_force(K, K.friction_row[f]):
                return True
    return False


def clear_rejected_events(K: Guards) -> None:
    """Clear the flags of rejected guards; events that the step passes stay rejected."""
    K.active[: K.n_contacts + K.n_guards + K.n_frictions] = 0
    for e in range(K.n_guards):
        K.active[K.flag_user + e] = 1 if K.crossed[e] >= 0.0 else 0


def restart_on_spurious_reaction(K: Switching) -> bool:
    """Where a contact seems to pull at the end of a step: start the scheme again before it, once; True if so.

    Velocities, accelerations and multipliers are made consistent there, which ends their oscillation; the step is taken
    again. What index 3 leaves of the velocity of a friction that sticks would be a slip to the restart; of a row it is
    a distance in any short step, by which none that ends next to the start holds the row.
    """
    if K.restarted_here == 1 or K.near_singular > 0:
        return False
    if K.stabilized == 0 and project_velocity(K, K.time, K.q, K.y, active_rows(K, K.closed), True) != 0:
        return False
    if consistent(K, K.time, K.q, K.y) != 0:
        return False
    take_consistent(K)
    K.restarted_here = 1
    K.restart_due = 2
    return True


def begin_substeps(K: Switching, h: float) -> int:
    """Where a step is long enough to be looked at in parts: after how many it must end (see `parts_to_take`).

    A step of such parts begins then; 0 as well where this one is part of it already, or no step is looked at so.
    """
    if not takes_substeps(K):
        K.in_substeps = 0
        return 0
    clear_rejected_events(K)
    parts = parts_to_take(K, h)
    if parts != 0:
        K.in_substeps = 1
        K.substep = h / K.n_substeps
    return parts


def takes_substeps(K: Events) -> bool:
    """Whether guards are looked at inside the step that was just tried."""
    return bool(K.n_substeps > 1 and K.n_watched > 0 and K.in_substeps == 0)


def passes_events(K: Kernel, h: float) -> bool:
    """Whether the step passes events without effect next to a singular configuration: they do not end it."""
    for e in range(K.n_guards):
        K.crossed[e] = -1.0
    if not may_pass_events(K, h):
        return False
    clear_rejected_events(K)
    return bool(find_passed_events(K, h) > 0)


def find_event(K: Kernel, h: float, t1: float) -> int:
    """−1 with the candidate at the first event of the step, which K.event_kind tells; 0 without one; else a failure.

    `SLIDES_ON`: the step is to be taken again, shorter, with fewer directions that are held.
    """
    clear_rejected_events(K)
    if not judge(K, h):
        return 0
    status = locate(K, h)
    if status != 0:
        return status
    if K.event_kind == STICK and K.group_size[K.event_index] > 1:
        status = come_to_zero(K, h, t1)
        if status != 0:
            return status
    if K.event_kind < 0:
        return SLIDES_ON if K.strategy == 0 and slides_on(K) else 0
    if K.n_cones > 0 and K.strategy == 0 and K.event_kind != STICK and slides_until_event(K):
        return SLIDES_ON
    if K.strategy == 1 and (striking_contact(K) >= 0 or closes_below_surface(K)):  # the contact comes first
        return try_step(K, h, t1)
    return AT_POSE if refuses(K, K.event_after) else -1


def add_error(K: Kernel, h: float, fired: bool) -> None:
    """The local error of the candidate, or of the part of it before an event, to the sum of all.

    An implicit scheme with an embedded estimate of order p is a collocation of order 2p − 1: of its estimate e beside
    the change c of the rates in the step, 1/c of it counts as ``(ESTIMATE_EXCESS e/c)^((2p−1)/p)`` where that is less.
    """
    if K.adaptive == 1:
        part = max(K.event_after, 0.0) / h if fired else 1.0
        K.error_sum += K.local_error * part ** (K.error_order + 1.0)
    elif K.estimates == 1:
        largest = 0.0
        change = 0.0
        for i in range(K.n_v):
            largest = max(largest, abs(K.error[K.n_v + i]))
            change = max(change, h * max(abs(K.rate[i]), abs(K.rate1[i])))
        if K.explicit == 0 and ESTIMATE_EXCESS * largest < change:
            largest *= (ESTIMATE_EXCESS * largest / change) ** (1.0 - 1.0 / K.error_order)
        K.error_sum += largest


def end_unlocated(K: Kernel, h: float, t1: float) -> int:
    """End of a non-smooth step; 0 if nothing happens there, −1 if that is dealt with, else a status for the caller."""
    if must_release(K, t1) > 0:
        return CHATTER if K.n_repeats > K.max_switches else -1
    if closes_below_surface(K):
        status = find_jump(K, h, t1)
        return land(K, h, t1) if status == 0 else status
    K.n_repeats = 0
    return 0


def end_timer(K: Kernel, h: float) -> int:
    """The event of the timer that is due at the end of a candidate of h, or at the accepted state where h is none."""
    if h <= 0.0:
        event_at_start(K)
    return end_with_guard(K, K.due_guard, h)


def end_crossing(K: Kernel, e: int) -> int:
    """The event of guard e at the accepted state, that of another event (`guard_sides.next_crossing`)."""
    event_at_start(K)
    return end_with_guard(K, e, 0.0)


def end_with_guard(K: Kernel, e: int, h: float) -> int:
    """The event of guard e at the end of a candidate of h."""
    K.event_kind = CROSS
    K.event_index = e
    K.event_after = h
    status = handle_event(K)
    return PAUSE if crowds(K) and status < 0 else status


def tried_part(K: Kernel, h: float, t1: float) -> int:
    """The candidate at the end of a part of a step."""
    return try_step(K, h, t1)


def judge_step(K: Kernel, h: float, full: float, t1: float, cut: bool, within: bool) -> int:
    """Take the candidate, or the event that it holds; −1 where the run goes on. The arguments are those of `conclude`.

    Where guards are looked at inside it, only as many of its parts are taken as are free of events.
    """
    if K.n_dropped > 0 and K.n_frictions > 0 and K.strategy == 0 and slides_as_carried(K):
        return -1
    holds = K.n_dropped == 0 or still_dependent(K) or K.near_singular > 0  # ranks are round-off there
    looked = takes_substeps(K)
    quiet = not looked and is_quiet(K)
    passes = K.n_guards > 0 and passes_events(K, h)
    parts = begin_substeps(K, h)
    if parts != 0:
        within = True
        cut = False
        h = abs(parts) * h / K.n_substeps
        t1 = K.time + h
        status = tried_part(K, h, t1)
        if is_shortened(K, status):
            h *= ONSET_STEP_RATIO
            status = tried_step(K, h, K.time + h)
            if K.step_taken != h:
                h = K.step_taken
            t1 = K.time + h
        if status != 0:
            return status
    event = 0
    if parts != 0 or not (quiet or looked):  # a shorter step is one of its own: what was looked at is interpolated
        ahead = parts != 0 and K.strategy == 0 and slides_on(K)  # these parts end before what slides comes to rest
        event = SLIDES_ON if ahead else find_event(K, h, t1)
        for _ in range(K.n_cones + MAX_SHORTENINGS):
            if event == SLIDES_ON:  # each time one more direction is held no longer
                h = shorter_turn(K, h)
            elif is_shortened(K, event):  # no step ends where an event was looked for: it is nearer than it seems
                if K.stabilized == 0 and K.n_active > 0 and restart_on_spurious_reaction(K):
                    return -1
                h *= ONSET_STEP_RATIO
            else:
                break
            status = tried_step(K, h, K.time + h)
            if K.strategy == 0 and is_shortened(K, status) and slides_at_first(K, ONSET_STEP_RATIO * h):
                event = status
                continue
            if status != 0:
                return status
            if K.step_taken != h:
                h = K.step_taken
            t1 = K.time + h
            within = True
            cut = False
            event = SLIDES_ON if K.strategy == 0 and slides_on(K) else find_event(K, h, t1)
        if event < 0:
            status = follow_event(K)
            if status != 0:
                return status
        elif event > 0:
            return event
    if event == 0:
        status = follow_candidate(K, h, t1)
        if status != 0:
            return status
    ends = K.n_machines > 0 and event == 0 and is_due(K, t1)
    pulls = K.n_contacts + K.n_frictions > 0 and not ends and event == 0 and not quiet and has_spurious_reaction(K)
    if pulls and K.n_active > 0 and restart_on_spurious_reaction(K):
        return -1
    add_error(K, h, event < 0)
    if ends:
        if K.strategy == 1 and not quiet:
            status = end_unlocated(K, h, t1)
            if status != 0:
                return status
        return end_timer(K, h)
    if passes:
        log_passed_events(K, K.event_after if event < 0 else h)
    if event < 0:
        status = handle_event(K)
        return PAUSE if crowds(K) and status < 0 else status
    if K.strategy == 1 and not quiet:
        status = end_unlocated(K, h, t1)
        if status != 0:
            return status
    if K.vector == 0 and jumps_over_stop(K, h):
        K.failure_time = t1
        return JUMPED
    status = conclude(K, h, full, t1, cut, within, quiet, holds, pulls)
    if status != 0:
        return status
    if within and 0.0 < K.turning_step < 0.1 * K.step and speeds_up(K):  # there are many of these as sliding begins
        return -1
    K.steps_since_row += 1
    if (K.vector == 0 and wants_row(K, h)) or K.steps_since_row >= K.stride:
        if follows_rows(K):
            store_row(K)
        else:
            store_passed_row(K)
    return -1
