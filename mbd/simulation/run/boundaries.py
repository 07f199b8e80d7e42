"""Instants at which steps must end: samples of controllers, jumps and kinks of signals in time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.errors import ModelError
from mbd.kernel import codes

__all__ = ["Boundaries", "without_sharing"]

NEAR = 8.0 * codes.EPS
"""Two instants are one where they differ by less, relative: round-off of a sum of steps [-]."""
CROWD = 32
"""Breaks within 64 steps before and after one, above which it is stepped over as one of a dense signal."""


def _sparse(instants: Vector, dt: float) -> Vector:
    """The breaks at which steps end: not those of samples about as dense as the steps.

    Judged around each of them, so that it does not depend on where a run begins or ends.
    """
    if not len(instants):
        return instants
    window = 64.0 * dt
    around = np.searchsorted(instants, instants + window) - np.searchsorted(instants, instants - window)
    return np.asarray(instants[around <= CROWD])


class Boundaries:
    """Instants at which a step must end: samples of controllers, jumps and kinks of signals in time."""

    def __init__(
        self, controllers: Sequence[Any], instants: Sequence[float], begin: float, dt: float, end: float
    ) -> None:
        self.controllers = tuple(controllers)
        fast = [c for c in self.controllers if c.period is not None and c.period < 1e-6 * dt]
        if fast:
            raise ModelError(
                [f"the period of {c.name!r}, {c.period:g} s, is far below dt = {dt:g} s; lower dt too" for c in fast]
            )
        self.states = {controller.name: without_sharing(controller.state) for controller in self.controllers}
        self.begin_time = begin
        self.samples = {c.name: 0 for c in self.controllers if c.period is not None}
        self.breaks = _sparse(np.asarray(instants, dtype=float), dt)
        self.place = int(np.searchsorted(self.breaks, begin, side="right"))
        self.near = min(NEAR * abs(end), 1e-6 * dt)

    # what a run keeps of it -----------------------------------------------------------------------------------------
    def kept(self) -> tuple[Any, ...]:
        """What changes as the run goes on; for `restore`."""
        return self.begin_time, self.samples, self.states, self.place

    def restore(self, kept: tuple[Any, ...]) -> None:
        """As it was."""
        self.begin_time, self.samples, self.states, self.place = kept

    def remembered(self) -> dict[str, Any]:
        """For a run that goes on from here."""
        return {"begin": self.begin_time, "samples": dict(self.samples), "states": without_sharing(self.states)}

    def take_up(self, remembered: Mapping[str, Any], now: float) -> None:
        """Go on with the samples and states of an earlier run."""
        self.begin_time, self.samples = remembered["begin"], dict(remembered["samples"])
        self.states = without_sharing(dict(remembered["states"]))
        self.place = int(np.searchsorted(self.breaks, now, side="right"))

    # the run --------------------------------------------------------------------------------------------------------
    def sample(self, controller: Any) -> float:
        """When a controller is called next [s]."""
        return float(self.begin_time + self.samples[controller.name] * controller.period)

    def count(self, controller: Any) -> None:
        """One more sample of a controller has been taken."""
        self.samples = {**self.samples, controller.name: self.samples[controller.name] + 1}

    def next(self, end: float) -> tuple[float, bool]:
        """Where the kernel must stop next, and whether a boundary is there; one at round-off of the end is the end.

        Just before a break, so that the step sees its left side.
        """
        due = [float(np.nextafter(time, -np.inf)) for time in self.breaks[self.place : self.place + 1]]
        due += [self.sample(controller) for controller in self.controllers if controller.period is not None]
        first = min(due, default=np.inf)
        return (first, True) if first <= end + self.near else (end, False)


def without_sharing(value: Any) -> Any:
    """A copy that changes apart, of anything that can be copied."""
    try:
        return deepcopy(value)
    except Exception:  # an open file, a lock, a generator: the user's, and shared then
        return value
