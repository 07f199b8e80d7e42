"""Contacts with Coulomb's law as one problem of complementarity over cones.

Velocities (or accelerations) follow impulses (forces) linearly, ``w = G z + shift``, and

normal       ``0 ≤ w_n ⟂ z_n ≥ 0``, or ``w_n = 0`` of a contact that is held
tangent      ``‖z_t‖ ≤ L = max(0, limit + slope z_n)``; ``w_t = 0``, or ``z_t = −L w_t/‖w_t‖`` where it slides

which is Coulomb's law itself: a contact that slides is not lifted, as it would be by the dual cone without De Saxcé's
correction. In terms of ``y = z − ρ w``, ρ the inverse of the diagonal of G, these are the equations (Alart & Curnier
1991, Comput. Methods Appl. Mech. Eng. 92:353)

``F_n = z_n − max(0, y_n) = 0``,  ``F_t = z_t − proj_{‖·‖ ≤ L} y_t = 0``

which a semismooth Newton method with line search solves; by turns with it, and where F does not fall, go projected
Gauss–Seidel sweeps. Where this does not lead to a solution, slopes grow from zero to what they are, in parts.
G may be singular, as where there are more contacts than motions. First each is taken as a little soft, so that
impulses are the same in any order of contacts and close to those of least norm; from there the rigid problem is
solved, with ε on the diagonal, which keeps steps small along what is undetermined.
"""

from mbd.equal import ROUND_OFF_RTOL
from mbd.kernel.algebra.linear import factor, solve
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.codes import EPS
from mbd.kernel.records import Integers, Reals

PUSH, EQUAL, STEADY = -1, -2, -3
"""In `owner`: a contact that pushes, one that is held, and friction whose limit no unknown changes."""
CONE_RTOL = 1e-10
"""Largest ‖F‖ that counts as solved, of the impulses that each contact would have without others."""
CONE_ULPS = 64.0
"""Round-off of ‖F‖, in units of the last place of the largest impulse [-]."""
CONE_FLOOR = 1e-15
"""‖F‖ of the largest impulse below which there is nothing to gain."""
CONE_COMPLIANCE = 1e-7
"""Velocity by which a soft contact gives way to its impulse, of the least that any contact alone does."""
CONE_REGULARIZATION = 1e-9
"""ε, where the diagonal of the equations is 1."""


def cone_places(n: int) -> int:
    """Places that `cone_solve` needs in `work`."""
    return n * (n + 6) + 3


def cone_solve(
    G: Reals, n: int, shift: Reals, z: Reals, owner: Integers, twin: Integers, limit: Reals, slope: Reals, work: Reals,
    pivots: Integers,
) -> int:  # fmt: skip
    """Solve for z from where it is: 0, or 1 where ‖F‖ over `cone_size` stays above `CONE_RTOL`.

    Parameters
    ----------
    G : (n n) row-major; shift : (n)
    z : (n) a start, then the solution; among all that were met the one with the least ‖F‖
    owner : (n) of a tangent the number of its normal; else PUSH, EQUAL or STEADY
    twin : (n) of an unknown that slides with others the next of them, of the last the first; −1 for one alone
    limit, slope : (n) of tangents; slope < 0: no limit while the contact pushes
    work : of `cone_places(n)` places, ‖F‖ then in the first; pivots : (n)
    """
    size = cone_metric(G, n, shift, twin, work)
    best = 1e300
    parts = 1
    least = 1e300
    for u in range(n):
        if work[n * n + 2 * n + u] > 0.0:
            least = min(least, 1.0 / work[n * n + 2 * n + u])
    for growth in range(4):  # ways to grow: friction at once, in 8 parts, in 32, in 128
        if not (size < 1e300 and best > CONE_RTOL):
            break
        if growth > 0:
            z[:n] = 0.0
            parts *= 8 if growth == 1 else 4
        for part in range(parts):
            work[n * (n + 6)] = (part + 1.0) / parts
            work[n * (n + 6) + 2] = CONE_COMPLIANCE * least
            if part == 0:
                cone_iterate(G, n, shift, z, owner, twin, limit, slope, work, pivots, size)
            work[n * (n + 6) + 2] = 0.0
            best = cone_iterate(G, n, shift, z, owner, twin, limit, slope, work, pivots, size)
    work[0] = best
    return 0 if best <= CONE_RTOL else 1


