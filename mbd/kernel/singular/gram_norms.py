"""How much of each row is left beside the earlier ones.

The squares that remain are the pivots of G = Q Qᵀ, Q the rows scaled to length 1 (Cholesky, with diagonal pivoting
where the longest remaining row comes next): what Gram–Schmidt finds, to within √ε of a row's length. While orthogonal
rows fill up with what they were cleared of, G keeps its zeros: a row that is done makes neighbours of its own
neighbours only, so that a large mechanism, most rows of which have nothing in common, costs little.
"""

from mbd.kernel.algebra.column_weights import counted_inertia, least_inertia
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.records import DependentRows, Singular, SingularSteps

SQUARED_ROW_RTOL = 1e-15
"""Square of a scaled row below which it is round-off of its terms [-]."""


def pivoted_gram_norms(
    K: SingularSteps,
    m: int,
    h: float,
    ratio: float,
    ahead: float,
    place: int,
    o_S: int,
    stride: int,
    o_H: int,
    width: int,
) -> None:
    """Lengths of the rows of B, `ahead` of now, less their parts along earlier ones, into K.spare from `place` on.

    The longest remaining row comes next; at place 0 that order is found, elsewhere it is kept.
    """
    if place == 0:
        find_support(K, m, o_S, stride, o_H, width)
    for row in range(m):
        K.spare[4 * m + row] = scaled_row(K, m, row, h, ratio, ahead, o_H, width)
    gram_norms(K, m, K.n_v, place, 5 * m, place == 0)
    for done in range(m):
        K.spare[3 * m + done] = K.spare[4 * m + K.columns[done]]


def gram_norms(K: DependentRows, m: int, n: int, place: int, G: int, searches: bool) -> None:
    """What is left of each row of the basis beside those earlier in K.columns, into K.spare from `place` on.

    The m rows have n numbers and length 1; K.support tells which are not zero. G is made at K.spare[G:]. Where it
    `searches`, the order in K.columns becomes that of the longest remaining row next.
    """
    for row in range(m):
        for other in range(row + 1):
            part = common_part(K, n, row, other)
            K.spare[G + row * m + other] = part
            K.spare[G + other * m + row] = part
    for done in range(m):
        if searches:
            longest = done
            for k in range(done + 1, m):
                if K.spare[G + K.columns[k] * (m + 1)] > K.spare[G + K.columns[longest] * (m + 1)]:
                    longest = k
            row = K.columns[longest]
            K.columns[longest] = K.columns[done]
            K.columns[done] = row
        K.spare[place + done] = sqrt(max(K.spare[G + K.columns[done] * (m + 1)], 0.0))
        take_out(K, m, n, done, G)


def find_support(K: SingularSteps, m: int, o_S: int, stride: int, o_H: int, width: int) -> None:
    """Which entries of each row are not zero, into K.support; weights of columns behind the rows of the basis."""
    n = K.n_v
    least_mass = least_inertia(K, K.out, o_S, stride, 0)
    least_turning = least_inertia(K, K.out, o_S, stride, 1)
    for j in range(n):
        weight = counted_inertia(K, j, abs(K.out[o_S + stride * j]), least_mass, least_turning)
        K.basis[m * n + j] = 1.0 / sqrt(weight) if weight > 0.0 else 1.0
    for row in range(m):
        K.columns[row] = row
        count = 0
        for j in range(n):
            K.basis[row * n + j] = 0.0
            if K.out[o_H + row * width + j] != 0.0 or K.turning[row * n + j] != 0.0:
                count += 1
                K.support[row * (n + 1) + count] = j
        K.support[row * (n + 1)] = count


def scaled_row(K: SingularSteps, m: int, row: int, h: float, ratio: float, ahead: float, o_H: int, width: int) -> float:
    """A row of B, `ahead` of now, over the length that is returned, into the basis."""
    n = K.n_v
    moves = 0.0 if K.row_level[K.rows[row]] == 1 else 1.0
    length = 0.0
    turned = 0.0
    for e in range(K.support[row * (n + 1)]):
        j = K.support[row * (n + 1) + 1 + e]
        weight = K.basis[m * n + j]
        turn = K.turning[row * n + j] * weight
        entry = K.out[o_H + row * width + j] * weight - ratio * turn
        length += entry * entry
        turned += turn * turn
        K.basis[row * n + j] = entry + moves * ahead * turn
    length = sqrt(length) + moves * h * sqrt(turned) + 1e-300
    for e in range(K.support[row * (n + 1)]):
        K.basis[row * n + K.support[row * (n + 1) + 1 + e]] /= length
    return float(length)


def common_part(K: Singular, n: int, row: int, other: int) -> float:
    """The product of two rows of the basis, which are n long, over the entries of the first in K.support."""
    part = 0.0
    for e in range(K.support[row * (n + 1)]):
        j = K.support[row * (n + 1) + 1 + e]
        part += K.basis[row * n + j] * K.basis[other * n + j]
    return float(part)


def take_out(K: DependentRows, m: int, n: int, done: int, G: int) -> None:
    """Clear the rows still to come of their parts along the one that is done."""
    row = K.columns[done]
    pivot = K.spare[G + row * (m + 1)]
    if not pivot > SQUARED_ROW_RTOL:
        return
    near = m * (n + 1)
    count = 0
    for k in range(done + 1, m):
        if K.spare[G + row * m + K.columns[k]] != 0.0:
            K.support[near + count] = K.columns[k]
            count += 1
    for a in range(count):
        one = K.support[near + a]
        part = K.spare[G + row * m + one] / pivot
        for b in range(count):
            other = K.support[near + b]
            K.spare[G + one * m + other] -= part * K.spare[G + row * m + other]
