"""Many steps with switching: step, judge, accept or switch, observe."""

from __future__ import annotations

from typing import Any

from mbd.kernel.fields import (
    BASE,
    CHATTER,
    CLOSE,
    CONFLICT,
    CROSS,
    DONE,
    ENDLESS,
    EVENT,
    EVENTS,
    FULL,
    GRID,
    HALVED,
    HALVES,
    INCHING,
    LAST,
    LAST_SWITCH,
    LEFT,
    LOCAL,
    LOG_EVENT,
    LOGGED,
    MODE,
    N_DROPPED,
    NEAR,
    NEW_MODE,
    NEXT,
    NO_IMPACT,
    NOT_CONVERGED,
    NOW,
    PAIRED,
    PAUSE,
    PLASTIC,
    REDONE,
    RESTART,
    ROWS,
    SHORTENED,
    SINCE_STORE,
    SPENT,
    STEP,
    STEPS,
    STORED,
    STRAIGHT,
    SWITCHES,
    TRIED,
    WATCH,
    WIDTH,
)  # fmt: skip
from mbd.kernel.guards import is_quiet, judge, try_step, update_armed, update_sides
from mbd.kernel.hooks import scheme_accept
from mbd.kernel.interior import parts_to_take
from mbd.kernel.locate import locate
from mbd.kernel.nonsmooth import PULL, keep, lands, lets_go, put_back, rebound, strike
from mbd.kernel.observe import is_awaited, store_row
from mbd.kernel.pairs import ALONE, FIRST, SECOND
from mbd.kernel.settle import log_event
from mbd.kernel.starting import find_mode, restart, still_dependent
from mbd.kernel.switching import switch
from mbd.kernel.takeover import leave_pose, take_over
from mbd.kernel.trying import part_end, step_end, tried_step

__all__ = ["advance"]

MOST_SHORTENED = 5
"""Shortened steps, less half the full ones between them, after which a mechanism with rows is stuck.

Without rows ten times as many.
"""
MOST_HALVED = 3
"""How often a non-smooth step whose end has no impulses is halved [-]."""


def rings(K: Any) -> bool:
    """Whether a step of index 3 ends with a contact that pulls, although it has been judged to push.

    Multipliers of index 3 err for some steps after a start; consistent ones take the place of such a row's.
    """
    force = 0.0
    for i in range(K.n_v):
        force = max(force, K.scale[i])
    for c in range(K.n_contacts):
        if K.kind[c] == 0 and K.closed[c] == 1 and K.opens[c] == 0 and K.lam1[K.normal[c]] > PULL * force:
            return True
    return False


def accept(K: Any, h: float, t1: float, quiet: bool) -> None:
    """The candidate becomes the accepted state; guards follow."""
    scheme_accept(K, h)
    K.clock[NOW] = t1
    for i in range(K.n_watched):
        K.guards0[i] = K.guards1[i]
    if not quiet:
        update_armed(K)
        update_sides(K)


def same_instant(K: Any) -> bool:
    """Count switches without progress in time; true when there were too many."""
    now = K.clock[NOW]
    if now - K.clock[LAST_SWITCH] <= 1e-10 * K.dt:
        K.state[SWITCHES] += 1
    else:
        K.state[SWITCHES] = 0
    K.clock[LAST_SWITCH] = now
    return bool(K.state[SWITCHES] > K.max_switches)


def was_closed(K: Any, c: int) -> bool:
    """Whether a contact was closed in the row before the last."""
    return bool(K.store[(K.state[STORED] - 2) * K.width + K.width - K.n_contacts + c] == 1.0)


