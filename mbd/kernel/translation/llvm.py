"""Typed trees of the kernel (`mbd.kernel.translation.tree`) → LLVM IR text."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from struct import pack

from mbd.errors import CapabilityError
from mbd.kernel.records import TABLE
from mbd.kernel.translation import tree

__all__ = ["HEAD", "LLVM", "TAGS", "Body", "Value", "llvm_text", "tags"]

LLVM = {"bool": "i1", "int": "i64", "real": "double", "ints": "ptr", "reals": "ptr", "kernel": "ptr", "none": "void"}
HEAD = """\
declare double @pow(double, double) nounwind nobuiltin willreturn memory(none)
declare double @llvm.sqrt.f64(double)
declare double @llvm.fabs.f64(double)
declare double @llvm.copysign.f64(double, double)
declare i64 @llvm.abs.i64(i64, i1)
"""
PLACES: dict[str, int] = {field: place for place, field in enumerate(TABLE.addresses)}
TAGS = {
    what: 2 * place + 3 for place, what in enumerate(("real", "int", *TABLE.real_arrays, *TABLE.integer_arrays, "code"))
}
"""Numbers of LLVM's tags of memory, see `tags`."""
WITHIN_ANOTHER = {"shift1": "block"}
"""Fields that lie in the array of another, whose tag they have."""
TAGS |= {part: TAGS[whole] for part, whole in WITHIN_ANOTHER.items()}
ARITHMETIC = {"+": "add", "-": "sub", "*": "mul"}
COMPARISONS = {
    "<": ("slt", "olt"), "<=": ("sle", "ole"), ">": ("sgt", "ogt"), ">=": ("sge", "oge"), "==": ("eq", "oeq"),
    "!=": ("ne", "une"),
}  # fmt: skip
CONVERSIONS = {("bool", "int"): "zext", ("bool", "real"): "uitofp", ("int", "real"): "sitofp"}

Value = tuple[str, str]
"""(operand in LLVM's words, kind)."""


def llvm_text(functions: Sequence[tree.Function], entry: str) -> str:
    """The module of some functions, of which the last is called from outside, by the name `entry`.

    What is called in one place only becomes part of its caller at once: LLVM would do the same, but would simplify it
    again at every level of the calls, which takes a third of its time.
    """
    bodies = [Body(function) for function in functions]
    calls = Counter(symbol for body in bodies for symbol in body.called)
    whole = "\n".join([HEAD, tags(), *(body.text(calls[body.function.symbol] == 1) for body in bodies)])
    return whole.replace(f"internal i64 @{functions[-1].symbol}(", f"i64 @{entry}(")


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


