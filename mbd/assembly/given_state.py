"""A model at a state that somebody gives: its compiled equations with the parameters that are valid there."""

import math
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.assembly.manager import manager_of
from mbd.bodies.values import named_number_faults
from mbd.compile.mechanism import Mechanism
from mbd.compile.mechanisms import mechanism_of
from mbd.dataclass import dataclass
from mbd.equal import EQUAL_RTOL
from mbd.equations.equations import Equations
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.kernel.contact.active_set import ActiveSetManager
from mbd.state import State, malformed

MAX_ANGLE = 1e12
"""Beyond this, neighbouring numbers differ by more than 1e-4 rad: poses, and what depends on them, are round-off."""


@dataclass(frozen=True)
class GivenState:
    """What a state is judged and continued with.

    Parameters
    ----------
    mechanism, manager : compiled equations and their contacts
    values : the parameter vector
    changed : parameters other than the model's, by name
    """

    mechanism: Mechanism
    manager: ActiveSetManager
    values: Vector
    changed: dict[str, float]


def given_state(
    model: Any, state: Any, parameters: Mapping[str, float] | None, backend: str, inputs: Collection[str] = ()
) -> GivenState:
    """The model with the parameters of the state, and others on top of them; `inputs` as for `mechanism_of`.

    Raises
    ------
    ModelError
        if the state is not one of this model, or not of finite numbers.
    """
    if not isinstance(state, State):
        raise ModelError(f"state must be a State from mbd.assemble(model, …), not {state!r}")
    faults = malformed(state) + named_number_faults(parameters, "parameters")
    if faults:
        raise ModelError(faults)
    changed = {**state.parameters, **(parameters or {})}
    mechanism = mechanism_of(model, backend, changed, inputs)
    values = mechanism.parameters_of(model, changed)
    manager = manager_of(mechanism, values)
    belongs(state, mechanism.equations, manager)
    return GivenState(mechanism, manager, values, changed)


def fits(start: State, equations: Equations, manager: ActiveSetManager) -> None:
    """The state must be a state, and one of this model, of finite numbers."""
    if faults := malformed(start):
        raise ModelError(faults)
    belongs(start, equations, manager)


def belongs(start: State, equations: Equations, manager: ActiveSetManager) -> None:
    """The same of what is known to be a state."""
    names, anchors = equations.configuration.names, equations.n_anchors
    sizes = (len(start.q), len(start.v), len(start.z)) == (equations.n_q, equations.n_v, equations.n_z)
    if start.names != names or not sizes:
        raise ModelError(
            f"the start has the coordinates {', '.join(start.names) or 'none'} and {len(start.z)} states, but "
            f"the model has {', '.join(names)} and {equations.n_z} states; assemble it from this model"
        )
    known = manager.names
    if start.mode.closed or start.armed:
        contacts = dict.fromkeys([*sorted(start.mode.closed), *sorted(start.armed or ())])
        if unknown := [nearest(name, known, "contact") for name in contacts if name not in known]:
            raise UnknownNameError(unknown)
    if len(start.anchors) != anchors and (start.mode.closed or (len(start.anchors) and equations.turns)):
        raise ModelError(
            f"the start holds {len(start.anchors)} anchors of contacts and turns of cut joints, but the model has "
            f"{anchors}; assemble it from this model, with the same parameters="
        )
    if bad := _bad_values(start, equations):
        raise ModelError(bad)


def _bad_values(start: State, equations: Equations) -> list[str]:
    """Numbers of a state that are not finite, or that no posture has."""
    values = np.concatenate([start.q, start.v, start.z, start.anchors])
    bad = [] if all(map(math.isfinite, values.tolist())) else _not_finite(start, equations)
    bad += [f"the start has {fault}; take whole turns away" for fault in beyond_angles(equations, start.q)]
    return bad or [f"the start has {fault}" for fault in equations.configuration.misplaced(start.q, EQUAL_RTOL)]


def _not_finite(start: State, equations: Equations) -> list[str]:
    """Numbers of a state that are not finite, by name."""
    names = [coordinate.name for coordinate in equations.coordinates]
    parts = ((start.q, names), (start.v, equations.velocity_names), (start.z, [s.name for s in equations.states]))
    values = [(name, value) for part, known in parts for name, value in zip(known, part, strict=True)]
    held = {a: f"{m.name}.{field}" for m in equations.machines for a, field in zip(m.anchors, m.fields, strict=True)}
    values += [(held.get(k, f"anchor {k} of its contacts"), value) for k, value in enumerate(start.anchors)]
    return [
        f"the start has {name!r} = {value}; give a finite number" for name, value in values if not np.isfinite(value)
    ]


def beyond_angles(equations: Equations, q: Vector) -> list[str]:
    """Which angles of a position (n_q,) are too large, one phrase each."""
    if not np.maximum.reduce(np.abs(q), initial=0.0) > MAX_ANGLE:
        return []
    return [
        f"{coordinate.name!r} = {value:.6g} rad, where neighbouring numbers are {np.spacing(abs(value)):.2g} rad apart"
        for coordinate, value in zip(equations.coordinates, q, strict=True)
        if coordinate.unit == "rad" and abs(value) > MAX_ANGLE
    ]