def handle_event(K: Any) -> int:
    """Take the located event: rows before and after, impact, restart. Negative: nothing for the caller to do."""
    kind = K.fired[0]
    index = K.fired[1]
    first = K.state[LOGGED]
    take_over(K, K.clock[NOW] + K.pick[2])
    if same_instant(K):
        return CHATTER
    if kind == WATCH:
        K.state[RESTART] = 2
        return switch(K) - 1
    store_row(K)
    if kind == CROSS:
        log_event(K, LOG_EVENT, index, 0.0, False)
        K.side[index] = -K.side[index]
        K.state[RESTART] = 1
        return EVENT if is_awaited(K, first) else -1
    if kind == CLOSE and K.state[SWITCHES] > K.max_switches // 2:  # blows by turns: their limit is plastic, all at once
        K.state[PLASTIC] = 1
        K.counts[ENDLESS] += 1
    status = switch(K)
    K.state[PLASTIC] = 0
    if status != 0:
        return status
    status = restart(K)
    store_row(K)  # also where no accelerations are consistent: the velocities after the event are known
    if status != 0:
        return status
    for c in range(K.n_contacts):
        if was_closed(K, c) and K.closed[c] == 0 and K.armed[c] != 1 and K.guards0[K.n_contacts + c] < -1e-6:
            K.sinking[c] = min(K.sinking[c], K.clock[NOW])
    return EVENT if is_awaited(K, first) else -1


def land(K: Any, h: float, t1: float) -> int:
    """End a non-smooth step: rows before and after, impact, restart. Negative: nothing for the caller to do.

    Where no impulses obey all laws, the step is tried again with half its size, down to an eighth.
    """
    first = K.state[LOGGED]
    stored = K.state[STORED]
    t = K.clock[NOW]
    events = K.counts[EVENTS]
    keep(K)
    status = strike(K, h, t1)
    if status == 0:
        store_row(K)
        status = rebound(K)
    if status == 0:
        status = restart(K)
    if (status == NO_IMPACT or status == CONFLICT) and K.state[HALVED] < MOST_HALVED:
        K.state[HALVED] += 1
        K.state[HALVES] = 2 ** (K.state[HALVED] + 1)
        K.counts[SHORTENED] += 1
        K.state[LOGGED] = first
        K.state[STORED] = stored
        K.counts[EVENTS] = events
        put_back(K, t)
        K.state[RESTART] = 2
        return -1
    if status != 0:
        return status
    store_row(K)
    K.state[REDONE] = 0
    K.state[HALVED] = 0
    return EVENT if is_awaited(K, first) else -1


def forget_found(K: Any) -> None:
    """No guard has been found to be no event yet."""
    for c in range(K.n_contacts + K.n_guards + K.n_frictions):
        K.active[c] = 0


def begin(K: Any) -> int:
    """What comes before a step: room for its rows, a start of the scheme, code of the mode; −1 if it can be taken."""
    if K.state[STORED] + 4 > K.capacity or K.state[LOGGED] + 3 * K.n_contacts + 6 > K.event_capacity:
        return FULL
    if K.state[RESTART] > 0:
        visible = K.state[RESTART] == 1
        first = K.state[LOGGED]
        status = restart(K)
        if status != 0:
            return status
        K.state[RESTART] = 0
        if visible or K.state[LOGGED] > first:
            store_row(K)
        if is_awaited(K, first):
            return EVENT
    if K.clock[NOW] >= K.until - 1e-12 * K.dt:
        return DONE
    if K.state[MODE] < 0:
        K.state[MODE] = find_mode(K)
        if K.state[MODE] < 0:
            return NEW_MODE
    return -1


def conclude(K: Any, h: float, full: float, t1: float, cut: bool, within: bool, quiet: bool, holds: bool) -> int:
    """Accept a candidate without events; 0, or a failure.

    h of the `full` step that was to be; `cut` at a boundary inside the run; `within` a step of the grid;
    `quiet`: no guard can have changed; `holds`: so do the rows that were left out.
    """
    paired = K.state[PAIRED] > 0
    if h < full and not within:
        K.counts[SHORTENED] += 1
        K.state[INCHING] += 2
        patience = 2 * MOST_SHORTENED if K.state[ROWS] > 0 else 20 * MOST_SHORTENED
        if K.state[INCHING] > patience:
            K.detail[0] = t1
            K.detail[1] = 0.0
            return NOT_CONVERGED
    elif K.state[INCHING] > 0:
        K.state[INCHING] -= 1
    if not within:
        if K.state[PAIRED] == FIRST:
            K.state[PAIRED] = SECOND
            K.counts[SHORTENED] += 1
        else:
            K.counts[SHORTENED] += 1 if K.state[PAIRED] == ALONE else 0
            K.state[PAIRED] = 0
    uneven = K.stabilized == 0 and K.state[ROWS] > 0 and (h < (1.0 - 1e-6) * K.clock[STEP] or rings(K))
    if (h < 1e-3 * K.clock[STEP] and K.scheme != 1) or uneven:  # index 3 rings after a change of step
        take_over(K, t1)
        K.state[RESTART] = 2
    else:
        accept(K, h, t1, quiet)
        if not within:
            K.state[GRID] += 1
        if not holds:  # the pose has changed its rank
            K.state[RESTART] = 2
        if (h < full and not within) or K.state[HALVED] > 0 or paired or cut or K.adaptive == 1:
            K.clock[BASE] = t1  # the grid goes on from here
            K.state[GRID] = 0
        if K.adaptive == 1 and not within:
            K.clock[STEP] = K.clock[NEXT]
        if K.state[NEAR] == LEFT:
            status = leave_pose(K, h)
            if status != 0:
                return status
    if K.state[HALVED] > 0:  # the end that had no impulses may not come at all
        K.state[HALVES] -= 1
        if K.state[HALVES] == 0:
            K.state[HALVED] = 0
    return 0


