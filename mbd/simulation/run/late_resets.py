"""Resets of events that end runs, for many ends at once.

A run that an event ends is over but for what the event resets. Where coordinates add, no rows and no contacts bind
them, and the reset is written in numbers and expressions of coordinates, rates and parameters, the same functions of
`math` that a run alone calls are called for all ends, one after the other, with the same bits as result.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.bodies.values import is_finite_number
from mbd.compile.mechanism import rate_names
from mbd.constraints.expressions import function_of_expression, is_expression
from mbd.equations.equations import Guard
from mbd.simulation.run.data import RunData


def may_reset_late(run: RunData, guard: Guard) -> bool:
    """Whether `reset_ends` can do what a run does after this event."""
    if not isinstance(guard.reset, Mapping) or not run.mechanism.vector:
        return False
    if run.kernel.n_rows or run.kernel.n_contacts:
        return False
    places, known = _places(run), _known(run)
    if not all(_spelled(name) in places for name in guard.reset):
        return False
    for value in guard.reset.values():
        if is_expression(value):
            names, _ = function_of_expression(value)
            if not all(_spelled(name) in known for name in names):
                return False
        elif not is_finite_number(value):
            return False
    return True


def reset_ends(run: RunData, guard: Guard, q: Matrix, y: Matrix, parameters: Matrix) -> Any:
    """Reset the ends (N, n_q) and (N, n) of runs with parameters (N, P) or (1, P), in place.

    Returns
    -------
    (N,) whether each was given finite numbers; one that was not stays as it is
    """
    known: list[Any] = run.mechanism.kept((reset_ends, id(guard)), list)
    if not known or known[0].keys() != guard.reset.keys() or any(known[0][k] is not v for k, v in guard.reset.items()):
        known[:] = dict(guard.reset), _plan(run, guard)
    plan = known[1]
    whole = np.hstack([q, y, np.broadcast_to(parameters, (len(q), parameters.shape[1]))])
    wanted = [(place, _column(function, [whole[:, k] for k in read], len(q))) for place, function, read in plan]
    sound = np.all([np.isfinite(column) for _, column in wanted], axis=0)
    n_q = run.kernel.n_q
    for place, column in wanted:
        target = q[:, place] if place < n_q else y[:, place - n_q]
        target[sound] = column[sound]
    return np.asarray(sound)


def _plan(run: RunData, guard: Guard) -> list[tuple[int, Callable[..., Any], list[int]]]:
    """Of each number that is set: its place in (q, v, z), what gives it, and the places that this takes it from."""
    places, known, found = _places(run), _known(run), list[tuple[int, Callable[..., Any], list[int]]]()
    for name, value in guard.reset.items():
        names, function = function_of_expression(value) if is_expression(value) else ((), partial(float, value))
        found.append((places[_spelled(name)], function, [known[_spelled(each)] for each in names]))
    return found


def _column(function: Any, columns: list[Vector], count: int) -> Vector:
    """A function of floats at every row; NaN where it has no value."""

    def at(*values: float) -> float:
        try:
            return float(function(*values))
        except (ValueError, ZeroDivisionError, OverflowError, TypeError):
            return float("nan")

    rows = zip(*[column.tolist() for column in columns], strict=True) if columns else iter([()] * count)
    return np.array([at(*values) for values in rows], dtype=float)


def _places(run: RunData) -> dict[str, int]:
    """Where coordinates, rates and states stand in (q, v, z), by every spelling that a reset may use."""
    equations = run.mechanism.equations
    names = {coordinate.name: k for k, coordinate in enumerate(equations.coordinates)}
    n_q, n_v = equations.n_q, equations.n_v
    rates = {name: n_q + k for name, k in rate_names(equations).items()}
    states = {state.name: n_q + n_v + k for k, state in enumerate(equations.states)}
    return {**rates, **states, **names}


def _known(run: RunData) -> dict[str, int]:
    """The same with the parameters behind them."""
    equations = run.mechanism.equations
    size = equations.n_q + equations.n_v + equations.n_z
    parameters = {parameter.name: size + k for k, parameter in enumerate(equations.parameters)}
    return {**parameters, **_places(run)}


def _spelled(name: str) -> str:
    """'theta.rate' for 'theta_rate', as symbols of energies are called."""
    return f"{name.removesuffix('_rate')}.rate" if name.endswith("_rate") else name
