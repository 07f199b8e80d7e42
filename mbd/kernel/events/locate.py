"""The instant at which a guard fired, exactly: steps of varying size from the same accepted state."""

from mbd.equal import INSTANT_RTOL, NOMINAL_RTOL
from mbd.kernel.codes import (
    BY_MEASURE,
    CLOSE,
    CROSS,
    CROSS_BACK,
    CROSS_BRIEF,
    GRAZE,
    JUMPED,
    NO_LOCATION,
    STICK,
    STICK_BRIEF,
)
from mbd.kernel.events.bracket import bracket, flag_of
from mbd.kernel.events.guard_round_off import guard_round_off
from mbd.kernel.events.guard_sides import striking_contact
from mbd.kernel.events.guards import (
    gap_scale,
    gap_tolerance,
    guard_value,
    is_watched,
    judge,
)
from mbd.kernel.records import Events, Guards, Kernel, Switching
from mbd.kernel.stepping.trial_step import try_step

MAX_UNEXPLAINED_TURN = 0.5
"""What rates at both ends of a step miss of the change of an angle, where it may have jumped between them [rad]."""
EARLIER, LATER = -2, -1
"""Where `fall_back` has seen another guard fire: before the place looked at, or in the full step."""


def dip(K: Kernel, h: float) -> int:
    """Step to the lowest point of a grazing gap or of a user's guard; a real dip is an event, else it keeps quiet.

    It becomes a closing, or the first of two crossings; the second where the guard fires in its direction alone.
    """
    t = K.time
    c = K.event_index
    users = K.event_kind == CROSS_BRIEF
    side = K.side[c] if users else 1.0
    at = (K.at_user if users else 0) + c
    at_rate = (K.at_user_rate if users else K.at_gap_rate) + c
    low = 0.0
    high = h
    rate_low = side * K.guards0[at_rate]
    rate_high = side * K.guards1[at_rate]
    place = K.event_place * h
    for _ in range(30):
        status = try_step(K, place, t + place)
        if status != 0:
            return status
        depth = -side * K.guards1[at] - (0.0 if users else max(-K.guards0[at], 0.0))  # below where it was
        if depth > 0.0 and depth > (guard_round_off(K, c, t + place, K.q1, K.y1) if users else gap_tolerance(K, c)):
            K.event_kind = CLOSE
            if users:
                K.event_kind = CROSS_BACK if K.direction[c] * side > 0.0 else CROSS
            K.event_place = place
            K.event_low = 0.0
            return 0
        rate = side * K.guards1[at_rate]
        if rate == 0.0 or high - low < 1e-7 * h:
            break
        if rate < 0.0:
            low = place
            rate_low = rate
        else:
            high = place
            rate_high = rate
        place = low + (high - low) * min(max(rate_low / (rate_low - rate_high), 0.02), 0.98)
    K.active[(K.flag_user if users else 0) + c] = 1
    K.event_kind = -1
    return try_step(K, h, t + h)


def locate(K: Kernel, h: float) -> int:
    """Move the candidate to the instant of the first event of the step; K.event_after its distance from the start.

    A bracketing root finder on steps of varying size from the same accepted state, until the guard is at round-off.
    K.event_kind < 0 afterwards: there was no event, the candidate is the full step.
    """
    end = h
    found_kind = -1  # the event at `end`, before which others are looked for
    found_index = 0
    for _ in range(4 * (K.n_contacts + K.n_guards + K.n_frictions) + 4):
        kind = K.event_kind
        index = K.event_index
        low = K.event_low * end
        status = 0
        if kind == GRAZE or kind == STICK_BRIEF or kind == CROSS_BRIEF:
            low = 0.0
            status = come_to_rest(K, index, end) if kind == STICK_BRIEF else dip(K, end)
            kind = K.event_kind
            if status == 0 and kind == CROSS_BACK:
                low = K.event_place
                status = try_step(K, end, K.time + end)
            elif kind == CLOSE or kind == CROSS or (kind == STICK and K.event_place < end):
                end = K.event_place
                found_kind = -1
        if status == 0 and kind >= 0:
            status = root_before(K, kind, index, low, end)
        if status != 0:
            return status
        if K.event_kind < 0:
            status = fall_back(K, h, end, found_kind, found_index)
            if status >= 0:
                return status
            if status == LATER:
                end = h
            continue
        found = K.event_after
        if found <= 0.0:
            return 0
        together = found_kind >= 0 and found > (1.0 - INSTANT_RTOL) * end  # as the one it was looked for before
        if together or not another_before(K, kind, index, found):
            take_event(K, kind, index, found)
            if (kind == CROSS or kind == CROSS_BACK) and K.strategy == 0:  # of one instant, the contact comes first
                c = striking_contact(K)
                if c >= 0 and K.active[c] == 0:
                    take_event(K, CLOSE, c, found)
            return 0
        end = found
        found_kind = kind
        found_index = index
    return NO_LOCATION


