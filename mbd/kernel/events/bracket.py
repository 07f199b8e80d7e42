"""The root of one guard that fired between two distances from the accepted state."""

from mbd.equal import HALF_PRECISION_RTOL
from mbd.kernel.codes import CLOSE, CROSS, CROSS_BACK, EPS, OPEN_FORCE, OPEN_GAP, OPEN_PULL, PRESS, SLIP, STICK, WATCH
from mbd.kernel.contact.cones import along
from mbd.kernel.events.guards import GAP_RTOL, gap_scale, gap_tolerance, guard_value, pull_round_off
from mbd.kernel.events.hermite import first_guess
from mbd.kernel.events.refine import enough, refine
from mbd.kernel.records import ContactForces, Guards, Kernel, Sizes
from mbd.kernel.stepping.accept_restart import event_at_start, event_candidate, put_on_rows
from mbd.kernel.stepping.restart import largest_force
from mbd.kernel.stepping.scales import FORCE_ULPS

MAX_HALVINGS = 12
"""How often a step is halved to see a friction slide, or a contact part, that has just begun to [-]."""


def bracket(K: Kernel, kind: int, index: int, low: float, high: float) -> int:
    """Root of the fired guard between two distances from the accepted state; K.event_after its distance."""
    K.n_locations += 1
    K.looks_ahead = 0
    # the far end, with velocities on the rows: has the guard fired at all?
    put_on_rows(K, K.time + high)
    f_high = guard_value(K, kind, index, K.time + high)
    if f_high >= 0.0:
        if kind == OPEN_PULL or kind == STICK or kind == SLIP or kind == CROSS or kind == CROSS_BACK:
            reject_event(K, kind, index)
        K.event_after = high
        return 0
    d_high = guard_rate(K, kind, index)
    if kind == SLIP or kind == OPEN_PULL:
        note_ahead(K, high)
    # the near end, further on where the guard begins at the root of its last event
    status = candidate_at(K, low)
    if status != 0:
        return status
    f_low = guard_value(K, kind, index, K.time + low)
    if begins_at_root(K, kind, index, f_low, f_high):
        low = find_way(K, kind, index, high, root_tolerance(K, kind, index, f_low, f_high))
        if low < 0.0:
            return int(-low)
        if low == 0.0 and kind == CLOSE and abs(K.guards0[index]) <= GAP_RTOL * gap_scale(K, index):
            status = parts_slowly(K, index, high)
            if status == 0:
                reject_event(K, kind, index)
                K.event_after = high
            if status <= 0:
                return -status
        if low == 0.0:
            K.looks_ahead = 1 if kind == SLIP or kind == OPEN_PULL else 0
            event_at_start(K)
        f_low = guard_value(K, kind, index, K.time + low)
    if f_low <= 0.0:
        return take_end(K, kind, index, low, high)
    # the root between them
    width = high - low
    guess = first_guess(f_low, f_high, guard_rate(K, kind, index) * width, d_high * width)
    if K.linear == 1 and kind != WATCH and kind != OPEN_PULL:  # no contact is stored that pulls
        place = low + width * f_low / (f_low - f_high)
        K.event_after = place
        return event_candidate(K, place, K.time + place)
    return refine(K, kind, index, low, f_low, high, f_high, low + width * guess)


def flag_of(K: Sizes, kind: int, index: int) -> int:
    """Where K.active tells whether the guard of an event is quiet."""
    if kind == CROSS or kind == CROSS_BACK:
        return K.flag_user + index
    if kind == STICK or kind == SLIP:
        return K.flag_friction + index
    return index


def reject_event(K: Guards, kind: int, index: int) -> None:
    """The guard has not fired after all: it keeps quiet until the step ends.

    Only the multiplier of the step was negative, not that of the motion; or with velocities on the rows nothing has
    crossed yet.
    """
    K.active[flag_of(K, kind, index)] = 1
    K.event_kind = -1


def candidate_at(K: Kernel, place: float) -> int:
    """The candidate at a distance from the accepted state, which may be 0; 0, or a status."""
    if place > 0.0:
        return int(event_candidate(K, place, K.time + place))
    event_at_start(K)
    return 0


