"""Contacts that slide in a plane within non-smooth steps: fixed steps, whatever becomes of the direction of γ.

A step in which γ may turn by much of itself, or reach zero, holds the direction in which it begins, and so does a step
for which directions that follow γ change too fast. Where it ends in another one, or beyond zero, the friction of the
whole step is found again, as an impulse in the cone opposite to the velocity at its end: that is Moreau's step, of
first order, for all contacts together.
"""

from __future__ import annotations

from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.codes import PULL
from mbd.kernel.contact.cone_contacts import all_hold
from mbd.kernel.contact.cone_turns import STABLE, estimated_turn_rate
from mbd.kernel.contact.cones import HELD, aim, along, pull_of_both
from mbd.kernel.contact.contact_modes import STILL
from mbd.kernel.records import Balance, Frictions, Guards, Reals, Switching
from mbd.kernel.stepping.restart import evaluate, evaluate_loaded, largest_force, limit_of

__all__ = ["hold_all", "hold_for_step", "hold_together", "keep_within", "release_both", "turned_in_plane"]

FAR = 2.0
"""Times of a step in which γ must neither reach zero nor turn by a radian if its direction is to follow it [-]."""
TURNED = 1e-6
"""Sine of the angle by which γ may leave the direction that a step holds [-]."""


def hold_for_step(K: Guards, h: float) -> None:
    """Which directions a step of size h holds; all of them where an explicit scheme would be unstable."""
    for f in range(K.n_frictions):
        p = K.partner[f]
        if p > f and K.slip[f] != 0.0:
            x = K.guards0[K.at_slip + f]
            y = K.guards0[K.at_slip + p]
            ax = K.guards0[K.at_slip_rate + f]
            ay = K.guards0[K.at_slip_rate + p]
            held = FAR * h * sqrt(ax * ax + ay * ay) > sqrt(x * x + y * y)
            K.hold[f] = K.hold[p] = HELD if held else 0.0
    if K.explicit == 1 and h * estimated_turn_rate(K) > STABLE:
        hold_all(K)


def hold_all(K: Frictions) -> bool:
    """Hold all directions in the step that is tried again, where a slow γ turned too fast for it; whether any did not.

    The friction of a step that ends in other directions is found again as an impulse, whatever its size.
    """
    found = False
    for f in range(K.n_frictions):
        if K.partner[f] >= 0 and K.slip[f] != 0.0 and K.hold[f] != HELD:
            K.hold[f] = HELD
            found = True
    return found


def turned_in_plane(K: Guards, f: int) -> bool:
    """Whether friction f and its partner end a step in another direction than they held, beyond zero, or at rest."""
    p = K.partner[f]
    x = K.guards1[K.at_slip + f]
    y = K.guards1[K.at_slip + p]
    forward = along(K, f, x, y)
    if K.hold[f] != HELD:
        return forward < -STILL
    return bool(forward <= STILL or abs(K.slip[f] * y - K.slip[p] * x) > TURNED * forward)


def release_both(K: Switching, f: int, least: float) -> int:
    """1 if friction f and its partner stick beyond their limit at the candidate: they slide as they were pulled."""
    p = K.partner[f]
    if K.n_repeats == 0:
        K.let_go[f] = K.let_go[p] = 0
    if K.sticks[f] == 0 or pull_of_both(K, f, K.lam1) - K.guards1[K.at_limit + f] <= least:
        return 0
    K.sticks[f] = K.sticks[p] = 0
    K.let_go[f] = K.let_go[p] = 1
    aim(K, f, K.lam1[K.friction_row[f]], K.lam1[K.friction_row[p]])
    return 1


def hold_together(K: Switching, t1: float, force: float) -> bool:
    """Whether contacts that depend on each other hold although multipliers of least norm pull or leave a cone."""
    if K.n_dropped == 0:
        return False
    K.limit[: K.n_frictions] = K.guards1[K.at_limit : K.at_limit + K.n_frictions]
    return not is_within(K, K.lam1, PULL * force) and all_hold(K, t1)


def keep_within(K: Balance) -> None:
    """After a restart: where multipliers of least norm pull or leave a cone, those by which it was decided stay.

    They are still in K.impulse.
    """
    if K.n_dropped == 0:
        return
    evaluate(K, K.time, K.q, K.y)
    evaluate_loaded(K, K.lam)
    for f in range(K.n_frictions):
        K.limit[f] = limit_of(K, f)
    if not is_within(K, K.lam, PULL * largest_force(K)):
        K.lam[: K.n_rows] = K.impulse[: K.n_rows]


def is_within(K: Frictions, lam: Reals, least: float) -> bool:
    """Whether no contact that opens on pull pulls, and no friction sticks beyond its limit, by these multipliers."""
    within = True
    for c in range(K.n_contacts):
        if K.kind[c] == 0 and K.closed[c] == 1 and K.opens[c] == 0 and lam[K.normal[c]] > least:
            within = False
    for f in range(K.n_frictions):
        if K.sticks[f] == 1 and pull_of_both(K, f, lam) - K.limit[f] > least:
            within = False
    return within
