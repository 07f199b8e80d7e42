"""After an event: who pushes, sticks and slides, so that accelerations and forces are consistent."""

from mbd.equal import REST_SPEED
from mbd.kernel.algebra.islands import find_islands
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.algebra.saddle import solve_rows
from mbd.kernel.codes import (
    LOG_CLOSED,
    LOG_OPENED,
    LOG_SLIPPED,
    LOG_STUCK,
    NO_FORCE,
    NO_IMPACT,
    NOT_KNOWN_YET,
    SLIP,
)
from mbd.kernel.contact.branches import solve_directed
from mbd.kernel.contact.complementarity import complementarity
from mbd.kernel.contact.cones import aim, follows, hold_directions, set_loose, set_sticking
from mbd.kernel.contact.contact_log import NO_IMPULSE, log_event
from mbd.kernel.contact.jams import stop_slide
from mbd.kernel.records import Balance, ContactForces, Frictions, Guards, Switching
from mbd.kernel.stepping.restart import (
    active_rows,
    capture,
    evaluate,
    note_scales,
    raise_scales,
    restore_scales,
    row_speed,
    take_consistent,
)

NEAR_REST_SPEED = 1e-7
"""The same along a friction that an event found at rest; index 3 may have moved it as velocities became consistent."""


def resolve_contact_modes(K: Switching) -> int:
    """Consistent accelerations and multipliers; contacts that would pull open, touching ones that press close.

    Frictions that do not move stick or begin to slide.
    """
    status = choose_modes(K)
    for _ in range(K.n_contacts):
        if status >= 0:
            break
        K.looks_ahead = 0
        status = stop_slide(K, -1 - status)
        if status == 0:
            status = choose_modes(K)
    if status < 0:
        K.failure_index = -1 - status
        return NO_FORCE
    if status != 0:
        return status
    take_consistent(K)
    for c in range(K.n_contacts):
        K.touched[c] = 0
        if K.kind[c] == 0 and K.active[c] != K.closed[c]:
            K.closed[c] = K.active[c]
            if K.active[c] == 1:
                capture(K, c)
                log_event(K, LOG_CLOSED, c, 0.0, NO_IMPULSE)
                K.closing_gap[c] = -1e300  # guards may be those of other parameters here
            else:
                K.armed[c] = 1
                log_event(K, LOG_OPENED, c, 0.0, NO_IMPULSE)
        K.active[c] = 0
    for f in range(K.n_frictions):
        c = K.friction_contact[f]
        K.loose[f] = 0
        if c >= 0 and K.closed[c] == 0:
            K.sticks[f] = 0
            K.slip[f] = 0.0
        if follows(K, f):  # the first of a group tells of all
            continue
        now = frictional_state(K, f)
        if now != K.was[f] and K.was[f] != NOT_KNOWN_YET:
            if now == 2:
                log_event(K, LOG_STUCK, f, 0.0, NO_IMPULSE)
            elif now != 0 and K.was[f] != 0:
                log_event(K, LOG_SLIPPED, f, 0.0, NO_IMPULSE)
        K.was[f] = now
    return 0


def choose_modes(K: Switching) -> int:
    """The active contacts and sticking frictions at the present velocities, by `find_branches`."""
    if K.n_cones > 0:
        hold_directions(K)
    find_slips(K)
    evaluate(K, K.time, K.q, K.y)
    K.impulse[: K.n_rows] = K.lam[: K.n_rows]
    for c in range(K.n_contacts):
        K.active[c] = 1 if (K.closed[c] == 1 and K.kind[c] == 0) else 0
        K.free[c] = 0
        if K.kind[c] == 0:
            if (K.closed[c] == 1 and K.opens[c] == 0) or (K.closed[c] == 0 and K.touched[c] == 1):
                K.free[c] = 1
    if K.looks_ahead == 0:
        return find_branches(K)
    # nothing that tells them apart acts yet: they are those of the forces that follow
    note_scales(K)
    evaluate(K, K.time_ahead, K.q_ahead, K.y_ahead)
    raise_scales(K, False)
    status = find_branches(K)
    restore_scales(K)
    evaluate(K, K.time, K.q, K.y)
    return status if status != 0 else solve_directed(K, 0)


