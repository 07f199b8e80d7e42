"""A start with some of its coordinates and rates changed, completed as the first time."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mbd.assembly.consistency import residuals, violations
from mbd.assembly.given_state import given_state
from mbd.assembly.machines import begun_in, stored_anew
from mbd.assembly.pose import Posture
from mbd.assembly.posture import capture, close_nearby, close_velocities, position_rows
from mbd.compile.mechanism import Mechanism, rate_names
from mbd.errors import AssemblyError
from mbd.state import State, of_model


def start_names(mechanism: Mechanism) -> dict[str, tuple[str, int]]:
    """('q' or 'y', number) by name: every coordinate that adds, rate and first-order state of a start.

    The parts of a quaternion are none of them, as they do not change alone.
    """
    equations = mechanism.equations
    found = {name: ("y", number) for name, number in rate_names(equations).items()}
    found |= {state.name: ("y", equations.n_v + k) for k, state in enumerate(equations.states)}
    adding = set(equations.configuration.places.tolist())
    return found | {each.name: ("q", k) for k, each in enumerate(equations.coordinates) if k in adding}


def changed_start(
    model: Any, start: State, values: Mapping[str, float], parameters: Mapping[str, float], backend: str
) -> State:
    """The start with these coordinates and rates, held exactly; what rows bind follows, with the least motion.

    Positions that are not named move least in the metric of the mass matrix until the rows on positions and closed
    contacts hold, which stick where they are then; then velocities.

    Raises
    ------
    AssemblyError
        where the others cannot make the rows hold.
    """
    given = given_state(model, start, parameters, backend)
    mechanism, manager, equations = given.mechanism, given.manager, given.mechanism.equations
    start, begun = begun_in(model, mechanism, start)
    q, y = np.array(start.q, dtype=float), np.concatenate([start.v, start.z]).astype(float)
    free_q, free_v = np.ones(equations.n_v, dtype=bool), np.ones(equations.n_v, dtype=bool)
    names = start_names(mechanism)
    for name, value in values.items():
        which, number = names[name]
        (q if which == "q" else y)[number] = value
        if which == "q":
            free_q[equations.configuration.places == number] = False
        elif number < equations.n_v:
            free_v[number] = False
    anchors = np.array(start.anchors, dtype=float)
    anchors = anchors if len(anchors) == mechanism.layout.n_anchors else np.zeros(mechanism.layout.n_anchors)
    flags = manager.flags(start.mode.closed)
    work = Posture(mechanism, manager, given.values, q, y, flags, anchors, time=start.time)
    active = list(manager.active_rows(flags))
    if active:
        close_nearby(work, position_rows(work), free_q)
        capture(work)
        close_velocities(work, free_v)
        rows = residuals(mechanism, work.time, work.q, work.y, work.parameters, work.anchors)
        left = violations(equations.rows, active, rows, float(np.max(np.abs(work.y[: equations.n_v]), initial=0.0)))
        if left:
            shown = ", ".join(f"{name} = {value:.6g}" for name, value in values.items())
            raise AssemblyError(f"no start with {shown}: {'; '.join(left)}")
    changed = replace(
        start, q=work.q, v=work.y[: equations.n_v].copy(), z=work.y[equations.n_v :].copy(),
        anchors=work.anchors if active else start.anchors, moved={}, memory=None,
    )  # fmt: skip
    return of_model(stored_anew(mechanism, changed, given.values, begun), model)
