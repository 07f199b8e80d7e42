"""What a run holds between two calls of the kernel, which all that drives, saves and judges it takes."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from time import perf_counter
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.bodies.domains import ParameterCheck
from mbd.compile.mechanism import Mechanism
from mbd.dataclass import dataclass
from mbd.equations.switching_times import jumps_between, switches_of
from mbd.forces.base import Force
from mbd.integrators.base import Integrator
from mbd.kernel.contact.active_set import ActiveSetManager
from mbd.kernel.records import Kernel
from mbd.results.failure import Failure
from mbd.results.record import EventRecord
from mbd.results.turning import counted, function_of
from mbd.simulation.run.boundaries import WINDOW_STEPS, Boundaries
from mbd.simulation.run.event_log import EventLog
from mbd.simulation.run.idle import stepper_of
from mbd.simulation.run.stepper import Stepper, is_compiled
from mbd.state import State

STEPS_AT_ONCE = {True: 20000, False: 200}
"""Steps between two looks at the clock, compiled and interpreted: some 20 ms."""
FIRST_TABLE = 1 << 28
"""Largest table laid out at the start, of which only rows written take memory; it doubles as it fills [bytes]."""

WHY = {
    1: "impacts through several closed contacts crowded",
    2: "locating could not go on",
}
"""Reasons for non-smooth steps, by their number in `state[UNLOCATED]`."""


@dataclass
class EnergyFindings:
    """What the energy of a run tells.

    problem, note : what was found, in a sentence; '' if nothing
    row : the first from which on the energy is the scheme's own, −1 if there is none
    share : of the energy that the mechanism had, what the scheme gave (positive) or took [-]
    """

    problem: str = ""
    note: str = ""
    row: int = -1
    share: float = 0.0


@dataclass
class RoomFindings:
    """What is predicted of the memory of a run.

    problem : why the run had to end, in a sentence; '' if it did not
    note : what was predicted; '' if nothing
    """

    problem: str = ""
    note: str = ""


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


class RunData:
    """What a run was asked for, the kernel's arrays, and what was stored until now."""

    stepper_kind: type[Stepper] = Stepper
    rows_at_once = 1 << 14
    """Rows of results that the kernel may fill before it hands them over."""
    repeats = False
    """Whether the same run has been made before, so that its parameters need not be judged."""
    interrupted = False
    cause: BaseException | None = None
    ended = ""
    """The name of the event that ended it."""

    def __init__(
        self,
        model: Any,
        mechanism: Mechanism,
        manager: ActiveSetManager,
        integrator: Integrator,
        start: State,
        dt: float,
        end: float,
        stop: str | None,
        changed: Mapping[str, float],
        options: dict[str, Any],
        settings: dict[str, Any],
    ) -> None:
        if self.stepper_kind is Stepper and is_compiled(mechanism, integrator):
            from mbd.kernel.entry import entry  # with llvmlite, which runs in Python do without

            entry()  # the first run on a machine builds the kernel, which is no time of this run
        self.began = perf_counter()
        self.model = model
        self.mechanism, self.manager, self.start, self.end, self.stop = mechanism, manager, start, end, stop
        self.asked, self.changed, self.dt = settings, dict(changed), dt
        rows = int(min(self.rows_at_once, (end - start.time) / dt / options.get("store", 1) + 64))
        parameters = mechanism.parameters_of(model, self.changed)
        self.first_parameters = parameters.copy()
        compiled_options = {**options, "capacity": rows + 8 + 2 * len(manager.guards), "end": end}
        self.stepper = stepper_of(self.stepper_kind, mechanism, manager, integrator, parameters, dt, compiled_options)
        self.kernel = self.stepper.kernel
        self.kernel.chunk = _steps_at_once(self.stepper)
        width, capacity = self.kernel.width, self.kernel.capacity
        expected = 1.25 * (end - start.time) / dt / options.get("store", 1) + 1024
        self.table = _first_table(max(int(min(expected, FIRST_TABLE / (8 * width))), 3 * capacity), width)
        self.events: list[EventRecord] = []
        self.parameter_changes: list[tuple[int, Vector]] = []
        self.stored = 0
        self.history: list[Savepoint] = []
        self.pending: tuple[EventRecord, ...] = ()
        self.earlier: Sequence[EventRecord] = ()  # of the run that is repeated, for its message
        self.limit: int | None = None
        self.tried = 0
        self.label: float | None = None
        self.failure: Failure | None = None
        self.energy = EnergyFindings()
        self.room = RoomFindings()
        controllers = getattr(model, "controllers", ())
        self.turns = _TurnCounter()
        self.integrator = integrator
        self.boundaries = Boundaries(controllers, start.time, dt, end)
        self.kernel.last_time, self.kernel.near_end = end, self.boundaries.near
        self.begins_behind_jump = False
        self._find_breaks(start.time)
        self.damage = ""  # of the memory of the start
        self.doubts: list[str] = []  # about the result, in sentences
        self.resumed = self.carried = False

    @property
    def settings(self) -> dict[str, Any]:
        """What was asked for, with the strategy that contacts are treated by now."""
        return _settings_now(self.kernel, self.manager, self.asked)

    @property
    def now(self) -> float:
        return float(self.kernel.time)

    def set_parameters(self, changed: Mapping[str, float]) -> None:
        """Parameters that differ from the model's."""
        self.changed = dict(changed)
        self.kernel.params[: len(self.first_parameters)] = self.mechanism.parameters_of(self.model, self.changed)
        self._find_breaks(self.now)

    def _find_breaks(self, now: float) -> None:
        """The instants at which the equations jump with the present parameters, and those in its neighbourhood."""
        if not switches_of(self.mechanism.equations):
            return
        around = WINDOW_STEPS * self.dt
        span = min(self.start.time, now) - around, self.end + around
        highest = max(1, self.integrator.order() - 2)  # a jump of derivative k costs an error of dt^(k + 1)
        jumps = jumps_between(self.mechanism.equations, self.kernel.params, *span, self.dt, highest)
        self.boundaries.break_at(jumps, now, self.dt, bool(self.kernel.adaptive))

    def collect(self) -> None:
        """Take over the rows and events that the kernel has stored."""
        v = self.kernel
        count, logged = int(v.n_stored), int(v.n_logged)
        if not count and not logged:
            return
        if logged:
            width = v.event_width
            self.events += self.log.events(v.log[: logged * width].reshape(logged, width), self.stored)
        if count:
            self._make_room(count)
            rows = v.store.reshape(-1, v.width)[:count]
            if self.begins_behind_jump and not self.stored:
                rows[0, 0] = self.start.time
            self.table[self.stored : self.stored + count] = rows
            if self.stored:  # the kernel compares with rows of the same call
                change = np.abs(rows[0, 1 : 1 + v.n_q] - self.table[self.stored - 1, 1 : 1 + v.n_q])
                v.row_bounds[0] = np.maximum.reduce(change, initial=v.row_bounds[0])
        self.stored += count
        v.n_stored = v.n_logged = 0

    def _make_room(self, count: int) -> None:
        """Have places for so many more rows; a MemoryError leaves all as it is."""
        if self.stored + count <= len(self.table):
            return
        try:
            table = np.empty((2 * len(self.table) + count, self.kernel.width))
        except MemoryError:
            table = np.empty((self.stored + count, self.kernel.width))
        table[: self.stored] = self.table[: self.stored]
        self.table = table

    @cached_property
    def log(self) -> EventLog:
        """What names the events of the kernel."""
        return EventLog(self.manager)

    @cached_property
    def places(self) -> dict[str, str]:
        """The frames and joints of each force, for messages."""
        forces: list[Force] = getattr(self.model, "applied", getattr(self.model, "forces", []))
        return {force.name: _places(force) for force in forces}

    @cached_property
    def parameter_check(self) -> ParameterCheck:
        """The judgement of values of the model's parameters."""
        check: ParameterCheck = self.model.parameter_check()
        return check

    def count_turns(self) -> None:
        """Write the whole turns of spatial cut joints at the accepted state into the anchors."""
        self.turns.count(self.mechanism, self.kernel, self.stored, self.table)

    def move_to(self, time: float) -> None:
        """Put the clock, and the row just stored as the left side of a break, on its instant."""
        self.stepper.keep_row()
        self.collect()
        if self.stored and self.table[self.stored - 1, 0] == self.now:
            self.table[self.stored - 1, 0] = time
        self.kernel.time = time

    def state(self) -> State:
        """The accepted state."""
        self.count_turns()
        v = self.kernel
        names = self.manager.names
        armed = frozenset(name for name, flag in zip(names, v.armed.tolist(), strict=False) if flag == 1)
        y = v.y[: v.n].copy()
        n_v = v.n_v
        return State(
            self.now if self.label is None else self.label, v.q[: v.n_q].copy(), y[:n_v], y[n_v:],
            self.manager.mode(v.closed[: len(names)]), armed,
            v.anchors[: v.n_anchors].copy(), self.start.names, self.start.velocity_names, {}, dict(self.changed),
        )  # fmt: skip


