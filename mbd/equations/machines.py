"""Machines as expressions: first their anchors and named quantities, which laws ask for, and last their changes."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence

from mbd.constraints.base import Constraint
from mbd.constraints.event import Event
from mbd.constraints.machine import Change, Machine, state_of
from mbd.equations import equations as records
from mbd.equations.derivation_scope import DerivationScope
from mbd.equations.equations import Guard, Transition
from mbd.errors import ModelError, nearest
from mbd.tape.derivatives import live
from mbd.tape.node import Node, Scalar

OPENED = " opened"
"""Behind the name of a contact, what its opening is called among causes."""


def held_by(scope: DerivationScope, words: Sequence[Machine]) -> dict[str, list[Node]]:
    """The numbers that each machine holds, on the tape."""
    found, first = {}, 0
    for word in words:
        found[word.name] = [scope.tape.input("anchor", first + k) for k in range(len(word.fields))]
        first += len(word.fields)
    return found


def declare_machines(
    scope: DerivationScope, words: Sequence[Machine], offer: Callable[[str, Scalar], None]
) -> None:  # fmt: skip
    """Their anchors, and what they `offer` by name and set in the place of parameters.

    Raises
    ------
    ModelError
        for parameters that are known already, which geometry is made of, and those that two machines set.
    """
    faults = list[str]()
    for word, held in zip(words, held_by(scope, words).values(), strict=True):
        scope.first_anchor += len(held)
        scope.modes[word.name] = word.state_names
        for name, value in word.quantities(scope, held).items():
            offer(name, value)
        for name in (*word.held_parameters(), *word.parameters_by_state()):
            if name in scope.parameters:
                faults.append(
                    f"'{word.name}' sets {name!r}, which masses and energies are made of; only parameters of forces, "
                    "losses, contacts and measures change at instants"
                )
            if name in scope.held_parameters or name in scope.parameters_by_state:
                faults.append(f"'{word.name}' sets {name!r}, which another mode or sampled law sets as well")
        scope.held_parameters |= {name: held[place] for name, place in word.held_parameters().items()}
        for name, values in word.parameters_by_state().items():
            named = [(f"{name}.{state}", values[state]) if state in values else (name, None)
                     for state in word.state_names]  # fmt: skip
            scope.parameters_by_state[name] = held[0], tuple(named)
    if faults:
        raise ModelError(faults)


def machine_guards(
    scope: DerivationScope,
    words: Sequence[Machine],
    contacts: Sequence[Constraint],
    events: Sequence[Event],
    values: Mapping[str, float],
) -> tuple[list[records.Machine], list[Guard]]:
    """The machines, and their changes as guards behind those of users' events.

    values : of the model's parameters

    Raises
    ------
    ModelError
        with names of causes and conditions that do not exist, and what is stored that is not known at an instant.
    """
    held = held_by(scope, words)
    changes = [(m, change) for m, word in enumerate(words) for change in word.changes(scope, held[word.name])]
    causes = _Causes(words, contacts, events, changes)
    machines, guards, faults = list[records.Machine](), list[Guard](), list[str]()
    first = [word.first_values(scope, held[word.name]) for word in words]
    stored: list[dict[int, Node]] = [{k: scope.real(value) for k, value in each.items()} for each in first]
    for number, (m, change) in enumerate(changes):
        title = f"'{change.name}'"
        for k, value in change.stored.items():
            node = scope.real(value)
            if stored[m].setdefault(k, node) is not node:
                faults.append(f"{title} stores {words[m].fields[k]!r} in another way than others do")
        value = scope.tape.one if change.guard is None else scope.real(change.guard)
        rate = scope.tape.zero if change.guard is None else scope.change(change.guard)
        faults += causes.faults(title, change, value)
        if faults:
            continue
        condition = None if change.condition is None else scope.real(change.condition)
        places = [held[words[m].name][k].data[1] for k in change.stored]
        contact, while_state = causes.condition(change.contact)
        if while_state is not None:
            other, state = while_state
            index = held[other][0]
            condition = scope.tape.lift(0.5 - abs(index - float(state)))
        guards.append(Guard(
            change.name, value, rate, change.direction, change.terminal, change.reset,
            transition=Transition(
                m, change.source, change.target, causes.of(change, len(events) + number), contact, condition,
                tuple(places), change.timed,
            ),
        ))  # fmt: skip
    faults += _never(guards, len(events), [change.on for _, change in changes]) if not faults else []
    for m, word in enumerate(words):
        own = held[word.name]
        for k, node in stored[m].items():
            jumps = ("a", "s") if word.reads_before else ("a", "s", "lam")
            if any(each.op == "input" and each.data[0] in jumps for each in live([node])):
                faults.append(
                    f"'{word.name}' stores {word.fields[k]!r}, which depends on accelerations or forces of contacts; "
                    "they jump at the instant: store what positions and velocities tell"
                )
        loads = any(each.op == "input" and each.data[0] == "lam" for each in live(list(stored[m].values())))
        stored_first = () if loads else tuple(own[k].data[1] for k in first[m])  # forces are known once steps begin
        captured = tuple(stored[m].get(k, node) for k, node in enumerate(own))
        machines.append(records.Machine(
            word.name, word.state_names, tuple(node.data[1] for node in own), word.fields,
            tuple(own[k].data[1] for k in word.times), word.initial(values), stored_first, captured,
            tuple(_own_values(scope, word, values, own, captured)),
        ))  # fmt: skip
    if faults:
        raise ModelError(list(dict.fromkeys(faults)))
    return machines, guards


def _own_values(
    scope: DerivationScope, word: Machine, values: Mapping[str, float], held: Sequence[Node], captured: Sequence[Node]
) -> Iterable[tuple[int, int]]:
    """(turn, number) of the parameters that a machine sets, in whose place it holds their own values before it does."""
    used = {node.index for node in live(captured)}
    for name in word.held_parameters():
        turns = [k for k, value in enumerate(word.initial({**values, name: math.nan})) if math.isnan(value)]
        if name in values and any(held[k].index in used for k in turns):
            node = scope.parameters.node(name, values[name])
            yield from ((k, node.data[1]) for k in turns if node.op == "input")


def _never(guards: Sequence[Guard], first: int, causes: Sequence[str]) -> list[str]:
    """Changes, of guards from number `first` on, that wait for each other alone, or for what nothing causes."""
    waiting = {number: guard.transition.causes for number, guard in enumerate(guards, first) if guard.transition}
    happen = set[int]()
    while True:
        more = {
            number for number, each in waiting.items()
            if number not in happen and any(kind != "taken" or other in happen for kind, other in each)
        }  # fmt: skip
        if not more:
            break
        happen |= more
    return [
        f"'{guards[number - first].name}' never happens: it waits for {causes[number - first]!r}, which "
        "nothing else causes; give one of them another cause"
        for number in waiting
        if number not in happen
    ]


class _Causes:
    """What may cause changes, by name."""

    def __init__(
        self,
        words: Sequence[Machine],
        contacts: Sequence[Constraint],
        events: Sequence[Event],
        changes: Sequence[tuple[int, Change]],
    ) -> None:
        self.states: Mapping[str, Sequence[str]] = {word.name: word.state_names for word in words}
        self.contacts = {word.name: c for c, word in enumerate(contacts)}
        known: dict[str, tuple[tuple[str, int], ...]] = {}
        for name, c in self.contacts.items():
            known[name] = (("closed", c),)
            known[f"{name}{OPENED}"] = (("opened", c),)
        known |= {event.name: (("event", e),) for e, event in enumerate(events)}
        for m, word in enumerate(words):
            own = [(len(events) + k, change) for k, (owner, change) in enumerate(changes) if owner == m]
            known[word.name] = tuple(("taken", e) for e, _ in own)
            for number, state in enumerate(word.state_names):
                entering = tuple(("taken", e) for e, change in own if change.target == number)
                known[f"{word.name}: {state}"] = entering
            known |= {change.name: (("taken", e),) for e, change in own}
        self.known = known

    def faults(self, title: str, change: Change, guard: Node) -> list[str]:
        """What is wrong with the names of a change, and a guard that never changes."""
        found = []
        if change.on and change.on not in self.known:
            found.append(f"{title}, on: " + nearest(change.on, self.known, "contact, event or mode"))
        if change.contact and change.contact not in self.contacts and self._state(change.contact) is None:
            states = [f"{name}: {state}" for name, own in self.states.items() for state in own]
            known = [*self.contacts, *states]
            found.append(f"{title}, only_while: " + nearest(change.contact, known, "contact or state"))
        if change.guard is not None and not any(node.op == "input" and node.data[0] != "p" for node in live([guard])):
            found.append(f"{title}: what it waits for never changes; let it depend on a coordinate, a rate or the time")
        return found

    def of(self, change: Change, guard: int) -> tuple[tuple[str, int], ...]:
        """The causes of a change whose guard has this number."""
        return self.known[change.on] if change.on else (("event", guard),)

    def condition(self, name: str) -> tuple[int, tuple[str, int] | None]:
        """The contact that must be closed, −1 for none, or the state of a machine."""
        state = self._state(name)
        return (-1, state) if state is not None or not name else (self.contacts[name], None)

    def _state(self, name: str) -> tuple[str, int] | None:
        return state_of(name, self.states)
