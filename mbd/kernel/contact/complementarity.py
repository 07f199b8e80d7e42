"""Who pushes and who sticks: contacts and dry friction choose so that every one of them obeys its law.

``M w + force + R λ = 0`` with ``B w + bias = 0`` on held rows, ``0 ≤ B w + bias ⟂ −λ ≥ 0`` on contacts that may choose,
``|λ_T| ≤ limit`` where a friction sticks and ``λ_T = limit · sign`` where it slides along w.

1. A semismooth Newton method: every contact and friction takes the branch of its law that the last solution asks for,
   and the linear equations of these branches are solved again (Alart & Curnier 1991; Hintermüller, Ito & Kunisch 2002).
2. Where that does not end, all laws are solved together as one problem over cones (`cone_contacts`), and 1 continues
   from its branches; then only the branch that breaks its law most changes. Multipliers of least norm of dependent
   rows, by which steps judge, may leave limits that other multipliers keep: then a friction slides that need not.
3. In impacts, whose impulses nothing judges again, those of the cones stand where 2 finds none and no rows conflict.
4. Where rows depend on each other, a friction may slide at its limit though others that stick hold its place: the
   accelerations are the same with fewer that slide, so that it sticks. Else which of them slides would change with
   every restart.

Non-smooth steps with friction in space begin with the cones.
"""

from mbd.equal import LAW_RTOL, NOMINAL_RTOL
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.codes import CONFLICT, NO_IMPACT
from mbd.kernel.contact.branches import is_on, solve_directed
from mbd.kernel.contact.cone_contacts import keep_branches, solve_cones
from mbd.kernel.contact.cone_directions import misses, turn_directions
from mbd.kernel.contact.cone_problem import CONE_RTOL
from mbd.kernel.contact.cones import aim, follows, set_sticking
from mbd.kernel.records import Balance, ContactForces, Contacts, DependentRows, Motion
from mbd.kernel.stepping.restart import active_rows, largest_force, refresh_scales

MAX_NEWTON = 12
"""Changes of all branches at once before and after the solution over cones [-]."""
MAX_CONE_MISFIT = 0.1
"""Part of the largest impulse that cones may miss laws by for their branches to be tried [-]."""


def complementarity(K: Balance, level: int) -> int:
    """Choose K.active of contacts with K.free = 1 and K.sticks, K.slip of frictions with K.loose = 1 or 2, and solve.

    Others keep theirs. With K.free = 2 a contact chooses K.parting: its normal row is off, its tangents stay. With
    K.loose = 2 a friction slides unless that is clearly wrong. Those that slide together choose as one.
    level 0: accelerations, force and bias are those of K.acc; 1: velocities, bias and impulses K.given are in place.
    """
    measure_free(K, level)
    if K.n_cones > 0 and K.strategy == 1 and level < 2 and solve_cones(K, level, CONE_RTOL) == 1:
        return 0
    status = choose_branches(K, level)
    if status == 0 and level == 0 and K.strategy == 0 and K.n_cones > 0:
        return stick_where_held(K)
    return status


def choose_branches(K: Balance, level: int) -> int:
    """Branches that no solution contradicts, by Newton's method and over cones; a status."""
    status = change_branches(K, level, 0)
    if status == CONFLICT or status == NO_IMPACT:
        solve_cones(K, level, MAX_CONE_MISFIT)  # else from the last branches
        # changes of the worst branch that follow
        again = change_branches(K, level, 4 * (K.n_contacts + K.n_frictions))
        if again != CONFLICT and again != NO_IMPACT:
            return again
        if level == 1 and status == NO_IMPACT and again == NO_IMPACT and solve_cones(K, level, CONE_RTOL) == 1:
            return 0
        if again == CONFLICT:
            return again
    return status


