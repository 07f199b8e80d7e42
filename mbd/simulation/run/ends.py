"""Where a run stops: its last step, its last row, and the state to go on from."""

from dataclasses import replace

import numpy as np

from mbd.dataclass import found_late
from mbd.errors import SimulationError
from mbd.kernel import codes
from mbd.simulation.run.data import RunData
from mbd.simulation.run.memory import memory_of
from mbd.simulation.run.savepoints import called, restore, save
from mbd.simulation.run.strategy import may_go_on_unlocated
from mbd.state import State


def advance(run: RunData, target: float, due: bool) -> int:
    """Call the kernel; a step that would pass the end of the run ends there, unless a longer run's would too.

    `due` says that a boundary is at the target, where a longer run would end a step as well.
    """
    v = run.kernel
    if run.limit is not None:
        v.chunk = max(min(v.chunk, run.limit - int(v.n_steps)), 0)
    status = call(run, target, np.inf if due else target)
    if status != codes.LAST:
        return status
    before, counts = save(run), v.counts.copy()
    status = _one_step(run)
    if may_go_on_unlocated(run, status):  # as a longer run would
        return status
    near = run.boundaries.near
    if status in (codes.PAUSE, codes.EVENT, codes.NEW_MODE) and run.now <= target + near:
        return codes.DONE if status == codes.PAUSE and run.now >= target - near else status
    restore(run, before)
    v.counts[:] = counts
    run.history = [*run.history[:-1], before]
    return call(run, target, np.inf)


def call(run: RunData, until: float, end: float) -> int:
    """Call the kernel from the last savepoint; a step that would pass `until` is cut, or left to us if it is `end`."""
    called(run, until, end)
    run.kernel.end = end
    return run.stepper.advance(until)


def _one_step(run: RunData) -> int:
    """A step of the grid, wherever it ends."""
    chunk, run.kernel.chunk = run.kernel.chunk, 1
    try:
        return call(run, np.inf, np.inf)
    except SimulationError:  # an integrator of the user's raised beyond the end that was asked for
        return -1
    finally:
        run.kernel.chunk = chunk


def close(run: RunData, settled: bool) -> State:
    """Store the last row, give the end the time that was asked for; the state to go on from."""
    if not settled:  # not even the scheme's start succeeded
        return run.start
    final = run.state()
    found_late(final, "memory", memory_of(run, final.time))
    run.stepper.keep_row()
    run.collect()
    if run.label is not None and run.label != run.now:  # round-off of the sum of steps
        last = run.table[: run.stored]
        last[last[:, 0] >= min(run.now, run.label), 0] = run.label
        run.events = [replace(event, time=run.label) if event.time == run.now else event for event in run.events]
    return final
