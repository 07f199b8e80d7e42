"""The tangent S = M + c_C C + c_K K of a balance, by the way that takes fewer operations.

Either one forward sweep a column over the recursive dynamics (`seeded`), which knows any equations, or what the
derivation knows of its own (`Geometry.tangent`): of planar trees, quantities of whole branches (`composites`). Both are
the same to round-off.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from mbd.equations.equations import ActingForces, Equations
from mbd.equations.factoring import factored
from mbd.equations.inputs import Inputs
from mbd.tape.derivatives import Sweeps, live
from mbd.tape.node import Node

__all__ = ["Columns", "seeded", "tangent"]

Columns = list[list[Node]]
"""A matrix, column by column."""

MIN_ADVANTAGE = 0.1
"""Part by which one way must be shorter for the balance alone to be taken for every contact mode without counting."""
MAX_DEPTH = 8.0
"""Coordinates that move a body, on average, from which on branches are shorter: seeds cost three times as much a pair.
"""


def tangent(equations: Equations, r: Sequence[Node], forces: ActingForces, others: Sequence[Node]) -> Columns:
    """The columns of S.

    The choice depends on the equations and the mode alone, never on what was asked before.

    Parameters
    ----------
    r : the balance under these forces
    others : what is evaluated beside, whose parts cost nothing
    """
    ratio = _ratio(equations)
    if ratio > 1.0 + MIN_ADVANTAGE:
        return seeded(equations, r)
    known = _known(equations, forces)
    if known is None or ratio < 1.0 - MIN_ADVANTAGE:
        return seeded(equations, r) if known is None else known
    swept = seeded(equations, r)
    return known if _size([*r, *others], known) < _size([*r, *others], swept) else swept


def seeded(equations: Equations, r: Sequence[Node]) -> Columns:
    """One forward sweep a column, in the directions of `Inputs.directions`, with common factors outside or not."""
    inputs = Inputs.of(equations)
    known: Sequence[Mapping[Node, Node]] = [{} for _ in inputs.x]
    if equations.geometry is not None:
        known = equations.geometry.partials(r)
    sweeps: Sweeps = equations.memory.setdefault("sweeps of tangents", Sweeps())
    columns, zero = sweeps(r, inputs.directions(known)), equations.tape.zero
    filled = [j for j, column in enumerate(columns) if any(entry is not zero for entry in column)]
    plain = [entry for j in filled for entry in columns[j]]
    known_factors: dict[int, Node] = equations.memory.setdefault("factored tangents", {})
    entries = min(plain, factored(plain, inputs.c, known_factors), key=lambda S: len(live([*r, *S])))
    for place, j in enumerate(filled):
        columns[j] = entries[place * len(r) : (place + 1) * len(r)]
    return columns


def _known(equations: Equations, forces: ActingForces) -> Columns | None:
    return None if equations.geometry is None else equations.geometry.tangent(forces)


def _ratio(equations: Equations) -> float:
    """Nodes of the balance alone with its tangent by branches, over those with seeds; ∞ where there is no such way."""
    if "branches over seeds" not in equations.memory:
        balance, ratio = list(equations.balance), float("inf")
        known = _known(equations, ActingForces())
        if known is not None:
            deep = equations.geometry is not None and equations.geometry.depth >= MAX_DEPTH
            ratio = 0.0 if deep else _size(balance, known) / max(1, _size(balance, seeded(equations, balance)))
        equations.memory["branches over seeds"] = ratio
    return float(equations.memory["branches over seeds"])


def _size(others: Sequence[Node], columns: Columns) -> int:
    return len(live([*others, *(entry for column in columns for entry in column)]))