def _settings_now(values: Kernel, manager: ActiveSetManager, asked: Mapping[str, Any]) -> dict[str, Any]:
    """The settings of a run, with the strategy that it has taken since."""
    cause = int(values.fallback) if values.auto else 0
    if cause == 0:
        return {**asked}
    since = float(values.fallback_time)
    count = sum(item.kind == "unilateral" for item in manager.contacts)
    reason = (
        f"contact='events' was chosen for {count} contacts until t = {since:.6g} s, then 'nonsmooth': {WHY[cause]}; "
        "contact='events' locates all the same, contact='nonsmooth' takes fixed steps from the start"
    )
    return {**asked, "contact": "nonsmooth", "contact_reason": reason, "nonsmooth_since": since}


def _steps_at_once(stepper: Stepper) -> int:
    """Steps of a call of the kernel; they follow from the size alone, as what is judged between calls must."""
    layout = stepper.mechanism.layout
    size = max((layout.n + layout.n_rows) // 10, 1)  # large mechanisms get better code at these looks
    return max(STEPS_AT_ONCE[stepper.compiled] // (size * size), STEPS_AT_ONCE[False])


def _places(force: Force) -> str:
    """The frames and joints of a force, for messages."""
    named = [getattr(mention, "full_name", getattr(mention, "name", None)) for mention in force.mentions()]
    return ", ".join(repr(name) for name in named if name)


def _first_table(rows: int, width: int) -> Matrix:
    """A table of so many rows, or of fewer where addresses are limited."""
    while True:
        try:
            return np.empty((rows, width))
        except MemoryError:
            if rows < 1024:
                raise
            rows //= 4


class _TurnCounter:
    """Counts the turns made since a stored row, whenever a state is asked for; see `mbd.results.stored_states`."""

    def __init__(self) -> None:
        self._row = 0
        self._turns = self._first = np.zeros(0)

    def count(self, mechanism: Mechanism, v: Kernel, stored: int, table: Matrix) -> None:
        """Write the turns of the accepted state into the anchors of a run that has stored these rows."""
        wrapped = mechanism.equations.wrapped
        waiting = int(v.n_stored)
        if not wrapped or stored + waiting == 0:
            return
        anchors = [turn.anchor for turn in wrapped]
        if not len(self._first):
            self._first = v.anchors[anchors].copy()
        if stored <= self._row or not len(self._turns):  # none yet, or the run went back
            self._row, self._turns = 0, self._first
        n_q, n_v = v.n_q, v.n_v
        now = np.concatenate([[float(v.time)], v.q[:n_q], v.y[:n_v]])
        width = len(now)
        fresh = v.store.reshape(-1, v.width)[:waiting, :width]
        rows = np.vstack([table[self._row : stored, :width], fresh, now])
        inputs = {
            "t": rows[:, 0], "q": rows[:, 1 : 1 + n_q], "v": rows[:, 1 + n_q :],
            "anchor": np.tile(v.anchors[: v.n_anchors], (len(rows), 1)),
        }  # fmt: skip
        inputs["anchor"][:, anchors] = self._turns
        found = mechanism.kept(function_of, lambda: function_of(wrapped))(inputs, v.params)
        turns = np.array([counted(rows[:, 0], *found[2 * k : 2 * k + 2]) for k in range(len(wrapped))])
        v.anchors[anchors] = self._turns + turns[:, -1]
        if stored > self._row:
            self._turns = self._turns + turns[:, stored - 1 - self._row]
            self._row = stored - 1
