"""Linear complementarity by Lemke's method, ``w = M z + q``, ``0 ≤ w ⟂ z ≥ 0`` (Cottle, Pang & Stone 1992, ch. 4).

An artificial unknown z₀ is added, ``w = M z + q + z₀ 1``, as large as makes all w ≥ 0; then complementary pivots follow
a path along which ``zᵀ w = 0`` until z₀ leaves the basis. Where M is copositive-plus (positive semidefinite matrices
are, copies of rows included) the path ends in a solution, or in a ray, and then there is none (their theorem 4.4.12).

Ties of degenerate problems are broken lexicographically by the rows of the inverse basis (their section 4.9), which
stand in the tableau where the identity was; so no basis comes twice. Congruent scaling ``D M D`` beforehand keeps all
these properties of M; the solution is corrected with the numbers given, free of what pivots have gathered.
"""

from __future__ import annotations

from mbd.kernel.linear import factor, solve
from mbd.kernel.records import Integers, Reals
from mbd.kernel.roots import sqrt

__all__ = [
    "LCP_BOUND", "LCP_NOT_FINITE", "LCP_RAY", "LCP_SOLVED", "LCP_UNRESOLVED", "lemke", "lemke_places",
]  # fmt: skip

LCP_SOLVED = 0
"""z solves the problem."""
LCP_RAY = 1
"""The path ends in a ray: no solution if M is copositive-plus, else none was found."""
LCP_BOUND = 2
"""More pivots than allowed."""
LCP_UNRESOLVED = 3
"""Round-off: what the last basis gives misses the conditions by more than `LCP_TOLERANCE`."""
LCP_NOT_FINITE = 4
"""M or q holds something that is not a finite number."""

LCP_TOLERANCE = 1e-8
"""Largest violation that counts as solved, of the terms of its row: the square root of round-off."""
LCP_CANCELLED = 1e-13
"""Share of its terms below which a difference is round-off: some hundred times that of one operation."""
LCP_PIVOT = 1e-11
"""Smallest pivot, of the largest entry of its column; every other attempt takes a larger one."""
LCP_ATTEMPTS = 4
"""Paths tried where round-off spoils one, or one does not end."""
LCP_REGULAR = 1e-10
"""ε of the corrections, of the largest entries."""
LCP_SWEEPS = 10
"""Sweeps of scaling; each halves the decades by which rows differ."""


def lemke_places(n: int) -> int:
    """Places that `lemke` needs in `work`."""
    return n * (2 * n + 4)


def lemke(M: Reals, n: int, q: Reals, z: Reals, work: Reals, basis: Integers, most: int) -> int:
    """Solve the problem of n unknowns; what is returned says how it ended, z is 0 where it is not `LCP_SOLVED`.

    Parameters
    ----------
    M : (n n) row-major; it is left as it is, and so is q, (n)
    z : (n) the solution
    work : of `lemke_places(n)` places
    basis : (n) integers
    most : pivots allowed; a path usually takes fewer than 2 n
    """
    o_scale = n * (2 * n + 1)
    worst = LCP_SOLVED
    size = lcp_scales(M, n, q, work, o_scale)
    least = 0.0
    for i in range(n):
        least = min(least, q[i])
        z[i] = 0.0
    if not size < 1e300:
        return LCP_NOT_FINITE
    if least == 0.0:
        return LCP_SOLVED
    for attempt in range(LCP_ATTEMPTS):
        smallest = LCP_PIVOT * (1.0 if attempt % 2 == 0 else 1e3)
        lcp_tableau(M, n, q, size, 1.0 * attempt, work, o_scale)
        status = lcp_path(n, work, basis, most, smallest)
        if status == LCP_SOLVED:
            status = lcp_finish(M, n, q, size, z, work, basis, o_scale)
            if status == LCP_SOLVED:
                return status
        if attempt == 0:
            worst = status
    z[:n] = 0.0
    return worst


