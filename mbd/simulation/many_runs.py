"""Many runs of one laid-out run, in few calls of the kernel: starts as a table, ends as a table."""

from collections.abc import Callable, Mapping
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.errors import MbdError
from mbd.kernel import codes
from mbd.simulation.marching import Run
from mbd.simulation.run.late_resets import may_reset_late
from mbd.simulation.run.plain import PlainScheme
from mbd.state import State

MIN_STEPS, CALL_TIME = 20_000, 0.2
"""Least steps of a call of the kernel, and its time [s], after which somebody may interrupt."""


def may_be_many(run: Run, late_resets: bool = False) -> str:
    """Why runs like this one need Python between their steps; '' if they do not.

    late_resets : whether who asks resets the state himself after an event that ends a run (`reset_ends`)
    """
    for guard in run.manager.guards:
        last = guard.terminal or (run.stop is not None and run.manager.happens(run.stop, guard.name))
        if guard.reset is not None and not (last and late_resets and may_reset_late(run, guard)):
            return f"the event {guard.name!r} resets the state, which Python does"
    if run.boundaries.controllers:
        return f"the controller {run.boundaries.controllers[0].name!r} is called in Python"
    if len(run.boundaries.breaks):
        return "signals in time have jumps or kinks, at which steps end"
    if run.kernel.adaptive:
        return "steps follow a tolerance, which trial runs calibrate"
    if run.mechanism.equations.wrapped:
        return "whole turns of cut joints are counted in Python"
    plain = not run.stepper.compiled and isinstance(run.stepper.scheme, PlainScheme)
    return f"{run.stepper.integrator!r} is written in Python" if plain else ""


@dataclass(frozen=True, eq=False)
class Ends:
    """Where runs ended, a row for each.

    status : DONE, EVENT (an event has ended it), a failure of `mbd.kernel.codes`; from DOUBTFUL_START on Python has to
        make the run
    stopped_by : number of the contact, or of the guard behind the contacts, that ended it, −1: none
    steps, events : how many there were; sequence : a number that tells one order of events from another
    time [s]; row : (N, width) as the kernel stores it; armed, before : (N, contacts) armed ones, closed just before
    anchors : (N, n_anchors); lines : the first lines of the log, (N, most, width), of which n_lines were written
    """

    status: NDArray[np.int64]
    stopped_by: NDArray[np.int64]
    steps: NDArray[np.int64]
    events: NDArray[np.int64]
    sequence: NDArray[np.int64]
    n_lines: NDArray[np.int64]
    time: Vector
    row: Matrix
    armed: NDArray[np.int64]
    before: NDArray[np.int64]
    anchors: Matrix
    lines: NDArray[np.float64]

    def state(self, run: Run, k: int, parameters: Mapping[str, float]) -> State:
        """The end of the k-th run as a state."""
        v, row = run.kernel, self.row[k]
        at_v = 1 + v.n_q
        closed = row[at_v + 2 * v.n + v.n_rows :][: v.n_contacts]
        return State(
            float(self.time[k]), row[1:at_v].copy(), row[at_v : at_v + v.n_v].copy(),
            row[at_v + v.n_v : at_v + v.n].copy(), run.manager.mode(closed.astype(np.int64)),
            frozenset(name for name, side in zip(run.manager.names, self.armed[k].tolist(), strict=True) if side == 1),
            self.anchors[k].copy(), run.start.names, run.start.velocity_names, {}, dict(parameters),
        )  # fmt: skip


def start_line(run: Run, start: State) -> Vector:
    """A start as the kernel takes it: t, q, (v, z), anchors, closed, armed."""
    manager = run.manager
    fits = len(start.anchors) == run.kernel.n_anchors
    armed = set(manager.names) - start.mode.closed if start.armed is None else start.armed
    return np.concatenate([
        [start.time], start.q, start.v, start.z, start.anchors if fits else np.zeros(run.kernel.n_anchors),
        manager.flags(start.mode.closed), manager.flags(armed),
    ])  # fmt: skip


