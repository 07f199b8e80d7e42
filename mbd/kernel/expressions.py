"""Expressions of the kernel's Python → LLVM IR: numbers, fields, elements of arrays, calls.

Kinds of values: 'bool', 'int' (64 bits), 'real' (double), 'ints' and 'reals' (addresses of arrays), 'kernel' (of the
table of fields), 'none'. Operators mean what they mean in Python for these: ``//`` and ``%`` round down, ``max``
keeps its first argument unless a later one is larger, ``sqrt`` is rounded once, powers are those of the C library,
nothing is reordered or contracted. Only the bounds of int do not grow, and x/0 is ±∞ or NaN.
"""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Callable, Mapping
from struct import pack
from textwrap import dedent

from mbd.errors import CapabilityError
from mbd.kernel.records import TABLE

__all__ = ["LLVM", "Callee", "Expressions", "Function", "join", "tags"]

LLVM = {"bool": "i1", "int": "i64", "real": "double", "ints": "ptr", "reals": "ptr", "kernel": "ptr", "none": "void"}
NUMBERS = ("bool", "int", "real")
PLACES: dict[str, int] = {field: place for place, field in enumerate(TABLE.addresses)}
TAGS = {
    what: 2 * place + 3 for place, what in enumerate(("real", "int", *TABLE.real_arrays, *TABLE.integer_arrays, "code"))
}
"""Numbers of LLVM's tags of memory, see `tags`."""
WITHIN_ANOTHER = {"shift1": "block"}
"""Fields that lie in the array of another, whose tag they have."""
TAGS |= {part: TAGS[whole] for part, whole in WITHIN_ANOTHER.items()}
ARITHMETIC = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul"}
COMPARISONS = {
    ast.Lt: ("slt", "olt"), ast.LtE: ("sle", "ole"), ast.Gt: ("sgt", "ogt"), ast.GtE: ("sge", "oge"),
    ast.Eq: ("eq", "oeq"), ast.NotEq: ("ne", "une"),
}  # fmt: skip

Value = tuple[str, str]
"""(operand in LLVM's words, kind)."""
Function = tuple[str, tuple[str, ...], str]
"""(symbol, kinds of arguments, kind of result) of a function that may be called."""
Callee = Callable[[str, tuple[str, ...]], Function]
"""The function of a name for arguments of some kinds."""


def join(a: str, b: str) -> str:
    """The kind that holds both."""
    if a == b:
        return a
    if a in NUMBERS and b in NUMBERS:
        return max(a, b, key=NUMBERS.index)
    raise CapabilityError(f"one name for a value of kind {a!r} and one of kind {b!r}")


def tags() -> str:
    """What cannot share a place, in LLVM's words: reals and integers, and the arrays of any two fields of the kernel.

    An array that is an argument or a local name may be that of any field of its kind.
    """
    lines = ["!0 = !{}", '!1 = !{!"kernel"}']
    for what, tag in TAGS.items():
        if what in WITHIN_ANOTHER:
            continue
        parent = 1 if what in ("real", "int") else TAGS["real" if what in TABLE.real_arrays else "int"] - 1
        lines += [f'!{tag - 1} = !{{!"{what}", !{parent}}}', f"!{tag} = !{{!{tag - 1}, !{tag - 1}, i64 0}}"]
    return "\n".join(lines)


def formula(name: str, record: ast.expr) -> ast.expr:
    """The expression that a property of the records returns, of the fields of `record`."""
    tree = ast.parse(dedent(inspect.getsource(TABLE.formulas[name])))
    own = next(node for node in ast.walk(tree) if isinstance(node, ast.Return)).value
    assert own is not None
    return ast.parse(re.sub(r"\bself\b", ast.unparse(record), ast.unparse(own)), mode="eval").body