def find_branches(K: Balance) -> int:
    """`complementarity` at the acceleration level, without slides whose normal force is unstable; a status.

    −1 − c where contact c slides so that no force is consistent: an impulse stops it.

    From rest in a plane such a slide is consistent only where sticking is: with ``(g̈, w) = w₀ + G (p, T)`` along the
    pull, ``w dg̈/dp = det G (μ p − |T|)`` of the sticking p and T. Both end at the limit ``|T| = μ p``, where the
    contact parts with ``g̈ = −p dg̈/dp``, the one motion left. In space the pull may turn as sliding begins.
    """
    status = complementarity(K, 0)
    parted = 0
    while status == 0 or status == NO_IMPACT:
        c = find_painleve_contacts(K)
        if c < 0:
            break
        if K.free[c] == 0 or K.active[c] == 0 or parted == K.n_contacts or not slides_from_rest(K, c):
            K.failure_index = c
            return -1 - c if status == NO_IMPACT and K.closed[c] == 1 and K.strategy == 0 else NO_FORCE
        K.active[c] = 0
        parted += 1
        status = complementarity(K, 0)
    return int(status)


def slides_from_rest(K: Frictions, c: int) -> bool:
    """Whether a contact that slides has no velocity along its friction."""
    found = False
    for f in range(K.n_frictions):
        found = found or (K.friction_contact[f] == c and K.loose[f] > 0)
    return found


def frictional_state(K: Frictions, f: int) -> int:
    """0 off, 2 sticking, ±1 sliding; 1 in space."""
    if K.sticks[f] == 1:
        return 2
    if K.group_size[f] > 1:
        return 1 if K.slip[f] != 0.0 else 0
    return int(K.slip[f])


def find_slips(K: Guards) -> None:
    """Which frictions slide, by their velocity, and which may choose; K.loose tells what an event has found out.

    On entry K.loose[f] is 0, 2 where an event found the velocity to be zero, 3 where it found that it must slide.
    """
    if K.n_frictions == 0:
        return
    evaluate(K, K.time, K.q, K.y)
    for f in range(K.n_frictions):  # its direction is that at the point of now, unless it is held already
        c = K.friction_contact[f]
        if c >= 0 and (K.closed[c] == 0 or K.sticks[f] == 0):
            capture(K, c)
    evaluate(K, K.time, K.q, K.y)
    for f in range(K.n_frictions):
        c = K.friction_contact[f]
        if K.group_size[f] > 1:
            if not follows(K, f):
                find_slip_of_group(K, f)
            continue
        found = K.loose[f]
        K.loose[f] = 0
        K.lean[f] = K.slip[f] if K.slip[f] != 0.0 else K.lean[f]
        if c >= 0 and K.closed[c] == 0 and K.touched[c] == 0:
            K.sticks[f] = 0
            K.slip[f] = 0.0
            continue
        gamma = row_speed(K, K.friction_row[f])
        if found == 3:  # an event may have been wrong about it; a step that has been tried was not
            K.loose[f] = 2 if K.strategy == 0 else 0
            continue
        small = max(1.0, 1e-2 * K.scale[K.n + K.n_rows + K.friction_row[f]])
        still = abs(gamma) <= REST_SPEED * small
        if (found == 2 and abs(gamma) <= NEAR_REST_SPEED * small) or (
            still and (K.slip[f] == 0.0 or K.event_kind != SLIP)
        ):
            K.loose[f] = 1
            K.sticks[f] = 1
            K.slip[f] = 0.0
        elif still:  # it is about to slide, and does unless its acceleration says otherwise
            K.loose[f] = 1
        else:
            K.sticks[f] = 0
            K.slip[f] = 1.0 if gamma > 0.0 else -1.0


def find_slip_of_group(K: Guards, f: int) -> None:
    """The same of frictions that slide together, the first of which is f: K.slip is the direction of γ."""
    c = K.friction_contact[f]
    found = K.loose[f]
    set_loose(K, f, 0)
    if c >= 0 and K.closed[c] == 0 and K.touched[c] == 0:
        set_sticking(K, f, 0)
        return
    if found == 3:  # along its pull
        set_loose(K, f, 2 if K.strategy == 0 else 0)
        return
    square = 0.0
    small = 1.0
    for g in range(f, f + K.group_size[f]):
        gamma = row_speed(K, K.friction_row[g])
        square += gamma * gamma
        small = max(small, 1e-2 * K.scale[K.n + K.n_rows + K.friction_row[g]])
    if sqrt(square) <= (NEAR_REST_SPEED if found == 2 else REST_SPEED) * small:
        set_loose(K, f, 1)
        if K.slip[f] == 0.0 or K.event_kind != SLIP or found == 2:
            set_sticking(K, f, 1)
    else:
        set_sticking(K, f, 0)
        for g in range(f, f + K.group_size[f]):
            K.slip[g] = row_speed(K, K.friction_row[g])
        aim(K, f)


