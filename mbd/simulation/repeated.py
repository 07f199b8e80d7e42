"""One prepared run, made again and again from other starts and with other parameters, until an event ends it.

`simulate` prepares, runs, judges and explains one run. Return maps, searches and basins make thousands of short runs of
which only the end is asked: here the kernel's arrays are laid out once, and a run is a start put into them and a march.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any
from weakref import finalize

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.integrators import Integrator
from mbd.kernel import codes
from mbd.results.record import EventRecord
from mbd.simulation.many_runs import Ends, ManyRuns, may_be_many, start_line
from mbd.simulation.marching import Run
from mbd.simulation.run.begin import begin
from mbd.simulation.run.idle import keep_idle
from mbd.simulation.run.late_resets import reset_ends
from mbd.simulation.simulate import REST_SPEED, laid_out, prepared
from mbd.state import State

MAX_EVENTS = 32
"""Events of a run of many that are kept; one with more is made alone [-]."""


@dataclass(frozen=True, eq=False)
class End:
    """Where a run ended.

    state : there, on the right side of the last event; None if the start was refused
    events : in order of time
    before : names of the contacts that were closed just before the last instant
    stopped_by : the name of the event that ended it; '' if none did
    problem : why the run could not go on; '' if nothing was wrong
    """

    state: State | None
    events: Sequence[EventRecord]
    before: frozenset[str]
    stopped_by: str
    problem: str

    @property
    def time(self) -> float:
        """Of the end [s]."""
        return self.state.time if self.state is not None else 0.0


class RepeatedRun:
    """A run with fixed steps from time 0, ready to be made again; contacts are located.

    Parameters
    ----------
    model, start, integrator, dt : as for `simulate`; `start` tells the coordinates
    until : (name of the event at which runs end, latest time [s])
    parameters : values that differ from the model's, by name; every name that a later call changes must be among them
        if the model folds its value into the equations
    """

    def __init__(
        self, model: Any, start: State, integrator: Integrator, dt: float, until: tuple[str, float],
        parameters: Mapping[str, float], backend: str = "auto",
    ) -> None:  # fmt: skip
        options = {
            "contact": "events", "impact": "newton", "locate": "root", "store": 1, "rest_speed": REST_SPEED,
            "backend": backend,
        }  # fmt: skip
        first = replace(start, time=0.0, memory=None)
        self._arguments = model, first, integrator, dt, until, dict(parameters), options
        self._laid_out = laid_out(*self._arguments)
        finalize(self, keep_idle, self._laid_out.stepper).atexit = False
        self.alone = may_be_many(self._laid_out, late_resets=True)
        """Why runs are made one by one; '' if they need not be."""
        boundaries = self._laid_out.boundaries
        self.adjustable = not boundaries.controllers and not len(boundaries.breaks)
        """Whether `adjust` may be used: no controller and no kink of a signal in time sets instants of its own."""
        self.parameters = dict(parameters)
        self.dt, self.latest = dt, self._laid_out.end
        self._folded = getattr(model, "parameters", {})

    @cached_property
    def run(self) -> Run:
        """The run that Python drives."""
        run = prepared(*self._arguments)
        self._reals, self._integers = run.stepper.reals.copy(), run.stepper.integers.copy()
        self._boundaries = run.boundaries.kept()
        return run

    def __call__(self, start: State, parameters: Mapping[str, float] | None = None) -> End:
        """The end of the run from a consistent start."""
        run = self.run
        try:
            self._reset(start, self.parameters if parameters is None else dict(parameters))
        except ModelError as error:
            return End(None, (), frozenset(), "", str(error))
        problem, _ = run.march()
        if run.interrupted:  # a march ends in order then, and what repeats it is to end too
            run.interrupted = False
            raise run.cause or KeyboardInterrupt
        run.collect()
        final = replace(run.state(), moved={})
        stopped_by = "" if problem else run.ended
        return End(final, tuple(run.events), _before(start, run.events, run.now), stopped_by, problem)

    def many(
        self, starts: Sequence[State], parameters: Sequence[Mapping[str, float]] | Mapping[str, float] | None = None
    ) -> list[End]:
        """The ends of runs from consistent starts, the same as one call for each, to the bit, without Python between.

        Parameters
        ----------
        starts : at time 0
        parameters : of all, or of each; None: those that the run was prepared with
        """
        own = self.parameters if parameters is None else parameters
        each = [dict(own)] * len(starts) if isinstance(own, Mapping) else [dict(one) for one in own]
        if len(each) != len(starts):
            raise ModelError(f"there are {len(starts)} starts and {len(each)} sets of parameters; give one for each")
        if self.alone or not starts:
            return [self(start, values) for start, values in zip(starts, each, strict=True)]
        known: list[tuple[dict[str, float], Vector]] = []
        for values in each:
            if not known or values != known[-1][0]:
                known.append((values, self._vector(values)))
            else:
                known.append(known[-1])
        vectors = np.array([vector for _, vector in known]).reshape(len(each), -1)
        lines = np.array([start_line(self._many.run, start) for start in starts]).reshape(len(each), -1)
        ends = self._many(lines, vectors, MAX_EVENTS)
        self._reset_ends(ends, vectors)
        return [self._end(ends, k, start, each[k]) for k, start in enumerate(starts)]

    @cached_property
    def _names(self) -> list[str]:
        """Of contacts, and of the guards behind them."""
        manager = self._laid_out.manager
        return [*manager.names, *(guard.name for guard in manager.guards)]

    @cached_property
    def _many(self) -> ManyRuns:
        """Arrays of their own, so that runs of both kinds may follow each other."""
        many = ManyRuns(self._laid_out)
        if self.adjustable:
            many.adjust(self.dt, self.latest)
        return many

    def _reset_ends(self, ends: Ends, vectors: Matrix) -> None:
        """What the event that ended runs resets; where that gives no numbers, a run alone says so."""
        run = self._many.run
        v, at_v = run.kernel, 1 + run.kernel.n_q
        for e, guard in enumerate(run.manager.guards):
            here = np.flatnonzero((ends.status == codes.EVENT) & (ends.stopped_by == v.n_contacts + e))
            if guard.reset is None or not len(here):
                continue
            q, y = ends.row[here, 1:at_v], ends.row[here, at_v : at_v + v.n]
            sound = reset_ends(run, guard, q, y, vectors[here])
            ends.row[here, 1:at_v], ends.row[here, at_v : at_v + v.n] = q, y
            ends.status[here[~sound]] = codes.NEEDS_PYTHON

    def _vector(self, values: Mapping[str, float]) -> Vector:
        return self._laid_out.mechanism.parameters(values, self._folded if values else {})

    def _end(self, ends: Ends, k: int, start: State, values: dict[str, float]) -> End:
        """The end of the k-th run; one that Python has to make, or to explain, is made again."""
        run, status = self._many.run, int(ends.status[k])
        if status not in (codes.DONE, codes.EVENT) or ends.events[k] > MAX_EVENTS or run.mechanism.equations.facings:
            return self(start, values)
        events = run.log.events(ends.lines[k, : ends.n_lines[k]], 0)
        number = int(ends.stopped_by[k])
        names = self._names
        before = run.manager.mode(ends.before[k]).closed
        return End(ends.state(run, k, values), tuple(events), before, names[number] if number >= 0 else "", "")

    def adjust(self, dt: float, latest: float) -> None:
        """Another step and another latest time [s] for the next calls."""
        self.dt, self.latest = dt, latest
        if "_many" in self.__dict__:
            self._many.adjust(dt, latest)

    @property
    def table(self) -> Matrix:
        """The stored rows of the last run (R, width): time, q, v and more."""
        return self.run.table[: self.run.stored]

    def _reset(self, start: State, parameters: dict[str, float]) -> None:
        """The run as it was before its first step, from another start."""
        run = self.run
        run.stepper.reals[:], run.stepper.integers[:] = self._reals, self._integers
        run.kernel.dt = run.kernel.step = run.dt = self.dt
        run.kernel.end = run.end = self.latest
        run.kernel.counts[:] = 0
        run.boundaries.restore(self._boundaries)
        run.boundaries.states = {c.name: c.state for c in run.boundaries.controllers}
        run.stored, run.events, run.pending, run.history = 0, [], (), []
        run.label, run.gave_up, run.cause, run.carried = None, None, None, False
        if run.changed != parameters:
            run.set_parameters(parameters)
        run.start = start
        begin(run, start)


def _before(start: State, events: Sequence[EventRecord], now: float) -> frozenset[str]:
    """The contacts that were closed just before the last instant."""
    closed = set(start.mode.closed)
    for event in events:
        if event.time < now and event.kind == "closed":
            closed.add(event.name)
        elif event.time < now and event.kind == "opened":
            closed.discard(event.name)
    return frozenset(closed)
