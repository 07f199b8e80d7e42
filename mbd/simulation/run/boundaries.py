"""Instants at which steps must end: samples of controllers, jumps and kinks of signals in time."""

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from copy import deepcopy
from typing import Any

import numpy as np

from mbd.equations.switching_times import Jump
from mbd.errors import ModelError
from mbd.kernel import codes

INSTANT_RTOL = 8.0 * codes.EPS
"""Two instants are one where they differ by less, relative: round-off of a sum of steps [-]."""
WINDOW_STEPS = 64.0
"""Steps before and after a kink in which others are counted [-]."""
CROWD_OF_JUMPS = 256
"""The same of forces that jump."""
RESTARTS = 1
"""Highest level of a jump behind which a scheme starts again: what it remembers of accelerations holds before it."""


def _ends_of_steps(jumps: Sequence[Jump], dt: float, follows_tolerance: bool) -> list[Jump]:
    """The jumps at which steps end: not those about as dense as the steps, but for forces that jump, with `tol`.

    Judged around each of them, so that it does not depend on where a run begins or ends.
    """
    kept = []
    for limit, group in (
        (CROWD_OF_JUMPS, [jump for jump in jumps if jump.level <= 0]),
        (32, [jump for jump in jumps if jump.level > 0]),  # a dense signal is stepped over
    ):
        if limit == CROWD_OF_JUMPS and follows_tolerance:
            kept += group
        elif group:
            times, window = np.array([jump.right for jump in group]), WINDOW_STEPS * dt
            around = np.searchsorted(times, times + window) - np.searchsorted(times, times - window)
            kept += [jump for jump, crowd in zip(group, around, strict=True) if crowd <= limit]
    return sorted(kept)


class Boundaries:
    """Instants at which a step must end: samples of controllers, jumps and kinks of signals in time."""

    def __init__(self, controllers: Sequence[Any], begin: float, dt: float, end: float) -> None:
        self.controllers = tuple(controllers)
        fast = [c for c in self.controllers if c.period is not None and c.period < 1e-6 * dt]
        if fast:
            raise ModelError(
                [f"the period of {c.name!r}, {c.period:g} s, is far below dt = {dt:g} s; lower dt too" for c in fast]
            )
        self.states = {controller.name: without_sharing(controller.state) for controller in self.controllers}
        self.begin_time = begin
        self.samples = {c.name: 0 for c in self.controllers if c.period is not None}
        self.breaks: Sequence[Jump] = ()
        self.place = 0
        self.near = min(INSTANT_RTOL * abs(end), 1e-6 * dt)

    def break_at(self, jumps: Sequence[Jump], now: float, dt: float, follows_tolerance: bool) -> None:
        """End steps at these jumps from now on, but for those about as dense as the steps."""
        self.breaks = _ends_of_steps(jumps, dt, follows_tolerance)
        self._find_place(now)

    def _find_place(self, now: float) -> None:
        self.place = bisect_right(self.breaks, now, key=lambda jump: jump.right) if self.breaks else 0

    # what a run keeps of it -----------------------------------------------------------------------------------------
    def kept(self) -> tuple[Any, ...]:
        """What changes as the run goes on; for `restore`."""
        return self.begin_time, self.samples, self.states, self.breaks, self.place

    def restore(self, kept: tuple[Any, ...]) -> None:
        """As it was."""
        self.begin_time, self.samples, self.states, self.breaks, self.place = kept

    def remembered(self) -> dict[str, Any]:
        """For a run that goes on from here."""
        return {
            "begin": self.begin_time,
            "samples": dict(self.samples),
            "states": without_sharing(self.states) if self.states else {},
        }

    def take_up(self, remembered: Mapping[str, Any], now: float) -> None:
        """Go on with the samples and states of an earlier run."""
        self.begin_time, self.samples = remembered["begin"], dict(remembered["samples"])
        self.states = without_sharing(dict(remembered["states"]))
        self._find_place(now)

    # the run --------------------------------------------------------------------------------------------------------
    def sample(self, controller: Any) -> float:
        """When a controller is called next [s]."""
        return float(self.begin_time + self.samples[controller.name] * controller.period)

    def count(self, controller: Any) -> None:
        """One more sample of a controller has been taken."""
        self.samples = {**self.samples, controller.name: self.samples[controller.name] + 1}

    @property
    def ahead(self) -> Jump | None:
        """The next instant at which the equations jump."""
        return self.breaks[self.place] if self.place < len(self.breaks) else None

    def next(self, end: float) -> tuple[float, bool]:
        """Where the kernel must stop next, and whether a boundary is there; one at round-off of the end is the end.

        Just before a jump or kink of the accelerations, so that the step sees its left side.
        """
        due = [self.sample(controller) for controller in self.controllers if controller.period is not None]
        if self.ahead is not None:
            due.append(self.ahead.left if self.ahead.level <= RESTARTS else self.ahead.right)
        first = min(due, default=np.inf)
        return (first, True) if first <= end + self.near else (end, False)

    def is_end(self, target: float, end: float) -> bool:
        """Whether the run ends at this target: on the left side of a jump that is at its end."""
        jump = self.ahead
        return target >= end - self.near or (
            jump is not None and jump.level <= RESTARTS and jump.left <= target and jump.right >= end - self.near
        )


def without_sharing(value: Any) -> Any:
    """A copy that changes apart, of anything that can be copied."""
    try:
        return deepcopy(value)
    except Exception:  # an open file, a lock, a generator: the user's, and shared then
        return value
