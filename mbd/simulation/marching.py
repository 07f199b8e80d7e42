"""One run: the kernel called again and again, and what happens in Python between the calls."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any, Self

import numpy as np

from mbd.assembly.conflicts import Conflict, loops_of
from mbd.assembly.infeasibility import position_conflicts
from mbd.assembly.pose import Posture
from mbd.assembly.posture import close_positions, position_rows
from mbd.dataclass import found_late
from mbd.equal import EQUAL_RTOL
from mbd.equations.equations import Guard
from mbd.errors import MemoryLimitError, SimulationError, UnknownNameError
from mbd.kernel import codes
from mbd.kernel.records import TABLE
from mbd.results.columns import ModelColumns
from mbd.results.trajectory import EventRecord, Trajectory
from mbd.simulation.arguments import MAX_WAIT
from mbd.simulation.diagnostics.circular import circular_laws
from mbd.simulation.diagnostics.energy import EnergyWatch
from mbd.simulation.diagnostics.failures import attempt, crowded, explanation
from mbd.simulation.diagnostics.fastest import stability
from mbd.simulation.diagnostics.notes import Note, notes_of
from mbd.simulation.diagnostics.singular import at_singular_configuration
from mbd.simulation.diagnostics.turning import first_reversed, overturned
from mbd.simulation.run.begin import begin, check_rank, notify
from mbd.simulation.run.control import apply_reset, arrive, begin_controllers, call_controllers
from mbd.simulation.run.data import RunData
from mbd.simulation.run.ends import advance, call, close
from mbd.simulation.run.memory import carry_on, take_up
from mbd.simulation.run.pace import Pace
from mbd.simulation.run.room import Room
from mbd.simulation.run.savepoints import rewind, save
from mbd.simulation.run.stored import ended_record, whole_record
from mbd.simulation.run.strategy import go_on_unlocated, may_go_on_unlocated
from mbd.simulation.run.user_calls import call_user
from mbd.state import State

AHEAD = (1.0, 4.0, 16.0)
"""How many steps beyond the last accepted state are looked at, one after the other [-]."""
STEP_FAILURES = frozenset(
    {
        codes.NOT_FINITE, codes.NOT_CONVERGED, codes.SINGULAR, codes.STAGNATED, codes.DEPENDENT, codes.CONFLICT,
        codes.NO_LOCATION, codes.TOO_TIGHT,
        codes.TOO_NEAR, codes.TOO_SMALL, codes.SINGULAR_ROWS_MOVE, codes.OUTGROWN, codes.GAINED, codes.LEAPT,
        codes.UNSTABLE,
    }
)  # fmt: skip
"""What steps fail with next to such a limit."""

COUNTS = {
    name: TABLE.places[f"n_{name}"][1]
    for name in (
        "steps", "iterations", "tangents", "residuals", "factorizations", "events", "restarts", "impacts",
        "locations", "stagnations", "singular_steps", "shortened", "energetic_impacts",
        "endless", "pivoted",
    )
}  # fmt: skip
"""Counts of the kernel that results tell, and their places."""

INTERRUPTED = "interrupted"
"""The problem of a run that was interrupted, until its time is known."""
OVERFULL = (
    "t = {:.9g} s: more rows or events came in one step than there was room for: a fault of mbd, please report the "
    "model; a smaller dt has fewer events in a step"
)
"""The problem of a run whose rows and events outgrew what `advance` keeps free for a step."""


class Run(RunData):
    """Drives the kernel from a state to the end of a run."""

    energy: EnergyWatch
    room: Room
    gave_up: tuple[float, str] | None = None
    observers: Sequence[Callable[[float, State], None]] = ()
    progress: Callable[[float, float], None] | None = None

    def at_start(self) -> Self:
        """The run with its start in the kernel's arrays, or with what that remembers of an earlier run."""
        start = self.start
        self.energy, self.room, self.pace = EnergyWatch(), Room(self.kernel.width), Pace()
        self.resumed = take_up(self, start)
        notify(self)
        self.carried = self.resumed  # so do controllers
        if not self.resumed:
            begin(self, start)
            self.carried = carry_on(self, start)
            if self.changed and not self.repeats:
                check_rank(self, start, self.first_parameters)
        return self

    def observe(
        self, observers: Sequence[Callable[[float, State], None]], progress: Callable[[float, float], None] | None
    ) -> None:
        """Who is informed how far the run is."""
        self.observers, self.progress = observers, progress

    # the run ------------------------------------------------------------------------------------------------------
    def complete(self) -> tuple[Trajectory, str]:
        """Run to the end; the trajectory, and what went wrong ('' if nothing did)."""
        problem, message = self.march()
        try:
            return self._concluded(problem, message)
        except MemoryError:  # with what there is, and nothing that takes more
            self.history, self.cause = [], MemoryLimitError(self.room.exhausted(self))
            record = replace(
                whole_record(self), success=False, message=self.room.problem, final=self.state(), stats={"notes": []}
            )
            return Trajectory(record), self.room.problem

    def _concluded(self, problem: str, message: str) -> tuple[Trajectory, str]:
        """The trajectory of a march that is over, and what went wrong with either."""
        self.collect()
        settled, tried = True, attempt(self) if problem else None
        if problem:
            settled = rewind(self, failed=problem not in self._no_failures)
        final = close(self, settled)
        problem, fed = self._in_words(problem), self._in_words(self._guarded(self._judge_energy)[0])
        if self.stop and not problem and not self.ended:
            message = f"{self.stop!r} did not happen before t = {self.end:g} s"
            if isinstance(self.settings["until"], str) and self.limit is None:
                asked = f"in {MAX_WAIT} steps" if self.settings.get("dt") else "up to which a run with tol= waits"
                problem = f"{message}, {asked}; if it may not happen, give the latest time as well: "
                problem += f"until=({self.stop!r}, {self.end / 100.0:g})"
        if not problem:
            problem = fed or self._reversed() or overturned(self) or self._in_words(self._guarded(self._last_show)[0])
        if problem:
            self.failure = (tried or attempt(self))(problem, final)  # a replay finds its sentence again
        if fed not in ("", problem):
            problem = f"{problem}; before that, {fed}"
        if problem and not self.interrupted and self.stored:
            problem += stability(self, whole_record(self))
        return _trajectory_of(self, problem, message, final), problem

    @property
    def _no_failures(self) -> tuple[str, ...]:
        """Reasons to end between two steps, neither of which failed."""
        return INTERRUPTED, self.energy.problem, self.room.problem, self.pace.problem

    def march(self) -> tuple[str, str]:
        """Run until the end or a failure, of which nothing is taken back yet; (problem, message)."""
        return self._guarded(self._march)

    def _guarded(self, part: Callable[[], tuple[str, str]]) -> tuple[str, str]:
        """(problem, message) of a part of the run; what users' functions raise ends it in order."""
        try:
            return part()
        except (KeyboardInterrupt, SystemExit) as error:
            self.interrupted = True
            self.cause = error if isinstance(error, SystemExit) else None
            return INTERRUPTED, ""
        except MemoryError:
            self.cause = MemoryLimitError(self.room.exhausted(self))
            return self.room.problem, ""
        except (SimulationError, UnknownNameError) as error:
            self.cause = self.cause or error
            return str(error), ""

    def _in_words(self, problem: str) -> str:
        """A problem in words; an interruption happened at the state that was kept."""
        if problem == INTERRUPTED:
            return f"interrupted at t = {self.now:.6g} s; everything until then is kept"
        return problem

    def _march(self) -> tuple[str, str]:
        """Kernel, reaction, kernel, … until the end; (problem, message)."""
        shown = 0.0
        if not self.carried:
            begin_controllers(self)
        save(self, self.pending)
        self.ended = ""
        if self.pending:
            self.ended, self.pending = self._react(self.pending), ()
            save(self)
        while not self.ended:
            known = len(self.events)
            target, due = self.boundaries.next(self.end)
            jump = self.boundaries.ahead
            self.kernel.next_jump = jump.left if jump is not None else np.nan
            self._make_room(2 * self.kernel.capacity)  # before they are made: then none is lost
            status = advance(self, target, due)
            self.collect()
            if self.kernel.n_lost:
                return OVERFULL.format(self.now), ""
            if status == codes.NEW_MODE:
                self.stepper.add_mode()
            elif status == codes.DONE:
                circular = circular_laws(self.stepper)
                if not circular and self.boundaries.is_end(target, self.end):  # left to a run that continues
                    self.label = self.end
                    return "", f"reached t = {self.end:g} s"
                save(self)
                if circular:
                    return f"t = {self.now:.9g} s: {circular}", ""
                arrive(self, target)
            elif status == codes.EVENT:
                save(self, self.events[known:])
                self.ended = self._react(self.events[known:])
            elif status not in (codes.FULL, codes.PAUSE) and not self._goes_on_unlocated(status):
                return self._explained(status), ""
            save(self)
            problem = crowded(self.events, self.now, self.dt) or self.room.check(self) or self.pace.check(self)
            if not problem and (circular := circular_laws(self.stepper)):
                problem = f"t = {self.now:.9g} s: {circular}"
            if not problem and self.limit is None and self.energy.is_due(self):
                problem = self.energy.judge(self)
            if problem:
                self.cause = MemoryLimitError(problem) if problem == self.room.problem else self.cause
                return problem, ""
            if self.limit is not None and self.kernel.n_steps >= self.limit:
                return "", f"stopped after {self.limit} steps at t = {self.now:g} s"
            if perf_counter() - shown > 0.1:  # wall time between two looks [s]
                shown = perf_counter()
                self._show()
        return self._finish()

    def _finish(self) -> tuple[str, str]:
        """Store the row after the event that ends the run, and take others that happen at the same instant."""
        status = codes.EVENT
        while status == codes.EVENT:
            save(self)
            known = len(self.events)
            status = call(self, self.now, np.inf)
            self.collect()
            self._react(self.events[known:])
        if status not in (codes.DONE, codes.NEW_MODE):
            return self._explained(status), ""
        return "", f"ended by {self.ended!r} at t = {self.now:.6g} s"

    def _goes_on_unlocated(self, status: int) -> bool:
        """Whether the step that failed was taken back, and non-smooth steps follow in the place of located instants."""
        if not may_go_on_unlocated(self, status):
            return False
        reason = self._explained(status)
        if not rewind(self, failed=True):
            return False
        self.gave_up = self.now, reason
        go_on_unlocated(self)
        return True

    def _explained(self, status: int) -> str:
        if self.gave_up is not None and self.gave_up[0] == self.now:
            return f"{self.gave_up[1]}; non-smooth steps do not go on from there either"
        n_q, n_v = self.kernel.n_q, self.kernel.n_v
        rates = np.abs(self.table[: self.stored, 1 + n_q : 1 + n_q + n_v])
        swiftest = float(np.max(rates, initial=0.0))
        events = [*self.earlier, *self.events]
        beyond = _out_of_reach(self, status) or at_singular_configuration(self, status)
        return explanation(self.stepper, status, events, self.places, swiftest, beyond)

    def _show(self, finished: bool = False) -> None:
        if self.progress is not None:
            call_user("progress", self.progress, self.now, self.now if finished else self.end)
        for observer in self.observers:
            call_user("an observer", observer, self.now, self.state())

    def _judge_energy(self) -> tuple[str, str]:
        """Whether the scheme itself has put energy in; a replay of a few steps is not asked."""
        return (self.energy.judge(self) if self.limit is None else ""), ""

    def _reversed(self) -> str:
        """A cut joint that a step too long has turned the wrong way round in a stored row, in a sentence; else ''."""
        if self.limit is not None or not self.mechanism.equations.facings:
            return ""
        found = first_reversed(self.mechanism, ModelColumns(whole_record(self), self.mechanism.equations))
        if found is None:
            return ""
        joint, time = found
        return (
            f"t = {time:.9g} s: {joint!r} was turned by half a turn in one step and is the wrong way round there, "
            "which its rows cannot tell; results from then on are of another mechanism; take a smaller dt, or tol=, "
            "or do not cut it"
        )

    def _last_show(self) -> tuple[str, str]:
        self._show(finished=True)
        return "", ""

    def _react(self, happened: Sequence[EventRecord]) -> str:
        """Resets, controllers and endings of the events just logged; the name of the event that ends the run."""
        guards = {guard.name: guard for guard in self.manager.guards}
        ended = ""
        for event in happened:
            if event.kind not in ("closed", "event"):
                continue
            guard = guards[event.name] if event.kind == "event" else None
            if guard is not None and guard.reset is not None:
                self.reset(guard)
            call_controllers(self, event.name)
            if (self.stop and self.manager.happens(self.stop, event.name)) or (guard is not None and guard.terminal):
                ended = event.name if self.stop is None or guard is None or guard.terminal else self.stop
        return ended

    def reset(self, guard: Guard) -> None:
        """What a user's event sets; after a row of its own where the row of that with which it happens is stored."""
        apply_reset(self, guard)
        if guard.transition is not None:
            self.kernel.restart_due = 1


