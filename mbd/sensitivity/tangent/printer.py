"""Typed trees of the kernel (`mbd.trees.tree`) → LLVM IR in which every real carries its derivatives.

A real is a value and `LANES` derivatives, one for each direction, in vectors that registers hold; an array of reals is
two addresses, the array and one with `LANES` numbers for each of its own; the kernel is two tables, whose fields have
the same places. Rules
(Griewank & Walther 2008, Evaluating Derivatives, ch. 2): those of + − × ÷, powers, roots and |x|; an extreme or a
choice takes the derivatives of the value that it takes; integers, conditions and numbers of the record have none.
Values are computed by the very operations of the kernel, so that a run with derivatives is the run without them;
derivatives take fused ones where the processor has them.

Functions in `HELD` are called as they stand, without derivatives: what they write keeps the derivatives it had. Model
code is called for its values, then its exact derivatives are multiplied into the vectors of its inputs (`answers`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence

from mbd.kernel.records import TABLE
from mbd.kernel.translation.llvm import TAGS, Body, tags
from mbd.trees import tree
from mbd.trees.llvm import HEAD, LLVM, Value

WIDTH = 8
"""Derivatives in one vector: a power of 2, as others are taken apart number by number."""
LANES = 3 * WIDTH
"""Derivatives of a real; the last is kept for that by the size of a step, which an event needs.

Two sums of as many stay in the sixteen registers of four numbers that most processors have.
"""
PIECES = LANES // WIDTH
VECTOR = f"<{WIDTH} x double>"
ROOM = f"[{LANES} x double]"
"""All of them in memory, without gaps between one and the next."""
Parts = tuple[str, ...]
"""Operands of the derivatives of one value: vectors of those of a real, the address of those of an array or a table."""
WITH_TANGENT = {"real": PIECES * (VECTOR,), "reals": ("ptr",), "kernel": ("ptr",)}
FLAGS = "contract nnan nsz"
"""What derivatives allow: fused operations, and that what is multiplied by 0 is 0."""
ZERO: Parts = PIECES * ("zeroinitializer",)
HELD_ARRAYS = frozenset(
    (
        "scale", "known", "weight", "blurs", "typical", "largest", "error", "closing_gap", "deepest", "sinking",
        "contact_step", "closing_rate", "largest_rate", "contact_steps", "least_contact_step", "doubt", "seen",
        "row_bounds", "tableau", "turning",
    )
)  # fmt: skip
"""Arrays whose numbers have no derivatives: what only decides, and sizes of steps by their error."""
HELD_PLACES = frozenset(
    TABLE.places[name] for name in ("step", "next_step", "substep", "turning_step", "begun_step", "step_taken")
)
"""The same of single numbers: steps that follow an error are held as they were."""
PLAIN_PREFIX = "plain_"
"""What names of arrays begin with that are given without derivatives."""
BUNDLES = {kind: f"{{ {', '.join((LLVM[kind], *more))} }}" for kind, more in WITH_TANGENT.items()}
"""What functions return that return reals, or the address of an array."""


PRODUCT = """\
define internal void @product(
  ptr %program, ptr %block, ptr %params, ptr %out, ptr %of.block, ptr %of.params, ptr %of.out
) noinline {
entry:
  %code = load ptr, ptr %program
  %numbers.at = getelementptr i64, ptr %program, i64 1
  %numbers = load ptr, ptr %numbers.at
  %answer.at = getelementptr i64, ptr %program, i64 2
  %answer = load ptr, ptr %answer.at
  %bytes.at = getelementptr i64, ptr %program, i64 3
  %bytes = load i64, ptr %bytes.at
  %found.at = getelementptr i64, ptr %program, i64 4
  %found = load ptr, ptr %found.at
  %there = icmp ne ptr %code, null
  br i1 %there, label %evaluate, label %values
evaluate:
  call void %code(ptr %block, ptr %params, ptr %numbers)
  br label %values
values:
  %solved = icmp ne i64 %bytes, 0
  br i1 %solved, label %solution, label %derivatives
solution:
  call void @llvm.memcpy.p0.p0.i64(ptr %out, ptr %found, i64 %bytes, i1 false)
  br label %derivatives
derivatives:
  %known = icmp ne ptr %answer, null
  br i1 %known, label %answered, label %done
answered:
  call void %answer(ptr %numbers, ptr %of.block, ptr %of.params, ptr %of.out)
  br label %done
done:
  ret void
}
"""
"""Derivatives of a program at its inputs (see `programs.Derivative`): what multiplies those of the inputs, then these.

