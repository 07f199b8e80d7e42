"""In which order to eliminate a large sparse matrix, and which entries that makes other than zero.

The rules are those of `mbd.tape.elimination`, for matrices too large for straight-line code: ``[S R; H 0]`` with S
about symmetric and definite, always the cheapest pivot next (Markowitz 1957, Management Science 3:255) among

- coordinates by their own equations,
- multipliers by their own rows, once all coordinates of these rows are eliminated,
- a coordinate and a multiplier by a row and an equation whose entries for each other are numbers.

Costs are products of how many entries a row and a column have besides the pivot; they are kept up to date by sets, so
that an order takes little more time than the elimination has entries.
"""

from collections.abc import Collection, Iterable
from heapq import heappop, heappush

from mbd.dataclass import dataclass

Place = tuple[int, int]
"""A row and a column."""


@dataclass(frozen=True)
class Order:
    """Pivots in turn, and the factors row by row.

    rows, columns : of the pivots
    entries : of each pivot's row, the turns at which its columns are eliminated, ascending, fill-in included
    operations : multiplications of a factorization and one solution
    """

    rows: tuple[int, ...]
    columns: tuple[int, ...]
    entries: tuple[tuple[int, ...], ...]
    operations: int


def order(places: Iterable[Place], numbers: Collection[Place], coordinates: int, size: int) -> Order | None:
    """The order for a matrix with entries at these places, some of which are numbers of about one; None if stuck.

    The first rows and columns belong to coordinates, the others to rows and multipliers.
    """
    work = _Pattern(places, numbers, coordinates, size)
    while work.left:
        chosen = work.cheapest()
        if chosen is None:
            return None
        for row, column in chosen:
            work.eliminate(row, column)
    turn = {column: k for k, column in enumerate(work.columns)}
    entries = tuple(tuple(sorted(turn[column] for column in work.whole[row])) for row in work.rows)
    return Order(tuple(work.rows), tuple(work.columns), entries, work.operations)


class _Pattern:
    """Which entries are left.

    along, down : columns of each row and rows of each column that are left; whole: columns of each row with fill-in
    waiting : coordinates of each row that must go before its multiplier
    costs : of every pivot, or pair of pivots, that may be next; ranked: the same as a heap, with some that are past
    of : pivots and pairs by unknown or row; stale: rows and columns whose costs have changed
    """

    def __init__(self, places: Iterable[Place], numbers: Collection[Place], coordinates: int, size: int) -> None:
        self.n, self.left = coordinates, size
        self.along: list[set[int]] = [set() for _ in range(size)]
        self.down: list[set[int]] = [set() for _ in range(size)]
        for row, column in places:
            self.along[row].add(column)
            self.down[column].add(row)
        self.whole = [set(line) for line in self.along]
        self.numbers = set(numbers)
        self.waiting = [
            {c for c in self.along[k] if c < coordinates} if k >= coordinates else set() for k in range(size)
        ]
        self.rows: list[int] = []
        self.columns: list[int] = []
        self.gone_rows, self.gone_columns = set[int](), set[int]()
        self.operations = 0
        self.costs: dict[tuple[Place, ...], int] = {}
        self.ranked: list[tuple[int, tuple[Place, ...]]] = []
        self.of: list[set[tuple[Place, ...]]] = [set() for _ in range(size)]
        self.stale = set(range(size))

    def cheapest(self) -> tuple[Place, ...] | None:
        """The pivot, or pair of pivots, that makes the fewest products; of equals the first."""
        for k in self.stale:
            for one in self.of[k]:
                self.costs.pop(one, None)
            self.of[k].clear()
        for k in self.stale:
            for one in self._choices(k):
                cost = self._cost(one)
                if cost is not None and self.costs.get(one) != cost:
                    self.costs[one] = cost
                    heappush(self.ranked, (cost, one))
                    for unknown in one[0]:
                        self.of[unknown].add(one)
        self.stale.clear()
        while self.ranked and self.costs.get(self.ranked[0][1]) != self.ranked[0][0]:
            heappop(self.ranked)
        return self.ranked[0][1] if self.ranked else None

    def _choices(self, k: int) -> list[tuple[Place, ...]]:
        """Pivots and pairs that unknown or row k takes part in."""
        found: list[tuple[Place, ...]] = [((k, k),)]
        for other in self.along[k] | self.down[k]:
            row, column = max(k, other), min(k, other)
            if row >= self.n > column and (row, column) in self.numbers and (column, row) in self.numbers:
                found.append(((row, column), (column, row)))
        return found

    def _cost(self, pivots: tuple[Place, ...]) -> int | None:
        """Products of an elimination, None where it may not be next."""
        if any(row in self.gone_rows or column in self.gone_columns for row, column in pivots):
            return None
        if len(pivots) == 1:
            k = pivots[0][0]
            if k not in self.along[k] or self.waiting[k]:
                return None
            return (len(self.along[k]) - 1) * (len(self.down[k]) - 1)
        row, column = pivots[0]
        if row in self.along[row] or not set(pivots) <= self.numbers:
            return None
        first = (len(self.along[row]) - 1) * (len(self.down[column]) - 1)
        return first + (len(self.along[column]) - 1) * (len(self.down[row]) - 1)

    def eliminate(self, row: int, column: int) -> None:
        """Take a row and a column out, with what that fills in."""
        self.rows.append(row)
        self.columns.append(column)
        self.gone_rows.add(row)
        self.gone_columns.add(column)
        self.left -= 1
        beside, below = self.along[row] - {column}, self.down[column] - {row}
        self.operations += len(beside) * len(below) + len(beside) + 2 * len(below) + 1
        for c in (*beside, column):
            self.down[c].discard(row)
        for r in (*below, row):
            self.along[r].discard(column)
        for r in below:
            self.along[r] |= beside
            self.whole[r] |= beside
        for c in beside:
            self.down[c] |= below
        self.numbers.difference_update((r, c) for r in below for c in beside)
        touched = beside | below | {row, column}
        for k in range(self.n, len(self.waiting)):
            if column in self.waiting[k]:
                self.waiting[k].discard(column)
                if row >= self.n:  # what the row says of the coordinate takes its place
                    self.waiting[k] |= self.waiting[row] - self.gone_columns
                touched.add(k)
        self.stale |= touched
