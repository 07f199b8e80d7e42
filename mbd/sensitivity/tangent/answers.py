"""Derivatives of a program from those of its inputs: straight-line code for all directions at once.

They are linear in some inputs 'lane' k, the derivatives of its inputs: nodes that these lead to are computed for every
direction, what multiplies them once, by the code of the program (`programs`). What parameters give that one direction
each changes alone, by 1, stands ready direction by direction: inputs 'ready' k. A system of equations makes its answer
of the derivatives of its residuals.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.compile.llvm import LEVEL, MAX_QUICK_LINES, cached_object, emit_object
from mbd.dataclass import dataclass
from mbd.sensitivity.tangent.printer import LANES, PIECES, ROOM, VECTOR, WIDTH
from mbd.tape.derivatives import live
from mbd.tape.node import Node

SYMBOL = "mbd.answer"
WORDS = {"add": "fadd contract", "sub": "fsub contract", "mul": "fmul contract", "neg": "fneg contract"}
PLAIN = {"add": np.add, "sub": np.subtract, "mul": np.multiply, "neg": np.negative}
Place = tuple[int, int]
"""Of an input in the block, or −1 − place of a parameter; and a second place whose derivatives are added, −1 for none:
where coordinates add, of what depends on q + x alone."""
Operand = tuple[str, Any]


@dataclass(frozen=True)
class Answer:
    """Code of an answer.

    factors : what derivatives are multiplied by, computed before; behind them stand derivatives that are ready
    lines, results : operations, and what is written behind `first` numbers without derivatives: operands are ('lane',
        k), ('ready', k), ('factor', k), ('line', k) or ('number', value)
    address : ``code(factors, derivatives of the block, of parameters, of the outputs)``; 0 where there is no code
    """

    factors: Sequence[Node]
    lines: Sequence[tuple[str, Sequence[Operand]]]
    results: Sequence[Operand]
    first: int
    address: int

    def taken(self, factors: Vector, ready: Matrix, of: Matrix) -> Matrix:
        """The answer in Python, from derivatives that are ready and those of inputs."""
        known = list[Any]()

        def one(kind: str, data: Any) -> Any:
            if kind == "number":
                return data
            return {"lane": of, "ready": ready}.get(kind, factors if kind == "factor" else known)[data]

        for word, operands in self.lines:
            known.append(PLAIN[word](*(one(*each) for each in operands)))
        out = np.zeros((self.first + len(self.results), LANES))
        for line, each in zip(out[self.first :], self.results, strict=True):
            line[:] = one(*each)
        return out


def answer_of(
    outputs: Sequence[Node], places: Sequence[Place], first: int, load: Callable[[bytes, str], int] | None
) -> Answer:
    """The code that gives these outputs.

    places : of the inputs; first : numbers before the outputs; load : of an object file, gives the address of a symbol
    """
    known, factors = dict[int, Operand](), dict[int, Operand]()
    lines, nodes = list[tuple[str, Sequence[Operand]]](), list[Node]()

    def operand(node: Node) -> Operand:
        if node.index in known:
            return known[node.index]
        if node.is_constant:
            return "number", float(node.data)
        if node.index not in factors:
            factors[node.index] = "factor", len(nodes)
            nodes.append(node)
        return factors[node.index]

    for node in live(outputs):
        if node.op == "input" and node.data[0] in ("lane", "ready"):
            known[node.index] = node.data
        elif any(arg.index in known for arg in node.args):
            lines.append((node.op, [operand(arg) for arg in node.args]))
            known[node.index] = "line", len(lines) - 1
    results, address = [operand(node) for node in outputs], 0
    if load is not None and first + len(results):
        text = _text(places, first, len(nodes), lines, results)
        symbol = f"{SYMBOL}.{hashlib.sha256(text.encode()).hexdigest()[:24]}"
        text = text.replace(f"@{SYMBOL}(", f"@{symbol}(")
        size = text.count("\n")
        level = LEVEL if size <= MAX_QUICK_LINES else 1 if size <= 4 * MAX_QUICK_LINES else 0  # what few steps call
        address = load(cached_object(f"answer\n{text}", lambda: emit_object(text, level)), symbol)
    return Answer(nodes, lines, results, first, address)


def _text(
    places: Sequence[Place], first: int, factors: int, lines: Sequence[tuple[str, Sequence[Operand]]],
    results: Sequence[Operand],
) -> str:  # fmt: skip
    """The code in LLVM's words: one piece of the derivatives after the other, each read whole before it is written."""
    text = list[str]()
    numbered: dict[Operand, str] = {}

    def add(name: str, line: str) -> str:
        text.append(f"  %{name} = {line}")
        return f"%{name}"

    def splat(name: str, scalar: str) -> str:
        first = add(f"{name}.first", f"insertelement {VECTOR} poison, double {scalar}, i64 0")
        return add(name, f"shufflevector {VECTOR} {first}, {VECTOR} poison, <{WIDTH} x i32> zeroinitializer")

    def read(name: str, place: int) -> str:
        array, number = ("block", place) if place >= 0 else ("params", -1 - place)
        at = add(f"{name}.at", f"getelementptr {ROOM}, ptr %{array}, i64 {number}")
        return add(name, f"load {VECTOR}, ptr {at}, align 8")

    def operand(kind: str, data: Any) -> str:
        if (kind, data) not in numbered:
            name = f"n{len(numbered)}"
            if kind == "number":
                numbered[kind, data] = splat(name, f"0x{np.float64(data).view(np.uint64):016X}")
            elif kind == "lane":
                place, other = places[data]
                found = read(name, place)
                if other >= 0:
                    found = add(f"{name}.both", f"fadd {VECTOR} {found}, {read(f'{name}.other', other)}")
                numbered[kind, data] = found
            elif kind == "ready":
                at = add(f"{name}.at", f"getelementptr {ROOM}, ptr %ready, i64 {data}")
                numbered[kind, data] = add(name, f"load {VECTOR}, ptr {at}, align 8")
            else:  # a factor
                at = add(f"{name}.at", f"getelementptr double, ptr %factors, i64 {data}")
                numbered[kind, data] = splat(name, add(f"{name}.value", f"load double, ptr {at}, align 8"))
        return numbered[kind, data]

    for k, (word, operands) in enumerate(lines):
        given = ", ".join([operand(*each) for each in operands])
        numbered["line", k] = add(f"line{k}", f"{WORDS[word]} {VECTOR} {given}")
    values = [operand(*each) for each in results]
    for k, value in enumerate(values):
        at = add(f"to{k}", f"getelementptr {ROOM}, ptr %out, i64 {first + k}")
        text.append(f"  store {VECTOR} {value}, ptr {at}, align 8")
    body = "\n".join(text)
    size = 8 * LANES * first
    clear = f"  call void @llvm.memset.p0.i64(ptr %of.out, i8 0, i64 {size}, i1 false)\n" if first else ""
    return f"""\
declare void @llvm.memset.p0.i64(ptr, i8, i64, i1)
define void @{SYMBOL}(ptr %factors, ptr %of.block, ptr %of.params, ptr %of.out) {{
entry:
{clear}  %behind = getelementptr double, ptr %factors, i64 {factors}
  br label %piece
piece:
  %i = phi i64 [ 0, %entry ], [ %next, %piece ]
  %block = getelementptr {VECTOR}, ptr %of.block, i64 %i
  %params = getelementptr {VECTOR}, ptr %of.params, i64 %i
  %out = getelementptr {VECTOR}, ptr %of.out, i64 %i
  %ready = getelementptr {VECTOR}, ptr %behind, i64 %i
{body}
  %next = add i64 %i, 1
  %more = icmp slt i64 %next, {PIECES}
  br i1 %more, label %piece, label %end
end:
  ret void
}}
"""
