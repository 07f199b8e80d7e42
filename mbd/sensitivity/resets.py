"""Resets of users' events, differentiated: the functions that give the values are traced as those of forces are."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from mbd.arrays import Matrix, Vector
from mbd.compile.mechanism import rate_names
from mbd.constraints.expressions import is_expression
from mbd.equations.equations import Equations
from mbd.errors import MbdError
from mbd.joints.quaternions import quaternion_product
from mbd.sensitivity.motion import Mode, Motion, Rates
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.run_data import refused
from mbd.tape.node import Node, Tape
from mbd.tape.sympy import lower


class Named(Mapping[str, Node]):
    """Any named quantity as an expression."""

    def __init__(self, equations: Equations) -> None:
        self._equations = equations
        self._places = {parameter.name: k for k, parameter in enumerate(equations.parameters)}

    def __getitem__(self, name: str) -> Node:
        if name.endswith("_rate") and name not in self._places and name not in self._equations.output_names():
            name = f"{name.removesuffix('_rate')}.rate"  # as symbols of energies are called
        if name in self._places and name not in self._equations.output_names():
            return self._equations.tape.input("p", self._places[name])
        return self._equations.output(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._equations.output_names())

    def __len__(self) -> int:
        return len(self._equations.output_names())


def after_reset(
    programs: Programs, motion: Motion, mode: Mode, rates: Rates, e: int, row: tuple[Vector, Vector]
) -> Motion:
    """The motion at the row (q, y) after the reset of users' event e.

    Raises
    ------
    CapabilityError
        for a reset that is not a function of traced values.
    """
    equations, guard = programs.equations, programs.equations.guards[e]
    values = reset_expressions(equations, guard.reset, guard.name)
    names, nodes = list(values), list(values.values())
    lines = programs.derivatives_of(f"reset {e}", nodes, motion.at(mode, rates.rate, rates.lam))
    found = lines @ motion.tangent.stacked(programs.columns, rates.of_rate, rates.of_lam)
    coordinates = {each.name: k for k, each in enumerate(equations.coordinates)}
    speeds = {name: k for name, k in rate_names(equations).items() if name not in coordinates}
    speeds |= {state.name: equations.n_v + k for k, state in enumerate(equations.states)}
    places = {int(place): k for k, place in enumerate(equations.configuration.places) if place >= 0}
    q, y, turned = motion.tangent.q.copy(), motion.tangent.y.copy(), dict[int, Vector]()
    for name, change in zip(names, found, strict=True):
        if name in coordinates and coordinates[name] in places:
            q[places[coordinates[name]]] = change
        elif name in coordinates:
            turned[coordinates[name]] = change
        else:
            known = name if name in speeds else f"{name.removesuffix('_rate')}.rate"
            y[speeds[known]] = change
    if turned:
        _turn(equations, turned, row[0], q, guard.name)
    return replace(motion, q=row[0], y=row[1]).with_tangent(q=q, y=y)


def _turn(equations: Equations, turned: Mapping[int, Vector], at: Vector, q: Matrix, name: str) -> None:
    """The tangents (n_v, D) of orientations that a reset sets by the parts of their quaternions: 2 q* ⊗ δq."""
    for joint, first_q, first_v in equations.configuration.charts:
        own = range(first_q + joint.adding, first_q + len(joint.labels))
        given = [turned[k] for k in own if k in turned]
        if not given:
            continue
        if joint.orientation is None or len(given) < len(own):
            raise refused(f"the reset of {name!r} sets a part of what tells how {joint.name!r} turns", "set all parts")
        w, x, y, z = at[own.start : own.stop]
        q[first_v + joint.adding : first_v + joint.adding + 3] = [
            2.0 * part for part in quaternion_product([w, -x, -y, -z], given)[1:]
        ]


def reset_expressions(equations: Equations, reset: Any, name: str) -> dict[str, Node]:
    """What a reset sets, as expressions of the state before it, from a function or from sympy expressions.

    Raises
    ------
    CapabilityError
        for a reset that is not a function of traced values.
    """
    named, tape = Named(equations), equations.tape
    try:
        with tape.lock:
            wanted = reset(named) if callable(reset) else reset
            values: Sequence[tuple[str, Any]] = list(wanted.items())
            return {each: _node(named, tape, value) for each, value in values}
    except (TypeError, ValueError, AttributeError, MbdError) as error:
        raise refused(
            f"the reset of {name!r} cannot be differentiated: {error}", "write it with mbd.sin, mbd.where and operators"
        ) from error


def _node(named: Named, tape: Tape, value: Any) -> Node:
    """One value that a reset sets: a number, a function of named quantities, or a sympy expression of them."""
    if is_expression(value):
        return lower(value, {symbol: named[str(symbol)] for symbol in value.free_symbols}, tape)
    return tape.lift(value(named) if callable(value) else value)
