"""The scene without some of its effects, started with the same values."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mbd.assembly.assemble import assemble
from mbd.compile.mechanisms import mechanism_of
from mbd.dataclass import dataclass
from mbd.equations.cost import Cost
from mbd.equations.equations import Equations
from mbd.results.trajectory import Trajectory
from mbd.state import Mode, State


@dataclass(frozen=True)
class Element:
    """An effect that may be left out: name, kind in the ledger, operations, and when it takes them."""

    name: str
    kind: str
    operations: int
    acts: str


@dataclass(frozen=True, eq=False)
class Scene:
    """A model, its start, and the parameters that differ from the model's."""

    model: Any
    start: State
    parameters: Mapping[str, float]


def elements(equations: Equations, cost: Cost) -> tuple[Element, ...]:
    """Every effect: forces of all kinds as they act, penalty contacts while closed, dry friction while it slides."""
    columns = {effect.name: effect.column for effect in equations.effects}
    penalties = [contact.name for contact in equations.contacts if contact.kind == "penalty"]
    return (
        *(Element(name, columns[name], count, "always") for name, count in cost.effects.items()),
        *(Element(name, "penalty", cost.contacts[name], "while closed") for name in penalties),
        *(Element(name, "friction", count, "while sliding") for name, count in cost.frictions.items()),
    )


def reduced(scene: Scene, run: Trajectory, names: Iterable[str], backend: str) -> Scene:
    """The scene without some effects, from the same positions and velocities.

    Rows are those of the whole scene or fewer, so the same values hold on them. Where an effect had a joint cut
    (friction that follows its force), the coordinates are others: they are read off the whole scene and assembled.

    Parameters
    ----------
    run : of the whole scene, whose first row gives what its state does not name
    """
    model = scene.model.without(*names)
    known = getattr(model, "parameters", {})
    mine = {name: value for name, value in scene.parameters.items() if name in known}
    start = scene.start
    equations = mechanism_of(model, backend, mine).equations
    whole = mechanism_of(scene.model, backend, scene.parameters).equations
    if [c.name for c in equations.coordinates] != list(start.names):
        return Scene(model, _reassembled(equations, whole, model, start, run, mine, backend), mine)
    states = dict(zip((state.name for state in whole.states), start.z, strict=True))
    contacts = {contact.name for contact in equations.contacts}
    armed = None if start.armed is None else start.armed & contacts
    made = replace(
        start, z=np.array([states[state.name] for state in equations.states]),
        mode=Mode(start.mode.closed & contacts), armed=armed, anchors=_anchors(equations, whole, start),
        parameters=mine, memory=None, moved={},
    )  # fmt: skip
    return Scene(model, made, mine)


def _anchors(equations: Equations, whole: Equations, start: State, fresh: Any = None) -> Any:
    """What the contacts and machines that are left hold, and the whole turns of cut joints.

    fresh : anchors of a start in other coordinates, of which machines alone hold what they held
    """
    if not len(start.anchors):
        return start.anchors if fresh is None else fresh
    held, before = np.zeros(equations.n_anchors) if fresh is None else fresh.copy(), _places_of_anchors(whole)
    for key, anchor in _places_of_anchors(equations).items():
        if key in before and (fresh is None or key[0] == "machine"):
            held[anchor] = start.anchors[before[key]]
    return held


def _places_of_anchors(equations: Equations) -> dict[tuple[Any, ...], int]:
    """Anchors by what holds them."""
    found: dict[tuple[Any, ...], int] = {("turn", turn.joint, turn.name): turn.anchor for turn in equations.turns}
    for contact in equations.contacts:
        found |= {("contact", contact.name, len(contact.anchors), k): a for k, a in enumerate(contact.anchors)}
    for each in equations.machines:
        found |= {("machine", each.name, field): a for field, a in zip(each.fields, each.anchors, strict=True)}
    return found


def _reassembled(
    equations: Equations, whole: Equations, model: Any, start: State, run: Trajectory,
    parameters: Mapping[str, float], backend: str,
) -> State:  # fmt: skip
    """A start in other coordinates."""
    first = run.at(float(run.time[0]), side="left")
    position = {coordinate.name: first[coordinate.name] for coordinate in (*equations.coordinates, *equations.states)}
    velocity = {name: first[name] for name in equations.velocity_names}
    contacts = {contact.name for contact in equations.contacts}
    closed = start.mode.closed & contacts
    free = set() if start.armed is None else contacts - closed - start.armed
    made = assemble(model, position, velocity, closed, free, parameters, project=True, backend=backend)
    return replace(made, time=start.time, anchors=_anchors(equations, whole, start, made.anchors))
