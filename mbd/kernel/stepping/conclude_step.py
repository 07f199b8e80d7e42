"""A candidate without events becomes the accepted state, and the grid of steps goes on from it."""

from mbd.kernel.codes import AT_POSE, LEFT, NOT_CONVERGED
from mbd.kernel.contact.cones import follow_motion
from mbd.kernel.events.guards import update_armed, update_sides
from mbd.kernel.hooks import scheme_accept
from mbd.kernel.records import Kernel
from mbd.kernel.singular.events import refuses
from mbd.kernel.singular.leave import leave_singularity
from mbd.kernel.singular.step_pairs import ALONE, FIRST, SECOND
from mbd.kernel.stepping.accept_restart import accept_for_restart
from mbd.kernel.stepping.candidate import accept_guards
from mbd.kernel.stepping.contact_step import relax_pace

MAX_SHORTENED = 5
"""Shortened steps, less half the full ones between them, after which a mechanism with rows is stuck.

Without rows ten times as many.
"""


def accept(K: Kernel, h: float, t1: float, quiet: bool) -> None:
    """The candidate becomes the accepted state; guards follow."""
    scheme_accept(K, h)
    K.time = t1
    accept_guards(K)
    if K.n_cones > 0:
        follow_motion(K)
    if not quiet:
        update_armed(K)
        if K.n_guards > 0:
            update_sides(K)


def conclude(
    K: Kernel, h: float, full: float, t1: float, cut: bool, within: bool, quiet: bool, holds: bool, pulls: bool
) -> int:
    """Accept a candidate without events; 0, or a failure.

    h of the `full` step that was to be; `cut` at a boundary inside the run; `within` a step of the grid;
    `quiet`: no guard can have changed; `holds`: so do the rows that were left out; `pulls`: a reaction is spurious.
    """
    paired = K.paired_step > 0
    if h < full and not within:
        K.n_shortened += 1
        K.n_sized += K.too_near
        K.short_steps += 2
        patience = 2 * MAX_SHORTENED if K.n_active > 0 else 20 * MAX_SHORTENED
        if K.short_steps > patience:
            K.failure_time = t1
            K.failure_size = 0.0
            return NOT_CONVERGED
    elif K.short_steps > 0:
        K.short_steps -= 1
    if not within:
        if K.paired_step == FIRST:
            K.paired_step = SECOND
            K.n_shortened += 1
            K.n_sized += 1
        else:
            K.n_shortened += 1 if K.paired_step == ALONE else 0
            K.n_sized += 1 if K.paired_step == ALONE else 0
            K.paired_step = 0
    uneven = K.stabilized == 0 and K.n_active > 0 and (h < (1.0 - 1e-6) * K.step or not holds)
    uneven = uneven or pulls
    K.restarted_here = 0
    if cut and K.stabilized == 0 and refuses(K, h):
        K.event_kind = -1
        return AT_POSE
    if (h < 1e-3 * K.step and K.explicit == 0) or uneven:  # index-3 multipliers oscillate after a change of step
        accept_for_restart(K, t1)
        K.restart_due = 2
    else:
        accept(K, h, t1, quiet)
        if not within:
            K.grid_steps += 1
        if not holds:  # the constraint Jacobian has changed its rank
            K.restart_due = 2
        if (h < full and not within) or K.halvings > 0 or paired or cut or K.adaptive == 1:
            K.grid_start = t1  # the grid goes on from here
            K.grid_steps = 0
        if K.adaptive == 1 and not within:
            K.step = K.next_step
        elif K.step < K.dt:
            relax_pace(K)
        if K.near_singular == LEFT:
            status = leave_singularity(K, h)
            if status != 0:
                return status
    if K.halvings > 0:  # the end that had no impulses may not come at all
        K.halves_left -= 1
        if K.halves_left == 0:
            K.halvings = 0
    return 0