def root_tolerance(K: ContactForces, kind: int, index: int, f_low: float, f_high: float) -> float:
    """Value up to which a guard at the near end is the root of its last event, left at round-off.

    Forces begin there after their event; a friction that has just come to rest may be at its limit, as behind a stop
    that opens.
    """
    if kind == CLOSE:
        return float(gap_tolerance(K, index))
    if kind == OPEN_PULL:
        return FORCE_ULPS * EPS * largest_force(K, K.normal[index])
    if kind == PRESS or kind == OPEN_FORCE:
        return float(enough(K, kind, index, f_low, f_high))
    if kind == SLIP:
        return float(pull_round_off(K, index, K.impulse))
    return 0.0


def begins_at_root(K: ContactForces, kind: int, index: int, f_low: float, f_high: float) -> bool:
    """Whether what the guard watches began at the near end, just now: its root there is no event."""
    near = root_tolerance(K, kind, index, f_low, f_high)
    if f_low > 0.0:
        return f_low <= near and kind != CLOSE
    if kind == SLIP or kind == OPEN_PULL:
        return f_low >= -near
    return kind == STICK or kind == CLOSE or kind == PRESS


def take_end(K: Kernel, kind: int, index: int, low: float, high: float) -> int:
    """The event at an end of the bracket, where the guard is not above zero at the near one; 0, or a status.

    A touch too short to be seen within the step is over at the far end. Others are events of the near end.
    """
    if (kind == OPEN_GAP or kind == OPEN_FORCE) and K.guards0[K.at_gap_rate + index] < 0.0:
        K.event_after = high
        return int(event_candidate(K, high, K.time + high))
    K.event_after = low
    if low > 0.0 and kind != CROSS and kind != CROSS_BACK:
        K.event_after = 0.0
        event_at_start(K)
    return 0


def guard_rate(K: Guards, kind: int, index: int) -> float:
    """Rate of `guard_value` at the candidate; 0 where it is not known."""
    if kind == CLOSE:
        return float(K.guards1[K.at_gap_rate + index])
    if kind == OPEN_GAP:
        return float(-K.guards1[K.at_gap_rate + index])
    if kind == CROSS:
        return float(K.side[index] * K.guards1[K.at_user_rate + index])
    if kind == CROSS_BACK:
        return float(-K.side[index] * K.guards1[K.at_user_rate + index])
    if kind == STICK:
        return along(K, index, K.guards1, K.at_slip_rate)
    return 0.0


def find_way(K: Kernel, kind: int, index: int, high: float, tiny: float) -> float:
    """Distance at which what began just now (sliding, parting, a pull) is seen by steps shorter than one that does not.

    It is seen where the guard is above `tiny`. 0 if none sees it; − status if a step fails.
    """
    low = high
    for _ in range(MAX_HALVINGS):
        low *= 0.5
        status = event_candidate(K, low, K.time + low)
        if status != 0:
            return -float(status)
        value = guard_value(K, kind, index, K.time + low)
        if value > tiny:
            return low
        if kind == SLIP or kind == OPEN_PULL:
            row = K.friction_row[index] if kind == SLIP else K.normal[index]
            if value < -HALF_PRECISION_RTOL * largest_force(K, row):
                note_ahead(K, low)
    return 0.0


def note_ahead(K: Guards, place: float) -> None:
    """Keep the candidate at a distance from the accepted state, where forces tell apart what they do not there."""
    K.time_ahead = K.time + place
    K.q_ahead[: K.n_q] = K.q1[: K.n_q]
    K.y_ahead[: K.n] = K.y1[: K.n]


def parts_slowly(K: Kernel, c: int, high: float) -> int:
    """0 where a gap at rest on its surface rises, though a step ends below; 1 where it falls; − status if a step fails.

    As the force of a contact passes zero, the gap rises with the cube of time, which is what a scheme of order 2 errs
    by in a step of any size. Its rate, which grows with the square, tells: no shorter step may end with one that falls.
    """
    place = high
    rising = 0
    for _ in range(MAX_HALVINGS):
        place *= 0.5
        status = event_candidate(K, place, K.time + place)
        if status != 0:
            return -status
        way = place * K.guards1[K.at_gap_rate + c]
        if way < -gap_tolerance(K, c):
            return 1
        if way > gap_tolerance(K, c):
            rising += 1
    return 0 if rising > 0 else 1
