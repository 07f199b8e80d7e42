"""Contacts that slide in a plane within non-smooth steps: fixed steps, whatever becomes of the direction of γ.

A step in which γ may turn by much of itself, or reach zero, holds the direction in which it begins, and so does a step
for which directions that follow γ change too fast. Where it ends in another one, or beyond zero, the friction of the
whole step is found again, as an impulse in the cone opposite to the velocity at its end: that is Moreau's step, of
first order, for all contacts together.
"""

from mbd.equal import NOMINAL_RTOL, REST_SPEED
from mbd.kernel.codes import PULL
from mbd.kernel.contact.cone_turns import MIN_STEPS_TO_REST, STABILITY_SHARE, estimated_turn_rate
from mbd.kernel.contact.cones import (
    HOLD_DIRECTION,
    aim_as_pulled,
    along,
    away,
    friction_size,
    leads_group,
    set_hold,
    speed_of,
)
from mbd.kernel.records import ContactRows, Frictions, Guards, Reals, Switching
from mbd.kernel.stepping.restart import largest_force


def hold_for_step(K: Switching, h: float) -> None:
    """Which directions a step of size h holds; all of them where an explicit scheme would be unstable."""
    for f in range(K.n_frictions):
        if leads_group(K, f) and K.slip[f] != 0.0:
            change = speed_of(K, f, K.guards0, K.at_slip_rate)
            set_hold(
                K, f, HOLD_DIRECTION if MIN_STEPS_TO_REST * h * change > speed_of(K, f, K.guards0, K.at_slip) else 0.0
            )
    if K.explicit == 1 and h * estimated_turn_rate(K) > STABILITY_SHARE:
        hold_all(K)


def hold_all(K: Frictions) -> bool:
    """Hold all directions in the step that is tried again, where a slow γ turned too fast for it; whether any did not.

    The friction of a step that ends in other directions is found again as an impulse, whatever its size.
    """
    found = False
    for f in range(K.n_frictions):
        if K.group_size[f] > 1 and K.slip[f] != 0.0 and K.hold[f] != HOLD_DIRECTION:
            K.hold[f] = HOLD_DIRECTION
            found = True
    return found


def turned_in_plane(K: Guards, f: int) -> bool:
    """Whether the group of f ends a step in another direction than it held, beyond zero, or at rest."""
    forward = along(K, f, K.guards1, K.at_slip)
    if K.hold[f] != HOLD_DIRECTION:
        return forward < -REST_SPEED
    return bool(forward <= REST_SPEED or away(K, f, K.guards1, K.at_slip) > NOMINAL_RTOL * forward)


def release(K: Switching, f: int) -> int:
    """1 if the group of f sticks beyond its limit at the candidate: it slides as it was pulled."""
    slips = K.sticks[f] == 1 and is_beyond(K, f, K.lam1, K.guards1[K.at_limit + f])
    for g in range(f, f + K.group_size[f]):
        if slips or K.n_repeats == 0:
            K.let_go[g] = 1 if slips else 0
        if slips:
            K.sticks[g] = 0
    if not slips:
        return 0
    aim_as_pulled(K, f, K.lam1)
    return 1


def pulls(K: ContactRows, c: int, lam: Reals, part: float) -> bool:
    """Whether contact c, closed, opens on pull and does so by more than this part of the forces."""
    if K.kind[c] != 0 or K.closed[c] == 0 or K.opens[c] != 0:
        return False
    pull = lam[K.normal[c]]
    return bool(pull > 0.0 and pull > part * largest_force(K, K.normal[c]))


def is_beyond(K: ContactRows, f: int, lam: Reals, limit: float) -> bool:
    """Whether a friction is larger than its limit, by more than the round-off of the forces."""
    excess = friction_size(K, f, lam) - limit
    return bool(excess > 0.0 and excess > PULL * largest_force(K, K.friction_row[f]))
