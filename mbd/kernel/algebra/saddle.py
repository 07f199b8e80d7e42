"""The equations of accelerations and impacts in one matrix.

``M w + force + R λ = 0`` with ``B w + bias = 0`` on active rows: w the acceleration and λ the multiplier, or w the jump
of velocity and λ the impulse. M may be singular; only the whole matrix is ever solved with.
"""

from typing import Any

from mbd.equal import DIRECT_PIVOT_RTOL, ROUND_OFF_RTOL
from mbd.kernel.algebra.islands import find_islands, gather_island, saddle_entry
from mbd.kernel.algebra.linear import eliminate, factor, round_off, sum_of_sizes
from mbd.kernel.algebra.ordered import OF_ACCELERATIONS, SYMMETRIC, factor_ordered, order_at, solve_ordered
from mbd.kernel.algebra.redundancy import find_dependent, find_shares, sharing, spread, take_shares
from mbd.kernel.codes import CONFLICT, DEPENDENT, EPS, NOT_FINITE
from mbd.kernel.records import Balance, DependentRows, Equations
from mbd.kernel.tangent_rules import is_differentiated

COMPATIBILITY_RTOL = 1e-6
"""Part of the terms of rows that a row which depends on others may be missed by, for errors of positions [-]."""
ROW_RTOL = 64.0 * EPS
"""Round-off of a row on positions, relative to its terms [-]."""
OWN_TERMS, VELOCITIES, POSITIONS = range(3)
"""What changes in a solution: accelerations, whose rows are measured by their own terms, velocities or positions."""


def solve_rows(K: Balance, m: int, dropping: bool) -> int:
    """w and λ for the m rows in K.rows; w in K.jump, λ of all rows in K.impulse.

    Rows may depend on each other where `dropping` allows it: then K.dropped tells which, and λ has the least norm; with
    a friction that slides the shares of the limits in K.limit are solved with. K.rows has the dependent ones last then.
    Without `dropping` the rows are those that K.dropped has left, and K.shares are in place.
    """
    return int(solve_change(K, K.y, m, dropping, OWN_TERMS))


def solve_at(K: Balance, m: int, level: int) -> int:
    """w and λ of the m rows in K.rows, which may depend on each other: of accelerations, velocities, or positions."""
    if level == 0:
        return int(solve_rows(K, m, True))
    return int(correct_velocities(K, K.y, m, True) if level == 1 else correct_positions(K, m))


def correct_velocities(K: Balance, y: Any, m: int, dropping: bool) -> int:
    """The same for a change w of the velocities y alone, which contradictions are measured by."""
    return int(solve_change(K, y, m, dropping, VELOCITIES))


def correct_positions(K: Balance, m: int) -> int:
    """The same for a change w of positions, at which rows that depend on others differ by the round-off of gaps."""
    return int(solve_change(K, K.y, m, True, POSITIONS))


def solve_change(K: Balance, y: Any, m: int, dropping: bool, what: int) -> int:
    """The same, contradictions measured by what changes: the velocities y, positions, or the rows' own terms."""
    size = K.n + m
    rank = solve_matrix(K, m, not dropping and sharing(K), ROUND_OFF_RTOL)
    if rank == -CONFLICT and dropping:
        return solve_kept(K, y, m, what)
    if rank == -CONFLICT and K.failure_index < K.n:  # forces push along a motion of little inertia
        return solve_to_round_off(K, m, False)
    if rank < 0:
        return -rank
    if rank == size:
        if dropping:
            find_dependent(K, 0)
        elif sharing(K):
            take_shares(K, K.impulse)
        return 0
    undetermined = K.n + m
    for k in range(rank, size):
        if K.columns[k] < K.n or not dropping:
            undetermined = min(undetermined, int(K.columns[k]))
    if dropping:
        find_dependent(K, m)
        if sharing(K):  # how loads are shared moves the mechanism: any unknown may be the one without a pivot
            find_shares(K)
            return solve_shared(K, dependent_last(K, m))
    if undetermined < K.n:
        return solve_to_round_off(K, dependent_last(K, m) if dropping else m, dropping)
    if undetermined < size:
        K.failure_index = undetermined
        return DEPENDENT
    spread(K, K.impulse)
    return 0


