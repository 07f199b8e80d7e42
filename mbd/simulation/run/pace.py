"""Runs whose steps follow their error down to where they no longer get anywhere."""

from mbd.simulation.run.data import RunData

LOOK_STEPS = 200_000
"""Steps between two looks at how far a run has come [-]."""


class Pace:
    """Whether a run with ``tol`` still advances.

    problem : where it did not any more, in a sentence; '' if it does
    """

    def __init__(self) -> None:
        self.problem = ""
        self._steps, self._time = 0, -float("inf")

    def check(self, run: RunData) -> str:
        """A sentence where a billion steps like the last ones would not take it as far as it has come, '' otherwise."""
        steps, now, begun = int(run.kernel.n_steps), run.now, run.start.time
        if not run.kernel.adaptive or steps < self._steps + LOOK_STEPS:
            return ""
        moved = now - max(self._time, begun)
        self._steps, self._time = steps, now
        if moved * 1e9 <= LOOK_STEPS * (now - begun):
            self.problem = (
                f"t = {now:.9g} s: the last {LOOK_STEPS:,} steps have taken the run {moved:.2g} s further: something "
                f"changes within {moved / LOOK_STEPS:.1g} s there, such as the lowest point of a disk that comes to "
                "lie flat; use a larger tol=, a fixed dt=, or end the run before"
            )
        return self.problem
