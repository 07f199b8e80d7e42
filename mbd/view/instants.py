"""The times of a picture that moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.results.trajectory import Moments, Trajectory


@dataclass(frozen=True, eq=False)
class Instants:
    """Times to draw, a switch with both its sides: time (F,) [s], after (F,) True on the right side."""

    time: Vector
    after: NDArray[np.bool_]
    _moments: WeakKeyDictionary[Trajectory, dict[str, Moments]] = field(default_factory=WeakKeyDictionary, repr=False)

    @classmethod
    def of(cls, run: Trajectory, count: int) -> Instants:
        """`count` equal intervals of the run, and both sides of every event."""
        time = run.time
        inner = [event.time for event in run.events if time[0] < event.time <= time[-1]]
        even = np.linspace(time[0], time[-1], count + 1) if time[-1] > time[0] else time[:1]
        events = np.unique(inner)
        both = np.concatenate([even[~np.isin(even, events)], events, events])
        after = np.ones(len(both), dtype=bool)
        after[len(both) - 2 * len(events) : len(both) - len(events)] = False
        order = np.lexsort((after, both))
        return cls(both[order], after[order])

    def read(self, run: Trajectory, names: Sequence[str]) -> Matrix:
        """Named scalars at the instants, (F, names)."""
        found = np.empty((len(self.time), len(names)))
        moments = self._moments.setdefault(run, {})
        for side, chosen in (("right", self.after), ("left", ~self.after)):
            if side not in moments:
                moments[side] = run.at(self.time[chosen], side=side)  # type: ignore[arg-type]
            values = moments[side].read(*names)
            for column, name in enumerate(names):
                found[chosen, column] = values[name]
        return found

    def part(self, chosen: NDArray[np.int64]) -> Instants:
        """Some of them."""
        return Instants(self.time[chosen], self.after[chosen])

    def blend(self, run: Trajectory, column: Vector) -> Vector:
        """A column of the stored rows at the instants."""
        grid = run.columns.grid
        slopes, found = grid.slopes(column), np.empty(len(self.time))
        found[self.after] = grid.places(self.time[self.after], "right").blend(column, slopes)
        found[~self.after] = grid.places(self.time[~self.after], "left").blend(column, slopes)
        return found
