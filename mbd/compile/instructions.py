"""Instructions of LLVM IR for the operations of a tape, one after the other.

A number lives in `Body.names` as an SSA value and a condition in `Body.flags`; each is made from the other when it is
first asked for.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import count

from mbd.compile.layout import Layout
from mbd.compile.trigonometry import WIDTHS, constant
from mbd.tape.node import CONDITIONS, Node, Table

__all__ = ["MANY_ZEROS", "Angles", "Body"]

MANY_ZEROS = 12
"""Zeros side by side from which on a loop writes them: large matrices consist of little else."""

ARITHMETIC = {"add": "fadd double", "sub": "fsub double", "mul": "fmul double", "div": "fdiv double"}

PERMUTATIONS = ((1.0,), (1.0, 1.0), (1.0, 2.0, 2.0), (1.0, 3.0, 6.0, 6.0))
"""k!/(k − d)!, the factor of s^(k−d) in the d-th derivative of s^k."""

Angles = tuple[tuple[Node, Node | None, Node | None], ...]
"""Up to four arguments, each with the sine and the cosine that are asked of it."""


def _runs(places: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Ascending places as runs (first, how many)."""
    first, number = places[0], 0
    for place in places:
        if place != first + number:
            yield first, number
            first, number = place, 0
        number += 1
    yield first, number


