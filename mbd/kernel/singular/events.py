"""Events next to a singular configuration, where constraints depend on each other for an instant.

Within τ of such a configuration round-off δ of a row makes velocities wrong by the share c/τ² (`step_size`).
No step may end there, and no scheme can restart from there. An event that changes nothing needs neither: the step over
the configuration stays as it is, and time and state of the event come from the quintic Hermite interpolant of the step
(`mbd.kernel.events.guard_substeps`). One that changes something ends the run with an error of its own (`refuses`).
"""

from mbd.kernel.algebra.orthogonal import square
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.codes import CROSS, LOG_EVENT
from mbd.kernel.contact.contact_log import NO_IMPULSE, log_event
from mbd.kernel.events.guard_substeps import copy_candidate, copy_ends, interpolate_candidate
from mbd.kernel.events.guards import judge_user
from mbd.kernel.records import DependentRows, Kernel, SingularSteps, Switching
from mbd.kernel.singular.step_size import MAX_NOISE, NOISE_RTOL, larger_motion, noise_coefficient, row_norms
from mbd.kernel.stepping.candidate import accept_guards
from mbd.kernel.stepping.observe import store_state
from mbd.kernel.stepping.restart import evaluate

REGULAR_RTOL = 0.05
"""What is left of a row, over the longest row, above which no singular configuration is near [-]."""
WELL_CONDITIONED_RTOL = 1e-3
"""The same above which restarts are well-conditioned [-]."""
EVENT_ELSEWHERE = -2.0
"""In place of the time to an event: it fires in this step, but not next to a singular configuration [-]."""


def may_pass_events(K: DependentRows, h: float) -> bool:
    """Whether the candidate's step may hold a singular configuration; where rows are held as index 3 any may."""
    if K.n_active == 0 or K.strategy == 1:
        return False
    if K.singular_size == 0:
        return bool(K.stabilized == 0 or K.near_singular > 0)
    return bool(0.0 <= K.singular_time - K.time <= h)


def find_passed_events(K: Kernel, h: float) -> int:
    """Times from the start of the step to events without effect next to a singular configuration, into K.crossed.

    Those are left out when events are looked for. Returns how many there are; the candidate stays as it is.
    """
    found = 0
    t = K.time
    copy_ends(K, True)
    for part in range(1, K.n_substeps + 1):
        show(K, t, h, part / K.n_substeps)
        for e in range(K.n_guards):
            if K.notify[K.flag_user + e] == 1 or K.crossed[e] != -1.0:
                continue
            K.event_kind = -1
            K.event_place = 2.0
            judge_user(K, e, h / K.n_substeps)
            if K.event_kind != CROSS:
                continue
            K.crossed[e] = EVENT_ELSEWHERE
            place = (part - 1 + K.event_place) / K.n_substeps
            low = (part - 1 + K.event_low) / K.n_substeps
            if share_inside(K, t, h, place) > 0.0:
                place = root_inside(K, e, t, h, low, part / K.n_substeps)
                if share_inside(K, t, h, place) > NOISE_RTOL:
                    K.crossed[e] = place * h
                    found += 1
            show(K, t, h, part / K.n_substeps)
        accept_guards(K)
    copy_ends(K, False)
    K.event_kind = -1
    return found


def show(K: Switching, t: float, h: float, s: float) -> None:
    """The interpolant at the part s of the step in place of the candidate; at its end the candidate itself."""
    if s < 1.0:
        interpolate_candidate(K, t, h, s, False)
    else:
        copy_candidate(K, False)


def root_inside(K: Switching, e: int, t: float, h: float, low: float, high: float) -> float:
    """Where the measure of event e vanishes on the interpolant, as a part of the step: by regula falsi."""
    place = K.at_user + e
    side = K.side[e]
    show(K, t, h, low)
    f_low = side * K.guards1[place]
    show(K, t, h, high)
    f_high = side * K.guards1[place]
    if f_low <= 0.0 or f_high >= 0.0:
        return low if f_low <= 0.0 else high
    middle = low
    last = 0
    for turn in range(100):  # steps to the root of an event's measure on the interpolant; it takes about ten
        middle = (low * f_high - high * f_low) / (f_high - f_low)
        if turn % 3 == 2 or not low < middle < high:
            middle = 0.5 * (low + high)
            last = 0
        if not low < middle < high:
            break
        show(K, t, h, middle)
        value = side * K.guards1[place]
        if value == 0.0:
            break
        if value > 0.0:
            low = middle
            f_low = value
            f_high *= 0.5 if last == 1 else 1.0
            last = 1
        else:
            high = middle
            f_high = value
            f_low *= 0.5 if last == -1 else 1.0
            last = -1
    return middle


