"""The branches of contacts and friction by Lemke's method, where changes of single ones have not found them.

Everything that may not choose is held, and the rest solved for: with one solution of the held KKT matrix for each
multiplier that may choose, the velocities (or accelerations) γ of these rows follow

``γ = γ_0 + G z``, ``w = M z + q``, ``0 ≤ w ⟂ z ≥ 0``

with z = (Λ_n | Λ+ | Λ− | s): pushes, friction along and against its direction, and the speed of sliding
(Stewart & Trinkle 1996, Int. J. Numer. Meth. Eng. 39:2673). w = (γ_n | s + γ_T | s − γ_T | limit − Λ+ − Λ−).
What is found are branches only: the caller solves their equations again and judges them.
"""

from __future__ import annotations

from mbd.kernel.lemke import LCP_SOLVED, lemke
from mbd.kernel.linear import factor, solve
from mbd.kernel.records import Balance, ContactForces
from mbd.kernel.redundancy import shared, sharing
from mbd.kernel.restart import active_rows, evaluate_loaded, limit_of, load_accelerations
from mbd.kernel.saddle import solve_at

__all__ = ["factor_held", "pivoted"]

NOTHING = 1e-10
"""Unknowns below this part of the largest of their kind are zero [-]."""


def pivoted(K: Balance, level: int) -> int:
    """1 if Lemke's method has chosen the branches of all that may choose, 0 if it cannot.

    It cannot where friction follows multipliers as that of a pin does or slides in a plane, where a contact that may
    open holds tangents without limit, where held rows and masses alone determine no motion, and where its path ends
    in a ray.
    """
    if K.loaded == 1 or K.n_cones > 0:
        return 0
    pushes = gather_pushes(K)
    if pushes < 0:
        return 0
    drags = gather_drags(K, pushes)
    size = pushes + 3 * drags
    if size == 0:
        return 0
    let_go(K, pushes, drags)
    limits_of_pushes(K, level, pushes, drags)
    held = hold(K, level, pushes, drags)
    if held < 0:
        return 0
    fill_problem(K, held, pushes, drags)
    status = lemke(K.lcp_matrix, size, K.lcp_shift, K.lcp_found, K.lcp_work, K.lcp_basis, 20 * size + 20)
    if status != LCP_SOLVED:
        return 0
    take_branches(K, pushes, drags)
    return 1


def gather_pushes(K: ContactForces) -> int:
    """Contacts that may choose, into K.lcp_who, their normal rows into K.lcp_rows; −1 if one sticks without limit."""
    pushes = 0
    for c in range(K.n_contacts):
        if K.free[c] > 0:
            K.lcp_who[pushes] = c
            K.lcp_rows[pushes] = K.normal[c]
            pushes += 1
    for row in range(K.n_rows):
        c = K.row_contact[row]
        if c >= 0 and K.free[c] == 1 and K.row_normal[row] == 0:
            f = K.row_friction[row]
            if f < 0 or (K.sticks[f] == 1 and K.loose[f] == 0):
                return -1
    return pushes


def gather_drags(K: ContactForces, pushes: int) -> int:
    """Frictions that may choose, behind the contacts."""
    drags = 0
    for f in range(K.n_frictions):
        c = K.friction_contact[f]
        if K.loose[f] > 0 and (c < 0 or K.free[c] == 1 or K.active[c] == 1):
            K.lcp_who[pushes + drags] = f
            K.lcp_rows[pushes + drags] = K.friction_row[f]
            drags += 1
    return drags


def let_go(K: ContactForces, pushes: int, drags: int) -> None:
    """All that may choose is off."""
    for u in range(pushes):
        c = K.lcp_who[u]
        if K.free[c] == 2:
            K.parting[c] = 1
        else:
            K.active[c] = 0
    for u in range(pushes, pushes + drags):
        K.sticks[K.lcp_who[u]] = 0
        K.slip[K.lcp_who[u]] = 0.0


