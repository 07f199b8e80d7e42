"""Accelerations and multipliers between the rows of a run, from the balance of forces at interpolated q and v.

Polynomials through stored multipliers have no better slopes than differences of neighbours, so that between long steps
they are far less accurate than the rows. The balance is as accurate as q and v,

``a(θ) = a*(θ) + (1 − θ) (a₀ − a*₀) + θ (a₁ − a*₁)``,  the same for λ and ż,

a* of `results.balance`, a₀ and a₁ of the rows: schemes whose rows do not satisfy it to round-off are met at both ends.

Stiff forces and poses next to a singular one magnify the error of interpolated positions by (ω h)². There the
polynomials through the stored values are better. What changes less when q and v are interpolated by polynomials of a
lower degree is taken.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.equal import EQUAL_RTOL
from mbd.results.balance import Balance, Flags, put
from mbd.results.polynomials import CHUNK, Places
from mbd.results.record import Rows

POINTS = np.array([0.2, 0.5, 0.8])
"""Where in an interval both are compared [-]."""
NOT_EVALUATED = -1
"""Of an interval that was not asked for yet."""


States = Callable[[Places], tuple[Rows, Rows]]
"""Interpolated states at places, and the same by polynomials of a lower degree."""


class Forces:
    """Accelerations and multipliers between the rows of a run."""

    def __init__(self, balance: Balance, rows: Rows, states: States) -> None:
        self.balance, self.rows, self.states = balance, rows, states
        self._known = np.full(len(rows), NOT_EVALUATED, dtype=np.int8)  # of each interval, by the row that begins it

    def at(self, places: Places) -> Rows:
        """The states at places, with accelerations and multipliers from the balance where these are the better ones."""
        found, _ = self.states(places)
        inside = np.flatnonzero((places.step > 0.0) & self._serves(places))
        if not len(inside):
            return found
        here = self.balance.solve(found.part(inside))
        lower, upper, theta = places.lower[inside], places.upper[inside], places.theta[inside][:, None]
        (first, from_first), (last, from_last) = (_missed(self.balance, self.rows, lower, k) for k in (lower, upper))
        rate = here.rate + (1.0 - theta) * first[0] + theta * last[0]
        lam = here.lam + (1.0 - theta) * first[1] + theta * last[1]
        good = here.sound & from_first & from_last
        chosen = np.zeros(len(found), dtype=bool)
        chosen[inside[good]] = True
        a, s = np.split(rate[good], [found.a.shape[1]], axis=1)
        return replace(
            found, a=put(found.a, chosen, a), s=put(found.s, chosen, s), lam=put(found.lam, chosen, lam[good])
        )  # fmt: skip

    def _serves(self, places: Places) -> Flags:
        """Whether the balance is better than polynomials in the interval of each place; false where it meets a row."""
        asked = np.unique(places.lower[places.step > 0.0])
        fresh = asked[self._known[asked] == NOT_EVALUATED]
        for part in np.array_split(fresh, -(-len(fresh) // CHUNK)) if len(fresh) else ():
            self._known[part] = self._steadier(part)
        return np.asarray(self._known[places.lower] == 1)

    def _steadier(self, lower: Any) -> Flags:
        """Where the balance changes less with the degree of interpolation than the polynomials, (k,) intervals.

        Both are compared at several points of an interval: at some a difference may pass zero. Accelerations are
        weighed by inertia and count together with multipliers, which may be a little steadier where they are wild.
        """
        time = self.rows.time
        begin, step = np.repeat(lower, len(POINTS)), np.repeat(time[lower + 1] - time[lower], len(POINTS))
        theta = np.tile(POINTS, len(lower))
        found, rougher = self.states(Places(time[begin] + theta * step, begin, begin + 1, theta, step))
        here, there = self.balance.solve(found), self.balance.solve(rougher)
        rate, rough_rate = np.hstack([found.a, found.s]), np.hstack([rougher.a, rougher.s])
        moved = _largest(np.einsum("kij,kj->ki", here.inertia, here.rate - there.rate))
        bent = _largest(np.einsum("kij,kj->ki", here.inertia, rate - rough_rate))
        pushed, bowed = _largest(here.lam - there.lam), _largest(found.lam - rougher.lam)
        least = EQUAL_RTOL * (_largest(here.load) + _largest(here.lam))
        sound = (here.sound & there.sound).reshape(-1, len(POINTS)).all(axis=1)
        steady = moved + pushed <= bent + bowed + least
        return np.asarray(sound & steady)


def _missed(balance: Balance, rows: Rows, lower: Any, ends: Any) -> tuple[tuple[Matrix, Matrix], Flags]:
    """What stored rates and multipliers differ from the balance at the end of each interval, and where that is known.

    The contacts and frictions are those of the interval, which begins at `lower`.
    """
    pairs, place = np.unique(np.column_stack([lower, ends]), axis=0, return_inverse=True)
    begin, end = pairs.T
    at = rows.part(end)
    at = replace(at, **{name: getattr(rows, name)[begin] for name in ("closed", "phase", "anchors", "source")})
    solved = balance.solve(at)
    place = place.ravel()
    rate = np.hstack([at.a, at.s]) - solved.rate
    return (rate[place], (at.lam - solved.lam)[place]), solved.sound[place]


def _largest(values: Matrix) -> Vector:
    """The largest size of vectors over the points of each interval (k,)."""
    return np.asarray(np.max(np.linalg.norm(values, axis=1).reshape(-1, len(POINTS)), axis=1))
