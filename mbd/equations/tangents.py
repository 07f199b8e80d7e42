"""The tangent S = M + c_C C + c_K K of a balance, by the way that takes fewer operations.

Either one forward sweep a column over the recursive dynamics (`seeded`), which knows any equations, or what the
derivation knows of its own (`Geometry.tangent`): of planar trees, quantities of whole branches (`composites`). Both are
the same to round-off.
"""

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

from mbd.equations.equations import ActingForces, Equations
from mbd.equations.inputs import Inputs
from mbd.tape.derivatives import Sweeps, live, rebuild
from mbd.tape.node import Node, Tape

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


# Common factors moved outward: fewer operations for the same tangents.
#
# A tangent seeded with c_K carries it into every term, ``(c_K a) x + (c_K b) y``; moved outward it is multiplied once,
# ``c_K (a x + b y)``, and the sum inside is often there already: the derivative of a rotated vector by its own angle is
# the vector turned by a right angle.


class _Term(NamedTuple):
    """± factor · rest."""

    negative: bool
    factor: Node
    rest: Node


def factored(outputs: Sequence[Node], factors: Collection[Node], known: dict[int, Node] | None = None) -> list[Node]:
    """The outputs with the factors moved outward through products, signs and sums of terms that share one.

    known : what became of nodes, by index, in an earlier call for the same factors; what this one finds is added
    """
    if not outputs:
        return []
    tape = outputs[0].tape
    keys = {factor.index for factor in factors}
    new: dict[int, Node] = {} if known is None else known
    for node in live(outputs, new):
        if node.index in new:
            continue
        args = [new[arg.index] for arg in node.args]
        if node.op == "mul":
            new[node.index] = _product(tape, args[0], args[1], keys)
        elif node.op in ("add", "sub"):
            new[node.index] = _sum(tape, node.op, args[0], args[1], keys)
        elif all(arg is old for arg, old in zip(args, node.args, strict=True)):
            new[node.index] = node
        else:
            new[node.index] = rebuild(tape, node, args)
    return [new[node.index] for node in outputs]


def _split(node: Node, keys: Collection[int]) -> _Term | None:
    """A node as a factor times the rest, if it is one."""
    core, negative = (node.args[0], True) if node.op == "neg" else (node, False)
    if core.index in keys:
        return _Term(negative, core, core.tape.one)
    if core.op == "mul":
        for factor, rest in (core.args, core.args[::-1]):
            if factor.index in keys:
                return _Term(negative, factor, rest)
    return None


def _product(tape: Tape, a: Node, b: Node, keys: Collection[int]) -> Node:
    """a b with the factor in front."""
    if a.index in keys or b.index in keys or a.is_constant or b.is_constant:
        return tape.mul(a, b)
    term, other = _split(a, keys), b
    if term is None:
        term, other = _split(b, keys), a
    if term is None:
        return tape.mul(a, b)
    result = tape.mul(term.factor, tape.mul(term.rest, other))
    return tape.neg(result) if term.negative else result


def _sum(tape: Tape, op: str, a: Node, b: Node, keys: Collection[int]) -> Node:
    """a ± b, with a factor that both share in front."""
    combine = tape.add if op == "add" else tape.sub
    one, other = _split(a, keys), _split(b, keys)
    if one is None or other is None or one.factor is not other.factor:
        return combine(a, b)
    left, right = (tape.neg(term.rest) if term.negative else term.rest for term in (one, other))
    return tape.mul(one.factor, combine(left, right))