def find_painleve_contacts(K: Balance) -> int:
    """A contact that slides so that pushing on it makes it approach: no force or several are consistent; −1 if none.

    ``dg̈/dp = B_n K⁻¹ (B_n − μ s B_T)ᵀ ≤ 0`` with the other rows held (Painlevé 1895; Génot & Brogliato 1999,
    Eur. J. Mech. A 18:653). Contacts of different islands are tested together, one of each in a turn. K.jump and
    K.impulse are kept.
    """
    turns = take_turns(K)
    if turns == 0:
        return -1
    K.trial_jump[: K.n] = K.jump[: K.n]
    K.trial[: K.n_rows] = K.impulse[: K.n_rows]
    K.bias[: K.n_rows] = 0.0
    found = -1
    for turn in range(turns):
        if found < 0 and push_on(K, turn, -1) == 0:
            found = approaching(K, turn)
            continue
        for c in range(K.n_contacts):  # one of them cannot be solved for: each alone
            if found < 0 and K.turn[c] == turn and push_on(K, turn, c) == 0 and approaches(K, c):
                found = c
    K.jump[: K.n] = K.trial_jump[: K.n]
    K.impulse[: K.n_rows] = K.trial[: K.n_rows]
    return found


def take_turns(K: Balance) -> int:
    """K.turn of each contact that slides, −1 of others: its number among those of its island; how many turns.

    Contacts that slide from rest are tested as far as their branches go: in a plane, and where they are closed.
    """
    turns = 0
    for c in range(K.n_contacts):
        K.turn[c] = -1
        K.cone_flags[c] = K.active[c]
    for f in range(K.n_frictions):
        c = K.friction_contact[f]
        if c < 0 or K.sticks[f] == 1 or K.slip[f] == 0.0:
            continue
        if K.closed[c] == 1 if K.loose[f] == 0 else (K.active[c] == 1 and K.group_size[f] == 1):
            K.turn[c] = 0
            K.active[c] = 1
            turns = 1
    if turns == 0:
        return 0
    m = active_rows(K, K.active)
    islands = find_islands(K, m)
    K.own_columns[:islands] = 0
    for k in range(m):
        c = K.row_contact[K.rows[k]]
        if c >= 0 and K.turn[c] == 0 and K.normal[c] == K.rows[k]:
            island = K.island[K.n + k]
            K.turn[c] = K.own_columns[island]
            K.own_columns[island] += 1
            turns = max(turns, K.own_columns[island])
    for c in range(K.n_contacts):
        K.active[c] = K.cone_flags[c]
    return turns


def push_on(K: Balance, turn: int, only: int) -> int:
    """K.jump under a push of one on each contact of a turn, or on `only` one of them; a status."""
    K.force[: K.n] = 0.0
    for c in range(K.n_contacts):
        if K.turn[c] == turn and (only < 0 or only == c):
            K.active[c] = K.parting[c] = 1
            for i in range(K.n):
                K.force[i] -= K.acc[K.acc_R + i * K.n_rows + K.normal[c]]
    status = solve_rows(K, active_rows(K, K.active), True)
    for c in range(K.n_contacts):
        if K.turn[c] == turn:
            K.parting[c] = 0
            K.active[c] = K.cone_flags[c]
    return int(status)


def approaching(K: ContactForces, turn: int) -> int:
    """The first contact of a turn that approaches under its push, −1 if none does."""
    for c in range(K.n_contacts):
        if K.turn[c] == turn and approaches(K, c):
            return c
    return -1


def approaches(K: ContactForces, c: int) -> bool:
    """Whether a contact approaches in K.jump, beyond round-off of the same push where no other row held."""
    gained = 0.0
    alone = 0.0
    for j in range(K.n):
        slope = K.acc[K.acc_B + K.normal[c] * K.n + j]
        gained += slope * K.jump[j]
        alone += slope * slope / K.acc[j * K.n + j] if K.acc[j * K.n + j] > 0.0 else 0.0
    return gained < -1e-9 * alone
