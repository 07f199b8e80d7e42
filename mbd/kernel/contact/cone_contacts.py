"""Contacts and friction solved as one problem over cones: impulses over a step, or forces at an instant.

Everything that may not choose is held, and with one solution of the held KKT matrix for each row that may,

``w = B (v + K⁻¹ …) = G z + shift``,  z = −λ

of normals, frictions that slide together, friction along one direction, and tangents that stick as long as their
contact pushes (see `kernel.contact.cone_problem`). Of a non-smooth step z is the impulse of the whole step, that of its
smooth part included, so that what was closed may push less than it did there, but never pull.
"""

from mbd.equal import REST_SPEED
from mbd.kernel.algebra.linear import factor, solve
from mbd.kernel.algebra.redundancy import shared, sharing
from mbd.kernel.algebra.saddle import solve_at
from mbd.kernel.contact.cone_problem import CONE_RTOL, EQUAL, PUSH, STEADY, cone_faults, cone_limit, cone_solve
from mbd.kernel.contact.cones import aim, follows, set_sticking
from mbd.kernel.records import Balance, ContactForces, Frictions
from mbd.kernel.stepping.loads import evaluate_loaded, limit_of
from mbd.kernel.stepping.restart import MAX_LOAD_ITERATIONS, active_rows, load_accelerations
from mbd.kernel.tangent_rules import takes_part

LOAD_RTOL = 1e-6
"""Change of multipliers, of the largest, below which the limits that follow them are found [-]."""


def solve_cones(K: Balance, level: int, allowed: float) -> int:
    """1 if all that may choose obeys its law, with K.jump, K.impulse and branches in place; 0 if nothing was found.

    Then branches are as they were. The levels, and what may choose, are those of `complementarity`; laws may be missed
    by the part `allowed` of the largest impulse: `CONE_RTOL`, or more where branches alone are asked for. Limits that
    follow loads of joints are found for branches alone, by a fixed point: those of the solution before, the first
    without loads, so that each of its problems has one solution (Nečas, Jarušek & Haslinger 1980, Boll. Unione Mat.
    Ital. 17:796).
    """
    if K.loaded == 1 and allowed <= CONE_RTOL:
        return 0
    keep_branches(K, True)
    count = gather_unknowns(K)
    if count == 0:
        return 0
    hold_others(K)
    if K.loaded == 1:
        K.impulse[: K.n_rows] = 0.0
    found = False
    for turn in range(MAX_LOAD_ITERATIONS if K.loaded == 1 else 1):
        change = find_limits_apart(K, level, count)
        if turn > 0 and change <= LOAD_RTOL:
            break
        found = solve_apart(K, level, count, allowed)
        if not found:
            break
    if not found:
        keep_branches(K, False)
        return 0
    residual = K.cone_work[0]
    take_cone_branches(K, level, count)
    if residual <= CONE_RTOL:
        K.cone_residual = max(K.cone_residual, residual)
    return 1


def solve_apart(K: Balance, level: int, count: int, allowed: float) -> bool:
    """Whether there is a solution with limits that follow the unknown pushes alone; it is then in place."""
    held = load_held(K, level, count)
    if held < 0:
        return False
    fill_cones(K, held, count)
    if K.n_clusters > 1:
        take_own_units(K, count)
    cone_solve(
        K.cone_matrix, count, K.cone_shift, K.cone_found, K.cone_owner, K.cone_twin, K.cone_limit, K.cone_mu,
        K.cone_work, K.side_pivots,
    )  # fmt: skip
    if K.n_clusters > 1:
        leave_own_units(K, count)
    return bool(K.cone_work[0] <= allowed and take_impulses(K, level, count))


def keep_branches(K: ContactForces, out: bool) -> None:
    """Branches into K.cone_flags and K.cone_slips, or back."""
    n = K.n_contacts
    for c in range(n):
        if out:
            K.cone_flags[c] = K.active[c]
            K.cone_flags[n + c] = K.parting[c]
        else:
            K.active[c] = K.cone_flags[c]
            K.parting[c] = K.cone_flags[n + c]
    for f in range(K.n_frictions):
        if out:
            K.cone_flags[2 * n + f] = K.sticks[f]
            K.cone_slips[f] = K.slip[f]
        else:
            K.sticks[f] = K.cone_flags[2 * n + f]
            K.slip[f] = K.cone_slips[f]


