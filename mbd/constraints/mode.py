"""A discrete state of a machine, such as the phase of a knee, and its transitions."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import field, replace
from typing import Any

from mbd.bodies.domains import Domain, positive
from mbd.bodies.scope import Scope
from mbd.bodies.values import among, is_number, is_several, name_of, number
from mbd.constraints.machine import SEPARATOR, Change, Machine
from mbd.constraints.measure import Measure, gap_of
from mbd.constraints.user_measure import measured
from mbd.dataclass import dataclass
from mbd.errors import ModelError, nearest
from mbd.forces.quantities import Mention
from mbd.tape.node import Node, Scalar

INDEX, SINCE, REMEMBERED = 0, 1, 2
"""Numbers that a mode holds: of its state, when that began [s], what it remembers."""


@dataclass(frozen=True)
class Transition:
    """One way from a state of a `Mode` to another: by `on`, `when` or `after`, one of the three.

    Parameters
    ----------
    source : state that it leaves, or several
    target : state that it enters
    on : name of what causes it: a contact that closes ('right foot') or opens ('right foot opened'), one after the
        other in a rebound, an `mbd.Event`, another mode that changes ('other'), or enters a state ('other: stance')
    when : what crosses zero as it happens, located like the guard of an `mbd.Event`: a measure, the name of a
        quantity, a function of named quantities, an expression. One that is beyond zero already as the state is
        entered has to go back first
    after : time in the state after which it happens [s], > 0; a number is the parameter '<name of the mode>.<source>
        to <target>.after', a text the name of a parameter or quantity, whose value as time passes
        counts. A time that is not positive as the state is entered is due at once, also in the first state of a run;
        so is one that has ended before a run begins, with another state or other parameters.
        Of timers of one state that end together the first is taken: two of equal length are an error
    only_while : it happens only while this holds at its instant: a contact is closed ('right foot'), another mode is
        in a state ('other: stance'), or a measure is positive. Where it does not hold, the instant has passed: a timer
        begins again as the state is entered again
    direction : of `when`: −1 as it falls through zero, +1 as it rises, 0 both; a jump over zero counts, as in an impact
    """

    source: str | Sequence[str]
    target: str
    on: str | None = None
    when: Any = None
    after: Any = None
    only_while: Any = None
    direction: int = 0

    def __post_init__(self) -> None:
        put, title = object.__setattr__, f"Transition({self.source!r}, {self.target!r})"
        several = is_several(self.source)
        sources = tuple(self.source) if several else (self.source,)
        if not sources or not all(isinstance(each, str) and each for each in (*sources, self.target)):
            raise ModelError(f"{title} needs the names of the states that it leaves and enters")
        put(self, "source", sources)
        given = [name for name in ("on", "when", "after") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ModelError(
                f"{title} takes one cause, on=, when= or after=; got {' and '.join(given) or 'none'}; give one "
                "transition for each cause"
            )
        if self.on is not None and (not isinstance(self.on, str) or not self.on):
            raise ModelError(f"{title}: on is the name of a contact, an event or a mode, got {self.on!r}")
        if self.when is not None:
            put(self, "when", measured(self.when, f"{title}: when"))
        if is_number(self.after):
            put(self, "after", number(self.after, f"{title}: after"))
            if self.after <= 0.0:
                raise ModelError(f"{title}: after {self.after:g} s is not positive; give a time > 0, or on=")
        elif self.after is not None and not isinstance(self.after, str):
            raise ModelError(f"{title}: after is a time [s] or the name of a parameter, got {self.after!r}")
        if self.only_while is not None and not isinstance(self.only_while, str):
            put(self, "only_while", measured(self.only_while, f"{title}: only_while", "a contact"))
        if not among(self.direction, (-1, 0, 1)):
            raise ModelError(f"{title}: direction is -1, 0 or 1, got {self.direction!r}")
        if self.direction and self.when is None:
            raise ModelError(f"{title}: direction is that of when=; leave it out")


@dataclass(frozen=True)
class Mode(Machine):
    """A discrete state: which leg stands, which phase a knee is in.

    Laws of forces take ``{state: value}`` with ``by="knee phase"``. Named quantities for laws, measures and results are
    'knee phase' (results give its text, laws its number from 0), 'knee phase.time', the time in the state [s], and
    'knee phase.<name>' of each remembered value and parameter.

    At one instant each mode takes at most one transition for each thing that happens, the first one in the order of
    `transitions`; what these change may cause further ones. Contacts come before events, events before timers.

    Parameters
    ----------
    name : its name
    states : names of its states, two at least
    start : the state that runs begin in; by default the first
    transitions : of `Transition`
    remembers : values that are stored as a state is entered: {'touchdown angle': 'right hip.angle'}, a name, a
        measure or a function of quantities; ``{'touchdown angle': {'stance': 'right hip.angle'}}`` stores it only as
        'stance' is entered. At the start of a run all of them are stored
    numbers : parameters of its own, for laws, measures and timers: {'threshold': 0.2} is 'knee phase.threshold'
    sets : parameters of other words by state: {'knee loss.coefficient': {'stance': 5.0}}; in states that are left out
        the parameter keeps its own value. Each number is the parameter 'knee loss.coefficient.stance'

    Raises
    ------
    ModelError
        for names of states that do not exist, states that no transitions lead to, a start that is never left, and what
        is no cause or value.

    Examples
    --------
    >>> import mbd
    >>> mbd.Mode(
    ...     "knee phase", ("stance", "swing"),
    ...     transitions=[mbd.Transition("stance", "swing", on="foot opened"),
    ...                  mbd.Transition("swing", "stance", after=0.4)],
    ... ).parameters()
    {'knee phase.swing to stance.after': 0.4}
    """

    name: str
    states: Sequence[str]
    start: str | None = None
    transitions: Sequence[Transition] = ()
    remembers: Mapping[str, Any] = field(default_factory=dict, hash=False)
    numbers: Mapping[str, float] = field(default_factory=dict, hash=False)
    sets: Mapping[str, Mapping[str, float]] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        name_of(self.name, "Mode")
        put, title = object.__setattr__, f"Mode '{self.name}'"
        states = tuple(self.states) if is_several(self.states) else ()
        if len(states) < 2 or not all(isinstance(each, str) and each for each in states):
            raise ModelError(f"{title} needs the names of two states at least, such as ('stance', 'swing')")
        if len(set(states)) < len(states) or any(SEPARATOR in each for each in states):
            raise ModelError(f"{title}: give each state a name of its own, without '{SEPARATOR}'")
        for kind in ("remembers", "numbers", "sets"):
            given = getattr(self, kind)
            if not isinstance(given, Mapping) or not all(isinstance(each, str) and each for each in given):
                raise ModelError(f"{kind} of {title} maps names to what they stand for, got {given!r}")
        if not is_several(self.transitions):
            raise ModelError(f"transitions of {title} are a list of mbd.Transition, got {self.transitions!r}")
        if self.start is not None and not isinstance(self.start, str):
            raise ModelError(f"start of {title} is the name of a state, got {self.start!r}")
        put(self, "states", states)
        put(self, "start", states[0] if self.start is None else self.start)
        put(self, "transitions", tuple(self.transitions))
        wrong = [each for each in self.transitions if not isinstance(each, Transition)]
        if wrong:
            raise ModelError(f"{title}: transitions are mbd.Transition(source, target, …), got {wrong[0]!r}")
        put(self, "remembers", {str(label): _stored(value, self, label) for label, value in self.remembers.items()})
        put(
            self,
            "numbers",
            {str(each): number(value, f"{each!r} of numbers of {title}") for each, value in self.numbers.items()},
        )
        put(self, "sets", {name: _numbers(values, self, name) for name, values in self.sets.items()})
        if faults := [*self._name_faults(), *self._label_faults()]:
            raise ModelError(faults)
        if faults := [*self._graph_faults(), *self._timer_faults()]:
            raise ModelError(faults)

    def _name_faults(self) -> list[str]:
        """Names of states that do not exist."""
        wanted = [("start", self.start)]
        for each in self.transitions:
            wanted += [("a transition leaves", state) for state in each.source]
            wanted.append(("a transition enters", each.target))
        wanted += [(f"remembers {label!r} as it enters", state) for label, (_, only) in self.remembers.items()
                   for state in only]  # fmt: skip
        wanted += [(f"sets {name!r} in", state) for name, values in self.sets.items() for state in values]
        return [
            f"Mode '{self.name}', {what}: " + nearest(str(state), self.states, "state", "There are")
            for what, state in dict.fromkeys(wanted)
            if state not in self.states
        ]

    def _label_faults(self) -> list[str]:
        """Labels that are taken."""
        taken = ["time", "index", *self.remembers, *self.numbers]
        return [
            f"Mode '{self.name}': {label!r} names two things; rename one"
            for label in dict.fromkeys(taken)
            if taken.count(label) > 1
        ]

    def _timer_faults(self) -> list[str]:
        """Numbers of its own that are times of timers and are not positive."""
        own = {f"{self.name}.{label}": value for label, value in self.numbers.items()}
        late = dict.fromkeys(str(each.after) for each in self.transitions if str(each.after) in own)
        return [
            f"Mode '{self.name}': {name!r} is the time of a timer, but {own[name]:g} s is not positive; give a time > 0"
            for name in late if own[name] <= 0.0
        ]  # fmt: skip

    def _graph_faults(self) -> list[str]:
        """States that are never entered, and a start that is never left."""
        ways: dict[str, set[str]] = {state: set() for state in self.states}
        for each in self.transitions:
            for source in each.source:
                ways[source].add(each.target)
        start = str(self.start)
        if late := self._preceded():
            return late
        if not ways[start] - {start}:
            return [f"Mode '{self.name}' never leaves {start!r}, in which it starts; give a Transition({start!r}, …)"]
        reached, waiting = {start}, [start]
        while waiting:
            new = ways[waiting.pop()] - reached
            reached |= new
            waiting += new
        return [
            f"Mode '{self.name}': no transitions lead from {start!r} to {state!r}; give one that enters it, or leave "
            "it out"
            for state in self.states
            if state not in reached
        ]

    def _preceded(self) -> list[str]:
        """Transitions behind another one with the same cause, or an equal time, which always comes first."""
        found, first = [], dict[tuple[str, str], Transition]()
        for each in self.transitions:
            cause = each.on if each.on is not None else each.after
            words = f"{'after' if each.on is None else 'on'} {cause!r}" + (" s" if is_number(cause) else "")
            for source in each.source if cause is not None else ():
                before = first.get((source, words))
                if before is not None:
                    found.append(
                        f"Mode '{self.name}' never goes from {source!r} to {each.target!r} {words}: the "
                        f"transition to {before.target!r} is first at the same instant; give that one an only_while=, "
                        "or leave one out"
                    )
                elif each.only_while is None:
                    first[source, words] = each
        return found

    # the promise of machines --------------------------------------------------------------------------------------
    @property
    def state_names(self) -> tuple[str, ...]:
        """Its states."""
        return tuple(self.states)

    @property
    def fields(self) -> tuple[str, ...]:
        """'index', 'since', and what it remembers."""
        return ("index", "since", *self.remembers)

    @property
    def times(self) -> tuple[int, ...]:
        """When its state began."""
        return (SINCE,)

    def initial(self, values: Mapping[str, float]) -> tuple[float, ...]:
        """The state that it starts in."""
        return (float(self.states.index(str(self.start))), *(0.0 for _ in self.fields[1:]))

    def quantities(self, scope: Scope, held: Sequence[Node]) -> Mapping[str, Scalar]:
        """Its state, the time in it, what it remembers, and its parameters."""
        found: dict[str, Scalar] = {self.name: held[INDEX], f"{self.name}.index": held[INDEX]}
        found[f"{self.name}.time"] = scope.time - held[SINCE]
        remembered = zip(self.remembers, held[REMEMBERED:], strict=True)
        return found | {f"{self.name}.{label}": node for label, node in remembered}

    @property
    def quantity_names(self) -> tuple[str, ...]:
        """'knee phase', 'knee phase.index', 'knee phase.time', 'knee phase.touchdown angle'."""
        return (self.name, *(f"{self.name}.{label}" for label in ("index", "time", *self.remembers)))

    def parameters_by_state(self) -> Mapping[str, Mapping[str, float]]:
        """`sets`."""
        return self.sets

    def without_parameters(self, known: Collection[str]) -> Mode:
        """Without what it sets in vain."""
        left = {name: values for name, values in self.sets.items() if name in known}
        return self if len(left) == len(self.sets) else replace(self, sets=left)

    def changes(self, scope: Scope, held: Sequence[Node]) -> Sequence[Change]:
        """Its transitions, one for each source."""
        found: list[Change] = []
        names = self._event_names()
        for each in self.transitions:
            contact, condition = "", None
            if isinstance(each.only_while, Measure):
                condition = gap_of(each.only_while, scope)
            elif each.only_while is not None:
                contact = each.only_while
            for source in each.source:
                name = names[each, source]
                guard = None if each.when is None else gap_of(each.when, scope)
                direction = each.direction
                if each.after is not None:
                    if isinstance(each.after, str):
                        limit: Scalar = scope.named(each.after)
                    else:
                        limit = scope.parameter(self.name, self._timer(name), each.after)
                    guard, direction = (scope.time - held[SINCE]) - limit, 1
                found.append(Change(
                    name, self.states.index(source), self.states.index(each.target), guard, direction, each.on or "",
                    contact, condition, self._stored(scope, each.target), timed=each.after is not None,
                ))  # fmt: skip
        return found

    def first_values(self, scope: Scope, held: Sequence[Node]) -> Mapping[int, Scalar]:
        """All that it remembers."""
        return self._stored(scope, None)

    def _stored(self, scope: Scope, target: str | None) -> dict[int, Scalar]:
        """What is stored as a state is entered, or at the start."""
        found: dict[int, Scalar] = {SINCE: scope.time}
        for place, (what, only) in enumerate(self.remembers.values(), REMEMBERED):
            if target is None or not only or target in only:
                found[place] = gap_of(what, scope)
        return found

    def _timer(self, event: str) -> str:
        """The name of the parameter of a timer among those of the mode: 'stance to swing.after'."""
        return f"{event.removeprefix(self.name + SEPARATOR)}.after"

    def _event_names(self) -> dict[tuple[Transition, str], str]:
        """The names of the events of its transitions: 'knee phase: stance to swing'."""
        found: dict[tuple[Transition, str], str] = {}
        for each in self.transitions:
            for source in each.source:
                plain = f"{self.name}{SEPARATOR}{source} to {each.target}"
                same = sum(name == plain or name.startswith(f"{plain} (") for name in found.values())
                found[each, source] = f"{plain} ({same + 1})" if same else plain
        return found

    # the promise of words -----------------------------------------------------------------------------------------
    def mentions(self) -> list[Mention]:
        """What its transitions and memories depend on."""
        measures = [each for t in self.transitions for each in (t.when, t.only_while) if isinstance(each, Measure)]
        measures += [what for what, _ in self.remembers.values()]
        named = [each.after for each in self.transitions if isinstance(each.after, str)]
        return [*(mention for each in measures for mention in each.mentions()), *named]

    @property
    def details(self) -> str:
        """Its states."""
        return f", in {', '.join(repr(state) for state in self.states)}"

    def parameters(self) -> dict[str, float]:
        """Times of timers, its own numbers, those that it sets, and those of its measures."""
        found = {f"{self.name}.{label}": value for label, value in self.numbers.items()}
        names = self._event_names()
        for each in self.transitions:
            if isinstance(each.after, float):
                timers = (self._timer(names[each, source]) for source in each.source)
                found |= {f"{self.name}.{timer}": each.after for timer in timers}
            for word in (each.when, each.only_while):
                found |= word.parameters() if isinstance(word, Measure) else {}
        for name, values in self.sets.items():
            found |= {f"{name}.{state}": value for state, value in values.items()}
        return found

    def domains(self) -> dict[str, Domain]:
        """Times of timers are positive, those that are its own numbers too."""
        named = {each.after for each in self.transitions}
        timers = [name for name in self.parameters() if name.endswith(".after") or name in named]
        return dict.fromkeys(timers, positive("is not positive; give a time > 0", "s"))


def _stored(value: Any, mode: Mode, label: str) -> tuple[Measure, tuple[str, ...]]:
    """What is remembered, and the states as which are entered it is stored; none are all."""
    what = f"Mode '{mode.name}' remembers {label!r}"
    if isinstance(value, tuple) and len(value) == 2 and isinstance(value[0], Measure):  # of a copy
        return value
    if isinstance(value, Mapping):
        if len({id(each) for each in value.values()}) != 1 and len(set(map(str, value.values()))) != 1:
            raise ModelError(f"{what}: give one quantity, for one state or several; remember others under other names")
        return measured(next(iter(value.values())), what), tuple(value)
    return measured(value, what), ()


def _numbers(values: Any, mode: Mode, name: str) -> dict[str, float]:
    what = f"Mode '{mode.name}' sets {name!r}"
    if not isinstance(values, Mapping) or not values:
        raise ModelError(f"{what}: give numbers by state, such as {{{mode.states[0]!r}: 1.0}}, got {values!r}")
    return {state: number(value, f"{what} in {state!r}") for state, value in values.items()}
