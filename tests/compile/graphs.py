"""Random graphs of every operation, and their values worked out one node at a time."""

import ctypes
import math
import shutil
import subprocess
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from hypothesis import strategies as st

from mbd.arrays import Vector
from mbd.compile.c import c_source
from mbd.compile.host import host
from mbd.compile.ir import Module
from mbd.compile.layout import Layout
from mbd.compile.llvm import Machine, call, emit_object
from mbd.errors import TraceError
from mbd.tape.derivatives import live
from mbd.tape.node import CONDITIONS, Node, Tape
from mbd.tape.operations import value

Call = Callable[[Vector, Vector, Vector], None]

KINDS = (("t", 1), ("c", 2), ("q", 2), ("x", 2), ("v", 2), ("z", 1), ("a", 2), ("s", 1), ("lam", 1), ("anchor", 1),
         ("switch", 1), ("p", 3))  # fmt: skip

BREAKS = (-1.0, 0.0, 0.5, 2.0)
ROWS = ((0.5, 1.0, 0.0, 0.0), (1.5, -2.0, 0.25, 3.0), (1.0, 0.75, -1.5, 0.125), (0.0, -0.25, 0.0, 0.0))
RAMP = ((0.0, 3.0, 0.0, 0.0),)

LAYOUT = Layout(2, 2, 1, 1, 1, 1, 3, (3, 3 + 5 * len(BREAKS)))

UNARY = ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "abs", "sign",
         "floor")  # fmt: skip
BINARY = ("atan2", "min", "max", "pow")
STEPS = ("add", "sub", "mul", "div", "neg", *UNARY, *BINARY, "sin", "cos", "lt", "le", "and", "or", "not", "where",
         "where", "table", "table1", "table2", "table3", "ramp", "const", "mixed")  # fmt: skip

ordinary = st.floats(-4.0, 4.0).map(lambda x: round(x, 4))
special = st.sampled_from((0.0, -0.0, math.nan, math.inf, -math.inf, 1e308, -1e-310, 3e6, -1048576.0, 1e22))


@dataclass(frozen=True)
class Graph:
    """Every live operation of a random graph is an output, so that each can be checked by itself."""

    outputs: tuple[Node, ...]
    block: Vector
    parameters: Vector
    layout: Layout = LAYOUT


@st.composite
def graphs(draw: st.DrawFn, specials: bool = True, size: int = 40) -> Graph:
    """Graphs over all kinds of inputs, all operations, tables with derivatives, and nested conditions."""
    tape = Tape()
    tables = tape.table("curve", BREAKS, ROWS), tape.table("ramp", (0.25,), RAMP)
    numbers = [tape.input(kind, index) for kind, count in KINDS for index in range(count)]
    conditions = [numbers[0] < numbers[1], numbers[3] <= 0.5]
    place = st.integers(0, 1000)
    for op, i, j, k in draw(
        st.lists(st.tuples(st.sampled_from(STEPS), place, place, place), min_size=5, max_size=size)
    ):
        x, y = numbers[-1 - i % len(numbers)], numbers[-1 - j % len(numbers)]
        first, second = conditions[-1 - k % len(conditions)], conditions[-1 - j % len(conditions)]
        try:
            made = _step(tape, op, x, y, first, second, tables, i)
        except TraceError:  # an exact zero as divisor
            continue
        (conditions if made.op in CONDITIONS else numbers).append(made)
    values = special | ordinary if specials else ordinary
    block = np.array(draw(st.lists(values, min_size=LAYOUT.size, max_size=LAYOUT.size)))
    parameters = draw(st.lists(values, min_size=3, max_size=3))
    outputs = tuple(node for node in live([*numbers, *conditions]))
    return Graph(outputs, block, np.array([*parameters, *tables[0].flat, *tables[1].flat]))


