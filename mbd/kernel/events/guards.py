"""Judging a step: which guard fired first.

A watched gap fires when it falls through zero, also when it dips below zero and returns within
the step (cubic Hermite interpolant; `locate` then steps to the dip itself). A contact that is not
armed is ignored until its gap has risen above zero. Closed contacts fire by their release rule.
"""

from mbd.equal import NOMINAL_RTOL, REST_SPEED, ROUND_OFF_RTOL
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.codes import (
    ALWAYS,
    BY_MEASURE,
    CLOSE,
    CROSS,
    CROSS_BACK,
    CROSS_BRIEF,
    EPS,
    GRAZE,
    GUARDS,
    OPEN_FORCE,
    OPEN_GAP,
    OPEN_PULL,
    PRESS,
    SLIP,
    STICK,
    STICK_BRIEF,
    WATCH,
)
from mbd.kernel.contact.cones import HOLD_DIRECTION, along, follows, friction_size
from mbd.kernel.events.guard_round_off import TRUSTED_CHANGE, condition_round_off, guard_round_off
from mbd.kernel.events.hermite import crossing, hermite, hermite_turn
from mbd.kernel.hooks import call
from mbd.kernel.records import (
    Balance,
    ContactRows,
    Contacts,
    Events,
    Guards,
    Mechanism,
    Model,
    Reals,
    Switching,
)
from mbd.kernel.stepping.loads import evaluate_loaded, limit_of
from mbd.kernel.stepping.restart import consistent, evaluate, fill_block, largest_force
from mbd.kernel.stepping.scales import FORCE_ULPS, speed_round_off, unseen_force

DOUBTFUL_SHARE = 0.25
"""Part of the forces below which the sign of a multiplier of index 3 is asked of consistent accelerations [-]."""
NEAR_TURN_RATIO = 1e-3
"""Part of what a guard changes by in a step, at its first rate, above zero where the turn is looked at itself [-]."""
GAP_RTOL = 1e-10
"""Part of its terms by which a gap may be off its surface, or fall in a step at whose ends it does not fall [-]."""
RETREAT_ROUND_OFFS = 16.0
"""Round-offs of a guard by which it has gone back; a contact at its surface may leave it off by some of them [-]."""


def watch(K: Mechanism, t: float, q: Reals, y: Reals, rate: Reals, lam: Reals, values: Reals) -> None:
    """Gaps, gap rates, penalty forces, conditions and user guards at a state."""
    fill_block(K, t, q, y)
    K.block[K.o_a : K.o_a + K.n] = rate[: K.n]
    K.block[K.o_lam : K.o_lam + K.n_rows] = lam[: K.n_rows]
    call(K, GUARDS, values)


def is_waiting(K: Guards, e: int) -> bool:
    """Whether guard e is looked at: one of a transition is while its machine is in the state that it leaves.

    A timer is not, whose instant is known (`mbd.kernel.events.transitions.find_due`).
    """
    m = K.guard_machine[e]
    if m < 0:
        return True
    return bool(
        K.guard_fires[e] == 1 and K.guard_timed[e] < 4 and int(K.anchors[K.machine_start[m]]) == K.guard_source[e]
    )


def is_watched(K: Contacts, c: int, values: Reals) -> bool:
    """Whether an open contact may close."""
    other = K.watched_by[c]
    if other >= 0:
        return bool(K.closed[other] == 1)
    return bool(other == ALWAYS or values[K.at_condition + c] > 0.0)


def gap_scale(K: ContactRows, c: int) -> float:
    """Size of the terms a gap is made of [m, rad]; 1 for a penalty contact."""
    row = K.normal[c]
    size = K.scale[K.n + row] if row >= 0 else 1.0
    return float(max(size, 1e-3))


def gap_tolerance(K: ContactRows, c: int) -> float:
    """Round-off of the gap."""
    return 16.0 * EPS * gap_scale(K, c)


