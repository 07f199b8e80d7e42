"""Rows that depend on others: found in order, left out of the solve, their multipliers of least norm.

With B_d = C B_kept the multipliers of least norm obey ``λ_d = W_d C W_kept⁻¹ λ_kept``, W of `share`: the shares. Where
no friction slides the forces Bᵀλ alone matter, so that the solve leaves λ_d out and `spread` finds them afterwards.
Where one does, its force depends on how a load is shared (other μ, other drag): the shares are part of the solve then.
"""

from mbd.equal import DIRECT_PIVOT_RTOL, RANK_RTOL
from mbd.kernel.algebra.column_weights import counted_inertia, least_inertia
from mbd.kernel.algebra.linear import factor, solve
from mbd.kernel.algebra.ordered import SYMMETRIC, factor_ordered, order_at
from mbd.kernel.algebra.orthogonal import clear_row, square
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.records import ContactRows, DependentRows, Equations, Frictions, Model, Reals, Singular
from mbd.kernel.tangent_rules import takes_part

SHORT_ROW_RATIO = 1e-2
"""Length of a row over that of the longest of its unit below which it comes after the others [-].

It vanishes at a singular configuration nearby: what errors of positions leave of it is no part of its own length.
"""

NOT_YET_JUDGED = 2
"""Mark in K.dropped of a row whose turn has not come [-].

Two feet that stick hold the line through them twice. Of the four tangents the one that lies along that line is left
out, else the coefficients of the one that is are large, and at the limit there are none.
"""

JOINT_SHARE = 2.0**26
"""Size of multipliers of rows that always act over those of contacts with which they count the same [-].

Contacts open and slide by their multipliers: these must not follow from which joints are cut, and have rows of their
own. So contacts share a load with the least norm of theirs, however large those of joints are for it.
"""

MIN_LIMIT_SHARE = 1e-4
"""Part of the largest limit of friction that even one without load counts as, where several hold together [-]."""


def find_dependent(K: DependentRows, m: int) -> None:
    """Mark rows among the m in K.rows that depend on others in K.dropped, with B_d = C B_kept in K.dependence.

    Gram–Schmidt on columns scaled by √M_ii, by turns: in the order of the rows those come first of which a tenth is
    left, then those of which a hundredth is, and so on, short ones after the others of the first turns; B is that of
    K.acc. What is kept is as independent as any choice is, but for a factor of ten. Where none is short and elimination
    in an order chosen beforehand keeps much of each, none depends on others.
    """
    K.n_dropped = 0
    K.dropped[: K.n_rows] = 0
    if m == 0:
        return
    for k in range(m):
        K.work[k] = length_of(K, K.rows[k])
    lengths = longest_row(K, m, 0)
    angles = longest_row(K, m, 1)
    others = longest_row(K, m, 2)
    if are_independent(K, m, lengths, angles, others):
        return
    for k in range(m):
        K.dropped[K.rows[k]] = NOT_YET_JUDGED
    kept = 0
    waiting = m
    bar = 0.1
    while waiting > 0:
        for k in range(m):
            row = K.rows[k]
            if K.dropped[row] != NOT_YET_JUDGED:
                continue
            part = part_of_longest(K, k, lengths, angles, others)
            left = remaining_norm(K, row, kept) * (part if part < SHORT_ROW_RATIO else 1.0)
            if left > bar:
                K.dropped[row] = 0
                keep_row(K, row, kept)
                kept += 1
                waiting -= 1
            elif left <= RANK_RTOL:
                K.dropped[row] = 1
                K.n_dropped += 1
                combine(K, row, kept)
                waiting -= 1
        bar = max(0.1 * bar, RANK_RTOL)


def are_independent(K: Equations, m: int, lengths: float, angles: float, others: float) -> bool:
    """Whether none of the m rows in K.rows is short and their matrix has an order whose pivots keep much of each."""
    o = order_at(K, m) if K.mode_id < 0 else 0  # those of modes eliminate pairs of numbers, and suppose that none does
    if o == 0:
        return False
    for k in range(m):
        if part_of_longest(K, k, lengths, angles, others) < SHORT_ROW_RATIO:
            return False
    return bool(factor_ordered(K, K.acc, o, SYMMETRIC, DIRECT_PIVOT_RTOL))