def _trajectory_of(run: RunData, problem: str, message: str, final: State) -> Trajectory:
    """The run by name; `problem` is '' if it went as far as it was asked to. Its message tells what is in doubt."""
    record = ended_record(run)
    notes, run.doubts = notes_of(run, record)
    text = problem or "; but ".join([message, *run.doubts])
    ended = record.concluded(success=not problem, message=text, failure=run.failure, final=final)
    return Trajectory(found_late(ended, "stats", _statistics(run, notes)))


def _statistics(run: RunData, notes: Sequence[Note]) -> Callable[[], dict[str, Any]]:
    """What gives counts and notes."""
    counts = run.kernel.counts.tolist()
    numbers: dict[str, Any] = {name: counts[place] for name, place in COUNTS.items()}
    if run.kernel.adaptive:
        numbers["rejected"] = int(run.kernel.n_rejected)
    if run.kernel.adaptive or run.kernel.estimates:
        numbers["local_errors"] = float(run.kernel.error_sum)
    if run.kernel.n_cones > 0 and run.kernel.strategy == 1:
        numbers["cone_residual"] = float(run.kernel.cone_residual)
    numbers["modes"] = int(run.kernel.n_modes)
    numbers["compiled"] = run.stepper.compiled
    numbers["optimized"] = run.stepper.compiled and not run.stepper.provisional
    numbers["derive_and_compile_seconds"] = run.mechanism.seconds
    numbers["notes"] = []
    numbers["wall_seconds"] = perf_counter() - run.began

    def statistics() -> dict[str, Any]:
        numbers["notes"] = [one for note in notes for one in ([note] if isinstance(note, str) else note())]
        return numbers

    return statistics


