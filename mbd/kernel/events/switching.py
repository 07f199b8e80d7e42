"""What an event does: contacts close by impact, open by their rules; frictions stick and slip."""

from mbd.equal import EQUAL_RTOL, REST_SPEED
from mbd.kernel.codes import (
    CLOSE,
    CROSS,
    LOG_CLOSED,
    LOG_OPENED,
    NO_FORCE,
    OPEN_FORCE,
    OPEN_PULL,
    PRESS,
    SLIP,
    STICK,
    WATCH,
)
from mbd.kernel.contact.cones import aim_as_pulled, friction_size, leads_group, set_loose, set_sticking, speed_of
from mbd.kernel.contact.contact_log import ALL_IMPULSES, NO_IMPULSE, OWN_IMPULSE, log_event
from mbd.kernel.contact.impact import impact
from mbd.kernel.contact.impact_solve import loss_elsewhere, loss_in, strikes
from mbd.kernel.events.guards import gap_scale, is_watched
from mbd.kernel.events.impulses import AFTER, BEFORE, BESIDE, push
from mbd.kernel.records import Balance, Frictions, Guards, Mechanism, Switching
from mbd.kernel.stepping.accept_restart import project_velocity
from mbd.kernel.stepping.loads import evaluate_loaded, limit_of
from mbd.kernel.stepping.restart import active_rows, capture, consistent, evaluate, largest_force

COMMON_REST_SHARE = 1e-3
"""Part of dt within which contacts that come to rest do so together [-]."""


def gather_closing(K: Guards) -> float:
    """Mark the contacts that close at this instant in K.closing; the fastest closing speed of unilateral ones.

    Contacts that touch and approach close together with the fired one, whatever their order; those that touch and
    rest (2) take part in its impact, where impacts follow each other without end also those that leave.
    """
    fastest = 0.0
    for c in range(K.n_contacts):
        K.closing[c] = 0
        if K.closed[c] == 1:
            continue
        fired = K.event_kind == CLOSE and K.event_index == c
        near = abs(K.guards0[c]) <= 1e-10 * gap_scale(K, c)
        ready = K.armed[c] == 1 and is_watched(K, c, K.guards0)
        approach = -K.guards0[K.at_gap_rate + c]
        if fired or (near and ready and K.kind[c] == 0 and approach > REST_SPEED):
            K.closing[c] = 1
            if K.kind[c] == 0:
                # located by interpolation it may part already, which is no rest; located exactly it parts only where
                # its next contact is at this instant as well
                fastest = max(fastest, abs(approach) if K.linear == 1 else approach)
        elif near and ready and K.kind[c] == 0 and (approach >= -REST_SPEED or K.plastic_impact == 1):
            K.closing[c] = 2
    return fastest


