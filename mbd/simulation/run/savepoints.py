"""A step is a transaction: what a run must restore so that a step that failed leaves nothing behind.

The kernel takes thousands of steps in a call. A savepoint before each call costs nothing beside it, and as the same
steps give the same bits, the state before any step of the call is reached again by repeating those before it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from mbd.arrays import Vector
from mbd.errors import SimulationError
from mbd.kernel import fields as F
from mbd.results.record import EventRecord

if TYPE_CHECKING:
    from mbd.simulation.run.run import Run

__all__ = ["Savepoint", "called", "restore", "rewind", "save"]

SETTLED = (F.DONE, F.FULL, F.NEW_MODE, F.PAUSE, F.LAST)
"""What the kernel returns with an accepted state that nobody has to react to."""
FAILED = -1
"""In place of a kernel's status: an integrator written in Python raised."""


@dataclass(frozen=True, eq=False)
class Savepoint:
    """A run between two calls of the kernel.

    reals, integers : what the next step depends on
    scheme, boundaries, changed : memory of a Python integrator; samples and controllers; parameters by name
    stored, events, changes, steps : how many there were of each
    settled : no restart is pending
    pending : events at this very instant that nobody has reacted to yet
    call : `until` and `end` of the call of the kernel that was made from here, if one was
    """

    reals: Vector
    integers: Vector
    scheme: Any
    boundaries: Any
    changed: Mapping[str, float]
    stored: int
    events: int
    changes: int
    steps: int
    settled: bool
    pending: tuple[EventRecord, ...] = ()
    call: tuple[float, float] | None = None


def save(run: Run, pending: Sequence[EventRecord] = ()) -> Savepoint:
    """Note where the run is; kept are this point, those since the last step, and the last one with steps after it."""
    run.collect()
    stepper = run.stepper
    point = Savepoint(
        stepper.reals.copy(), stepper.integers.copy(), stepper.scheme.memory, run.boundaries.kept(), run.changed,
        run.stored, len(run.events), len(run.parameter_changes), int(run.values["counts"][F.STEPS]),
        int(run.values["state"][F.RESTART]) == 0, tuple(pending),
    )  # fmt: skip
    earlier = run.history
    if earlier and earlier[-1].steps < point.steps:
        earlier = earlier[-1:]
    run.history = [*earlier, point]
    return point


def called(run: Run, until: float, end: float) -> None:
    """Note the call that is made from the last savepoint."""
    run.history = [*run.history[:-1], replace(run.history[-1], call=(until, end))]


def restore(run: Run, point: Savepoint) -> None:
    """The run as it was at a savepoint."""
    stepper = run.stepper
    stepper.reals[:] = point.reals
    stepper.integers[:] = point.integers
    stepper.scheme.memory = point.scheme
    run.boundaries.restore(point.boundaries)
    if run.changed is not point.changed:
        run.set_parameters(point.changed)
    run.stored, run.pending = point.stored, point.pending
    del run.events[point.events :], run.parameter_changes[point.changes :]


def rewind(run: Run, failed: bool) -> bool:
    """Take back what was not finished: the step that failed with all it caused, or what an interrupt cut in two.

    Returns whether there was a settled state to go back to; there is none before the scheme has started.
    """
    counts = run.values["counts"].copy()
    try:
        for point in reversed(run.history):
            steps = int(counts[F.STEPS]) - point.steps
            if _before_failure(run, point, steps) if failed and point.call else _settled(run, point):
                return True
        return False
    finally:
        run.values["counts"][:] = counts


def _settled(run: Run, point: Savepoint) -> bool:
    """Go to a savepoint; whether it is settled, after a restart if need be, or waits for a reaction to an event."""
    restore(run, point)
    if point.settled or point.pending:
        return True
    until, end = point.call or (float("inf"), float("inf"))
    if _go(run, until, end, 0) not in SETTLED:
        return False
    run.collect()
    return True


def _before_failure(run: Run, point: Savepoint, steps: int) -> bool:
    """Go to the settled state before the last step of the call made from a savepoint; whether there is one."""
    assert point.call is not None
    restore(run, point)
    until, end = point.call
    status = _go(run, until, end, max(steps - 1, 0))
    if status not in SETTLED:
        return False
    history = run.history
    last = save(run)
    while status == F.PAUSE:
        last = save(run)
        iterations = int(run.values["counts"][F.ITERATIONS])
        status = _go(run, until, end, 1)
        run.tried = int(run.values["counts"][F.ITERATIONS]) - iterations
    run.history = history
    restore(run, last)
    return True


def _go(run: Run, until: float, end: float, chunk: int) -> int:
    """Call the kernel for so many steps."""
    usual = run.values["chunk"]
    run.values["chunk"], run.values["end"] = chunk, end
    try:
        return run.stepper.advance(until)
    except SimulationError:
        return FAILED
    finally:
        run.values["chunk"] = usual
