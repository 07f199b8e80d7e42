"""Contact without locating instants: fixed steps, positions and velocities corrected at their ends.

After Brüls, Acary & Cardona 2014 (Comput. Methods Appl. Mech. Eng. 281:131). A step is taken smoothly with the contacts
that are closed, whose rows keep the order of the scheme. At its end

positions    ``M U + B_bᵀ ν_b = B_uᵀ ν_u``, ``h(q₁) = 0``, ``0 ≤ g(q₁) ⟂ ν_u ≥ 0`` with ``q₁ = q~ ⊕ U``
velocities   the impact law from v~, with ``0 ≤ γ₁ + e γ₀ ⟂ Λ_u ≥ 0``, γ₀ the gap rate before the step, and friction
             whose impulse over the whole step obeys Coulomb's law
forces       those of consistent accelerations, from which the scheme starts again

instead of carrying the accelerations of the free flight on. A contact that would pull over a step, and a friction
beyond its limit, let go before it, and the step is taken again.
"""

from mbd.equal import REST_SPEED
from mbd.kernel.algebra.linear import largest_entry
from mbd.kernel.codes import CONFLICT, EPS, LOG_OPENED, NO_IMPACT, PULL
from mbd.kernel.contact.complementarity import complementarity
from mbd.kernel.contact.cones import follows
from mbd.kernel.contact.contact_log import NO_IMPULSE, log_event
from mbd.kernel.contact.nonsmooth_cones import pulls, release, turned_in_plane
from mbd.kernel.events.guards import gap_scale, gap_tolerance, is_watched, watch
from mbd.kernel.events.switching import close_by_impact, mark_touching
from mbd.kernel.records import Balance, ContactForces, ContactRows, Guards, Reals, Switching
from mbd.kernel.stepping.candidate import accept_candidate, carry
from mbd.kernel.stepping.restart import consistent, displace, evaluate, is_held, take_consistent

MAX_DEPTH_OVER_ROUND_OFF = 1e4
"""Depth over the round-off of a gap at which a correction of positions has failed [-]."""
HELD_ROW_RTOL = 1024.0 * EPS
"""What a row on positions is off by, relative to its terms, where it holds [-]."""
REST_SPEED_RATIO = 2.0
"""Approach speed over the change of speed in a step below which a contact rests instead of rebounding [-]."""


def must_release(K: Switching, t1: float) -> int:
    """Contacts that pulled and frictions beyond their limits in the step just tried let go before it; how many.

    What has let go for a step does not hold again in it, even where frictions that depend on each other share a load.
    """
    count = 0
    doubtful = any_pulls(K, K.lam1, PULL)  # multipliers of a step may oscillate: consistent ones decide
    known = doubtful and consistent(K, t1, K.q1, K.y1) == 0
    for c in range(K.n_contacts):
        if doubtful and pulls(K, c, K.impulse if known else K.lam1, PULL):
            K.closed[c] = 0
            K.armed[c] = 1
            count += 1
            log_event(K, LOG_OPENED, c, 0.0, NO_IMPULSE)
    for f in range(K.n_frictions):
        c = K.friction_contact[f]
        if c >= 0 and K.closed[c] == 0:
            K.sticks[f] = 0
            K.slip[f] = 0.0
            continue
        if not follows(K, f):
            count += release(K, f)
    if count > 0:
        for f in range(K.n_frictions):
            if K.let_go[f] == 1 and K.slip[f] != 0.0:
                K.loose[f] = 3
        K.restart_due = 2
        K.n_repeats += 1
    return count


def any_pulls(K: ContactRows, lam: Reals, part: float) -> bool:
    """Whether one of them does."""
    found = False
    for c in range(K.n_contacts):
        found = found or pulls(K, c, lam, part)
    return found


def closes_below_surface(K: Guards) -> bool:
    """Whether open contacts lie below their surfaces at the candidate, or a friction has turned around.

    The contacts are marked in K.closing.
    """
    found = False
    for c in range(K.n_contacts):
        K.closing[c] = 0
        if K.kind[c] == 0 and K.closed[c] == 0 and K.armed[c] == 1 and is_watched(K, c, K.guards0):
            if K.guards1[c] < -gap_tolerance(K, c):
                K.closing[c] = 1
                found = True
    for f in range(K.n_frictions):
        if K.group_size[f] > 1:
            found = found or (K.slip[f] != 0.0 and not follows(K, f) and turned_in_plane(K, f))
        elif K.slip[f] != 0.0:
            turned = -K.slip[f] * K.guards1[K.at_slip + f]
            if turned > REST_SPEED:
                found = True
    return found


