"""A model at a state that somebody gives: its compiled equations with the parameters that are valid there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mbd.arrays import Vector
from mbd.bodies.values import named_number_faults
from mbd.compile.mechanism import Mechanism
from mbd.compile.mechanisms import mechanism_of
from mbd.errors import ModelError
from mbd.kernel.active_set import ActiveSetManager
from mbd.simulation.arguments import fits
from mbd.state import State, malformed
from mbd.trivial_rows import manager_of

__all__ = ["GivenState", "given_state"]


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


def given_state(model: Any, state: Any, parameters: Mapping[str, float] | None, backend: str) -> GivenState:
    """The model with the parameters of the state, and others on top of them.

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
    mechanism = mechanism_of(model, backend, changed)
    values = mechanism.parameters(changed, getattr(model, "parameters", {}))
    manager = manager_of(mechanism, values)
    fits(state, mechanism.equations, manager)
    return GivenState(mechanism, manager, values, changed)
