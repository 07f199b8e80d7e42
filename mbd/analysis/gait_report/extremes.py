"""The largest value of a result over an interval, between the rows too, on both sides of each event."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from mbd.arrays import Vector
from mbd.results.interpolation import OneSide

__all__ = ["largest"]

FEWEST = 9
"""Samples of a part between two events at least, and of each refinement [-]."""


def largest(values: Callable[[Vector, OneSide], Vector], begin: float, end: float, breaks: Sequence[float]) -> float:
    """The maximum of a function that is smooth between `breaks`, at which it may jump.

    1. each part is sampled from just after its beginning to just before its end;
    2. around the largest sample of all the function is sampled again between that sample's neighbours, several times.

    Parameters
    ----------
    values : of the function at times [s], 'after' or 'before' what happens there
    """
    knots = np.unique([begin, *(time for time in breaks if begin < time < end), end])
    best = (-np.inf, knots[:2])
    for first, last in pairwise(knots):
        # samples of the whole interval among which the largest is looked for first
        count = max(FEWEST, int(np.ceil(1001 * (last - first) / (end - begin))))
        found, times = _sampled(values, first, last, count)
        best = max(best, _around(found, times), key=lambda one: one[0])
    for _ in range(4):  # each four times as finely
        here, near = _around(*_sampled(values, float(best[1][0]), float(best[1][1]), FEWEST))
        best = max(best[0], here), near
    return float(best[0])


def _sampled(
    values: Callable[[Vector, OneSide], Vector], first: float, last: float, count: int
) -> tuple[Vector, Vector]:
    """The function from just after the first time to just before the last one."""
    times = np.linspace(first, last, count)
    return np.concatenate([values(times[:-1], "after"), values(times[-1:], "before")]), times


def _around(found: Vector, times: Vector) -> tuple[float, Vector]:
    """The largest sample, and the times of its neighbours."""
    place = int(np.argmax(found))
    return float(found[place]), times[[max(place - 1, 0), min(place + 1, len(times) - 1)]]