def advance(K: Any) -> int:
    """Step until `until`, a full store, a mode without code, an event to report, or a failure."""
    steps = 0
    while True:
        status = begin(K)
        if status >= 0:
            return status
        t = K.clock[NOW]
        if steps >= K.chunk:
            return PAUSE
        steps += 1
        on_grid = step_end(K)
        t1 = part_end(K, on_grid)
        within = t1 < on_grid  # the step ends inside one of the grid, where guards are looked at
        cut = t1 > K.until - 1e-6 * K.clock[STEP]
        if cut and K.until >= K.end:  # the caller decides: a step of the grid as in a longer run, or one cut
            return LAST
        if cut:
            t1 = K.until
        h = t1 - t
        if K.state[HALVED] > 0:
            h *= 0.5 ** K.state[HALVED]
            t1 = t + h
            cut = False
        full = h
        status = tried_step(K, h, t1)
        if status != 0:
            return status
        if K.clock[TRIED] != h:
            h = K.clock[TRIED]
            t1 = t + h
            cut = cut and h >= full
        if K.adaptive == 1 or K.state[PAIRED] == FIRST or K.state[PAIRED] == ALONE:
            full = h
        K.counts[STEPS] += 1
        holds = K.state[N_DROPPED] == 0 or still_dependent(K) or K.state[NEAR] > 0  # nothing is told apart there
        fired = False
        quiet = is_quiet(K)
        judged = quiet
        if K.looks > 1 and K.n_watched > 0 and K.state[STRAIGHT] == 0:
            forget_found(K)
            quiet = False
            parts = parts_to_take(K, h)
            judged = parts >= 0
            if parts != 0:
                within = True
                cut = False
                K.state[STRAIGHT] = 1
                K.clock[WIDTH] = h / K.looks
                h = abs(parts) * h / K.looks
                t1 = t + h
                status = try_step(K, h, t1)
                if status != 0:
                    return status
        else:
            K.state[STRAIGHT] = 0
        if not judged:
            forget_found(K)
            if judge(K, h):
                status = locate(K, h)
                if status != 0:
                    return status
                fired = K.fired[0] >= 0
                if fired and K.strategy == 1 and lands(K):  # the contact comes first
                    fired = False
                    status = try_step(K, h, t1)
                    if status != 0:
                        return status
        if K.adaptive == 1:
            part = max(K.pick[2], 0.0) / h if fired else 1.0
            K.clock[SPENT] += K.clock[LOCAL] * part ** (K.error_order + 1.0)
        elif K.scheme == 1:
            largest = 0.0
            for i in range(K.n_v):
                largest = max(largest, abs(K.error[K.n_v + i]))
            K.clock[SPENT] += largest
        if fired:
            status = handle_event(K)
            if status >= 0:
                return status
            continue
        if K.strategy == 1 and not quiet:
            if lets_go(K, t1) > 0:
                if K.state[REDONE] > K.max_switches:
                    return CHATTER
                continue
            if lands(K):
                status = land(K, h, t1)
                if status >= 0:
                    return status
                continue
            K.state[REDONE] = 0
        status = conclude(K, h, full, t1, cut, within, quiet, holds)
        if status != 0:
            return status
        K.state[SINCE_STORE] += 1
        if K.state[SINCE_STORE] >= K.stride:
            store_row(K)
