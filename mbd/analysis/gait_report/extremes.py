"""The largest value of a result over an interval, between the rows too, on both sides of each event."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from mbd.arrays import Vector
from mbd.results.interpolation import OneSide

__all__ = ["largest"]

MIN_SAMPLES = 9
"""Samples of a part between two events at least, and of each refinement [-]."""


def largest(
    values: Callable[[Vector, OneSide], Vector], intervals: Sequence[tuple[float, float]], breaks: Sequence[float]
) -> list[float]:
    """The maximum in each interval of a function that is smooth between `breaks`, at which it may jump.

    1. each part of an interval is sampled from just after its beginning to just before its end;
    2. around the largest sample of all the function is sampled again between that sample's neighbours, several times.

    The samples of all intervals are asked for at once.

    Parameters
    ----------
    values : of the function at times [s], 'after' or 'before' what happens there
    """
    parts, owners = [], []
    for owner, (begin, end) in enumerate(intervals):
        knots = np.unique([begin, *(time for time in breaks if begin < time < end), end])
        for first, last in pairwise(knots):
            # samples of the whole interval among which the largest is looked for first
            count = max(MIN_SAMPLES, int(np.ceil(1001 * (last - first) / (end - begin))))
            parts.append(np.linspace(first, last, count))
            owners.append(owner)
    # of each interval the part with the largest sample
    best: dict[int, tuple[float, Vector]] = {}
    for owner, times, found in zip(owners, parts, _sampled(values, parts), strict=True):
        best[owner] = max(best.get(owner, (-np.inf, times[:2])), _around(found, times), key=lambda one: one[0])
    for _ in range(4):  # each four times as finely
        finer = [np.linspace(float(near[0]), float(near[1]), MIN_SAMPLES) for _, near in best.values()]
        for owner, times, found in zip(best, finer, _sampled(values, finer), strict=True):
            here, near = _around(found, times)
            best[owner] = max(best[owner][0], here), near
    return [float(best[owner][0]) for owner in range(len(intervals))]


def _sampled(values: Callable[[Vector, OneSide], Vector], parts: Sequence[Vector]) -> list[Vector]:
    """The function in each part, from just after its first time to just before its last one."""
    if not parts:
        return []
    inside = values(np.concatenate([times[:-1] for times in parts]), "after")
    ends = values(np.array([times[-1] for times in parts]), "before")
    split = np.split(inside, np.cumsum([len(times) - 1 for times in parts])[:-1])
    return [np.append(found, end) for found, end in zip(split, ends, strict=True)]


def _around(found: Vector, times: Vector) -> tuple[float, Vector]:
    """The largest sample, and the times of its neighbours."""
    place = int(np.argmax(found))
    return float(found[place]), times[[max(place - 1, 0), min(place + 1, len(times) - 1)]]
