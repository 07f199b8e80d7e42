"""Steps in the charts of joints whose coordinates do not add (`mbd.sensitivity.charts`); nothing where all add.

Behind the programs of a scheme stand, in this order, `moves`, q ⊕ x and `differences`.
"""

from __future__ import annotations

from mbd.kernel.hooks import call_on
from mbd.kernel.records import Integers, Model, Reals
from mbd.sensitivity.kernel.directions import add
from mbd.sensitivity.kernel.sizes import AT_Q, AT_X, BASE, COORDINATES, GROUPS, LISTED, PLACES, RATES, WIDTH

__all__ = ["compose", "enter", "increment", "leave", "place_in_chart", "rates_of"]


def enter(S: Integers, Z: Reals, line: int) -> None:
    """The tangent of x in Z becomes that of the bases of charts around the state, in which nothing has moved yet.

    line : of Z, with which the columns begin
    """
    w = S[WIDTH]
    base = line + S[BASE]
    for g in range(S[GROUPS]):
        first = line + S[LISTED + 2 * g]
        for i in range(S[LISTED + 2 * g + 1]):
            for j in range(w):
                Z[(base + i) * w + j] = Z[(first + i) * w + j]
                Z[(first + i) * w + j] = 0.0
        base += S[LISTED + 2 * g + 1]


def leave(K: Model, program: int, S: Integers, block: Reals, out: Reals, Z: Reals, line: int, own: Reals) -> None:
    """The tangent of x in Z becomes A δq + D δx, along velocities at the q ⊕ x of the block.

    program : the number of `moves`; line : of Z, with which the columns begin; out, own (n_v, D): room
    """
    if S[GROUPS] == 0:
        return
    w = S[WIDTH]
    base = line + S[BASE]
    place = 0
    call_on(K, program, block, out)
    for g in range(S[GROUPS]):
        first = line + S[LISTED + 2 * g]
        size = S[LISTED + 2 * g + 1]
        for i in range(size * w):
            own[i] = Z[first * w + i]
            Z[first * w + i] = 0.0
        for i in range(size):
            for k in range(size):
                add(Z, first + i, out[place + i * size + k], Z, base + k, w)
                add(Z, first + i, out[place + (size + i) * size + k], own, k, w)
        for i in range(size * w):
            Z[base * w + i] = 0.0
        base += size
        place += 4 * size * size + size


def rates_of(
    K: Model, program: int, S: Integers, block: Reals, out: Reals, Z: Reals, s: int, V: Reals, of_V: Reals
) -> None:
    """ẋ = D⁻¹ v of the block as slope s in V, where coordinates do not add, and its derivatives by Z in of_V.

    V (stages, n), of_V (stages, n, D)
    """
    if S[GROUPS] == 0:
        return
    w = S[WIDTH]
    n_v = S[PLACES]
    n = S[RATES]
    place = 0
    call_on(K, program, block, out)
    for g in range(S[GROUPS]):
        first = S[LISTED + 2 * g]
        size = S[LISTED + 2 * g + 1]
        for i in range(size):
            line = s * n + first + i
            V[line] = out[place + 4 * size * size + i]
            for j in range(w):
                of_V[line * w + j] = 0.0
            for k in range(size):
                add(of_V, line, out[place + (2 * size + i) * size + k], Z, n_v + first + k, w)
                add(of_V, line, out[place + (3 * size + i) * size + k], Z, first + k, w)
        place += 4 * size * size + size


def compose(K: Model, program: int, S: Integers, block: Reals, out: Reals) -> None:
    """q ⊕ x in the place of q in the block, and no increment; program : the number of `moves`."""
    if S[GROUPS] == 0:
        return
    call_on(K, program + 1, block, out)
    for i in range(S[COORDINATES]):
        block[S[AT_Q] + i] = out[i]
    for i in range(S[PLACES]):
        block[S[AT_X] + i] = 0.0


def increment(K: Model, program: int, S: Integers, k: int, q: Reals, room: Reals, out: Reals) -> None:
    """The way from row k of q to the next one into `out` (n_v); program : the number of `moves`, room (2 n_q)."""
    n_q = S[COORDINATES]
    for i in range(2 * n_q):
        room[i] = q[k * n_q + i]
    call_on(K, program + 2, room, out)


def place_in_chart(S: Integers, block: Reals, k: int, q: Reals, x: Reals) -> None:
    """An increment x (n_v) from row k of q into the inputs of programs, where coordinates do not add."""
    if S[GROUPS] == 0:
        return
    for i in range(S[COORDINATES]):
        block[S[AT_Q] + i] = q[k * S[COORDINATES] + i]
    for i in range(S[PLACES]):
        block[S[AT_X] + i] = x[i]
