"""What a step ends with: an event that was located, or the impact of a non-smooth step."""

from mbd.kernel.codes import (
    CHATTER,
    CLOSE,
    CONFLICT,
    CROSS,
    CROSS_BACK,
    EVENT,
    LOG_EVENT,
    NO_IMPACT,
    OPEN_FORCE,
    OPEN_PULL,
    SLIP,
    WATCH,
)
from mbd.kernel.contact.contact_log import NO_IMPULSE, log_event
from mbd.kernel.contact.nonsmooth import keep, put_back, rebound, strike
from mbd.kernel.events.crowding import count_impact
from mbd.kernel.events.guard_sides import find_crossings, find_passed, is_at_event, keep_at_zero, log_crossings
from mbd.kernel.events.guards import update_side
from mbd.kernel.events.impulses import is_followed_by_impulse
from mbd.kernel.events.switching import switch
from mbd.kernel.events.transitions import has_happened, is_allowed, settle_fresh, take_transitions
from mbd.kernel.records import Guards, Kernel, Switching
from mbd.kernel.stepping.accept_restart import accept_for_restart
from mbd.kernel.stepping.candidate import carry
from mbd.kernel.stepping.observe import is_awaited, store_row
from mbd.kernel.stepping.starting import restart_after_event


def same_instant(K: Guards) -> bool:
    """Count switches without progress in time; true when there were too many, or when they repeat themselves."""
    now = K.time
    if now - K.last_switch <= 1e-10 * K.dt:
        K.n_switches += 1
    else:
        K.n_switches = 0
        K.seen_at = 0.0
    K.last_switch = now
    if repeats(K):
        if K.n_switches > K.max_switches // 2:
            return True
        K.n_switches = K.max_switches // 2  # from the next impact on they are plastic, all at once
        K.seen_at = 0.0
    return bool(K.n_switches > K.max_switches)


def repeats(K: Guards) -> bool:
    """Whether everything is as it was after an earlier switch of this instant, so that they go on without end.

    The state is compared with the one noted when there were half as many switches or fewer, so that a cycle of any
    length is found (Brent 1980, BIT 20:176).
    """
    same = K.seen_at > 0.0
    o = 1
    for c in range(K.n_contacts):
        same = same and K.seen[o + 2 * c] == K.closed[c] and K.seen[o + 2 * c + 1] == K.armed[c]
    o += 2 * K.n_contacts
    for f in range(K.n_frictions):
        same = same and K.seen[o + 2 * f] == K.sticks[f] and K.seen[o + 2 * f + 1] == K.slip[f]
    o += 2 * K.n_frictions
    for e in range(K.n_guards):
        same = same and K.seen[o + e] == K.side[e]
    o += K.n_guards
    for i in range(K.n_q):
        same = same and K.seen[o + i] == K.q[i]
    o += K.n_q
    for i in range(K.n):
        same = same and K.seen[o + i] == K.y[i]
    if same:
        return True
    number = int(K.n_switches)
    if number > 0 and number >= 2.0 * K.seen_at:
        note_state(K, number)
    return False


def note_state(K: Guards, number: int) -> None:
    """What `repeats` compares with, at this switch of the instant."""
    K.seen_at = float(number)
    o = 1
    for c in range(K.n_contacts):
        K.seen[o + 2 * c] = float(K.closed[c])
        K.seen[o + 2 * c + 1] = float(K.armed[c])
    o += 2 * K.n_contacts
    for f in range(K.n_frictions):
        K.seen[o + 2 * f] = float(K.sticks[f])
        K.seen[o + 2 * f + 1] = K.slip[f]
    o = carry(K.side, K.seen, o + 2 * K.n_frictions, K.n_guards, True)
    o = carry(K.q, K.seen, o, K.n_q, True)
    carry(K.y, K.seen, o, K.n, True)


def update_other_sides(K: Switching) -> None:
    """Users' guards that have gone back before this event may fire again; those that are zero at it stay as is."""
    fired = K.event_index if K.event_kind == CROSS or K.event_kind == CROSS_BACK else -1
    for e in range(K.n_guards):
        if e != fired and K.passing[e] == 0 and not is_at_event(K, e):
            update_side(K, e)


