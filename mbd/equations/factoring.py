"""Common factors moved outward: fewer operations for the same tangents.

A tangent seeded with c_K carries it into every term, ``(c_K a) x + (c_K b) y``; moved outward it is multiplied once,
``c_K (a x + b y)``, and the sum inside is often there already: the derivative of a rotated vector by its own angle is
the vector turned by a right angle.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import NamedTuple

from mbd.tape.derivatives import live, rebuild
from mbd.tape.node import Node, Tape

__all__ = ["factored"]


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