def share_inside(K: Kernel, t: float, h: float, s: float) -> float:
    """Share of the velocities that round-off makes up at the part s of the step; 0 far from such a configuration.

    The candidate's place holds the interpolant afterwards.
    """
    interpolate_candidate(K, t, h, s, False)
    if not comes_close(K, t + s * h, REGULAR_RTOL):
        return 0.0
    m = K.n_active
    keep_parts(K, m)
    other = 0.0 if s >= 0.5 else 1.0
    show(K, t, h, other)
    evaluate(K, t + other * h, K.q1, K.y1)
    row_norms(K, m)
    return largest_noise_share(K, m, abs(s - other) * h)


def comes_close(K: DependentRows, t: float, part: float) -> bool:
    """Whether what is left of some row beside the others at (q1, y1) is a small part of the longest row.

    K.work holds these lengths, K.basis the directions.
    """
    m = K.n_active
    evaluate(K, t, K.q1, K.y1)
    row_norms(K, m)
    longest = 0.0  # a row may vanish by itself there
    least = 1e300
    for k in range(m):
        length = 0.0
        for j in range(K.n):
            entry = K.acc[K.acc_B + K.rows[k] * K.n + j] * K.spare[j]
            length += entry * entry
        longest = max(longest, length)
        least = min(least, K.work[k])
    return bool(least * least < part * part * longest)


def keep_parts(K: SingularSteps, m: int) -> None:
    """The independent parts of rows in K.turning and their lengths in K.work[2m:3m]."""
    K.turning[: m * K.n] = K.basis[: m * K.n]
    for k in range(m):
        K.work[2 * m + k] = K.work[k]


def largest_noise_share(K: SingularSteps, m: int, apart: float) -> float:
    """c/τ² of the parts kept, from those in K.basis at a time `apart` from them; K.failure_index names the row."""
    n = K.n
    largest = 0.0
    for k in range(m):
        here = K.work[2 * m + k]
        for j in range(n):
            K.basis[k * n + j] = K.work[k] * K.basis[k * n + j] - here * K.turning[k * n + j]
        change = square(K.basis, k * n, n)
        fall = sqrt(change) / (apart + 1e-300)
        share = (
            noise_coefficient(K, k, fall, larger_motion(K, k)) * fall * fall / (here * here + 1e-300)
            if fall > 0.0
            else 0.0
        )
        if share > largest:
            largest = share
            K.failure_index = K.n + k
    return largest


def refuses(K: SingularSteps, h: float) -> bool:
    """Whether the candidate ends where round-off makes too much of velocities to restart from there.

    K.detail tells when it ends, the share and the size of the step; K.failure_index the row.
    """
    t = K.time
    if K.n_active == 0 or h < 1e-6 * K.step or not comes_close(K, t + h, WELL_CONDITIONED_RTOL):
        return False
    m = K.n_active
    keep_parts(K, m)
    evaluate(K, t, K.q, K.y)
    row_norms(K, m)
    share = largest_noise_share(K, m, h)
    if share <= MAX_NOISE:
        return False
    K.failure_time = t + h
    K.failure_size = min(share, 1.0)
    K.failure_step = h
    return True


def log_passed_events(K: Switching, h: float) -> None:
    """Rows and lines of the log of events in K.crossed up to h, in order of time, from the candidate's interpolant."""
    t = K.time
    copy_ends(K, True)
    for _ in range(K.n_guards):
        first = -1
        for e in range(K.n_guards):
            if 0.0 <= K.crossed[e] <= h and (first < 0 or K.crossed[e] < K.crossed[first]):
                first = e
        if first < 0:
            break
        at = K.crossed[first]
        show(K, t, h, at / h)
        for k in range(K.n_rows):
            K.lam1[k] = K.lam[k] + at / h * (K.lam1[k] - K.lam[k])
        K.time = t + at
        store_state(K, K.q1, K.y1, K.rate1, K.lam1)
        log_event(K, LOG_EVENT, first, 0.0, NO_IMPULSE)
        store_state(K, K.q1, K.y1, K.rate1, K.lam1)
        K.time = t
        copy_candidate(K, False)
        K.side[first] = -K.side[first]
        K.crossed[first] = -1.0
    copy_ends(K, False)
    K.event_kind = -1