def part_of_longest(K: Equations, k: int, lengths: float, angles: float, others: float) -> float:
    """Length in K.work of the k-th of K.rows over that of the longest of its unit."""
    unit = K.row_unit[K.rows[k]]
    far = lengths if unit == 0 else (angles if unit == 1 else others)
    return float(K.work[k] / far) if far > 0.0 else 1.0


def longest_row(K: Equations, m: int, unit: int) -> float:
    """The largest length, in K.work, of the m rows in K.rows that have this unit."""
    longest = 0.0
    for k in range(m):
        if K.row_unit[K.rows[k]] == unit:
            longest = max(longest, K.work[k])
    return longest


def length_of(K: Model, row: int) -> float:
    """Length of a row on columns scaled by √M_ii."""
    n = K.n
    total = 0.0
    least_mass = least_inertia(K, K.acc, 0, n + 1, 0)
    least_turning = least_inertia(K, K.acc, 0, n + 1, 1)
    for j in range(n):
        slope = K.acc[K.acc_B + row * n + j]
        weight = counted_inertia(K, j, K.acc[j * n + j], least_mass, least_turning)
        total += slope * slope / weight if weight > 0.0 else slope * slope
    return float(sqrt(total))


def find_dependence(K: DependentRows, m: int) -> None:
    """C in K.dependence at the place of K.acc: the m rows in K.rows are kept, those of K.dropped depend on them."""
    for k in range(m):
        remaining_norm(K, K.rows[k], k)
        keep_row(K, K.rows[k], k)
    for row in range(K.n_rows):
        if K.dropped[row] == 1:
            remaining_norm(K, row, m)
            combine(K, row, m)


def remaining_norm(K: DependentRows, row: int, kept: int) -> float:
    """What is left of a row beside the `kept` first vectors of K.basis, relative to it, as the next vector there.

    Its parts along them are left in the next line of K.lower.
    """
    n = K.n
    base = kept * n
    least_mass = least_inertia(K, K.acc, 0, n + 1, 0)
    least_turning = least_inertia(K, K.acc, 0, n + 1, 1)
    for j in range(n):
        weight = counted_inertia(K, j, K.acc[j * n + j], least_mass, least_turning)
        K.basis[base + j] = K.acc[K.acc_B + row * n + j] / (sqrt(weight) if weight > 0.0 else 1.0)
    size = square(K.basis, base, n)
    K.lower[kept * K.n_rows : kept * K.n_rows + kept] = 0.0
    for _ in range(2):
        for i in range(kept):
            first = K.support[2 * i]
            K.lower[kept * K.n_rows + i] += clear_row(
                K.basis, base + first, i * n + first, K.support[2 * i + 1] - first
            )
    left = square(K.basis, base, n)
    return float(sqrt(left / size)) if size > 0.0 else 0.0


def keep_row(K: DependentRows, row: int, kept: int) -> None:
    """The next vector of K.basis, which `remaining_norm` has found, gets length 1; its row number into K.columns.

    K.support tells from where to where it has entries: rows of one part of a mechanism have nothing to do with others.
    """
    n = K.n
    left = sqrt(square(K.basis, kept * n, n)) + 1e-300
    K.lower[kept * K.n_rows + kept] = left
    first = n
    end = n
    for j in range(n):
        K.basis[kept * n + j] /= left
        if takes_part(K.basis[kept * n + j]):
            first = min(first, j)
            end = j + 1
    K.columns[kept] = row
    K.support[2 * kept] = first
    K.support[2 * kept + 1] = end


def combine(K: DependentRows, row: int, kept: int) -> None:
    """The coefficients of a row in the kept rows from those in the basis, ``c L = `` the next line of K.lower."""
    K.dependence[row * K.n_rows : row * K.n_rows + K.n_rows] = 0.0
    for back in range(kept):
        i = kept - 1 - back
        value = K.lower[kept * K.n_rows + i]
        for j in range(i + 1, kept):
            value -= K.dependence[row * K.n_rows + K.columns[j]] * K.lower[j * K.n_rows + i]
        K.dependence[row * K.n_rows + K.columns[i]] = value / K.lower[i * K.n_rows + i]


