"""What machines hold, in return maps: which of it the motion remembers, its mirror image, and its instants.

A return begins at time 0, so that instants are counted from there. The numbers of states are compared, not solved for;
what was stored as the section was reached follows from the state there; the rest, as far as the motion depends on it,
is among the coordinates of the section.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.compile.mechanism import Mechanism
from mbd.equations import programs
from mbd.equations.equations import Equations, Guard, Machine, Transition
from mbd.joints.reflected import exchanged
from mbd.tape.derivatives import live
from mbd.tape.node import Node

Numbers = NDArray[np.intp]
OWN = "its measure or timer"
"""What causes a transition with when= or after=, in words."""


def state_anchors(equations: Equations) -> list[int]:
    """Anchors that hold the numbers of states."""
    return [machine.anchors[0] for machine in equations.machines]


def counted_from(equations: Equations, anchors: Matrix, time: Vector | float) -> Matrix:
    """Anchors (…, n_anchors) with their instants counted from a time (…)."""
    instants = [anchor for machine in equations.machines for anchor in machine.times]
    if not instants:
        return anchors
    found = np.array(anchors, dtype=float)
    found[..., instants] -= np.asarray(time)[..., np.newaxis]
    return found


def in_state(mechanism: Mechanism, number: int) -> Vector:
    """Anchors of zeros (n_anchors,), with each machine in the state of this number, modulo how many it has."""
    found = np.zeros(mechanism.layout.n_anchors)
    for machine in mechanism.equations.machines:
        found[machine.anchors[0]] = number % len(machine.states)
    return found


def times_since(equations: Equations) -> set[int]:
    """Numbers of the nodes t − T of instants T that machines hold."""
    tape = equations.tape
    instants = [anchor for machine in equations.machines for anchor in machine.times]
    return {tape.sub(tape.input("t"), tape.input("anchor", anchor)).index for anchor in instants}


def instants_stored(equations: Equations) -> list[Node]:
    """What machines store into instants, where that is the time, or so much later."""
    found = [
        node for machine in equations.machines for anchor, node in zip(machine.anchors, machine.captured, strict=True)
        if anchor in machine.times
    ]  # fmt: skip
    return [node for node in found if _counts_from_now(node)]


def _counts_from_now(node: Node) -> bool:
    if node.op == "add":
        one, other = (_has_time(each) for each in node.args)
        return one != other and all(_counts_from_now(each) for each in node.args if _has_time(each))
    return bool(node.op == "input" and node.data[0] == "t")


def _has_time(node: Node) -> bool:
    return any(each.op == "input" and each.data[0] == "t" for each in live([node]))


def remembered(equations: Equations, states: Sequence[float]) -> tuple[int, ...]:
    """Anchors of machines, but for numbers of states, on which motion, events or what is stored depends.

    states : the numbers of the states in which machines begin; timers of other states begin with these
    """
    key = tuple(int(each) for each in states)
    all_known: dict[tuple[int, ...], tuple[int, ...]] = equations.memory.setdefault("remembered by machines", {})
    known = all_known.get(key)
    if known is None:
        own = {anchor for machine in equations.machines for anchor in machine.anchors[1:]}
        stored = {a: node for each in equations.machines for a, node in zip(each.anchors, each.captured, strict=True)}
        with equations.tape.lock:
            outputs = programs.accelerations(equations)
            first = len(outputs) - 1 - len(equations.frictions) - equations.n_anchors
            outputs = outputs[:first] + outputs[first + equations.n_held_by_machines :]
            guards, first = programs.guards(equations), 4 * len(equations.contacts)
            for e, guard in enumerate(equations.guards):
                if guard.is_timer and guard.transition is not None and states:
                    if int(states[guard.transition.machine]) != guard.transition.source:
                        guards[first + e] = equations.tape.one
            found = _anchors_in([*outputs, *guards]) & own
            while True:  # what is stored counts where what it is stored into does
                more = _anchors_in([stored[anchor] for anchor in found if not _is_itself(stored[anchor], anchor)]) & own
                if more <= found:
                    break
                found |= more
        known = all_known[key] = tuple(sorted(found))
    return known


def _anchors_in(nodes: Sequence[Node]) -> set[int]:
    return {node.data[1] for node in live(nodes) if node.op == "input" and node.data[0] == "anchor"}


def _is_itself(node: Node, anchor: int) -> bool:
    return bool(node.op == "input" and node.data == ("anchor", anchor))


def stored_by(equations: Equations, names: Sequence[str]) -> frozenset[int]:
    """Anchors that transitions store whose events have these names, and that follow from the motion there alone.

    What is made of other values that are held, or of forces, is none of them: these may be others after the transition.
    """
    taken = {guard.name: guard.transition for guard in equations.guards if guard.transition is not None}
    nodes = {a: node for each in equations.machines for a, node in zip(each.anchors, each.captured, strict=True)}
    found = {anchor for name in names if name in taken for anchor in taken[name].stored}
    return frozenset(anchor for anchor in found if _of_motion(nodes[anchor]))


def _of_motion(node: Node) -> bool:
    return not any(each.op == "input" and each.data[0] in ("anchor", "lam", "a", "s") for each in live([node]))


def images(equations: Equations, sides: tuple[str, str]) -> tuple[Numbers, dict[int, Vector]]:
    """From which anchor each takes its mirror image, and by the anchors of states, the numbers that these become."""
    places = np.arange(equations.n_anchors, dtype=np.intp)
    states = dict[int, Vector]()
    partners = {machine.name: machine for machine in equations.machines}
    for machine in equations.machines:
        other = partners[exchanged(machine.name, sides)]
        fields = dict(zip(other.fields, other.anchors, strict=True))
        for name, anchor in zip(machine.fields, machine.anchors, strict=True):
            places[anchor] = fields[exchanged(name, sides)]
        names = [exchanged(state, sides) for state in other.states]
        states[machine.anchors[0]] = np.array([machine.states.index(name) for name in names], dtype=float)
    return places, states


def image_faults(equations: Equations, sides: tuple[str, str]) -> list[str]:
    """What has no partner among machines, their states, and what they remember."""
    partners, faults = {machine.name: machine for machine in equations.machines}, list[str]()
    for machine in equations.machines:
        name = exchanged(machine.name, sides)
        if name not in partners:
            faults.append(f"mirror={sides}: mode {machine.name!r} has no partner {name!r}")
            continue
        faults += _pair_faults(machine, partners[name], sides)
    return faults or _cause_faults(equations, sides)


def _pair_faults(one: Machine, other: Machine, sides: tuple[str, str]) -> list[str]:
    return [
        f"mirror={sides}: {kind} {name!r} of mode {one.name!r} has no partner {exchanged(name, sides)!r}"
        + (f" in {other.name!r}" if other is not one else "")
        for kind, own, others in (("state", one.states, other.states), ("value", one.fields, other.fields))
        for name in own
        if exchanged(name, sides) not in others
    ]


def _cause_faults(equations: Equations, sides: tuple[str, str]) -> list[str]:
    """Transitions whose mirror image is none: on the other side something else causes them.

    Those of events that happen with something else count where they change something.
    """
    guards = [guard for guard in equations.guards if guard.transition is not None]
    used = {number for guard in guards for number in _transition(guard).causes}
    own, faults = {_wiring(equations, guard) for guard in guards}, list[str]()
    for e, guard in enumerate(equations.guards):
        if guard.transition is None:
            continue
        alone = len(equations.machines[guard.transition.machine].states) == 1 and ("taken", e) not in used
        if alone and guard.reset is None and not guard.terminal and not guard.transition.stored:
            continue
        machine, source, target, causes, needed = _wiring(equations, guard)
        names = [exchanged(name, sides) for name in (machine, source, target)]
        others = frozenset(exchanged(name, sides) for name in causes)
        if (*names, others, exchanged(needed, sides)) not in own:
            mine = f"{guard.name!r} on {_listed(causes)}" + (f" while {needed!r} is closed" if needed else "")
            faults.append(f"mirror={sides}: {mine} has no partner on {_listed(others)}")
    return faults


def _listed(causes: frozenset[str]) -> str:
    return " or ".join(cause if cause == OWN else repr(cause) for cause in sorted(causes))


def _transition(guard: Guard) -> Transition:
    assert guard.transition is not None
    return guard.transition


def _wiring(equations: Equations, guard: Guard) -> tuple[str, str, str, frozenset[str], str]:
    """Of a transition its machine, the states that it leaves and enters, its causes, and the contact that it needs."""
    taken = _transition(guard)
    machine = equations.machines[taken.machine]
    contacts, guards = equations.contacts, equations.guards
    causes = set[str]()
    for kind, number in taken.causes:
        if kind in ("closed", "opened"):
            causes.add(contacts[number].name + (" opened" if kind == "opened" else ""))
        elif guards[number] is guard:
            causes.add(OWN)
        elif kind == "taken":
            other = _transition(guards[number])
            states = equations.machines[other.machine].states
            causes.add(f"{equations.machines[other.machine].name}: {states[other.source]} to {states[other.target]}")
        else:
            causes.add(guards[number].name)
    needed = contacts[taken.contact].name if taken.contact >= 0 else ""
    return machine.name, machine.states[taken.source], machine.states[taken.target], frozenset(causes), needed
