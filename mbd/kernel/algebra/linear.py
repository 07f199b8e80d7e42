"""Dense linear algebra on small flat matrices: LU with partial pivoting, elimination with complete pivoting.

Hand-written because it runs inside the compiled kernel, where below about 28 unknowns it beats a library call.
"""

from mbd.equal import ROUND_OFF_RTOL
from mbd.kernel.codes import EPS
from mbd.kernel.records import Integers, Reals
from mbd.kernel.tangent_rules import takes_part


def factor(A: Reals, n: int, pivots: Integers) -> int:
    """LU factors of the row-major n×n matrix A, in place, inverse pivots on the diagonal; 0, or 1 + the bad column."""
    for k in range(n):
        p = k
        big = abs(A[k * n + k])
        for i in range(k + 1, n):
            size = abs(A[i * n + k])
            if size > big:
                big = size
                p = i
        pivots[k] = p
        if not (big > 1e-305 and big < 1e300):
            return k + 1
        if p != k:
            swap_rows(A, n, k, p)
        inverse = 1.0 / A[k * n + k]
        A[k * n + k] = inverse
        for i in range(k + 1, n):
            if takes_part(A[i * n + k]):
                left = A[i * n + k] * inverse
                A[i * n + k] = left
                subtract_row(A, n, i, k, left, k + 1, n)
    return 0


def swap_rows(A: Reals, n: int, i: int, k: int) -> None:
    """Rows i and k of the row-major n×n matrix A change places."""
    for j in range(n):
        swap = A[i * n + j]
        A[i * n + j] = A[k * n + j]
        A[k * n + j] = swap


def subtract_row(A: Reals, n: int, i: int, k: int, part: float, first: int, end: int) -> None:
    """Row i less `part` times row k, in the columns from `first` to before `end`."""
    j = first
    while j + 3 < end:  # four at once, which become one instruction
        a0 = A[i * n + j] - part * A[k * n + j]
        a1 = A[i * n + j + 1] - part * A[k * n + j + 1]
        a2 = A[i * n + j + 2] - part * A[k * n + j + 2]
        a3 = A[i * n + j + 3] - part * A[k * n + j + 3]
        A[i * n + j] = a0
        A[i * n + j + 1] = a1
        A[i * n + j + 2] = a2
        A[i * n + j + 3] = a3
        j += 4
    while j < end:
        A[i * n + j] -= part * A[k * n + j]
        j += 1


def solve(A: Reals, n: int, pivots: Integers, b: Reals) -> None:
    """b ← A⁻¹ b with the factors of `factor`."""
    for k in range(n):
        p = pivots[k]
        if p != k:
            swap = b[k]
            b[k] = b[p]
            b[p] = swap
    for k in range(n):  # by columns: the entries of b do not wait for each other
        left = b[k]
        for i in range(k + 1, n):
            b[i] -= A[i * n + k] * left
    for c in range(n):
        k = n - 1 - c
        left = b[k] * A[k * n + k]
        b[k] = left
        for i in range(k):
            b[i] -= A[i * n + k] * left


def round_off(n: int) -> float:
    """What elimination of n unknowns may leave of a pivot that is zero, of the entries that it came from."""
    return min(ROUND_OFF_RTOL, 8.0 * EPS * (n + 8.0))


def solve_definite(M: Reals, n: int, b: Reals, work: Reals) -> float:
    """b ← M⁻¹ b by M = Lᵀ D L, last unknown first, D L in the lower half of M; 0 where M is not positive definite.

    What returns else is the least part that a pivot keeps of its diagonal entry. `work` needs n places, for the
    diagonal of M. Of a tree whose coordinates are numbered outwards the zeros of M between branches stay zeros
    (Featherstone 2005, Int. J. Robotics Research 24:487).
    """
    for k in range(n):
        work[k] = abs(M[k * n + k])
    kept = 1.0
    lost = round_off(n)
    for c in range(n):
        k = n - 1 - c
        pivot = M[k * n + k]
        if not pivot > lost * work[k]:
            return 0.0
        if pivot < kept * work[k]:
            kept = pivot / work[k]
        inverse = 1.0 / pivot
        M[k * n + k] = inverse
        for i in range(k):
            if takes_part(M[k * n + i]):
                left = M[k * n + i] * inverse
                b[i] -= left * b[k]
                subtract_row(M, n, i, k, left, 0, i + 1)
    substitute_outwards(M, n, b)
    return kept


def solve_again(M: Reals, n: int, b: Reals) -> None:
    """b ← M⁻¹ b with the factors of `solve_definite`."""
    for c in range(n):
        k = n - 1 - c
        left = b[k] * M[k * n + k]
        for i in range(k):
            b[i] -= M[k * n + i] * left
    substitute_outwards(M, n, b)