def release_for(K: Switching, after: int) -> None:
    """Open the contacts whose rule names one that closes now."""
    for c in range(K.n_contacts):
        if K.closed[c] == 1:
            for place in range(K.when[c], K.when[c + 1]):
                if K.when[place] % 2 == after and K.closing[K.when[place] // 2] == 1:
                    K.closed[c] = 0
                    K.armed[c] = 0
                    log_event(K, LOG_OPENED, c, 0.0, NO_IMPULSE)
                    break


def close_by_impact(K: Switching, fastest: float) -> int:
    """Impact of all closing unilateral contacts, the releases it causes, anchors and log."""
    slow = fastest < K.rest_speed or (K.plastic_impact == 1 and fastest == 0.0)  # a rebound too small to rise at all
    if not slow:
        release_for(K, 0)
    status = 0
    if K.n_impulses > 0 and not slow:
        status = push(K, BEFORE)
        status = push(K, BESIDE) if status == 0 else status
    if status == 0:
        status = impact(K, slow)
    if status != 0:
        return status
    count = 0
    own = 0.0
    for c in range(K.n_contacts):
        if strikes(K, c):
            count += 1
            own += abs(loss_in(K, c))
    others = loss_elsewhere(K) if count > 0 else 0.0
    impulses = ALL_IMPULSES  # in the first line, so that each impulse of this impact is reported once
    for c in range(K.n_contacts):
        if K.kind[c] != 0 or (K.closed[c] == 0 and not strikes(K, c)):
            continue
        if K.closing[c] > 0:
            loss = loss_in(K, c)
            part = abs(loss) / own if own > 0.0 else 1.0 / count
            log_event(K, LOG_CLOSED, c, loss + part * others, impulses)
            K.closing_gap[c] = min(K.closing_gap[c], K.guards0[c])
            impulses = OWN_IMPULSE
            if K.active[c] == 1:
                capture(K, c)
                K.closed[c] = 1
            else:
                K.armed[c] = 1
                if K.n_machines > 0:  # it rebounds, or an impulse keeps it from striking: open again, for modes too
                    K.happened[LOG_OPENED * K.n_contacts + c] = 1
        elif K.active[c] == 0:
            K.closed[c] = 0
            K.armed[c] = 1
            log_event(K, LOG_OPENED, c, 0.0, NO_IMPULSE)
    if not slow:
        release_for(K, 1)
    return push(K, AFTER) if K.n_impulses > 0 and not slow else 0


def mark_touching(K: Guards) -> None:
    """Contacts at g = 0 and ġ = 0 are left to their acceleration."""
    evaluate(K, K.time, K.q, K.y)
    for c in range(K.n_contacts):
        K.touched[c] = 0
        near = abs(K.guards0[c]) <= 1e-10 * gap_scale(K, c)
        if K.kind[c] == 0 and K.closed[c] == 0 and K.armed[c] == 1 and near and is_watched(K, c, K.guards0):
            still = True
            for k in range(K.n_rows):
                if K.row_contact[k] == c and K.row_friction[k] < 0 and abs(K.acc[K.acc_rate + k]) > REST_SPEED:
                    still = False
            K.touched[c] = 1 if still else 0


def capture_approach(K: Mechanism) -> None:
    """Penalty contacts that close hold their approach speed, as an impact at the same instant leaves it."""
    for c in range(K.n_contacts):
        if K.closing[c] == 1 and K.kind[c] == 1 and K.anchor_start[c] < K.anchor_start[c + 1]:
            evaluate(K, K.time, K.q, K.y)
            capture(K, c)


def bursts(K: Mechanism, c: int) -> bool:
    """Whether the force of a sliding contact changed its sign through a pole, not through zero."""
    for f in range(K.n_frictions):
        if K.friction_contact[f] == c and K.slip[f] != 0.0:
            return bool(abs(K.lam[K.normal[c]]) > 1e-3 * largest_force(K, K.normal[c]))
    return False


def stop_together(K: Switching, index: int) -> None:
    """Frictions in a plane or in space come to rest: the group found, and those that do within a thousandth of dt.

    A body that slides on several feet stops on all of them at once, but for round-off and errors of the step. The
    velocities that are left become those at which nothing slides; whether it stays so is for the restart to say.
    """
    evaluate(K, K.time, K.q, K.y)
    for f in range(K.n_frictions):
        if leads_group(K, f) and K.slip[f] != 0.0 and is_closed(K, f):
            speed = speed_of(K, f, K.guards0, K.at_slip)
            if f == index or speed <= COMMON_REST_SHARE * K.dt * speed_of(K, f, K.guards0, K.at_slip_rate):
                set_loose(K, f, 2)
                set_sticking(K, f, 1)
                if K.friction_contact[f] >= 0:
                    capture(K, K.friction_contact[f])
    project_velocity(K, K.time, K.q, K.y, active_rows(K, K.closed), True)


def is_closed(K: Frictions, f: int) -> bool:
    """Whether the contact of friction f is closed, or it is that of a joint."""
    return bool(K.friction_contact[f] < 0 or K.closed[K.friction_contact[f]] == 1)


def slip_together(K: Balance, index: int) -> None:
    """Feet that share a load begin to slide together: the one found, and those at their limits at the largest load.

    The others stick on: the body turns about one that does. Who slides goes the way of its pull, which at that load is
    the only one.
    """
    set_sticking(K, index, 1)
    status = consistent(K, K.time, K.q, K.y)
    aim_as_pulled(K, index, K.lam)
    K.loads[: K.n_rows] = K.impulse[: K.n_rows]
    evaluate_loaded(K, K.loads)
    for f in range(K.n_frictions):
        if status == 0 and leads_group(K, f) and K.sticks[f] == 1 and is_closed(K, f):
            limit = limit_of(K, f)
            if f == index or (limit > 0.0 and friction_size(K, f, K.lam_at_limit) > (1.0 - EQUAL_RTOL) * limit):
                set_loose(K, f, 3)
                set_sticking(K, f, 0)
                aim_as_pulled(K, f, K.lam_at_limit)
    for g in range(K.leader[index], K.leader[index] + K.group_size[index]):
        K.sticks[g] = 0


def stop_spin(K: Balance, index: int) -> None:
    """The spin of a contact that came to rest is none, not round-off of what it was: nothing else may move then."""
    K.sticks[index] = 1
    project_velocity(K, K.time, K.q, K.y, active_rows(K, K.closed), True)
    K.sticks[index] = 0


def switch(K: Switching) -> int:
    """What the fired guard does to the closed contacts and the velocities; the state is at its instant."""
    kind = K.event_kind
    index = K.event_index
    for c in range(K.n_contacts):
        K.closing[c] = 0
        K.active[c] = 0
    if kind == CLOSE:
        fastest = gather_closing(K)
        hard = False
        for c in range(K.n_contacts):
            if K.closing[c] == 1:
                if K.kind[c] == 0:
                    hard = True
                else:
                    K.closed[c] = 1
                    log_event(K, LOG_CLOSED, c, 0.0, NO_IMPULSE)
        if hard:
            status = close_by_impact(K, fastest)
            if status != 0:
                return status
        else:  # a penalty contact closes without impact
            release_for(K, 0)
            release_for(K, 1)
        capture_approach(K)
    elif kind == PRESS:
        K.closed[index] = 1
        log_event(K, LOG_CLOSED, index, 0.0, NO_IMPULSE)
    elif kind == STICK:
        K.loose[index] = 2
        K.sticks[index] = 0
        if K.group_size[index] > 1:
            stop_together(K, index)
        elif K.friction_contact[index] >= 0 and K.row_unit[K.friction_row[index]] == 1:
            stop_spin(K, index)
    elif K.looks_ahead == 1:  # all contacts and frictions choose together
        mark_touching(K)
        return 0
    elif kind == SLIP:
        set_loose(K, index, 3)
        set_sticking(K, index, 0)
        aim_as_pulled(K, index, K.lam)
        if K.group_size[index] > 1 and K.n_dropped > 0:
            slip_together(K, index)
    elif kind == OPEN_PULL and bursts(K, index):
        K.failure_index = index
        return NO_FORCE
    elif kind != CROSS and kind != WATCH:
        K.closed[index] = 0
        K.armed[index] = 2 if kind == OPEN_FORCE else 1
        log_event(K, LOG_OPENED, index, 0.0, NO_IMPULSE)
    if kind != WATCH:
        mark_touching(K)
    if kind == OPEN_PULL:  # its force has passed zero: the acceleration there is round-off and decides nothing
        K.touched[index] = 0
    return 0