def update_armed(K: Guards) -> None:
    """A contact is armed (1) once its gap has risen above zero; one that becomes watched (−1), if it is above or rests.

    One that sinks through zero together with its own condition is below as long as it is watched, so it is ignored.

    A penalty contact that opened below the surface because it would have pulled (2) acts again as it presses.
    """
    for c in range(K.n_contacts):
        if K.closed[c] == 0:
            if K.armed[c] == 2:
                if K.guards0[c] > gap_tolerance(K, c):
                    K.armed[c] = 1
                continue
            if K.armed[c] != 1:
                K.deepest[c] = min(K.deepest[c], K.guards0[c])
            if not is_watched(K, c, K.guards0):
                K.armed[c] = -1
            elif K.armed[c] == -1:
                near = 1e-10 * gap_scale(K, c)
                sinks = K.watched_by[c] == BY_MEASURE and K.guards0[K.at_gap_rate + c] < -1e-9
                K.armed[c] = 1 if K.guards0[c] > near or (K.guards0[c] >= -near and not sinks) else 0
            elif K.armed[c] == 0 and K.guards0[c] > 1e-8 * gap_scale(K, c):
                K.armed[c] = 1


def update_sides(K: Switching) -> None:
    """The sides of users' guards at the accepted state."""
    for e in range(K.n_guards):
        update_side(K, e)


def update_side(K: Switching, e: int) -> None:
    """A guard that fires in one direction only is ready again once it has gone back.

    One that rested on its surface (side 0), at the start or after an event, is on the side to which it has moved.
    """
    value = K.guards0[K.at_user + e]
    if K.side[e] == 0.0 and value != 0.0 and abs(value) > guard_round_off(K, e, K.time, K.q, K.y):
        K.side[e] = 1.0 if value > 0.0 else -1.0
    if goes_back(K, e, value, K.time, K.q, K.y):
        K.side[e] = float(-K.direction[e])


def goes_back(K: Switching, e: int, value: float, t: float, q: Reals, y: Reals) -> bool:
    """Whether a guard that fires in one direction only is clearly on the side again from which it fires."""
    back = -K.direction[e]
    if not (back * K.side[e] < 0.0 and back * value > 0.0):
        return False
    return bool(abs(value) > RETREAT_ROUND_OFFS * guard_round_off(K, e, t, q, y))


def consider(K: Events, kind: int, index: int, estimate: float, low: float) -> None:
    """Keep the candidate that fires first; all in fractions of the step."""
    if estimate < K.event_place:
        K.event_place = estimate
        K.event_low = low
        K.event_kind = kind
        K.event_index = index


def is_quiet(K: Guards) -> bool:
    """Whether no guard can have fired: every contact open, armed, always watched and clearly apart."""
    if K.n_guards + K.n_frictions > 0:
        return False
    for c in range(K.n_contacts):
        if K.closed[c] != 0 or K.armed[c] != 1 or K.watched_by[c] != ALWAYS:
            return False
        if not (K.guards0[c] > NOMINAL_RTOL and K.guards1[c] > NOMINAL_RTOL):
            return False
        if K.guards0[K.at_gap_rate + c] < 0.0 < K.guards1[K.at_gap_rate + c]:
            return False
    return True


