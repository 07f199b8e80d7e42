"""Plain evaluation of tape expressions, node by node: simple, and never raising on numbers."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbd.errors import UnknownNameError, nearest
from mbd.tape.derivatives import live
from mbd.tape.node import Node
from mbd.tape.operations import CONDITIONS, value
from mbd.tape.printing import input_name

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


def evaluate_arrays(output: Node, inputs: Mapping[Key, ArrayLike]) -> NDArray[np.float64]:
    """One output for arrays of inputs, which are broadcast together; the numbers are those of `evaluate`."""
    given = {key: np.asarray(numbers, dtype=np.float64) for key, numbers in inputs.items()}
    found: dict[int, Any] = {}
    with np.errstate(all="ignore"):
        for node in live([output]):
            args = [found[arg.index] for arg in node.args]
            if node.op == "const":
                found[node.index] = float(node.data)
            elif node.op == "input":
                found[node.index] = given[node.data]
            elif node.op == "table":
                table, order = node.data
                found[node.index] = np.vectorize(table.value, otypes=[np.float64])(args[0], order)
            else:
                found[node.index] = _apply(node.op, args)
    shape = np.broadcast_shapes(*(numbers.shape for numbers in given.values()))
    return np.array(np.broadcast_to(found[output.index], shape), dtype=np.float64)


_CHOICES: dict[str, Any] = {"where": np.where, "not": np.logical_not, "and": np.logical_and, "or": np.logical_or}
_NUMPY: dict[str, Any] = {
    "div": np.divide, "pow": np.power, "min": np.minimum, "max": np.maximum, "lt": np.less, "le": np.less_equal,
    "add": np.add, "sub": np.subtract, "mul": np.multiply, "neg": np.negative, "atan2": np.arctan2,
    "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan,
}  # fmt: skip
"""Operations that numpy calls by other names than the tape."""


def _apply(op: str, args: Sequence[Any]) -> Any:
    if op in _CHOICES:
        truths = args if op in CONDITIONS else args[:1]
        return _CHOICES[op](*(np.asarray(truth, dtype=bool) for truth in truths), *args[len(truths) :])
    function: Any = _NUMPY[op] if op in _NUMPY else getattr(np, op)
    return function(*args)
