"""The instant at which a guard fired, exactly: steps of varying size from the same accepted state."""

from __future__ import annotations

from typing import Any

from mbd.kernel.fields import (
    CLOSE,
    CROSS,
    EPS,
    GRAZE,
    LOCATIONS,
    NO_LOCATION,
    NOW,
    OPEN_FORCE,
    OPEN_GAP,
    OPEN_PULL,
    SLIP,
    STICK,
    STICK_BRIEF,
    WATCH,
)
from mbd.kernel.guards import frictions_at, gap_tolerance, guard_value, is_watched, judge, try_step
from mbd.kernel.hermite import first_guess

__all__ = ["locate"]

MOST_LOOKS = 12
"""How often a step is halved to see a friction slide, or a contact part, that has just begun to [-]."""
SAME = 1e-9
"""Events closer than this part of the way to the first are one event."""


def stay(K: Any) -> None:
    """The candidate becomes the accepted state itself: an event at the very start of the step."""
    for i in range(K.n_q):
        K.q1[i] = K.q[i]
    for i in range(K.n):
        K.y1[i] = K.y[i]
        K.rate1[i] = K.rate[i]
        K.aux1[i] = K.aux[i]
    for k in range(K.n_rows):
        K.lam1[k] = K.lam[k]
    for i in range(K.n_watched):
        K.guards1[i] = K.guards0[i]


def dip(K: Any, h: float) -> int:
    """Step to the lowest point of a grazing gap; a real dip becomes a closing, else the guard keeps quiet."""
    t = K.clock[NOW]
    c = K.fired[1]
    nC = K.n_contacts
    low = 0.0
    high = h
    rate_low = K.guards0[nC + c]
    rate_high = K.guards1[nC + c]
    place = K.pick[0] * h
    for _ in range(30):
        status = try_step(K, place, t + place)
        if status != 0:
            return status
        if K.guards1[c] < -gap_tolerance(K, c):
            K.fired[0] = CLOSE
            K.pick[0] = place
            K.pick[1] = 0.0
            return 0
        rate = K.guards1[nC + c]
        if rate == 0.0 or high - low < 1e-7 * h:
            break
        if rate < 0.0:
            low = place
            rate_low = rate
        else:
            high = place
            rate_high = rate
        place = low + (high - low) * min(max(rate_low / (rate_low - rate_high), 0.02), 0.98)
    K.active[c] = 1
    K.fired[0] = -1
    return try_step(K, h, t + h)


def locate(K: Any, h: float) -> int:
    """Move the candidate to the instant of the first event of the step; K.pick[2] its distance from the start.

    A bracketing root finder on steps of varying size from the same accepted state, until the guard is at round-off.
    K.fired[0] < 0 afterwards: there was no event, the candidate is the full step.
    """
    t = K.clock[NOW]
    end = h
    found_kind = -1  # the event at `end`, before which others are looked for
    found_index = 0
    for _ in range(4 * (K.n_contacts + K.n_guards + K.n_frictions) + 4):
        kind = K.fired[0]
        index = K.fired[1]
        if kind == GRAZE:
            status = dip(K, end)
            if status != 0:
                return status
            if K.fired[0] < 0:
                if not judge(K, end):
                    status = fall_back(K, h, end, found_kind, found_index)
                    if status >= 0:
                        return status
                    end = h
                continue
            kind = CLOSE
            end = K.pick[0]
            found_kind = -1
            low = 0.0
        elif kind == STICK_BRIEF:  # a step to the deepest place shows it at rest on the way, or not at all
            status = try_step(K, K.pick[0] * end, t + K.pick[0] * end)
            if status != 0:
                return status
            kind = STICK
            if guard_value(K, kind, index, t + K.pick[0] * end) < 0.0:
                end = K.pick[0] * end
                found_kind = -1
            low = 0.0
        else:
            low = K.pick[1] * end
        status = bracket(K, kind, index, low, end)
        if status != 0:
            return status
        found = K.pick[2]
        if K.fired[0] >= 0 and found > 0.0 and kind == CLOSE and left_alone(K, index):  # not watched any more there
            K.active[index] = 1
            K.fired[0] = -1
        if K.fired[0] < 0:
            status = try_step(K, end, t + end)
            if status != 0:
                return status
            if not judge(K, end):
                status = fall_back(K, h, end, found_kind, found_index)
                if status >= 0:
                    return status
                end = h
            continue
        if found <= 0.0:
            return 0
        # did another guard fire before this one? (this one is at round-off and may look fired itself)
        place = index
        if kind == CROSS:
            place += K.n_contacts
        elif kind == STICK or kind == SLIP:
            place += K.n_contacts + K.n_guards
        quiet = K.active[place]
        K.active[place] = 1
        other = judge(K, found) and K.pick[0] < 1.0 - SAME
        K.active[place] = quiet
        if not other:
            K.fired[0] = kind
            K.fired[1] = index
            K.pick[2] = found
            return 0
        end = found
        found_kind = kind
        found_index = index
    return NO_LOCATION


def fall_back(K: Any, h: float, end: float, kind: int, index: int) -> int:
    """Where no guard has fired before `end` after all: the event found there stands (kind ≥ 0), else the full step h.

    The candidate is at `end`. −1: a guard has fired in the full step, which is the candidate then.
    """
    if kind >= 0:
        K.fired[0] = kind
        K.fired[1] = index
        K.pick[2] = end
        return 0
    if end < h:
        status = try_step(K, h, K.clock[NOW] + h)
        if status != 0:
            return status
        if judge(K, h):
            return -1
    K.pick[2] = h
    return 0


