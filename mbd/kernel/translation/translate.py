"""Functions of the kernel's Python → typed trees (`mbd.trees.tree`).

The kernel uses little of Python: numbers, flat arrays, fields of its records, ``if``, ``while``, ``for … in range``,
slices that are filled with a number or copied, calls of its own functions by position. A name means what it means in
its module: two modules may each have a `step`. A scalar argument or result has the kind of its annotation; one
annotated ``Any`` has the kind it is called with, and a function is translated once for each combination of these.
Local names hold what all their assignments have in common: int and float make float.
"""

import ast
import inspect
from collections.abc import Mapping, Sequence
from functools import lru_cache
from importlib import import_module
from types import FunctionType, ModuleType
from typing import Any

from mbd.errors import CapabilityError
from mbd.kernel.records import TABLE
from mbd.kernel.translation import hints
from mbd.kernel.translation.shorthand import each, formula_of
from mbd.trees import tree

KINDS = {"int": "int", "float": "real", "bool": "bool", "None": "none", "Integers": "ints", "Reals": "reals"}
FIELDS = (*TABLE.kinds, *TABLE.formulas)
OPERATORS = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "//", ast.Mod: "%", ast.Pow: "**",
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
}  # fmt: skip


class Misread(CapabilityError):
    """Python that the kernel may not use, by file, line and function."""


class Source:
    """A module of the kernel: its title, its functions as trees of Python, what names mean in it, and its file."""

    def __init__(
        self, title: str, functions: Mapping[str, ast.FunctionDef], names: Mapping[str, Any], file: str = ""
    ) -> None:
        self.title, self.functions, self.names, self.file = title, functions, names, file or title


def functions_of(*sources: str) -> dict[str, ast.FunctionDef]:
    """All functions that some texts define, by name."""
    trees = [ast.parse(source) for source in sources]
    return {node.name: node for tree in trees for node in tree.body if isinstance(node, ast.FunctionDef)}


@lru_cache(maxsize=256)
def source_of(module: str) -> Source:
    """A module by its full name."""
    found = import_module(module)
    file = hints.shown(str(found.__file__))
    return Source(module.removeprefix("mbd.kernel."), functions_of(inspect.getsource(found)), vars(found), file)


def translate(
    source: Source,
    entry: str,
    kinds: Sequence[str],
    apart: Sequence[str] = (),
    instead: Mapping[str, Source] | None = None,
) -> list[tree.Function]:
    """A function and all that it calls; the function itself is the last.

    Parameters
    ----------
    source, entry, kinds : the function that is called from outside, where it is, and the kinds of its arguments
    apart : functions that are never inlined, as ``module.function``
    instead : sources in place of modules, by their full names
    """
    translation = _Translation(apart, instead or {})
    translation.callee(source, entry, tuple(kinds))
    return translation.found


class _Translation:
    def __init__(self, apart: Sequence[str], instead: Mapping[str, Source]) -> None:
        self.apart, self.instead = apart, instead
        self.done: dict[str, tree.Function] = {}
        self.found: list[tree.Function] = []
        self.open: list[str] = []

    def callee(self, source: Source, name: str, given: tuple[str, ...]) -> tree.Function:
        """What a name means in a module, for arguments of the given kinds, translated when it is first asked for."""
        meant = source.names.get(name)
        if name not in source.functions and isinstance(meant, FunctionType):
            source, name = self.instead.get(meant.__module__) or source_of(meant.__module__), meant.__name__
        if name not in source.functions:
            raise CapabilityError(hints.no_function(name, source.functions))
        node, title = source.functions[name], f"{source.title}.{name}"
        notes = [ast.unparse(argument.annotation) if argument.annotation else "Any" for argument in node.args.args]
        if len(notes) != len(given):
            raise CapabilityError(hints.called(name, (argument.arg for argument in node.args.args), len(given)))
        kinds = [KINDS.get(note, kind) for note, kind in zip(notes, given, strict=True)]
        symbol = ".".join([title, *kinds])
        if symbol not in self.done:
            if title in self.open:
                raise CapabilityError(f"{name!r} calls itself; try a loop")
            self.open.append(title)
            arguments = dict(zip((argument.arg for argument in node.args.args), kinds, strict=True))
            result = KINDS.get(ast.unparse(node.returns), "") if node.returns else ""
            self.done[symbol] = self._translated(
                source, node, tree.Function(symbol, arguments, result, title in self.apart)
            )
            self.found.append(self.done[symbol])
            self.open.pop()
        return self.done[symbol]

    def _translated(self, source: Source, node: ast.FunctionDef, function: tree.Function) -> tree.Function:
        function.locals = dict(function.arguments)
        stated, widens = function.result, True
        while widens:  # what was read before a name widened has the kind that it had then
            function.result, body = stated, _Body(source, function, self, node.name)
            function.body, widens = body.block(node.body), body.widens
            function.result = function.result or "none"
        return function


