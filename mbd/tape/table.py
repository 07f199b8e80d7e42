"""Piecewise cubics of one variable, stored beside the parameters."""

import math
from bisect import bisect_right
from collections.abc import Sequence

from mbd.equal import ROUND_OFF_RTOL


class Table:
    """A piecewise cubic of one variable, stored beside the parameters and looked up at run time.

    ``value(x) = Σ_k coefficients[i, k] (x − breaks[i])^k`` on interval i; outside, the first and last pieces go on,
    so give the first and last piece the extrapolation wanted (`mbd.tape.interpolation` does).

    Parameters
    ----------
    name : the user's name of it
    breaks : n increasing abscissae
    coefficients : n rows of 4; row i belongs to ``[breaks[i], breaks[i+1])``, row 0 also to the left of it
    index : its place among the tables of its tape
    jumps : (n − 1) the lowest derivative that jumps where row i begins, i ≥ 1, 4 for none; by default it is measured
    """

    __slots__ = ("_jumps", "breaks", "coefficients", "index", "name")

    def __init__(
        self,
        name: str,
        breaks: Sequence[float],
        coefficients: Sequence[Sequence[float]],
        index: int = 0,
        jumps: Sequence[int] | None = None,
    ) -> None:
        self.name, self.index = name, index
        self.breaks = tuple(float(x) for x in breaks)
        self.coefficients = tuple(tuple(float(c) for c in row) for row in coefficients)
        self._jumps = None if jumps is None else tuple(jumps)

    @property
    def jumps(self) -> tuple[int, ...]:
        """The lowest derivative that jumps at each break but the first; 4 where none does."""
        if self._jumps is None:
            self._jumps = tuple(map(self._jump, range(1, len(self.breaks))))
        return self._jumps

    def _jump(self, piece: int) -> int:
        """The lowest derivative that jumps by more than round-off where a piece begins; 4 for none."""
        before, after = self.coefficients[piece - 1], self.coefficients[piece]
        width = self.breaks[piece] - self.breaks[piece - 1]
        sizes = [max(abs(row[k]) for row in self.coefficients[piece - 1 : piece + 1]) * width**k for k in range(4)]
        for order in range(4):
            left = sum(math.comb(k, order) * before[k] * width ** (k - order) for k in range(order, 4))
            if abs(left - after[order]) * width**order > ROUND_OFF_RTOL * sum(sizes):
                return order
        return 4

    @property
    def flat(self) -> list[float]:
        """Storage of ``5 n`` numbers: breaks, then the rows of coefficients."""
        return [*self.breaks, *(c for row in self.coefficients for c in row)]

    def value(self, x: float, order: int = 0) -> float:
        """The `order`-th derivative at x (plain reference).

        >>> Table("ramp", [0.0, 1.0], [[0.0, 2.0, 0.0, 0.0], [2.0, 0.0, 0.0, 0.0]]).value(0.25)
        0.5
        """
        piece = max(bisect_right(self.breaks, x) - 1, 0)
        s, row = x - self.breaks[piece], self.coefficients[piece]
        total = 0.0
        for k in range(3, order - 1, -1):
            total = total * s + math.perm(k, order) * row[k]
        return total