def _out_of_reach(run: RunData, status: int) -> str:
    """A sentence on the constraints that cannot hold together soon after the accepted state, '' if none.

    A linkage that a driver pulls to its limit ends next to a singular configuration, where steps fail for reasons of
    their own; that no position exists beyond it is the cause.
    """
    if status not in STEP_FAILURES or not _follows_time(run):
        return ""
    try:
        return _first_conflict(run)
    except np.linalg.LinAlgError:
        return ""


def _first_conflict(run: RunData) -> str:
    """The same of rows that follow time."""
    for steps in AHEAD:
        found = _conflict(run, steps * run.dt)
        if found is not None:
            return f"by t = {run.now + steps * run.dt:.6g} s {found}"
    return ""


def _follows_time(run: RunData) -> bool:
    """Whether a row on positions that acts changes with time while nothing moves."""
    rows = position_rows(_posture(run, 0.0))
    off = [np.max(np.abs(_heights(_posture(run, ahead * run.dt), rows)), initial=0.0) for ahead in AHEAD]
    return bool(rows) and bool(np.isfinite(off).all()) and max(off) > EQUAL_RTOL


def _posture(run: RunData, ahead: float) -> Posture:
    """The accepted positions at a later time."""
    v = run.kernel
    return Posture(
        run.mechanism, run.manager, v.params, v.q[: v.n_q].copy(), v.y[: v.n].copy(),
        v.closed[: v.n_contacts].copy(), v.anchors.copy(), time=run.now + ahead,
    )  # fmt: skip


def _heights(work: Posture, rows: list[int]) -> np.ndarray:
    """What the rows are off."""
    terms = work.terms()
    return np.asarray(terms.h[rows])


def _closes(run: RunData, ahead: float) -> bool:
    work = _posture(run, ahead)
    left = close_positions(work, position_rows(work), np.ones(work.equations.n_v, dtype=bool))
    return bool(np.max(np.abs(left), initial=0.0) <= EQUAL_RTOL)


def _conflict(run: RunData, ahead: float) -> Conflict | None:
    """The first irreducible set of constraints that no position satisfies at a later time."""
    if _closes(run, ahead):
        return None
    work = _posture(run, ahead)
    found = position_conflicts(work, position_rows(work), work.q.copy(), loops_of(run.model), tried=True)
    return found[0] if found else None
