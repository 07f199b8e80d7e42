"""The return map of a walker: from a state just after an event to the next one, sides exchanged if it is symmetric."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import field, replace
from functools import cached_property
from math import sqrt
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.assembly.manager import manager_of
from mbd.bodies.domains import ParameterCheck
from mbd.compile.mechanism import Mechanism
from mbd.compile.mechanisms import mechanism_of
from mbd.compile.python import ScalarFunction, scalar_function
from mbd.constraints.base import Constraint
from mbd.constraints.rolling_touchdown import RollingSole
from mbd.dataclass import dataclass
from mbd.equal import INSTANT_RTOL
from mbd.errors import MbdError, ModelError
from mbd.gait.alike import moves_sides_alike, sides_faults
from mbd.gait.extrapolation import slopes_of
from mbd.gait.heading import Heading
from mbd.gait.machines import counted_from, stored_by
from mbd.gait.mirror import Mirror
from mbd.gait.outcome import Outcome, fall_of
from mbd.gait.section import Section
from mbd.integrators import Integrator
from mbd.results.facts import Facts
from mbd.simulation.interrupted import stopped
from mbd.simulation.repeated import End, RepeatedRun
from mbd.simulation.simulate import simulate
from mbd.state import State

Values = Mapping[str, float]
"""Parameters and values of functions of parameters, by name."""


@dataclass(frozen=True, eq=False)
class Arrival:
    """Where one or several returns have led.

    state : on the section, sides exchanged where the map does; its time is 0
    outcome : arrives, or why not
    period : time that it took [s]; travel : way along the coordinates that the walker moves on along, one each
    steps : (foot, time since the beginning [s], distance of its place from that of the other foot [m]) of every
        touchdown, in the names of a walk without exchange of sides; NaN where more feet than two make it unclear
    before : contacts closed just before the last event
    events : (name, kind) of all returns in order, in the names of a walk without exchange of sides; penalty contacts,
        which change nothing abruptly, are none
    stored : anchors that machines stored at the last instant
    """

    state: State
    outcome: Outcome
    period: float
    travel: Vector
    steps: tuple[tuple[str, float, float], ...]
    before: frozenset[str]
    events: tuple[tuple[str, str], ...]
    stored: frozenset[int] = frozenset()


@dataclass(eq=False)
class _Walk:
    """An application of the map while it is made."""

    state: State
    values: Values
    travel: Vector
    outcome: Outcome = field(default_factory=lambda: Outcome("arrives", ""))
    period: float = 0.0
    steps: list[tuple[str, float, float]] = field(default_factory=list)
    events: list[tuple[str, str]] = field(default_factory=list)
    stored: frozenset[int] = frozenset()
    end: End | None = None

    def arrival(self) -> Arrival:
        """Where it has led."""
        assert self.end is not None
        return Arrival(
            self.state,
            self.outcome,
            self.period,
            self.travel,
            tuple(self.steps),
            self.end.before,
            tuple(self.events),
            self.stored,
        )


@dataclass(eq=False)
class ReturnMap:
    """The map of a model, compiled once and laid out once.

    section : name of the event; mirror : None or how sides are exchanged; strides : returns of one application
    functions : {'slope': f} with f(value) → {parameter: value}, whose names may stand among parameters
    longest : latest time of one return [s]
    fixed : numbers of increments along which the walker moves on
    heading : turns about the vertical that change nothing; None: there are none
    """

    model: Any
    integrator: Integrator
    dt: float
    section: str
    mirror: Mirror | None
    strides: int
    functions: Mapping[str, Callable[[float], Mapping[str, float]]]
    longest: float
    values: dict[str, float]
    backend: str
    start: State
    fixed: tuple[int, ...] = ()
    heading: Heading | None = None
    runs: int = 0

    def __post_init__(self) -> None:
        self._last: tuple[Values, Vector] | None = None
        self._allowed: dict[str, float] | None = None
        self._of_both_sides: set[tuple[str, float]] = set()
        plain = self.plain(self.values)
        self.mechanism: Mechanism = mechanism_of(self.model, self.backend, plain)
        self.manager = manager_of(self.mechanism, self.vector(self.values))
        self.penalties = {contact.name for contact in self.manager.contacts if contact.kind == "penalty"}
        self.feet: dict[str, str] = self.mechanism.kept(ReturnMap, self._feet)
        words = [word for word in getattr(self.model, "constraints", ()) if isinstance(word, Constraint)]
        self.rolling = {word.name for word in words if isinstance(getattr(word, "measure", None), RollingSole)}
        self.inert = {
            g.name for g in self.mechanism.equations.guards
            if g.reset is None and not g.terminal and g.transition is None
        }  # fmt: skip
        self.parameter_steps: dict[str, float] = {}
        """Differences of parameters whose effect was seen, by name, with which later derivatives begin."""
        self._repeated: dict[tuple[float, float] | None, RepeatedRun] = {}

    @cached_property
    def folded(self) -> Mapping[str, float]:
        """Parameters of the model, some of which are part of the equations."""
        found: Mapping[str, float] = getattr(self.model, "parameters", {})
        return found

    @cached_property
    def _check(self) -> ParameterCheck:
        """The judgement of values of parameters."""
        found: ParameterCheck = self.model.parameter_check()
        return found

    def _feet(self) -> dict[str, str]:
        """Names of the places of contacts."""
        places = {contact.name: contact.place for contact in Facts.of(self.mechanism.equations).contacts}
        places = {name: place or self._center(name) for name, place in places.items()}
        return {name: place for name, place in places.items() if place}

    def _center(self, contact: str) -> str:
        """The middle of the disk or ball of a contact; '' where it has none that is among the results."""
        words = [word for word in getattr(self.model, "constraints", ()) if word.name == contact]
        center = getattr(getattr(words[0], "measure", None), "center", None) if words else None
        name = str(getattr(center, "full_name", ""))
        return name if f"{name}.x" in self.mechanism.equations.output_names() else ""

    @property
    def turned(self) -> Vector:
        """For each coordinate that the walker moves on along, −1 where its mirror image goes the other way."""
        reflection = None if self.mirror is None else self.mirror.reflection
        return np.ones(len(self.fixed)) if reflection is None else reflection.v[list(self.fixed)]

    @property
    def forward(self) -> Vector:
        """For each of these 0 where an application and the next, mirrored, cancel: to the side; else 1."""
        return np.where((self.turned < 0.0) & (self.strides % 2 == 1), 0.0, 1.0)

    def way_of(self, arrival: Arrival) -> float:
        """The way of one application [m]; the sum of its steps where no coordinate tells it, NaN without steps."""
        if len(arrival.travel):
            return float(np.linalg.norm(self.forward * arrival.travel))
        lengths = [length for _, _, length in arrival.steps]
        return float(np.sum(lengths)) if lengths else float("nan")

    def ahead(self, way: Vector) -> Vector:
        """A vector (3,) without its part across the plane in which the walker is mirrored."""
        if self.mirror is None or self.mirror.reflection is None:
            return way
        return np.where(np.array(list("xyz")) == self.mirror.reflection.axis, 0.0, way)

    # parameters ---------------------------------------------------------------------------------------------------
    def plain(self, values: Values) -> dict[str, float]:
        """Parameters of the model by name; what functions give goes before."""
        found = {name: float(value) for name, value in values.items() if name not in self.functions}
        for name, function in self.functions.items():
            if name in values:
                found |= {key: float(value) for key, value in function(float(values[name])).items()}
        return found

    def vector(self, values: Values) -> Vector:
        """The parameter vector."""
        last = self._last
        if last is None or last[0] != values:
            last = self._last = dict(values), self._vector(self.plain(values))
        return last[1]

    def rates_of(self, name: str, values: Values) -> Mapping[str, float] | None:
        """Rates of the model's parameters by one of them or by the value of a function; None where they have none."""
        rates = slopes_of(self.functions[name], float(values[name])) if name in self.functions else {name: 1.0}
        known = {each.name for each in self.mechanism.equations.parameters}
        return rates if rates is not None and rates.keys() <= known else None

    def _vector(self, plain: Mapping[str, float]) -> Vector:
        return self.mechanism.parameters(plain, self.folded if plain else {})

    def faults(self, values: Values) -> list[str]:
        """Why no walk of the map has these values of parameters, one sentence each.

        Words of the model do not allow them, or they are not those of a walker with equal sides that a mirror needs.
        """
        if self._allowed is not None and self._allowed == values:
            return []
        plain = self.plain(values)
        found: list[str] = self._check.faults(plain)
        if not found and self.mirror is not None:
            own = {**self.folded, **plain}
            found = sides_faults(self.mechanism, self.mirror, self.vector(values), own)
        self._allowed = None if found else dict(values)
        return found

    def require(self, values: Values) -> None:
        """Raise a `ModelError` with the `faults` of values of parameters, if there are any."""
        if faults := self.faults(values):
            raise ModelError(faults)

    def require_free(self, names: Iterable[str], values: Values) -> None:
        """Raise a `ModelError` for parameters that a function among the values gives, so that their own say nothing."""
        given = {each: name for name, f in self.functions.items() if name in values for each in f(float(values[name]))}
        if faults := [f"{name!r} is given by the function {given[name]!r}; change that" for name in names
                      if name in given]:  # fmt: skip
            raise ModelError(faults)

    def require_both_sides(self, name: str, value: float, values: Values) -> None:
        """Raise a `ModelError` where a parameter of one side is to change and a mirror takes both sides as equal."""
        if self.mirror is None or (name, value) in self._of_both_sides:
            return

        def vector(at: float) -> Vector:
            return self.vector({**values, name: at})

        if not moves_sides_alike(self.mechanism, self.mirror, vector, value):
            raise ModelError(
                f"mirror={self.mirror.sides}: {name!r} changes the two sides differently, so that beside its value a "
                "step of one side does not repeat on the other; find the gait over a stride, with mirror=None, or "
                "change both sides together by functions={…} of one value"
            )
        self._of_both_sides.add((name, value))

    # runs ---------------------------------------------------------------------------------------------------------
    def with_step(self, dt: float, longest: float | None = None) -> ReturnMap:
        """The same map, and the same prepared run, with another step and another latest time of one return."""
        found = copy(self)
        found.dt, found.longest, found.runs = dt, self.longest if longest is None else longest, 0
        return found

    def __call__(self, state: State, values: Values | None = None, strides: int | None = None) -> Arrival:
        """One application of the map; a return that does not arrive ends it."""
        return self.each([(state, self.values if values is None else values)], strides)[0]

    def each(self, points: Sequence[tuple[State, Values]], strides: int | None = None) -> list[Arrival]:
        """The applications of the map from several states with values of parameters, made together."""
        walks = [_Walk(state, values, np.zeros(len(self.fixed))) for state, values in points]
        for number in range(self.strides if strides is None else strides):
            going = [walk for walk in walks if walk.outcome.good]
            for walk, end in zip(going, self._ends(going), strict=True):
                self._arrived(walk, end, odd=self.mirror is not None and number % 2 == 1)
        return [walk.arrival() for walk in walks]

    def _arrived(self, walk: _Walk, end: End, odd: bool) -> None:
        """One return more of a walk."""
        start, walk.end = walk.state, end
        after = end.state if end.state is not None else start
        places = self._feet_at(start, walk.values), self._feet_at(after, walk.values)
        walk.outcome = self._judged(start, end, *places)
        moved = self.mechanism.equations.configuration.difference(start.q, after.q)[list(self.fixed)]
        found = self._steps(end, moved, *places)
        walk.steps += [(self._named(name, odd), walk.period + t, length) for name, t, length in found]
        walk.events += [(self._named(e.name, odd), e.kind) for e in end.events if e.name not in self.penalties]
        walk.period, walk.travel = walk.period + after.time, walk.travel + (self.turned * moved if odd else moved)
        equations = self.mechanism.equations
        anchors = counted_from(equations, after.anchors, after.time)
        state = State(0.0, after.q, after.v, after.z, after.mode, after.armed, anchors, after.names,
                      after.velocity_names)  # fmt: skip
        last = [e.name for e in end.events if e.kind == "event" and e.time == after.time]
        walk.stored = stored_by(equations, last if self.mirror is None else [self.mirror.name(name) for name in last])
        walk.state = self.mirror.state(state) if self.mirror is not None else state

    def _named(self, name: str, odd: bool) -> str:
        return self.mirror.name(name) if odd and self.mirror is not None else name

    def _ends(self, walks: Sequence[_Walk]) -> list[End]:
        """The ends of one run of each."""
        self.runs += len(walks)
        run = self._run()
        return run.many([walk.state for walk in walks], [self.plain(walk.values) for walk in walks])

    def rows(self, state: State, values: Values) -> Matrix:
        """The rows of one return, as the kernel stores them; up to the latest time where it does not arrive before."""
        run = self._run()
        run(state, self.plain(values))
        return run.table.copy()

    def _run(self) -> RepeatedRun:
        """The prepared run with the step and the latest time of this map."""
        run = self._repeated.get(None) or self._repeated.get((self.dt, self.longest))
        if run is None:
            run = RepeatedRun(
                self.model, self.start, self.integrator, self.dt, (self.section, self.longest), self.plain(self.values),
                self.backend,
            )  # fmt: skip
            self._repeated[None if run.adjustable else (self.dt, self.longest)] = run
        if run.adjustable:
            run.adjust(self.dt, self.longest)
        return run

    def _steps(
        self, end: End, moved: Vector, was: Mapping[str, Vector], now: Mapping[str, Vector]
    ) -> list[tuple[str, float, float]]:  # fmt: skip
        """The feet that touched down, when, and the length of the step that each ended.

        A step is as long as the way between the places of both feet as each strikes. One that began with the map begins
        where its foot was then; of two the second begins where its foot is at the end, unless it rolls: NaN, not known.
        """
        strikes = [event for event in end.events if event.kind == "closed" and event.name in self.feet]
        lengths = [float("nan")] * len(strikes)
        stance = [name for name in self.feet if name in end.before and name != self.section]
        last = end.state is not None and self.section in self.feet and end.stopped_by == self.section
        if last and end.state is not None and strikes and len(stance) == 1 and len(strikes) <= 2:
            begun = was if len(strikes) == 1 else now
            if len(strikes) == 1 or stance[0] not in self.rolling:
                way = self.ahead(now[self.section] - begun[stance[0]])
                lengths[-1] = sqrt(way @ way)
            if len(strikes) == 2:
                lengths[0] = float(np.linalg.norm(self.forward * moved)) - lengths[-1]
        return [(event.name, event.time, length) for event, length in zip(strikes, lengths, strict=True)]

    def _feet_at(self, state: State, values: Values) -> dict[str, Vector]:
        """Where the points of all feet are, by name (3,) [m]."""
        if not self.feet:
            return {}
        out = np.zeros(3 * len(self.feet))
        y = np.concatenate([state.v, state.z])
        closed = [number for number, name in enumerate(self.manager.names) if name in state.mode]
        block = self.mechanism.block(0.0, state.q, y, state.anchors, closed)
        self._where(block, self.vector(values), out)
        return dict(zip(self.feet, out.reshape(-1, 3), strict=True))

    @property
    def _where(self) -> ScalarFunction:
        """The program of the places of all feet."""
        memory = self.mechanism.equations.memory
        if "places of feet" not in memory:
            with self.mechanism.equations.tape.lock:
                outputs = [self.mechanism.equations.output(f"{f}.{axis}") for f in self.feet.values() for axis in "xyz"]
                memory["places of feet"] = scalar_function(outputs, self.mechanism.layout, "places")
        found: ScalarFunction = memory["places of feet"]
        return found

    # judgement ----------------------------------------------------------------------------------------------------
    def _judged(
        self, start: State, end: End, was: Mapping[str, Vector], now: Mapping[str, Vector]
    ) -> Outcome:  # fmt: skip
        """Arrives, or why not, as far as the end alone tells; `explained` tells falls."""
        if end.state is None:
            return Outcome("not on the section", end.problem, 0.0)
        if end.problem or not (np.isfinite(end.state.q).all() and np.isfinite(end.state.v).all()):
            return Outcome("numerical error", end.problem or "the state is not finite", end.time)
        if end.stopped_by != self.section:
            if end.stopped_by:
                return Outcome("other event", f"ends by {end.stopped_by!r} at {end.time:.3g} s", end.time)
            return Outcome("misses", f"{self.section!r} does not happen within {self.longest:.3g} s", end.time)
        if end.time <= INSTANT_RTOL * self.longest:
            return Outcome("scuffs", f"scuffs at {end.time:.3g} s: {self.section!r} happens at once", end.time)
        if self._scuffs(start, end, was, now):
            text = f"scuffs at {end.time:.3g} s: {self.section!r} closes before its foot has passed the other"
            return Outcome("scuffs", text, end.time)
        return Outcome("arrives", f"arrives after {end.time:.6g} s", end.time)

    def _scuffs(self, start: State, end: End, was: Mapping[str, Vector], now: Mapping[str, Vector]) -> bool:
        """Whether the foot of the section came down on the side of the stance foot from which it left."""
        stance = [name for name in self.feet if name in end.before and name != self.section]
        if end.state is None or self.section not in self.feet or len(stance) != 1 or self.section in start.mode.closed:
            return False
        before, after = (places[self.section] - places[stance[0]] for places in (was, now))
        return float(before @ after) > 0.0 and float(before @ before) > 0.0

    def explained(self, state: State, outcome: Outcome, values: Values | None = None) -> Outcome:
        """The outcome with falls named; makes the run once more where that needs its rows."""
        if outcome.kind not in ("other event", "misses", "numerical error"):
            return outcome
        return self.fall(state, self.values if values is None else values) or outcome

    def fall(self, state: State, values: Values) -> Outcome | None:
        """Whether a walker of one or two feet falls on the way of one return; makes the run again."""
        if len(self.feet) > 2:
            return None
        try:
            run = simulate(
                self.model, replace(state, parameters={}), self.integrator, dt=self.dt,
                until=(self.section, self.longest), contact="events", parameters=self.plain(values), progress=False,
                on_failure="return", backend=self.backend,
            )  # fmt: skip
            if stopped(run):
                raise KeyboardInterrupt
            return fall_of(run, next((name for name in self.feet if name in state.mode.closed), ""))
        except MbdError:
            return None

    def other_events(self, one: Arrival, other: Arrival) -> str:
        """What the events of another walk have more or less that changes its motion, in words; '' where nothing."""
        if one.events == other.events:
            return ""
        before, after = (Counter(e for e in each.events if e[0] not in self.inert) for each in (one, other))
        more, less = sorted((after - before).elements()), sorted((before - after).elements())
        if not more and not less:
            return ""
        (name, kind), word = (more[0], "has the event") if more else (less[0], "lacks the event")
        return f"{word} {name!r} {kind}"

    def against(self, section: Section, arrival: Arrival) -> Outcome:
        """The outcome, where other contacts are closed than on the section a name for that."""
        if not arrival.outcome.good:
            return arrival.outcome
        if others := section.other_states(arrival.state):
            text = f"comes to other states at {arrival.period:.3g} s: {others}"
            return Outcome("other states", text, arrival.period)
        closed, wanted = arrival.state.mode.closed, section.mode.closed
        if closed == wanted or closed - self.penalties == wanted - self.penalties:
            return arrival.outcome
        has, needs = closed - self.penalties, wanted - self.penalties
        missing, more = sorted(needs - has), sorted(has - needs)
        sets = ((missing, "open"), (more, "closed"))
        what = " and ".join(f"{', '.join(map(repr, names))} {word}" for names, word in sets if names)
        kind = "scuffs" if missing and self.section in self.feet else "wrong contacts"
        word = "scuffs" if kind == "scuffs" else "comes to other contacts"
        return Outcome(kind, f"{word} at {arrival.period:.3g} s: {self.section!r} happens with {what}", arrival.period)
