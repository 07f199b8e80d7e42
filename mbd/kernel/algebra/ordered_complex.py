"""LU factors of a complex matrix in an order chosen beforehand: `algebra.ordered` with real and imaginary parts."""

from mbd.compile.orders import HEADER_SIZE
from mbd.kernel.algebra.ordered import is_sound
from mbd.kernel.records import Steps
from mbd.kernel.tangent_rules import takes_part


def factor_pair_ordered(K: Steps, o_A: int, o: int, loss: float) -> bool:
    """Factors by the order at o of the matrix at K.stages[o_A:], in its place; false, and no change, if not sound.

    There N² real and N² imaginary parts of the matrix make way for those of the factors, inverse pivots among them.
    """
    size = K.orders[o]
    entries = K.orders[o + 2]
    o_row = o + HEADER_SIZE + K.orders[o + 1]
    o_start = o_row + 2 * size
    o_own = o_start + size + 1
    o_turn = o_own + size
    o_from = o_turn + entries
    V = K.spare
    S = K.stages
    re_at = 2 * size
    im_at = 2 * size + entries
    for k in range(size):
        first = K.orders[o_start + k]
        own = K.orders[o_own + k]
        last = K.orders[o_start + k + 1]
        for e in range(first, last):
            turn = K.orders[o_turn + e]
            place = o_A + K.orders[o_from + e]
            V[turn] = S[place]
            V[size + turn] = S[place + size * size]
        before = abs(V[k]) + abs(V[size + k])
        terms = before
        for e in range(first, own):
            turn = K.orders[o_turn + e]
            re = V[turn]
            im = V[size + turn]
            if takes_part(re) or takes_part(im):
                inner = K.orders[o_own + turn]
                left = re * V[re_at + inner] - im * V[im_at + inner]
                left_im = re * V[im_at + inner] + im * V[re_at + inner]
                V[turn] = left
                V[size + turn] = left_im
                old = V[k]
                old_im = V[size + k]
                for f in range(inner + 1, K.orders[o_start + turn + 1]):
                    at = K.orders[o_turn + f]
                    V[at] -= left * V[re_at + f] - left_im * V[im_at + f]
                    V[size + at] -= left * V[im_at + f] + left_im * V[re_at + f]
                terms += abs(V[k] - old) + abs(V[size + k] - old_im)
        re = V[k]
        im = V[size + k]
        row = K.orders[o_row + k]
        diagonal = row == K.orders[o_row + size + k]
        if not is_sound(abs(re) + abs(im), before, terms, diagonal, row >= K.n, loss):
            return False
        square = re * re + im * im
        if not (square > 1e-300 and square < 1e300):
            return False
        V[k] = re / square
        V[size + k] = -im / square
        for e in range(first, last):
            turn = K.orders[o_turn + e]
            V[re_at + e] = V[turn]
            V[im_at + e] = V[size + turn]
    S[o_A : o_A + 2 * entries] = V[re_at : re_at + 2 * entries]
    return True


def solve_pair_ordered(K: Steps, o_A: int, o: int, o_b: int) -> None:
    """b ← A⁻¹ b with the factors of `factor_pair_ordered`; b is at K.stages[o_b:], N real and N imaginary parts."""
    size = K.orders[o]
    entries = K.orders[o + 2]
    o_row = o + HEADER_SIZE + K.orders[o + 1]
    o_start = o_row + 2 * size
    o_own = o_start + size + 1
    o_turn = o_own + size
    V = K.spare
    S = K.stages
    o_im = o_A + entries
    for k in range(size):
        re = S[o_b + K.orders[o_row + k]]
        im = S[o_b + size + K.orders[o_row + k]]
        for e in range(K.orders[o_start + k], K.orders[o_own + k]):
            turn = K.orders[o_turn + e]
            re -= S[o_A + e] * V[turn] - S[o_im + e] * V[size + turn]
            im -= S[o_A + e] * V[size + turn] + S[o_im + e] * V[turn]
        V[k] = re
        V[size + k] = im
    for c in range(size):
        k = size - 1 - c
        own = K.orders[o_own + k]
        re = V[k]
        im = V[size + k]
        for e in range(own + 1, K.orders[o_start + k + 1]):
            turn = K.orders[o_turn + e]
            re -= S[o_A + e] * V[turn] - S[o_im + e] * V[size + turn]
            im -= S[o_A + e] * V[size + turn] + S[o_im + e] * V[turn]
        V[k] = re * S[o_A + own] - im * S[o_im + own]
        V[size + k] = re * S[o_im + own] + im * S[o_A + own]
        S[o_b + K.orders[o_row + size + k]] = V[k]
        S[o_b + size + K.orders[o_row + size + k]] = V[size + k]