def left_alone(K: Any, c: int) -> bool:
    """Whether contact c is not watched at the candidate; a condition that ends at the same instant has ended."""
    if not is_watched(K, c, K.guards1):
        return True
    place = 3 * K.n_contacts + c
    return bool(K.while_kind[c] == 2 and K.guards1[place] <= SAME * K.guards0[place])


def guard_rate(K: Any, kind: int, index: int) -> float:
    """Rate of `guard_value` at the candidate; 0 where it is not known."""
    if kind == CLOSE:
        return float(K.guards1[K.n_contacts + index])
    if kind == OPEN_GAP:
        return float(-K.guards1[K.n_contacts + index])
    if kind == CROSS:
        return float(K.side[index] * K.guards1[4 * K.n_contacts + K.n_guards + index])
    if kind == STICK:
        return float(K.slip[index] * K.guards1[frictions_at(K) + K.n_frictions + index])
    return 0.0


def find_way(K: Any, kind: int, index: int, high: float) -> float:
    """Distance at which what began just now, sliding or parting, is seen by shorter steps than one that misses it.

    0 if none sees it; − status if a step fails.
    """
    tiny = gap_tolerance(K, index) if kind == CLOSE else 0.0
    low = high
    for _ in range(MOST_LOOKS):
        low *= 0.5
        status = try_step(K, low, K.clock[NOW] + low)
        if status != 0:
            return -float(status)
        if guard_value(K, kind, index, K.clock[NOW] + low) > tiny:
            return low
    return 0.0


def bracket(K: Any, kind: int, index: int, low: float, high: float) -> int:
    """Root of the fired guard between two distances from the accepted state; K.pick[2] its distance."""
    t = K.clock[NOW]
    K.counts[LOCATIONS] += 1
    f_high = guard_value(K, kind, index, t + high)
    if f_high >= 0.0:
        if kind == OPEN_PULL:  # only the multiplier of the step was negative, not that of the motion
            K.active[index] = 1
            K.fired[0] = -1
        elif kind == STICK or kind == SLIP:
            K.active[K.n_contacts + K.n_guards + index] = 1
            K.fired[0] = -1
        K.pick[2] = high
        return 0
    d_high = guard_rate(K, kind, index)
    if low > 0.0:
        status = try_step(K, low, t + low)
        if status != 0:
            return status
    else:
        stay(K)
    f_low = guard_value(K, kind, index, t + low)
    if f_low <= 0.0 and (kind == STICK or kind == CLOSE):
        low = find_way(K, kind, index, high)
        if low < 0.0:
            return int(-low)
        if low == 0.0:
            stay(K)
        f_low = guard_value(K, kind, index, t + low)
    if f_low <= 0.0:
        if (kind == OPEN_GAP or kind == OPEN_FORCE) and K.guards0[K.n_contacts + index] < 0.0:
            K.pick[2] = high  # a touch too short to be seen within the step: it is over at its end
            return try_step(K, high, t + high)
        if low > 0.0 and kind != CROSS:
            low = 0.0
            stay(K)
        K.pick[2] = low
        return 0
    width = high - low
    guess = first_guess(f_low, f_high, guard_rate(K, kind, index) * width, d_high * width)
    if K.linear == 1 and kind != WATCH:
        place = low + width * f_low / (f_low - f_high)
        K.pick[2] = place
        return try_step(K, place, t + place)
    return refine(K, kind, index, low, f_low, high, f_high, low + width * guess)


def refine(K: Any, kind: int, index: int, low: float, f_low: float, high: float, f_high: float, guess: float) -> int:
    """Brent's root finder (Brent 1973, ch. 4) from a bracket and a first guess; leaves the candidate at the root."""
    t = K.clock[NOW]
    tiny = 0.0
    if kind == CLOSE or kind == OPEN_GAP:
        tiny = 0.25 * gap_tolerance(K, index)
    elif kind != WATCH and kind != CROSS:  # a user's guard has a scale of its own: its instant is found instead
        tiny = 1e-15 * max(f_low, -f_high)
    a = low  # the iterate before
    fa = f_low
    b = high  # the best iterate
    fb = f_high
    c = low  # the other end of the bracket
    fc = f_low
    move = high - low
    before = move
    at = -1.0  # where the candidate stands
    for trial in range(100):
        if (fb > 0.0) == (fc > 0.0):
            c = a
            fc = fa
            move = b - a
            before = move
        if abs(fc) < abs(fb):
            a = b
            b = c
            c = a
            fa = fb
            fb = fc
            fc = fa
        limit = 2.0 * EPS * max(abs(t), b)
        half = 0.5 * (c - b)
        if abs(half) <= limit or abs(fb) <= tiny:
            break
        if trial == 0:
            before = move
            move = guess - b
        elif abs(before) >= limit and abs(fa) > abs(fb):
            s = fb / fa
            if a == c:
                p = 2.0 * half * s
                r = 1.0 - s
            else:
                u = fa / fc
                w = fb / fc
                p = s * (2.0 * half * u * (u - w) - (b - a) * (w - 1.0))
                r = (u - 1.0) * (w - 1.0) * (s - 1.0)
            if p > 0.0:
                r = -r
            else:
                p = -p
            if 2.0 * p < min(3.0 * half * r - abs(limit * r), abs(before * r)):
                before = move
                move = p / r
            else:
                move = half
                before = half
        else:
            move = half
            before = half
        a = b
        fa = fb
        if abs(move) > limit:
            b += move
        else:
            b += limit if half > 0.0 else -limit
        status = try_step(K, b, t + b)
        if status != 0:
            return status
        at = b
        fb = guard_value(K, kind, index, t + b)
    place = b
    if kind == WATCH and fb >= 0.0:  # end where it is watched, or it fires again
        place = c
    K.pick[2] = place
    return 0 if at == place else try_step(K, place, t + place)
