"""The root of a guard in a bracket, by Brent's method on steps of varying size from the same accepted state."""

from mbd.kernel.codes import CLOSE, CROSS, CROSS_BACK, EPS, OPEN_GAP, WATCH
from mbd.kernel.events.guards import gap_tolerance, guard_value
from mbd.kernel.records import ContactRows, Kernel
from mbd.kernel.stepping.accept_restart import event_candidate

NOT_TRUSTED = 1e300
"""What `interpolated` gives where its move is not to be trusted."""


def refine(K: Kernel, kind: int, index: int, low: float, f_low: float, high: float, f_high: float, guess: float) -> int:
    """Brent's root finder (Brent 1973, ch. 4) from a bracket and a first guess; leaves the candidate at the root."""
    t = K.time
    tiny = enough(K, kind, index, f_low, f_high)
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
        trusted = guess - b
        if trial > 0:
            trusted = interpolated(a, b, c, fa, fb, fc, before, limit)
        before = move
        move = trusted
        if trusted == NOT_TRUSTED:
            move = half
            before = half
        a = b
        fa = fb
        if abs(move) > limit:
            b += move
        else:
            b += limit if half > 0.0 else -limit
        status = event_candidate(K, b, t + b)
        if status != 0:
            return status
        at = b
        fb = guard_value(K, kind, index, t + b)
    place = b
    if kind == WATCH and fb >= 0.0:  # end where it is watched, or it fires again
        place = c
    K.event_after = place
    return 0 if at == place else event_candidate(K, place, t + place)


def enough(K: ContactRows, kind: int, index: int, f_low: float, f_high: float) -> float:
    """Size of a guard that is round-off; 0 for a user's, which has a scale of its own: its instant is found instead."""
    if kind == CLOSE or kind == OPEN_GAP:
        return float(0.25 * gap_tolerance(K, index))
    if kind != WATCH and kind != CROSS and kind != CROSS_BACK:
        return 1e-15 * max(f_low, -f_high)
    return 0.0


def interpolated(a: float, b: float, c: float, fa: float, fb: float, fc: float, before: float, limit: float) -> float:
    """The move from b to the zero of the inverse parabola through three points (of the line through two, a = c).

    `NOT_TRUSTED` where it leaves the bracket from b to c, or iterates do not close in half as fast as two moves ago.
    """
    if not (abs(before) >= limit and abs(fa) > abs(fb)):
        return NOT_TRUSTED
    half = 0.5 * (c - b)
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
        return p / r
    return NOT_TRUSTED