def judge(K: Switching, h: float) -> bool:
    """Whether a guard fired between the accepted state and the candidate; the earliest in K.event_kind and so on."""
    K.event_kind = -1
    K.event_place = 2.0
    for c in range(K.n_contacts):
        if K.active[c] == 1 or (K.strategy == 1 and K.kind[c] == 0):  # found to be no event, or not located
            continue
        g0 = K.guards0[c]
        g1 = K.guards1[c]
        d0 = K.guards0[K.at_gap_rate + c] * h
        d1 = K.guards1[K.at_gap_rate + c] * h
        tiny = gap_tolerance(K, c)
        if K.closed[c] == 0:
            if begins_to_be_watched(K, c, h):
                consider(K, WATCH, c, crossing(K.guards0[K.at_condition + c], K.guards1[K.at_condition + c]), 0.0)
                continue
            if K.armed[c] == 2 and g1 < 0.0 and K.guards1[K.at_force + c] > 0.0:
                consider(K, PRESS, c, crossing(K.guards0[K.at_force + c], K.guards1[K.at_force + c]), 0.0)
            if K.armed[c] != 1 or not is_watched(K, c, K.guards0):
                continue
            if g1 < -tiny:
                if min(d0, d1) >= -tiny and rises(g0, g1 + tiny, d0, d1, GAP_RTOL * gap_scale(K, c), d1 * K.dt / h):
                    continue
                slow = d0 >= -tiny and g0 - g1 > tiny  # what comes before it is looked at first
                if g0 > tiny:
                    consider(K, CLOSE, c, crossing(g0, g1), 0.0)
                else:
                    top = hermite_turn(g0, g1, d0, d1, True)
                    if top > 0.0 and hermite(g0, g1, d0, d1, top) > tiny:
                        consider(K, CLOSE, c, top + (1.0 - top) * crossing(hermite(g0, g1, d0, d1, top), g1), top)
                    else:
                        consider(K, CLOSE, c, sqrt(tiny / (g0 - g1)) if slow else 0.0, 0.0)
            elif d0 < -tiny and d1 > 0.0:
                bottom = hermite_turn(g0, g1, d0, d1, False)
                limit = -NEAR_TURN_RATIO * d0 if g0 > tiny else min(g0, 0.0) - 4.0 * tiny
                if bottom > 0.0 and hermite(g0, g1, d0, d1, bottom) < limit:
                    consider(K, GRAZE, c, bottom, 0.0)
        elif K.kind[c] == 0:
            if K.opens[c] == 0:
                pull = pull_of(K, c, h)
                if pull > 0.0:
                    evaluate(K, K.time, K.q, K.y)
                if pull > 0.0 and pull > unseen_force(K, K.normal[c]):
                    consider(K, OPEN_PULL, c, crossing(-K.lam[K.normal[c]], -pull), 0.0)
        else:
            low = 0.0
            if g0 >= -tiny and d0 < 0.0:  # it closed just now; it opens after its deepest point
                low = max(hermite_turn(g0, g1, d0, d1, False), 0.0)
            if K.opens[c] == 1:
                if g1 > tiny:
                    consider(K, OPEN_GAP, c, low + (1.0 - low) * crossing(hermite(g0, g1, d0, d1, low), g1), low)
            elif K.guards1[K.at_force + c] < 0.0:
                consider(
                    K, OPEN_FORCE, c, max(low, crossing(K.guards0[K.at_force + c], K.guards1[K.at_force + c])), low
                )
    for e in range(K.n_guards):
        judge_user(K, e, h)
    for f in range(K.n_frictions):
        if K.strategy == 0 or is_located(K, f):
            judge_friction(K, f, h)
    return bool(K.event_kind >= 0)


def is_located(K: Guards, f: int) -> bool:
    """Whether friction f is that of a joint that sticks or moves: a non-smooth step ends where that changes."""
    alone = K.friction_contact[f] < 0 and K.group_size[f] == 1
    return bool(alone and (K.sticks[f] == 1 or K.slip[f] * K.guards0[K.at_slip + f] > REST_SPEED))


def rises(g0: float, g1: float, d0: float, d1: float, lost: float, reach: float) -> bool:
    """Whether a gap whose rate is none or positive at both ends of a step is below zero by an error of the step alone.

    By what Newton's method leaves open, `lost`; or where it was at rest on its surface, by less than it rises in a
    step: as a force passes zero, the gap rises with the cube of time, which is what a scheme of order 2 errs by. From
    there it comes up again, by `reach` in a step of dt; what is farther below has jumped there. What left the surface
    with a speed and is below it at the end has come down in between.
    """
    return g1 >= -lost or (abs(g0) <= lost and d0 <= lost and g0 - g1 <= d1) or (g0 <= g1 and -reach <= g0 < 0.0)


def begins_to_be_watched(K: Switching, c: int, h: float) -> bool:
    """Whether the measure that contact c is watched by has risen through zero, by more than its round-off."""
    place = K.at_condition + c
    if K.watched_by[c] != BY_MEASURE or not K.guards0[place] <= 0.0 < K.guards1[place]:
        return False
    return bool(K.guards1[place] > condition_round_off(K, c, K.time + h, K.q1, K.y1))


