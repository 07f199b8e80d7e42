"""Tape outputs → LLVM IR text: straight-line code, inputs loaded once, nothing reordered or contracted.

Every function is ``void @mbd.<name>(ptr block, ptr parameters, ptr out)``. Sines and cosines come first, four at a
time (see `trigonometry`), because a call empties all registers. A function above `LARGE` operations is cut into
parts of about `PART`, which hand values on through an array on the stack: allocating registers costs more than
linear time (16 000 operations: 0.8 s in one piece, 0.3 s in parts, which run 2 % slower).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from mbd.compile.instructions import Angles, Body
from mbd.compile.layout import Layout
from mbd.compile.trigonometry import WIDTHS, sincos
from mbd.tape.derivatives import live
from mbd.tape.node import Node

__all__ = ["LARGE", "LIBRARY", "PART", "module"]

LARGE = 2500
"""Operations above which a function is cut into parts."""

PART = 250
"""Operations of a part."""

LIBRARY = ("acos", "asin", "atan", "atan2", "cos", "cosh", "exp", "fmod", "log", "pow", "sin", "sinh", "tan", "tanh")
"""Functions of the C library that the code may call, by their C names."""

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
        _write(Body(places, layout, {}, lines, needs), steps).rest(outputs)
        lines.append("ret void\n}")
        return
    parts = list(_parts(steps, part))
    slots = _slots(parts)
    for number, steps in enumerate(parts):
        lines.append(f"define internal void @mbd.{name}.{number}({ARGUMENTS}, ptr noalias %work) #1 {{\nentry:")
        body = _write(Body(places, layout, slots, lines, needs), steps)
        if number == len(parts) - 1:
            body.rest(outputs)
        lines.append("ret void\n}")
    lines.append(f"define void @mbd.{name}({ARGUMENTS}) #0 {{\nentry:\n%work = alloca double, i64 {len(slots) + 1}")
    lines += (
        f"call void @mbd.{name}.{number}(ptr %block, ptr %parameters, ptr %out, ptr %work)"
        for number in range(len(parts))
    )
    lines.append("ret void\n}")


def _write(body: Body, steps: Iterable[Step]) -> Body:
    """The operations of some steps into a body."""
    for nodes, angles in steps:
        body.operations(nodes)
        body.angles(angles)
    return body


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