def lcp_scales(M: Reals, n: int, q: Reals, work: Reals, o_scale: int) -> float:
    """D, so that the largest entry of each row and column of D M D together is about 1; returns max |D q|, or inf.

    Symmetric scaling in the largest norm (Ruiz 2001, RAL-TR-2001-034).
    """
    total = 0.0
    for k in range(n * n):
        total += abs(M[k])
    for i in range(n):
        total += abs(q[i])
        work[o_scale + i] = 1.0
    if not total < 1e300:
        return 1e301
    for _ in range(LCP_SWEEPS):
        for i in range(n):
            big = 0.0
            for j in range(n):
                big = max(big, max(abs(M[i * n + j]), abs(M[j * n + i])) * work[o_scale + j])
            big *= work[o_scale + i]
            work[o_scale + n + i] = 1.0 / sqrt(big) if big > 1e-300 else 1.0
        for i in range(n):
            work[o_scale + i] *= work[o_scale + n + i]
    size = 0.0
    for i in range(n):
        size = max(size, abs(work[o_scale + i] * q[i]))
    return size


def lcp_tableau(M: Reals, n: int, q: Reals, size: float, spread: float, work: Reals, o_scale: int) -> None:
    """The rows ``1 w − M z − 1 z₀ = q``, scaled: columns of w (the inverse basis from then on), of z, and of q.

    The column of z₀ is left out: z₀ enters first, and is basic until the end. Rows of w stretched by different
    amounts, up to 1 + spread, are another covering vector, hence another path.
    """
    width = 2 * n + 1
    for i in range(n):
        stretch = 1.0 + spread * (0.6180339887498949 * (i + 1) % 1.0)
        for j in range(n):
            work[i * width + j] = 1.0 if i == j else 0.0
            work[i * width + n + j] = -(work[o_scale + i] * M[i * n + j] * work[o_scale + j]) * stretch
        work[i * width + 2 * n] = work[o_scale + i] * q[i] / size * stretch


def lcp_path(n: int, work: Reals, basis: Integers, most: int, smallest: float) -> int:
    """Complementary pivots from w = q until z₀ leaves; `basis` tells the unknown of each row: w 0…, z n…, z₀ 2 n."""
    width = 2 * n + 1
    for i in range(n):
        basis[i] = i
    row = n - 1  # z₀ = −min q, of equal ones the last: the others then are lexicographically positive
    for i in range(n - 1):
        k = n - 2 - i
        if work[k * width + 2 * n] < work[row * width + 2 * n] - LCP_CANCELLED:
            row = k
    for i in range(n):
        if i != row:
            for j in range(width):
                lcp_subtract(work, i * width + j, work[row * width + j])
    for j in range(width):
        work[row * width + j] = -work[row * width + j]
    entering = n + row  # the complement of the w that left
    basis[row] = 2 * n
    for _ in range(most):
        row = lcp_leaving(n, work, basis, entering, smallest)
        if row < 0:
            for i in range(n):
                if basis[i] == 2 * n and work[i * width + 2 * n] <= LCP_TOLERANCE:
                    return LCP_SOLVED  # but for round-off: rows that hold each other, such as a stop on either side
            return LCP_RAY
        leaving = basis[row]
        lcp_pivot(n, work, row, entering)
        basis[row] = entering
        if leaving == 2 * n:
            return LCP_SOLVED
        entering = leaving + n if leaving < n else leaving - n
    return LCP_BOUND


def lcp_subtract(work: Reals, place: int, change: float) -> None:
    """Subtract; what cancels is zero, so that ties are seen."""
    old = work[place]
    new = old - change
    work[place] = new if abs(new) > LCP_CANCELLED * (abs(old) + abs(change)) else 0.0


def lcp_pivot(n: int, work: Reals, row: int, column: int) -> None:
    """Solve the equation of a row for the unknown of a column and put it into the others."""
    width = 2 * n + 1
    inverse = 1.0 / work[row * width + column]
    for j in range(width):
        work[row * width + j] *= inverse
    work[row * width + column] = 1.0
    for i in range(n):
        factor_of_row = work[i * width + column]
        if i != row and factor_of_row != 0.0:
            for j in range(width):
                if work[row * width + j] != 0.0:
                    lcp_subtract(work, i * width + j, factor_of_row * work[row * width + j])
            work[i * width + column] = 0.0


def lcp_leaving(n: int, work: Reals, basis: Integers, entering: int, smallest: float) -> int:
    """The row whose unknown reaches zero first as another enters, lexicographically; −1 if none ever does."""
    width = 2 * n + 1
    big = 0.0
    for i in range(n):
        big = max(big, abs(work[i * width + entering]))
    found = -1
    for i in range(n):
        slope = work[i * width + entering]
        if slope > smallest * max(big, 1.0):
            if found < 0:
                found = i
                continue
            side = lcp_compare(work, i * width + 2 * n, slope, found * width + 2 * n, work[found * width + entering])
            if side == 0 and basis[found] == 2 * n:
                continue  # z₀ may leave: done
            if side == 0 and basis[i] == 2 * n:
                side = -1
            j = 0
            while side == 0 and j < n:
                side = lcp_compare(work, i * width + j, slope, found * width + j, work[found * width + entering])
                j += 1
            if side < 0 or (side == 0 and slope > work[found * width + entering]):
                found = i
    return found


