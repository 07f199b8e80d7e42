"""LLVM IR text of functions: of typed trees (`mbd.trees.tree`), and of straight ones, operation by operation.

Both are written by the same verbs. Names of a tree are places on the stack; what a straight function names is a value.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from struct import pack
from typing import ClassVar

from mbd.errors import CapabilityError
from mbd.trees import tree
from mbd.trees.trigonometry import WIDTHS, sincos

LLVM = {"bool": "i1", "int": "i64", "real": "double", "ints": "ptr", "reals": "ptr", "kernel": "ptr", "none": "void"}
HEAD = """\
declare double @pow(double, double) nounwind nobuiltin willreturn memory(none)
declare double @llvm.sqrt.f64(double)
declare double @llvm.fabs.f64(double)
declare double @llvm.copysign.f64(double, double)
declare i64 @llvm.abs.i64(i64, i1)
"""
PIECE = """\
define internal i64 @mbd.piece(ptr readonly %breaks, i64 %n, double %x) nounwind noinline {
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
"""The last of n ascending numbers that is not above x, or the first one, by halving."""
ARITHMETIC = {"+": "add", "-": "sub", "*": "mul"}
REAL = {sign: f"f{word}" for sign, word in (*ARITHMETIC.items(), ("/", "div"))}
COMPARISONS = {
    "<": ("slt", "olt"), "<=": ("sle", "ole"), ">": ("sgt", "ogt"), ">=": ("sge", "oge"), "==": ("eq", "oeq"),
    "!=": ("ne", "une"),
}  # fmt: skip
CONVERSIONS = {("bool", "int"): "zext", ("bool", "real"): "uitofp", ("int", "real"): "sitofp"}

Value = tuple[str, str]
"""(operand in LLVM's words, kind)."""


def helpers(bodies: Sequence[Writer], fused: bool) -> list[str]:
    """What a module of some straight functions needs besides them.

    Parameters
    ----------
    fused : whether the machine has fused multiply-add (used only inside sine and cosine)
    """
    needs, lines = {need for body in bodies for need in body.needs}, HEAD.splitlines()
    for width in WIDTHS:
        if f"sincos{width}" in needs:
            needs.discard(f"sincos{width}")
            body, declarations = sincos(width, fused)
            lines += body
            needs.update(declarations)
    if "piece" in needs:
        needs.discard("piece")
        lines.append(PIECE)
    return lines + sorted(needs - set(lines))


class Writer:
    """Lines of a function as they grow, and the verbs by which they are written, on operands in LLVM's words.

    called, needs : symbols of other functions that it calls, and declarations and helpers that its module must have
    """

    def __init__(self) -> None:
        self.called: list[str] = []
        self.needs: set[str] = set()
        self.lines: list[str] = []
        self.count = 0

    def fresh(self) -> str:
        self.count += 1
        return f"%.{self.count}"

    def emit(self, text: str) -> str:
        self.count += 1
        name = f"%.{self.count}"
        self.lines.append(f"{name} = {text}")
        return name

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

    def operation(self, operator: str, a: str, b: str, kind: str) -> str:
        """A binary operation on operands of this kind."""
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


class Body(Writer):
    """A function from its tree.

    places, tags : of the record's fields in its table, and numbers of LLVM's tags of memory
    """

    places: ClassVar[Mapping[str, int]] = {}
    tags: ClassVar[Mapping[str, int]] = {}

    def __init__(self, function: tree.Function) -> None:
        super().__init__()
        self.function, self.result = function, function.result
        self.slots: list[str] = []
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
        self.lines.append(f"store {LLVM[target.kind]} {operand}, ptr {place}, !tbaa !{self.tags[target.what]}")

    def _Update(self, node: tree.Update) -> None:
        place = self.place(node.target)
        now = self.cast((self.load(node.target, place), node.target.kind), node.kind)
        changed = self.operation(node.operator, now, self.as_kind(node.value, node.kind), node.kind)
        self.store(node.target, place, (changed, node.kind))

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

    def _Number(self, node: tree.Number) -> str:
        return f"0x{pack('>d', node.value).hex()}" if node.kind == "real" else str(node.value).lower()

    def _Local(self, node: tree.Local) -> str:
        return self.emit(f"load {LLVM[node.kind]}, ptr %own.{node.name}")

    def _Field(self, node: tree.Field) -> str:
        return self.field(self.value(node.record)[0], node.name, node.kind)

    def field(self, table: str, name: str, kind: str) -> str:
        place = self.emit(f"getelementptr inbounds i64, ptr {table}, i64 {self.places[name]}")
        return self.emit(f"load {LLVM[kind]}, ptr {place}, !invariant.load !0")

    def _Element(self, node: tree.Element) -> str:
        return self.load(node, self.place(node))

    def place(self, node: tree.Element) -> str:
        """The address of an element."""
        array, index = self.value(node.array)[0], self.as_kind(node.index, "int")
        return self.emit(f"getelementptr inbounds {LLVM[node.kind]}, ptr {array}, i64 {index}")

    def load(self, node: tree.Element, place: str) -> str:
        return self.emit(f"load {LLVM[node.kind]}, ptr {place}, !tbaa !{self.tags[node.what]}")

    def _Convert(self, node: tree.Convert) -> str:
        return self.as_kind(node.value, node.kind)

    def _Operation(self, node: tree.Operation) -> str:
        kind = node.kind
        return self.operation(node.operator, self.as_kind(node.left, kind), self.as_kind(node.right, kind), kind)

    def _Unary(self, node: tree.Unary) -> str:
        value = self.value(node.value)
        if node.operator == "not":
            return self.emit(f"xor i1 {self.cast(value, 'bool')}, true")
        return self.unary(node.operator, self.cast(value, node.kind), node.kind)

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


class Straight(Writer):
    """A function without branches or loops on arrays of reals that share no number, written by the verbs of `Target`.

    Parameters
    ----------
    symbol, arguments : its name, and those of the arrays
    """

    def __init__(self, symbol: str, arguments: Sequence[str], apart: bool = False) -> None:
        super().__init__()
        self.symbol, self.arguments, self.apart = symbol, arguments, apart
        self.data = list[str]()

    def text(self, linkage: str = "") -> str:
        """The function, for others to see or, as "internal ", not."""
        given = ", ".join(f"ptr noalias %{name}" for name in self.arguments)
        head = f"define {linkage}void @{self.symbol}({given}) nounwind{' noinline' if self.apart else ''} {{"
        return "\n".join([*self.data, head, "entry:", *self.lines, "ret void", "}"])

    def emit(self, text: str) -> str:
        name = f"%{self.count}"  # a number, which LLVM reads faster than a name
        self.count += 1
        self.lines.append(f"{name} = {text}")
        return name

    def number(self, value: float) -> str:
        return f"0x{pack('>d', value).hex()}"

    def address(self, array: str, place: int) -> str:
        return self.emit(f"getelementptr double, ptr %{array}, i64 {place}")

    def load(self, array: str, place: int) -> str:
        address, name = f"%{self.count}", f"%{self.count + 1}"
        self.count += 2
        self.lines += (
            f"{address} = getelementptr double, ptr %{array}, i64 {place}", f"{name} = load double, ptr {address}"
        )  # fmt: skip
        return name

    def store(self, value: str, array: str, place: int) -> None:
        address = f"%{self.count}"
        self.count += 1
        self.lines += (
            f"{address} = getelementptr double, ptr %{array}, i64 {place}", f"store double {value}, ptr {address}"
        )  # fmt: skip

    def clear(self, array: str, first: int, count: int) -> None:
        self.needs.add("declare void @llvm.memset.p0.i64(ptr, i8, i64, i1)")
        start = self.address(array, first)
        self.lines.append(f"call void @llvm.memset.p0.i64(ptr align 8 {start}, i8 0, i64 {8 * count}, i1 false)")

    def arithmetic(self, sign: str, a: str, b: str) -> str:
        name = f"%{self.count}"
        self.count += 1
        self.lines.append(f"{name} = {REAL[sign]} double {a}, {b}")
        return name

    def floor(self, x: str) -> str:
        self.needs.add("declare double @llvm.floor.f64(double)")
        return self.emit(f"call double @llvm.floor.f64(double {x})")

    def library(self, name: str, *operands: str) -> str:
        self.needs.add(
            f"declare double @{name}({', '.join(['double'] * len(operands))}) "
            "nounwind nobuiltin willreturn memory(none)"
        )
        return self.emit(f"call double @{name}({', '.join(f'double {each}' for each in operands)}) nobuiltin")

    def compare(self, sign: str, a: str, b: str) -> str:
        return self.compared(sign, (a, "real"), (b, "real"))

    def join(self, word: str, a: str, b: str) -> str:
        return self.emit(f"{word} i1 {a}, {b}")

    def negate(self, flag: str) -> str:
        return self.emit(f"xor i1 {flag}, true")

    def select(self, flag: str, yes: str, no: str) -> str:
        return self.emit(f"select i1 {flag}, double {yes}, double {no}")

    def piece(self, array: str, first: int, count: int, x: str) -> str:
        self.needs.add("piece")
        return self.emit(f"call i64 @mbd.piece(ptr {self.address(array, first)}, i64 {count}, double {x})")

    def load_from(self, array: str, first: int, step: int, number: str) -> str:
        place = self.emit(f"add i64 {self.emit(f'mul i64 {number}, {step}')}, {first}")
        return self.emit(f"load double, ptr {self.emit(f'getelementptr double, ptr %{array}, i64 {place}')}")

    def sines_and_cosines(self, angles: Sequence[str]) -> tuple[list[str], list[str]]:
        width = next(each for each in WIDTHS if each >= len(angles))
        self.needs.add(f"sincos{width}")
        if width == 1:
            both = self.emit(f"call fastcc {{ double, double }} @mbd.sincos1(double {angles[0]})")
            return [self.emit(f"extractvalue {{ double, double }} {both}, 0")], [
                self.emit(f"extractvalue {{ double, double }} {both}, 1")
            ]
        kind, packed = f"<{width} x double>", "zeroinitializer"
        for lane, x in enumerate(angles):
            packed = self.emit(f"insertelement {kind} {packed}, double {x}, i64 {lane}")
        both = self.emit(f"call fastcc {{ {kind}, {kind} }} @mbd.sincos{width}({kind} {packed})")
        halves = [self.emit(f"extractvalue {{ {kind}, {kind} }} {both}, {half}") for half in range(2)]
        sines, cosines = (
            [self.emit(f"extractelement {kind} {half}, i64 {lane}") for lane in range(len(angles))] for half in halves
        )
        return sines, cosines

    def room(self, name: str, size: int) -> None:
        self.lines.append(f"%{name} = alloca double, i64 {size}")

    def call(self, symbol: str, arrays: Sequence[str]) -> None:
        self.called.append(symbol)
        self.lines.append(f"call void @{symbol}({', '.join(f'ptr %{name}' for name in arrays)})")

    def load_at(self, array: str, entry: int) -> str:
        return self.emit(
            f"load double, ptr {self.emit(f'getelementptr double, ptr %{array}, i32 {self._entry(entry)}')}"
        )

    def store_at(self, value: str, array: str, entry: int) -> None:
        address = self.emit(f"getelementptr double, ptr %{array}, i32 {self._entry(entry)}")
        self.lines.append(f"store double {value}, ptr {address}")

    def _entry(self, entry: int) -> str:
        return self.emit(f"load i32, ptr {self.emit(f'getelementptr i32, ptr %table, i64 {entry}')}")

    def table(self, numbers: Sequence[int]) -> None:
        data = b"".join(number.to_bytes(4, sys.byteorder) for number in numbers)
        text = "".join(f"\\{byte:02x}" for byte in data)
        self.data.append(f'@{self.symbol}.table = internal constant [{len(data)} x i8] c"{text}", align 4')

    def call_at(self, symbol: str, arrays: Sequence[str], entry: int) -> None:
        self.called.append(symbol)
        given = ", ".join(f"ptr %{name}" for name in arrays)
        place = f"ptr getelementptr (i32, ptr @{self.symbol}.table, i64 {entry})"
        self.lines.append(f"call void @{symbol}({given}, {place})")
