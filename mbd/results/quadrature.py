"""Integrals over the stored rows of a run, more accurate than the schemes that made them.

Over one interval the integrand is the polynomial through its values at rows around, and through its rates where they
are known. Four rows with rates, or eight without, give an error of order 8; at the ends of a smooth stretch the same
number of rows is taken from one side, and stretches that are short or uneven give what their rows allow: two rows with
rates are ``∫ P dt = h/2 (P₀ + P₁) + h²/12 (Ṗ₀ − Ṗ₁)``, of order 4 (Davis & Rabinowitz 1984, ch. 2.9).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.equal import EQUAL_RTOL
from mbd.results.polynomials import CHUNK

ROWS_WITH_RATES, ROWS_WITHOUT = 4, 8
"""Rows that the polynomial goes through: eight conditions either way."""
MAX_LENGTH_RATIO = 8.0
"""Neighbouring intervals whose lengths differ by more than this factor lie on no common polynomial [-]."""

Index = NDArray[np.intp]


def stretches(time: Vector) -> tuple[Index, Index]:
    """First and last row of the stretch that each interval of positive length may look at.

    Returns
    -------
    (n,), (n,) for the n intervals, in the order of time; a stretch ends at a switch (two rows of one time) and where
    the length of steps jumps, as it does beside the instant of an event.
    """
    length = np.diff(time)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = length[1:] / length[:-1]
    joined = (length[1:] > 0.0) & (length[:-1] > 0.0) & (ratio < MAX_LENGTH_RATIO) & (ratio > 1.0 / MAX_LENGTH_RATIO)
    group = np.concatenate([[0], np.cumsum(~joined)]) if len(length) else np.zeros(0)
    begin = np.flatnonzero(length > 0.0)
    first = np.searchsorted(group, group[begin], side="left")
    last = np.searchsorted(group, group[begin], side="right")
    return first.astype(np.intp), last.astype(np.intp)


def cumulative(time: Vector, integrands: Sequence[tuple[Vector, Vector | None]]) -> list[Vector]:
    """∫ P dt from the first row to each row, (R,), of each integrand; nothing is added across a switch.

    Parameters
    ----------
    time : (R,) [s], equal at the two sides of a switch
    integrands : P at the rows, where those of the two sides of a switch may differ; and Ṗ, each as seen from its own
        side, or None where it is not known
    """
    known = {with_rates: _rules(time, with_rates) for with_rates in {rates is not None for _, rates in integrands}}
    found = []
    for values, rates in integrands:
        steps = np.zeros(len(time))
        for upper, rows, weights in known[rates is not None]:
            columns = values[rows] if rates is None else np.hstack([values[rows], rates[rows]])
            steps[upper] = np.sum(weights * columns, axis=1)
        found.append(np.cumsum(steps))
    return found


def _rules(time: Vector, with_rates: bool) -> list[tuple[Index, Index, Matrix]]:
    """Intervals in groups: their upper rows, the rows that each looks at, and the weights of these."""
    begin = np.flatnonzero(np.diff(time) > 0.0)
    if not len(begin):
        return []
    wanted = ROWS_WITH_RATES if with_rates else ROWS_WITHOUT
    first, last = _alike(time, begin, *stretches(time), wanted - 2)
    size = np.minimum(wanted, last - first + 1)
    left = np.clip(begin - (size - 2) // 2, first, last + 1 - size)
    found = []
    for count in np.unique(size):
        chosen = np.flatnonzero(size == count)
        rows = left[chosen, None] + np.arange(count)
        found.append((begin[chosen] + 1, rows, _weights(time, begin[chosen], rows, with_rates)))
    return found


def _alike(time: Vector, begin: Index, first: Index, last: Index, most: int) -> tuple[Index, Index]:
    """First and last row of each interval's stretch whose lengths differ by less than `MAX_LENGTH_RATIO`.

    Steps that become shorter each time, as friction comes to rest, lead out of any that is no longer like them.
    """
    length = np.diff(time)
    nearest, farthest = begin.copy(), begin + 1
    for bound, step in ((nearest, -1), (farthest, 1)):
        goes_on = np.ones(len(begin), dtype=bool)
        for away in range(1, most + 1):
            other = begin + step * away
            goes_on &= (other >= first) & (other < last)
            with np.errstate(divide="ignore", invalid="ignore"):
                ratio = length[np.clip(other, 0, len(length) - 1)] / length[begin]
            goes_on &= (ratio < MAX_LENGTH_RATIO) & (ratio > 1.0 / MAX_LENGTH_RATIO)
            bound[goes_on] += step
    return nearest, farthest


def _weights(time: Vector, begin: Index, rows: NDArray[np.intp], with_rates: bool) -> Matrix:
    """Factors of the values, and then of the rates, that give the integral over each interval."""
    length = time[begin + 1] - time[begin]
    place = (time[rows] - time[begin, None]) / length[:, None]
    offset = begin - rows[:, 0]
    even = np.all(np.abs(np.diff(place, axis=1) - 1.0) < EQUAL_RTOL, axis=1)
    found = np.empty((len(begin), rows.shape[1] * (2 if with_rates else 1)))
    for k in np.unique(offset[even]):
        found[even & (offset == k)] = _solved((np.arange(rows.shape[1]) - k)[None, :].astype(float), with_rates)
    odd = np.flatnonzero(~even)
    for part in np.array_split(odd, max(1, -(-len(odd) // CHUNK))):
        if len(part):
            found[part] = _solved(place[part], with_rates)
    found *= length[:, None]
    if with_rates:
        found[:, rows.shape[1] :] *= length[:, None]
    return found


def _solved(place: Matrix, with_rates: bool) -> Matrix:
    """Weights for ∫₀¹ that are exact for polynomials: ``Σ w_j x_jᵖ + Σ u_j p x_jᵖ⁻¹ = 1/(p + 1)``.

    Powers are taken about the middle of the rows, in half their distance, which keeps the equations well conditioned.
    """
    middle, half = 0.5 * (place[:, :1] + place[:, -1:]), 0.5 * (place[:, -1:] - place[:, :1])
    x, count = (place - middle) / half, place.shape[1] * (2 if with_rates else 1)
    power = np.arange(count)
    matrix = x[:, None, :] ** power[:, None]
    if with_rates:
        slopes = power[:, None] * x[:, None, :] ** np.maximum(power - 1, 0)[:, None] / half[:, :, None]
        matrix = np.concatenate([matrix, slopes], axis=2)
    low, high = (0.0 - middle) / half, (1.0 - middle) / half
    moments = half * (high ** (power + 1) - low ** (power + 1)) / (power + 1)
    return np.asarray(np.linalg.solve(matrix, moments[:, :, None])[:, :, 0])
