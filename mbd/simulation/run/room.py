"""Memory for the rows of a run: how many it will need, said while it runs, and an end before there is none left.

A run in steps of the size it has taken so far stores ``n ≈ n_now (T − t₀)/(t − t₀)`` rows of `width` numbers, 8 bytes
each; where an event may end it sooner only those that it has are counted.
"""

from mbd.free_memory import available, size_in_words as memory
from mbd.notes import doubt
from mbd.simulation.run.data import RoomFindings, RunData

EARLIEST, NOTABLE = 1 << 16, 1 << 25
"""Rows, and bytes of them, before which nothing is expected."""


class Room(RoomFindings):
    """What the rows of one run may fill.

    The system is asked for the free memory, which takes 50 µs, once it matters: after some ten thousand rows, and as
    often as their number has doubled.

    Attributes
    ----------
    patience : rows above which a run that is expected to have them is ended
    is_long : whether it was
    expected : rows that were expected last
    """

    def __init__(self, width: int) -> None:
        self.size = 8 * width
        super().__init__()
        self.patience, self.expected, self.is_long = float("inf"), 0.0, False
        self._most, self._seen = -1, 0

    def exhausted(self, run: RunData) -> str:
        """The sentence of a run that was refused memory."""
        self.problem = (
            f"t = {run.now:.9g} s: the system has no memory left; {run.stored} rows fill "
            f"{memory(run.stored * self.size)}; {_remedy(run)}"
        )
        return self.problem

    @property
    def most(self) -> int:
        """Rows for which there is room, as it was when it was looked at last."""
        if self._most < 0:
            self._look(0)
        return self._most

    def _look(self, stored: int) -> None:
        """Ask for the free memory, of which these rows have taken some."""
        # part of the memory that is free which the rows of a run may fill: trial runs, and results, need some too
        self._most, self._seen = int(0.25 * (available() + stored * self.size)) // self.size, stored

    def check(self, run: RunData) -> str:
        """Look at a run that goes on; a sentence if it must not store any more rows."""
        if run.stored < EARLIEST and run.stored * self.size < NOTABLE:
            return ""
        if run.stored >= 2 * self._seen:
            self._look(run.stored)
        rows = self.expected = _expected_rows(run)
        if rows > self.patience:
            self.is_long, self.problem = True, f"t = {run.now:.9g} s: about {rows:.2g} rows are expected"
            return self.problem
        if run.stored >= self.most:
            self.problem = (
                f"t = {run.now:.9g} s: {run.stored} rows fill {memory(run.stored * self.size)}, a quarter of the free "
                f"memory; the whole run needs about {rows:.2g} rows, {memory(rows * self.size)}; {_remedy(run)}"
            )
            return self.problem
        # where nobody has chosen their number, from 4 million rows on
        is_large = (rows > (1 << 22) and run.kernel.adaptive) or rows * self.size > 1.0e9 or rows > self.most
        if is_large and not self.note:
            last = f"; it will be ended at {self.most} rows" if rows > self.most else ""
            self.note = (
                f"at t = {run.now:.3g} s there are {run.stored} rows: at this rate the run will have about {rows:.2g}, "
                f"which take {memory(rows * self.size)}{last}; {_remedy(run)}"
            )
            doubt(self.note)
        return ""

    def refused(self, rows: float, seconds: float) -> str:
        """Why a run of so many rows that takes so long is not even begun; '' if there is room for it."""
        if rows <= self.most:
            return ""
        return (
            f"about {rows:.2g} steps would be needed, which take about {_duration(seconds)} and whose rows take "
            f"{memory(rows * self.size)}, more than a quarter of the free memory"
        )


def _expected_rows(run: RunData) -> float:
    """Rows of the whole run."""
    begin, span = run.start.time, run.end - run.start.time
    if run.stop or not run.now > begin:
        return float(run.stored)
    return float(run.stored * max(span / (run.now - begin), 1.0))


def _duration(seconds: float) -> str:
    """In seconds, minutes or hours."""
    if seconds < 120.0:
        return f"{seconds:.2g} s"
    return f"{seconds / 60.0:.2g} min" if seconds < 7200.0 else f"{seconds / 3600.0:.2g} h"


def _remedy(run: RunData) -> str:
    if run.kernel.adaptive:
        return "ask for less accuracy or a shorter time, take a scheme of higher order, or dt= with store="
    return "use store= to keep fewer rows, a larger dt, or a shorter time"
