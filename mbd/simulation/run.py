"""One run: the kernel called again and again, and what happens in Python between the calls."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from time import perf_counter
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.assembly import BELOW, undetermined
from mbd.compile.mechanism import Mechanism
from mbd.equations.equations import Contact
from mbd.errors import ModelError, SimulationError, UnknownNameError
from mbd.forces.base import Force
from mbd.integrators.base import Integrator
from mbd.kernel import fields as F
from mbd.kernel.active_set import ActiveSetManager
from mbd.posture import Posture
from mbd.results.failure import Failure
from mbd.simulation.asked import asked
from mbd.simulation.control import Boundaries, Named, apply_reset
from mbd.simulation.ends import advance, call, close
from mbd.simulation.failures import attempt, crowded, explanation
from mbd.simulation.memory import take_up
from mbd.simulation.redundant import redundancy
from mbd.simulation.savepoints import Savepoint, rewind, save
from mbd.simulation.stepper import Stepper
from mbd.state import State
from mbd.trajectory import EventRecord, Record, Trajectory

__all__ = ["Run"]

ROWS_AT_ONCE = 1 << 14
"""Rows of results that the kernel may fill before it hands them over."""
STEPS_AT_ONCE = {True: 20000, False: 200}
"""Steps between two looks at the clock, compiled and interpreted: some 20 ms."""
SHOW_EVERY = 0.1
"""Wall time between two calls of progress and observers [s]."""
RESOLVED = 10.0
"""Steps that a penalty contact must last to be resolved at all."""
MOST_EXPECTED = 1 << 22
"""Rows for which a table is laid out at the start; longer runs enlarge it."""
INTERRUPTED = "interrupted"
"""The problem of a run that was interrupted, until its time is known."""
KINDS = ("closed", "opened", "event", "stuck", "slipped")
"""Names of the kinds of events that the kernel logs by number."""


class Run:
    """Drives the kernel from a state to the end of a run and keeps what it stores."""

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
        self.began = perf_counter()
        self.model = model
        self.mechanism, self.manager, self.start, self.end, self.stop = mechanism, manager, start, end, stop
        self.settings, self.changed, self.dt = settings, dict(changed), dt
        forces = [force for force in getattr(model, "forces", ()) if isinstance(force, Force)]
        self.places = {force.name: _places(force) for force in forces}
        rows = int(min(ROWS_AT_ONCE, (end - start.time) / dt / options.get("store", 1) + 64))
        self.folded = getattr(model, "parameters", {})
        parameters = mechanism.parameters(changed, self.folded)
        self.first_parameters = parameters.copy()
        compiled_options = {**options, "capacity": rows + 8, "end": end}
        self.stepper = Stepper(mechanism, manager, integrator, parameters, dt, compiled_options)
        self.values = self.stepper.values
        self.values["chunk"] = STEPS_AT_ONCE[self.stepper.compiled]
        expected = min(1.25 * (end - start.time) / dt / options.get("store", 1) + 1024, MOST_EXPECTED)
        self.table = np.empty((int(expected), self.values["width"]))  # memory is taken as rows are written
        self.events: list[EventRecord] = []
        self.parameter_changes: list[tuple[int, Vector]] = []
        self.stored = 0
        self.cause: Exception | None = None
        self.history: list[Savepoint] = []
        self.pending: tuple[EventRecord, ...] = ()
        self.earlier: Sequence[EventRecord] = ()  # of the run that is repeated, for its message
        self.limit: int | None = None
        self.tried = 0
        self.label: float | None = None
        self.failure: Failure | None = None
        self.observers: Sequence[Callable[[float, State], None]] = ()
        self.progress: Callable[[float, float], None] | None = None
        controllers, instants = getattr(model, "controllers", ()), getattr(model, "instants", ())
        self.boundaries = Boundaries(controllers, instants, start.time, dt, end)
        self.resumed = take_up(self, start)
        self._notify()
        if not self.resumed:
            self._begin(start)
            if changed:
                self._check(start, parameters)

    def observe(
        self, observers: Sequence[Callable[[float, State], None]], progress: Callable[[float, float], None] | None
    ) -> None:
        """Who is told how far the run is."""
        self.observers, self.progress = observers, progress

    # the start ----------------------------------------------------------------------------------------------------
    def _notify(self) -> None:
        """Of which contacts and events Python must hear."""
        notify = self.values["notify"]
        ends = {self.stop} | {name for controller in self.boundaries.controllers for name in controller.on}
        for c, contact in enumerate(self.manager.contacts):
            notify[c] = int(contact.name in ends)
        for e, guard in enumerate(self.manager.guards):
            wanted = guard.terminal or guard.reset is not None or guard.name in ends
            notify[self.values["n_contacts"] + e] = int(wanted)

    def _begin(self, start: State) -> None:
        v = self.values
        v["q"][: v["n_q"]] = start.q
        v["y"][: v["n"]] = np.concatenate([start.v, start.z])
        if len(start.anchors):
            v["anchors"][:] = start.anchors
        n_contacts, n_guards = v["n_contacts"], v["n_guards"]
        v["closed"][:n_contacts] = self.manager.flags(start.mode.closed)
        armed = start.armed if start.armed is not None else set(self.manager.names) - start.mode.closed
        v["armed"][:n_contacts] = self.manager.flags(armed)
        v["clock"][F.NOW] = v["clock"][F.BASE] = start.time
        v["clock"][F.LAST_SWITCH] = -np.inf
        v["state"][F.RESTART], v["state"][F.MODE] = 1, -1
        guards, inside = self._guard_values(), []
        rates = self.mechanism.acceleration_terms(
            start.time, start.q, v["y"][: v["n"]], v["params"], v["anchors"][: v["n_anchors"]]
        ).rate
        for c in range(n_contacts):
            close, slow = abs(guards[c]) <= 1e-8, abs(guards[n_contacts + c]) <= 1e-9
            target = v["while_target"][c]
            watched = (True, v["closed"][target] == 1, guards[3 * n_contacts + c] > 0.0)[v["while_kind"][c]]
            ready = v["armed"][c] == 1 and watched
            held = [row for row in self.manager.contacts[c].rows if self.mechanism.equations.rows[row].friction < 0]
            still = all(abs(rates[row]) <= 1e-9 for row in held)
            v["touched"][c] = int(ready and v["kind"][c] == 0 and close and slow and still)
            if ready and v["closed"][c] == 0 and guards[c] < -BELOW:
                contact = self.manager.contacts[c]
                inside.append(
                    f"{contact.name!r} starts {-guards[c]:.6g} {contact.unit} inside its surface; assemble the start "
                    "with it in closed=[…] or open=[…]"
                )
        if inside:
            raise ModelError(inside)
        for e in range(n_guards):
            self._set_side(e, guards)

    def _check(self, start: State, parameters: Vector) -> None:
        """Values of parameters may take away what determines the motion."""
        y, flags = np.concatenate([start.v, start.z]), self.values["closed"][: self.values["n_contacts"]]
        faults = undetermined(
            Posture(
                self.mechanism, self.manager, parameters, start.q, y, flags, self.values["anchors"], time=start.time
            )
        )
        if faults:
            raise ModelError(faults)

    def _guard_values(self) -> Vector:
        v = self.values
        block = self.mechanism.block(
            v["clock"][F.NOW], v["q"][: v["n_q"]], v["y"][: v["n"]], v["anchors"][: v["n_anchors"]]
        )
        out = np.zeros(max(self.mechanism.sizes["guards"], 1))
        if self.mechanism.sizes["guards"]:
            self.mechanism.common["guards"](block, v["params"], out)
        return out

    def _set_side(self, e: int, guards: Vector) -> None:
        """The sign from which a user's guard will cross next; at zero its rate decides."""
        n_contacts, n_guards = self.values["n_contacts"], self.values["n_guards"]
        value, rate = guards[4 * n_contacts + e], guards[4 * n_contacts + n_guards + e]
        decider = value if abs(value) > 1e-9 else rate
        self.values["side"][e] = 1.0 if decider > 0.0 else -1.0

    def _reset(self, e: int) -> None:
        """Apply the reset of a user's guard at zero; one that turns its motion around will cross from the same side."""
        place = 4 * self.values["n_contacts"] + e
        before = self._guard_values()
        apply_reset(self, self.manager.guards[e])
        guards, rate = self._guard_values(), place + self.values["n_guards"]
        stays = guards[place] == before[place]  # 'linear' location leaves it near zero, on either side
        if abs(guards[place]) > 1e-9 and not stays:
            self._set_side(e, guards)
        elif before[rate] * guards[rate] <= 0.0:
            self.values["side"][e] *= -1.0

    # the run ------------------------------------------------------------------------------------------------------
    def complete(self) -> tuple[Trajectory, str]:
        """Run to the end; the trajectory, and what went wrong ('' if nothing did)."""
        problem, message = self.march()
        self.collect()
        settled = True
        if problem:
            tried = attempt(self)
            settled = rewind(self, failed=problem != INTERRUPTED)
        final = close(self, settled)
        problem = self._told(problem)
        if self.stop and not problem and not message.startswith("ended"):
            message = f"{self.stop!r} did not happen before t = {self.end:g} s"
        if problem:
            self.failure = tried(problem, final)
        else:
            problem = self._told(self._guarded(self._last_show)[0])
            self.failure = attempt(self)(problem, final) if problem else None
        return self._trajectory(problem, message, final), problem

    def march(self) -> tuple[str, str]:
        """Run until the end or a failure, of which nothing is taken back yet; (problem, message)."""
        return self._guarded(self._march)

    def _guarded(self, part: Callable[[], tuple[str, str]]) -> tuple[str, str]:
        """(problem, message) of a part of the run; what users' functions raise ends it in order."""
        try:
            return part()
        except KeyboardInterrupt:
            return INTERRUPTED, ""
        except (SimulationError, UnknownNameError) as error:
            self.cause = self.cause or error
            return str(error), ""

    def _told(self, problem: str) -> str:
        """A problem in words; an interruption happened at the state that was kept."""
        if problem == INTERRUPTED:
            return f"interrupted at t = {self.now:.6g} s; everything until then is kept"
        return problem

    def _march(self) -> tuple[str, str]:
        """Kernel, reaction, kernel, … until the end; (problem, message)."""
        shown = 0.0
        if not self.resumed:
            self.boundaries.begin(self)
        save(self, self.pending)
        ended = self._react(self.pending)
        self.pending = ()
        save(self)
        while not ended:
            known = len(self.events)
            target, due = self.boundaries.next(self.end)
            status = advance(self, target, due)
            self.collect()
            if status == F.NEW_MODE:
                self.stepper.add_mode()
            elif status == F.DONE:
                save(self)
                if not self.boundaries.arrive(self, target, self.end):
                    self.label = self.end
                    return "", f"reached t = {self.end:g} s"
            elif status == F.EVENT:
                save(self, self.events[known:])
                ended = self._react(self.events[known:])
            elif status not in (F.FULL, F.PAUSE):
                return self._explained(status), ""
            save(self)
            problem = crowded(self.events, self.now, self.dt)
            if problem:
                return problem, ""
            if self.limit is not None and self.values["counts"][F.STEPS] >= self.limit:
                return "", f"stopped after {self.limit} steps at t = {self.now:g} s"
            if perf_counter() - shown > SHOW_EVERY:
                shown = perf_counter()
                self._show()
        return self._finish(f"ended by {ended!r} at t = {self.now:.6g} s")

    def _finish(self, message: str) -> tuple[str, str]:
        """Store the row after the event that ends the run."""
        save(self)
        status = call(self, self.now, np.inf)
        self.collect()
        ended = status in (F.DONE, F.EVENT, F.NEW_MODE)
        return ("", message) if ended else (self._explained(status), "")

    def _explained(self, status: int) -> str:
        return explanation(self.stepper, status, [*self.earlier, *self.events], self.places)

    @property
    def now(self) -> float:
        return float(self.values["clock"][F.NOW])

    def _show(self, finished: bool = False) -> None:
        if self.progress is not None:
            asked("progress", self.progress, self.now, self.now if finished else self.end)
        for observer in self.observers:
            asked("an observer", observer, self.now, self.state())

    def _last_show(self) -> tuple[str, str]:
        self._show(finished=True)
        return "", ""

    def collect(self) -> None:
        """Take over the rows and events that the kernel has stored."""
        v = self.values
        count, logged = int(v["state"][F.STORED]), int(v["state"][F.LOGGED])
        lines = v["log"].reshape(-1, v["event_width"])[:logged]
        guards = [guard.name for guard in self.manager.guards]
        frictions = [friction.name for friction in self.manager.frictions]
        for line in lines:
            kind = KINDS[int(line[1])]
            index, impulse = int(line[2]), np.zeros(0)
            names = {"event": guards, "stuck": frictions, "slipped": frictions}.get(kind, self.manager.names)
            name = names[index]
            if kind == "closed":
                impulse = line[[5 + k for k in self.manager.contacts[index].rows]].copy()
            self.events.append(
                EventRecord(float(line[0]), kind, name, impulse, float(line[3]), self.stored + int(line[4]))
            )
        if count:
            if self.stored + count > len(self.table):
                self.table = np.concatenate([self.table, np.empty((len(self.table) + count, v["width"]))])
            self.table[self.stored : self.stored + count] = v["store"].reshape(-1, v["width"])[:count]
        self.stored += count
        v["state"][F.STORED] = v["state"][F.LOGGED] = 0

    def _react(self, happened: Sequence[EventRecord]) -> str:
        """Resets, controllers and endings of the events just logged; the name of the event that ends the run."""
        guards = {guard.name: e for e, guard in enumerate(self.manager.guards)}
        ended = ""
        for event in happened:
            if event.kind not in ("closed", "event"):
                continue
            guard = self.manager.guards[guards[event.name]] if event.kind == "event" else None
            if guard is not None and guard.reset is not None:
                self._reset(guards[event.name])
            self.boundaries.call(self, event.name)
            if event.name == self.stop or (guard is not None and guard.terminal):
                ended = event.name
        return ended

    def change_parameters(self, values: Mapping[str, float]) -> None:
        """New parameter values from now on; the scheme restarts from them if they differ."""
        equations = self.mechanism.equations
        present = {parameter.name: v for parameter, v in zip(equations.parameters, self.values["params"], strict=False)}
        if all(present.get(name) == value for name, value in values.items()):
            return
        self.stepper.keep_row()
        self.set_parameters({**self.changed, **values})
        self.parameter_changes.append((self.stored + int(self.values["state"][F.STORED]), self.values["params"].copy()))
        self.values["state"][F.RESTART] = 1

    def set_parameters(self, changed: Mapping[str, float]) -> None:
        """Parameters that differ from the model's."""
        self.changed = dict(changed)
        self.values["params"][: len(self.first_parameters)] = self.mechanism.parameters(self.changed, self.folded)

    def move_to(self, time: float) -> None:
        """Put the clock, and the row just stored as the left side of a break, on its instant."""
        self.stepper.keep_row()
        self.collect()
        if self.stored and self.table[self.stored - 1, 0] == self.now:
            self.table[self.stored - 1, 0] = time
        self.values["clock"][F.NOW] = time

    def named(self) -> Named:
        """Named quantities at the present state."""
        return Named(self)

    # the result ---------------------------------------------------------------------------------------------------
    def state(self) -> State:
        """The accepted state."""
        v = self.values
        names = np.array(self.manager.names)
        armed = frozenset(str(name) for name in names[v["armed"][: len(names)] == 1])
        y = v["y"][: v["n"]].copy()
        n_v = v["n_v"]
        return State(
            self.now if self.label is None else self.label, v["q"][: v["n_q"]].copy(), y[:n_v], y[n_v:],
            self.manager.mode(v["closed"][: len(names)]), armed,
            v["anchors"][: v["n_anchors"]].copy(), self.start.names, self.start.velocity_names, {}, dict(self.changed),
        )  # fmt: skip

    def _trajectory(self, problem: str, message: str, final: State) -> Trajectory:
        v, equations = self.values, self.mechanism.equations
        table = self.table[: self.stored]
        n_q, n_v, n, rows = v["n_q"], v["n_v"], v["n"], v["n_rows"]
        cuts = np.cumsum([1, n_q, n_v, n - n_v, n_v, n - n_v, rows])
        time, q, velocity, z, a, s, lam, closed = np.split(table, cuts, axis=1)
        last = len(table) - 1  # a run that failed right at an event has no row after it
        events = [event if event.row <= last else replace(event, row=last) for event in self.events]
        record = Record(
            equations=equations, parameters=self.first_parameters,
            parameter_names=[parameter.name for parameter in equations.parameters], time=time[:, 0], q=q, v=velocity,
            z=z, a=a, s=s, lam=lam, closed=closed.astype(np.uint8), events=events, stats=self._statistics(),
            success=not problem, message=problem or message, failure=self.failure, final=final,
            settings=self.settings, parameter_changes=self.parameter_changes, start=self.start,
        )  # fmt: skip
        return Trajectory(record)

    def _statistics(self) -> dict[str, Any]:
        counts = self.values["counts"]
        names = (
            "steps", "iterations", "tangents", "residuals", "factorizations", "events", "restarts", "impacts",
            "locations", "stagnations", "careful", "shortened", "energetic_impacts",
        )  # fmt: skip
        numbers: dict[str, Any] = {name: int(counts[place]) for place, name in enumerate(names)}
        numbers["modes"] = len(self.stepper.modes)
        numbers["compiled"] = self.stepper.compiled
        numbers["derive_and_compile_seconds"] = self.mechanism.seconds
        numbers["notes"] = self._notes()
        numbers["wall_seconds"] = perf_counter() - self.began
        return numbers

    def _notes(self) -> list[str]:
        """What the user should know of contacts that were ignored on purpose."""
        v, notes = self.values, list(self.mechanism.notes)
        dependent = redundancy(self.mechanism.equations.rows, self.stepper.dependent)
        notes += [dependent] if dependent else []
        shortened = int(v["counts"][F.SHORTENED])
        if shortened:
            notes.append(
                f"{shortened} steps were shortened where Newton's method or the impact law failed at the full dt, or "
                "where a step would have ended too close to a pose in which rows lose rank"
            )
        careful = int(v["counts"][F.CAREFUL])
        if careful:
            notes.append(
                f"poses in which rows lose rank were passed: {careful} steps next to them held positions alone on the "
                "rows; their velocities and multipliers are less accurate"
            )
        energetic = int(v["counts"][F.STRONGE])
        if energetic:
            notes.append(
                f"{energetic} impacts took Stronge's energetic restitution, where the {self.settings['impact']} law "
                "would have created energy"
            )
        endless = int(v["counts"][F.ENDLESS])
        if endless:
            notes.append(
                f"{endless} times contacts struck by turns without end at one instant; they were closed together, "
                "which is the limit of these impacts"
            )
        for c, contact in enumerate(self.manager.contacts):
            if v["deepest"][c] < -1e-9:
                notes.append(
                    f"{contact.name!r} lay up to {-v['deepest'][c]:.3g} {contact.unit} below its surface while ignored"
                )
            if np.isfinite(v["sinking"][c]):
                notes.append(
                    f"{contact.name!r} was released at t = {v['sinking'][c]:.6g} s while moving into its surface"
                )
            notes += self._short_touch(contact)
        return notes

    def _short_touch(self, contact: Contact) -> list[str]:
        """A penalty contact over within a few steps is not resolved: its energy is anyone's guess."""
        if contact.kind != "penalty":
            return []
        times = [(event.kind, event.time) for event in self.events if event.name == contact.name]
        spans = [b[1] - a[1] for a, b in pairwise(times) if (a[0], b[0]) == ("closed", "opened")]
        if not spans or min(spans) >= RESOLVED * self.dt:
            return []
        return [
            f"{contact.name!r} closed for {min(spans) / self.dt:.2g} steps only, too few: its peak force and energy "
            f"are not resolved; use dt below {min(spans) / 20.0:.2g} s, a softer stiffness, or mbd.Unilateral"
        ]


def _places(force: Force) -> str:
    """The frames and joints of a force, for messages."""
    named = [getattr(mention, "full_name", getattr(mention, "name", None)) for mention in force.mentions()]
    return ", ".join(repr(name) for name in named if name)