def come_to_rest(K: Kernel, index: int, end: float) -> int:
    """A step to where a friction comes nearest to rest within `end`: at rest on the way, or not at all.

    K.event_place is the distance of that place, or `end` where it slides on.
    """
    place = K.event_place * end
    status = try_step(K, place, K.time + place)
    if status == 0:
        K.event_kind = STICK
        K.event_place = place if guard_value(K, STICK, index, K.time + place) < 0.0 else end
    return status


def root_before(K: Kernel, kind: int, index: int, low: float, end: float) -> int:
    """`bracket`, and the candidate at `end` again where there was no event after all."""
    status = bracket(K, kind, index, low, end)
    if status != 0:
        return status
    if K.event_kind == CLOSE and K.event_after > 0.0 and K.kind[index] == 0 and K.linear == 0 and jumps(K, index):
        return JUMPED
    if (
        K.event_kind >= 0 and K.event_after > 0.0 and kind == CLOSE and left_alone(K, index)
    ):  # not watched any more there
        K.active[index] = 1
        K.event_kind = -1
    return 0 if K.event_kind >= 0 else try_step(K, end, K.time + end)


def jumps(K: Switching, c: int) -> bool:
    """Whether the angle of contact c is nowhere zero as it closes, as a twist at half a turn: K.failure_index."""
    if K.row_unit[K.normal[c]] != 1 or abs(K.guards1[c]) <= NOMINAL_RTOL * gap_scale(K, c):
        return False
    K.failure_index = c
    return True


def find_jump(K: Kernel, h: float, t1: float) -> int:
    """JUMPED where an angle whose contact closes in a step that is not located (K.closing) jumps past zero within it.

    It is looked for where the rates at both ends of the step do not explain how far the angle went.
    """
    for c in range(K.n_contacts):
        if K.closing[c] == 1 and K.row_unit[K.normal[c]] == 1 and K.guards0[c] > 0.0:
            mean = 0.5 * (K.guards0[K.at_gap_rate + c] + K.guards1[K.at_gap_rate + c])
            if abs(K.guards1[c] - K.guards0[c] - h * mean) > MAX_UNEXPLAINED_TURN:
                status = bracket(K, CLOSE, c, 0.0, h)
                if status == 0 and K.event_after > 0.0 and jumps(K, c):
                    return JUMPED
                status = try_step(K, h, t1)
                if status != 0:
                    return status
    return 0


def jumps_over_stop(K: Switching, h: float) -> bool:
    """Whether an angle leads past its stop in a step and jumps back to the open side, as a twist does at half a turn.

    The contact is open at both ends of the step; the rates there lead to its other side: K.failure_index.
    """
    found = False
    for c in range(K.n_contacts):
        if K.row_unit[K.normal[c]] == 1 and K.kind[c] == 0 and K.closed[c] == 0 and K.armed[c] == 1:
            there = K.guards0[c] + 0.5 * h * (K.guards0[K.at_gap_rate + c] + K.guards1[K.at_gap_rate + c])
            if (
                there < 0.0 < K.guards1[c]
                and K.guards1[c] - there > MAX_UNEXPLAINED_TURN
                and is_watched(K, c, K.guards0)
            ):
                K.failure_index = c
                found = True
    return found


def another_before(K: Switching, kind: int, index: int, found: float) -> bool:
    """Whether another guard fired before this one, which is at round-off and may look fired itself."""
    place = flag_of(K, kind, index)
    quiet = K.active[place]
    K.active[place] = 1
    other = judge(K, found) and K.event_place < 1.0 - INSTANT_RTOL
    K.active[place] = quiet
    return other


def take_event(K: Events, kind: int, index: int, place: float) -> None:
    """The event that the step ends with."""
    K.event_kind = kind
    K.event_index = index
    K.event_after = place


def fall_back(K: Kernel, h: float, end: float, kind: int, index: int) -> int:
    """Where no guard has fired before `end` after all: the event found there stands (kind ≥ 0), else the full step h.

    The candidate is at `end`. `EARLIER`: another guard has fired before that. `LATER`: one has fired in the full step,
    which is the candidate then.
    """
    if judge(K, end):
        return EARLIER
    if kind >= 0:
        take_event(K, kind, index, end)
        return 0
    if end < h:
        status = try_step(K, h, K.time + h)
        if status != 0:
            return status
        if judge(K, h):
            return LATER
    K.event_after = h
    return 0


def left_alone(K: Guards, c: int) -> bool:
    """Whether contact c is not watched at the candidate; a condition that ends at the same instant has ended."""
    if not is_watched(K, c, K.guards1):
        return True
    if K.watched_by[c] != BY_MEASURE:
        return False
    place = K.at_condition + c
    change = abs(K.guards0[place] - K.guards1[place])
    fall = abs(K.guards0[c] - K.guards1[c])
    apart = INSTANT_RTOL * K.step / K.event_after + gap_tolerance(K, c) / (fall + 1e-300)  # of the way here, at most
    return bool(K.guards1[place] <= apart * change)
