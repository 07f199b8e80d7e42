"""How large the terms of an expression are before they cancel, which bounds its round-off."""

from collections.abc import Iterable, Mapping, Sequence
from math import perm

from mbd.tape.derivatives import live
from mbd.tape.functions import maximum, minimum, sqrt, where
from mbd.tape.node import Node, Scalar, Tape

MAX_SUM_RATIO = 16.0
"""How far the sum of the terms of a force may lie above the root of their squares, and in iterations that above the
largest of them: as far as those of 256 equal ones do."""
MIN_SINE = 0.1
"""Share of its amplitude that a sine has at least: round-off of its argument when it vanishes."""


def of_directions(values: Iterable[Scalar]) -> dict[int, float]:
    """What is known of components of unit vectors, by the numbers of their nodes: the largest that each can be.

    Where one is a multiple of another node, as ``R₁₂ = 2 (x y − w z)`` is, that is known of the other one too: a factor
    is drawn into the multiple.
    """
    known: dict[int, float] = {}
    for value in values:
        if not isinstance(value, Node) or not value.args:
            continue
        node = value.args[0] if value.op == "neg" else value
        known[node.index] = 1.0
        if node.op == "mul" and node.args[0].is_constant:
            known[node.args[1].index] = abs(1.0 / node.args[0].data)
    return known


def magnitudes(tape: Tape, outputs: Sequence[Node], known: Mapping[int, float] | None = None) -> list[Node]:
    """Σ|terms| through sums and products, bounded by their root of squares, in iterations by the largest of them.

    Where a vector is turned, Σ|terms| of its components is up to √2 times as long as the vector, and in recursions up
    and down a chain of n links this grows like 2ⁿ: beyond some twenty links every residual would pass for round-off.
    The root of the squares of terms is as long as the vector however often it is turned, as round-off is.

    So it is with sines, whose terms are not looked at. Elements of a rotation made from a quaternion are sums of
    products themselves, by whose terms a vector would grow by a half or more with each turn: 1000 times in a chain of
    three ball joints.

    Sum and squares multiply the terms of factors, so that in iterations each step raises the terms of the one before to
    powers, though it corrects them: ten steps of Newton's method in a user's force counted 10³⁰⁰ times its size. The
    largest term has the factors that lead to it, to first order, which is what its round-off is multiplied by.

    Parameters
    ----------
    known : the amplitudes of nodes that count as sines do, by their numbers (see `of_directions`)
    """
    bounds = known or {}
    sums, squares, largest = (each(tape, outputs, bounds) for each in (_sums, _squares, _largest))
    found = zip(sums, squares, largest, strict=True)
    bounded = [(minimum(s, MAX_SUM_RATIO * sqrt(q)), m) for s, q, m in found]
    # beyond that the terms are those of an iteration
    return [where(s > 2.0**36 * m, MAX_SUM_RATIO * MAX_SUM_RATIO * m, s) for s, m in bounded]


def _sums(tape: Tape, outputs: Sequence[Node], known: Mapping[int, float]) -> list[Node]:
    """|x| through sums and products: Σ|terms| where terms are added, |x| of everything else.

    Sines and tables that happen to vanish keep the round-off of their argument and of their coefficients: they count
    with their amplitude.
    """
    size: dict[int, Node] = {}
    for node in live(outputs):
        parts = [size[arg.index] for arg in node.args]
        if node.index in known:
            size[node.index] = tape.constant(known[node.index])
        elif node.op in ("add", "sub"):
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


def _squares(tape: Tape, outputs: Sequence[Node], known: Mapping[int, float]) -> list[Node]:
    """Σ terms² through sums and products, at least x²; sines have at least `MIN_SINE` of their amplitude."""
    size: dict[int, Node] = {}
    for node in live(outputs):
        parts = [size[arg.index] for arg in node.args]
        if node.index in known:
            size[node.index] = node * node + (MIN_SINE * known[node.index]) ** 2
        elif node.op in ("add", "sub"):
            size[node.index] = maximum(parts[0] + parts[1], node * node)
        elif node.op in ("mul", "div"):
            by = parts[1] if node.op == "mul" else node.args[1] * node.args[1]
            size[node.index] = parts[0] * by if node.op == "mul" else parts[0] / by
        elif node.op in ("sin", "cos", "tanh"):
            size[node.index] = node * node + MIN_SINE**2
        elif node.op == "table":
            size[node.index] = node * node + _amplitude(node) ** 2
        else:
            size[node.index] = parts[0] if node.op == "neg" else node * node
    return [size[node.index] for node in outputs]


def _largest(tape: Tape, outputs: Sequence[Node], known: Mapping[int, float]) -> list[Node]:
    """The largest term times the factors on its way to the output, max |∂output/∂term · term| over terms and ways."""
    size: dict[int, Node] = {}
    for node in live(outputs):
        parts = [size[arg.index] for arg in node.args]
        if node.index in known:
            size[node.index] = tape.constant(known[node.index])
        elif node.op in ("add", "sub"):
            size[node.index] = maximum(parts[0], parts[1])
        elif node.op == "mul":
            size[node.index] = maximum(parts[0] * abs(node.args[1]), parts[1] * abs(node.args[0]))
        elif node.op == "div":
            size[node.index] = maximum(parts[0], parts[1] * abs(node)) / abs(node.args[1])
        elif node.op in ("sin", "cos", "tanh"):
            size[node.index] = tape.one
        elif node.op == "table":
            size[node.index] = abs(node) + _amplitude(node)
        else:
            size[node.index] = parts[0] if node.op == "neg" else abs(node)
    return [size[node.index] for node in outputs]


def _amplitude(node: Node) -> float:
    """The largest coefficient of the derivative that a table gives."""
    table, order = node.data
    return float(perm(order, order) * max(abs(row[order]) for row in table.coefficients))
