"""On which side of zero a user's guard is after an event, and which guards reach zero together with a contact.

An impact, or a friction that comes to rest, may keep a guard from crossing the zero that it has just reached, such as
the height of the foot that strikes. Such a guard has its event at the same instant, after the contact's own.

After the impact and after the reset the rate ġ₁ of the guard, by consistent accelerations, is compared with that
before, ġ₀:

    ġ₁ ġ₀ < 0   its motion has turned around: it is on the side from which it came, and will cross from there again;
                so is one that repeated resets of this instant have brought to rest, which ends the run (`CHATTER`)
    ġ₁ ≈ 0      it rests at zero: it is on the side to which it moves next
    otherwise   it has passed
"""

from mbd.equal import INSTANT_RTOL, MIN_DIVISOR
from mbd.kernel.codes import CLOSE, CROSS, CROSS_BACK, EPS, LOG_EVENT, STICK
from mbd.kernel.contact.contact_log import NO_IMPULSE, log_event
from mbd.kernel.events.guard_round_off import guard_round_off
from mbd.kernel.events.guards import gap_tolerance, is_waiting, is_watched
from mbd.kernel.records import Events, Guards, Switching

AWAITS_EVENT = 2
"""Of K.passing: the guard is at zero at the event of another one, and has its own next."""
REACH_SHARE = 1e-3
"""Part of a step within which a guard must reach zero at its rate, for its round-off to be looked at [-]."""
REST_RATE_RTOL = 1e-10
"""Rate after an event over that before, or speed across a direction over that along it, which is none [-]."""
RESET_ROUND_OFFS = 2.0**20
"""Round-offs of a guard beyond which a reset has moved it away from zero [-]."""


def find_crossings(K: Switching) -> None:
    """Mark the guards that cross zero at the event just found, with their values and rates, before it does anything.

    Those that a guard's event finds at zero have events of their own, one after the other (`next_crossing`).
    """
    kind = K.event_kind
    if kind == CROSS and K.passing[K.event_index] == AWAITS_EVENT:
        K.passing[K.event_index] = 1
        return
    for e in range(K.n_guards):
        K.passing[e] = 0
    if kind == CROSS or kind == CROSS_BACK:
        mark(K, K.event_index)
        for e in range(K.n_guards if is_observed(K, K.event_index) else 0):
            if e != K.event_index and is_observed(K, e) and reaches_zero(K, e):
                mark(K, e)
                K.passing[e] = AWAITS_EVENT
    elif kind == STICK or (kind == CLOSE and K.kind[K.event_index] == 0):
        for e in range(K.n_guards):
            if reaches_zero(K, e):
                mark(K, e)


def is_observed(K: Events, e: int) -> bool:
    """Whether guard e is that of an event of its own: of no transition, and of no force that bends there."""
    return bool(K.guard_kink[e] == 0 and (K.n_machines == 0 or K.guard_machine[e] < 0))


def next_crossing(K: Events) -> int:
    """A guard that was at zero at the event of another one, and has not had its own yet; −1: none."""
    for e in range(K.n_guards):
        if K.passing[e] == AWAITS_EVENT:
            return e
    return -1


def mark(K: Events, e: int) -> None:
    """Guard e crosses now; its value and rate are kept for `settle_sides`."""
    K.passing[e] = 1
    K.met[e] = K.guards0[K.at_user + e]
    K.met[K.n_guards + e] = K.guards0[K.at_user_rate + e]


def is_at_event(K: Guards, e: int) -> bool:
    """Whether guard e is zero at the event, as far as its instant is known; the state is there."""
    known = max(INSTANT_RTOL * K.event_after, 8.0 * EPS * abs(K.time))
    if K.event_kind == CLOSE:
        known += gap_tolerance(K, K.event_index) / (abs(K.guards0[K.at_gap_rate + K.event_index]) + MIN_DIVISOR)
    return bool(abs(K.guards0[K.at_user + e]) <= known * abs(K.guards0[K.at_user_rate + e]))


