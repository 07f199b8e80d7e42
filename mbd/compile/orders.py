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
====================  ==============================================================================
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mbd.tape.node import Node
from mbd.tape.ordering import Order, order

__all__ = ["FEWER", "SMALLEST", "elimination_order", "flat_order", "may_pay"]

SMALLEST = 21
"""Unknowns from which on an order is looked for: below, loops over dense rows take no longer [-]."""
FEWER = 4
"""How many times fewer operations than dense elimination it must take [-]."""


def may_pay(accelerations: Sequence[Node], n: int, n_rows: int, rows: Sequence[int]) -> bool:
    """Whether there may be an order that pays, as far as size and entries of the matrices of accelerations tell."""
    size = n + len(rows)
    return size >= SMALLEST and 4 * len(_of_accelerations(accelerations, n, n_rows, rows)) <= size * size


def elimination_order(
    tangent: Sequence[Node], accelerations: Sequence[Node], n: int, n_rows: int, rows: Sequence[int]
) -> Any | None:
    """The order for the outputs of `programs.newton` and `programs.accelerations`, None where it does not pay."""
    size = n + len(rows)
    if not may_pay(accelerations, n, n_rows, rows):
        return None
    places = {divmod(k, size) for k, node in enumerate(tangent[: size * size]) if not node.is_zero}
    places |= _of_accelerations(accelerations, n, n_rows, rows)
    numbers = set[tuple[int, int]]()
    for i, j in places:
        there = [tangent[i * size + j], *(accelerations[k] for k in _both(i, j, n, n_rows, rows) if k >= 0)]
        if all(node.is_constant and 0.1 < abs(node.data) < 10.0 for node in there):
            numbers.add((i, j))
    if 4 * len(places) > size * size:
        return None
    found = order(places, numbers, n, size)
    if found is None or FEWER * found.operations > size**3 / 3.0:
        return None
    return flat_order(found, n, n_rows, rows)


def _of_accelerations(accelerations: Sequence[Node], n: int, n_rows: int, rows: Sequence[int]) -> set[tuple[int, int]]:
    """Places of what is not zero in [M R; B 0] and [M Bᵀ; B 0]."""
    at_R, at_B, column = n * n + n, n * n + n + n * n_rows, {row: n + k for k, row in enumerate(rows)}
    places = {divmod(k, n) for k, node in enumerate(accelerations[: n * n]) if not node.is_zero}
    for k, node in enumerate(accelerations[at_R : at_B + n * n_rows]):
        if not node.is_zero:
            (i, row) = divmod(k, n_rows) if k < n * n_rows else divmod(k - n * n_rows, n)[::-1]
            if row in column:
                places.add((i, column[row]))
                if k >= n * n_rows:
                    places.add((column[row], i))
    return places


def _both(i: int, j: int, n: int, n_rows: int, rows: Sequence[int]) -> tuple[int, int]:
    """Where (i, j) of the matrix of accelerations is in its program, with R and with Bᵀ; −1 for the corner of zeros."""
    at_R, at_B = n * n + n, n * n + n + n * n_rows
    if i < n and j < n:
        return i * n + j, i * n + j
    if i < n:
        row = rows[j - n]
        return at_R + i * n_rows + row, at_B + row * n + i
    return (at_B + rows[i - n] * n + j,) * 2 if j < n else (-1, -1)


def flat_order(found: Order, n: int, n_rows: int, rows: Sequence[int]) -> Any:
    """An order with where its values are, as the kernel reads it."""
    size = n + len(rows)
    places = [(found.rows[k], found.columns[turn]) for k in range(size) for turn in found.entries[k]]
    starts = np.cumsum([0, *(len(line) for line in found.entries)])
    own = [int(starts[k]) + line.index(k) for k, line in enumerate(found.entries)]
    both = [_both(i, j, n, n_rows, rows) for i, j in places]
    parts: list[Sequence[int]] = [
        (size, len(rows), len(places)), rows, found.rows, found.columns, starts.tolist(), own,
        [turn for line in found.entries for turn in line], [i * size + j for i, j in places],
        [one for one, _ in both], [other for _, other in both],
    ]  # fmt: skip
    return np.array([number for part in parts for number in part], dtype=np.int64)
