"""Tape outputs → LLVM IR text: straight-line code, inputs loaded once, nothing reordered or contracted.

Every function is ``void @mbd.<name>(ptr block, ptr parameters, ptr out)``. Sines and cosines come first, four at a
time (see `trigonometry`), because a call empties all registers. A function above `LARGE` operations is cut into
parts of about `PART`, which hand values on through an array on the stack: allocating registers costs more than
linear time (16 000 operations: 0.8 s in one piece, 0.3 s in parts, which run 2 % slower).

Inside a function a number lives in `names` as an SSA value and a condition in `flags`; each is made from the other
when it is first asked for.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import count

from mbd.compile.layout import Layout
from mbd.compile.trigonometry import WIDTHS, constant, sincos
from mbd.tape.derivatives import live
from mbd.tape.node import CONDITIONS, Node, Table

__all__ = ["LARGE", "LIBRARY", "MANY_ZEROS", "PART", "module"]

LARGE = 2500
"""Operations above which a function is cut into parts."""

PART = 250
"""Operations of a part."""

LIBRARY = ("acos", "asin", "atan", "atan2", "cos", "cosh", "exp", "fmod", "log", "pow", "sin", "sinh", "tan", "tanh")
"""Functions of the C library that the code may call, by their C names."""

ARITHMETIC = {"add": "fadd double", "sub": "fsub double", "mul": "fmul double", "div": "fdiv double"}

ARGUMENTS = "ptr noalias readonly %block, ptr noalias readonly %parameters, ptr noalias %out"

PIECE = """\
define internal i64 @mbd.piece(ptr readonly %breaks, i64 %n, double %x) #1 {
entry:
br label %test
test:
%low = phi i64 [ 0, %entry ], [ %next, %halve ]
%size = phi i64 [ %n, %entry ], [ %rest, %halve ]
%more = icmp ugt i64 %size, 1
br i1 %more, label %halve, label %done
halve:
%half = lshr i64 %size, 1
%middle = add i64 %low, %half
%address = getelementptr double, ptr %breaks, i64 %middle
%break = load double, ptr %address
%left = fcmp olt double %x, %break
%next = select i1 %left, i64 %low, i64 %middle
%rest = sub i64 %size, %half
br label %test
done:
ret i64 %low
}"""
"""The last piece of a table that begins at or before x, or the first one."""

ZEROS = """\
define internal void @mbd.zeros(ptr %to, i64 %n) #1 {
entry:
br label %test
test:
%k = phi i64 [ 0, %entry ], [ %next, %four ]
%next = add i64 %k, 4
%whole = icmp ule i64 %next, %n
br i1 %whole, label %four, label %rest
four:
%from = getelementptr double, ptr %to, i64 %k
store <4 x double> zeroinitializer, ptr %from, align 8
br label %test
rest:
%last = phi i64 [ %k, %test ], [ %after, %one ]
%more = icmp ult i64 %last, %n
br i1 %more, label %one, label %done
one:
%place = getelementptr double, ptr %to, i64 %last
store double 0.0, ptr %place
%after = add i64 %last, 1
br label %rest
done:
ret void
}"""
"""Zeros side by side."""

MANY_ZEROS = 12
"""Zeros side by side from which on a loop writes them: large matrices consist of little else."""

ATTRIBUTES = """\
attributes #0 = { nounwind }
attributes #1 = { nounwind noinline }
attributes #2 = { nounwind nobuiltin willreturn memory(none) }
!0 = !{!"branch_weights", i32 1000000, i32 1}
"""


def module(
    programs: Mapping[str, Sequence[Node]],
    layout: Layout,
    fused: bool = False,
    large: int = LARGE,
    part: int = PART,
) -> str:
    """IR text of a module with one function ``mbd.<name>`` per program.

    Parameters
    ----------
    programs : names and what each function writes to ``out``
    fused : whether the machine has fused multiply-add (used only inside sine and cosine)
    large, part : operations above which a function is cut, and those of a part
    """
    lines: list[str] = []
    needs: set[str] = set()
    for name, outputs in programs.items():
        _function(name, outputs, layout, lines, needs, large, part)
    for width in WIDTHS:
        if f"sincos{width}" in needs:
            needs.discard(f"sincos{width}")
            body, declarations = sincos(width, fused)
            lines += body
            needs.update(declarations)
            needs.update(f"declare double @{name}(double)" for name in ("sin", "cos"))
    if "piece" in needs:
        needs.discard("piece")
        lines.append(PIECE)
    if "zeros" in needs:
        needs.discard("zeros")
        lines.append(ZEROS)
    lines += sorted(needs)
    lines.append(ATTRIBUTES)
    return "\n".join(lines)


def _function(
    name: str, outputs: Sequence[Node], layout: Layout, lines: list[str], needs: set[str], large: int, part: int
) -> None:
    steps = list(_steps(live(outputs)))
    places = _places(outputs)
    size = sum(len(nodes) for nodes, _ in steps)
    if size <= large:
        lines.append(f"define void @mbd.{name}({ARGUMENTS}) #0 {{\nentry:")
        body = _Body(places, layout, {}, lines, needs)
        for nodes, angles in steps:
            body.operations(nodes)
            body.angles(angles)
        body.rest(outputs)
        lines.append("ret void\n}")
        return
    parts = list(_parts(steps, part))
    slots = _slots(parts)
    for number, steps in enumerate(parts):
        lines.append(f"define internal void @mbd.{name}.{number}({ARGUMENTS}, ptr noalias %work) #1 {{\nentry:")
        body = _Body(places, layout, slots, lines, needs)
        for nodes, angles in steps:
            body.operations(nodes)
            body.angles(angles)
        if number == len(parts) - 1:
            body.rest(outputs)
        lines.append("ret void\n}")
    lines.append(f"define void @mbd.{name}({ARGUMENTS}) #0 {{\nentry:\n%work = alloca double, i64 {len(slots) + 1}")
    lines += (
        f"call void @mbd.{name}.{number}(ptr %block, ptr %parameters, ptr %out, ptr %work)"
        for number in range(len(parts))
    )
    lines.append("ret void\n}")


Angles = tuple[tuple[Node, Node | None, Node | None], ...]
"""Up to four arguments, each with the sine and the cosine that are asked of it."""

Step = tuple[list[Node], Angles]
"""Operations, and then a call for the sines and cosines of some angles."""


def _steps(order: list[Node]) -> Iterator[Step]:
    """The operations in an order that asks for sines and cosines as early and as many together as possible."""
    asked: dict[int, dict[str, Node]] = {}
    arguments: dict[int, Node] = {}
    for node in order:
        if node.op == "sin" or node.op == "cos":
            argument = node.args[0]
            arguments[argument.index] = argument
            asked.setdefault(argument.index, {})[node.op] = node
    done: set[int] = set()
    if arguments:
        level: dict[int, int] = {}
        for node in live(arguments.values()):
            deepest = max((level[arg.index] for arg in node.args), default=0)
            level[node.index] = deepest + (node.op == "sin" or node.op == "cos")
        ranked = sorted(arguments.values(), key=lambda node: (level[node.index], node.index))
        for group in _groups(ranked, level):
            before = [n for n in live(group) if n.index not in done and n.op != "sin" and n.op != "cos" and n.args]
            done.update(node.index for node in before)
            yield before, tuple((arg, asked[arg.index].get("sin"), asked[arg.index].get("cos")) for arg in group)
    yield (
        [n for n in order if n.args and n.op != "sin" and n.op != "cos" and n.index not in done],
        (),
    )


def _groups(ranked: list[Node], level: dict[int, int]) -> Iterator[list[Node]]:
    group: list[Node] = []
    for node in ranked:
        if group and (len(group) == WIDTHS[-1] or level[node.index] != level[group[0].index]):
            yield group
            group = []
        group.append(node)
    yield group


def _parts(steps: list[Step], size: int) -> Iterator[list[Step]]:
    """The same steps in portions of about `size` operations."""
    portion: list[Step] = []
    filled = 0
    for nodes, angles in steps:
        for start in range(0, max(len(nodes), 1), size):
            piece = nodes[start : start + size]
            last = start + size >= len(nodes)
            if filled and filled + len(piece) > size:
                yield portion
                portion, filled = [], 0
            portion.append((piece, angles if last else ()))
            filled += len(piece) + (4 * len(angles) if last else 0)
    if portion:
        yield portion


def _slots(parts: list[list[Step]]) -> dict[int, int]:
    """Places on the stack of the values that one part makes and another uses."""
    made: dict[int, int] = {}
    slots: dict[int, int] = {}

    def use(node: Node, number: int) -> None:
        if node.args and made[node.index] != number:
            slots.setdefault(node.index, len(slots))

    for number, steps in enumerate(parts):
        for nodes, angles in steps:
            for node in nodes:
                made[node.index] = number
                for arg in node.args:
                    use(arg, number)
            for argument, *values in angles:
                use(argument, number)
                made.update((node.index, number) for node in values if node is not None)
    return slots


def _places(outputs: Sequence[Node]) -> dict[int, list[int]]:
    """Where each node is asked for, by its index."""
    places: dict[int, list[int]] = {}
    for k, node in enumerate(outputs):
        places.setdefault(node.index, []).append(k)
    return places


def _runs(places: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Ascending places as runs (first, how many)."""
    first, number = places[0], 0
    for place in places:
        if place != first + number:
            yield first, number
            first, number = place, 0
        number += 1
    yield first, number


class _Body:
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


PERMUTATIONS = ((1.0,), (1.0, 1.0), (1.0, 2.0, 2.0), (1.0, 3.0, 6.0, 6.0))
"""k!/(k − d)!, the factor of s^(k−d) in the d-th derivative of s^k."""
