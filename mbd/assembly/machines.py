"""What machines hold at a start."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.bodies.values import number
from mbd.compile.mechanism import Mechanism
from mbd.dataclass import makes_late
from mbd.equal import INSTANT_RTOL, ROUND_OFF_RTOL
from mbd.equations.equations import Machine
from mbd.errors import ModelError, nearest
from mbd.state import State


def first_anchors(mechanism: Mechanism, parameters: Vector) -> Vector:
    """Anchors of which machines hold what they do before a start, and zeros elsewhere."""
    anchors = np.zeros(mechanism.layout.n_anchors)
    for machine in mechanism.equations.machines:
        anchors[list(machine.anchors)] = machine.initial_at(parameters)
    return anchors


def is_end(state: State) -> bool:
    """Whether a run has ended in a state as it is, with what contacts and machines hold."""
    unseen = makes_late(state, "memory")
    memory = state.memory if unseen is None else unseen.memory
    if memory is None or memory.time != state.time or not np.array_equal(memory.anchors, state.anchors):
        return False
    return np.array_equal(memory.place, np.concatenate([state.q, state.v, state.z]))


def begun_in(model: Any, mechanism: Mechanism, state: State) -> tuple[State, Sequence[Machine]]:
    """A state, and the machines that begin in it: they hold what they store there at a start, with its parameters.

    None begins where a run has ended, nor, in a start whose time was moved on, what has begun before. The anchors of a
    state that has none are those of a start.
    """
    machines = mechanism.equations.machines
    if not machines or is_end(state):
        return state, ()
    own = mechanism.parameters_of(model, state.parameters)
    if len(state.anchors) != mechanism.layout.n_anchors:
        state = replace(state, anchors=first_anchors(mechanism, own))
        return stored_anew(mechanism, state, own, machines), machines
    fresh = stored_anew(mechanism, state, own, machines).anchors
    off = np.abs(fresh - state.anchors) > ROUND_OFF_RTOL * np.maximum(1.0, np.abs(fresh))
    later = fresh > state.anchors
    return state, [
        m for m in machines
        if not np.any((off & later)[list(m.times)] if m.name in state.begins else off[list(m.anchors[1:])])
    ]  # fmt: skip


def require_past(model: Any, mechanism: Mechanism, state: State) -> None:
    """What machines hold since before a state must not be of an instant after it.

    Raises
    ------
    ModelError
        for a mode that is entered, or a law that takes its last sample, later.
    """
    held = [machine for machine in mechanism.equations.machines if machine.name not in state.begins]
    if not held or is_end(state) or len(state.anchors) != mechanism.layout.n_anchors:
        return
    latest = stored_anew(mechanism, state, mechanism.parameters_of(model, state.parameters), held).anchors
    late = [
        f"the start is at t = {state.time:g} s, where '{m.name}.{m.fields[m.anchors.index(k)]}' is at most "
        f"{latest[k]:g} s, got {state.anchors[k]:g} s; move the anchors of its time too, or let all begin there, as "
        "in dataclasses.replace(start, time=…, anchors=())"
        for m in held for k in m.times if state.anchors[k] > latest[k] + INSTANT_RTOL * max(1.0, abs(latest[k]))
    ]  # fmt: skip
    if late:
        raise ModelError(late)


def stored_anew(mechanism: Mechanism, state: State, parameters: Vector, machines: Sequence[Machine]) -> State:
    """The state, with what some machines hold that begin in it; those stay in their states."""
    if not machines:
        return state
    found = np.array(state.anchors, dtype=float)
    for machine in machines:
        found[list(machine.anchors[1:])] = machine.initial_at(parameters)[1:]
        found[list(machine.times)] = state.time
    store_first(mechanism, state.time, state.q, np.concatenate([state.v, state.z]), parameters, found, machines)
    return replace(state, anchors=found)


def store_first(
    mechanism: Mechanism, time: float, q: Vector, y: Vector, parameters: Vector, anchors: Vector,
    machines: Sequence[Machine] | None = None,
) -> None:  # fmt: skip
    """Store into anchors what machines store at a start, one after the other; the states that they are in stay."""
    for machine in mechanism.equations.machines if machines is None else machines:
        captured = mechanism.acceleration_terms(time, q, y, parameters, anchors).captured
        anchors[list(machine.first)] = captured[list(machine.first)]
        if not machine.first:  # a law that samples forces: its first sample is due at the start
            anchors[list(machine.times)] = time


def without_held(model: Any, position: Any) -> tuple[Any, dict[str, Any]]:
    """Named values without those of machines, and these: states as numbers, and values that they remember.

    Raises
    ------
    ModelError
        for a state that a mode does not have, and what is no number.
    """
    machines = getattr(model, "machines", ())
    if not machines or not isinstance(position, Mapping):
        return position, {}
    held: dict[str, Any] = {}
    for machine in machines:
        own = set(machine.quantity_names) - {f"{machine.name}.index", f"{machine.name}.time"}
        for name in own & set(position):
            value = position[name]
            if name != machine.name:
                held[name] = number(value, f"position of {name!r}")
            elif value in machine.state_names:
                held[name] = float(machine.state_names.index(value))
            else:
                raise ModelError(f"position, {name!r}: " + nearest(str(value), machine.state_names, "state", "It has"))
    return {name: value for name, value in position.items() if name not in held}, held


def hold(mechanism: Mechanism, held: Mapping[str, float], anchors: Vector) -> None:
    """Write what machines are to hold into anchors."""
    for machine in mechanism.equations.machines if held else ():
        for field, anchor in zip(machine.fields, machine.anchors, strict=True):
            name = machine.name if anchor == machine.anchors[0] else f"{machine.name}.{field}"
            if name in held:
                anchors[anchor] = held[name]


def beginning(mechanism: Mechanism, held: Mapping[str, float]) -> frozenset[str]:
    """Names of the machines of which nothing is held but the state they are in."""
    machines = mechanism.equations.machines
    return frozenset(m.name for m in machines if not any(name.startswith(f"{m.name}.") for name in held))
