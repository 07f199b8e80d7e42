"""One assignment per operation: what the writers of Python and of C have in common."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from mbd.compile.layout import Layout
from mbd.tape.derivatives import live
from mbd.tape.node import CONDITIONS, Node

__all__ = ["Dialect", "arguments", "cubic", "statements"]


@dataclass(frozen=True)
class Dialect:
    """How a language writes things; all texts are templates for `str.format`.

    operations : expression of each operation; one that is missing is a function of one argument, so named
    literal : text of a constant
    number, condition : assignment of a number and of a condition, from name and expression
    block, parameter : the input at an offset
    piece : assignments that find piece ``k{k}`` of a table for argument ``{x}``, with local abscissa ``s{k}`` and
        coefficients ``c{k}``; the table has ``{n}`` breaks at offset ``{start}`` of the parameters, rows at ``{rows}``
    """

    operations: Mapping[str, str]
    literal: Callable[[float], str]
    number: str
    condition: str
    block: str
    parameter: str
    piece: tuple[str, ...]


def cubic(row: str, s: str, order: int) -> str:
    """The order-th derivative of ``Σ_k row_k s^k`` (Horner); `row` is a template of the power."""
    text = "0.0" if order == 3 else ""  # so that a NaN comes out again
    for power in range(3, order - 1, -1):
        factor = math.perm(power, order)
        c = row.format(power) if factor == 1 else f"{factor}.0 * {row.format(power)}"
        text = f"({text}) * {s} + {c}" if text else c
    return text


def arguments(node: Node, name: Callable[[Node], str], as_number: str = "{}") -> list[str]:
    """Texts of a node's arguments, numbers turned into conditions and back where the operation wants the other."""
    conditions = 1 if node.op == "where" else len(node.args) if node.op in ("and", "or", "not") else 0
    texts = []
    for k, arg in enumerate(node.args):
        text = name(arg)
        if k < conditions and arg.op not in CONDITIONS:
            text = f"({text} != 0.0)"
        elif k >= conditions and arg.op in CONDITIONS:
            text = as_number.format(text)
        texts.append(text)
    return texts


def statements(outputs: Sequence[Node], layout: Layout, dialect: Dialect) -> tuple[list[str], list[str]]:
    """Assignments for all live operations, in the order of the tape, and the names of the outputs."""
    names: dict[int, str] = {}
    pieces: dict[tuple[int, int], int] = {}
    lines: list[str] = []

    def name(node: Node) -> str:
        text = names.get(node.index)
        if text is None:  # a constant, or an input that is asked for the first time
            if node.op == "const":
                text = dialect.literal(node.data)
            else:
                kind, index = node.data
                parameter = kind == "p"
                source = (
                    dialect.parameter.format(index) if parameter else dialect.block.format(layout.place(kind, index))
                )
                text = f"v{node.index}"
                lines.append(dialect.number.format(text, source))
            names[node.index] = text
        return text

    for node in live(outputs):
        if not node.args:
            continue
        if node.op == "table":
            table, order = node.data
            start, n, x = layout.table_offsets[table.index], len(table.breaks), name(node.args[0])
            k = pieces.get((table.index, node.args[0].index))
            if k is None:
                k = pieces[table.index, node.args[0].index] = len(pieces)
                lines += (line.format(k=k, x=x, n=n, start=start, rows=start + n) for line in dialect.piece)
            text = cubic(f"c{k}[{{}}]", f"s{k}", order)
        else:
            text = dialect.operations.get(node.op, f"{node.op}({{}})").format(*arguments(node, name))
        template = dialect.condition if node.op in CONDITIONS else dialect.number
        lines.append(template.format(f"v{node.index}", text))
        names[node.index] = f"v{node.index}"
    return lines, [name(node) for node in outputs]