def judge_user(K: Switching, e: int, h: float) -> None:
    """Whether a user's guard crosses zero from its side; one that still rises from there does so after its top.

    A sign that has changed by no more than round-off is no crossing, unless the guard comes from beyond round-off and
    goes on at such a rate; otherwise it is judged again after the next step. A guard that is back on its side at the
    end is looked at where it turns, like a gap that grazes (`locate` steps there).
    """
    side = K.side[e]
    v0 = side * K.guards0[K.at_user + e]
    v1 = side * K.guards1[K.at_user + e]
    if K.active[K.flag_user + e] == 1 or (K.n_machines > 0 and not is_waiting(K, e)):
        return
    if v1 >= 0.0:
        judge_return(K, e, v0, v1, h)
        return
    if K.direction[e] * side > 0.0:
        return
    d0 = side * K.guards0[K.at_user_rate + e] * h
    d1 = side * K.guards1[K.at_user_rate + e] * h
    doubt = guard_round_off(K, e, K.time + h, K.q1, K.y1)
    if -v1 <= doubt and min(v0, -d1) <= TRUSTED_CHANGE * doubt:
        return
    top = hermite_turn(v0, v1, d0, d1, True) if d0 > 0.0 else -1.0
    if top > 0.0:
        consider(K, CROSS, e, top + (1.0 - top) * crossing(max(hermite(v0, v1, d0, d1, top), 0.0), v1), top)
    else:
        consider(K, CROSS, e, crossing(v0, v1) if v0 > 0.0 else 0.0, 0.0)


def judge_return(K: Events, e: int, v0: float, v1: float, h: float) -> None:
    """Whether a user's guard, above zero at both ends of the step, seems to dip below or to come close between them."""
    d0 = K.side[e] * K.guards0[K.at_user_rate + e] * h
    d1 = K.side[e] * K.guards1[K.at_user_rate + e] * h
    if v0 > 0.0 and d0 < 0.0 < d1:
        bottom = hermite_turn(v0, v1, d0, d1, False)
        if bottom > 0.0 and hermite(v0, v1, d0, d1, bottom) < -NEAR_TURN_RATIO * d0:
            consider(K, CROSS_BRIEF, e, bottom, 0.0)


def pull_of(K: Balance, c: int, h: float) -> float:
    """The multiplier of a closed contact at the candidate, positive where it pulls.

    That of a step lags behind; where it is small beside the forces (index 3), or beside what it changed by in the step,
    the consistent one is asked.
    """
    pull = float(K.lam1[K.normal[c]])
    if is_doubtful(K, K.normal[c], pull, pull - K.lam[K.normal[c]]) and consistent(K, K.time + h, K.q1, K.y1) == 0:
        return float(K.impulse[K.normal[c]])
    return pull


def is_doubtful(K: Model, row: int, force: float, change: float) -> bool:
    """Whether the sign of a force along a row that follows from multipliers of a step is asked of consistent ones.

    The multipliers of an implicit step of low order balance its own accelerations, which may lag by what the step
    changes: where the motion is prescribed they are off by a part of the change of the force within the step.
    Those of long steps, which are looked at in parts (`guard_substeps`), are consistent.
    """
    if K.explicit == 1 or K.n_substeps > 1 or K.strategy == 1:
        return False
    if abs(force) < abs(change):
        return True
    return bool(K.stabilized == 0 and abs(force) < DOUBTFUL_SHARE * largest_force(K, row))


