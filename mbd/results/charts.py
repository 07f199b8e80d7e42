"""States between the rows of a run whose coordinates do not add, interpolated in the chart of the row before.

The expressions are those of the joints, ⊕, ⊖, N and D (`mbd.configuration`), so that a run that is read from a file
gives the same bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from mbd.arrays import Matrix
from mbd.compile.python import array_function
from mbd.dataclass import dataclass
from mbd.equations.charts import chart_maps
from mbd.results.polynomials import Places, hermite, hermite_rate, quintics
from mbd.results.record import Rows
from mbd.tape.node import Node


@dataclass(frozen=True, eq=False)
class Charts:
    """The operations of a configuration as expressions of q, x, v and a second q, the inputs ('q', n_q + k).

    compose, difference : q ⊕ x (n_q) and other ⊖ q (n_v)
    rates : ẋ = D⁻¹ v (n_v); velocities : v = D ẋ (n_v) with ẋ in the place of v
    accelerations : ẍ (n_v) by x, v and v̇; turned : v̇ by x, ẋ and ẍ in the places of v and v̇
    """

    compose: tuple[Node, ...]
    difference: tuple[Node, ...]
    rates: tuple[Node, ...]
    velocities: tuple[Node, ...]
    accelerations: tuple[Node, ...]
    turned: tuple[Node, ...]

    @classmethod
    def of(cls, equations: Any) -> Charts | None:
        """Those of a set of equations; None where coordinates add, or where they are not known."""
        if not equations.compose or "charts" in equations.memory:
            found: Charts | None = equations.memory.get("charts")
            return found
        equations.memory["charts"] = made = cls(*chart_maps(equations))
        return made

    @property
    def nodes(self) -> tuple[Node, ...]:
        """All of them, in order."""
        parts = (self.compose, self.difference, self.rates, self.velocities, self.accelerations, self.turned)
        return tuple(node for part in parts for node in part)

    @classmethod
    def from_nodes(cls, nodes: Sequence[Node], n_q: int, n_v: int) -> Charts:
        """Those of `nodes`."""
        ends = [0, *(n_q + k * n_v for k in range(6))]
        return cls(*(tuple(nodes[a:b]) for a, b in pairwise(ends)))

    # values at many places ----------------------------------------------------------------------------------------
    def composed(self, q: Matrix, x: Matrix) -> Matrix:
        """q ⊕ x (k, n_q)."""
        return self._at(self.compose, q=q, x=x)

    def increments(self, q: Matrix, other: Matrix) -> Matrix:
        """other ⊖ q (k, n_v)."""
        return self._at(self.difference, q=np.hstack([q, other]))

    def increment_rates(self, x: Matrix, v: Matrix) -> Matrix:
        """ẋ (k, n_v)."""
        return self._at(self.rates, x=x, v=v)

    @staticmethod
    def _at(nodes: Sequence[Node], **inputs: Matrix) -> Matrix:
        return np.column_stack(array_function(nodes)(inputs, np.zeros(0)))

    # between rows -------------------------------------------------------------------------------------------------
    def between(self, rows: Rows, places: Places, smooth: bool) -> tuple[Matrix, Matrix, Matrix]:
        """q, v and v̇ at places: x by a cubic and v by another; `smooth`: x of degree 5, v and v̇ its slopes."""
        low, high = places.lower, places.upper
        inside = (places.step > 0.0)[:, None]
        q, v, a = rows.q[low], rows.v[low], rows.a[low]
        end = self.increments(q, rows.q[high])
        rate = self.increment_rates(end, rows.v[high])
        still = np.zeros_like(end)
        if not smooth:
            x = hermite(places, still, v, end, rate)
            ends = (v, a, rows.v[high], rows.a[high])
            v, a = hermite(places, *ends), hermite_rate(places, *ends)
            return np.where(inside, self.composed(q, x), q), v, a
        bent = self._at(self.accelerations, x=end, v=rows.v[high], a=rows.a[high])
        count = len(low)
        spans = Places(places.time, np.arange(count), count + np.arange(count), places.theta, places.step)
        x, speed, change = quintics(spans, np.vstack([still, end]), np.vstack([v, rate]), np.vstack([a, bent]))
        found = self._at(self.velocities, x=x, v=speed)
        turned = self._at(self.turned, x=x, v=speed, a=change)
        return tuple(np.where(inside, *pair) for pair in ((self.composed(q, x), q), (found, v), (turned, a)))  # type: ignore[return-value]
