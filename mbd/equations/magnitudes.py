"""How large the terms of an expression are before they cancel, which bounds its round-off."""

from __future__ import annotations

from collections.abc import Sequence
from math import perm

from mbd.tape.derivatives import live
from mbd.tape.functions import maximum, minimum, sqrt
from mbd.tape.node import Node, Tape

__all__ = ["magnitudes"]

SPREAD = 16.0
"""How far the sum of the terms of a force may lie above the root of their squares: as far as 256 equal ones do."""
VANISHED = 0.1
"""Share of its amplitude that a sine has at least: round-off of its argument when it vanishes."""


def magnitudes(tape: Tape, outputs: Sequence[Node]) -> list[Node]:
    """Σ|terms| through sums and products, bounded by `SPREAD` times their root of squares.

    Where a vector is turned, Σ|terms| of its components is up to √2 times as long as the vector, and in recursions up
    and down a chain of n links this grows like 2ⁿ: beyond some twenty links every residual would pass for round-off.
    The root of the squares of terms is as long as the vector however often it is turned, as round-off is.
    """
    sums, squares = _sums(tape, outputs), _squares(tape, outputs)
    return [minimum(s, SPREAD * sqrt(q)) for s, q in zip(sums, squares, strict=True)]


def _sums(tape: Tape, outputs: Sequence[Node]) -> list[Node]:
    """|x| through sums and products: Σ|terms| where terms are added, |x| of everything else.

    Sines and tables that happen to vanish keep the round-off of their argument and of their coefficients: they count
    with their amplitude.
    """
    size: dict[int, Node] = {}
    for node in live(outputs):
        parts = [size[arg.index] for arg in node.args]
        if node.op in ("add", "sub"):
            size[node.index] = parts[0] + parts[1]
        elif node.op in ("mul", "div"):
            size[node.index] = parts[0] * parts[1] if node.op == "mul" else parts[0] / abs(node.args[1])
        elif node.op in ("sin", "cos", "tanh"):
            size[node.index] = tape.one
        elif node.op == "table":
            size[node.index] = abs(node) + _amplitude(node)
        else:
            size[node.index] = parts[0] if node.op == "neg" else abs(node)
    return [size[node.index] for node in outputs]


def _squares(tape: Tape, outputs: Sequence[Node]) -> list[Node]:
    """Σ terms² through sums and products, at least x²; sines have at least `VANISHED` of their amplitude."""
    size: dict[int, Node] = {}
    for node in live(outputs):
        parts = [size[arg.index] for arg in node.args]
        if node.op in ("add", "sub"):
            size[node.index] = maximum(parts[0] + parts[1], node * node)
        elif node.op in ("mul", "div"):
            by = parts[1] if node.op == "mul" else node.args[1] * node.args[1]
            size[node.index] = parts[0] * by if node.op == "mul" else parts[0] / by
        elif node.op in ("sin", "cos", "tanh"):
            size[node.index] = node * node + VANISHED**2
        elif node.op == "table":
            size[node.index] = node * node + _amplitude(node) ** 2
        else:
            size[node.index] = parts[0] if node.op == "neg" else node * node
    return [size[node.index] for node in outputs]


def _amplitude(node: Node) -> float:
    """The largest coefficient of the derivative that a table gives."""
    table, order = node.data
    return float(perm(order, order) * max(abs(row[order]) for row in table.coefficients))
