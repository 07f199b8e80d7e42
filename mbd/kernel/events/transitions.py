"""Changes of machines: which of them happen at an instant, what is stored with them, and their order.

What has happened at the instant (contacts that closed or opened, guards that crossed zero, transitions that were taken)
is marked in K.happened. One round looks at all transitions in their order: of each machine the first one is taken that
leaves its state of now, has a cause among the marks, and whose condition holds. The transitions of a round are the
marks of the next one, until a round takes none.
"""

from mbd.kernel.codes import ENDLESS_TRANSITIONS, EPS, LOG_EVENT, LOG_OPENED
from mbd.kernel.contact.contact_log import NO_IMPULSE, log_event
from mbd.kernel.events.guard_round_off import guard_round_off
from mbd.kernel.events.guards import watch
from mbd.kernel.records import Events, Guards, Switching
from mbd.kernel.stepping.restart import evaluate

NEXT_ROUND = 2
"""Mark of what transitions are looked for by in the round that follows."""

SAME_INSTANT = 1024.0 * EPS
"""Difference of instants, over the time, by which sums of many periods may part them [-]."""


def begins_now(K: Guards, e: int) -> bool:
    """Whether the state that timer e leaves begins at the accepted state."""
    return bool(K.anchors[K.machine_start[K.guard_machine[e]] + 1] == K.time)


def find_due(K: Guards) -> None:
    """The next instant of a timer, K.due_time and K.due_guard; of several the first in the order of transitions.

    Instants are sums, 17 periods of 0.05 s or 0.35 s + 0.15 s + 0.35 s: those that round-off parts are one.
    """
    K.due_guard = -1
    for e in range(K.n_guards):
        m = K.guard_machine[e]
        if m < 0 or K.guard_timed[e] == 0 or int(K.anchors[K.machine_start[m]]) != K.guard_source[e]:
            continue
        if K.side[e] > 0.0:  # it has passed while its condition did not hold
            continue
        due = K.time - min(K.guards0[K.at_user + e], 0.0)
        if K.guard_timed[e] < 4 and not (K.side[e] < 0.0 and K.guards0[K.at_user + e] > 0.0):
            if not begins_now(K, e) or due - K.time > 8.0 * EPS * max(abs(K.time), K.step):
                continue  # its instant moves, and is located as that of any guard
        if K.due_guard < 0 or due < K.due_time - SAME_INSTANT * abs(due):
            K.due_time = due
            K.due_guard = e


def is_due(K: Guards, t: float) -> bool:
    """Whether the next timer ends at t, which is no earlier, but for round-off."""
    return bool(K.due_guard >= 0 and K.due_time - t <= max(SAME_INSTANT * abs(t), 8.0 * EPS * K.step))


def is_allowed(K: Guards, e: int) -> bool:
    """Whether the condition of transition e holds at the accepted state, at which K.guards0 is."""
    c = K.guard_contact[e]
    if c >= 0 and K.closed[c] == 0:
        return False
    return bool(K.guards0[K.at_allowed + e] > 0.0)


def has_cause(K: Events, e: int) -> bool:
    """Whether something has happened that causes transition e."""
    found = False
    for place in range(K.causes[e], K.causes[e + 1]):
        found = found or K.happened[K.causes[place]] == 1
    return found


def has_happened(K: Events) -> bool:
    """Whether there are marks that no transition has been looked for by."""
    found = False
    for i in range(K.n_marks):
        found = found or K.happened[i] == 1
    return found


def take_transitions(K: Switching) -> int:
    """Take the transitions that follow from what has happened; 0, or `ENDLESS_TRANSITIONS`."""
    if not has_happened(K):
        return 0
    if K.time != K.chain_time:
        K.chain_time = K.time
        K.n_rounds = 0
    watch(K, K.time, K.q, K.y, K.rate, K.lam, K.guards0)
    # of a contact that closed and opened at this instant, what it is now came last
    for c in range(K.n_contacts):
        if K.happened[c] == 1 and K.happened[K.n_contacts + c] == 1:
            K.happened[c if K.closed[c] == 1 else K.n_contacts + c] = NEXT_ROUND
    while has_happened(K):
        K.n_rounds += 1
        taken = find_taken(K)
        for i in range(K.n_marks):
            K.happened[i] = 1 if K.happened[i] == NEXT_ROUND else 0
        if taken == 0:
            continue
        if K.n_rounds > 64:  # transitions that follow each other without end
            return ENDLESS_TRANSITIONS
        store_taken(K)
        open_released(K)
        watch(K, K.time, K.q, K.y, K.rate, K.lam, K.guards0)
    return 0


def find_taken(K: Guards) -> int:
    """The transition that each machine takes now, into K.taken; how many there are."""
    count = 0
    for m in range(K.n_machines):
        K.taken[m] = -1
    for e in range(K.n_guards):
        m = K.guard_machine[e]
        if m < 0 or K.taken[m] >= 0 or int(K.anchors[K.machine_start[m]]) != K.guard_source[e]:
            continue
        if has_cause(K, e) and is_allowed(K, e):
            K.taken[m] = e
            count += 1
    return count


def store_taken(K: Switching) -> None:
    """Change the machines by the transitions in K.taken; these are marked, and logged unless their guards were."""
    evaluate(K, K.time, K.q, K.y)
    for m in range(K.n_machines):
        e = K.taken[m]
        if e < 0:
            continue
        K.failure_index = e
        for place in range(K.stores[e], K.stores[e + 1]):
            K.anchors[K.stores[place]] = K.acc[K.acc_captured + K.stores[place]]
        K.anchors[K.machine_start[m]] = float(K.guard_target[e])
        if K.guard_fires[e] == 0:
            log_event(K, LOG_EVENT, e, 0.0, NO_IMPULSE)
        for i in range(K.n_guards):  # its guards are looked at from where they are now
            if K.guard_machine[i] == m:
                K.fresh[i] = 1
                K.passing[i] = 0
        K.happened[2 * K.n_contacts + K.n_guards + e] = 1
    for e in range(K.n_guards):
        K.happened[2 * K.n_contacts + e] = 0


def open_released(K: Switching) -> None:
    """Open the contacts whose rule names a state that is entered now."""
    for c in range(K.n_contacts):
        for place in range(K.releases[c], K.releases[c + 1]):
            if K.closed[c] == 1 and K.happened[K.releases[place]] == 1:
                K.closed[c] = 0
                K.armed[c] = 0
                log_event(K, LOG_OPENED, c, 0.0, NO_IMPULSE)


def settle_fresh(K: Switching) -> None:
    """The sides of the guards of machines that have changed, by their values after the restart: K.guards0.

    That of its rate where the value is round-off; where that leads nowhere in a step, the first steps that do. Timers
    are still to come: one whose time is not positive is due at once.
    """
    for e in range(K.n_guards):
        if K.fresh[e] == 0:
            continue
        K.fresh[e] = 0
        if K.guard_timed[e] > 0:
            K.side[e] = -1.0
            continue
        value = K.guards0[K.at_user + e]
        rate = K.guards0[K.at_user_rate + e]
        doubt = guard_round_off(K, e, K.time, K.q, K.y)
        if abs(value) <= doubt:
            value = rate if abs(rate) * K.step > doubt else 0.0
        K.side[e] = 0.0
        if value > 0.0:
            K.side[e] = 1.0
        elif value < 0.0:
            K.side[e] = -1.0
