"""What a batch of runs gives: a table of their ends."""

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Vector
from mbd.compile.python import array_function
from mbd.errors import ModelError, SimulationError
from mbd.kernel import codes
from mbd.notebook import table
from mbd.results.columns import ModelColumns
from mbd.results.record import Rows
from mbd.results.tables import last_number
from mbd.results.titled import Titled
from mbd.results.trajectory import Trajectory
from mbd.simulation.batch.alone import NAMES, Alone
from mbd.simulation.batch.runner import Runner
from mbd.simulation.batch.starts import Starts
from mbd.simulation.many_runs import Ends
from mbd.state import State

NOT_RUN = "not run"
"""The outcome of runs that an interrupted batch never came to."""


class Batch(Titled):
    """The ends of N runs.

    Attributes
    ----------
    outcome (N,) : 'end' (the time that was asked for is reached), 'event' (one has ended the run), 'refused' (its start
        is none of this model), 'not run' (the batch was interrupted before), or how it failed: 'not converged',
        'not finite', 'chatter', …
    success (N,) : whether the run is whole
    time (N,) : of the end [s]; q (N, n_q), v (N, n_v), z (N, n_z) : the state there, NaN of a refused start
    stopped_by (N,) : name of the event that ended the run, '' if none did
    steps, events (N,) : how many there were; −1 of runs that were made alone
    results : {name: (N,)} at the end, NaN of runs that are not whole
    complete : False where Ctrl-C ended the batch; runs that it never came to have the outcome 'not run'
    how : '' where all runs were made in the kernel, else why they were made one by one
    """

    known_as = "batch"

    def __init__(self, runner: Runner, starts: Starts, places: dict[str, int], results: tuple[str, ...]) -> None:
        self._runner, self._starts, self._places, self._names = runner, starts, places, results
        count, v = len(starts), runner.run.kernel
        self.outcome: NDArray[Any] = np.full(count, "end", dtype="<U20")
        self.time: Vector = np.full(count, np.nan)
        self.q, self.v, self.z = (np.full((count, size), np.nan) for size in (v.n_q, v.n_v, v.n - v.n_v))
        self.stopped_by: NDArray[Any] = np.full(count, "", dtype=object)
        self.steps: NDArray[np.int64] = np.full(count, -1)
        self.events: NDArray[np.int64] = np.full(count, -1)
        self.results: dict[str, Vector] = {name: np.full(count, np.nan) for name in results}
        self.how, self.complete = runner.slow, True
        self._alone: dict[int, Alone] = {}
        self._ends: Ends | None = None

    # filled by who makes the runs ---------------------------------------------------------------------------------
    def take(self, ends: Ends) -> None:
        """Runs that the kernel has made."""
        run, v = self._runner.run, self._runner.run.kernel
        self._ends = ends
        at_y = 1 + v.n_q
        self.q, self.v, self.z = ends.row[:, 1:at_y], ends.row[:, at_y : at_y + v.n_v], ends.row[:, at_y + v.n_v :][:, : v.n - v.n_v]  # noqa: E501  # fmt: skip
        self.time, self.steps, self.events = ends.time, ends.steps, ends.events
        self.outcome[ends.status == codes.EVENT] = "event"
        if isinstance(run.settings["until"], str):
            self.outcome[self.outcome == "end"] = "no event"
        for code, name in NAMES.items():
            self.outcome[ends.status == code] = name
        names = [*run.manager.names, *(guard.name for guard in run.manager.guards)]
        for number, name in enumerate(names):
            self.stopped_by[ends.stopped_by == number] = name
        if self._names:
            self._take_results(ends)

    def _take_results(self, ends: Ends) -> None:
        v, equations = self._runner.run.kernel, self._runner.mechanism.equations
        row, n_z = ends.row, v.n - v.n_v
        cuts = np.cumsum([1, v.n_q, v.n_v, n_z, v.n_v, n_z, v.n_rows, v.n_contacts])
        time, q, speed, z, a, s, lam, closed, phase = np.split(row, cuts, axis=1)
        rows = Rows(
            time[:, 0], q, speed, z, a, s, lam, closed.astype(np.uint8), ends.anchors, np.arange(len(row)),
            phase.astype(np.int8),
        )  # fmt: skip
        with equations.tape.lock:
            function = array_function([equations.output(name) for name in self._names])
        found = function(ModelColumns.inputs(rows), self._runner.changes.all_vectors(len(row)))
        for name, column in zip(self._names, found, strict=True):
            self.results[name] = np.where(self.success, column, np.nan)

    def take_alone(self, runs: Sequence[int], report: Callable[[int], None] | None) -> None:
        """Runs that `simulate` makes; Ctrl-C ends that."""
        done = 0
        try:
            for k in runs:
                self._put(k, self._made(k))
                done += 1
                if report is not None:
                    report(done)
        except KeyboardInterrupt:
            self.not_made(np.isin(np.arange(len(self)), list(runs)[done:]))

    def refuse(self, runs: NDArray[np.bool_]) -> None:
        """Runs whose starts break their constraints, as `simulate` says too; in words where somebody asks for them."""
        self.outcome[runs] = "refused"
        self._empty(runs)

    def _empty(self, runs: NDArray[np.bool_]) -> None:
        """No numbers for these runs."""
        self.stopped_by[runs] = ""
        self.steps[runs] = self.events[runs] = -1
        for numbers in (self.time, self.q, self.v, self.z, *self.results.values()):
            numbers[runs] = np.nan

    def not_made(self, runs: NDArray[np.bool_]) -> None:
        """Runs that the batch never came to, or whose end nobody has judged, as it was interrupted."""
        self.complete = False
        self.outcome[runs] = NOT_RUN
        self._empty(runs)

    def _made(self, k: int) -> Alone:
        return self._runner.alone(self.start(k), self._runner.changes.at(k))

    def _put(self, k: int, one: Alone) -> None:
        self._alone[k] = one
        self.outcome[k], self.stopped_by[k] = one.outcome, one.stopped_by
        self.time[k] = one.state.time if one.state is not None else np.nan
        for name in ("q", "v", "z"):
            getattr(self, name)[k] = np.nan if one.state is None else getattr(one.state, name)
        self.steps[k] = self.events[k] = -1
        for name in self._names:
            whole = one.run is not None and one.run.success
            self.results[name][k] = last_number(one.run, name) if whole and one.run is not None else np.nan

    # what users ask -----------------------------------------------------------------------------------------------
    def __len__(self) -> int:
        return len(self._starts)

    @property
    def success(self) -> NDArray[np.bool_]:
        """Whether each run is whole."""
        return np.isin(self.outcome, ("end", "event"))

    def start(self, k: int) -> State:
        """The start of the k-th run."""
        return self._starts.state(self._number(k), self._places)

    def final(self, k: int) -> State:
        """The end of the k-th run, from which another may start.

        Raises
        ------
        SimulationError
            for a run that was refused.
        """
        k = self._number(k)
        if self.outcome[k] == NOT_RUN:
            raise SimulationError(f"run {k} was not made: the batch was interrupted; batch.run({k}) makes it")
        if self.outcome[k] == "refused" and k not in self._alone:
            self._put(k, self._made(k))
        if k in self._alone:
            state = self._alone[k].state
            if state is None:
                raise SimulationError(f"run {k} was refused: {self._alone[k].message}")
            return state
        assert self._ends is not None
        return self._ends.state(self._runner.run, k, self._runner.changes.at(k))

    def run(self, k: int) -> Trajectory:
        """The k-th run again, with all its rows.

        Raises
        ------
        SimulationError
            for a run that was refused.
        """
        one = self._alone.get(self._number(k)) or self._made(self._number(k))
        if one.run is None:
            raise SimulationError(f"run {k} was refused: {one.message}")
        return one.run

    def message(self, k: int) -> str:
        """The sentence of the k-th run: how it ended, or why it could not go on."""
        k = self._number(k)
        if self.outcome[k] == NOT_RUN:
            return "not run: interrupted"
        if k not in self._alone and self.outcome[k] == "refused":
            self._put(k, self._made(k))
        if k not in self._alone and not self.success[k]:
            self._alone[k] = self._made(k)
        if k in self._alone:
            return self._alone[k].message
        if self.outcome[k] == "event":
            return f"ended by {self.stopped_by[k]!r} at t = {self.time[k]:.6g} s"
        stop = self._runner.run.stop
        return f"{stop!r} did not happen before t = {self.time[k]:g} s" if stop else f"reached t = {self.time[k]:g} s"

    def _number(self, k: int) -> int:
        if isinstance(k, bool) or not isinstance(k, int | np.integer) or not -len(self) <= k < len(self):
            raise ModelError(f"the batch has runs 0 to {len(self) - 1}, not {k!r}")
        return int(k) % len(self)

    @property
    def columns(self) -> dict[str, Any]:
        """Everything by title: parameters and numbers of the start that vary, the end, results."""
        equations, runs = self._runner.mechanism.equations, len(self)
        varied = {f"start {name}": column for name, column in self._starts.columns.items() if len(column) == runs}
        varied |= {name: column for name, column in self._runner.changes.columns.items() if column.ndim}
        state: dict[str, Any] = {c.name: self.q[:, k] for k, c in enumerate(equations.coordinates)}
        state |= {name: self.v[:, k] for k, name in enumerate(equations.velocity_names)}
        state |= {each.name: self.z[:, k] for k, each in enumerate(equations.states)}
        ended = {"outcome": self.outcome, "stopped_by": self.stopped_by, "time": self.time}
        return {**varied, **ended, **state, **self.results}

    def __repr__(self) -> str:
        counts = Counter(map(str, self._kinds()))
        parts = ", ".join(f"{count} × {what}" for what, count in counts.most_common())
        return f"{getattr(self._runner.model, 'name', '')}: {len(self)} runs: {parts}"

    def _kinds(self) -> list[str]:
        pairs = zip(self.outcome, self.stopped_by, strict=True)
        return [
            f"ended by {name!r}" if name else ("reached the end" if what == "end" else what) for what, name in pairs
        ]

    def _repr_html_(self) -> str:
        counts = Counter(self._kinds())
        return table(f"{len(self)} runs", ("outcome", "runs"), list(counts.most_common()))