def gather_unknowns(K: ContactForces) -> int:
    """Rows that may choose, into K.cone_rows, and how they belong together; how many."""
    count = 0
    for c in range(K.n_contacts):
        K.cone_normal[c] = -1
        if K.kind[c] == 0 and (K.free[c] > 0 or (K.active[c] == 1 and slides_or_sticks(K, c))):
            K.cone_normal[c] = count
            K.cone_rows[count] = K.normal[c]
            K.cone_owner[count] = PUSH if K.free[c] > 0 else EQUAL
            K.cone_twin[count] = -1
            count += 1
    for row in range(K.n_rows):
        c = K.row_contact[row]
        f = K.row_friction[row]
        if c >= 0 and (K.cone_normal[c] < 0 or K.normal[c] == row):
            continue
        chooses = f >= 0 and K.loose[f] > 0
        stuck = c >= 0 and K.free[c] != 2 and (f < 0 or (K.sticks[f] == 1 and K.loose[f] == 0))
        if chooses or stuck:
            K.cone_rows[count] = row
            K.cone_owner[count] = K.cone_normal[c] if c >= 0 else STEADY
            K.cone_twin[count] = -1
            K.cone_mu[count] = 0.0 if chooses else -1.0
            count += 1
    for u in range(count):
        f = K.row_friction[K.cone_rows[u]]
        if f >= 0 and K.loose[f] > 0 and K.group_size[f] > 1:
            after = f + 1 if f + 1 < K.leader[f] + K.group_size[f] else K.leader[f]
            for v in range(count):
                if K.cone_rows[v] == K.friction_row[after]:
                    K.cone_twin[u] = v
    return count


def slides_or_sticks(K: Frictions, c: int) -> bool:
    """Whether a friction of contact c may choose."""
    found = False
    for f in range(K.n_frictions):
        if K.friction_contact[f] == c and K.loose[f] > 0:
            found = True
    return found


def hold_others(K: ContactForces) -> None:
    """All that may choose is off."""
    for c in range(K.n_contacts):
        if K.cone_normal[c] >= 0:
            if K.free[c] == 2:
                K.parting[c] = 1
            else:
                K.active[c] = 0
    for f in range(K.n_frictions):
        if K.loose[f] > 0:
            K.sticks[f] = 0
            K.slip[f] = 0.0


def find_limits_apart(K: ContactForces, level: int, count: int) -> float:
    """Limits of frictions without the unknown pushes, into K.cone_limit, and their slopes; how far loads changed."""
    for k in range(K.n_rows):
        K.loads[k] = (K.given[k] + K.past[k]) if level == 1 else 0.0
        if K.loaded == 1:
            K.loads[k] += K.impulse[k]
    for u in range(count):
        if K.cone_owner[u] < 0:
            K.loads[K.cone_rows[u]] = K.given[K.cone_rows[u]] if level == 1 else 0.0
    change = evaluate_loaded(K, K.loads)
    for u in range(count):
        f = K.row_friction[K.cone_rows[u]]
        K.cone_limit[u] = limit_of(K, f) if f >= 0 and K.cone_mu[u] >= 0.0 else 0.0
    for c in range(K.n_contacts):
        if K.cone_normal[c] >= 0:
            K.loads[K.normal[c]] -= 1.0
    evaluate_loaded(K, K.loads)
    for u in range(count):
        f = K.row_friction[K.cone_rows[u]]
        if K.cone_owner[u] >= 0 and f >= 0 and K.cone_mu[u] >= 0.0:
            K.cone_mu[u] = max(limit_of(K, f) - K.cone_limit[u], 0.0)
        if level == 1 and f >= 0:  # a force that stays finite has an impulse only over the time of the step
            K.cone_limit[u] += (K.past_time - 1.0) * K.base_limit[f]
    for c in range(K.n_contacts):
        if K.cone_normal[c] >= 0:
            K.loads[K.normal[c]] += 1.0
    evaluate_loaded(K, K.loads)
    return change


def load_held(K: Balance, level: int, count: int) -> int:
    """Force of what is given, without what the smooth step did through the unknown rows; see `factor_held`."""
    o_R = K.acc_R
    if level == 0:
        load_accelerations(K)
    else:
        for i in range(K.n):
            K.force[i] = 0.0
            for k in range(K.n_rows):
                K.force[i] += K.acc[o_R + i * K.n_rows + k] * K.given[k] if takes_part(K.given[k]) else 0.0
    for u in range(count):
        row = K.cone_rows[u]
        K.cone_found[u] = -K.past[row] if level == 1 else -K.lam[row]
        if level == 1:
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


def fill_cones(K: Balance, held: int, count: int) -> None:
    """G and shift, column by column, of unit impulses."""
    n = K.n
    for i in range(count):
        row = K.cone_rows[i]
        value = K.bias[row]
        for j in range(n):
            value += K.acc[K.acc_B + row * n + j] * K.jump[j]
        K.cone_shift[i] = value
    for j in range(count):
        for i in range(n):
            K.rhs[i] = K.acc[K.acc_R + i * K.n_rows + K.cone_rows[j]]
        K.rhs[n : n + held] = 0.0
        solve(K.kkt, n + held, K.pivots, K.rhs)
        for i in range(count):
            value = 0.0
            for k in range(n):
                value += K.acc[K.acc_B + K.cone_rows[i] * n + k] * K.rhs[k]
            K.cone_matrix[i * count + j] = value


