"""Whether a run has the same events in the same order where what it was differentiated by changes by so much."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from mbd.assembly.projection import project
from mbd.bodies.values import is_number, shown
from mbd.errors import AssemblyError, ModelError, SimulationError, UnknownNameError, nearest
from mbd.results.trajectory import Trajectory
from mbd.sensitivity.run_data import RunRows, refused
from mbd.sensitivity.starts import directions, programs_of, start_tangent
from mbd.state import State

__all__ = ["amounts_of", "changed_sequences"]

Again = Callable[[State, Mapping[str, float]], Trajectory]


def amounts_of(given: Any, names: list[str]) -> dict[str, float]:
    """By how much each quantity is to change, checked.

    Raises
    ------
    ModelError, UnknownNameError
        for what is no positive number, or a name that is not among `names`.
    """
    if given is None:
        return {}
    if not isinstance(given, Mapping) or not all(is_number(size) and size > 0.0 for size in given.values()):
        raise ModelError(
            "check_events maps names in wrt to changes > 0 that the order of events is to survive, such as "
            f"{{'hip.angle': 0.01}}, not {shown(given)}"
        )
    for name in given:
        if name not in names:
            raise UnknownNameError("check_events: " + nearest(name, names, "name in wrt", "There are"))
    return {name: float(size) for name, size in given.items()}


def changed_sequences(
    model: Any, run: Trajectory, ways: Sequence[Any], held: Sequence[str], amounts: Mapping[str, float], again: Again,
    backend: str,
) -> tuple[str, ...]:  # fmt: skip
    """The first event that is another, by each change in both senses; () if all are the same.

    ways, held : directions and what they leave as it is, see `mbd.sensitivity.derivative`; amounts : sizes of changes;
    again : makes the run from another start, with other parameters
    """
    rows, found = RunRows(run), list[str]()
    wanted_ways, compose = directions(rows.mechanism, ways), rows.mechanism.equations.configuration.compose
    for way in wanted_ways:
        if way.restitutions and way.name in amounts:
            raise refused(
                f"runs take no other restitution as a parameter: {way.name!r}", "leave it out of check_events"
            )
    programs = programs_of(rows.mechanism, wanted_ways, rows.record.parameters)
    start, state = start_tangent(rows.first, programs, wanted_ways, held), rows.record.start
    values = dict(zip(rows.record.parameter_names, rows.record.parameters, strict=False))
    wanted = [(event.kind, event.name) for event in run.events]
    for k, way in enumerate(wanted_ways):
        size = amounts.get(way.name, 0.0)
        for part in (size, -size) if size else ():
            changed = {name: values[name] + part * rate for name, rate in (way.parameters or {}).items()}
            n_v = len(start.q)
            moved = replace(
                state, q=compose(state.q, part * start.q[:, k]), v=state.v + part * start.y[:n_v, k],
                z=state.z + part * start.y[n_v:, k], memory=None,
            )  # fmt: skip
            name = f"{way.name} {'+' if part > 0 else '−'} {size:g}"
            try:
                other = again(project(model, moved, {**state.parameters, **changed}, backend), changed)
            except (AssemblyError, SimulationError) as error:
                found.append(f"{name}: {str(error).splitlines()[0]}")
                continue
            difference = _first_difference(wanted, [(event.kind, event.name) for event in other.events])
            found += [f"{name}: {difference}"] if difference else []
    return tuple(found)


def _first_difference(wanted: list[tuple[str, str]], found: list[tuple[str, str]]) -> str:
    """The first event that is another, '' if none is."""
    for number in range(max(len(wanted), len(found))):
        here = wanted[number] if number < len(wanted) else None
        there = found[number] if number < len(found) else None
        if here != there:
            now, then = (f"{each[1]!r} {each[0]}" if each else "none" for each in (there, here))
            return f"event {number + 1} is {now}, in the run {then}"
    return ""