def change_branches(K: Balance, level: int, single: int) -> int:
    """Solve, and change all branches that the solution contradicts, then up to `single` times the worst; a status.

    Where that does not end: CONFLICT if held rows contradicted each other on the way, else NO_IMPACT.
    """
    failed = NO_IMPACT
    for attempt in range(MAX_NEWTON + single):
        status = solve_branches(K, level)
        if status == CONFLICT:
            failed = CONFLICT
            if give_way(K) == 0:
                break
        elif status != 0 or (change_all(K, level) if attempt < MAX_NEWTON else change_worst(K, level)) == 0:
            return status
    return failed


def stick_where_held(K: Balance) -> int:
    """Frictions that may choose and slide though nothing moves there stick, where they all can; a status.

    Where they cannot all branches are those that were found, which are solved for again.
    """
    found = False
    keep_branches(K, True)
    for f in range(K.n_frictions):
        if K.loose[f] == 1 and K.sticks[f] == 0 and is_on(K, f) and not follows(K, f) and is_held_still(K, f):
            set_sticking(K, f, 1)
            found = True
    if not found:
        return 0
    if solve_branches(K, 0) == 0 and not is_contradicted(K):
        return 0
    keep_branches(K, False)
    return solve_branches(K, 0)


def is_held_still(K: ContactForces, f: int) -> bool:
    """Whether the acceleration along the group of a friction is round-off of its terms."""
    for g in range(f, f + K.group_size[f]):
        row = K.friction_row[g]
        if departure(K, row, 1.0, LAW_RTOL) > 0.0 or departure(K, row, -1.0, LAW_RTOL) > 0.0:
            return False
    return True


def is_contradicted(K: ContactForces) -> bool:
    """Whether a contact or friction that may choose breaks its law in the solution."""
    found = False
    for f in range(K.n_frictions):
        found = found or (K.loose[f] > 0 and is_on(K, f) and friction_fault(K, f, 0) > 0.0)
    for c in range(K.n_contacts):
        found = found or (K.free[c] > 0 and contact_fault(K, c, 0) > 0.0)
    return found


def solve_branches(K: Balance, level: int) -> int:
    """Solve with the present branches; friction that slides is put into K.impulse of its row, opposite to its way."""
    status = solve_directed(K, level)
    if status == 0 and K.n_cones > 0:
        status = turn_directions(K, level)
    return status


def measure_free(K: Motion, level: int) -> None:
    """Sizes of w where no row acted, by which its round-off is judged: where all rests w itself is nothing else."""
    if level == 0 and K.scale[0] == 0.0:
        refresh_scales(K)
    for i in range(K.n):
        mass = abs(K.acc[i * K.n + i])
        K.typical[i] = abs(K.y[i]) if level == 1 else (K.scale[i] / mass if mass > 0.0 else 0.0)


def departure(K: ContactForces, row: int, sign: float, tolerance: float) -> float:
    """How far sign (B w + bias) of a row is below zero, beyond a tolerance relative to its terms."""
    n = K.n
    value = K.bias[row]
    size = abs(K.bias[row])
    for j in range(n):
        slope = K.acc[K.acc_B + row * n + j]
        value += slope * K.jump[j]
        size = max(size, abs(slope) * max(abs(K.jump[j]), K.typical[j]))
    return float(-sign * value - tolerance * size)


def contact_fault(K: ContactForces, c: int, level: int) -> float:
    """How badly contact c breaks its law; ≤ 0 if it does not."""
    if K.active[c] == 1 and K.parting[c] == 0:
        return float(K.impulse[K.normal[c]] - LAW_RTOL * largest_impulse(K, K.normal[c], level))  # λ > 0 would pull
    return departure(K, K.normal[c], 1.0, LAW_RTOL)


def friction_fault(K: ContactForces, f: int, level: int) -> float:
    """How badly friction f breaks its law; ≤ 0 if it does not."""
    row = K.friction_row[f]
    if K.group_size[f] > 1:
        return group_fault(K, f, level)
    if K.sticks[f] == 1:
        return float(abs(K.impulse[row] + K.past[row]) - K.limit[f] - LAW_RTOL * largest_impulse(K, row, level))
    return departure(
        K, row, K.slip[f], NOMINAL_RTOL if K.loose[f] == 2 else LAW_RTOL
    )  # it slides against its own friction