class _Body:
    """Statements and expressions of one function; `widens`: one of its local names has got a wider kind."""

    def __init__(self, source: Source, function: tree.Function, translation: _Translation, name: str) -> None:
        self.source, self.function, self.translation, self.name = source, function, translation, name
        self.widens = False

    # statements -----------------------------------------------------------------------------------------------------
    def block(self, statements: Sequence[ast.stmt]) -> list[tree.Statement]:
        found: list[tree.Statement] = []
        for statement in statements:
            try:
                found += getattr(self, f"_{type(statement).__name__}", self._unknown)(statement)
            except Misread:
                raise
            except CapabilityError as error:
                place = f"{self.source.file}:{statement.lineno}, in {self.name}"
                raise Misread(f"{place}: {error}") from None
        return found

    def _unknown(self, node: ast.stmt) -> list[tree.Statement]:
        raise CapabilityError(hints.statement(node))

    def _Pass(self, node: ast.Pass) -> list[tree.Statement]:
        return []

    def _Expr(self, node: ast.Expr) -> list[tree.Statement]:
        return [] if isinstance(node.value, ast.Constant) else [tree.Do(self.value(node.value))]  # a docstring

    def _Assign(self, node: ast.Assign) -> list[tree.Statement]:
        if isinstance(node.targets[0], ast.Subscript) and isinstance(node.targets[0].slice, ast.Slice):
            return self._For(each(node, node.targets[0], node.targets[0].slice))
        value = self.value(node.value)
        targets = tuple(self.target(target, value.kind) for target in node.targets)
        for target in targets:
            _converts(value.kind, target.kind)
        return [tree.Assign(targets, value)]

    def target(self, node: ast.expr, kind: str) -> tree.Local | tree.Element:
        """What is assigned to; a local name widens."""
        if isinstance(node, ast.Subscript | ast.Attribute):
            return self.element(node)
        if not isinstance(node, ast.Name):
            raise CapabilityError(hints.expected("a name, an element or a field to assign to", node))
        names = self.function.locals
        known = names.get(node.id, kind)
        names[node.id] = tree.joined(known, kind)
        self.widens |= names[node.id] != known
        return tree.Local(node.id, names[node.id])

    def _AugAssign(self, node: ast.AugAssign) -> list[tree.Statement]:
        if isinstance(node.target, ast.Name):
            value = self.operation(node.op, self._Name(node.target), self.value(node.value))
            return [tree.Assign((self.target(node.target, value.kind),), value)]
        target = self.element(node.target)
        changed = self.operation(node.op, target, self.value(node.value))
        return [tree.Update(target, changed.operator, changed.right, changed.kind)]

    def _Return(self, node: ast.Return) -> list[tree.Statement]:
        value = None if node.value is None else self.value(node.value)
        if value is not None:
            self.function.result = self.function.result or value.kind
            _converts(value.kind, self.function.result)
        return [tree.Return(value)]

    def _If(self, node: ast.If) -> list[tree.Statement]:
        return [tree.If(self.test(node.test), self.block(node.body), self.block(node.orelse))]

    def _While(self, node: ast.While) -> list[tree.Statement]:
        if node.orelse:
            self._unknown(node)
        return [tree.While(self.test(node.test), self.block(node.body))]

    def _For(self, node: ast.For) -> list[tree.Statement]:
        call = node.iter
        plain = isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "range"
        if not plain or node.orelse:
            raise CapabilityError(f"expected a loop over range(…), got one over {ast.unparse(node.iter)!r}")
        assert isinstance(call, ast.Call)
        bounds = [self.value(bound) for bound in call.args]
        first, last = (tree.Number(0, "int"), bounds[0]) if len(bounds) == 1 else (bounds[0], bounds[1])
        try:
            step = int(ast.literal_eval(call.args[2])) if len(bounds) == 3 else 1
        except ValueError:
            raise CapabilityError(f"expected a number as the step of a range, got {ast.unparse(call)!r}") from None
        target = self.target(node.target, "int")
        if not isinstance(target, tree.Local):
            raise CapabilityError(hints.expected("a name that counts the loop", node.target))
        return [tree.Range(target, first, last, step, self.block(node.body))]

    def _Continue(self, node: ast.Continue) -> list[tree.Statement]:
        return [tree.Continue()]

    def _Break(self, node: ast.Break) -> list[tree.Statement]:
        return [tree.Break()]

    # expressions ----------------------------------------------------------------------------------------------------
    def value(self, node: ast.expr) -> tree.Expression:
        found = getattr(self, f"_{type(node).__name__}", None)
        if found is None or not isinstance(node, ast.expr):
            raise CapabilityError(hints.expected("a number, a field or an element of an array", node))
        return found(node)  # type: ignore[no-any-return]

    def test(self, node: ast.expr) -> tree.Expression:
        """The truth of an expression, in any kind of number."""
        value = self.value(node)
        _converts(value.kind, "bool")
        return value

    def _Constant(self, node: ast.Constant) -> tree.Number:
        return _number(node.value)

    def _Name(self, node: ast.Name) -> tree.Expression:
        if node.id in self.function.locals:
            return tree.Local(node.id, self.function.locals[node.id])
        if node.id.isupper() and isinstance(self.source.names.get(node.id), int | float):
            return _number(self.source.names[node.id])
        raise CapabilityError(hints.no_value(node.id, self.function.locals, self.source.names))

    def _Attribute(self, node: ast.Attribute) -> tree.Expression:
        if node.attr in TABLE.places:
            return self.element(node)
        if node.attr in TABLE.formulas:
            return self.value(formula_of(node.attr, node.value))
        record = self.value(node.value)
        if record.kind != "kernel" or node.attr not in TABLE.kinds:
            raise CapabilityError(hints.unknown_field(ast.unparse(node), node.attr, record.kind, FIELDS))
        return tree.Field(record, node.attr, TABLE.kinds[node.attr])

    def element(self, node: ast.expr) -> tree.Element:
        """An element of an array, or a number that a record names by its place in one."""
        if isinstance(node, ast.Attribute):
            if node.attr not in TABLE.places:
                code, kind = ast.unparse(node), self.value(node.value).kind
                if node.attr in TABLE.kinds:
                    raise CapabilityError(f"expected an array or a field in one to write to, got {code!r}, a setting")
                raise CapabilityError(hints.unknown_field(code, node.attr, kind, FIELDS))
            array, index = TABLE.places[node.attr]
            node = ast.Subscript(ast.Attribute(node.value, array, ast.Load()), ast.Constant(index), ast.Load())
        if not isinstance(node, ast.Subscript):
            raise CapabilityError(hints.expected("an element of an array", node))
        base = self.value(node.value)
        if base.kind not in ("ints", "reals"):
            raise CapabilityError(f"expected an array, got {ast.unparse(node.value)!r}, {tree.kind_of(base.kind)}")
        own = base.kind[:-1]
        return tree.Element(base, self.value(node.slice), own, base.name if isinstance(base, tree.Field) else own)

    def _Subscript(self, node: ast.Subscript) -> tree.Element:
        return self.element(node)

    def _BinOp(self, node: ast.BinOp) -> tree.Operation:
        return self.operation(node.op, self.value(node.left), self.value(node.right))

    def operation(self, operator: ast.operator, left: tree.Expression, right: tree.Expression) -> tree.Operation:
        """A binary operation."""
        sign = OPERATORS.get(type(operator), "")
        if sign == "**":
            return _power(left, right)
        kind = "real" if sign == "/" else tree.joined(tree.joined(left.kind, right.kind), "int")
        if not sign or (sign == "//" and kind != "int"):
            came = f"{type(operator).__name__} of {tree.kind_of(kind)}"
            raise CapabilityError(f"expected + − * / ** of numbers, // and % of ints, got {came}")
        return tree.Operation(sign, left, right, kind)

    def _UnaryOp(self, node: ast.UnaryOp) -> tree.Expression:
        if isinstance(node.op, ast.Not):
            return tree.Unary("not", self.test(node.operand), "bool")
        value = self.value(node.operand)
        if not isinstance(node.op, ast.USub) or value.kind not in ("int", "real"):
            raise CapabilityError(hints.expected("a number, a field or an element of an array", node))
        return tree.Unary("-", value, value.kind)

    def _Compare(self, node: ast.Compare) -> tree.Compare:
        first = last = self.value(node.left)
        rest = []
        for operator, operand in zip(node.ops, node.comparators, strict=True):
            right, sign = self.value(operand), OPERATORS.get(type(operator), "")
            kind = tree.joined(last.kind, right.kind)
            if not sign or kind not in ("bool", "int", "real"):
                raise CapabilityError(
                    f"expected < <= > >= == != of numbers, got {type(operator).__name__} of {tree.kind_of(kind)}"
                )
            rest.append((sign, right))
            last = right
        return tree.Compare(first, tuple(rest))

    def _BoolOp(self, node: ast.BoolOp) -> tree.Junction:
        return tree.Junction(isinstance(node.op, ast.And), tuple(self.test(operand) for operand in node.values))

    def _IfExp(self, node: ast.IfExp) -> tree.Choice:
        test, yes, no = self.test(node.test), self.value(node.body), self.value(node.orelse)
        return tree.Choice(test, yes, no, tree.joined(yes.kind, no.kind))

    def _Call(self, node: ast.Call) -> tree.Expression:
        function, source = node.func, self.source
        if isinstance(function, ast.Attribute) and isinstance(function.value, ast.Name):
            module = self.source.names.get(function.value.id)
            if isinstance(module, ModuleType):
                if not isinstance(vars(module).get(function.attr), FunctionType):
                    raise CapabilityError(hints.no_function(function.attr, source.functions))
                function, source = ast.Name(function.attr, ast.Load()), source_of(module.__name__)
        if not isinstance(function, ast.Name) or node.keywords:
            raise CapabilityError(
                f"expected a function of a module with its arguments by position, got {ast.unparse(node)!r}"
            )
        name = function.id
        values = tuple(self.value(argument) for argument in node.args)
        kinds = tuple(value.kind for value in values)
        if name in ("float", "int", "bool"):
            return tree.Convert(values[0], KINDS[name])
        if name in ("max", "min"):
            return tree.Extreme(
                ">" if name == "max" else "<", values, tree.joined("bool", *kinds) if len(kinds) else "bool"
            )
        if name == "abs":
            return tree.Unary("abs", values[0], "real" if kinds[0] == "real" else "int")
        if name == "sqrt":
            return tree.Unary("sqrt", values[0], "real")
        if name == "call":
            return tree.Evaluate(values[0], values[1], None, values[2])
        if name == "call_on":
            return tree.Evaluate(values[0], values[1], values[2], values[3])
        called = self.translation.callee(source, name, kinds)
        for kind, needed in zip(kinds, called.arguments.values(), strict=True):
            _converts(kind, needed)
        return tree.Call(called, values, called.result)


def _converts(kind: str, needed: str) -> None:
    """Whether a value of one kind may stand where another is needed."""
    numbers = ("bool", "int", "real")
    if kind != needed and (kind not in numbers or needed not in numbers):
        raise CapabilityError(f"expected {tree.kind_of(needed)}, got {tree.kind_of(kind)}")


def _number(value: object) -> tree.Number:
    for kind, name in ((bool, "bool"), (int, "int"), (float, "real")):
        if isinstance(value, kind):
            return tree.Number(value, name)
    raise CapabilityError(f"expected a number, got {value!r}")


def _power(left: tree.Expression, right: tree.Expression) -> tree.Operation:
    if left == tree.Number(2, "int") and right.kind == "int":
        return tree.Operation("<<", tree.Number(1, "int"), right, "int")
    if "real" not in (left.kind, right.kind):
        raise CapabilityError("expected a power of a float, or of 2, got one of ints; try float(…)")
    if right == tree.Number(0.5, "real"):
        raise CapabilityError("x ** 0.5 is a root or a power by the level of optimization; try sqrt(x)")
    return tree.Operation("**", left, right, "real")
