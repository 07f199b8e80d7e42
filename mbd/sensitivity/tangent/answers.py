"""What a system of equations makes of the derivatives of its residuals: straight-line code for all directions at once.

An answer is linear in some inputs 'lane' k, its derivatives: nodes that these lead to are computed for every direction,
what multiplies them once, by the code of the program whose residuals they are (`programs`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.compile.llvm import Machine, cached_object, emit_object
from mbd.dataclass import dataclass
from mbd.sensitivity.tangent.printer import LANES, PIECES, ROOM, VECTOR, WIDTH
from mbd.tape.derivatives import live
from mbd.tape.node import Node

__all__ = ["Answer", "answer_of"]

SYMBOL = "mbd.answer"
WORDS = {"add": "fadd contract", "sub": "fsub contract", "mul": "fmul contract", "neg": "fneg contract"}
PLAIN = {"add": np.add, "sub": np.subtract, "mul": np.multiply, "neg": np.negative}


@dataclass(frozen=True)
class Answer:
    """Code of an answer.

    factors : what derivatives are multiplied by, computed before
    given, results, lines : derivatives that are read, those that are written in turn, and the operations between them:
        each operand is ('lane', k), ('factor', k), ('line', k) or ('number', value)
    address : ``code(factors, derivatives)``, in place; 0 where there is no machine code
    """

    factors: Sequence[Node]
    given: Sequence[int]
    lines: Sequence[tuple[str, Sequence[tuple[str, Any]]]]
    results: Sequence[tuple[str, Any]]
    address: int
    machine: Any

    def taken(self, factors: Vector, of: Matrix) -> Matrix:
        """The answer in Python."""
        known = list[Any]()

        def one(kind: str, data: Any) -> Any:
            if kind == "number":
                return data
            return of[data] if kind == "lane" else factors[data] if kind == "factor" else known[data]

        for word, operands in self.lines:
            known.append(PLAIN[word](*(one(*each) for each in operands)))
        return np.array([np.broadcast_to(one(*each), LANES) for each in self.results])


def answer_of(outputs: Sequence[Node], compiled: bool) -> Answer:
    """The code that gives these outputs."""
    known, factors = dict[int, tuple[str, Any]](), dict[int, tuple[str, Any]]()
    lines, nodes = list[tuple[str, Sequence[tuple[str, Any]]]](), list[Node]()

    def operand(node: Node) -> tuple[str, Any]:
        if node.index in known:
            return known[node.index]
        if node.is_constant:
            return "number", float(node.data)
        if node.index not in factors:
            factors[node.index] = "factor", len(nodes)
            nodes.append(node)
        return factors[node.index]

    for node in live(outputs):
        if node.op == "input" and node.data[0] == "lane":
            known[node.index] = "lane", node.data[1]
        elif any(arg.index in known for arg in node.args):
            lines.append((node.op, [operand(arg) for arg in node.args]))
            known[node.index] = "line", len(lines) - 1
    given = sorted(data for kind, data in known.values() if kind == "lane")
    results = [operand(node) for node in outputs]
    address, machine = 0, None
    if compiled:
        text = _text(given, lines, results)
        machine = Machine()
        address = machine.load(cached_object(f"answer\n{text}", lambda: emit_object(text)), [SYMBOL])[0]
    return Answer(nodes, given, lines, results, address, machine)


def _text(
    given: Sequence[int], lines: Sequence[tuple[str, Sequence[tuple[str, Any]]]], results: Sequence[tuple[str, Any]]
) -> str:
    """The code in LLVM's words: one piece of the derivatives after the other, each read whole before it is written."""
    text = list[str]()
    numbered: dict[tuple[str, Any], str] = {}

    def add(name: str, line: str) -> str:
        text.append(f"  %{name} = {line}")
        return f"%{name}"

    def splat(name: str, scalar: str) -> str:
        first = add(f"{name}.first", f"insertelement {VECTOR} poison, double {scalar}, i64 0")
        return add(name, f"shufflevector {VECTOR} {first}, {VECTOR} poison, <{WIDTH} x i32> zeroinitializer")

    def operand(kind: str, data: Any) -> str:
        if (kind, data) not in numbered:
            name = f"n{len(numbered)}"
            if kind == "number":
                numbered[kind, data] = splat(name, f"0x{np.float64(data).view(np.uint64):016X}")
            else:  # a factor
                at = add(f"{name}.at", f"getelementptr double, ptr %factors, i64 {data}")
                numbered[kind, data] = splat(name, add(f"{name}.value", f"load double, ptr {at}, align 8"))
        return numbered[kind, data]

    for k in given:
        at = add(f"lane{k}.at", f"getelementptr {ROOM}, ptr %base, i64 {k}")
        numbered["lane", k] = add(f"lane{k}", f"load {VECTOR}, ptr {at}, align 8")
    for k, (word, operands) in enumerate(lines):
        numbered["line", k] = add(f"line{k}", f"{WORDS[word]} {VECTOR} {', '.join(operand(*o) for o in operands)}")
    for k, result in enumerate(results):
        value = operand(*result)
        at = add(f"to{k}", f"getelementptr {ROOM}, ptr %base, i64 {k}")
        text.append(f"  store {VECTOR} {value}, ptr {at}, align 8")
    body = "\n".join(text)
    return f"""\
define void @{SYMBOL}(ptr noalias %factors, ptr noalias %of) {{
entry:
  br label %piece
piece:
  %i = phi i64 [ 0, %entry ], [ %next, %piece ]
  %base = getelementptr {VECTOR}, ptr %of, i64 %i
{body}
  %next = add i64 %i, 1
  %more = icmp slt i64 %next, {PIECES}
  br i1 %more, label %piece, label %end
end:
  ret void
}}
"""
