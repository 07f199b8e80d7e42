"""Directions in which frictions in a plane or in space slide, as sliding begins and in impacts: parts of the solution.

λ_T = limit e with ‖e‖ = 1, and e is the direction of the velocity (or acceleration) γ that comes of it. Each e is
projected, ``e ← (limit e + ρ γ)/‖…‖`` with ρ the mass that the point has (Alart & Curnier 1991), until Newton's method
on the angles continues, ``γ × e = 0``, with slopes by differences: what γ is follows linearly from λ_T. A direction in
a plane turns by one angle, a direction in space by two.
"""

from mbd.equal import SMALL_SUM_RTOL
from mbd.kernel.algebra.linear import factor, solve
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.contact.branches import is_on, solve_directed
from mbd.kernel.contact.cones import aim, aim_along, leads_group
from mbd.kernel.records import Balance, ContactForces, ContactRows

DIFFERENCE_ANGLE = 1e-6
"""Angle by whose effect slopes are measured [rad]."""
MAX_TURN = 0.5
"""Most that a step of Newton's method turns [rad]."""
MAX_GROUP_SIZE = 3
"""Frictions that slide together, at most: those of a ball joint [-]."""


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
    """How far the velocity (acceleration) of the group of f is from pointing the way in which it slides."""
    size = 0.0
    forward = 0.0
    square = 0.0
    for g in range(f, f + K.group_size[f]):
        value = gained(K, K.friction_row[g])
        size = max(size, terms(K, K.friction_row[g]))
        forward += K.slip[g] * value
        for h in range(g + 1, f + K.group_size[f]):
            turned = K.slip[g] * gained(K, K.friction_row[h]) - K.slip[h] * value
            square += turned * turned
    return float(max(-forward, sqrt(square)) - tolerance * size)


def fill_tangents(K: ContactForces, f: int, i: int) -> int:
    """Unit vectors across the direction of the group of f into K.cone_across, of unknowns i and on; the next unknown.

    In a plane that is one. In space both are columns of the reflection that takes the largest axis to the direction.
    """
    m = K.group_size[f]
    largest = 0
    for k in range(m):
        if abs(K.slip[f + k]) > abs(K.slip[f + largest]):
            largest = k
    sign = 1.0 if K.slip[f + largest] > 0.0 else -1.0
    if m == 2:
        K.cone_across[MAX_GROUP_SIZE * i] = -K.slip[f + 1]
        K.cone_across[MAX_GROUP_SIZE * i + 1] = K.slip[f]
        K.cone_who[i] = f
        return i + 1
    for k in range(m):
        if k == largest:
            continue
        part = K.slip[f + k] / (1.0 + abs(K.slip[f + largest]))
        for j in range(m):
            beside = K.slip[f + j] + (sign if j == largest else 0.0)
            K.cone_across[MAX_GROUP_SIZE * i + j] = (1.0 if j == k else 0.0) - part * beside
        K.cone_who[i] = f
        i += 1
    return i


def find_misses(K: ContactForces, count: int) -> float:
    """Parts of γ across the direction of each group into K.cone_miss; the largest over its terms, 1 for γ backwards.

    Where a direction has turned from the one that K.cone_across belongs to, these are projected.
    """
    worst = 0.0
    for i in range(count):
        f = K.cone_who[i]
        size = 0.0
        forward = 0.0
        leaned = 0.0
        miss = 0.0
        for k in range(K.group_size[f]):
            value = gained(K, K.friction_row[f + k])
            size = max(size, terms(K, K.friction_row[f + k]))
            forward += K.slip[f + k] * value
            leaned += K.slip[f + k] * K.cone_across[MAX_GROUP_SIZE * i + k]
            miss += K.cone_across[MAX_GROUP_SIZE * i + k] * value
        K.cone_miss[i] = miss - leaned * forward
        worst = max(worst, abs(K.cone_miss[i]) / (size + 1e-300))
        if forward < -SMALL_SUM_RTOL * size:
            worst = max(worst, 1.0)
    return worst


