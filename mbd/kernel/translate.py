"""Functions of the kernel's Python → LLVM IR text.

The kernel uses little of Python: numbers, flat arrays, fields of `Kernel`, ``if``, ``while``, ``for … in range``, calls
of its own functions by position. A scalar argument or result has the kind of its annotation; one annotated ``Any`` has
the kind it is called with, and a function is translated once for each combination of these. Local names hold what all
their assignments have in common: int and float make float.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence

from mbd.errors import CapabilityError
from mbd.kernel.expressions import LLVM, Callee, Expressions, Function, join, tags

__all__ = ["translate"]

KINDS = {"int": "int", "float": "real", "bool": "bool", "None": "none", "Integers": "ints", "Reals": "reals"}
HEAD = """\
declare double @pow(double, double) nounwind nobuiltin willreturn memory(none)
declare double @llvm.sqrt.f64(double)
declare double @llvm.fabs.f64(double)
declare double @llvm.copysign.f64(double, double)
declare i64 @llvm.abs.i64(i64, i1)
"""


def translate(
    functions: Mapping[str, ast.FunctionDef],
    constants: Mapping[str, float],
    entry: str,
    kinds: Sequence[str],
    apart: Sequence[str] = (),
) -> str:
    """LLVM IR of a function and all that it calls.

    Parameters
    ----------
    functions, constants : by their names
    entry, kinds : the function that is called from outside, under this name, and the kinds of its arguments
    apart : functions that are never inlined
    """
    return _Module(functions, constants, apart).text(entry, tuple(kinds))


class _Module:
    def __init__(
        self, functions: Mapping[str, ast.FunctionDef], constants: Mapping[str, float], apart: Sequence[str]
    ) -> None:
        self.functions, self.constants, self.apart = functions, constants, apart
        self.done: dict[tuple[str, tuple[str, ...]], Function] = {}
        self.texts: list[str] = []
        self.open: list[str] = []

    def text(self, entry: str, kinds: tuple[str, ...]) -> str:
        symbol, _, _ = self.callee(entry, kinds)
        whole = "\n".join([HEAD, tags(), *self.texts])
        return whole.replace(f"internal i64 @{symbol}(", f"i64 @{entry}(")

    def callee(self, name: str, given: tuple[str, ...]) -> Function:
        """The function of a name for arguments of the given kinds, translated when it is first asked for."""
        if name not in self.functions:
            raise CapabilityError(f"no function {name!r} in the kernel")
        node = self.functions[name]
        notes = [ast.unparse(argument.annotation) if argument.annotation else "Any" for argument in node.args.args]
        if len(notes) != len(given):
            raise CapabilityError(f"{name!r} takes {len(notes)} arguments and is given {len(given)}")
        kinds = tuple(KINDS.get(note, kind) for note, kind in zip(notes, given, strict=True))
        if (name, kinds) not in self.done:
            if name in self.open:
                raise CapabilityError(f"{name!r} calls itself")
            self.open.append(name)
            self.done[name, kinds] = self._translated(node, kinds)
            self.open.pop()
        return self.done[name, kinds]

    def _translated(self, node: ast.FunctionDef, kinds: tuple[str, ...]) -> Function:
        result = KINDS.get(ast.unparse(node.returns), "") if node.returns else ""
        arguments = dict(zip((argument.arg for argument in node.args.args), kinds, strict=True))
        names: dict[str, str] = dict(arguments)
        while True:  # until no assignment widens a name any more
            known = dict(names)
            body = _Body(names, self.constants, self.callee, result)
            body.function(node, arguments)
            if names == known:
                break
        symbol = f"{node.name}.{'.'.join(kinds)}"
        given = ", ".join(f"{LLVM[kind]} %in.{name}" for name, kind in arguments.items())
        apart = " noinline" if node.name in self.apart else ""
        lines = [f"define internal {LLVM[body.result]} @{symbol}({given}) nounwind{apart} align 64 {{", "entry:"]
        lines += [f"%own.{name} = alloca {LLVM[kind]}" for name, kind in names.items()]
        self.texts.append("\n".join([*lines, *body.slots, *body.lines, "}"]))
        return symbol, kinds, body.result


class _Body(Expressions):
    """Statements of one function."""

    def __init__(self, names: dict[str, str], constants: Mapping[str, float], callee: Callee, result: str) -> None:
        super().__init__(names, constants, callee)
        self.result = result
        self.loops: list[tuple[str, str]] = []

    def function(self, node: ast.FunctionDef, arguments: Mapping[str, str]) -> None:
        """The whole body, its arguments in places like local names."""
        for name, kind in arguments.items():
            self.lines.append(f"store {LLVM[kind]} %in.{name}, ptr %own.{name}")
        self.block(node.body)
        self.result = self.result or "none"
        self.lines.append("ret void" if self.result == "none" else "unreachable")

    def block(self, statements: Sequence[ast.stmt]) -> None:
        for statement in statements:
            try:
                getattr(self, f"_{type(statement).__name__}", self._unknown)(statement)
            except CapabilityError as error:
                if "line" in str(error):
                    raise
                raise CapabilityError(f"line {statement.lineno}: {error}") from None

    def _unknown(self, node: ast.stmt) -> None:
        raise CapabilityError(f"{ast.unparse(node)!r} is no statement that the kernel may use")

    def _Pass(self, node: ast.Pass) -> None:
        pass

    def _Expr(self, node: ast.Expr) -> None:
        if not isinstance(node.value, ast.Constant):  # a docstring
            self.value(node.value)

    def _Assign(self, node: ast.Assign) -> None:
        value = self.value(node.value)
        for target in node.targets:
            self.assign(target, value)

    def assign(self, target: ast.expr, value: tuple[str, str]) -> None:
        if isinstance(target, ast.Subscript | ast.Attribute):
            place, kind, what = self.element(target)
            self.store(self.cast(value, kind), place, kind, what)
        elif isinstance(target, ast.Name):
            kind = self.names[target.id] = join(self.names.get(target.id, value[1]), value[1])
            self.lines.append(f"store {LLVM[kind]} {self.cast(value, kind)}, ptr %own.{target.id}")
        else:
            raise CapabilityError(f"{ast.unparse(target)!r} cannot be assigned")

    def _AugAssign(self, node: ast.AugAssign) -> None:
        if isinstance(node.target, ast.Subscript | ast.Attribute):
            place, kind, what = self.element(node.target)
            value = self.operation(node.op, (self.load(place, kind, what), kind), self.value(node.value))
            self.store(self.cast(value, kind), place, kind, what)
        else:
            own = ast.Name(ast.unparse(node.target), ast.Load())
            self.assign(node.target, self.operation(node.op, self.value(own), self.value(node.value)))

    def _Return(self, node: ast.Return) -> None:
        if node.value is None:
            self.lines.append("ret void")
        else:
            value = self.value(node.value)
            self.result = self.result or value[1]
            self.lines.append(f"ret {LLVM[self.result]} {self.cast(value, self.result)}")
        self.begin(self.label())  # what follows is never reached

    def _If(self, node: ast.If) -> None:
        yes, no, end = self.label(), self.label(), self.label()
        self.branch(self.test(node.test), yes, no)
        for label, statements in ((yes, node.body), (no, node.orelse)):
            self.begin(label)
            self.block(statements)
            self.go(end)
        self.begin(end)

    def _While(self, node: ast.While) -> None:
        if node.orelse:
            self._unknown(node)
        again, body, end = self.label(), self.label(), self.label()
        self.go(again)
        self.begin(again)
        self.branch(self.test(node.test), body, end)
        self._turn(body, again, end, node.body)

    def _For(self, node: ast.For) -> None:
        """A loop over a range, whose bounds are found once."""
        call = node.iter
        plain = isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "range"
        if not plain or node.orelse:
            raise CapabilityError(f"a loop over {ast.unparse(node.iter)!r}, not over a range")
        assert isinstance(call, ast.Call)
        bounds = [self.as_kind(bound, "int") for bound in call.args]
        first, last = ("0", bounds[0]) if len(bounds) == 1 else bounds[:2]
        try:
            step = int(ast.literal_eval(call.args[2])) if len(bounds) == 3 else 1
        except ValueError:
            raise CapabilityError(f"{ast.unparse(call)!r}: the step of a range is a number") from None
        place = self.slot("int")
        again, body, more, end = self.label(), self.label(), self.label(), self.label()
        self.lines.append(f"store i64 {first}, ptr {place}")
        self.go(again)
        self.begin(again)
        now = self.emit(f"load i64, ptr {place}")
        self.branch(self.emit(f"icmp {'slt' if step > 0 else 'sgt'} i64 {now}, {last}"), body, end)
        self.begin(body)
        self.assign(node.target, (now, "int"))
        inner = self.label()
        self.go(inner)
        self._turn(inner, more, end, node.body, leave_open=True)
        self.begin(more)
        self.lines.append(f"store i64 {self.emit(f'add nsw i64 {now}, {step}')}, ptr {place}")
        self.go(again)
        self.begin(end)

    def _turn(self, body: str, more: str, end: str, statements: Sequence[ast.stmt], leave_open: bool = False) -> None:
        """The body of a loop; `continue` goes to `more`, `break` to `end`."""
        self.begin(body)
        self.loops.append((more, end))
        self.block(statements)
        self.loops.pop()
        self.go(more)
        if not leave_open:
            self.begin(end)

    def _Continue(self, node: ast.Continue) -> None:
        self.go(self.loops[-1][0])
        self.begin(self.label())

    def _Break(self, node: ast.Break) -> None:
        self.go(self.loops[-1][1])
        self.begin(self.label())
