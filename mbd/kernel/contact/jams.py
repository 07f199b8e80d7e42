"""An impulse without collision: what ends a slide whose contact force is nowhere consistent (Painlevé's paradox).

A push on such a contact makes it approach as long as it slides, and no push lets it sink in. The bodies resist: within
an instant the push grows until the slide has stopped, as in an impact whose approach speed is none (Génot & Brogliato
1999, Eur. J. Mech. A 18:653; Zhao, Liu, Ma & Chen 2008, Mech. Res. Commun. 35:576). It is that impact, by the same
laws: of an approach that tends to zero, which leaves no solution in which the contact slides on.
"""

from mbd.equal import ROUND_OFF_RTOL
from mbd.kernel.codes import LOG_OPENED, LOG_STUCK, NO_FORCE
from mbd.kernel.contact.contact_log import ALL_IMPULSES, NO_IMPULSE, log_event
from mbd.kernel.contact.impact_solve import energy_gain, gather, prepare, solve_impact, start_over
from mbd.kernel.records import ContactForces, Switching
from mbd.kernel.stepping.restart import row_speed

APPROACH_REDUCTION = 0.1
"""Approach of each regularized impact over the one before, the first over the speed of the slide [-]."""
MAX_REDUCTIONS = 4
"""Approaches before there is none [-]."""


def stop_slide(K: Switching, c: int) -> int:
    """The velocities in K.y jump so that something slides no longer where contact c cannot slide on.

    NO_FORCE where no impulses do that.
    """
    K.closing[: K.n_contacts] = 0
    prepare(K)
    gather(K, False, False)
    slide = 0.0
    for k in range(K.n_rows):
        K.given[k] = 0.0
        if K.row_contact[k] == c and K.normal[c] != k:
            slide += abs(row_speed(K, k))
    # the branches of a slow approach, then the impulses that these give without it
    status = 0
    approach = APPROACH_REDUCTION
    for turn in range(MAX_REDUCTIONS + 1):
        start_over(K)
        for k in range(K.n_rows):
            K.bias[k] = row_speed(K, k)
            other = K.row_contact[k]
            if other >= 0 and K.normal[other] == k and K.active[other] == 1:
                K.bias[k] -= approach * slide
        if status == 0:
            status = solve_impact(K)
        approach *= APPROACH_REDUCTION if turn + 1 < MAX_REDUCTIONS else 0.0
    stopped = stopped_friction(K)
    if status != 0 or stopped < 0 or energy_gain(K) > ROUND_OFF_RTOL:
        K.failure_index = c
        return NO_FORCE
    # energy, velocities, and who parts
    loss = 0.0
    for k in range(K.n_rows):
        half = 0.0
        for j in range(K.n):
            half += 0.5 * K.acc[K.acc_B + k * K.n + j] * K.jump[j]
        loss += K.impulse[k] * (row_speed(K, k) + half)
    for i in range(K.n):
        K.y[i] += K.jump[i]
    K.n_impacts += 1
    log_event(K, LOG_STUCK, stopped, loss, ALL_IMPULSES)
    for f in range(K.n_frictions):
        K.loose[f] = 2 if K.sticks[f] == 1 and K.loose[f] == 1 else 0
        if K.friction_contact[f] == K.friction_contact[stopped]:
            K.was[f] = 2
    for other in range(K.n_contacts):
        if K.closed[other] == 1 and K.kind[other] == 0 and K.active[other] == 0:
            K.closed[other] = 0
            K.armed[other] = 1
            log_event(K, LOG_OPENED, other, 0.0, NO_IMPULSE)
    return 0


def stopped_friction(K: ContactForces) -> int:
    """The friction of a contact that an impulse has stopped, the first of several that slide together; −1: none."""
    for f in range(K.n_frictions):
        c = K.friction_contact[f]
        if c >= 0 and K.leader[f] == f and K.sticks[f] == 1 and K.active[c] == 1 and K.impulse[K.normal[c]] < 0.0:
            return f
    return -1
