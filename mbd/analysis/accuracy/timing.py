"""Processor time of runs, measured so that what else the machine does spoils no comparison."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from time import perf_counter

from mbd.analysis.accuracy.points import Point

__all__ = ["folds", "retimed"]

MAX_ROUNDS, MIN_TIMED_SECONDS = 10, 0.3
"""Rounds over all points, the quickest first, that time each once more until it took this much time [s]."""

COUNTS = ("steps", "iterations", "tangents", "residuals", "factorizations", "events")
"""What a run does: one that does no less of anything takes no less time."""


def retimed(
    points: Sequence[Point], once: Callable[[Point], float], patience: float, share: Callable[[float], None]
) -> list[Point]:
    """The points with the least time of some more rounds over all of them.

    Whatever else the machine did during one point's repeats then spoils no comparison. Neighbours of a scheme of which
    the one with more work takes less time (`folds`) are timed again and again until they do not, or patience ends.

    Parameters
    ----------
    once : time of one more run of a point [s]
    patience : wall time for all rounds [s]
    """
    found, began = list(points), perf_counter()
    places = sorted((k for k, point in enumerate(found) if not point.failure), key=lambda k: found[k].seconds)

    def again(chosen: Sequence[int], turn: int, until: float) -> bool:
        """Whether there was time to run them all once more."""
        for place in chosen:
            point, spent = found[place], perf_counter() - began
            if spent + point.seconds >= until:
                return False
            share(min(spent / patience, 1.0))
            if turn * point.seconds <= MIN_TIMED_SECONDS:
                found[place] = replace(point, seconds=min(point.seconds, once(point)))
        return True

    for turn in range(MAX_ROUNDS):
        if not again(places, turn, 0.8 * patience):
            break
    for _ in range(MAX_ROUNDS):
        folded = sorted({place for pair in folds(found) for place in pair})
        if not folded or not again(folded, 0, patience):
            break
    return found


def folds(points: Sequence[Point]) -> list[tuple[int, int]]:
    """Places of neighbours of a scheme, of which the second does no less of anything and yet takes less time."""
    lines: dict[str, list[int]] = {}
    for place, point in enumerate(points):
        if not point.failure and point.dt is not None:
            lines.setdefault(point.scheme, []).append(place)
    return [
        (first, second)
        for line in lines.values()
        for first, second in pairwise(sorted(line, key=lambda place: -(points[place].dt or 0.0)))
        if points[second].seconds < points[first].seconds
        and all(getattr(points[second], name) >= getattr(points[first], name) for name in COUNTS)
    ]
