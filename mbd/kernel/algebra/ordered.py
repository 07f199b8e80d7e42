"""LU factors in an order of pivots chosen beforehand, over the entries that can be other than zero.

For large mechanisms with few neighbours: a chain of loops takes operations in proportion to its length. Orders are
made by `mbd.compile.orders`, which tells what stands where. Each row is eliminated by the earlier ones, of which it
knows which concern it. Nothing is exchanged; instead every pivot is compared with what it was made of, as in
`mbd.tape.elimination`, and where one is too small the caller searches for pivots.
"""

from mbd.compile.orders import HEADER_SIZE
from mbd.kernel.algebra.linear import solve
from mbd.kernel.records import Equations, Model, Motion, Reals
from mbd.kernel.tangent_rules import is_differentiated, solve_plain, takes_part

OF_TANGENT, OF_ACCELERATIONS, SYMMETRIC = range(3)
"""Where values come from: the matrix of a step, row-major; the program `accelerations`; that with Bᵀ in place of R."""


def order_at(K: Motion, m: int) -> int:
    """Where the order for the m rows in K.rows begins in K.orders, 0 if there is none.

    Before a run has a mode it is that of its start, which K.orders begins with the place of.
    """
    mode = K.mode_id
    o = K.orders[0] if mode < 0 or mode >= K.n_modes else K.mode_order[mode]
    if o == 0 or K.orders[o + 1] != m:
        return 0
    for k in range(m):
        if K.orders[o + HEADER_SIZE + k] != K.rows[k]:
            return 0
    return int(o)


def columns_at(K: Model, o: int) -> int:
    """Where the order at o tells which coordinates each row of H concerns: ends of rows, from 0, then coordinates."""
    return int(o + HEADER_SIZE + K.orders[o + 1] + 4 * K.orders[o] + 1 + 4 * K.orders[o + 2])


def clear_tangent(K: Model, m: int, out: Reals) -> None:
    """Clear what the tangent of the present mode leaves as it is: all that its order does not ask for, if it has one.

    Whoever reads the whole matrix, or ∂ḣ/∂x, calls this first.
    """
    if K.mode_order[K.mode_id] > 0:
        size = K.n + m
        out[: size * size] = 0.0
        if K.stabilized == 1:
            o = size * size + K.n + 2 * m
            out[o : o + m * K.n_v] = 0.0


def factor_ordered(K: Equations, A: Reals, o: int, source: int, loss: float) -> bool:
    """Factors of the matrix in A by the order at o, into K.kkt, inverse pivots among them; false if one is not sound.

    K.spare holds what is left of a row, by turns of its columns, and behind it the factors.
    """
    size = K.orders[o]
    entries = K.orders[o + 2]
    o_row = o + HEADER_SIZE + K.orders[o + 1]
    o_start = o_row + 2 * size
    o_own = o_start + size + 1
    o_turn = o_own + size
    o_from = o_turn + entries * (1 + source)
    V = K.spare
    K.order_start = 0
    for k in range(size):
        first = K.orders[o_start + k]
        own = K.orders[o_own + k]
        last = K.orders[o_start + k + 1]
        for e in range(first, last):
            place = K.orders[o_from + e]
            value = 0.0
            if place >= 0:
                value = A[place]
            V[K.orders[o_turn + e]] = value
        before = abs(V[k])
        terms = before
        for e in range(first, own):
            turn = K.orders[o_turn + e]
            if takes_part(V[turn]):
                inner = K.orders[o_own + turn]
                left = V[turn] * V[size + inner]
                V[turn] = left
                old = V[k]
                for f in range(inner + 1, K.orders[o_start + turn + 1]):
                    V[K.orders[o_turn + f]] -= left * V[size + f]
                terms += abs(V[k] - old)
        row = K.orders[o_row + k]
        diagonal = row == K.orders[o_row + size + k]
        if not is_sound(abs(V[k]), before, terms, diagonal, row >= K.n, loss):
            return False
        V[k] = 1.0 / V[k]
        for e in range(first, last):
            V[size + e] = V[K.orders[o_turn + e]]
    K.kkt[:entries] = V[size : size + entries]
    K.order_start = o
    return True


def is_sound(size: float, before: float, terms: float, diagonal: bool, multiplier: bool, loss: float) -> bool:
    """Whether a pivot keeps enough of Σ|terms| of a multiplier, of what it was before of a coordinate.

    One that has grown out of proportion tells that an earlier one was too small.
    """
    if not (size > 1e-300 and size < 1e300):
        return False
    if not diagonal or terms == before:
        return True
    if multiplier:
        return loss * terms < size
    return loss * before < size and loss * size < before


def weakest_pivot(K: Equations) -> float:
    """Largest inverse pivot of multipliers among the factors at hand."""
    o = K.order_start
    size = K.orders[o]
    o_row = o + HEADER_SIZE + K.orders[o + 1]
    o_own = o_row + 3 * size + 1
    largest = 0.0
    for k in range(size):
        row = K.orders[o_row + k]
        if row >= K.n and row == K.orders[o_row + size + k]:
            largest = max(largest, abs(K.kkt[K.orders[o_own + k]]))
    return largest


def solve_ordered(K: Equations, b: Reals) -> None:
    """b ← A⁻¹ b with the factors of `factor_ordered`; K.spare is written to."""
    o = K.order_start
    size = K.orders[o]
    o_row = o + HEADER_SIZE + K.orders[o + 1]
    o_start = o_row + 2 * size
    o_own = o_start + size + 1
    o_turn = o_own + size
    for k in range(size):
        left = b[K.orders[o_row + k]]
        for e in range(K.orders[o_start + k], K.orders[o_own + k]):
            left -= K.kkt[e] * K.spare[K.orders[o_turn + e]]
        K.spare[k] = left
    for c in range(size):
        k = size - 1 - c
        own = K.orders[o_own + k]
        left = K.spare[k]
        for e in range(own + 1, K.orders[o_start + k + 1]):
            left -= K.kkt[e] * K.spare[K.orders[o_turn + e]]
        K.spare[k] = left * K.kkt[own]
        b[K.orders[o_row + size + k]] = K.spare[k]


def solve_kkt(K: Equations, size: int, b: Reals) -> None:
    """b ← A⁻¹ b with the factors in K.kkt, whichever they are."""
    if K.order_start > 0:
        solve_ordered(K, b)
    else:
        solve(K.kkt, size, K.pivots, b)


def solve_held(K: Equations, size: int, b: Reals) -> None:
    """The same with a matrix that is held: one of Newton's method, whose corrections vanish at the solution."""
    if is_differentiated() and K.order_start == 0:
        solve_plain(K.kkt, size, K.pivots, b, 0)
    else:
        solve_kkt(K, size, b)