def solve_kept(K: Balance, y: Any, m: int, what: int) -> int:
    """w and λ of an independent set of rows, where what is left over of all of them seems to be a contradiction.

    Forces along a motion of little inertia seem to be one too.
    """
    blocked = K.failure_index
    find_dependent(K, m)
    kept = dependent_last(K, m)
    little = blocked < K.n
    if (kept < m or little) and not sharing(K):
        rank = solve_matrix(K, kept, False, round_off(K.n + kept) if little else ROUND_OFF_RTOL)
        if rank == K.n + kept and (kept == m or not contradicts(K, y, m, what)):
            spread(K, K.impulse)
            return 0
    elif kept < m:
        find_shares(K)
        if solve_shared(K, kept) == 0 and not contradicts(K, y, m, what):
            return 0
    K.failure_index = blocked
    return CONFLICT


def solve_to_round_off(K: Balance, m: int, dropping: bool) -> int:
    """w and λ for the m independent rows that come first in K.rows, where pivots of coordinates are small.

    The inertia of a motion may be a small difference of large ones: it is there as long as it is more than round-off.
    """
    size = K.n + m
    together = not dropping and sharing(K)
    rank = solve_matrix(K, m, together, round_off(size))
    if rank < 0:
        return -rank
    if rank < size:
        K.failure_index = K.columns[rank]
        for k in range(rank, size):
            K.failure_index = min(K.failure_index, K.columns[k])
        return DEPENDENT
    if together:
        take_shares(K, K.impulse)
    elif dropping:
        spread(K, K.impulse)
    return 0


def solve_shared(K: Balance, m: int) -> int:
    """w and λ with the shares of dependent rows in K.shares, for the m independent rows that come first in K.rows."""
    rank = solve_matrix(K, m, True, ROUND_OFF_RTOL)
    if rank < 0:
        return -rank
    if rank < K.n + m:
        K.failure_index = K.columns[rank]
        return DEPENDENT
    take_shares(K, K.impulse)
    return 0


def dependent_last(K: DependentRows, m: int) -> int:
    """The m rows in K.rows with those that depend on others behind the rest; how many the rest are."""
    kept = 0
    for k in range(m):
        K.columns[k] = K.rows[k]
        kept += 1 - K.dropped[K.rows[k]]
    first = 0
    last = kept
    for k in range(m):
        row = K.columns[k]
        if K.dropped[row] == 1:
            K.rows[last] = row
            last += 1
        else:
            K.rows[first] = row
            first += 1
    return int(kept)


def solve_matrix(K: Balance, m: int, together: bool, tolerance: float) -> int:
    """The same as `solve_islands`; values are those of its islands, whatever derivatives couple."""
    least = K.least_pivot
    rank = solve_islands(K, m, together, tolerance)
    if is_differentiated():
        K.least_pivot = least
        rank = solve_values(K, m, together, tolerance)
    return rank


def solve_values(K: Balance, m: int, together: bool, tolerance: float) -> int:
    """The same without derivatives: those that are there stay."""
    return solve_islands(K, m, together, tolerance)


def solve_islands(K: Balance, m: int, together: bool, tolerance: float) -> int:
    """w and λ of the m rows in K.rows, as far as they are independent, others 0; the rank, or minus a failure.

    With `together` each multiplier brings the shares of the rows that depend on its row along. Pivots below
    `tolerance` are round-off.
    """
    n = K.n
    size = n + m
    o = 0 if together else order_at(K, m)
    if o > 0 and factor_ordered(K, K.acc, o, OF_ACCELERATIONS, DIRECT_PIVOT_RTOL):  # far from any loss of rank
        return solve_in_order(K, m)
    islands = 1
    if together:  # shares of dependent rows may couple any two
        K.island[:size] = 0
    else:
        islands = find_islands(K, m)
    K.impulse[: K.n_rows] = 0.0
    rank = 0
    last = size
    for island in range(islands):
        members = gather_island(K, m, island)
        found = solve_island(K, members, together, tolerance)
        if found < 0:
            return found
        for k in range(members):
            if k < found:
                K.columns[rank + k] = K.members[K.own_columns[k]]
            else:
                last -= 1
                K.columns[last] = K.members[K.own_columns[k]]
        rank += found
    return rank


