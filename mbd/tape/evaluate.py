"""Plain evaluation of tape expressions, node by node: slow, simple, and never raising on numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from mbd.errors import UnknownNameError, nearest
from mbd.tape.derivatives import live
from mbd.tape.node import Node
from mbd.tape.operations import value
from mbd.tape.printing import input_name

__all__ = ["evaluate", "values"]

Key = tuple[str, int]


def evaluate(outputs: Sequence[Node], inputs: Mapping[Node | Key, float]) -> list[float]:
    """The values of the outputs, after IEEE 754: divisions by zero give infinity, impossible values nan.

    Parameters
    ----------
    outputs : what to evaluate
    inputs : the value of every input needed, by its node or by its key ``(kind, index)``; the value of any other node
        may be given too and is then used in place of its expression

    >>> from mbd.tape.node import Tape
    >>> tape = Tape()
    >>> x = tape.input("q", 0)
    >>> evaluate([x * x, 1.0 / (x - 3.0)], {("q", 0): 3.0})
    [9.0, inf]
    """
    known = values(outputs, inputs)
    return [known[node] for node in outputs]


def values(outputs: Sequence[Node], inputs: Mapping[Node | Key, float]) -> dict[Node, float]:
    """The value of every node that the outputs need, arguments first: shows where a nan was born."""
    given = {key.index: float(number) for key, number in inputs.items() if isinstance(key, Node)}
    by_key = {key: float(number) for key, number in inputs.items() if not isinstance(key, Node)}
    found: dict[int, float] = {}
    order = live(outputs, given)
    for node in order:
        found[node.index] = given[node.index] if node.index in given else _value(node, found, by_key)
    return {node: found[node.index] for node in order}


def _value(node: Node, found: Mapping[int, float], by_key: Mapping[Key, float]) -> float:
    op = node.op
    if op == "const":
        return float(node.data)
    if op == "input":
        if node.data not in by_key:
            known = [f"{kind}{index}" for kind, index in by_key]
            raise UnknownNameError(nearest(input_name(node), known, "input", "Given are"))
        return by_key[node.data]
    args = [found[arg.index] for arg in node.args]
    if op == "table":
        table, order = node.data
        return float(table.value(args[0], order))
    return value(op, *args)