def mass_of(K: ContactRows, f: int) -> float:
    """What a force along the group of f meets if nothing else holds, 1/(B M⁻¹ Bᵀ), of the mean of its directions."""
    ease = 0.0
    for g in range(f, f + K.group_size[f]):
        row = K.friction_row[g]
        for j in range(K.n):
            slope = K.acc[K.acc_B + row * K.n + j]
            ease += slope * slope / K.acc[j * K.n + j] if K.acc[j * K.n + j] > 0.0 else 0.0
    return K.group_size[f] / ease if ease > 0.0 else 0.0


def project(K: ContactForces, count: int) -> None:
    """Each direction towards that of its γ."""
    for i in range(count):
        f = K.cone_who[i]
        if i > 0 and K.cone_who[i - 1] == f:
            continue
        weight = mass_of(K, f)
        largest = 0.0
        for g in range(f, f + K.group_size[f]):
            K.cone_kept[g] = K.limit[f] * K.slip[g] + weight * gained(K, K.friction_row[g])
            largest = max(largest, abs(K.cone_kept[g]))
        if largest > 0.0:
            aim_along(K, f, K.cone_kept, 0)


def turn_by(K: ContactForces, i: int, angle: float) -> None:
    """Turn a direction across itself, by unknown i; to second order, for small angles exactly enough."""
    f = K.cone_who[i]
    for k in range(K.group_size[f]):
        K.slip[f + k] += angle * K.cone_across[MAX_GROUP_SIZE * i + k]
    aim(K, f)


def keep_directions(K: ContactForces, out: bool) -> None:
    """Directions into K.cone_kept, or back."""
    for f in range(K.n_frictions):
        if K.group_size[f] > 1 and K.slip[f] != 0.0:
            if out:
                K.cone_kept[f] = K.slip[f]
            else:
                K.slip[f] = K.cone_kept[f]
                K.lean[f] = K.slip[f]


def newton_turns(K: Balance, level: int, count: int) -> int:
    """The angles by which γ × e = 0 as its slopes tell, into K.cone_turn; a status."""
    for i in range(count):
        K.cone_turn[i] = -K.cone_miss[i]
    keep_directions(K, True)
    for j in range(count):
        turn_by(K, j, DIFFERENCE_ANGLE)
        status = solve_directed(K, level)
        if status != 0:
            return status
        find_misses(K, count)
        for i in range(count):
            K.cone_slope[i * count + j] = (K.cone_miss[i] + K.cone_turn[i]) / DIFFERENCE_ANGLE
        keep_directions(K, False)
    if factor(K.cone_slope, count, K.side_pivots) != 0:
        K.cone_turn[:count] = 0.0
        return 0
    solve(K.cone_slope, count, K.side_pivots, K.cone_turn)
    return 0


def gather(K: ContactForces) -> int:
    """Directions of groups that slide and may choose, into K.cone_who and K.cone_across; how many unknown angles."""
    count = 0
    for f in range(K.n_frictions):
        if leads_group(K, f) and K.loose[f] > 0 and K.sticks[f] == 0 and is_on(K, f):
            count = fill_tangents(K, f, count)
    return count


def measure_misses(K: ContactForces) -> float:
    """The largest miss of the present directions."""
    return find_misses(K, gather(K))


def turn_directions(K: Balance, level: int) -> int:
    """Turn the directions of all groups that slide and may choose until γ points along them; a status.

    Where none are found the last ones stay, and who judges the branches sees that γ misses them.
    """
    count = gather(K)
    if count == 0:
        return 0
    best = find_misses(K, count)
    for turn in range(60):  # rounds in which directions are looked for
        if best <= SMALL_SUM_RTOL:
            return 0
        by_newton = turn >= 3 and turn % 4 != 3  # three projections come before Newton's method
        if by_newton:
            status = newton_turns(K, level, count)
            if status != 0:
                return status
            for i in range(count):
                turn_by(K, i, max(min(K.cone_turn[i], MAX_TURN), -MAX_TURN))
        else:
            project(K, count)
        status = solve_directed(K, level)
        if status != 0:
            return status
        now = measure_misses(K)
        if by_newton and now >= best:
            if best <= 1e3 * SMALL_SUM_RTOL:
                keep_directions(K, False)
                return int(solve_directed(K, level))
            if now > best:
                keep_directions(K, False)
                status = solve_directed(K, level)
                if status != 0:
                    return status
                now = measure_misses(K)
        best = now
    return 0