class Body:
    """One function: its lines as they grow."""

    def __init__(self, function: tree.Function) -> None:
        self.function, self.result = function, function.result
        self.called: list[str] = []
        self.lines: list[str] = []
        self.slots: list[str] = []
        self.count = 0
        self.loops: list[tuple[str, str]] = []
        self.begin_arguments()
        self.block(function.body)
        self.lines.append("ret void" if self.result == "none" else "unreachable")

    def begin_arguments(self) -> None:
        """Arguments become local names."""
        for name, kind in self.function.arguments.items():
            self.lines.append(f"store {LLVM[kind]} %in.{name}, ptr %own.{name}")

    def text(self, once: bool) -> str:
        """The function; `once`: it is called in one place."""
        function = self.function
        given = ", ".join(f"{LLVM[kind]} %in.{name}" for name, kind in function.arguments.items())
        inlining = " noinline" if function.apart else " alwaysinline" if once else ""
        head = f"define internal {LLVM[self.result]} @{function.symbol}({given}) nounwind{inlining} align 64 {{"
        own = [f"%own.{name} = alloca {LLVM[kind]}" for name, kind in function.locals.items()]
        return "\n".join([head, "entry:", *own, *self.slots, *self.lines, "}"])

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

    # statements -----------------------------------------------------------------------------------------------------
    def block(self, statements: Sequence[tree.Statement]) -> None:
        for statement in statements:
            getattr(self, f"_{type(statement).__name__}")(statement)

    def _Do(self, node: tree.Do) -> None:
        self.value(node.value)

    def _Assign(self, node: tree.Assign) -> None:
        value = self.value(node.value)
        for target in node.targets:
            self.assign(target, value)

    def assign(self, target: tree.Local | tree.Element, value: Value) -> None:
        if isinstance(target, tree.Local):
            self.lines.append(f"store {LLVM[target.kind]} {self.cast(value, target.kind)}, ptr %own.{target.name}")
        else:
            self.store(target, self.place(target), value)

    def store(self, target: tree.Element, place: str, value: Value) -> None:
        operand = self.cast(value, target.kind)
        self.lines.append(f"store {LLVM[target.kind]} {operand}, ptr {place}, !tbaa !{TAGS[target.what]}")

    def _Update(self, node: tree.Update) -> None:
        place = self.place(node.target)
        now = self.load(node.target, place), node.target.kind
        self.store(
            node.target, place, (self.operation(node.operator, now, self.value(node.value), node.kind), node.kind)
        )

    def _Return(self, node: tree.Return) -> None:
        if node.value is None:
            self.lines.append("ret void")
        else:
            self.lines.append(f"ret {LLVM[self.result]} {self.as_kind(node.value, self.result)}")
        self.begin(self.label())  # what follows is never reached

    def _If(self, node: tree.If) -> None:
        yes, no, end = self.label(), self.label(), self.label()
        self.branch(self.as_kind(node.test, "bool"), yes, no)
        for label, statements in ((yes, node.yes), (no, node.no)):
            self.begin(label)
            self.block(statements)
            self.go(end)
        self.begin(end)

    def _While(self, node: tree.While) -> None:
        again, body, end = self.label(), self.label(), self.label()
        self.go(again)
        self.begin(again)
        self.branch(self.as_kind(node.test, "bool"), body, end)
        self.turn(body, again, end, node.body)
        self.begin(end)

    def _Range(self, node: tree.Range) -> None:
        first, last = self.as_kind(node.first, "int"), self.as_kind(node.last, "int")
        place = self.slot("int")
        again, body, more, end = self.label(), self.label(), self.label(), self.label()
        self.lines.append(f"store i64 {first}, ptr {place}")
        self.go(again)
        self.begin(again)
        now = self.emit(f"load i64, ptr {place}")
        self.branch(self.emit(f"icmp {'slt' if node.step > 0 else 'sgt'} i64 {now}, {last}"), body, end)
        self.begin(body)
        self.assign(node.target, (now, "int"))
        inner = self.label()
        self.go(inner)
        self.turn(inner, more, end, node.body)
        self.begin(more)
        self.lines.append(f"store i64 {self.emit(f'add nsw i64 {now}, {node.step}')}, ptr {place}")
        self.go(again)
        self.begin(end)

    def turn(self, body: str, more: str, end: str, statements: Sequence[tree.Statement]) -> None:
        """The body of a loop; `continue` goes to `more`, `break` to `end`."""
        self.begin(body)
        self.loops.append((more, end))
        self.block(statements)
        self.loops.pop()
        self.go(more)

    def _Continue(self, node: tree.Continue) -> None:
        self.go(self.loops[-1][0])
        self.begin(self.label())

    def _Break(self, node: tree.Break) -> None:
        self.go(self.loops[-1][1])
        self.begin(self.label())

    # expressions ----------------------------------------------------------------------------------------------------
    def value(self, node: tree.Expression) -> Value:
        return getattr(self, f"_{type(node).__name__}")(node), node.kind

    def as_kind(self, node: tree.Expression, kind: str) -> str:
        return self.cast(self.value(node), kind)

    def cast(self, value: Value, kind: str) -> str:
        """The value as another kind; reals become integers as by ``int``."""
        operand, own = value
        if own == kind:
            return operand
        if own not in tree.NUMBERS or kind not in tree.NUMBERS:
            raise CapabilityError(f"a value of kind {own!r} where one of kind {kind!r} is needed")
        if kind == "bool":
            return self.emit(f"fcmp une double {operand}, 0.0" if own == "real" else f"icmp ne i64 {operand}, 0")
        if own == "real":
            return self.emit(f"fptosi double {operand} to i64")
        return self.emit(f"{CONVERSIONS[own, kind]} {LLVM[own]} {operand} to {LLVM[kind]}")

    def _Number(self, node: tree.Number) -> str:
        return f"0x{pack('>d', node.value).hex()}" if node.kind == "real" else str(node.value).lower()

    def _Local(self, node: tree.Local) -> str:
        return self.emit(f"load {LLVM[node.kind]}, ptr %own.{node.name}")

    def _Field(self, node: tree.Field) -> str:
        return self.field(self.value(node.record)[0], node.name, node.kind)

    def field(self, table: str, name: str, kind: str) -> str:
        place = self.emit(f"getelementptr inbounds i64, ptr {table}, i64 {PLACES[name]}")
        return self.emit(f"load {LLVM[kind]}, ptr {place}, !invariant.load !0")

    def _Element(self, node: tree.Element) -> str:
        return self.load(node, self.place(node))

    def place(self, node: tree.Element) -> str:
        """The address of an element."""
        array, index = self.value(node.array)[0], self.as_kind(node.index, "int")
        return self.emit(f"getelementptr inbounds {LLVM[node.kind]}, ptr {array}, i64 {index}")

    def load(self, node: tree.Element, place: str) -> str:
        return self.emit(f"load {LLVM[node.kind]}, ptr {place}, !tbaa !{TAGS[node.what]}")

    def _Convert(self, node: tree.Convert) -> str:
        return self.as_kind(node.value, node.kind)

    def _Operation(self, node: tree.Operation) -> str:
        return self.operation(node.operator, self.value(node.left), self.value(node.right), node.kind)

    def operation(self, operator: str, left: Value, right: Value, kind: str) -> str:
        a, b = self.cast(left, kind), self.cast(right, kind)
        if operator in ARITHMETIC:
            word = ARITHMETIC[operator]
            return self.emit(f"f{word} double {a}, {b}" if kind == "real" else f"{word} nsw i64 {a}, {b}")
        if operator == "**":
            return self.emit(f"call double @pow(double {a}, double {b}) nobuiltin")
        if operator in ("/", "<<"):
            return self.emit(f"fdiv double {a}, {b}" if operator == "/" else f"shl i64 {a}, {b}")
        rest = self._modulus(a, b, kind)
        return rest if operator == "%" else self.emit(f"sdiv i64 {self.emit(f'sub nsw i64 {a}, {rest}')}, {b}")

    def _modulus(self, a: str, b: str, kind: str) -> str:
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
        return found

    def _Unary(self, node: tree.Unary) -> str:
        value = self.value(node.value)
        if node.operator == "not":
            return self.emit(f"xor i1 {self.cast(value, 'bool')}, true")
        return self.unary(node.operator, self.cast(value, node.kind), node.kind)

    def unary(self, operator: str, operand: str, kind: str) -> str:
        """'-', 'abs' or 'sqrt' of a number of this kind."""
        real = kind == "real"
        if operator == "-":
            return self.emit(f"fneg double {operand}" if real else f"sub nsw i64 0, {operand}")
        if operator == "sqrt":
            return self.emit(f"call double @llvm.sqrt.f64(double {operand})")
        return self.emit(
            f"call double @llvm.fabs.f64(double {operand})"
            if real
            else f"call i64 @llvm.abs.i64(i64 {operand}, i1 true)"
        )

    def compared(self, operator: str, left: Value, right: Value) -> str:
        kind = tree.joined(left[1], right[1])
        a, b = self.cast(left, kind), self.cast(right, kind)
        of_integers, of_reals = COMPARISONS[operator]
        return self.emit(
            f"fcmp {of_reals} double {a}, {b}" if kind == "real" else f"icmp {of_integers} {LLVM[kind]} {a}, {b}"
        )

    def _Compare(self, node: tree.Compare) -> str:
        left = self.value(node.first)
        if len(node.rest) == 1:
            operator, right = node.rest[0]
            return self.compared(operator, left, self.value(right))
        slot, end = self.slot("bool"), self.label()
        for operator, operand in node.rest:
            right_value = self.value(operand)
            found = self.compared(operator, left, right_value)
            left = right_value
            self.step_on(found, slot, True, end)
        return self.at_end(slot, end, "bool")

    def _Junction(self, node: tree.Junction) -> str:
        slot, end = self.slot("bool"), self.label()
        for condition in node.conditions:
            self.step_on(self.as_kind(condition, "bool"), slot, node.every, end)
        return self.at_end(slot, end, "bool")

    def step_on(self, found: str, slot: str, every: bool, end: str) -> None:
        """Note a condition and leave for `end` where it decides."""
        self.lines.append(f"store i1 {found}, ptr {slot}")
        more = self.label()
        self.branch(found, *((more, end) if every else (end, more)))
        self.begin(more)

    def at_end(self, slot: str, end: str, kind: str) -> str:
        self.go(end)
        self.begin(end)
        return self.emit(f"load {LLVM[kind]}, ptr {slot}")

    def _Choice(self, node: tree.Choice) -> str:
        slot, yes, no, end = self.slot(node.kind), self.label(), self.label(), self.label()
        self.branch(self.as_kind(node.test, "bool"), yes, no)
        for label, choice in ((yes, node.yes), (no, node.no)):
            self.begin(label)
            self.lines.append(f"store {LLVM[node.kind]} {self.as_kind(choice, node.kind)}, ptr {slot}")
            self.go(end)
        self.begin(end)
        return self.emit(f"load {LLVM[node.kind]}, ptr {slot}")

    def _Extreme(self, node: tree.Extreme) -> str:
        values = [self.value(value) for value in node.values]
        best = self.cast(values[0], node.kind)
        for value in values[1:]:
            other = self.cast(value, node.kind)
            better = self.compared(node.operator, (other, node.kind), (best, node.kind))
            best = self.emit(f"select i1 {better}, {LLVM[node.kind]} {other}, {LLVM[node.kind]} {best}")
        return best

    def _Call(self, node: tree.Call) -> str:
        values, kinds = [self.value(argument) for argument in node.arguments], node.function.arguments.values()
        given = ", ".join(f"{LLVM[kind]} {self.cast(value, kind)}" for value, kind in zip(values, kinds, strict=True))
        self.called.append(node.function.symbol)
        call = f"call {LLVM[node.kind]} @{node.function.symbol}({given})"
        if node.kind != "none":
            return self.emit(call)
        self.lines.append(call)
        return ""

    def _Evaluate(self, node: tree.Evaluate) -> str:
        table, number = self.value(node.kernel)[0], self.as_kind(node.number, "int")
        inputs = None if node.inputs is None else self.value(node.inputs)[0]
        out = self.value(node.out)[0]
        code, params = self.field(table, "code", "reals"), self.field(table, "params", "reals")
        block = inputs or self.field(table, "block", "reals")
        place = self.emit(f"getelementptr inbounds ptr, ptr {code}, i64 {number}")
        self.lines.append(f"call void {self.emit(f'load ptr, ptr {place}')}(ptr {block}, ptr {params}, ptr {out})")
        return ""
