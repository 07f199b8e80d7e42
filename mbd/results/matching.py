"""Events of two runs, each with its like in the other."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Vector
from mbd.dataclass import dataclass
from mbd.results.record import EventRecord

MAX_ASSIGNED = 400
"""Events of one name above which the k-th is matched with the k-th."""


@dataclass(frozen=True)
class Matches:
    """Times of the same event in two runs; of one that comes after the end of the other; how many have no match."""

    pairs: tuple[tuple[float, float], ...]
    late: tuple[tuple[float, float], ...]
    alone: int


def matched(first: Sequence[EventRecord], second: Sequence[EventRecord], begin: float, end: float) -> Matches:
    """The events of two runs, each of a kind and name with one of the other run, in order of time.

    Several events of one instant may be logged in any order. An event that only one run has is none of the other's
    where it is closer to the end than others are shifted: there it would come after the end.
    """
    ours, theirs = _by_name(first), _by_name(second)
    pairs: list[tuple[float, float]] = []
    alone: list[float] = []
    for key in ours.keys() | theirs.keys():
        # an event without a match costs a shift by a hundredth of the run
        found, left = aligned(ours.get(key, []), theirs.get(key, []), 0.01 * (end - begin))
        pairs += found
        alone += left
    shift = max((abs(a - b) for a, b in pairs), default=0.0)
    late = [time for time in alone if end - time <= 2.0 * shift]
    return Matches(tuple(pairs), tuple((time, end) for time in late), len(alone) - len(late))


def aligned(first: list[float], second: list[float], price: float) -> tuple[list[tuple[float, float]], list[float]]:
    """Pairs of times in order, and those left alone, with the least sum of shifts, where one alone costs `price`.

    >>> aligned([1.0, 2.0, 3.0], [1.1, 3.1], price=0.5)
    ([(1.0, 1.1), (3.0, 3.1)], [2.0])
    """
    if len(first) == len(second) and (
        len(first) > MAX_ASSIGNED or sum(abs(a - b) for a, b in zip(first, second, strict=True)) <= 2.0 * price
    ):
        return list(zip(first, second, strict=True)), []
    if max(len(first), len(second)) > MAX_ASSIGNED:
        pairs = list(zip(first, second, strict=False))
        return pairs, first[len(pairs) :] + second[len(pairs) :]
    n, m = len(first), len(second)
    cost = [[price * (i + j) for j in range(m + 1)] for i in range(n + 1)]
    for i in range(1, n + 1):
        for j in range(1, m + 1):
            both = cost[i - 1][j - 1] + abs(first[i - 1] - second[j - 1])
            cost[i][j] = min(both, cost[i - 1][j] + price, cost[i][j - 1] + price)
    pairs, alone, i, j = [], [], n, m
    while i or j:
        if i and j and cost[i][j] == cost[i - 1][j - 1] + abs(first[i - 1] - second[j - 1]):
            i, j = i - 1, j - 1
            pairs.append((first[i], second[j]))
        elif i and cost[i][j] == cost[i - 1][j] + price:
            i -= 1
            alone.append(first[i])
        elif j and cost[i][j] == cost[i][j - 1] + price:
            j -= 1
            alone.append(second[j])
        else:  # along an edge of the table, whose costs are products
            alone += first[:i] + second[:j]
            break
    return pairs[::-1], alone[::-1]


def _by_name(events: Sequence[EventRecord]) -> dict[tuple[str, str], list[float]]:
    found: dict[tuple[str, str], list[float]] = {}
    for event in events:
        found.setdefault((event.kind, event.name), []).append(event.time)
    return found


def apart(instants: Vector, pairs: Sequence[tuple[float, float]], beside: float) -> NDArray[np.bool_]:
    """Which instants do not lie between the two times of an event."""
    keep = np.ones(len(instants), dtype=bool)
    for ours, theirs in pairs:
        keep &= (instants < min(ours, theirs) - beside) | (instants > max(ours, theirs) + beside)
    return keep
