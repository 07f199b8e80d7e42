"""A step is a transaction: what a run must restore so that a step that failed leaves nothing behind.

The kernel takes thousands of steps in a call. A savepoint before each call costs nothing beside it, and as the same
steps give the same bits, the state before any step of the call is reached again by repeating those before it.
"""

from collections.abc import Sequence

from mbd.errors import SimulationError
from mbd.kernel import codes
from mbd.results.record import EventRecord
from mbd.simulation.run.data import RunData, Savepoint

SETTLED = (codes.DONE, codes.FULL, codes.NEW_MODE, codes.PAUSE, codes.LAST)
"""What the kernel returns with an accepted state that nobody has to react to."""
FAILED = -1
"""In place of a kernel's status: an integrator written in Python raised."""


def save(run: RunData, pending: Sequence[EventRecord] = ()) -> Savepoint:
    """Note where the run is; kept are this point, those since the last step, and the last one with steps after it."""
    run.collect()
    stepper = run.stepper
    point = Savepoint(
        stepper.reals.copy(), stepper.integers.copy(), stepper.scheme.memory, run.boundaries.kept(), run.changed,
        run.stored, len(run.events), len(run.parameter_changes), int(run.kernel.n_steps),
        int(run.kernel.restart_due) == 0, tuple(pending),
    )  # fmt: skip
    earlier = run.history
    if earlier and earlier[-1].steps < point.steps:
        earlier = earlier[-1:]
    run.history = [*earlier, point]
    return point


def called(run: RunData, until: float, end: float) -> None:
    """Note the call that is made from the last savepoint."""
    point = object.__new__(Savepoint)
    vars(point).update(vars(run.history[-1]), call=(until, end))
    run.history = [*run.history[:-1], point]


def restore(run: RunData, point: Savepoint) -> None:
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


def rewind(run: RunData, failed: bool) -> bool:
    """Take back what was not finished: the step that failed with all it caused, or what an interrupt cut in two.

    Returns whether there was a settled state to go back to; there is none before the scheme has started.
    """
    counts, reached = run.kernel.counts.copy(), int(run.kernel.n_steps)
    try:
        for point in reversed(run.history):
            steps = reached - point.steps
            if _before_failure(run, point, steps) if failed and point.call else _reached(run, point):
                return True
        return False
    finally:
        run.kernel.counts[:] = counts


def _reached(run: RunData, point: Savepoint) -> bool:
    """Go to a savepoint; whether it is settled, after a restart if need be, or waits for a reaction to an event."""
    restore(run, point)
    if point.settled or point.pending:
        return True
    until, end = point.call or (float("inf"), float("inf"))
    if _go(run, until, end, 0) not in SETTLED:
        return False
    run.collect()
    return True


def _before_failure(run: RunData, point: Savepoint, steps: int) -> bool:
    """Go to the settled state before the last step of the call made from a savepoint; whether there is one."""
    assert point.call is not None
    restore(run, point)
    until, end = point.call
    status = _go(run, until, end, max(steps - 1, 0))
    if status not in SETTLED:
        return False
    history = run.history
    last = save(run)
    while status == codes.PAUSE:
        last = save(run)
        iterations = int(run.kernel.n_iterations)
        status = _go(run, until, end, 1)
        run.tried = int(run.kernel.n_iterations) - iterations
    run.history = history
    restore(run, last)
    return True


def _go(run: RunData, until: float, end: float, chunk: int) -> int:
    """Call the kernel for so many steps."""
    usual = run.kernel.chunk
    run.kernel.chunk, run.kernel.end = chunk, end
    try:
        return run.stepper.advance(until)
    except SimulationError:
        return FAILED
    finally:
        run.kernel.chunk = usual