Of a system its solution takes the place of its residuals.
"""


class Dual(str):
    """An operand with those of its derivatives."""

    tangent: Parts

    def __new__(cls, value: str, tangent: Parts) -> Dual:
        found = super().__new__(cls, value)
        found.tangent = tangent
        return found


def of(operand: str) -> Parts:
    """The operands of the derivatives; zero for what has none."""
    return operand.tangent if isinstance(operand, Dual) else ZERO


def tangent_text(functions: Sequence[tree.Function], entry: str, held: Collection[str]) -> str:
    """The module of some functions with derivatives, of which the last is called from outside: ``entry(K, K')``.

    held : functions that are called without derivatives, as ``module.function``
    """
    bodies = [TangentBody(function, held) for function in functions if not is_called_plain(function, held)]
    plain = [Body(function) for function in functions]
    calls = Counter(symbol for body in (*bodies, *plain) for symbol in body.called)
    needed = _reached(functions[-1].symbol, {_name(each): each.called for each in (*bodies, *plain)})
    texts = [body.text(calls[_name(body)] == 1) for body in (*plain, *bodies) if _name(body) in needed]
    head = HEAD + "declare double @log(double) nounwind nobuiltin willreturn memory(none)\n"
    head += "declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)\n"
    head += f"declare {VECTOR} @llvm.fabs.v{WIDTH}f64({VECTOR})\n"
    whole = f"<{WIDTH} x i64>"
    head += f"declare {whole} @llvm.umax.v{WIDTH}i64({whole}, {whole})\n"
    head += f"declare i64 @llvm.vector.reduce.umax.v{WIDTH}i64({whole})\n"
    text = "\n".join([head, tags(), PRODUCT, *texts])
    return text.replace(f"internal i64 @{functions[-1].symbol}.d(", f"i64 @{entry}(")


def _name(body: Body) -> str:
    return body.function.symbol + (".d" if isinstance(body, TangentBody) else "")


def is_called_plain(function: tree.Function, held: Collection[str]) -> bool:
    """Whether a function is called without derivatives; held : such functions, as ``module.function``."""
    return ".".join(function.symbol.split(".")[: -len(function.arguments) or None]) in held


def _reached(entry: str, calls: dict[str, list[str]]) -> set[str]:
    found, waiting = set[str](), [f"{entry}.d"]
    while waiting:
        symbol = waiting.pop()
        if symbol not in found:
            found.add(symbol)
            waiting += calls[symbol]
    return found


class TangentBody(Body):
    """One function with derivatives."""

    def __init__(self, function: tree.Function, held: Collection[str]) -> None:
        self.held = held
        super().__init__(function)

    def begin_arguments(self) -> None:
        super().begin_arguments()
        for name, kind in self.function.arguments.items():
            if kind in WITH_TANGENT:
                given = [f"%of.{name}.{piece}" for piece in range(len(WITH_TANGENT[kind]))]
                self.keep(given, kind, f"%tangent.{name}")

    def text(self, once: bool) -> str:
        function = self.function
        given = [f"{LLVM[kind]} %in.{name}" for name, kind in function.arguments.items()]
        given += [
            f"{part} %of.{name}.{piece}"
            for name, kind in function.arguments.items()
            for piece, part in enumerate(WITH_TANGENT.get(kind, ()))
        ]
        inlining = " noinline" if function.apart else " alwaysinline" if once else ""
        result = BUNDLES.get(self.result, LLVM[self.result])
        head = f"define internal {result} @{function.symbol}.d({', '.join(given)}) nounwind{inlining} align 64 {{"
        own = [f"%own.{name} = alloca {LLVM[kind]}" for name, kind in function.locals.items()]
        own += [
            f"%tangent.{name}.{piece} = alloca {part}"
            for name, kind in function.locals.items()
            for piece, part in enumerate(WITH_TANGENT.get(kind, ()))
        ]
        return "\n".join([head, "entry:", *own, *self.slots, *self.lines, "}"])

    @staticmethod
    def align(kind: str) -> str:
        return ", align 8" if kind == "real" else ""

    def keep(self, given: Sequence[str], kind: str, slot: str) -> None:
        """Derivatives into memory of their own, which optimization makes names of."""
        for piece, (operand, part) in enumerate(zip(given, WITH_TANGENT[kind], strict=True)):
            self.lines.append(f"store {part} {operand}, ptr {slot}.{piece}{self.align(kind)}")

    def kept(self, kind: str, slot: str) -> Parts:
        """What `keep` has written."""
        align = self.align(kind)
        parts = enumerate(WITH_TANGENT[kind])
        return tuple(self.emit(f"load {part}, ptr {slot}.{piece}{align}") for piece, part in parts)

    def tangent_slot(self, kind: str) -> str:
        name = self.fresh()
        self.slots += [f"{name}.{piece} = alloca {part}" for piece, part in enumerate(WITH_TANGENT[kind])]
        return name

    def vectors(self, word: str, *operands: Parts) -> Parts:
        """An operation on vectors, piece by piece."""
        return tuple(self.emit(f"{word} {VECTOR} {', '.join(each)}") for each in zip(*operands, strict=True))

    def splat(self, operand: str) -> Parts:
        first = self.emit(f"insertelement {VECTOR} poison, double {operand}, i64 0")
        same = self.emit(f"shufflevector {VECTOR} {first}, {VECTOR} poison, <{WIDTH} x i32> zeroinitializer")
        return PIECES * (same,)

    def scaled(self, factor: str, tangent: Parts) -> Parts:
        """Derivatives times a number; ZERO stays."""
        return ZERO if tangent == ZERO else self.vectors(f"fmul {FLAGS}", self.splat(factor), tangent)

    def sum(self, a: Parts, b: Parts, word: str = "fadd") -> Parts:
        if b == ZERO:
            return a
        if a == ZERO:
            return b if word == "fadd" else self.vectors("fneg", b)
        return self.vectors(f"{word} {FLAGS}", a, b)

    def dual(self, value: str, tangent: Parts) -> str:
        return value if tangent == ZERO else Dual(value, tangent)

    # statements -----------------------------------------------------------------------------------------------------
    def assign(self, target: tree.Local | tree.Element, value: Value) -> None:
        super().assign(target, value)
        if isinstance(target, tree.Local) and target.kind in WITH_TANGENT:
            self.keep(of(self.cast(value, target.kind)), target.kind, f"%tangent.{target.name}")

    def store(self, target: tree.Element, place: str, value: Value) -> None:
        super().store(target, place, value)
        if not self.is_held(target):
            tangent = of(self.cast(value, "real"))
            for part, address in zip(tangent, self.pieces(place), strict=True):
                self.lines.append(f"store {VECTOR} {part}, ptr {address}, align 8, !tbaa !{TAGS[target.what]}")

    def _Return(self, node: tree.Return) -> None:
        if node.value is None or self.result not in BUNDLES:
            super()._Return(node)
            return
        bundle, kind = BUNDLES[self.result], self.result
        value = self.as_kind(node.value, kind)
        whole = self.emit(f"insertvalue {bundle} poison, {LLVM[kind]} {value}, 0")
        for piece, (operand, part) in enumerate(zip(of(value), WITH_TANGENT[kind], strict=True), 1):
            whole = self.emit(f"insertvalue {bundle} {whole}, {part} {operand}, {piece}")
        self.lines.append(f"ret {bundle} {whole}")
        self.begin(self.label())

    # expressions ----------------------------------------------------------------------------------------------------
    def _Local(self, node: tree.Local) -> str:
        value = super()._Local(node)
        if node.kind not in WITH_TANGENT:
            return value
        return Dual(value, self.kept(node.kind, f"%tangent.{node.name}"))

    def _Field(self, node: tree.Field) -> str:
        record = self.value(node.record)[0]
        value = self.field(record, node.name, node.kind)
        return Dual(value, (self.field(of(record)[0], node.name, "reals"),)) if node.kind == "reals" else value

    @staticmethod
    def is_held(node: tree.Element) -> bool:
        """Whether an element has no derivatives, or is no real."""
        if isinstance(node.array, tree.Local) and node.array.name.startswith(PLAIN_PREFIX):
            return True
        if node.kind != "real" or not isinstance(node.array, tree.Field):
            return node.kind != "real"
        index = node.index.value if isinstance(node.index, tree.Number) else -1
        return node.array.name in HELD_ARRAYS or (node.array.name, index) in HELD_PLACES

    def place(self, node: tree.Element) -> str:
        array, index = self.value(node.array)[0], self.as_kind(node.index, "int")
        place = self.emit(f"getelementptr inbounds {LLVM[node.kind]}, ptr {array}, i64 {index}")
        if self.is_held(node):
            return place
        return Dual(place, (self.emit(f"getelementptr inbounds {ROOM}, ptr {of(array)[0]}, i64 {index}"),))

    def pieces(self, place: str) -> Parts:
        """Addresses of the vectors of an element's derivatives."""
        words = [f"getelementptr inbounds {VECTOR}, ptr {of(place)[0]}, i64 {piece}" for piece in range(PIECES)]
        return tuple(self.emit(word) for word in words)

    def load(self, node: tree.Element, place: str) -> str:
        value = super().load(node, place)
        if self.is_held(node):
            return value
        tag = TAGS[node.what]
        read = [f"load {VECTOR}, ptr {address}, align 8, !tbaa !{tag}" for address in self.pieces(place)]
        return Dual(value, tuple(self.emit(word) for word in read))

    def operation(self, operator: str, a: str, b: str, kind: str) -> str:
        value = super().operation(operator, a, b, kind)
        if kind != "real":
            return value
        of_a, of_b = of(a), of(b)
        if operator in "+-":
            return self.dual(value, self.sum(of_a, of_b, "fadd" if operator == "+" else "fsub"))
        if operator == "*":
            return self.dual(value, self.sum(self.scaled(b, of_a), self.scaled(a, of_b)))
        if operator == "/":
            if of_a == of_b == ZERO:
                return value
            over = self.emit(f"fdiv double 1.0, {b}")
            return self.dual(value, self.scaled(over, self.sum(of_a, self.scaled(value, of_b), "fsub")))
        if operator == "%":
            return self.dual(value, of_a)
        if of_a != ZERO:
            less = self.emit(f"fsub double {b}, 1.0")
            power = self.emit(f"call double @pow(double {a}, double {less}) nobuiltin")
            of_a = self.scaled(self.emit(f"fmul double {b}, {power}"), of_a)
        if of_b != ZERO:
            log = self.emit(f"call double @log(double {a}) nobuiltin")
            of_b = self.scaled(self.emit(f"fmul double {value}, {log}"), of_b)
        return self.dual(value, self.sum(of_a, of_b))

    def _Unary(self, node: tree.Unary) -> str:
        if node.kind != "real":
            return super()._Unary(node)
        operand = self.as_kind(node.value, "real")
        value, tangent = self.unary(node.operator, operand, "real"), of(operand)
        if tangent == ZERO:
            return value
        if node.operator == "-":
            return Dual(value, self.vectors("fneg", tangent))
        if node.operator == "abs":
            below = self.emit(f"fcmp olt double {operand}, 0.0")
            return Dual(value, self.scaled(self.emit(f"select i1 {below}, double -1.0, double 1.0"), tangent))
        none = self.emit(f"fcmp oeq double {value}, 0.0")
        slope = self.emit(f"fdiv double 0.5, {value}")
        return Dual(value, self.scaled(self.emit(f"select i1 {none}, double 0.0, double {slope}"), tangent))

    def _Choice(self, node: tree.Choice) -> str:
        if node.kind not in WITH_TANGENT:
            return super()._Choice(node)
        slot, yes, no, end = self.slot(node.kind), self.label(), self.label(), self.label()
        more = self.tangent_slot(node.kind)
        self.branch(self.as_kind(node.test, "bool"), yes, no)
        for label, choice in ((yes, node.yes), (no, node.no)):
            self.begin(label)
            value = self.as_kind(choice, node.kind)
            self.lines.append(f"store {LLVM[node.kind]} {value}, ptr {slot}")
            self.keep(of(value), node.kind, more)
            self.go(end)
        self.begin(end)
        value = self.emit(f"load {LLVM[node.kind]}, ptr {slot}")
        return Dual(value, self.kept(node.kind, more))

    def _Extreme(self, node: tree.Extreme) -> str:
        if node.kind != "real":
            return super()._Extreme(node)
        best: str = self.as_kind(node.values[0], "real")
        tangent = of(best)
        for each in node.values[1:]:
            other = self.as_kind(each, "real")
            better = self.compared(node.operator, (other, "real"), (best, "real"))
            best = self.emit(f"select i1 {better}, double {other}, double {best}")
            if not tangent == of(other) == ZERO:
                pairs = zip(of(other), tangent, strict=True)
                tangent = tuple(self.emit(f"select i1 {better}, {VECTOR} {a}, {VECTOR} {b}") for a, b in pairs)
        return self.dual(best, tangent)

    def _Call(self, node: tree.Call) -> str:
        if is_called_plain(node.function, self.held):
            return super()._Call(node)
        kinds = list(node.function.arguments.values())
        name = node.function.symbol
        operands = [self.as_kind(argument, kind) for argument, kind in zip(node.arguments, kinds, strict=True)]
        if name.startswith("rules.seeded."):
            last = ", ".join([*(WIDTH - 1) * ["double 0.0"], "double 1.0"])
            return Dual(str(operands[0]), (*ZERO[1:], f"<{last}>"))
        if name.startswith("rules.at_root."):
            return self.at_root(*operands)
        if name.startswith("rules.seed_rate."):
            return self.last(operands[0])
        if name.startswith("rules.without_tangent."):
            return str(operands[0])
        if name.startswith("rules.derivative_of."):
            return Dual("0.0", of(operands[0]))
        if name.startswith("rules.takes_part."):
            return self.takes_part(operands[0])
        if name.startswith("rules.is_differentiated"):
            return "true"
        if name.startswith("rules.largest_derivative."):
            return self.largest(operands[0])
        given = [f"{LLVM[kind]} {operand}" for kind, operand in zip(kinds, operands, strict=True)]
        for kind, each in zip(kinds, operands, strict=True):
            if kind in WITH_TANGENT:
                given += [f"{part} {operand}" for part, operand in zip(WITH_TANGENT[kind], of(each), strict=True)]
        self.called.append(f"{name}.d")
        result = BUNDLES.get(node.kind, LLVM[node.kind])
        call = f"call {result} @{name}.d({', '.join(given)})"
        if node.kind == "none":
            self.lines.append(call)
            return ""
        both = self.emit(call)
        if node.kind not in BUNDLES:
            return both
        value, *parts = (
            self.emit(f"extractvalue {result} {both}, {piece}") for piece in range(1 + len(WITH_TANGENT[node.kind]))
        )
        return Dual(value, tuple(parts))

    def at_root(self, place: str, value: str) -> str:
        """The place h at which a value is 0: ``h' = −g'/ġ``, with ġ in the last lane; there nothing is left of it."""
        rate = self.last(value)
        over = self.emit(f"fdiv double -1.0, {rate}")
        moved = self.scaled(over, of(value))
        last = self.emit(f"insertelement {VECTOR} {moved[-1]}, double 0.0, i64 {WIDTH - 1}")
        return Dual(str(place), (*moved[:-1], last))

    def last(self, value: str) -> str:
        """The derivative in the last lane."""
        return self.emit(f"extractelement {VECTOR} {of(value)[-1]}, i64 {WIDTH - 1}")

    def takes_part(self, value: str) -> str:
        """Whether a value or one of its derivatives is not 0."""
        own = self.compared("!=", (str(value), "real"), ("0.0", "real"))
        if of(value) == ZERO:
            return own
        for part in of(value):
            bits = self.emit(f"fcmp une {VECTOR} {part}, zeroinitializer")
            word = self.emit(f"bitcast <{WIDTH} x i1> {bits} to i{WIDTH}")
            own = self.emit(f"or i1 {own}, {self.emit(f'icmp ne i{WIDTH} {word}, 0')}")
        return own

    def largest(self, value: str) -> str:
        """The largest size of the derivatives."""
        if of(value) == ZERO:
            return "0.0"
        whole = f"<{WIDTH} x i64>"
        sizes = [self.emit(f"call {VECTOR} @llvm.fabs.v{WIDTH}f64({VECTOR} {part})") for part in of(value)]
        found, *others = (self.emit(f"bitcast {VECTOR} {size} to {whole}") for size in sizes)
        for other in others:  # bits of sizes are ordered as they are
            found = self.emit(f"call {whole} @llvm.umax.v{WIDTH}i64({whole} {found}, {whole} {other})")
        bits = self.emit(f"call i64 @llvm.vector.reduce.umax.v{WIDTH}i64({whole} {found})")
        return self.emit(f"bitcast i64 {bits} to double")

    def _Evaluate(self, node: tree.Evaluate) -> str:
        table, number = self.value(node.kernel)[0], self.as_kind(node.number, "int")
        inputs = None if node.inputs is None else self.value(node.inputs)[0]
        out = self.value(node.out)[0]
        tables = table, of(table)[0]
        code, params = ([self.field(each, name, "reals") for each in tables] for name in ("code", "params"))
        block = [self.field(each, "block", "reals") for each in tables] if inputs is None else [inputs, of(inputs)[0]]
        places = [self.emit(f"getelementptr inbounds ptr, ptr {each}, i64 {number}") for each in code]
        function, program = (self.emit(f"load ptr, ptr {place}") for place in places)
        self.lines.append(
            f"call void @product(ptr {program}, ptr {block[0]}, ptr {params[0]}, ptr {out}, ptr {block[1]}, "
            f"ptr {params[1]}, ptr {of(out)[0]})"
        )
        self.lines.append(f"call void {function}(ptr {block[0]}, ptr {params[0]}, ptr {out})")
        return ""
