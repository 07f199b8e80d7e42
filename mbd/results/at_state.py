"""Results at one state: places and velocities, no forces."""

from typing import Any

import numpy as np

from mbd.compile.mechanisms import mechanism_of
from mbd.errors import ModelError, UnknownNameError
from mbd.results.columns import ModelColumns, asks_for_forces
from mbd.results.record import Record
from mbd.results.trajectory import Trajectory
from mbd.state import State, malformed


def instant(model: Any, state: State) -> Trajectory:
    """A run of one row: the state, without forces.

    Raises
    ------
    ModelError
        for a state that is none of this model.
    """
    faults = malformed(state)
    if faults:
        raise ModelError(faults)
    mechanism = mechanism_of(model, changed=state.parameters)
    equations = mechanism.equations
    sizes = {"q": (len(state.q), equations.n_q), "v": (len(state.v), equations.n_v), "z": (len(state.z), equations.n_z)}
    wrong = [
        f"{name} has {came} numbers, {wanted} are expected" for name, (came, wanted) in sizes.items() if came != wanted
    ]
    if wrong:
        raise ModelError(f"this state is none of '{equations.name}': {'; '.join(wrong)}")
    values = mechanism.parameters_of(model, state.parameters)
    n_v, n_z = equations.n_v, equations.n_z
    closed = np.array([[contact.name in state.mode.closed for contact in equations.contacts]], dtype=np.uint8)
    return Trajectory(
        Record(
            equations, values, [parameter.name for parameter in equations.parameters], np.array([float(state.time)]),
            np.array([state.q], dtype=float), np.array([state.v], dtype=float).reshape(1, n_v),
            np.array([state.z], dtype=float).reshape(1, n_z), np.zeros((1, n_v)), np.zeros((1, n_z)),
            np.zeros((1, len(equations.rows))), closed.reshape(1, len(equations.contacts)), start=state,
            phase=np.zeros((1, len(equations.frictions)), dtype=np.int8),
        )
    )  # fmt: skip


def quantity(run: Trajectory, name: str) -> Any:
    """A result of a run of one row: a number, or the components of a vector (k,); None for what no run has.

    Raises
    ------
    UnknownNameError
        for what follows from forces, which a state does not know.
    """
    columns = run.columns
    try:
        parts = columns.components(name)
    except UnknownNameError:
        return None
    if isinstance(columns, ModelColumns) and asks_for_forces([columns.node(part) for part in parts]):
        raise UnknownNameError(
            f"{name!r} follows from forces, which a state does not have; simulate the model, and ask the run for it"
        )
    value = run[name][0]
    if isinstance(value, str):  # the state of a mode
        return str(value)
    return float(value) if np.ndim(value) == 0 else np.array(value)


def answered(run: Trajectory) -> list[str]:
    """Names of the results of a run of one row that do not follow from forces."""
    columns = run.columns
    if not isinstance(columns, ModelColumns):
        return list(run.names)
    return [
        name for name in run.names if not asks_for_forces([columns.node(part) for part in columns.components(name)])
    ]