def group_fault(K: ContactForces, f: int, level: int) -> float:
    """How badly frictions that slide together break their law; all but the first of them never do."""
    if follows(K, f):
        return -1.0
    if K.sticks[f] == 1:
        square = 0.0
        for g in range(f, f + K.group_size[f]):
            pull = K.impulse[K.friction_row[g]] + K.past[K.friction_row[g]]
            square += pull * pull
        return float(sqrt(square) - K.limit[f] - LAW_RTOL * largest_impulse(K, K.friction_row[f], level))
    return misses(K, f, NOMINAL_RTOL if K.loose[f] == 2 else LAW_RTOL)


def give_way(K: DependentRows) -> int:
    """Where held rows contradict each other, a friction that may choose slides, or a contact opens; 0 if none can.

    It is the one whose row is blamed if it can. Its direction is other than the one it had last.
    """
    m = active_rows(K, K.active)
    chosen = -1
    for k in range(m):
        f = K.row_friction[K.rows[k]]
        if f >= 0 and K.loose[f] > 0 and (chosen < 0 or K.n + k == K.failure_index):
            chosen = f
    if chosen >= 0:
        for g in range(K.leader[chosen], K.leader[chosen] + K.group_size[chosen]):
            K.sticks[g] = 0
            K.slip[g] = -K.lean[g]
        aim(K, chosen)
        return 1
    for c in range(K.n_contacts):
        if K.free[c] == 1 and K.active[c] == 1:
            K.active[c] = 0
            return 1
    return 0


def largest_impulse(K: ContactForces, row: int, level: int) -> float:
    """Size of the multipliers of the cluster of a row; impulses where nothing strikes are round-off beside its forces.

    Those have the time of a step to act.
    """
    largest = K.dt * largest_force(K, row) if level == 1 else 0.0
    for k in range(K.n_rows):
        if K.cluster[K.n + k] == K.cluster[K.n + row]:
            largest = max(largest, abs(K.impulse[k]))
    return largest


def toggle(K: Contacts, c: int) -> None:
    """The other branch of a contact."""
    if K.free[c] == 2:
        K.parting[c] = 1 - K.parting[c]
    else:
        K.active[c] = 1 - K.active[c]


def turn(K: ContactForces, f: int) -> None:
    """The other branch of a friction: from sticking to sliding as its multiplier pulls, and back."""
    slides = K.sticks[f] == 1
    set_sticking(K, f, 0 if slides else 1)
    if slides:
        for g in range(f, f + K.group_size[f]):
            K.slip[g] = K.impulse[K.friction_row[g]] + K.past[K.friction_row[g]]
        aim(K, f)


def change_all(K: ContactForces, level: int) -> int:
    """Every contact and friction takes the branch that the solution asks for; how many changed."""
    count = 0
    for f in range(K.n_frictions):
        if K.loose[f] > 0 and is_on(K, f) and friction_fault(K, f, level) > 0.0:
            turn(K, f)
            count += 1
    for c in range(K.n_contacts):
        if K.free[c] > 0 and contact_fault(K, c, level) > 0.0:
            toggle(K, c)
            count += 1
    return count


def change_worst(K: ContactForces, level: int) -> int:
    """The contact or friction that breaks its law most takes its other branch; 0 if none breaks it."""
    found = -1
    most = 0.0
    for place in range(K.n_contacts + K.n_frictions):
        f = place - K.n_contacts
        fault = 0.0
        if f < 0:
            fault = contact_fault(K, place, level) if K.free[place] > 0 else 0.0
        elif K.loose[f] > 0 and is_on(K, f):
            fault = friction_fault(K, f, level)
        if fault > most:
            found = place
            most = fault
    if found >= K.n_contacts:
        turn(K, found - K.n_contacts)
    elif found >= 0:
        toggle(K, found)
    return found + 1
