"""How fast friction in a plane or in space turns the direction in which it slides."""

from __future__ import annotations

from mbd.kernel.algebra.linear import factor, solve
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.contact.cone_directions import MAX_GROUP_SIZE, fill_tangents, mass_of
from mbd.kernel.contact.cones import HELD, leads_group, product_of, speed_of
from mbd.kernel.contact.contact_modes import STILL
from mbd.kernel.records import Balance, ContactForces, Switching
from mbd.kernel.stepping.restart import evaluate

__all__ = ["STABLE", "estimated_turn_rate"]

STABLE = 2.0
"""Step times the estimated rate at which friction turns directions that explicit schemes take [-].

Beyond 2.785 that of order 4 lets what is across the direction grow from round-off until γ has turned away.
"""
SOON = 100.0
"""Steps before it comes to rest from which on a motion that slows down is looked at [-]."""


def estimated_turn_rate(K: Switching) -> float:
    """Estimated rate [1/s] at which friction turns γ that it does not point along, Σ limit λ/(‖γ‖ + s).

    λ is that of B M⁻¹ Bᵀ across the direction (see `ease_across`); that pushes follow the direction is left out. The
    rate is large where γ is small, just after sliding has begun and before it ends: an explicit scheme must follow it.
    """
    rate = 0.0
    evaluated = False
    for f in range(K.n_frictions):
        if leads_group(K, f) and K.slip[f] != 0.0 and K.hold[f] != HELD:
            gain = product_of(K, f, K.guards0, K.at_slip, K.at_slip_rate)
            speed = speed_of(K, f, K.guards0, K.at_slip)
            change = speed_of(K, f, K.guards0, K.at_slip_rate)
            if gain < 0.0 and speed > STILL and speed > SOON * change * K.dt:  # it slows down, and is still fast
                continue
            if not evaluated:
                evaluate(K, K.time, K.q, K.y)
                evaluated = True
            speed += 4.0 * K.hold[f]
            if speed > 0.0:
                rate += K.guards0[K.at_limit + f] * ease_across(K, f) / speed
    return rate


def ease_across(K: Balance, f: int) -> float:
    """What a force across the direction of the group of f gains: of a ball joint the largest eigenvalue λ.

    Of a contact, other corners of whose foot may hold, which makes λ far too large, the mean by the diagonal of M; true
    rates were found up to 1.24 times those that follow from it.
    """
    if K.group_size[f] == 2:
        mass = mass_of(K, f)
        return 1.0 / mass if mass > 0.0 else 0.0
    for i in range(K.n * K.n):
        K.kkt[i] = K.acc[i]
    return largest_ease(K, f) if factor(K.kkt, K.n, K.pivots) == 0 else 0.0


def largest_ease(K: Balance, f: int) -> float:
    """The largest eigenvalue of B M⁻¹ Bᵀ across the direction of the group of f; M is factored in K.kkt."""
    fill_tangents(K, f, 0)
    first = ease_between(K, f, 0, 0)
    second = ease_between(K, f, 1, 1)
    mixed = ease_between(K, f, 0, 1)
    half = 0.5 * (first - second)
    return 0.5 * (first + second) + sqrt(half * half + mixed * mixed)


def ease_between(K: Balance, f: int, i: int, j: int) -> float:
    """t_i B M⁻¹ Bᵀ t_j of the tangents i and j of the group of f."""
    for k in range(K.n):
        K.rhs[k] = row_along(K, f, j, k)
    solve(K.kkt, K.n, K.pivots, K.rhs)
    value = 0.0
    for k in range(K.n):
        value += row_along(K, f, i, k) * K.rhs[k]
    return value


def row_along(K: ContactForces, f: int, i: int, column: int) -> float:
    """Entry `column` of t_i B."""
    value = 0.0
    for g in range(K.group_size[f]):
        row = K.friction_row[f + g]
        value += K.cone_across[MAX_GROUP_SIZE * i + g] * K.acc[K.acc_B + row * K.n + column]
    return value
