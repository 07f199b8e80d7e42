"""Elimination of a small sparse system on the tape: straight-line code in an order chosen beforehand.

``[S R; H 0] x = b`` with S about symmetric and definite, as Newton's method for a mechanism with rows meets it. Zeros
and ones of the matrix are known while the code is written, so that they cost nothing. In turn the cheapest of these is
eliminated (Markowitz 1957, Management Science 3:255, with pivots on the diagonal):

- a coordinate by its own equation, pivot S_ii; not a massless one that rows act on, whose S_ii is stiffness alone
  and may be round-off;
- a multiplier by its own row, pivot the −H S⁻¹ R that is left there once all coordinates of the row are eliminated
  (with fewer of them, two rows may have the same left);
- a coordinate by a row, and that row's multiplier by the equation of the coordinate, where both pivots are numbers: a
  foot held at x + l sin φ gives x, and what is left is smaller by two and free of multipliers. No division is needed.

Nothing is exchanged at run time. Instead every pivot is compared with what it was made of, see `Factors.sound`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from math import inf

from mbd.dataclass import dataclass
from mbd.equal import HALF_PRECISION_RTOL
from mbd.tape.node import Node, Tape


@dataclass(frozen=True)
class Pivot:
    """One unknown eliminated: ``x_column = inverse (b_row − Σ upper x)``, after ``b −= lower b_row`` elsewhere."""

    row: int
    column: int
    inverse: Node
    lower: tuple[tuple[int, Node], ...]
    upper: tuple[tuple[int, Node], ...]


@dataclass(frozen=True)
class Factors:
    """An eliminated matrix.

    pivots : in turn
    sound : 1.0 where every pivot keeps more than the part `loss` of its terms, which ±∞ and NaN do not; else 0.0
    weakest : largest inverse pivot of multipliers, 0 where all of theirs are numbers; grows towards a
        singular configuration
    """

    pivots: tuple[Pivot, ...]
    sound: Node
    weakest: Node

    def solve(self, right: Sequence[Node]) -> list[Node]:
        """x from b."""
        b = list(right)
        for pivot in self.pivots:
            for row, factor in pivot.lower:
                b[row] = b[row] - factor * b[pivot.row]
        x = list(right)
        for pivot in reversed(self.pivots):
            rest = b[pivot.row]
            for column, factor in pivot.upper:
                rest = rest - factor * x[column]
            x[pivot.column] = rest * pivot.inverse
        return x

    def kept(self) -> list[Node]:
        """What `solve` needs besides numbers, each once."""
        found = {node.index: node for pivot in self.pivots for node in _parts(pivot) if not node.is_constant}
        return list(found.values())

    def read(self, kept: Mapping[int, Node]) -> Factors:
        """The same with inputs, by the index of what they stand for, in the place of `kept`."""

        def one(node: Node) -> Node:
            return kept.get(node.index, node)

        pivots = tuple(
            Pivot(
                pivot.row, pivot.column, one(pivot.inverse),
                tuple((row, one(node)) for row, node in pivot.lower),
                tuple((column, one(node)) for column, node in pivot.upper),
            )
            for pivot in self.pivots
        )  # fmt: skip
        return Factors(pivots, self.sound, self.weakest)


def _parts(pivot: Pivot) -> Iterator[Node]:
    yield pivot.inverse
    yield from (node for _, node in (*pivot.lower, *pivot.upper))


def factors(
    matrix: Sequence[Sequence[Node]], coordinates: int, most: float = inf, massless: Collection[int] = (),
    loss: float | None = None,
) -> Factors | None:  # fmt: skip
    """Eliminate a matrix whose first rows and columns belong to coordinates, the others to rows and multipliers.

    None where the pivots named above do not suffice, a pivot being an exact zero, or where factors and one solution
    take more than about so many operations. `loss` is the part of its terms that a pivot
    keeps, `HALF_PRECISION_RTOL` by default [-].
    """
    kinds = [[_kind(entry) for entry in line] for line in matrix]
    tries = (_order(kinds, coordinates, first, massless) for first in (False, True))
    found = [order for order in tries if order is not None]
    if not found or min(found)[0] > most:
        return None
    work = _Elimination(matrix, coordinates, HALF_PRECISION_RTOL if loss is None else loss)
    for row, column in min(found)[1]:
        if work.A[row][column].is_zero:
            return None
        work.eliminate(row, column)
    return work.result()


# order --------------------------------------------------------------------------------------------------------------
NOTHING, NUMBER, EXPRESSION = range(3)
"""Kinds of entries."""

Places = tuple[tuple[int, int], ...]
"""Rows and columns of pivots, in turn."""


def _kind(entry: Node) -> int:
    if entry.is_zero:
        return NOTHING
    return NUMBER if entry.is_constant and 0.1 < abs(entry.data) < 10.0 else EXPRESSION


def _order(
    kinds: Sequence[Sequence[int]], coordinates: int, pairs_first: bool, massless: Collection[int]
) -> tuple[float, Places] | None:
    """What an elimination costs and its pivots, always the cheapest next; those by rows before all others on demand."""
    work = _Pattern(kinds, coordinates, massless)
    cost, places = 0.0, list[tuple[int, int]]()
    while work.rows:
        choices = [*work.pairs()] if pairs_first else [*work.pairs(), *work.single()]
        choices = choices or [*work.single()]
        if not choices:
            return None
        cheapest, _, chosen = min(choices)
        cost += cheapest
        for row, column in chosen:
            work.eliminate(row, column)
        places += chosen
    return cost, tuple(places)


class _Pattern:
    """Which entries are left, and of what kind."""

    def __init__(self, kinds: Sequence[Sequence[int]], coordinates: int, massless: Collection[int]) -> None:
        self.A, self.n = [list(line) for line in kinds], coordinates
        self.involved = {k: {c for c in range(coordinates) if kinds[k][c]} for k in range(coordinates, len(kinds))}
        self.barred = {k for k in massless if any(k in known for known in self.involved.values())}
        self.rows, self.columns = list(range(len(kinds))), list(range(len(kinds)))

    def single(self) -> Iterator[tuple[float, int, Places]]:
        """Pivots on the diagonal (cost, a place to settle ties, pivots), of rows after those of their coordinates."""
        for k in self.rows:
            may = k in self.columns and self.A[k][k] and k not in self.barred
            if may and self.involved.get(k, set()).isdisjoint(self.columns):
                yield self.cost(k, k), k, ((k, k),)

    def pairs(self) -> Iterator[tuple[float, int, Places]]:
        """Coordinate and multiplier by a row, where both pivots are numbers."""
        for row in self.rows:
            if row < self.n or row not in self.columns or self.A[row][row]:
                continue
            for k in self.columns:
                if k < self.n and k in self.rows and self.A[row][k] == self.A[k][row] == NUMBER:
                    yield self.cost(row, k) + self.cost(k, row, row, k), k, ((row, k), (k, row))

    def cost(self, row: int, column: int, without_row: int = -1, without_column: int = -1) -> float:
        """Operations of an elimination and of solving with it; a row and a column gone by then do not count."""
        below = [self.A[r][column] for r in self.rows if r not in (row, without_row) and self.A[r][column]]
        beside = [self.A[row][c] for c in self.columns if c not in (column, without_column) and self.A[row][c]]
        long, wide = below.count(EXPRESSION), beside.count(EXPRESSION)
        subtractions, products = len(below) * len(beside) + len(below) + len(beside), long * wide + long + wide
        # a division costs sixteen multiplications: all that follows waits for it
        return subtractions + products + (0.0 if self.A[row][column] == NUMBER else 16.0 + len(below))

    def eliminate(self, row: int, column: int) -> None:
        self.rows.remove(row)
        self.columns.remove(column)
        beside = [c for c in self.columns if self.A[row][c]]
        for known in self.involved.values():
            if row >= self.n > column and column in known:  # what the row says of the coordinate takes its place
                known |= self.involved[row]
        for r in self.rows:
            if self.A[r][column]:
                for c in beside:
                    self.A[r][c] = EXPRESSION


# factors ------------------------------------------------------------------------------------------------------------
class _Elimination:
    """A matrix under elimination: what is left of it, and of how much each pivot of a multiplier was made."""

    def __init__(self, matrix: Sequence[Sequence[Node]], coordinates: int, loss: float) -> None:
        self.A, self.loss = [list(line) for line in matrix], loss
        self.first = [line[k] for k, line in enumerate(matrix)]
        self.n = coordinates
        self.tape: Tape = matrix[0][0].tape
        self.terms: dict[int, Node] = {}
        self.rows, self.columns = list(range(len(matrix))), list(range(len(matrix)))
        self.pivots: list[Pivot] = []
        self.sound: Node = self.tape.one
        self.weakest: Node = self.tape.zero

    def eliminate(self, row: int, column: int) -> None:
        """Take one unknown out of the other equations."""
        pivot = self.A[row][column]
        if row == column:
            self.judge(row, pivot)
        self.rows.remove(row)
        self.columns.remove(column)
        inverse = self.tape.one / pivot
        lower = [(r, self.A[r][column] * inverse) for r in self.rows if not self.A[r][column].is_zero]
        upper = [(c, self.A[row][c]) for c in self.columns if not self.A[row][c].is_zero]
        for r, factor in lower:
            for c, entry in upper:
                change = factor * entry
                if r == c and r >= self.n:
                    self.terms[r] = self.terms.get(r, abs(self.first[r])) + abs(change)
                self.A[r][c] = self.A[r][c] - change
        self.pivots.append(Pivot(row, column, inverse, tuple(lower), tuple(upper)))
        if row == column and row >= self.n:
            self.weakest = self.tape.binary("max", self.weakest, abs(inverse))

    def judge(self, k: int, pivot: Node) -> None:
        """Compare a pivot with what it was made of: Σ|terms| of a multiplier, what it was before of a coordinate.

        One that has grown out of proportion tells that an earlier one was too small.
        """
        size, tape = abs(pivot), self.tape
        if k >= self.n:
            holds = (self.loss * self.terms.get(k, size) < size) & (size < 1e300)
        elif pivot is self.first[k]:
            holds = (size > 1e-300) & (size < 1e300)
        else:
            before = abs(self.first[k])
            holds = (self.loss * before < size) & (self.loss * size < before)
        self.sound = tape.binary("and", self.sound, holds)

    def result(self) -> Factors:
        tape = self.tape
        sound = tape.where(self.sound, tape.one, tape.zero)
        return Factors(tuple(self.pivots), sound, self.weakest)
