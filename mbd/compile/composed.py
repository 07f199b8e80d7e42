"""A program of a contact mode as a sum: those of its parts, one after the other, and a table of where their outputs go.

Nothing is derived or compiled for a mode but a jump to the loop over its table, so that a new combination of contacts
costs no more than the table.
"""

from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Vector
from mbd.compile.backend import Function
from mbd.dataclass import dataclass
from mbd.equations.composition import BOTTOM, MATRIX, RATE, RESIDUAL, RIGHT, TURNING, VALUE

Places = NDArray[np.int64]
FIRST_TERM = 7
"""Numbers of a plan before those of its terms."""


@dataclass(frozen=True)
class Shape:
    """Where the outputs of a mode's program are, see `mbd.equations.programs`.

    n, n_v, rows : sizes and the numbers of the rows in ascending order
    matrix : whether K stands in front
    """

    n: int
    n_v: int
    rows: tuple[int, ...]
    stabilized: bool
    matrix: bool

    @property
    def head(self) -> int:
        """Numbers of K."""
        return (self.n + len(self.rows)) ** 2 if self.matrix else 0

    @property
    def size(self) -> int:
        """All numbers."""
        m = len(self.rows)
        rates = m + (m * self.n_v if self.matrix else 0) if self.stabilized else 0
        return self.head + self.n + m + rates

    def places(self, known: Sequence[Sequence[int]]) -> Places:
        """Where outputs go that are known by block, line and column."""
        if not len(known):
            return np.zeros(0, dtype=np.int64)
        block, i, j = np.array(known, dtype=np.int64).T
        m, turn = len(self.rows), np.zeros(max(self.rows, default=0) + 1, dtype=np.int64)
        turn[list(self.rows)] = np.arange(m)
        width, end = self.n + m, self.head + self.n
        row, column = turn[np.where(block > RIGHT, i, 0) * (block != RESIDUAL)], turn[j * (block == RIGHT)]
        found = np.zeros(len(block), dtype=np.int64)
        for kind, place in (
            (MATRIX, i * width + j), (RIGHT, i * width + self.n + column), (BOTTOM, (self.n + row) * width + j),
            (RESIDUAL, self.head + i), (VALUE, end + row), (RATE, end + m + row),
            (TURNING, end + 2 * m + row * self.n_v + j),
        ):  # fmt: skip
            found[block == kind] = place[block == kind]
        return found


class Term(NamedTuple):
    """A function of a sum.

    places : where in the output of the sum each of its numbers is added
    in_block, in_parameters : where its own inputs are, those of the block first; both empty where it reads them itself
    """

    function: Function
    places: Places
    in_block: Places
    in_parameters: Places


class Composed:
    """A function that adds what some functions write.

    Parameters
    ----------
    size : numbers of the output
    cleared : which of them are cleared first, a stretch (first, count) and places besides; all where it is None.
        Others are left as they are
    """

    def __init__(
        self, name: str, terms: Sequence[Term], size: int, cleared: tuple[int, int, Places] | None = None
    ) -> None:
        self.name, self.size = name, size
        self._terms = terms
        self._first, self._count, self._others = (0, size, np.zeros(0, dtype=np.int64)) if cleared is None else cleared
        self._tables = [np.concatenate([term.in_block, term.in_parameters]) for term in terms]
        lines = [
            [0, len(term.places), term.places.ctypes.data, len(term.in_block), len(table), table.ctypes.data]
            for term, table in zip(terms, self._tables, strict=True)
        ]
        most, inputs = max(len(term.places) for term in terms), max(map(len, self._tables))
        others = [len(self._others), self._others.ctypes.data]
        head = [self._first, self._count, *others, most + 1, inputs + 1, len(lines)]
        self._plan = np.array([*head, *(word for line in lines for word in line)], dtype=np.int64)

    @property
    def provisional(self) -> bool:
        """Whether better code of some term is being made."""
        return any(term.function.provisional for term in self._terms)

    @property
    def address(self) -> int:
        """Of the jump to the loop; terms are called by the best code that there is now. 0 in plain Python."""
        self._plan[FIRST_TERM::6] = [term.function.address for term in self._terms]
        return int(self._jump.address) if self._plan[FIRST_TERM] else 0

    @cached_property
    def _jump(self) -> Any:
        from mbd.compile.jump import Jump

        return Jump(self._plan.ctypes.data)

    def __call__(self, block: Vector, parameters: Vector, out: Vector) -> None:
        out[self._first : self._first + self._count] = 0.0
        out[self._others] = 0.0
        for term, table in zip(self._terms, self._tables, strict=True):
            work, own = np.zeros(len(term.places)), block
            if len(table):
                own = np.zeros(max(len(block), len(table)))
                own[: len(table)] = np.concatenate([block[term.in_block], parameters[term.in_parameters]])
            term.function(own, parameters, work)
            np.add.at(out, term.places, work)
