"""Random expressions, recorded on a tape and evaluated beside it with 60 digits."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath
from hypothesis import strategies as st

from mbd.tape.derivatives import live
from mbd.tape.node import Node, Tape

mp = mpmath.MPContext()
mp.dps = 60

Number = Any  # mpf

FUNCTIONS: dict[str, Callable[..., Number]] = {
    "add": lambda x, y: x + y, "sub": lambda x, y: x - y, "mul": lambda x, y: x * y, "div": lambda x, y: x / y,
    "neg": lambda x: -x, "where": lambda c, x, y: x if c else y, "pow": lambda x, y: x**y,
    "sqrt": mp.sqrt, "sin": mp.sin, "cos": mp.cos, "tan": mp.tan, "asin": mp.asin, "acos": mp.acos, "atan": mp.atan,
    "sinh": mp.sinh, "cosh": mp.cosh, "tanh": mp.tanh, "exp": mp.exp, "log": mp.log, "abs": abs, "sign": mp.sign,
    "floor": mp.floor, "atan2": mp.atan2, "min": min, "max": max, "lt": lambda x, y: x < y, "le": lambda x, y: x <= y,
    "and": lambda x, y: x and y, "or": lambda x, y: x or y, "not": lambda x: not x,
}  # fmt: skip

CONSTANTS = (0.0, 1.0, -1.0, 2.0, -2.0, 0.5, -0.5, 4.0)
"""Powers of two, so that folding their products and quotients makes no round-off."""

KINKED = ("min", "max", "abs", "sign", "where", "atan2")
OPS = (*("add", "sub", "mul", "div") * 4, "neg", "neg", *sorted(set(FUNCTIONS) - {"lt", "le", "and", "or", "not"}))


@dataclass(frozen=True)
class Graph:
    """The recorded nodes, their values as computed beside the tape, and where they were computed."""

    tape: Tape
    inputs: list[Node]
    nodes: list[Node]
    values: list[Number]
    point: dict[Node, Number]


Program = tuple[list[tuple[str, int, int, int]], list[float]]

programs: st.SearchStrategy[Program] = st.tuples(
    st.lists(st.tuples(st.sampled_from(OPS), *[st.integers(0, 30)] * 3), min_size=3, max_size=25),
    st.lists(st.floats(-3.0, 3.0).map(lambda x: round(x, 3)), min_size=3, max_size=3),
)
"""Lists of operations on earlier results, and a point."""


def build(program: Program, tape: Tape | None = None) -> Graph:
    """Record a program; steps that are undefined, huge or on a kink at its point are left out."""
    steps, point = program
    tape = Tape() if tape is None else tape
    inputs = [tape.input("q", k) for k in range(3)]
    nodes: list[Node] = [*inputs, *(tape.constant(c) for c in CONSTANTS)]
    values: list[Number] = [mp.mpf(x) for x in (*point, *CONSTANTS)]
    for op, i, j, k in steps:
        places = [place % len(nodes) for place in (i, j, k)]
        if not _step(tape, op, places, nodes, values):
            continue
        if nodes[-1].op == "const":  # folded in double precision
            folded, value = nodes[-1].data, values[-1]
            assert abs(folded - value) <= 1e-14 * (1 + abs(value))
            if folded != value or math.frexp(folded)[0] not in (0.0, 0.5, -0.5):
                nodes.pop(), values.pop()
    return Graph(tape, inputs, nodes, values, dict(zip(inputs, values[:3], strict=True)))


def _step(tape: Tape, op: str, places: Sequence[int], nodes: list[Node], values: list[Number]) -> bool:
    a, b, c = (nodes[place] for place in places)
    x, y, z = (values[place] for place in places)
    far = abs(x - y) > 1e-6 and abs(x) > 1e-6
    small = abs(y) > 1e-6 and (op != "pow" or (x > 0 and abs(y) < 8))
    if (op in KINKED and not far) or (op in ("div", "pow", "atan2") and not small):
        return False
    if op == "where":
        value, record = (y if x < y else z), lambda: tape.where(a < b, b, c)
    elif op in ("add", "sub", "mul", "div"):
        value, record = FUNCTIONS[op](x, y), lambda: getattr(tape, op)(a, b)
    elif op == "neg":
        value, record = -x, lambda: tape.neg(a)
    elif op == "pow":
        value, record = x**y, lambda: tape.power(a, b)
    elif op in ("atan2", "min", "max"):
        value, record = FUNCTIONS[op](x, y), lambda: tape.binary(op, a, b)
    else:
        if (op in ("sqrt", "log") and x < 1e-3) or (op in ("asin", "acos") and abs(x) > 0.99):
            return False
        if abs(x) > 20 or (op == "tan" and abs(mp.cos(x)) < 1e-2):
            return False
        value, record = FUNCTIONS[op](x), lambda: tape.unary(op, a)
    if op == "floor" and abs(x - mp.nint(x)) < 1e-6:
        return False
    if abs(value) > 1e5 or (value and abs(value) < 1e-5):
        return False
    nodes.append(record())
    values.append(value)
    return True


def exact(outputs: Sequence[Node], inputs: Mapping[Node, Number]) -> list[Number]:
    """The outputs with 60 digits."""
    found: dict[int, Number] = {node.index: value for node, value in inputs.items()}
    for node in live(outputs):
        if node.index in found:
            continue
        if node.op == "const":
            found[node.index] = mp.mpf(node.data)
        else:
            found[node.index] = FUNCTIONS[node.op](*(found[arg.index] for arg in node.args))
    return [found[node.index] for node in outputs]