def reaches_zero(K: Switching, e: int) -> bool:
    """Whether a guard that approaches zero in its direction is there at the accepted state, the instant of an event."""
    if K.n_machines > 0 and not is_waiting(K, e):
        return False
    side = K.side[e]
    rate = -side * K.guards0[K.at_user_rate + e]
    left = side * K.guards0[K.at_user + e]
    if rate <= 0.0 or K.direction[e] * side > 0.0 or left > REACH_SHARE * K.step * rate:
        return False
    return is_at_event(K, e) or bool(left <= guard_round_off(K, e, K.time, K.q, K.y))


def striking_contact(K: Guards) -> int:
    """An open unilateral contact that reaches its surface at the candidate, where a guard has its event; −1: none."""
    for c in range(K.n_contacts):
        if K.kind[c] == 0 and K.closed[c] == 0 and K.armed[c] == 1 and is_watched(K, c, K.guards0):
            speed = -K.guards1[K.at_gap_rate + c]
            if speed > 0.0 and K.guards1[c] <= max(gap_tolerance(K, c), INSTANT_RTOL * K.event_after * speed):
                return c
    return -1


def find_passed(K: Guards) -> None:
    """Mark the guards that are beyond zero at the end of a non-smooth step whose end lies below a contact's surface."""
    for e in range(K.n_guards):
        K.passing[e] = 0
        if K.n_machines > 0 and not is_waiting(K, e):
            continue
        side = K.side[e]
        rate = K.guards1[K.at_user_rate + e]
        if K.direction[e] * side <= 0.0 and side * K.guards1[K.at_user + e] < 0.0 and side * rate < 0.0:
            K.passing[e] = 1
            K.met[K.n_guards + e] = rate


def keep_at_zero(K: Switching, h: float) -> None:
    """Of these, as the positions are lifted to the surface after a step of h, the guards that have been at zero."""
    for e in range(K.n_guards):
        if K.passing[e] == 1:
            K.met[e] = K.guards0[K.at_user + e]
            left = K.side[e] * K.met[e]
            near = INSTANT_RTOL * h * abs(K.met[K.n_guards + e])
            if left > near and left > guard_round_off(K, e, K.time, K.q, K.y):
                K.passing[e] = 0


def log_crossings(K: Switching) -> None:
    """The events of the guards that were marked, after that of the contact; the scheme starts after their resets."""
    for e in range(K.n_guards):
        if K.passing[e] == 1 and K.n_machines > 0 and not is_waiting(K, e):  # a transition that has come before it
            K.passing[e] = 0
        if K.passing[e] == 1 and K.guard_kink[e] == 1:
            K.passing[e] = 0
            K.side[e] = -K.side[e]
        if K.passing[e] == 1:
            log_event(K, LOG_EVENT, e, 0.0, NO_IMPULSE)
            K.side[e] = -K.side[e]
            K.restart_due = 1


def settle_sides(K: Switching) -> None:
    """The sides of the guards that have crossed at this instant, after all impacts, resets and restarts of it."""
    for e in range(K.n_guards if next_crossing(K) < 0 else 0):
        if K.passing[e] == 0:
            continue
        K.passing[e] = 0
        value = K.guards0[K.at_user + e]
        before = K.met[K.n_guards + e]
        after = K.guards0[K.at_user_rate + e]
        if value != K.met[e] and abs(value) > RESET_ROUND_OFFS * guard_round_off(K, e, K.time, K.q, K.y):
            K.side[e] = 1.0 if value > 0.0 else -1.0
        elif before != 0.0 and abs(after) <= REST_RATE_RTOL * abs(before):
            K.side[e] = 0.0
        elif before < 0.0 < after or after < 0.0 < before or (before == 0.0 and K.n_switches > 0):
            K.side[e] = -K.side[e]
