"""Thousands of runs in few calls of the kernel."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from typing import Any, Literal

import numpy as np

from mbd.arrays import Vector
from mbd.bodies.values import flag, names_given, shown
from mbd.errors import ModelError
from mbd.integrators import HHT, Integrator
from mbd.kernel import codes
from mbd.progress import share_bar
from mbd.results.names import scalars
from mbd.simulation.arguments import check_arguments
from mbd.simulation.batch.result import Batch
from mbd.simulation.batch.runner import Runner
from mbd.simulation.batch.starts import Starts, columns_of, given_starts, places_of, starts_of
from mbd.simulation.batch.workers import Interrupted, processors
from mbd.simulation.run.begin import check_rank
from mbd.simulation.simulate import REST_SPEED


def batch(
    model: Any,
    starts: Any,
    integrator: Integrator | None = None,
    dt: float | None = None,
    *,
    until: float | str | tuple[str, float],
    parameters: Mapping[str, Any] | None = None,
    results: Sequence[str] = (),
    contact: Literal["auto", "events", "nonsmooth"] = "auto",
    impact: Literal["newton", "poisson", "sequential"] = "newton",
    locate: Literal["root", "linear"] = "root",
    rest_speed: float = REST_SPEED,
    workers: int | None = None,
    progress: bool = False,
    backend: str = "auto",
) -> Batch:
    """Many runs of a model from other starts or with other parameters, of which the end is kept.

    All runs are made in few calls of the machine code, one after the other without Python between them, side by side in
    threads. Each is the run that `simulate` makes from the same start, to the bit; one that fails is a row that says
    so. Runs that need Python between their steps, for controllers, jumps of signals in time, functions that reset the
    state or schemes written in Python, are made by `simulate` one by one, which `Batch.how` says.

    Parameters
    ----------
    model : a `Model` or `Lagrangian`
    starts : a list of consistent states at one time; or one state, or ``(state, {"hip.angle": [0.1, 0.2]})``: columns
        that replace coordinates [m, rad], rates [m/s, rad/s] or first-order states of it. What the states remember of
        earlier runs is not used: every run starts afresh
    integrator : default ``HHT(alpha=0.05)``
    dt : step [s]
    until : as for `simulate`: end time [s], name of an event, or (name, latest time)
    parameters : values that differ from the model's, by name: numbers, or columns with a value for each run
    results : names of quantities to keep, at the end of each run; of a vector its components, of a discrete state its
        number
    contact, impact, locate, rest_speed, backend : as for `simulate`
    workers : threads; by default as many as there are processors
    progress : True for a bar on a terminal

    Returns
    -------
    Batch
        a table: final states, times, what ended each run, results. A failed run has its outcome; ``batch.message(k)``
        says why, and ``batch.run(k)`` makes it again as a `Trajectory`. Ctrl-C ends the batch and keeps the runs that
        were over, see ``complete``.

    Raises
    ------
    ModelError, UnknownNameError, CapabilityError
        for arguments that cannot be honoured, before the first run.
    """
    bar_wanted, threads = flag(progress, "progress of a batch"), worker_count(workers)
    base, states, columns = given_starts(starts)
    scheme = HHT(alpha=0.05) if integrator is None else integrator
    names, faults = names_given(results, "results", "quantities, such as ['hip.angle']")
    changed = {**base.parameters, **(parameters or {})} if isinstance(parameters, Mapping | None) else parameters
    changes, more = columns_of(changed, "parameters")
    options = {"contact": contact, "impact": impact, "locate": locate, "store": 1, "rest_speed": rest_speed,
               "backend": backend}  # fmt: skip
    if faults or more:
        raise ModelError([*faults, *more])
    check_arguments(scheme, base, dt, None, None, until, None, options, "return", (), None)
    sizes = {"starts": len(states) or _length(columns), "parameters": _length(changes)}
    count = max(*sizes.values(), 1)
    if any(size not in (0, count) for size in sizes.values()):
        raise ModelError(f"there are {sizes['starts']} starts and {sizes['parameters']} values of parameters; give as "
                         "many of both, or one of either")  # fmt: skip
    runner = Runner(model, base, scheme, float(dt or 0.0), until, changes, options, threads)
    given = starts_of(base, states, columns, count, model, runner.mechanism, runner.manager, runner.changes)
    with share_bar() if bar_wanted else nullcontext() as bar:
        return _table(runner, given, tuple(names), None if bar is None else lambda done: bar(done, count))


def worker_count(workers: Any) -> int:
    """The number of threads that is asked for."""
    if workers is None:
        return processors()
    if isinstance(workers, bool) or not isinstance(workers, int) or not 1 <= workers <= 1024:
        raise ModelError(f"workers must be a number of threads from 1 to 1024, or None, not {shown(workers)}")
    return workers


def _length(columns: Mapping[str, Vector]) -> int:
    """Length of the lists among columns, 0 where all are numbers."""
    return max((len(column) for column in columns.values() if column.ndim), default=0)


def _table(runner: Runner, starts: Starts, results: tuple[str, ...], report: Callable[[int], None] | None) -> Batch:
    """The runs of a batch."""
    results = scalars(runner.mechanism.equations, results)
    places, count, changes = places_of(runner.mechanism), len(starts), runner.changes
    if changes.names and not changes.varies:  # what takes away what determines the motion
        check_rank(runner.run, starts.state(0, places), changes.constant_vector)
    found = Batch(runner, starts, places, results)
    resets = any(guard.reset is not None and guard.name in runner.terminal for guard in runner.manager.guards)
    if runner.slow or (resets and results):
        found.take_alone(range(count), report)
        return found
    lines = starts.lines(runner.run, places)
    try:
        ends = runner.ends(lines, changes, report)
    except Interrupted as stop:  # runs that `simulate` would have to judge count as not made
        found.take(stop.ends)
        found.not_made(~stop.done | runner.judged(lines, stop.ends, changes))
        return found
    found.take(ends)
    refused = ends.status == codes.DOUBTFUL_START
    found.refuse(refused)
    found.take_alone([int(k) for k in np.flatnonzero(runner.judged(lines, ends, changes) & ~refused)], None)
    return found