def handle_event(K: Kernel) -> int:
    """Take the located event: rows before and after, impact, restart. Negative: nothing for the caller to do."""
    kind = K.event_kind
    index = K.event_index
    first = K.n_logged
    if (kind != SLIP and kind != OPEN_PULL) or K.event_after > 0.0:
        K.looks_ahead = 0
    at_start = K.event_after <= 0.0 and K.stabilized == 0 and (kind == OPEN_FORCE or kind == OPEN_PULL)
    if at_start:  # the accepted row, which does not pull, is the one before
        store_row(K)
    timed = K.n_machines > 0 and kind == CROSS and K.guard_timed[index] >= 4
    accept_for_restart(K, K.due_time if timed else K.time + K.event_after)
    if same_instant(K):
        return CHATTER
    if K.n_guards > 0:
        update_other_sides(K)
        find_crossings(K)
    if kind == WATCH:
        K.restart_due = 2
        return switch(K) - 1
    if not at_start:
        store_row(K)
    if kind == CROSS or kind == CROSS_BACK:
        unheeded = K.n_machines > 0 and K.guard_machine[index] >= 0 and not is_allowed(K, index)
        if unheeded or K.guard_kink[index] == 1:
            K.passing[: K.n_guards] = 0
            K.restart_due = 2
            if kind == CROSS:
                K.side[index] = -K.side[index]
            return -1
        log_event(K, LOG_EVENT, index, 0.0, NO_IMPULSE)
        if kind == CROSS:
            K.side[index] = -K.side[index]
        K.restart_due = 1
        return EVENT if is_awaited(K, first) else -1
    if kind == CLOSE and K.n_switches > K.max_switches // 2:  # impacts by turns: their limit is plastic, all at once
        if is_followed_by_impulse(K, index):
            return CHATTER
        K.plastic_impact = 1
        K.n_endless += 1
    carry(K.closed, K.kept_flags, 0, K.n_contacts, True)
    status = switch(K)
    K.plastic_impact = 0
    if status == 0 and K.n_machines > 0:
        status = take_transitions(K)
    if status != 0:
        return status
    if K.auto == 1 and kind == CLOSE:
        count_impact(K)
    status = restart_after_event(K)
    store_row(K)  # also where no accelerations are consistent: the velocities after the event are known
    if status != 0:
        return status
    if K.n_guards > 0:
        log_crossings(K)
    if K.n_machines > 0:
        settle_fresh(K)
        if has_happened(K):
            K.restart_due = 1
    for c in range(K.n_contacts if K.restart_due == 0 else 0):
        if K.kept_flags[c] == 1 and K.closed[c] == 0 and K.armed[c] != 1 and K.guards0[K.at_gap_rate + c] < -1e-6:
            K.sinking[c] = min(K.sinking[c], K.time)
    return EVENT if is_awaited(K, first) else -1


def land(K: Kernel, h: float, t1: float) -> int:
    """End a non-smooth step: rows before and after, impact, restart. Negative: nothing for the caller to do.

    Where no impulses obey all laws, the step is tried again with half its size, down to an eighth.
    """
    first = K.n_logged
    stored = K.n_stored
    t = K.time
    events = K.n_events
    keep(K)
    find_passed(K)
    status = strike(K, h, t1)
    if status == 0:
        keep_at_zero(K, h)
        store_row(K)
        status = rebound(K)
    if status == 0 and K.n_machines > 0:
        status = take_transitions(K)
    if status == 0:
        status = restart_after_event(K)
    if (status == NO_IMPACT or status == CONFLICT) and K.halvings < 3:
        K.halvings += 1
        K.halves_left = 2 ** (K.halvings + 1)
        K.n_shortened += 1
        K.n_halved += 1
        K.n_logged = first
        K.n_stored = stored
        K.n_events = events
        K.passing[: K.n_guards] = 0
        put_back(K, t)
        K.restart_due = 2
        return -1
    if status != 0:
        return status
    store_row(K)
    log_crossings(K)
    if K.n_machines > 0:
        settle_fresh(K)
        if has_happened(K):
            K.restart_due = 1
    K.n_repeats = 0
    K.halvings = 0
    return EVENT if is_awaited(K, first) else -1
