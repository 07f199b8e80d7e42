"""How many operations an expression costs."""

from collections import Counter
from collections.abc import Iterable

from mbd.tape.derivatives import live
from mbd.tape.node import Node


def operations(outputs: Iterable[Node]) -> dict[str, int]:
    """Number of operations of each kind that the outputs need, shared ones once; inputs and constants are free.

    >>> from mbd.tape.node import Tape
    >>> tape = Tape()
    >>> x = tape.input("q", 0)
    >>> operations([tape.unary("sin", x) * x, tape.unary("sin", x) + 0.0 * x])
    {'mul': 1, 'sin': 1}
    """
    counted = Counter(node.op for node in live(outputs) if node.args)
    return dict(sorted(counted.items()))


def total(outputs: Iterable[Node]) -> int:
    """Number of operations that the outputs need."""
    return sum(operations(outputs).values())
