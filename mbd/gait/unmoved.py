"""Coordinates that nothing depends on but the places where feet stand: a walker moves on along them."""

from collections.abc import Mapping, Sequence

import numpy as np

from mbd.analysis.independent import ROW_RTOL
from mbd.arrays import Vector
from mbd.compile.mechanism import Mechanism
from mbd.constraints.expressions import is_expression
from mbd.equations import programs
from mbd.equations.equations import Equations
from mbd.gait.machines import in_state, instants_stored, times_since
from mbd.tape.derivatives import jvps, live

FAR, FAR_STATES = 20.0, 8
"""How far along a coordinate [m, rad], and at how many states, nothing may change where the tape cannot decide."""


def moving_on(mechanism: Mechanism, parameters: Vector) -> tuple[int, ...]:
    """Numbers of the increments of q that the motion does not depend on, if what stands moves along with them.

    Neither inertia, forces, Jacobian, gaps nor events hold it (found on the tape, else by going far along it), and rows
    of contacts take it off against the place of touchdown: ``h(q ⊕ s e, anchor(q₀ ⊕ s e)) = h(q, anchor(q₀))``.
    """
    known = mechanism.equations.memory.get("moving on")
    if known is None:
        equations = mechanism.equations
        with equations.tape.lock:
            identical, doubtful = _without_effect(mechanism)
            free = [*identical, *(k for k in doubtful if _changes_nothing(mechanism, parameters, k))]
            known = equations.memory["moving on"] = tuple(sorted(free))
    last: dict[bytes, tuple[int, ...]] = mechanism.kept(moving_on, dict)
    found = last.get(parameters.tobytes())
    if found is None:
        found = tuple(k for k in known if _follows(mechanism, parameters, k))
        last.clear()
        last[parameters.tobytes()] = found
    return found


def _without_effect(mechanism: Mechanism) -> tuple[list[int], list[int]]:
    """Increments that derivatives on the tape show to be in nothing but h of rows and what contacts capture, and those
    whose derivatives there do not cancel by themselves, as of the lever arm of a rolling foot.
    """
    equations, layout = mechanism.equations, mechanism.layout
    outputs = programs.accelerations(equations)
    n, rows = layout.n, layout.n_rows
    first = n * n + n + 2 * n * rows  # h of all rows, and behind ḣ and the biases what contacts capture
    captured = first + 3 * rows
    kept = outputs[:first] + outputs[first + rows : captured] + outputs[captured + layout.n_anchors :]
    kept += programs.guards(equations)
    places = equations.configuration.places
    set_by_events = reset_names(equations)
    names = [coordinate.name for coordinate in equations.coordinates]
    candidates = [] if set_by_events is None else [
        k for k in range(layout.n_v) if places[k] >= 0 and names[places[k]] not in set_by_events
    ]  # fmt: skip
    changes = jvps(kept, [{equations.tape.input("x", k): 1.0} for k in candidates])
    pairs = list(zip(candidates, changes, strict=True))
    identical = [k for k, change in pairs if all(node.is_zero for node in change)]
    return identical, [k for k, _ in pairs if k not in identical]