def solve_island(K: Balance, size: int, together: bool, tolerance: float) -> int:
    """w and λ of the unknowns in K.members, which nothing couples to others; the rank, or minus a failure."""
    n = K.n
    A = K.kkt
    for a in range(size):
        u = K.members[a]
        for b in range(size):
            A[a * size + b] = saddle_entry(K, u, K.members[b], together)
        K.rhs[a] = -K.force[u] if u < n else -K.bias[K.rows[u - n]]
    if not sum_of_sizes(A, size * size) + sum_of_sizes(K.rhs, size) < 1e300:
        return -NOT_FINITE
    rank = int(eliminate(A, size, K.rhs, K.own_columns, K.work, tolerance))
    for k in range(rank):
        K.least_pivot = min(K.least_pivot, abs(A[k * size + k]))
    if rank < 0:
        K.failure_index = K.members[K.own_columns[-1 - rank]]
        for k in range(-1 - rank, size):
            i = K.members[K.own_columns[k]]
            if i < n and K.acc[i * n + i] > 0.0:
                K.failure_index = i
        return -CONFLICT
    for a in range(size):
        u = K.members[a]
        if u < n:
            K.jump[u] = K.rhs[a]
        else:
            K.impulse[K.rows[u - n]] = K.rhs[a]
    return rank


def contradicts(K: Balance, y: Any, m: int, what: int) -> bool:
    """Whether the rows in K.rows that were left out of a solution contradict it, beyond errors of positions.

    Next to a singular configuration a row may be as short as its distance from there: what such errors leave of it is
    much of its own terms, but little of those of the rows beside it. So each row is judged by the largest terms of all
    rows of its unit, those of the velocities y included where they are what is corrected. Where positions are, Newton's
    iteration ends in round-off, in which dependent rows agree no longer; nor do accelerations of what cannot move,
    in the round-off of those that the forces alone, or a stop within a step, would make.
    """
    n = K.n
    for unit in range(3):
        worst = 0.0
        size = 0.0
        round_off = 0.0
        for k in range(m):
            row = K.rows[k]
            if K.row_unit[row] == unit:
                missed = K.bias[row]
                terms = abs(missed)
                free = 0.0
                for j in range(n):
                    slope = K.acc[K.acc_B + row * n + j]
                    missed += slope * K.jump[j]
                    terms += abs(slope * K.jump[j])
                    terms += abs(slope * y[j]) if what == VELOCITIES else 0.0
                    if what == OWN_TERMS and j < K.n_v and K.dt > 0.0 and K.acc[j * n + j] > 0.0:
                        free += abs(slope) * (abs(K.force[j]) / K.acc[j * n + j] + abs(K.y[j]) / K.dt)
                worst = max(worst, abs(missed))
                size = max(size, terms)
                round_off = max(round_off, ROUND_OFF_RTOL * free)
                if what != OWN_TERMS and (what == POSITIONS or K.dt > 0.0):
                    unseen = ROW_RTOL * max(K.scale[n + row], 1e-3)
                    round_off = max(round_off, unseen if what == POSITIONS else unseen / K.dt)
        if worst > COMPATIBILITY_RTOL * size + round_off:
            return True
    return False


def factor_saddle(K: Equations, m: int, symmetric: bool, loss: float) -> bool:
    """LU factors in K.kkt of [M R; B 0] from K.acc, or of [M Bᵀ; B 0]; false where a pivot is missing.

    Pivots of an order chosen beforehand must keep the part `loss` of their terms, else they are searched for.
    """
    n = K.n
    size = n + m
    o = order_at(K, m)
    if o > 0 and factor_ordered(K, K.acc, o, SYMMETRIC if symmetric else OF_ACCELERATIONS, loss):
        return True
    K.order_start = 0
    for i in range(n):
        K.kkt[i * size : i * size + n] = K.acc[i * n : i * n + n]
    for k in range(m):
        row = K.rows[k]
        for i in range(n):
            entry = K.acc[K.acc_B + row * n + i]
            K.kkt[(n + k) * size + i] = entry
            K.kkt[i * size + n + k] = entry if symmetric else K.acc[K.acc_R + i * K.n_rows + row]
        K.kkt[(n + k) * size + n : (n + k) * size + n + m] = 0.0
    return bool(factor(K.kkt, size, K.pivots) == 0)


def solve_in_order(K: Balance, m: int) -> int:
    """w and λ of the m rows in K.rows with the ordered factors at hand; all unknowns, or minus a failure."""
    for i in range(K.n):
        K.rhs[i] = -K.force[i]
    for k in range(m):
        K.rhs[K.n + k] = -K.bias[K.rows[k]]
    solve_ordered(K, K.rhs)
    if not sum_of_sizes(K.rhs, K.n + m) < 1e300:
        return -NOT_FINITE
    take_solution(K, m)
    return int(K.n + m)


def take_solution(K: Balance, m: int) -> None:
    """The solution in K.rhs to where others find it; multipliers of rows without part in it are 0."""
    K.jump[: K.n] = K.rhs[: K.n]
    K.impulse[: K.n_rows] = 0.0
    for k in range(m):
        K.impulse[K.rows[k]] = K.rhs[K.n + k]