class ManyRuns:
    """The arrays of a laid-out run for many starts, one after the other.

    Parameters
    ----------
    run : as `laid_out` gives it, before its start was put in; the arrays are its own from now on
    """

    def __init__(self, run: Run) -> None:
        from mbd.simulation.run.begin import notify

        self.run, self.interrupted = run, False
        notify(run)
        for e, guard in enumerate(run.manager.guards):
            run.kernel.resets[e] = int(guard.reset is not None)
        v, stepper = run.kernel, run.stepper
        v.whole_reals, v.whole_integers = stepper.reals, stepper.integers
        v.fresh_reals, v.fresh_integers = stepper.reals.copy(), stepper.integers.copy()
        v.noted_reals, v.noted_integers = stepper.reals.copy(), stepper.integers.copy()
        v.noted_counts = v.counts.copy()
        v.n_whole_reals, v.n_whole_integers = len(stepper.reals), len(stepper.integers)
        v.n_counts = len(v.counts)
        v.chunk_of_runs = v.chunk

    def __call__(self, starts: Matrix, parameters: Matrix | None = None, lines: int = 0) -> Ends:
        """The ends of runs from consistent starts.

        Parameters
        ----------
        starts : (N, 1 + n_q + n + n_anchors + 2 n_contacts): t, q, (v, z), anchors, closed, armed
        parameters : (N, P) vector of each run; None: that of the run
        lines : how many lines of the log to keep
        """
        ends = self.until_stopped(starts, parameters, lines)
        if self.interrupted:
            raise KeyboardInterrupt
        return ends

    def until_stopped(
        self, starts: Matrix, parameters: Matrix | None = None, lines: int = 0,
        stopped: Callable[[], bool] | None = None,
    ) -> Ends:  # fmt: skip
        """The same of the runs that are done before somebody interrupts them, or `stopped` answers True.

        Whether there was an interruption says `interrupted`; `stopped` is asked between two calls of the kernel.
        """
        v, stepper = self.run.kernel, self.run.stepper
        count = len(starts)
        v.starts = np.ascontiguousarray(starts, dtype=float).ravel() if count else np.zeros(1)
        v.ends = np.zeros(max(count * v.end_width, 1))
        v.max_lines, v.lines = lines, np.zeros(max(count * lines * v.event_width, 1))
        v.n_parameters = 0 if parameters is None else len(self.run.first_parameters)
        if parameters is not None:
            v.given_parameters = np.ascontiguousarray(parameters, dtype=float).ravel()
        else:
            v.params[: len(self.run.first_parameters)] = self.run.first_parameters
        v.run, v.n_runs, v.begun = 0, count, 0
        self.interrupted, done, steps = False, False, MIN_STEPS
        while not done:
            v.steps_left, begun = steps, perf_counter()
            try:
                status = stepper.march_many()
                if status == codes.NEW_MODE:
                    stepper.add_mode()
                done = status == codes.DONE or (stopped is not None and stopped())
            except MbdError:  # no code for a mode: that is an outcome of this run
                self._leave()
            except KeyboardInterrupt:
                self.interrupted = done = True
            if v.steps_left <= 0:
                steps = max(MIN_STEPS, min(2 * steps, int(steps * CALL_TIME / max(perf_counter() - begun, 1e-6))))
        return self._ends(int(v.run), lines)

    def none(self) -> Ends:
        """The ends of no runs."""
        return self._ends(0, 0)

    def adjust(self, dt: float, latest: float) -> None:
        """Another step and another latest time [s] for the next calls."""
        v, stepper = self.run.kernel, self.run.stepper
        if v.dt == dt and v.last_time == latest:
            return
        stepper.reals[:] = v.fresh_reals
        v.dt = v.step = dt
        v.last_time = latest
        v.fresh_reals[:] = stepper.reals

    def _leave(self) -> None:
        """Leave the present run to Python, and go on with the next."""
        v = self.run.kernel
        place = int(v.run) * v.end_width
        v.ends[place : place + v.end_width] = 0.0
        v.ends[place], v.ends[place + 1] = codes.NEEDS_PYTHON, -1.0
        v.run, v.begun = int(v.run) + 1, 0

    def _ends(self, count: int, lines: int) -> Ends:
        v = self.run.kernel
        table = v.ends[: count * v.end_width].reshape(count, v.end_width)
        whole = table[:, : v.end_row - 1].astype(np.int64)
        n_c, at = v.n_contacts, v.end_row + v.width
        status, stopped_by, steps, events, sequence, n_lines = whole.T
        return Ends(
            status, stopped_by, steps, events, sequence, n_lines, table[:, v.end_row - 1],
            table[:, v.end_row : at], table[:, at : at + n_c].astype(np.int64),
            table[:, at + n_c : at + 2 * n_c].astype(np.int64), table[:, at + 2 * n_c :],
            v.lines[: count * lines * v.event_width].reshape(count, lines, v.event_width),
        )  # fmt: skip