def limits_of_pushes(K: ContactForces, level: int, pushes: int, drags: int) -> None:
    """Limits without the unknown pushes and their slopes, into K.lcp_limit and K.lcp_slope."""
    for k in range(K.n_rows):
        K.loads[k] = (K.given[k] + K.past[k]) if level == 1 else 0.0
    evaluate_loaded(K, K.loads)
    for u in range(drags):
        K.lcp_limit[u] = limit_of(K, K.lcp_who[pushes + u])
    for c in range(K.n_contacts):
        if K.normal[c] >= 0:
            K.loads[K.normal[c]] -= 1.0
    evaluate_loaded(K, K.loads)
    for u in range(drags):
        f = K.lcp_who[pushes + u]
        K.lcp_slope[u] = limit_of(K, f) - K.lcp_limit[u] if K.friction_contact[f] >= 0 else 0.0
    for c in range(K.n_contacts):
        if K.normal[c] >= 0:
            K.loads[K.normal[c]] += 1.0
    evaluate_loaded(K, K.loads)
    if level == 1:  # a force that stays finite has an impulse only over the time of a non-smooth step
        for u in range(drags):
            K.lcp_limit[u] += (K.past_time - 1.0) * K.base_limit[K.lcp_who[pushes + u]]


def hold(K: Balance, level: int, pushes: int, drags: int) -> int:
    """The KKT matrix of the held rows in factors, K.jump and K.impulse without the unknowns; how many rows, −1: none.

    The impulses of a smooth step that friction has had are taken away, so that the unknowns are all of it.
    """
    o_R = K.acc_R
    if level == 0:
        load_accelerations(K)
    else:
        for i in range(K.n):
            K.force[i] = 0.0
            for k in range(K.n_rows):
                K.force[i] += K.acc[o_R + i * K.n_rows + k] * K.given[k] if K.given[k] != 0.0 else 0.0
    for u in range(pushes, pushes + drags):
        row = K.lcp_rows[u]
        for i in range(K.n):
            K.force[i] -= K.acc[o_R + i * K.n_rows + row] * K.past[row]
    return factor_held(K, level)


def factor_held(K: Balance, level: int) -> int:
    """The KKT matrix of all rows that act, in factors, and K.jump and K.impulse with it; how many rows, −1: none.

    Rows that depend on others are not among them.
    """
    o_R = K.acc_R
    m = active_rows(K, K.active)
    K.n_dropped = 0
    if solve_at(K, m, level) != 0:
        return -1
    held = 0
    for k in range(m):
        if K.n_dropped == 0 or K.dropped[K.rows[k]] == 0:
            K.rows[held] = K.rows[k]
            held += 1
    n = K.n
    size = n + held
    together = sharing(K)
    K.kkt[: size * size] = 0.0
    for i in range(n):
        K.kkt[i * size : i * size + n] = K.acc[i * n : i * n + n]
        for k in range(held):
            K.kkt[i * size + n + k] = K.acc[o_R + i * K.n_rows + K.rows[k]]
            if together:
                K.kkt[i * size + n + k] += shared(K, i, K.rows[k])
            K.kkt[(n + k) * size + i] = K.acc[K.acc_B + K.rows[k] * n + i]
    return held if factor(K.kkt, size, K.pivots) == 0 else -1