def judge_friction(K: Switching, f: int, h: float) -> None:
    """Whether a friction that slides comes to rest, or one that sticks is pulled beyond its limit."""
    if K.active[K.flag_friction + f] == 1 or follows(K, f):
        return
    if K.sticks[f] == 1:
        m0 = K.guards0[K.at_limit + f] - friction_size(K, f, K.lam)
        m1 = K.guards1[K.at_limit + f] - friction_size(K, f, K.lam1)
        if is_doubtful(K, K.friction_row[f], m1, change_of_margin(K, f)):
            m1 = margin(K, f, K.time + h)
        if m1 < -pull_round_off(K, f, K.lam1):
            consider(K, SLIP, f, crossing(max(m0, 0.0), m1), 0.0)
        return
    s = K.slip[f]
    if s == 0.0 or (
        K.group_size[f] > 1 and K.hold[f] != HOLD_DIRECTION
    ):  # in a plane γ passes zero where its direction is held
        return
    v0 = along(K, f, K.guards0, K.at_slip)
    v1 = along(K, f, K.guards1, K.at_slip)
    d0 = along(K, f, K.guards0, K.at_slip_rate) * h
    d1 = along(K, f, K.guards1, K.at_slip_rate) * h
    tiny = ROUND_OFF_RTOL * max(K.scale[K.n + K.n_rows + K.friction_row[f]], 1e-3)
    if v1 < -tiny or (d0 < 0.0 < d1 and v0 > tiny):  # round-off of the whole motion is asked for where it matters
        evaluate(K, K.time, K.q, K.y)
        tiny = speed_round_off(K, K.friction_row[f])
    if v1 < -tiny:
        top = hermite_turn(v0, v1, d0, d1, True) if d0 > 0.0 else -1.0
        if v0 > tiny:
            consider(K, STICK, f, crossing(v0, v1), 0.0)
        elif top > 0.0 and hermite(v0, v1, d0, d1, top) > tiny:
            consider(K, STICK, f, top + (1.0 - top) * crossing(hermite(v0, v1, d0, d1, top), v1), top)
        else:
            consider(K, STICK, f, 0.0, 0.0)
    elif d0 < 0.0 < d1 and v0 > tiny:
        bottom = hermite_turn(v0, v1, d0, d1, False)
        if bottom > 0.0 and hermite(v0, v1, d0, d1, bottom) < 0.0:  # it turns around and back within the step
            consider(K, STICK_BRIEF, f, bottom, 0.0)


def pull_round_off(K: ContactRows, f: int, lam: Reals) -> float:
    """Round-off of what is left of a sticking friction at given multipliers: that of all forces enters each of them."""
    return FORCE_ULPS * EPS * max(friction_size(K, f, lam), largest_force(K, K.friction_row[f]))


def change_of_margin(K: Guards, f: int) -> float:
    """Most by which limit − |λ_T| of a sticking friction may have changed in the step, by its own multipliers."""
    square = 0.0
    for g in range(f, f + K.group_size[f]):
        change = K.lam1[K.friction_row[g]] - K.lam[K.friction_row[g]]
        square += change * change
    return float(sqrt(square) + abs(K.guards1[K.at_limit + f] - K.guards0[K.at_limit + f]))


def margin(K: Switching, f: int, t1: float) -> float:
    """What is left of a sticking friction at the candidate, limit − |λ_T| of consistent multipliers."""
    if consistent(K, t1, K.q1, K.y1) != 0:
        return float(K.guards1[K.at_limit + f] - friction_size(K, f, K.lam1))
    K.loads[: K.n_rows] = K.impulse[: K.n_rows]
    evaluate_loaded(K, K.loads)
    if K.n_cones > 0 and K.n_dropped > 0:  # what all feet together have left, though this one may be at its limit
        return float(limit_of(K, f) - friction_size(K, f, K.lam_at_limit))
    return float(limit_of(K, f) - friction_size(K, f, K.impulse))


def guard_value(K: Switching, kind: int, index: int, t1: float) -> float:
    """The fired guard at the candidate, counted so that it is ≥ 0 before and < 0 after its event."""
    if kind == CLOSE:
        return float(K.guards1[index])
    if kind == OPEN_GAP:
        return float(-K.guards1[index])
    if kind == OPEN_FORCE:
        return float(K.guards1[K.at_force + index])
    if kind == PRESS:  # below the surface, to which it may come back within the step
        return float(max(K.guards1[index], -K.guards1[K.at_force + index]))
    if kind == WATCH:
        condition = float(K.guards1[K.at_condition + index])
        return -condition if condition != 0.0 else 1e-300 - condition  # watched only above zero
    if kind == CROSS:
        return float(K.side[index] * K.guards1[K.at_user + index])
    if kind == STICK:
        return along(K, index, K.guards1, K.at_slip)
    if kind == CROSS_BACK:
        return float(-K.side[index] * K.guards1[K.at_user + index])
    if kind == SLIP:
        return margin(K, index, t1)
    if consistent(K, t1, K.q1, K.y1) != 0:
        return float(-K.lam1[K.normal[index]])
    return float(-K.impulse[K.normal[index]])
