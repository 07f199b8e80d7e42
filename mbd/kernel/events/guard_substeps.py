"""Guards inside a long step, so that what happens and is over again within it is not missed.

A step of a high-order scheme may be as long as the motion takes to turn around. It has K.n_substeps parts, and at
their ends the guards are evaluated on the quintic Hermite interpolant of positions, velocities and accelerations (where
⊕ is not +, of the increment in the chart of the step), with consistent multipliers where a closed contact or a friction
asks for them, and each part is judged like a step of its own.

What is guaranteed: an excursion of a guard that lasts a fifth of the motion's own time scale or longer is seen, as it
is by four short steps in place of the long one; one that is shallower than the error of the interpolant may be missed,
like one between two short steps.
"""

from mbd.kernel.codes import EPS
from mbd.kernel.events.guards import gap_scale, gap_tolerance, goes_back, is_watched, judge, watch
from mbd.kernel.records import Contacts, Guards, Switching
from mbd.kernel.stepping.candidate import accept_guards, carry
from mbd.kernel.stepping.charts import find_chart_end, leave_chart
from mbd.kernel.stepping.restart import compose, consistent, fill_block

INTERPOLATION_ULPS = 16.0
"""Distance over the round-off of a position below which the interpolant need not meet it at the end of a step [-]."""


def parts_to_take(K: Switching, h: float) -> int:
    """After how many parts the candidate's step must end; −1: after the first, which holds an event; 0: never.

    Guards and multipliers of the accepted state and of the candidate are as before afterwards.
    """
    copy_ends(K, True)
    t = K.time
    asked = needs_multipliers(K)
    answer = 0
    for part in range(1, K.n_substeps + 1):
        if part < K.n_substeps:
            interpolate_candidate(K, t, h, part / K.n_substeps, asked)
        else:
            copy_candidate(K, False)
        fired = judge(K, h / K.n_substeps)
        if fired:
            answer = part - 1 if part > 1 else -1
            break
        if part < K.n_substeps and rearms(K, t + part / K.n_substeps * h):
            answer = part
            break
        accept_guards(K)
        K.lam[: K.n_rows] = K.lam1[: K.n_rows]
    copy_ends(K, False)
    K.event_kind = -1
    return answer


def copy_ends(K: Guards, out: bool) -> None:
    """What is overwritten, into K.inside or back: guards and multipliers at both ends, the candidate."""
    if out and K.vector == 0:
        find_chart_end(K)
    o = carry(K.guards0, K.inside, 0, K.n_watched, out)
    carry(K.lam, K.inside, o, K.n_rows, out)
    copy_candidate(K, out)


def copy_candidate(K: Guards, out: bool) -> None:
    """The same of the candidate alone; guards and multipliers of the accepted state stay what they are."""
    o = carry(K.guards1, K.inside, K.n_watched + K.n_rows, K.n_watched, out)
    o = carry(K.lam1, K.inside, o, K.n_rows, out)
    o = carry(K.q1, K.inside, o, K.n_q, out)
    o = carry(K.y1, K.inside, o, K.n, out)
    carry(K.rate1, K.inside, o, K.n, out)


def needs_multipliers(K: Contacts) -> bool:
    """Whether a guard asks for multipliers: of a contact that opens as it pulls, of friction."""
    if K.n_frictions > 0:
        return True
    count = 0
    for c in range(K.n_contacts):
        if K.closed[c] == 1 and K.kind[c] == 0 and K.opens[c] == 0:
            count += 1
    return count > 0


def interpolate_candidate(K: Switching, t: float, h: float, s: float, asked: bool) -> None:
    """Guards (and multipliers) of the interpolant at the part s of the step, in place of those of the candidate."""
    u = s * s
    fill_block(K, t, K.q, K.y)
    for i in range(K.n):
        y0 = K.y[i]
        y1 = K.inside[K.inside_y + i]
        d0 = h * K.rate[i]
        d1 = h * K.inside[K.inside_rate + i]
        gap = 0.0  # of the position at the end, which the integral of the cubic misses
        if i < K.n_v:
            if K.vector == 0:
                y1 = K.chart_end[K.n_v + i]
                d1 = h * K.chart_end[2 * K.n_v + i]
            whole = 0.5 * (y0 + y1) + (d0 - d1) / 12.0
            end = K.inside[K.inside_q + i] - K.q[i] if K.vector == 1 else K.chart_end[i]
            size = abs(K.q[i]) if K.vector == 1 else 1.0
            gap = end - h * whole
            if abs(gap) <= INTERPOLATION_ULPS * EPS * size:  # round-off over h would be a velocity
                gap = 0.0
            x = y0 * (s + u * s * (0.5 * s - 1.0)) + y1 * u * s * (1.0 - 0.5 * s)
            x += d0 * u * (0.5 + s * (0.25 * s - 2.0 / 3.0)) + d1 * u * s * (0.25 * s - 1.0 / 3.0)
            K.block[K.o_x + i] = h * x + gap * u * s * (10.0 + s * (6.0 * s - 15.0))
        K.y1[i] = y0 + (y1 - y0) * u * (3.0 - 2.0 * s) + d0 * s * (1.0 - s) * (1.0 - s) - d1 * u * (1.0 - s)
        K.y1[i] += gap / h * 30.0 * u * (1.0 - s) * (1.0 - s)
        slope = 6.0 * (y1 - y0) * s * (1.0 - s) + d0 * (1.0 - s) * (1.0 - 3.0 * s) + d1 * s * (3.0 * s - 2.0)
        K.rate1[i] = (slope + 60.0 * gap / h * s * (1.0 - s) * (1.0 - 2.0 * s)) / h
    compose(K, K.q1)
    if K.vector == 0:
        leave_chart(K)
    if asked and consistent(K, t + s * h, K.q1, K.y1) == 0:
        K.rate1[: K.n] = K.jump[: K.n]
        K.lam1[: K.n_rows] = K.impulse[: K.n_rows]
    watch(K, t + s * h, K.q1, K.y1, K.rate1, K.lam1, K.guards1)


def rearms(K: Switching, t: float) -> bool:
    """Whether a contact or a guard of the user would be ready to fire, or no longer, after the place just looked at."""
    for c in range(K.n_contacts):
        if K.closed[c] == 1:
            continue
        gap = K.guards1[c]
        if K.armed[c] == 2:
            changes = gap > gap_tolerance(K, c)
        else:
            changes = is_watched(K, c, K.guards1) != (K.armed[c] != -1)
            changes = changes or (K.armed[c] == 0 and gap > 1e-8 * gap_scale(K, c))
        if changes:
            return True
    back = False
    for e in range(K.n_guards):
        back = back or goes_back(K, e, K.guards1[K.at_user + e], t, K.q1, K.y1)
    return back
