"""The order in which the kernel eliminates the large matrices of a contact mode, as numbers.

One order serves the tangent ``[S R; H 0]`` of a step and the matrix ``[M R; B 0]`` of accelerations of the same rows:
the pattern is that of both. Behind a head (unknowns N, rows m, entries Z) there are

====================  ==============================================================================
m                     numbers of the rows
N, N                  row and column of each pivot, in turn
N + 1, N              where the entries of each pivot's row begin, and its own place among them
Z                     the turn of each entry's column
Z, Z, Z               where its value is: in the tangent; in the program `accelerations` (−1 for zero); there, with Bᵀ
                      in the place of R
m + 1, …              where the coordinates begin that each row of H concerns, and these, ascending
====================  ==============================================================================
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from itertools import accumulate
from typing import Any

import numpy as np

from mbd.dataclass import dataclass
from mbd.tape.node import Node
from mbd.tape.ordering import Order, order

HEADER_SIZE = 3
"""Numbers before the lists of an order."""
MIN_UNKNOWNS = 21
"""Unknowns from which on an order is looked for: below, loops over dense rows take no longer [-]."""


def may_pay(filled: Filled, n: int, rows: Sequence[int]) -> bool:
    """Whether there may be an order that pays, as far as size and entries of the matrices of accelerations tell."""
    size = n + len(rows)
    return not filled.is_dense and size >= MIN_UNKNOWNS and 4 * len(filled.places(n, rows)) <= size * size


def elimination_order(
    tangent: Mapping[tuple[int, int], bool],
    accelerations: Sequence[Node],
    filled: Filled,
    n: int,
    n_rows: int,
    rows: Sequence[int],
) -> Any | None:
    """The order for the outputs of `programs.newton` and `programs.accelerations`, None where it does not pay.

    tangent : places of what is not zero in K, and whether that is a number of about one
    """
    size = n + len(rows)
    if not may_pay(filled, n, rows):
        return None
    places = tangent.keys() | filled.places(n, rows)
    numbers = {
        (i, j)
        for (i, j), known in tangent.items()
        if known and all(is_unit(accelerations[k]) for k in _both(i, j, n, n_rows, rows) if k >= 0)
    }
    if 4 * len(places) > size * size:
        return None
    found = order(places, numbers, n, size)
    # it must take a quarter of the operations of dense elimination
    if found is None or 4 * found.operations > size**3 / 3.0:
        return None
    return flat_order(found, places, n, n_rows, rows)


def written(order: Any, n: int, n_v: int, stabilized: bool) -> tuple[Any, Any]:
    """Places of K and of ∂ḣ/∂x in the output of `programs.newton` that somebody reads who eliminates in this order."""
    size, m, entries = (int(number) for number in order[:HEADER_SIZE])
    o_turn = HEADER_SIZE + m + 4 * size + 1
    matrix = order[o_turn + entries : o_turn + 2 * entries]
    starts = order[o_turn + 4 * entries :][: m + 1]
    columns = order[o_turn + 4 * entries + m + 1 :]
    turning = size * size + n + 2 * m + np.repeat(np.arange(m), np.diff(starts)) * n_v + columns
    return matrix, turning if stabilized else turning[:0]


def pattern(tangent: Sequence[Node], size: int) -> dict[tuple[int, int], bool]:
    """What `elimination_order` asks of a matrix of nodes."""
    return {divmod(k, size): is_unit(node) for k, node in enumerate(tangent[: size * size]) if not node.is_zero}


def is_unit(node: Node) -> bool:
    """Whether an entry is a number of about one, which is a pivot whatever happens."""
    return node.is_constant and 0.1 < abs(node.data) < 10.0


@dataclass(frozen=True)
class Filled:
    """Places of what is not zero in M, and coordinates that R and B of each row concern, which serve all modes.

    is_dense : entries of M alone are so many that no order pays in any mode; places are not told then
    """

    M: frozenset[tuple[int, int]]
    R: tuple[frozenset[int], ...]
    B: tuple[frozenset[int], ...]
    is_dense: bool = False

    @classmethod
    def of(cls, accelerations: Sequence[Node], n: int, n_rows: int) -> Filled:
        """These of the outputs of `programs.accelerations`."""
        at_R, at_B = n * n + n, n * n + n + n * n_rows
        if 4 * sum(not node.is_zero for node in accelerations[: n * n]) > (n + n_rows) ** 2:
            return cls(frozenset(), (), (), True)
        known = [k for k, node in enumerate(accelerations[: at_B + n_rows * n]) if not node.is_zero]
        R, B = ([set[int]() for _ in range(n_rows)] for _ in range(2))
        for k in known:
            if k >= at_B:
                row, i = divmod(k - at_B, n)
                B[row].add(i)
            elif k >= at_R:
                i, row = divmod(k - at_R, n_rows)
                R[row].add(i)
        M = frozenset(divmod(k, n) for k in known if k < n * n)
        return cls(M, tuple(map(frozenset, R)), tuple(map(frozenset, B)))

    def places(self, n: int, rows: Sequence[int]) -> set[tuple[int, int]]:
        """Places of what is not zero in [M R; B 0] and [M Bᵀ; B 0] of some rows."""
        found = set(self.M)
        if self.is_dense:
            return found
        for column, row in enumerate(rows, n):
            found |= {(i, column) for i in self.R[row] | self.B[row]} | {(column, i) for i in self.B[row]}
        return found


def _both(i: int, j: int, n: int, n_rows: int, rows: Sequence[int]) -> tuple[int, int]:
    """Where (i, j) of the matrix of accelerations is in its program, with R and with Bᵀ; −1 for the corner of zeros."""
    at_R, at_B = n * n + n, n * n + n + n * n_rows
    if i < n and j < n:
        return i * n + j, i * n + j
    if i < n:
        row = rows[j - n]
        return at_R + i * n_rows + row, at_B + row * n + i
    return (at_B + rows[i - n] * n + j,) * 2 if j < n else (-1, -1)


def flat_order(found: Order, given: Collection[tuple[int, int]], n: int, n_rows: int, rows: Sequence[int]) -> Any:
    """An order with where its values are, as the kernel reads it; without fill-in they are at `given` places."""
    size = n + len(rows)
    places = [(found.rows[k], found.columns[turn]) for k in range(size) for turn in found.entries[k]]
    starts = np.cumsum([0, *(len(line) for line in found.entries)])
    own = [int(starts[k]) + line.index(k) for k, line in enumerate(found.entries)]
    both = [_both(i, j, n, n_rows, rows) for i, j in places]
    along: list[list[int]] = [[] for _ in rows]
    for row, j in sorted(given):
        if row >= n > j:
            along[row - n].append(j)
    parts: list[Sequence[int]] = [
        (size, len(rows), len(places)), rows, found.rows, found.columns, starts.tolist(), own,
        [turn for line in found.entries for turn in line], [i * size + j for i, j in places],
        [one for one, _ in both], [other for _, other in both],
        [0, *accumulate(map(len, along))], [j for line in along for j in line],
    ]  # fmt: skip
    return np.array([number for part in parts for number in part], dtype=np.int64)