def substitute_outwards(M: Reals, n: int, b: Reals) -> None:
    """b ← (D L)⁻¹ b with the factors of `solve_definite`."""
    for k in range(n):
        left = b[k]
        even = 0.0  # two sums, which do not wait for each other
        j = 0
        while j + 1 < k:
            left -= M[k * n + j] * b[j]
            even -= M[k * n + j + 1] * b[j + 1]
            j += 2
        if j < k:
            left -= M[k * n + j] * b[j]
        b[k] = (left + even) * M[k * n + k]


def eliminate(A: Reals, n: int, b: Reals, columns: Integers, work: Reals, rank_tolerance: float) -> int:
    """Solve A x = b by complete pivoting after equilibration; x in b, free unknowns 0.

    Returns the rank; a negative value −1−rank if the remaining equations conflict.
    `work` needs 3 n places: row scales, column scales, solution. The number of the unknown
    eliminated k-th is left in columns[k], those beyond the rank being the dependent ones.
    """
    equilibrate(A, n, b, work)
    size = 0.0
    for i in range(n):
        columns[i] = i
        size = max(size, abs(b[i]))
    rank = n
    for k in range(n):
        if not bring_largest(A, n, k, b, columns, rank_tolerance):
            rank = k
            break
        for i in range(k + 1, n):
            left = A[i * n + k] / A[k * n + k]
            if takes_part(left):
                subtract_row(A, n, i, k, left, k + 1, n)
                b[i] -= left * b[k]
    conflict = False
    for i in range(rank, n):
        if abs(b[i]) > 1e-8 * (size + 1e-300):
            conflict = True
    for k in range(rank):
        i = rank - 1 - k
        total = b[i]
        for j in range(i + 1, rank):
            total -= A[i * n + j] * b[j]
        b[i] = total / A[i * n + i]
    for j in range(n):
        work[2 * n + columns[j]] = b[j] if j < rank else 0.0
    for j in range(n):
        b[j] = work[2 * n + j] * work[n + j]
    return -1 - rank if conflict else rank


def equilibrate(A: Reals, n: int, b: Reals, work: Reals) -> None:
    """Scale rows (and b), then columns, of A x = b to largest entries of 1; the factors go into work[: 2 n]."""
    work[n : 2 * n] = 0.0
    for i in range(n):
        big = largest_entry(A, i * n, i * n + n)
        work[i] = 1.0 / big if big > 0.0 else 1.0
        for j in range(n):
            A[i * n + j] *= work[i]
            work[n + j] = max(work[n + j], abs(A[i * n + j]))
        b[i] *= work[i]
    for j in range(n):
        work[n + j] = 1.0 / work[n + j] if work[n + j] > 0.0 else 1.0
    for i in range(n):
        for j in range(n):
            A[i * n + j] *= work[n + j]


def largest_entry(A: Reals, first: int, last: int) -> float:
    """The largest |A| at the places from `first` to before `last`."""
    a0 = a1 = a2 = a3 = 0.0  # four, which do not wait for each other
    j = first
    while j + 3 < last:
        a0 = max(a0, abs(A[j]))
        a1 = max(a1, abs(A[j + 1]))
        a2 = max(a2, abs(A[j + 2]))
        a3 = max(a3, abs(A[j + 3]))
        j += 4
    while j < last:
        a0 = max(a0, abs(A[j]))
        j += 1
    return max(a0, a1, a2, a3)


def sum_of_sizes(A: Reals, last: int) -> float:
    """Σ |A| at the first `last` places; not finite where an entry is not."""
    a0 = a1 = a2 = a3 = 0.0
    j = 0
    while j + 3 < last:
        a0 += abs(A[j])
        a1 += abs(A[j + 1])
        a2 += abs(A[j + 2])
        a3 += abs(A[j + 3])
        j += 4
    while j < last:
        a0 += abs(A[j])
        j += 1
    return a0 + a1 + a2 + a3


def bring_largest(A: Reals, n: int, k: int, b: Reals, columns: Integers, least: float) -> bool:
    """The largest entry from (k, k) on comes to (k, k), its row with that of b, its column with its number.

    False where none is above `least`: nothing moves then.
    """
    p = k
    big = 0.0
    for i in range(k, n):
        most = largest_entry(A, i * n + k, i * n + n)
        if most > big:
            big = most
            p = i
    if not big > least:
        return False
    c = k
    while abs(A[p * n + c]) < big:
        c += 1
    if p != k:
        swap_rows(A, n, k, p)
        swap = b[k]
        b[k] = b[p]
        b[p] = swap
    if c != k:
        for i in range(n):
            swap = A[i * n + k]
            A[i * n + k] = A[i * n + c]
            A[i * n + c] = swap
        place = columns[k]
        columns[k] = columns[c]
        columns[c] = place
    return True
