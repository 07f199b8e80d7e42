"""Accelerations and multipliers between the rows of a run, from the balance of forces at interpolated q and v.

Polynomials through stored multipliers have no better slopes than differences of neighbours, so that between long steps
they are far less accurate than the rows. The balance is as accurate as q and v,

``a(θ) = a*(θ) + (1 − θ) (a₀ − a*₀) + θ (a₁ − a*₁)``,  the same for λ and ż,

a* of `results.balance`, a₀ and a₁ of the rows: schemes whose rows do not satisfy it to round-off are met at both ends.

Stiff forces and poses next to a singular one magnify the error of interpolated positions by (ω h)². There the
polynomials through the stored values are better. What changes less when q and v are interpolated by polynomials of a
lower degree is taken.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.results.balance import Balance, Flags, Solved, put
from mbd.results.interpolation import Places
from mbd.results.record import Rows

__all__ = ["balanced"]

NEGLIGIBLE = 1e-9
"""Change of forces, over the forces, that decides nothing [-]."""


def balanced(balance: Balance, rows: Rows, places: Places, found: Rows, rougher: Rows) -> Rows:
    """The states `found` at places with accelerations and multipliers from the balance where these are the better ones.

    Parameters
    ----------
    rows : stored; found : interpolated states; rougher : the same by polynomials of a lower degree
    """
    inside = places.step > 0.0
    if not inside.any():
        return found
    here, there = balance.solve(found.part(inside)), balance.solve(rougher.part(inside))
    lower, upper, theta = places.lower[inside], places.upper[inside], places.theta[inside][:, None]
    (first, from_first), (last, from_last) = (_missed(balance, rows, lower, end) for end in (lower, upper))
    rate = here.rate + (1.0 - theta) * first[0] + theta * last[0]
    lam = here.lam + (1.0 - theta) * first[1] + theta * last[1]
    ours, others = found.part(inside), rougher.part(inside)
    good = here.sound & there.sound & from_first & from_last
    good &= _steadier(here, there, np.hstack([ours.a, ours.s]), np.hstack([others.a, others.s]), ours.lam, others.lam)
    chosen = inside.copy()
    chosen[inside] = good
    a, s = np.split(rate[good], [ours.a.shape[1]], axis=1)
    return replace(
        found, a=put(found.a, chosen, a), s=put(found.s, chosen, s), lam=put(found.lam, chosen, lam[good])
    )  # fmt: skip


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


def _steadier(here: Solved, there: Solved, rate: Matrix, rough_rate: Matrix, lam: Matrix, rough_lam: Matrix) -> Flags:
    """Where the balance changes less with the degree of interpolation than polynomials through rates and multipliers.

    Accelerations are weighed by inertia.
    """
    least = NEGLIGIBLE * _size(here.load)
    moved = _size(np.einsum("kij,kj->ki", here.inertia, here.rate - there.rate))
    bent = _size(np.einsum("kij,kj->ki", here.inertia, rate - rough_rate))
    pushed, bowed = _size(here.lam - there.lam), _size(lam - rough_lam)
    return np.asarray((moved <= bent + least) & (pushed <= bowed + NEGLIGIBLE * _size(here.lam) + least))


def _size(values: Matrix) -> Vector:
    return np.asarray(np.linalg.norm(values, axis=1))
