"""How far a run is from another: events matched, quantities compared away from them, event times apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Vector

if TYPE_CHECKING:
    from mbd.trajectory import EventRecord, Trajectory

__all__ = ["Difference", "Matches", "aligned", "apart", "differences", "gaps", "matched", "ranges"]

ALONE = 0.01
"""What an event without a match costs, as a shift relative to the length of the run [-]."""
MANY = 400
"""Events of one name above which the k-th is matched with the k-th."""
BESIDE = 1e-9
"""Instants this close to an event are left out too, relative to the length of the run [-]."""


@dataclass(frozen=True)
class Difference:
    """What sets a run apart from a reference.

    Parameters
    ----------
    largest, at_end : by quantity, relative to its range: the largest over the instants, and at the end [-]
    event_time : largest shift of an event that both runs have [s]
    same_events : whether the same contacts and events happened, as often
    left_out : share of the instants that lie between an event and its match, where one run has switched and the other
        has not [-]
    """

    largest: Mapping[str, float]
    at_end: Mapping[str, float]
    event_time: float
    same_events: bool
    left_out: float

    @property
    def error(self) -> float:
        """The largest of all quantities and instants [-]."""
        return max([*self.largest.values(), *self.at_end.values()], default=0.0)


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
        found, left = aligned(ours.get(key, []), theirs.get(key, []), ALONE * (end - begin))
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
        len(first) > MANY or sum(abs(a - b) for a, b in zip(first, second, strict=True)) <= 2.0 * price
    ):
        return list(zip(first, second, strict=True)), []
    if max(len(first), len(second)) > MANY:
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


def ranges(run: Trajectory, names: Sequence[str], instants: Vector) -> dict[str, float]:
    """Largest less least value of each quantity, by which its error is divided; its size, or 1, where it rests."""
    found = {}
    for name, values in run.at(instants).read(*names).items():
        known = values[np.isfinite(values)]
        swing, size = float(np.ptp(known)) if known.size else 0.0, float(np.max(np.abs(known), initial=0.0))
        found[name] = swing if swing > 1e-9 * size else size or 1.0
    return found


def differences(run: Trajectory, reference: Trajectory, scales: Mapping[str, float], instants: Vector) -> Difference:
    """Compare a run with a reference at common instants; between its steps a run is what ``run.at`` gives.

    Instants between an event of one run and its match in the other are left out, where values differ by the whole jump
    whatever the scheme; the shift of the event is told apart. `at_end` compares the last rows, which for runs that end
    by an event are those of two instants.
    """
    begin, end = float(reference.time[0]), min(float(run.time[-1]), float(reference.time[-1]))
    found = matched(run.events, reference.events, begin, end)
    pairs = found.pairs + found.late
    inside = instants[instants <= end]
    keep = apart(inside, pairs, BESIDE * (end - begin))
    compared = gaps(run, reference, scales, inside[keep], inside[keep]) if keep.any() else {}
    ends = {} if found.late else gaps(run, reference, scales, run.time[-1:], reference.time[-1:])
    return Difference(
        {name: float(np.nanmax(gap, initial=0.0)) for name, gap in compared.items()},
        {name: float(gap[0]) for name, gap in ends.items() if np.isfinite(gap[0])},
        max((abs(a - b) for a, b in pairs), default=0.0),
        found.alone == 0,
        1.0 - float(np.mean(keep)) if len(keep) else 1.0,
    )


def apart(instants: Vector, pairs: Sequence[tuple[float, float]], beside: float) -> NDArray[np.bool_]:
    """Which instants do not lie between the two times of an event."""
    keep = np.ones(len(instants), dtype=bool)
    for ours, theirs in pairs:
        keep &= (instants < min(ours, theirs) - beside) | (instants > max(ours, theirs) + beside)
    return keep


def gaps(
    run: Trajectory, reference: Trajectory, scales: Mapping[str, float], ours: Vector, theirs: Vector
) -> dict[str, Vector]:
    """|difference| over range of each quantity."""
    first, second = run.at(ours).read(*scales), reference.at(theirs).read(*scales)
    return {name: np.abs(first[name] - second[name]) / scale for name, scale in scales.items()}
