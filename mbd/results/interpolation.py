"""Values between stored rows: cubic Hermite within a smooth segment, never across a switch."""

from dataclasses import field, replace
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from mbd.arrays import Matrix, Vector
from mbd.bodies.values import among
from mbd.dataclass import dataclass
from mbd.equal import ROUND_OFF_RTOL
from mbd.errors import TrajectoryError
from mbd.results.charts import Charts
from mbd.results.osculating import osculating
from mbd.results.polynomials import Index, Places, hermite, hermite_rate, parabola, quintics, theta_and_step
from mbd.results.record import Rows

Side = Literal["left", "right", "before", "after"]
OneSide = Literal["after", "before"]


@dataclass(frozen=True, eq=False)
class Grid:
    """The times of the stored rows; two equal neighbours are the two sides of a switch."""

    time: Vector
    _slopes: dict[int, tuple[Matrix, Matrix]] = field(default_factory=dict, repr=False)
    """Slopes of whole columns that are asked for again and again, by the identity of the columns, which are kept."""
    _last: dict[bool, Places] = field(default_factory=dict, repr=False)
    """The places that were asked for last, of either side: what is known of states there is known by them."""

    @property
    def cuts(self) -> Index:
        """First row of each smooth segment, and the number of rows."""
        jumps = np.flatnonzero(np.diff(self.time) <= 0.0) + 1
        return np.concatenate([[0], jumps, [len(self.time)]]).astype(np.intp)

    def places(self, times: ArrayLike, side: Side = "right") -> Places:
        """Where times lie; at a switch, the row after it (side 'right' or 'after') or before it ('left', 'before')."""
        if not among(side, ("left", "right", "before", "after")):
            raise TrajectoryError(f"side is 'left' or 'before', 'right' or 'after' (a switch), got {side!r}")
        wanted = np.atleast_1d(np.asarray(times, dtype=np.float64)).ravel()
        first, last = float(self.time[0]), float(self.time[-1])
        slack = ROUND_OFF_RTOL * max(abs(first), abs(last))
        outside = ~((wanted >= first - slack) & (wanted <= last + slack))
        if outside.any():
            bad = wanted[outside][0]
            raise TrajectoryError(f"t = {bad:g} s is outside the run, which covers {first:g} s to {last:g} s")
        wanted, behind = np.clip(wanted, first, last), side in ("right", "after")
        known = self._last.get(behind)
        if known is not None and np.array_equal(known.time, wanted):
            return known
        if behind:
            lower = np.searchsorted(self.time, wanted, side="right") - 1
            upper = np.minimum(lower + 1, len(self.time) - 1)
            lower = np.where(upper == lower, upper, lower)
            exact = self.time[lower] == wanted
            upper = np.where(exact, lower, upper)
        else:
            upper = np.searchsorted(self.time, wanted, side="left")
            lower = np.maximum(upper - 1, 0)
            exact = self.time[upper] == wanted
            lower = np.where(exact, upper, lower)
        step = self.time[upper] - self.time[lower]
        theta = np.divide(wanted - self.time[lower], step, out=np.zeros_like(wanted), where=step > 0)
        found = self._last[behind] = Places(wanted, lower.astype(np.intp), upper.astype(np.intp), theta, step)
        return found

    def middles(self) -> tuple[Index, Places]:
        """The rows that begin an interval of positive length, and the middles of these intervals."""
        lower = np.flatnonzero(np.diff(self.time) > 0.0).astype(np.intp)
        step = self.time[lower + 1] - self.time[lower]
        return lower, Places(self.time[lower] + step / 2, lower, lower + 1, np.full(len(lower), 0.5), step)

    @np.errstate(all="ignore")
    def slopes(self, values: Matrix) -> Matrix:
        """Rates of change by three-point differences within each smooth segment."""
        rates = np.zeros_like(values, dtype=np.float64)
        if values.size == 0:
            return rates
        cuts = self.cuts
        for start, stop in pairwise(cuts):
            if stop - start >= 2:
                order: Literal[1, 2] = 2 if stop - start > 2 else 1
                rates[start:stop] = np.gradient(values[start:stop], self.time[start:stop], axis=0, edge_order=order)
        return rates

    def _slopes_of(self, multipliers: Matrix) -> Matrix:
        """The slopes of the run's multipliers, made once however often states between the rows are asked for."""
        kept = self._slopes.get(id(multipliers))
        if kept is None:
            self._slopes.clear()
            kept = self._slopes[id(multipliers)] = multipliers, self.slopes(multipliers)
        return kept[1]

    def between(
        self, rows: Rows, places: Places, q_rate: Matrix, smooth: bool = False, charts: Charts | None = None,
        loads: bool = True,
    ) -> Rows:  # fmt: skip
        """The states at places between the rows.

        q by Hermite with q̇, v with v̇, z with ż; accelerations and ż are the slopes of those
        curves; multipliers, where `loads` count, by Hermite with three-point slopes; contacts, frictions and anchors as
        they hold in the interval. `smooth`, for rows whose accelerations are as accurate as the rest and q̇ = v: q of
        degree 8 through three rows, v and v̇ its slopes, and z of degree 5 (`results.osculating`). Where
        coordinates do not add, `charts` interpolate q, v and v̇ (`results.charts`).
        """
        low, high = places.lower, places.upper
        ends = (rows.v[low], rows.a[low], rows.v[high], rows.a[high])
        states = (rows.z[low], rows.s[low], rows.z[high], rows.s[high])
        if charts is not None:
            q, v, a = charts.between(rows, places, smooth)
            z, change = hermite(places, *states), hermite_rate(places, *states)
            if smooth:
                z, change = osculating(rows.time, places, (rows.z, rows.s)).values
        elif smooth:
            q, v, a = osculating(rows.time, places, (rows.q, rows.v, rows.a)).values
            z, change = osculating(rows.time, places, (rows.z, rows.s)).values
        else:
            z, change = hermite(places, *states), hermite_rate(places, *states)
            q, v, a = places.blend(rows.q, q_rate), hermite(places, *ends), hermite_rate(places, *ends)
        lam = places.blend(rows.lam, self._slopes_of(rows.lam)) if loads else rows.lam[low]
        return replace(rows.part(low), time=places.time, q=q, v=v, z=z, a=a, s=change, lam=lam)

    def rougher(self, rows: Rows, places: Places, found: Rows, plain: bool, smooth: bool) -> Rows:
        """What `between` has found, by polynomials of another degree: the difference tells the error of either.

        q, v and v̇ of degree 5 where q̇ = v (`plain`), else v of degree 2; z of degree 3 (`smooth`) or 2; multipliers
        along straight lines.
        """
        low, high = places.lower, places.upper
        if plain:
            q, v, a = quintics(places, rows.q, rows.v, rows.a)
        else:
            q, (v, a) = found.q, parabola(places, rows.v[low], rows.a[low], rows.v[high])
        states = (rows.z[low], rows.s[low], rows.z[high])
        z, change = parabola(places, *states)
        if smooth:
            z, change = hermite(places, *states, rows.s[high]), hermite_rate(places, *states, rows.s[high])
        x, _ = theta_and_step(places, rows.lam)
        lam = (1.0 - x) * rows.lam[low] + x * rows.lam[high]
        return replace(found, q=q, v=v, z=z, a=a, s=change, lam=lam)
