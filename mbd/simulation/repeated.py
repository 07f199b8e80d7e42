"""One prepared run, made again and again from other starts and with other parameters, until an event ends it.

`simulate` prepares, runs, judges and explains one run. Return maps, searches and basins make thousands of short runs of
which only the end is asked: here the kernel's arrays are laid out once, and a run is a start put into them and a march.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from mbd.arrays import Matrix
from mbd.errors import ModelError
from mbd.integrators import Integrator
from mbd.results.record import EventRecord
from mbd.simulation.run.begin import begin
from mbd.simulation.run.run import Run
from mbd.simulation.simulate import REST_SPEED, prepared
from mbd.state import State

__all__ = ["End", "RepeatedRun"]


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
        self.run: Run = prepared(model, first, integrator, dt, until, dict(parameters), options)
        stepper = self.run.stepper
        self._reals, self._integers = stepper.reals.copy(), stepper.integers.copy()
        self._boundaries = self.run.boundaries.kept()
        self.parameters = dict(parameters)
        self.dt = dt

    def __call__(self, start: State, parameters: Mapping[str, float] | None = None) -> End:
        """The end of the run from a consistent start."""
        run = self.run
        try:
            self._reset(start, self.parameters if parameters is None else dict(parameters))
        except ModelError as error:
            return End(None, (), frozenset(), "", str(error))
        problem, message = run.march()
        run.collect()
        final = replace(run.state(), moved={})
        return End(final, tuple(run.events), _before(start, run.events, run.now), self._stop(message), problem)

    @property
    def table(self) -> Matrix:
        """The stored rows of the last run (R, width): time, q, v and more."""
        return self.run.table[: self.run.stored]

    def _reset(self, start: State, parameters: dict[str, float]) -> None:
        """The run as it was before its first step, from another start."""
        run = self.run
        run.stepper.reals[:], run.stepper.integers[:] = self._reals, self._integers
        run.kernel.counts[:] = 0
        run.boundaries.restore(self._boundaries)
        run.boundaries.states = {c.name: c.state for c in run.boundaries.controllers}
        run.stored, run.events, run.pending, run.history = 0, [], (), []
        run.label, run.gave_up, run.cause, run.carried = None, None, None, False
        if run.changed != parameters:
            run.set_parameters(parameters)
        run.start = start
        begin(run, start)

    def _stop(self, message: str) -> str:
        """The name of the event in the message of a march that one ended."""
        if not message.startswith("ended by"):
            return ""
        ending = [event.name for event in self.run.events if event.kind in ("closed", "event")]
        terminal = {guard.name for guard in self.run.manager.guards if guard.terminal} | {self.run.stop}
        return next((name for name in reversed(ending) if name in terminal), "")


def _before(start: State, events: Sequence[EventRecord], now: float) -> frozenset[str]:
    """The contacts that were closed just before the last instant."""
    closed = set(start.mode.closed)
    for event in events:
        if event.time < now and event.kind == "closed":
            closed.add(event.name)
        elif event.time < now and event.kind == "opened":
            closed.discard(event.name)
    return frozenset(closed)