class Expressions:
    """The body of one function as it grows; lines of LLVM IR.

    names : kinds of the local names as far as they are known; constants : numbers of the module by name
    callee : the function of a name for arguments of some kinds
    """

    def __init__(
        self,
        names: dict[str, str],
        constants: Mapping[str, float],
        callee: Callee,
    ) -> None:
        self.names, self.constants, self.callee = names, constants, callee
        self.lines: list[str] = []
        self.slots: list[str] = []
        self.count = 0

    # lines ----------------------------------------------------------------------------------------------------------
    def fresh(self) -> str:
        self.count += 1
        return f"%.{self.count}"

    def emit(self, text: str) -> str:
        name = self.fresh()
        self.lines.append(f"{name} = {text}")
        return name

    def label(self) -> str:
        self.count += 1
        return f".{self.count}"

    def begin(self, label: str) -> None:
        self.lines.append(f"{label}:")

    def go(self, label: str) -> None:
        self.lines.append(f"br label %{label}")

    def branch(self, condition: str, yes: str, no: str) -> None:
        self.lines.append(f"br i1 {condition}, label %{yes}, label %{no}")

    def slot(self, kind: str) -> str:
        name = self.fresh()
        self.slots.append(f"{name} = alloca {LLVM[kind]}")
        return name

    def peek(self, node: ast.expr) -> str:
        """The kind of an expression, without leaving a trace."""
        lines, slots = len(self.lines), len(self.slots)
        kind = self.value(node)[1]
        del self.lines[lines:], self.slots[slots:]
        return kind

    # values ---------------------------------------------------------------------------------------------------------
    def value(self, node: ast.expr) -> Value:
        """The value of an expression."""
        found = getattr(self, f"_{type(node).__name__}", None)
        if found is None:
            raise CapabilityError(f"{ast.unparse(node)!r} is no expression that the kernel may use")
        return found(node)  # type: ignore[no-any-return]

    def cast(self, value: Value, kind: str) -> str:
        """The value as another kind; reals become integers as by ``int``."""
        operand, own = value
        if own == kind:
            return operand
        if own not in NUMBERS or kind not in NUMBERS:
            raise CapabilityError(f"a value of kind {own!r} where one of kind {kind!r} is needed")
        if kind == "bool":
            return self.emit(f"fcmp une double {operand}, 0.0" if own == "real" else f"icmp ne i64 {operand}, 0")
        if own == "real":
            return self.emit(f"fptosi double {operand} to i64")
        step = {("bool", "int"): "zext", ("bool", "real"): "uitofp", ("int", "real"): "sitofp"}[own, kind]
        return self.emit(f"{step} {LLVM[own]} {operand} to {LLVM[kind]}")

    def as_kind(self, node: ast.expr, kind: str) -> str:
        return self.cast(self.value(node), kind)

    def test(self, node: ast.expr) -> str:
        """The truth of an expression."""
        return self.as_kind(node, "bool")

    def _Constant(self, node: ast.Constant) -> Value:
        return self.number(node.value)

    def number(self, number: object) -> Value:
        if isinstance(number, bool):
            return str(number).lower(), "bool"
        if isinstance(number, int):
            return str(number), "int"
        if isinstance(number, float):
            return f"0x{pack('>d', number).hex()}", "real"
        raise CapabilityError(f"{number!r} is no number")

    def _Name(self, node: ast.Name) -> Value:
        if node.id in self.names:
            kind = self.names[node.id]
            return self.emit(f"load {LLVM[kind]}, ptr %own.{node.id}"), kind
        if node.id in self.constants:
            return self.number(self.constants[node.id])
        raise CapabilityError(f"{node.id!r} has no value here")

    def _Attribute(self, node: ast.Attribute) -> Value:
        if node.attr in TABLE.places:
            place, kind, what = self.element(node)
            return self.load(place, kind, what), kind
        if node.attr in TABLE.formulas:
            return self.value(formula(node.attr, node.value))
        table, kind = self.value(node.value)
        if kind != "kernel" or node.attr not in TABLE.kinds:
            raise CapabilityError(f"{ast.unparse(node)!r} is no field of the kernel")
        place = self.emit(f"getelementptr inbounds i64, ptr {table}, i64 {PLACES[node.attr]}")
        kind = TABLE.kinds[node.attr]
        return self.emit(f"load {LLVM[kind]}, ptr {place}, !invariant.load !0"), kind

    def element(self, node: ast.Subscript | ast.Attribute) -> tuple[str, str, str]:
        """Address of an element of an array, its kind, and what can be at that address: 'real', 'int', or a field.

        A number that a record names by its place in an array is such an element.
        """
        if isinstance(node, ast.Attribute):
            if node.attr not in TABLE.places:
                raise CapabilityError(f"{ast.unparse(node)!r} cannot be assigned")
            array, index = TABLE.places[node.attr]
            node = ast.Subscript(ast.Attribute(node.value, array, ast.Load()), ast.Constant(index), ast.Load())
        base, kind = self.value(node.value)
        if kind not in ("ints", "reals"):
            raise CapabilityError(f"{ast.unparse(node.value)!r} is no array")
        own = kind[:-1]
        place = self.as_kind(node.slice, "int")
        what = node.value.attr if isinstance(node.value, ast.Attribute) else own
        return self.emit(f"getelementptr inbounds {LLVM[own]}, ptr {base}, i64 {place}"), own, what

    def load(self, place: str, kind: str, what: str) -> str:
        return self.emit(f"load {LLVM[kind]}, ptr {place}, !tbaa !{TAGS[what]}")

    def store(self, operand: str, place: str, kind: str, what: str) -> None:
        self.lines.append(f"store {LLVM[kind]} {operand}, ptr {place}, !tbaa !{TAGS[what]}")

    def _Subscript(self, node: ast.Subscript) -> Value:
        place, kind, what = self.element(node)
        return self.load(place, kind, what), kind

    # operators ------------------------------------------------------------------------------------------------------
    def _BinOp(self, node: ast.BinOp) -> Value:
        return self.operation(node.op, self.value(node.left), self.value(node.right))

    def operation(self, operator: ast.operator, left: Value, right: Value) -> Value:
        """A binary operation."""
        if isinstance(operator, ast.Pow):
            return self._power(left, right)
        kind = "real" if isinstance(operator, ast.Div) else join(join(left[1], right[1]), "int")
        a, b = self.cast(left, kind), self.cast(right, kind)
        if type(operator) in ARITHMETIC:
            word = ARITHMETIC[type(operator)]
            return self.emit(f"f{word} double {a}, {b}" if kind == "real" else f"{word} nsw i64 {a}, {b}"), kind
        if isinstance(operator, ast.Div):
            return self.emit(f"fdiv double {a}, {b}"), kind
        if isinstance(operator, ast.Mod):
            return self._modulus(a, b, kind)
        if isinstance(operator, ast.FloorDiv) and kind == "int":
            rest = self._modulus(a, b, kind)[0]
            return self.emit(f"sdiv i64 {self.emit(f'sub nsw i64 {a}, {rest}')}, {b}"), kind
        raise CapabilityError(f"no operator {type(operator).__name__} for values of kind {kind!r}")

    def _modulus(self, a: str, b: str, kind: str) -> Value:
        """The rest of a division rounded down; it has the sign of the divisor."""
        real, llvm = kind == "real", LLVM[kind]
        less, unequal, zero = ("fcmp olt", "fcmp une", "0.0") if real else ("icmp slt", "icmp ne", "0")
        rest = self.emit(f"{'frem' if real else 'srem'} {llvm} {a}, {b}")
        there = self.emit(f"{unequal} {llvm} {rest}, {zero}")
        signs = self.emit(
            f"xor i1 {self.emit(f'{less} {llvm} {rest}, {zero}')}, {self.emit(f'{less} {llvm} {b}, {zero}')}"
        )
        wrong = self.emit(f"and i1 {signs}, {there}")
        more = self.emit(f"{'fadd' if real else 'add nsw'} {llvm} {rest}, {b}")
        found = self.emit(f"select i1 {wrong}, {llvm} {more}, {llvm} {rest}")
        if real:
            nothing = self.emit(f"call double @llvm.copysign.f64(double 0.0, double {b})")
            found = self.emit(f"select i1 {there}, double {found}, double {nothing}")
        return found, kind

    def _power(self, left: Value, right: Value) -> Value:
        if left == ("2", "int") and right[1] == "int":
            return self.emit(f"shl i64 1, {right[0]}"), "int"
        if "real" not in (left[1], right[1]):
            raise CapabilityError("a power of integers, other than of 2")
        if right == self.number(0.5):
            raise CapabilityError("x ** 0.5 is a root or a power by the level of optimization: write sqrt(x)")
        a, b = self.cast(left, "real"), self.cast(right, "real")
        return self.emit(f"call double @pow(double {a}, double {b}) nobuiltin"), "real"

    def _UnaryOp(self, node: ast.UnaryOp) -> Value:
        if isinstance(node.op, ast.Not):
            return self.emit(f"xor i1 {self.test(node.operand)}, true"), "bool"
        value = self.value(node.operand)
        if not isinstance(node.op, ast.USub) or value[1] not in ("int", "real"):
            raise CapabilityError(f"{ast.unparse(node)!r} is no expression that the kernel may use")
        return self.emit(f"fneg double {value[0]}" if value[1] == "real" else f"sub nsw i64 0, {value[0]}"), value[1]

    def compare(self, operator: ast.cmpop, left: Value, right: Value) -> str:
        kind = join(left[1], right[1])
        if type(operator) not in COMPARISONS or kind not in NUMBERS:
            raise CapabilityError(f"no comparison {type(operator).__name__} for values of kind {kind!r}")
        a, b = self.cast(left, kind), self.cast(right, kind)
        of_integers, of_reals = COMPARISONS[type(operator)]
        return self.emit(
            f"fcmp {of_reals} double {a}, {b}" if kind == "real" else f"icmp {of_integers} {LLVM[kind]} {a}, {b}"
        )

    def _Compare(self, node: ast.Compare) -> Value:
        left = self.value(node.left)
        found, end = "", ""
        slot = self.slot("bool") if len(node.ops) > 1 else ""
        for operator, operand in zip(node.ops, node.comparators, strict=True):
            right = self.value(operand)
            found = self.compare(operator, left, right)
            left = right
            if slot:
                end = end or self.label()
                self.lines.append(f"store i1 {found}, ptr {slot}")
                more = self.label()
                self.branch(found, more, end)
                self.begin(more)
        if not slot:
            return found, "bool"
        self.go(end)
        self.begin(end)
        return self.emit(f"load i1, ptr {slot}"), "bool"

    def _BoolOp(self, node: ast.BoolOp) -> Value:
        """Conditions from left to right until one decides."""
        slot, end = self.slot("bool"), self.label()
        for operand in node.values:
            found = self.test(operand)
            self.lines.append(f"store i1 {found}, ptr {slot}")
            more = self.label()
            self.branch(found, *((more, end) if isinstance(node.op, ast.And) else (end, more)))
            self.begin(more)
        self.go(end)
        self.begin(end)
        return self.emit(f"load i1, ptr {slot}"), "bool"

    def _IfExp(self, node: ast.IfExp) -> Value:
        kind = join(self.peek(node.body), self.peek(node.orelse))
        slot, yes, no, end = self.slot(kind), self.label(), self.label(), self.label()
        self.branch(self.test(node.test), yes, no)
        for label, choice in ((yes, node.body), (no, node.orelse)):
            self.begin(label)
            self.lines.append(f"store {LLVM[kind]} {self.as_kind(choice, kind)}, ptr {slot}")
            self.go(end)
        self.begin(end)
        return self.emit(f"load {LLVM[kind]}, ptr {slot}"), kind

    # calls ----------------------------------------------------------------------------------------------------------
    def _Call(self, node: ast.Call) -> Value:
        if not isinstance(node.func, ast.Name) or node.keywords:
            raise CapabilityError(f"{ast.unparse(node)!r}: only functions of the kernel, without names of arguments")
        name = node.func.id
        values = [self.value(argument) for argument in node.args]
        if name in ("float", "int", "bool"):
            kind = {"float": "real"}.get(name, name)
            return self.cast(values[0], kind), kind
        if name in ("max", "min"):
            return self._extreme(name, values)
        if name == "abs":
            return self._magnitude(values[0])
        if name == "sqrt":
            return self.emit(f"call double @llvm.sqrt.f64(double {self.cast(values[0], 'real')})"), "real"
        if name in ("call", "call_on"):
            return self._model(values)
        symbol, kinds, result = self.callee(name, tuple(kind for _, kind in values))
        given = ", ".join(f"{LLVM[kind]} {self.cast(value, kind)}" for value, kind in zip(values, kinds, strict=True))
        if result == "none":
            self.lines.append(f"call void @{symbol}({given})")
            return "", "none"
        return self.emit(f"call {LLVM[result]} @{symbol}({given})"), result

    def _extreme(self, name: str, values: list[Value]) -> Value:
        kind = "bool"
        for value in values:
            kind = join(kind, value[1])
        best = self.cast(values[0], kind)
        for value in values[1:]:
            other = self.cast(value, kind)
            operator = ast.Gt() if name == "max" else ast.Lt()
            better = self.compare(operator, (other, kind), (best, kind))
            best = self.emit(f"select i1 {better}, {LLVM[kind]} {other}, {LLVM[kind]} {best}")
        return best, kind

    def _magnitude(self, value: Value) -> Value:
        if value[1] == "real":
            return self.emit(f"call double @llvm.fabs.f64(double {value[0]})"), "real"
        return self.emit(f"call i64 @llvm.abs.i64(i64 {self.cast(value, 'int')}, i1 true)"), "int"

    def _model(self, values: list[Value]) -> Value:
        """``call(K, number, out)`` or ``call_on(K, number, numbers, out)``: model code by its address."""
        (table, _), (number, _), *numbers, (out, _) = values
        fields = []
        for name in ("code", "params", "block"):
            place = self.emit(f"getelementptr inbounds i64, ptr {table}, i64 {PLACES[name]}")
            fields.append(self.emit(f"load ptr, ptr {place}, !invariant.load !0"))
        code, params, block = fields
        if numbers:
            block = numbers[0][0]
        place = self.emit(f"getelementptr inbounds ptr, ptr {code}, i64 {number}")
        self.lines.append(f"call void {self.emit(f'load ptr, ptr {place}')}(ptr {block}, ptr {params}, ptr {out})")
        return "", "none"