def are_together(K: ContactForces, u: int, v: int) -> bool:
    """Whether two unknowns are of one cluster."""
    return bool(K.cluster[K.n + K.cone_rows[u]] == K.cluster[K.n + K.cone_rows[v]])


def take_own_units(K: Balance, count: int) -> None:
    """Impulses and velocities of each cluster in units of its own, in K.loads and K.rhs: all are of the size of one.

    One that is heavy would else hide what a light one apart misses of its laws.
    """
    for u in range(count):
        ease = 0.0
        for v in range(count):
            if are_together(K, u, v):
                ease = max(ease, K.cone_matrix[v * count + v])
        ease = ease if ease > 0.0 else 1.0
        size = 0.0
        for v in range(count):
            if are_together(K, u, v):
                size = max(size, max(abs(K.cone_shift[v]) / ease, max(abs(K.cone_found[v]), K.cone_limit[v])))
        K.loads[u] = size if size > 0.0 else 1.0
        K.rhs[u] = ease
    for u in range(count):
        K.cone_shift[u] /= K.rhs[u] * K.loads[u]
        K.cone_found[u] /= K.loads[u]
        K.cone_limit[u] /= K.loads[u]
        for v in range(count):
            K.cone_matrix[u * count + v] /= K.rhs[u]


def leave_own_units(K: Balance, count: int) -> None:
    """Those of all again, also of ρ in K.cone_work."""
    o_rho = count * count + 2 * count
    for u in range(count):
        K.cone_shift[u] *= K.rhs[u] * K.loads[u]
        K.cone_found[u] *= K.loads[u]
        K.cone_limit[u] *= K.loads[u]
        K.cone_work[o_rho + u] /= K.rhs[u]
        for v in range(count):
            K.cone_matrix[u * count + v] *= K.rhs[u]


def take_impulses(K: Balance, level: int, count: int) -> bool:
    """K.jump and the multipliers of held rows under the impulses found."""
    for u in range(count):
        for i in range(K.n):
            K.force[i] -= K.acc[K.acc_R + i * K.n_rows + K.cone_rows[u]] * K.cone_found[u]
    return bool(solve_at(K, active_rows(K, K.active), level) == 0)


def size_beside(K: ContactForces, count: int, u: int) -> float:
    """The largest impulse of the cluster of an unknown, or what would be."""
    o_rho = count * count + 2 * count
    size = 1e-300
    for v in range(count):
        if are_together(K, u, v):
            size = max(size, max(abs(K.cone_found[v]), abs(K.cone_work[o_rho + v] * K.cone_shift[v])))
    return size


def take_cone_branches(K: ContactForces, level: int, count: int) -> None:
    """Who pushes, sticks and slides which way, by the velocities of the solution; and its multipliers."""
    cone_faults(
        K.cone_matrix, count, K.cone_shift, K.cone_found, K.cone_owner, K.cone_twin, K.cone_limit, K.cone_mu,
        K.cone_work,
    )  # fmt: skip
    o_w = count * count + count
    for c in range(K.n_contacts):
        u = K.cone_normal[c]
        if u >= 0:
            small = REST_SPEED * size_beside(K, count, u)
            parts = K.cone_owner[u] == PUSH and K.cone_work[o_w + count + u] * K.cone_work[o_w + u] > small
            if K.free[c] == 2:
                K.parting[c] = 1 if parts else 0
            else:
                K.active[c] = 0 if parts else 1
    for u in range(count):
        f = K.row_friction[K.cone_rows[u]]
        if f >= 0 and K.loose[f] > 0:
            take_friction(K, u, f, REST_SPEED * size_beside(K, count, u), o_w, count)
    for u in range(count):
        row = K.cone_rows[u]
        K.impulse[row] = -K.cone_found[u] - (K.past[row] if level == 1 else 0.0)


def take_friction(K: ContactForces, u: int, f: int, small: float, o_w: int, count: int) -> None:
    """Whether friction f, which is unknown u, sticks; else which way it slides, with its group."""
    if follows(K, f):
        return
    speed = abs(K.cone_work[o_w + u])
    v = K.cone_twin[u]
    while v >= 0 and v != u:
        speed += abs(K.cone_work[o_w + v])
        v = K.cone_twin[v]
    c = K.friction_contact[f]
    on = c < 0 or K.active[c] == 1
    slides = on and K.cone_work[o_w + count + u] * speed > small
    limit = cone_limit(count, K.cone_found, K.cone_owner, K.cone_limit, K.cone_mu, K.cone_work, u)
    set_sticking(K, f, 0 if slides else 1)  # that of a contact that parts begins stuck if it closes after all
    for g in range(f, f + K.group_size[f]):
        K.limit[g] = limit
        if slides:
            K.slip[g] = K.cone_work[o_w + u]
            u = K.cone_twin[u]
    if slides:
        aim(K, f)