def fill_problem(K: Balance, held: int, pushes: int, drags: int) -> None:
    """M and q, column by column, of unit pushes and drags."""
    n = K.n
    size = pushes + 3 * drags
    K.lcp_matrix[: size * size] = 0.0
    for i in range(pushes + drags):
        row = K.lcp_rows[i]
        value = K.bias[row]
        for j in range(n):
            value += K.acc[K.acc_B + row * n + j] * K.jump[j]
        K.lcp_shift[i] = value
        if i >= pushes:
            K.lcp_shift[i + drags] = -value
            f = i - pushes
            normal = normal_of(K, i)
            push = -K.impulse[normal] if normal >= 0 else 0.0
            K.lcp_shift[i + 2 * drags] = K.lcp_limit[f] + K.lcp_slope[f] * push
    for j in range(pushes + drags):
        for i in range(n):
            K.rhs[i] = K.acc[K.acc_R + i * K.n_rows + K.lcp_rows[j]]
        K.rhs[n : n + held] = 0.0
        solve(K.kkt, n + held, K.pivots, K.rhs)
        fill_column(K, j, 1.0, held, pushes, drags)
        if j >= pushes:
            fill_column(K, j + drags, -1.0, held, pushes, drags)
            friction = j + 2 * drags
            K.lcp_matrix[j * size + friction] = 1.0
            K.lcp_matrix[(j + drags) * size + friction] = 1.0
            K.lcp_matrix[friction * size + j] -= 1.0
            K.lcp_matrix[friction * size + j + drags] -= 1.0


def normal_of(K: ContactForces, u: int) -> int:
    """The row by which friction u of the unknowns is loaded, −1 if none."""
    c = K.friction_contact[K.lcp_who[u]]
    return int(K.normal[c]) if c >= 0 else -1


def fill_column(K: Balance, column: int, sign: float, held: int, pushes: int, drags: int) -> None:
    """What an unknown does to all γ and limits: ± the solution in K.rhs."""
    n = K.n
    size = pushes + 3 * drags
    for i in range(pushes + drags):
        row = K.lcp_rows[i]
        value = 0.0
        for j in range(n):
            value += K.acc[K.acc_B + row * n + j] * K.rhs[j]
        K.lcp_matrix[i * size + column] += sign * value
        if i >= pushes:
            K.lcp_matrix[(i + drags) * size + column] -= sign * value
            slope = K.lcp_slope[i - pushes]
            normal = normal_of(K, i)
            if normal >= 0:
                for k in range(held):
                    if K.rows[k] == normal:
                        K.lcp_matrix[(i + 2 * drags) * size + column] -= sign * slope * K.rhs[n + k]
                if column < pushes and K.lcp_rows[column] == normal:
                    K.lcp_matrix[(i + 2 * drags) * size + column] += slope


def take_branches(K: ContactForces, pushes: int, drags: int) -> None:
    """Who pushes, sticks and slides in the solution."""
    most_push = 0.0
    most_speed = 0.0
    for u in range(pushes + 3 * drags):
        if u < pushes + 2 * drags:
            most_push = max(most_push, K.lcp_found[u])
            most_speed = max(most_speed, abs(K.lcp_shift[u]))
        else:
            most_speed = max(most_speed, K.lcp_found[u])
    for u in range(pushes):
        c = K.lcp_who[u]
        pushes_now = K.lcp_found[u] > NOTHING * most_push
        if K.free[c] == 2:
            K.parting[c] = 0 if pushes_now else 1
        else:
            K.active[c] = 1 if pushes_now else 0
    for u in range(pushes, pushes + drags):
        take_drag(K, u, most_push, most_speed, pushes, drags)


def take_drag(K: ContactForces, u: int, most_push: float, most_speed: float, pushes: int, drags: int) -> None:
    """Whether a friction sticks; one at its limit slides, even where other rows keep it at rest."""
    size = pushes + 3 * drags
    f = K.lcp_who[u]
    gamma = K.lcp_shift[u]
    left = K.lcp_shift[u + 2 * drags]
    for j in range(size - drags):
        gamma += K.lcp_matrix[u * size + j] * K.lcp_found[j]
        left += K.lcp_matrix[(u + 2 * drags) * size + j] * K.lcp_found[j]
    drag = K.lcp_found[u + drags] - K.lcp_found[u]
    K.sticks[f] = 0
    if K.lcp_found[u + 2 * drags] > NOTHING * most_speed:
        K.slip[f] = 1.0 if gamma > 0.0 else -1.0
    elif abs(drag) > NOTHING * most_push and left <= NOTHING * most_push:
        K.slip[f] = 1.0 if drag > 0.0 else -1.0
    else:
        K.sticks[f] = 1
        K.slip[f] = 0.0