def sharing(K: DependentRows) -> bool:
    """Whether a friction slides while rows depend on others: then the shares are part of the solve.

    Smooth friction of contacts does so all the time.
    """
    if K.n_dropped > 0 and K.loads_act == 1:
        return True
    if K.n_dropped > 0:
        for f in range(K.n_frictions):
            if K.slip[f] != 0.0:
                return True
    return False


def find_shares(K: DependentRows) -> None:
    """W_d C W_kept⁻¹ into K.shares, from K.dependence and the limits in K.limit."""
    largest = largest_limit(K)
    for d in range(K.n_rows):
        for k in range(K.n_rows):
            part = 0.0
            if K.dropped[d] == 1 and K.dropped[k] == 0:
                part = K.dependence[d * K.n_rows + k]
                if takes_part(part):
                    part *= share(K, d, largest) / share(K, k, largest)
            K.shares[d * K.n_rows + k] = part


def take_shares(K: Singular, lam: Reals) -> None:
    """The multipliers of dependent rows from those of the others."""
    for d in range(K.n_rows):
        if K.dropped[d] == 1:
            lam[d] = 0.0
            for k in range(K.n_rows):
                lam[d] += K.shares[d * K.n_rows + k] * lam[k] if K.dropped[k] == 0 else 0.0


def shared(K: DependentRows, i: int, row: int) -> float:
    """What the multiplier 1 of a row brings into component i of the balance through dependent rows, ``Σ R_d share``."""
    value = 0.0
    for d in range(K.n_rows):
        if K.dropped[d] == 1:
            value += K.acc[K.acc_R + i * K.n_rows + d] * K.shares[d * K.n_rows + row]
    return value


def largest_limit(K: Frictions) -> float:
    """The largest limit of all frictions."""
    largest = 0.0
    for f in range(K.n_frictions):
        largest = max(largest, K.limit[f])
    return largest


def share(K: ContactRows, row: int, largest: float) -> float:
    """Size W by which a multiplier counts: joints follow contacts, parallel frictions share by the ratio of limits."""
    f = K.row_friction[row]
    if f < 0 and K.row_contact[row] < 0:
        return JOINT_SHARE
    if f < 0 or largest == 0.0:
        return 1.0
    return float(max(K.limit[f] / largest, MIN_LIMIT_SHARE))


def clear_dependent(K: DependentRows, lam: Reals) -> None:
    """The multipliers of rows that were left out of a solve are none: those of the others carry the whole load.

    Where loads are shared, they have been part of it.
    """
    if K.n_dropped == 0 or sharing(K):
        return
    for d in range(K.n_rows):
        if K.dropped[d] == 1:
            lam[d] = 0.0


def spread(K: DependentRows, lam: Reals) -> None:
    """The multipliers of least norm with the same forces: λ_d = y, λ_kept = μ − Cᵀ y.

    (W_d⁻¹ + C W⁻¹ Cᵀ) y = C W⁻¹ μ, with W of `share`.
    """
    count = 0
    for d in range(K.n_rows):
        if K.dropped[d] == 1:
            K.columns[count] = d
            count += 1
    if count == 0:
        return
    largest = largest_limit(K)
    for i in range(K.n_rows):
        if K.dropped[i] == 0:
            for d in range(count):
                lam[i] += K.dependence[K.columns[d] * K.n_rows + i] * lam[K.columns[d]]
    for a in range(count):
        K.rhs[a] = 0.0
        for b in range(count):
            K.kkt[a * count + b] = 1.0 / share(K, K.columns[a], largest) if a == b else 0.0
        for i in range(K.n_rows):
            left = K.dependence[K.columns[a] * K.n_rows + i]
            if K.dropped[i] == 1 or not takes_part(left):
                continue
            left /= share(K, i, largest)
            K.rhs[a] += left * lam[i]
            for b in range(count):
                K.kkt[a * count + b] += left * K.dependence[K.columns[b] * K.n_rows + i]
    if factor(K.kkt, count, K.pivots) != 0:
        return
    solve(K.kkt, count, K.pivots, K.rhs)
    for d in range(count):
        lam[K.columns[d]] = K.rhs[d]
        for i in range(K.n_rows):
            if K.dropped[i] == 0:
                lam[i] -= K.dependence[K.columns[d] * K.n_rows + i] * K.rhs[d]