def _changes_nothing(mechanism: Mechanism, parameters: Vector, k: int) -> bool:
    """Whether inertia, forces, Jacobians, gaps and events are the same far away along a coordinate."""
    layout, random = mechanism.layout, np.random.default_rng(7)
    compose, size = mechanism.equations.configuration.compose, max(mechanism.sizes["guards"], 1)
    defaults = np.array(mechanism.equations.configuration.defaults)

    def numbers(touched: Vector, q: Vector, y: Vector, none: Vector) -> Vector:
        anchors = mechanism.acceleration_terms(0.0, touched, y, parameters, none).captured
        terms, guards = mechanism.acceleration_terms(0.0, q, y, parameters, anchors), np.zeros(size)
        mechanism.common["guards"](mechanism.block(0.0, q, y, anchors), parameters, guards)
        parts = (terms.M, terms.f, terms.R, terms.B, terms.rate, terms.bias, guards)
        return np.concatenate([np.ravel(part) for part in parts])

    for number in range(FAR_STATES):
        q0, q = (compose(defaults, end) for end in random.uniform(-0.5, 0.5, (2, layout.n_v)))
        y = random.uniform(-1.0, 1.0, layout.n)
        move = np.zeros(layout.n_v)
        move[k] = random.uniform(-FAR, FAR)
        states = in_state(mechanism, number)
        here, there = numbers(q0, q, y, states), numbers(compose(q0, move), compose(q, move), y, states)
        numeric = np.isfinite(here)
        if not np.array_equal(numeric, np.isfinite(there)):
            return False
        here, there = here[numeric], there[numeric]  # a gap below the ground is no number, here and there
        largest = max(1.0, float(np.max(np.abs(here), initial=0.0)))
        if np.max(np.abs(there - here), initial=0.0) > ROW_RTOL * largest:
            return False
    return True


def reset_names(equations: Equations) -> set[str] | None:
    """Names that resets of events set or read; None where functions may read any."""
    if "names of resets" not in equations.memory:
        equations.memory["names of resets"] = _reset_names(equations)
    known: set[str] | None = equations.memory["names of resets"]
    return known


def _reset_names(equations: Equations) -> set[str] | None:
    """The same, looked for."""
    found: set[str] = set()
    for guard in equations.guards:
        if guard.reset is None:
            continue
        if not isinstance(guard.reset, Mapping):
            return None
        for name, value in guard.reset.items():
            if callable(value) and not is_expression(value):
                return None
            found |= {name, *(map(str, value.free_symbols) if is_expression(value) else ())}
    return found


def _follows(mechanism: Mechanism, parameters: Vector, k: int) -> bool:
    """Whether every row stays as it is where the coordinate and the places of touchdown move on together."""
    layout, random = mechanism.layout, np.random.default_rng(5)
    if layout.n_rows == 0:
        return True
    compose = mechanism.equations.configuration.compose
    move = np.zeros(layout.n_v)
    move[k] = 0.7
    for _ in range(2):  # states at which the rows are moved along
        ends = random.uniform(-0.5, 0.5, (2, layout.n_v))
        defaults = np.array(mechanism.equations.configuration.defaults)
        q0, q1 = (compose(defaults, end) for end in ends)
        h = [_rows(mechanism, parameters, *pair) for pair in ((q0, q1), (compose(q0, move), compose(q1, move)))]
        if not np.max(np.abs(h[1] - h[0]), initial=0.0) <= ROW_RTOL:
            return False
    return True


def _rows(mechanism: Mechanism, parameters: Vector, touched: Vector, q: Vector) -> Vector:
    """h of all rows at q, with what contacts capture at another position."""
    layout = mechanism.layout
    y, none = np.zeros(layout.n), np.zeros(layout.n_anchors)
    held = mechanism.acceleration_terms(0.0, touched, y, parameters, none).captured
    anchors = np.concatenate([held, none])[: layout.n_anchors]
    return np.asarray(mechanism.acceleration_terms(0.0, q, y, parameters, anchors).h)


def depends_on_time(mechanism: Mechanism) -> bool:
    """Whether time itself is in the equations, so that the same state later is another one."""
    equations = mechanism.equations
    known = equations.memory.get("depends on time")
    if known is None:
        with equations.tape.lock:
            stored = {node.index for node in instants_stored(equations)}  # they begin at 0 again
            outputs = [node for node in programs.accelerations(equations) if node.index not in stored]
            given = times_since(equations)
            live_nodes = live([*outputs, *programs.guards(equations)], given)
            nodes: Sequence[object] = [node for node in live_nodes if node.index not in given]
        known = any(getattr(node, "op", "") == "input" and getattr(node, "data", ("",))[0] == "t" for node in nodes)
        equations.memory["depends on time"] = known
    return bool(known)