class Body:
    """Writes the instructions of one function, or of one part of it."""

    def __init__(
        self, places: dict[int, list[int]], layout: Layout, slots: dict[int, int], lines: list[str], needs: set[str]
    ) -> None:
        self.layout, self.slots, self.needs = layout, slots, needs
        self.append = lines.append
        self.names: dict[int, str] = {}
        self.flags: dict[int, str] = {}
        self.pieces: dict[tuple[int, int], tuple[str, str]] = {}
        self.places = places
        self.new = count().__next__

    def operations(self, nodes: Iterable[Node]) -> None:
        names, slots, places, append, new = self.names, self.slots, self.places, self.append, self.new
        for node in nodes:
            code = ARITHMETIC.get(node.op)
            index = node.index
            if code is not None:
                a, b = node.args
                x = names.get(a.index) or self.number(a)
                y = names.get(b.index) or self.number(b)
                names[index] = name = f"%{new()}"
                append(f"{name} = {code} {x}, {y}")
            elif node.op in CONDITIONS:
                self.flags[index] = self.condition(node)
            else:
                names[index] = self.function(node)
            if index in places or index in slots:
                self.keep(node)

    def do(self, instruction: str) -> str:
        name = f"%{self.new()}"
        self.append(f"{name} = {instruction}")
        return name

    def number(self, node: Node) -> str:
        """The value of a node as a double."""
        name = self.names.get(node.index)
        if name is None:
            if node.op == "const":
                name = constant(node.data)
            elif node.index in self.flags:
                name = self.do(f"uitofp i1 {self.flags[node.index]} to double")
            elif node.op == "input":
                kind, index = node.data
                name = (
                    self.load("parameters", index)
                    if kind == "p"
                    else self.load("block", self.layout.place(kind, index))
                )
            else:
                name = self.load("work", self.slots[node.index])
            self.names[node.index] = name
        return name

    def flag(self, node: Node) -> str:
        """The value of a node as a condition."""
        name = self.flags.get(node.index)
        if name is None:
            name = self.flags[node.index] = self.do(f"fcmp une double {self.number(node)}, {constant(0.0)}")
        return name

    def load(self, array: str, offset: int) -> str:
        return self.do(f"load double, ptr {self.do(f'getelementptr double, ptr %{array}, i64 {offset}')}")

    def store(self, name: str, array: str, offset: int) -> None:
        address = self.do(f"getelementptr double, ptr %{array}, i64 {offset}")
        self.append(f"store double {name}, ptr {address}")

    def keep(self, node: Node) -> None:
        """Store a value where the caller, or a later part, finds it."""
        for place in self.places.pop(node.index, ()):
            self.store(self.number(node), "out", place)
        if node.index in self.slots:
            self.store(self.number(node), "work", self.slots[node.index])

    def rest(self, outputs: Sequence[Node]) -> None:
        """Outputs that are inputs or constants."""
        for node in outputs:
            if node.args or node.index not in self.places:
                continue
            for first, number in _runs(self.places.pop(node.index)):
                if number >= MANY_ZEROS and self.number(node) == constant(0.0):
                    self.needs.add("zeros")
                    start = self.do(f"getelementptr double, ptr %out, i64 {first}")
                    self.append(f"call void @mbd.zeros(ptr {start}, i64 {number})")
                    continue
                for place in range(first, first + number):
                    self.store(self.number(node), "out", place)

    def condition(self, node: Node) -> str:
        op, args = node.op, node.args
        if op == "lt" or op == "le":
            return self.do(f"fcmp o{op} double {self.number(args[0])}, {self.number(args[1])}")
        if op == "not":
            return self.do(f"xor i1 {self.flag(args[0])}, true")
        return self.do(f"{op} i1 {self.flag(args[0])}, {self.flag(args[1])}")

    def function(self, node: Node) -> str:
        """Every operation on numbers besides + − × ÷."""
        op, args = node.op, node.args
        if op == "where":
            flag, yes, no = self.flag(args[0]), self.number(args[1]), self.number(args[2])
            return self.do(f"select i1 {flag}, double {yes}, double {no}")
        if op == "table":
            return self.table(node)
        x = self.number(args[0])
        if op == "neg":
            return self.do(f"fneg double {x}")
        if op == "sqrt" or op == "abs":
            name = f"llvm.{'fabs' if op == 'abs' else op}.f64"
            self.needs.add(f"declare double @{name}(double)")
            return self.do(f"call double @{name}(double {x})")
        if op == "floor":
            self.needs.add("declare double @llvm.floor.f64(double)")
            whole = self.do(f"call double @llvm.floor.f64(double {x})")
            return self.do(f"fadd double {whole}, {constant(0.0)}")  # 0 for −0
        if op == "sign":
            zero, above, below = constant(0.0), constant(1.0), constant(-1.0)
            other = self.do(f"fadd double {x}, {zero}")  # 0 for ±0, and NaN stays
            negative, positive = self.do(f"fcmp olt double {x}, {zero}"), self.do(f"fcmp ogt double {x}, {zero}")
            other = self.do(f"select i1 {negative}, double {below}, double {other}")
            return self.do(f"select i1 {positive}, double {above}, double {other}")
        if len(args) == 1:
            self.needs.add(f"declare double @{op}(double)")
            return self.do(f"call double @{op}(double {x}) #2")
        y = self.number(args[1])
        if op == "min" or op == "max":
            first = self.do(f"fcmp {'olt' if op == 'min' else 'ogt'} double {x}, {y}")
            nan = self.do(f"fcmp uno double {x}, {x}")
            return self.do(f"select i1 {self.do(f'or i1 {first}, {nan}')}, double {x}, double {y}")
        self.needs.add(f"declare double @{op}(double, double)")
        return self.do(f"call double @{op}(double {x}, double {y}) #2")

    def table(self, node: Node) -> str:
        """A derivative of a piecewise cubic; the piece is searched once for each argument."""
        table: Table
        table, order = node.data
        argument, n, start = node.args[0], len(table.breaks), self.layout.table_offsets[table.index]
        found = self.pieces.get((table.index, argument.index))
        if found is None:
            self.needs.add("piece")
            x = self.number(argument)
            breaks = self.do(f"getelementptr double, ptr %parameters, i64 {start}")
            piece = self.do(f"call i64 @mbd.piece(ptr {breaks}, i64 {n}, double {x})")
            left = self.do(f"load double, ptr {self.do(f'getelementptr double, ptr {breaks}, i64 {piece}')}")
            row = self.do(f"add i64 {self.do(f'shl i64 {piece}, 2')}, {start + n}")
            found = self.do(f"getelementptr double, ptr %parameters, i64 {row}"), self.do(f"fsub double {x}, {left}")
            self.pieces[table.index, argument.index] = found
        row, s = found
        value = constant(0.0) if order == 3 else ""  # so that a NaN comes out again
        for power in range(3, order - 1, -1):
            c = self.do(f"load double, ptr {self.do(f'getelementptr double, ptr {row}, i64 {power}')}")
            factor = PERMUTATIONS[power][order]
            if factor != 1.0:
                c = self.do(f"fmul double {constant(factor)}, {c}")
            value = self.do(f"fadd double {self.do(f'fmul double {value}, {s}')}, {c}") if value else c
        return value

    def angles(self, angles: Angles) -> None:
        """Sines and cosines of up to four angles in one call."""
        if not angles:
            return
        width = next(w for w in WIDTHS if w >= len(angles))
        self.needs.add(f"sincos{width}")
        real = f"<{width} x double>" if width > 1 else "double"
        packed = "zeroinitializer"
        for lane, (argument, _, _) in enumerate(angles):
            x = self.number(argument)
            packed = self.do(f"insertelement {real} {packed}, double {x}, i64 {lane}") if width > 1 else x
        both = self.do(f"call fastcc {{ {real}, {real} }} @mbd.sincos{width}({real} {packed})")
        for half in range(2):
            if all(values[half] is None for _, *values in angles):
                continue
            vector = self.do(f"extractvalue {{ {real}, {real} }} {both}, {half}")
            for lane, (_, *values) in enumerate(angles):
                node = values[half]
                if node is not None:
                    self.names[node.index] = (
                        self.do(f"extractelement {real} {vector}, i64 {lane}") if width > 1 else vector
                    )
                    if node.index in self.places or node.index in self.slots:
                        self.keep(node)