def _step(tape: Tape, op: str, x: Node, y: Node, first: Node, second: Node, tables: Sequence, number: int) -> Node:
    if op in ("add", "sub", "mul", "div"):
        return getattr(tape, op)(x, y)
    if op == "neg":
        return -x
    if op in UNARY:
        return tape.unary(op, x)
    if op in BINARY or op in ("lt", "le"):
        return tape.binary(op, x, y)
    if op in ("and", "or"):
        return tape.binary(op, first, second)
    if op == "not":
        return ~first
    if op == "where":
        return tape.where(first, x, y)
    if op.startswith("table"):
        return tape.lookup(tables[0], x, int(op[5:] or 0))
    if op == "ramp":
        return tape.lookup(tables[1], x)
    if op == "mixed":  # a condition used as a number
        return x * first
    return tape.constant((0.5, -3.0, 1e-3, 7.25, math.pi, math.inf)[number % 6])


def inputs_of(graph: Graph, rows: int = 1) -> dict[str, np.ndarray]:
    """The block as arrays by kind, the same in every row."""
    layout = graph.layout
    return {
        kind: np.tile([graph.block[layout.place(kind, index)] for index in range(count)], (rows, 1))
        for kind, count in KINDS
        if kind != "p"
    }


def run(function: Call, graph: Graph, size: int | None = None) -> Vector:
    """The outputs that a function writes, and nothing beyond them."""
    size = len(graph.outputs) if size is None else size
    out = np.full(size + 1, 12345.0)
    function(graph.block, graph.parameters, out)
    assert out[size] == 12345.0
    return out[:size]


def close(x: float, y: float, ulps: float, scale: float = 0.0) -> bool:
    """Whether two numbers agree to a few units in the last place (of `scale`, if that is larger)."""
    if math.isnan(x) or math.isnan(y):
        return math.isnan(x) and math.isnan(y)
    if math.isinf(x) or math.isinf(y):
        return x == y
    return abs(x - y) <= ulps * max(math.ulp(x), math.ulp(y), math.ulp(scale))


def against(graph: Graph, results: Sequence[float], ulps: float = 2.0) -> None:
    """Check every node against its operation on the values that the same results give its arguments."""
    found = {node.index: float(result) for node, result in zip(graph.outputs, results, strict=True)}
    for node in graph.outputs:
        result, args = found[node.index], [found[arg.index] for arg in node.args]
        scale = 0.0
        if node.op == "const":
            expected = node.data
        elif node.op == "input":
            kind, index = node.data
            expected = graph.parameters[index] if kind == "p" else graph.block[graph.layout.place(kind, index)]
        elif node.op == "table":
            (table, order), x = node.data, args[0]
            if math.isinf(x) or abs(x) > 1e60:  # inf − inf depends on the order of summation
                continue
            expected = table.value(x, order)
            scale = 100.0 * max(1.0, abs(x)) ** (3 - order)
        else:
            expected = value(node.op, *args)
        if node.op in CONDITIONS:
            assert result == float(bool(expected)), (node.op, args, result)
        else:
            assert close(result, float(expected), ulps, scale), (node.op, args, result, expected)


def by_llvm(
    programs: Mapping[str, Sequence[Node]], layout: Layout = LAYOUT, level: int = 1, **options: int
) -> dict[str, Call]:
    """Machine code without any cache."""
    text = Module(programs, layout, **{"fused": host().fused} | options).text()
    machine = Machine()
    addresses = machine.load(emit_object(text, level), [f"mbd.{name}" for name in programs])

    def keeping(address: int) -> Call:
        function = call(address)
        return lambda block, parameters, out: (function(block, parameters, out), machine)[0]

    return {name: keeping(address) for name, address in zip(programs, addresses, strict=True)}


COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")


def by_c(
    programs: Mapping[str, Sequence[Node]], folder: Path, layout: Layout = LAYOUT, **options: int
) -> dict[str, Call]:
    """C text, compiled by the system's C compiler."""
    assert COMPILER is not None
    (folder / "graph.c").write_text(c_source(programs, layout, **options))
    flags = ["-std=c99", "-O1", "-ffp-contract=off", "-Wall", "-Werror", "-Wno-unused", "-shared", "-fPIC"]
    subprocess.run([COMPILER, *flags, "graph.c", "-o", "graph.so", "-lm"], cwd=folder, check=True, timeout=300)
    library = ctypes.CDLL(str(folder / "graph.so"))
    return {name: call(ctypes.cast(getattr(library, f"mbd_{name}"), ctypes.c_void_p).value or 0) for name in programs}