def lcp_compare(work: Reals, a: int, slope_a: float, b: int, slope_b: float) -> int:
    """−1, 0 or 1: whether the ratio of the entry at a to its slope is smaller than that at b, equal, or larger."""
    one = work[a] * slope_b
    two = work[b] * slope_a
    if abs(one - two) <= 10.0 * LCP_CANCELLED * (abs(one) + abs(two)):
        return 0
    return -1 if one < two else 1


def lcp_finish(M: Reals, n: int, q: Reals, size: float, z: Reals, work: Reals, basis: Integers, o_scale: int) -> int:
    """z as the pivots left it, corrected by ``(M_BB + ε 1) δ = −(M z + q)_B`` with the numbers given.

    ε makes a last basis that round-off alone keeps regular harmless; where it is regular, one correction does.
    """
    width = 2 * n + 1
    o_best = o_scale + n  # −1 where w is basic
    o_now = o_scale + 2 * n
    for i in range(n):
        work[o_best + i] = -1.0
        work[o_now + i] = 0.0
    for i in range(n):
        if n <= basis[i] < 2 * n:
            work[o_now + basis[i] - n] = max(work[i * width + 2 * n], 0.0)
            work[o_best + basis[i] - n] = 0.0
    m = lcp_block(M, n, work, basis, o_scale)
    corrected = factor(work, m, basis) == 0
    best = 1e300
    for turn in range(4):
        now = lcp_violation(M, n, q, size, work, o_now, o_scale)
        if not now < best:
            break
        best = now
        m = 0
        for i in range(n):
            if work[o_best + i] >= 0.0:
                work[o_best + i] = work[o_now + i]
                z[m] = -lcp_slack(M, n, q, size, work, o_now, o_scale, i)
                m += 1
        if turn == 3 or not corrected:
            break
        solve(work, m, basis, z)
        m = 0
        for i in range(n):
            if work[o_best + i] >= 0.0:
                work[o_now + i] = max(work[o_now + i] + z[m], 0.0)
                m += 1
    for i in range(n):
        z[i] = max(work[o_best + i], 0.0) * work[o_scale + i] * size
    return LCP_SOLVED if best <= LCP_TOLERANCE else LCP_UNRESOLVED


def lcp_block(M: Reals, n: int, work: Reals, basis: Integers, o_scale: int) -> int:
    """``M_BB + ε 1``, scaled, of the basic z at the beginning of `work`; how many these are."""
    m = 0
    for i in range(n):
        if work[o_scale + n + i] >= 0.0:
            basis[m] = i
            m += 1
    for i in range(m):
        for j in range(m):
            k = basis[i] * n + basis[j]
            work[i * m + j] = work[o_scale + basis[i]] * M[k] * work[o_scale + basis[j]]
        work[i * m + i] += LCP_REGULAR
    return m


def lcp_slack(M: Reals, n: int, q: Reals, size: float, work: Reals, o_z: int, o_scale: int, i: int) -> float:
    """Row i of w, scaled; z scaled is in `work`."""
    w = q[i] / size
    for j in range(n):
        w += M[i * n + j] * work[o_scale + j] * work[o_z + j]
    return float(work[o_scale + i] * w)


def lcp_violation(M: Reals, n: int, q: Reals, size: float, work: Reals, o_z: int, o_scale: int) -> float:
    """How far scaled z ≥ 0 is from w ≥ 0 and zᵀ w = 0: the largest |min(z, w)|, of the terms of its row."""
    worst = 0.0
    for i in range(n):
        w = lcp_slack(M, n, q, size, work, o_z, o_scale, i)
        terms = 1e-3 + abs(q[i] / size * work[o_scale + i])
        for j in range(n):
            terms += abs(M[i * n + j]) * work[o_scale + j] * work[o_z + j] * work[o_scale + i]
        worst = max(worst, abs(min(w, work[o_z + i])) / terms)
    return worst
