"""Rows that hold whatever the motion, to round-off: redundant parts of joints on one axis or in one plane.

Three joints on one tilted axis close a loop in which the third holds no direction that the others leave free. Its rows
are zero identically, but the numbers that come out are round-off, and so is their Jacobian: to solve with it would hold
the mechanism at rest by forces that do not exist. Such rows never act. Whether a row is one depends on the shape of the
bodies, that is on parameters: it is judged for their values, at positions anywhere, by the parts of its Jacobian
before they cancel (`mbd.equations.derivation`).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.compile.mechanism import Mechanism
from mbd.compile.python import ScalarFunction, scalar_function
from mbd.equal import EQUAL_RTOL, NOMINAL_RTOL, ROUND_OFF_RTOL
from mbd.equations.equations import Equations, Row
from mbd.equations.magnitudes import magnitudes
from mbd.errors import ModelError
from mbd.tape.derivatives import gradient, live
from mbd.tape.node import Node

SAMPLED_POSES = 3
"""Positions at which rows are looked at [-]."""


@dataclass
class _Last:
    """What was found last: values of the parameters on which rows depend, with trivial rows and faults."""

    found: tuple[bytes, tuple[frozenset[int], list[str]]] | None = None


def trivial_rows(mechanism: Mechanism, parameters: Vector) -> frozenset[int]:
    """Numbers of the rows that hold whatever the motion, with these values of the parameters.

    Raises
    ------
    ModelError
        for rows of joints and constraints that no motion changes and that do not hold.
    """
    if not mechanism.equations.rows:
        return frozenset()
    places = mechanism.kept(_places, lambda: _places(mechanism))
    values = parameters[places].tobytes()
    last = mechanism.kept(_Last, _Last)
    known = last.found
    if known is None or known[0] != values:
        known = last.found = values, _found(mechanism, parameters)
    _, (rows, faults) = known
    if faults:
        raise ModelError(faults)
    return frozenset(rows)


def _places(mechanism: Mechanism) -> list[int]:
    """Places of the parameters on which rows depend."""
    nodes = [row.rate if row.is_velocity else row.value for row in mechanism.equations.rows]
    return sorted({node.data[1] for node in live(nodes) if node.op == "input" and node.data[0] == "p"})


def _found(mechanism: Mechanism, parameters: Vector) -> tuple[frozenset[int], list[str]]:
    """The rows, and what is wrong with them."""
    equations, n_v = mechanism.equations, mechanism.equations.n_v
    blocks = _blocks(mechanism)
    with np.errstate(all="ignore"):
        terms = [mechanism.terms_of(block, parameters) for block in blocks]
    B = np.abs(np.stack([each.B[:, :n_v] for each in terms]))
    largest = np.max(B, axis=(0, 2), initial=0.0)
    bound = NOMINAL_RTOL * max(1.0, float(np.max(largest, initial=0.0)))
    normals = {contact.rows[0] for contact in equations.contacts if contact.rows}
    doubtful = [k for k in range(len(equations.rows)) if largest[k] <= bound and k not in normals]
    if not doubtful:
        return frozenset(), []
    chosen = tuple(doubtful)
    sizes, out = mechanism.kept((_sizes, chosen), lambda: _sizes(mechanism, chosen)), np.zeros(len(doubtful) * n_v)
    trivial = np.ones(len(doubtful), dtype=bool)
    for block, slopes in zip(blocks, B, strict=True):
        with np.errstate(all="ignore"):
            sizes(block, parameters, out)
        trivial &= np.all(slopes[doubtful] <= ROUND_OFF_RTOL * out.reshape(len(doubtful), n_v), axis=1)
    rows, faults = [k for k, small in zip(doubtful, trivial, strict=True) if small], list[str]()
    for k in rows:
        faults += _misfit(
            equations.rows[k], [float((each.rate if equations.rows[k].is_velocity else each.h)[k]) for each in terms]
        )
    return frozenset(rows), faults


def _blocks(mechanism: Mechanism) -> list[Any]:
    """Inputs at rest at positions anywhere near the defaults, and at different times."""
    equations, layout = mechanism.equations, mechanism.layout
    q = np.array([coordinate.default for coordinate in equations.coordinates], dtype=float)
    found, places = list[Any](), np.arange(1, equations.n_v + 1)
    for number in range(SAMPLED_POSES):
        block = mechanism.block(0.37 * number, q, np.zeros(layout.n), np.zeros(layout.n_anchors))
        block[layout.x : layout.v] = 1.2 * np.sin(2.3 * places + 5.1 * number + 0.4)
        found.append(block)
    return found


def _sizes(mechanism: Mechanism, rows: tuple[int, ...]) -> ScalarFunction:
    """Σ|parts| of the derivatives of rows."""
    nodes = [node for k in rows for node in parts_of_row(mechanism.equations, k)]
    return scalar_function(nodes, mechanism.layout, "row_sizes")


def parts_of_row(equations: Equations, k: int) -> list[Node]:
    """Σ|parts| of the derivative of a row by each x_j, or v_j; of equations without bodies by the terms of it."""
    if equations.geometry is not None:
        return equations.geometry.row_sizes(k)
    row = equations.rows[k]
    inputs = [equations.tape.input("v" if row.is_velocity else "x", j) for j in range(equations.n_v)]
    return magnitudes(equations.tape, gradient(row.rate if row.is_velocity else row.value, inputs))


def _misfit(row: Row, values: list[float]) -> list[str]:
    """What is wrong with a row that no motion changes; anchors are chosen so that rows with them hold."""
    node: Node = row.rate if row.is_velocity else row.value
    if any(each.op == "input" and each.data[0] == "anchor" for each in live([node])):
        return []
    size = max(values, key=abs)
    if abs(size) <= EQUAL_RTOL:
        return []
    unit = f"{row.unit}/s" if row.is_velocity else row.unit
    return [f"{row.title} is {size:.6g} {unit} whatever the motion, so it can never be 0"]