def project_gaps(K: Switching) -> int:
    """Positions of K.q moved least, in the metric of M, until no contact lies below its surface."""
    for f in range(K.n_frictions):
        K.base_limit[f] = K.slip[f]  # kept here: friction moves nothing
        K.slip[f] = 0.0
        K.loose[f] = 0
    for k in range(K.n_rows):  # those that depend on others, and along a surface that is only being reached
        c = K.row_contact[k]
        along = c >= 0 and K.normal[c] != k and K.closed[c] == 0
        K.lifting[k] = 1 if (along or K.dropped[k] == 1) else 0
    status = NO_IMPACT
    left = 0.0
    for _ in range(20):  # corrections of positions at one instant
        for c in range(K.n_contacts):
            near = K.closing[c] > 0 or K.closed[c] == 1
            if K.kind[c] == 0 and not near and K.armed[c] == 1 and is_watched(K, c, K.guards0):
                near = K.guards0[c] < gap_tolerance(K, c)
                K.closing[c] = 1 if near else 0
            K.active[c] = 1 if (near and K.kind[c] == 0) else 0
            K.free[c] = 1 if (K.active[c] == 1 and K.closed[c] == 0 and K.closing[c] == 1) else 0
            K.parting[c] = 0
        status = project_gaps_once(K)
        if status != 0:
            break
        for c in range(K.n_contacts):  # one that was lifted stays at its surface while others follow
            if K.closing[c] == 1 and K.kind[c] == 0 and K.impulse[K.normal[c]] < 0.0:
                K.closing[c] = 3
        watch(K, K.time, K.q, K.y, K.rate, K.lam, K.guards0)
        left = 0.0
        for c in range(K.n_contacts):
            if K.kind[c] == 0 and K.armed[c] == 1 and K.closed[c] == 0 and is_watched(K, c, K.guards0):
                left = max(left, -K.guards0[c] / gap_tolerance(K, c))
        if left <= 1.0 and largest_entry(K.jump, 0, K.n_v) <= 1e-12:
            break
    K.slip[: K.n_frictions] = K.base_limit[: K.n_frictions]
    K.lifting[: K.n_rows] = 0
    if status == 0 and left > MAX_DEPTH_OVER_ROUND_OFF:
        return NO_IMPACT
    return status


def project_gaps_once(K: Balance) -> int:
    """One Newton step of `project_gaps`; the correction relative to 1 is left in K.jump."""
    n = K.n
    evaluate(K, K.time, K.q, K.y)
    K.force[:n] = 0.0
    for k in range(K.n_rows):
        K.given[k] = 0.0
        K.bias[k] = K.acc[K.acc_h + k]
    status = complementarity(K, 2)
    if status == CONFLICT and touches(K):
        K.impulse[: K.n_rows] = 0.0
        K.jump[:n] = 0.0
        return 0
    if status != 0:
        return status
    displace(K, K.q, K.jump)
    return 0


def touches(K: ContactRows) -> bool:
    """Whether all rows that act hold at K.q but for round-off, in which rows that nearly depend may contradict."""
    for row in range(K.n_rows):
        if is_held(K, row, K.active) and K.row_level[row] == 0:
            if not abs(K.acc[K.acc_h + row]) <= HELD_ROW_RTOL * max(K.scale[K.n + row], 1e-3):
                return False
    return True


def strike(K: Switching, h: float, t1: float) -> int:
    """The candidate becomes the accepted state, lifted out of the surfaces; multipliers of its row do not pull."""
    K.before[: K.n_contacts] = K.guards0[K.at_gap_rate : K.at_gap_rate + K.n_contacts]
    accept_candidate(K, t1)
    for k in range(K.n_rows):
        K.past[k] = h * K.lam[k]
    K.past_time = h
    if any_pulls(K, K.lam, 0.0) and consistent(K, t1, K.q, K.y) == 0:
        take_consistent(K)
    return project_gaps(K)


def rebound(K: Switching) -> int:
    """The impact of a step, after `strike`; where all that come down rest, none of the closed contacts leaves."""
    fastest = 0.0
    for c in range(K.n_contacts):
        if K.kind[c] != 0 or K.closed[c] == 1:
            K.closing[c] = 0
            continue
        near = K.closing[c] == 3 or K.guards0[c] <= 1e-10 * gap_scale(K, c)
        ready = K.armed[c] == 1 and is_watched(K, c, K.guards0)
        K.closing[c] = 1 if (near and ready) else 0
        if K.closing[c] == 1:
            approach = max(-K.before[c], 0.0)
            gained = abs(K.guards0[K.at_gap_rate + c] - K.before[c])
            if approach < REST_SPEED_RATIO * gained:
                K.before[c] = 0.0  # it rests
            else:
                K.before[c] = max(
                    K.before[c], min(K.guards0[K.at_gap_rate + c], 0.0)
                )  # the slower one: it gains no energy
                fastest = max(fastest, approach)
    status = close_by_impact(K, fastest)
    if status == 0:
        mark_touching(K)
    K.past[: K.n_rows] = 0.0
    K.past_time = 0.0
    return status


def keep(K: Switching) -> None:
    """Remember the accepted state, from which a step whose end has no impulses is tried again."""
    copy(K, True)
    copy_flags(K, True)


def put_back(K: Switching, t: float) -> None:
    """The state as `keep` found it, at time t."""
    copy(K, False)
    copy_flags(K, False)
    K.time = t


def copy(K: Switching, out: bool) -> None:
    """The state into K.kept, or back."""
    o = carry(K.q, K.kept, 0, K.n_q, out)
    o = carry(K.y, K.kept, o, K.n, out)
    o = carry(K.rate, K.kept, o, K.n, out)
    o = carry(K.lam, K.kept, o, K.n_rows, out)
    o = carry(K.guards0, K.kept, o, K.n_watched, out)
    o = carry(K.anchors, K.kept, o, K.n_anchors, out)
    carry(K.slip, K.kept, o, K.n_frictions, out)


def copy_flags(K: ContactForces, out: bool) -> None:
    """Who is closed, armed, … into K.kept_flags, or back."""
    o = carry(K.closed, K.kept_flags, 0, K.n_contacts, out)
    o = carry(K.armed, K.kept_flags, o, K.n_contacts, out)
    o = carry(K.touched, K.kept_flags, o, K.n_contacts, out)
    o = carry(K.sticks, K.kept_flags, o, K.n_frictions, out)
    o = carry(K.loose, K.kept_flags, o, K.n_frictions, out)
    carry(K.was, K.kept_flags, o, K.n_frictions, out)