def cone_iterate(
    G: Reals, n: int, shift: Reals, z: Reals, owner: Integers, twin: Integers, limit: Reals, slope: Reals, work: Reals,
    pivots: Integers, size: float,
) -> float:  # fmt: skip
    """Newton steps and sweeps from z; ‖F‖ of the largest impulse where it was least, which is where z is left."""
    o_best = n * n + 3 * n
    best = cone_faults(G, n, shift, z, owner, twin, limit, slope, work) / cone_size(n, z, size)
    work[o_best : o_best + n] = z[:n]
    for turn in range(48):  # Newton steps and blocks of sweeps
        if best <= CONE_FLOOR:
            break
        moved = False
        if turn % 6 != 0 or (turn > 0 and best <= CONE_RTOL):
            moved = cone_newton(G, n, shift, z, owner, twin, limit, slope, work, pivots, turn % 6 == 1)
        if not moved:
            if turn > 0 and best <= CONE_RTOL:
                break
            cone_sweep(G, n, shift, z, owner, twin, limit, slope, work, 1.0 / (1.0 + turn // 6 % 7))
        now = cone_faults(G, n, shift, z, owner, twin, limit, slope, work) / cone_size(n, z, size)
        if now < best:
            last = best
            best = now
            work[o_best : o_best + n] = z[:n]
            if best <= 1e-3 * CONE_RTOL and best > 0.5 * last:
                break
        elif best <= 1e-2 * CONE_RTOL:
            break
    z[:n] = work[o_best : o_best + n]
    return best


def cone_size(n: int, z: Reals, size: float) -> float:
    """What ‖F‖ is compared with: impulses that would be without others, beside the round-off of those that there are.

    Where nothing solves the problem, as where friction jams what is to rebound, z grows without end and F does not.
    """
    largest = 0.0
    for u in range(n):
        largest = max(largest, abs(z[u]))
    return size + CONE_ULPS * EPS / CONE_RTOL * largest + 1e-300


def cone_metric(G: Reals, n: int, shift: Reals, twin: Integers, work: Reals) -> float:
    """ρ of each unknown, equal for all that slide together; returns the largest ρ |shift|, or more than 1e300."""
    o_rho = n * n + 2 * n
    total = 0.0
    largest = 0.0
    for k in range(n * n):
        total += abs(G[k])
    for u in range(n):
        total += abs(shift[u])
        largest = max(largest, G[u * n + u])
    if not total < 1e300:
        return 1e301
    size = 0.0
    work[n * (n + 6) + 1] = 1.0 / largest if largest > 0.0 else 1.0
    for u in range(n):
        slack = G[u * n + u]
        if twin[u] >= 0:
            v = twin[u]
            count = 1
            while v != u:
                slack += G[v * n + v]
                count += 1
                v = twin[v]
            slack /= count
        work[o_rho + u] = 1.0 / slack if slack > ROUND_OFF_RTOL * largest else 0.0
        size = max(size, abs(work[o_rho + u] * shift[u]))
    return size


def cone_limit(n: int, z: Reals, owner: Integers, limit: Reals, slope: Reals, work: Reals, u: int) -> float:
    """L of a tangent, with as much of its slope as friction has grown to."""
    push = z[owner[u]] if owner[u] >= 0 else 0.0
    return float(max(limit[u] + work[n * (n + 6)] * slope[u] * max(push, 0.0), 0.0))


def cone_sticks(n: int, z: Reals, owner: Integers, work: Reals, u: int) -> bool:
    """Whether the contact of a tangent without limit pushes."""
    o_w = n * n + n
    p = owner[u]
    return bool(p < 0 or owner[p] == EQUAL or z[p] - work[o_w + n + p] * work[o_w + p] > 0.0)


def cone_faults(
    G: Reals, n: int, shift: Reals, z: Reals, owner: Integers, twin: Integers, limit: Reals, slope: Reals, work: Reals
) -> float:
    """w and F at z into `work`; the largest |F|."""
    o_F = n * n
    o_w = o_F + n
    o_rho = o_w + n
    for u in range(n):
        value = shift[u] + work[n * (n + 6) + 2] * z[u]
        for j in range(n):
            value += G[u * n + j] * z[j]
        work[o_w + u] = value
    worst = 0.0
    for u in range(n):
        step = work[o_rho + u] * work[o_w + u]
        if work[o_rho + u] == 0.0:
            work[o_F + u] = z[u]
            if owner[u] == PUSH or owner[u] == EQUAL:  # what no impulse changes must hold by itself
                missed = -work[o_w + u] if owner[u] == PUSH else abs(work[o_w + u])
                worst = max(worst, missed * work[n * (n + 6) + 1])
        elif owner[u] == PUSH:
            work[o_F + u] = min(z[u], step)
        elif owner[u] == EQUAL:
            work[o_F + u] = step
        elif slope[u] < 0.0:
            work[o_F + u] = step if cone_sticks(n, z, owner, work, u) else z[u]
        else:
            y = z[u] - step
            far = cone_length(n, z, twin, work, u, 1.0)
            most = cone_limit(n, z, owner, limit, slope, work, u)
            work[o_F + u] = step if far <= most else z[u] - most * (y / far)
        worst = max(worst, abs(work[o_F + u]))
    return worst


def cone_length(n: int, z: Reals, twin: Integers, work: Reals, u: int, share: float) -> float:
    """‖z − ρ w‖ of all that slide together with u, with this share of ρ; w is in `work`."""
    o_w = n * n + n
    o_rho = o_w + n
    y = z[u] - share * work[o_rho + u] * work[o_w + u]
    square = y * y
    v = twin[u]
    while v >= 0 and v != u:
        other = z[v] - share * work[o_rho + v] * work[o_w + v]
        square += other * other
        v = twin[v]
    return sqrt(square)


def cone_sweep(
    G: Reals, n: int, shift: Reals, z: Reals, owner: Integers, twin: Integers, limit: Reals, slope: Reals, work: Reals,
    share: float,
) -> None:  # fmt: skip
    """Sweeps over all contacts, each projected onto its law as the others are; w is in `work`.

    Along the tangents only the `share` of ρ is taken: less goes slower, but with large friction does not go in circles.
    """
    for _ in range(12):  # sweeps in a block
        for u in range(n):
            cone_project(G, n, z, owner, twin, limit, slope, work, share, u)


def cone_project(
    G: Reals, n: int, z: Reals, owner: Integers, twin: Integers, limit: Reals, slope: Reals, work: Reals, share: float,
    u: int,
) -> None:  # fmt: skip
    """One unknown, or with the first of several that slide together all of them, onto its law; w follows."""
    o_w = n * n + n
    o_rho = o_w + n
    v = twin[u]
    while v >= 0 and v != u:
        if v < u:
            return
        v = twin[v]
    step = share if owner[u] >= 0 else 1.0
    y = z[u] - step * work[o_rho + u] * work[o_w + u]
    part = 1.0
    if work[o_rho + u] == 0.0:
        part = 0.0
    elif owner[u] == PUSH:
        part = 1.0 if y > 0.0 else 0.0
    elif owner[u] != EQUAL and slope[u] < 0.0:
        part = 1.0 if cone_sticks(n, z, owner, work, u) else 0.0
    elif owner[u] != EQUAL:
        most = cone_limit(n, z, owner, limit, slope, work, u)
        far = cone_length(n, z, twin, work, u, step)
        part = 1.0 if far <= most else most / far
    o_change = n * n  # of F, which is found again after the sweeps
    v = u
    while v >= 0:
        work[o_change + v] = part * (z[v] - step * work[o_rho + v] * work[o_w + v]) - z[v]
        z[v] += work[o_change + v]
        v = twin[v] if twin[v] != u else -1
    v = u
    while v >= 0:
        for i in range(n):
            work[o_w + i] += G[i * n + v] * work[o_change + v]
        work[o_w + v] += work[n * (n + 6) + 2] * work[o_change + v]
        v = twin[v] if twin[v] != u else -1


def cone_slopes(
    G: Reals, n: int, z: Reals, owner: Integers, twin: Integers, limit: Reals, slope: Reals, work: Reals
) -> None:
    """∂F/∂z, of the branch that each law is on, with ε on the diagonal."""
    o_w = n * n + n
    o_rho = o_w + n
    for u in range(n):
        rho = work[o_rho + u]
        y = z[u] - rho * work[o_w + u]
        far = cone_length(n, z, twin, work, u, 1.0)
        most = cone_limit(n, z, owner, limit, slope, work, u) if owner[u] != PUSH and owner[u] != EQUAL else 0.0
        held = owner[u] == EQUAL or (owner[u] == PUSH and y > 0.0)
        if owner[u] >= 0 and slope[u] < 0.0:
            held = cone_sticks(n, z, owner, work, u)
        elif owner[u] != PUSH and owner[u] != EQUAL:
            held = far <= most
        slides = owner[u] != PUSH and owner[u] != EQUAL and slope[u] >= 0.0 and most > 0.0 and not held
        soft = work[n * (n + 6) + 2]
        for j in range(n):
            work[u * n + j] = rho * G[u * n + j] if held else 0.0
        work[u * n + u] += CONE_REGULARIZATION + (rho * soft if held else 0.0)
        if not held or rho == 0.0:
            work[u * n + u] += 1.0
        if slides and rho > 0.0:
            cosine = y / far
            if owner[u] >= 0 and z[owner[u]] > 0.0:
                work[u * n + owner[u]] -= cosine * work[n * (n + 6)] * slope[u]
            v = u if twin[u] >= 0 else -1
            while v >= 0:
                other = z[v] - work[o_rho + v] * work[o_w + v]
                part = most / far * ((1.0 if v == u else 0.0) - cosine * (other / far))
                for j in range(n):
                    work[u * n + j] += part * work[o_rho + v] * G[v * n + j]
                work[u * n + v] += part * (work[o_rho + v] * soft - 1.0)
                v = twin[v] if twin[v] != u else -1


def cone_newton(
    G: Reals, n: int, shift: Reals, z: Reals, owner: Integers, twin: Integers, limit: Reals, slope: Reals, work: Reals,
    pivots: Integers, freely: bool,
) -> bool:  # fmt: skip
    """One step of Newton's method with line search on ‖F‖², but `freely`; false, with z as it was, where it is none."""
    o_F = n * n
    o_step = o_F + 4 * n
    o_old = o_step + n
    before = 0.0
    for u in range(n):
        before += work[o_F + u] * work[o_F + u]
    cone_slopes(G, n, z, owner, twin, limit, slope, work)
    if factor(work, n, pivots) != 0:
        return False
    for u in range(n):
        work[o_old + u] = z[u]
        z[u] = -work[o_F + u]
    solve(work, n, pivots, z)
    for u in range(n):
        work[o_step + u] = z[u]
    part = 1.0
    for _ in range(5):
        for u in range(n):
            z[u] = work[o_old + u] + part * work[o_step + u]
        cone_faults(G, n, shift, z, owner, twin, limit, slope, work)
        after = 0.0
        for u in range(n):
            after += work[o_F + u] * work[o_F + u]
        if freely or after <= (1.0 - 0.1 * part) * before:
            return True
        part *= 0.4
    z[:n] = work[o_old : o_old + n]
    cone_faults(G, n, shift, z, owner, twin, limit, slope, work)
    return False
