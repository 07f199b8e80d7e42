"""Which way contacts in space slide where that follows from the solution itself: as sliding begins, and in impacts.

λ_T = limit e with ‖e‖ = 1, and e is the direction of the velocity (or acceleration) γ that comes of it. Each e is
projected, ``e ← (limit e + ρ γ)/‖…‖`` with ρ the mass that the point has (Alart & Curnier 1991), until Newton's method
on the angles goes on, ``γ × e = 0``, with slopes by differences: what γ is follows linearly from λ_T.
"""

from __future__ import annotations

from mbd.kernel.algebra.linear import factor, solve
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.contact.branches import is_on, solve_directed
from mbd.kernel.contact.cones import aim, follows
from mbd.kernel.records import Balance, ContactForces, ContactRows, Frictions

__all__ = ["mass_of", "misses", "turn_directions"]

EXACT = 1e-14
"""γ × e over its terms that is round-off [-]."""
SMALL_TURN = 1e-6
"""Angle by whose effect slopes are measured [rad]."""
LARGEST_TURN = 0.5
"""Most that a step of Newton's method turns [rad]."""


def gained(K: ContactForces, row: int) -> float:
    """B w + bias of a row."""
    value = K.bias[row]
    for j in range(K.n):
        value += K.acc[K.acc_B + row * K.n + j] * K.jump[j]
    return float(value)


def terms(K: ContactForces, row: int) -> float:
    """Size of what B w + bias of a row is made of."""
    size = abs(K.bias[row])
    for j in range(K.n):
        size = max(size, abs(K.acc[K.acc_B + row * K.n + j]) * max(abs(K.jump[j]), K.typical[j]))
    return float(size)


def misses(K: ContactForces, f: int, tolerance: float) -> float:
    """How far the velocity (acceleration) of f and its partner is from pointing the way in which they slide."""
    p = K.partner[f]
    x = gained(K, K.friction_row[f])
    y = gained(K, K.friction_row[p])
    size = max(terms(K, K.friction_row[f]), terms(K, K.friction_row[p]))
    back = -(K.slip[f] * x + K.slip[p] * y)
    off = abs(K.slip[f] * y - K.slip[p] * x)
    return float(max(back, off) - tolerance * size)


def find_misses(K: ContactForces, count: int) -> float:
    """γ × e of each pair into K.cone_miss; the largest over its terms, and one where γ points backwards."""
    worst = 0.0
    for i in range(count):
        f = K.cone_who[i]
        p = K.partner[f]
        x = gained(K, K.friction_row[f])
        y = gained(K, K.friction_row[p])
        size = max(terms(K, K.friction_row[f]), terms(K, K.friction_row[p]))
        K.cone_miss[i] = K.slip[f] * y - K.slip[p] * x
        worst = max(worst, abs(K.cone_miss[i]) / (size + 1e-300))
        if K.slip[f] * x + K.slip[p] * y < -EXACT * size:
            worst = max(worst, 1.0)
    return worst


def mass_of(K: ContactRows, f: int) -> float:
    """What a force along f and its partner meets if nothing else holds, 1/(B M⁻¹ Bᵀ) of both."""
    ease = 0.0
    for turn in range(2):
        row = K.friction_row[f] if turn == 0 else K.friction_row[K.partner[f]]
        for j in range(K.n):
            slope = K.acc[K.acc_B + row * K.n + j]
            ease += 0.5 * slope * slope / K.acc[j * K.n + j] if K.acc[j * K.n + j] > 0.0 else 0.0
    return 1.0 / ease if ease > 0.0 else 0.0


def project(K: ContactForces, count: int) -> None:
    """Each direction towards that of its γ."""
    for i in range(count):
        f = K.cone_who[i]
        p = K.partner[f]
        weight = mass_of(K, f)
        x = K.limit[f] * K.slip[f] + weight * gained(K, K.friction_row[f])
        y = K.limit[f] * K.slip[p] + weight * gained(K, K.friction_row[p])
        if sqrt(x * x + y * y) > 0.0:
            aim(K, f, x, y)


def turn_by(K: Frictions, f: int, angle: float) -> None:
    """Turn the direction of f and its partner; to second order, for small angles exactly enough."""
    p = K.partner[f]
    aim(K, f, K.slip[f] - angle * K.slip[p], K.slip[p] + angle * K.slip[f])


def keep_directions(K: ContactForces, count: int, out: bool) -> None:
    """Directions into K.cone_kept, or back."""
    for i in range(count):
        f = K.cone_who[i]
        p = K.partner[f]
        if out:
            K.cone_kept[2 * i] = K.slip[f]
            K.cone_kept[2 * i + 1] = K.slip[p]
        else:
            aim(K, f, K.cone_kept[2 * i], K.cone_kept[2 * i + 1])


def newton_turns(K: Balance, level: int, count: int) -> int:
    """The angles by which γ × e = 0 as its slopes tell, into K.cone_turn; a status."""
    for i in range(count):
        K.cone_turn[i] = -K.cone_miss[i]
    keep_directions(K, count, True)
    for j in range(count):
        turn_by(K, K.cone_who[j], SMALL_TURN)
        status = solve_directed(K, level)
        if status != 0:
            return status
        find_misses(K, count)
        for i in range(count):
            K.cone_slope[i * count + j] = (K.cone_miss[i] + K.cone_turn[i]) / SMALL_TURN
        keep_directions(K, count, False)
    if factor(K.cone_slope, count, K.cone_pivots) != 0:
        K.cone_turn[:count] = 0.0
        return 0
    solve(K.cone_slope, count, K.cone_pivots, K.cone_turn)
    return 0


def gather(K: ContactForces) -> int:
    """Pairs that slide and may choose, into K.cone_who; how many."""
    count = 0
    for f in range(K.n_frictions):
        if K.partner[f] >= 0 and not follows(K, f) and K.loose[f] > 0 and K.sticks[f] == 0 and is_on(K, f):
            K.cone_who[count] = f
            count += 1
    return count


def turn_directions(K: Balance, level: int) -> int:
    """Turn the directions of all pairs that slide and may choose until γ points along them; a status.

    Where none are found the last ones stay, and who judges the branches sees that γ misses them.
    """
    count = gather(K)
    if count == 0:
        return 0
    best = find_misses(K, count)
    for turn in range(60):  # rounds in which directions are looked for
        if best <= EXACT:
            return 0
        by_newton = turn >= 3 and turn % 4 != 3  # three projections come before Newton's method
        if by_newton:
            status = newton_turns(K, level, count)
            if status != 0:
                return status
            for i in range(count):
                turn_by(K, K.cone_who[i], max(min(K.cone_turn[i], LARGEST_TURN), -LARGEST_TURN))
        else:
            project(K, count)
        status = solve_directed(K, level)
        if status != 0:
            return status
        now = find_misses(K, count)
        if by_newton and now >= best:
            if best <= 1e3 * EXACT:
                keep_directions(K, count, False)
                return int(solve_directed(K, level))
            if now > best:
                keep_directions(K, count, False)
                status = solve_directed(K, level)
                if status != 0:
                    return status
                now = find_misses(K, count)
        best = now
    return 0
