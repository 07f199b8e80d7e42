"""Typed trees of the kernel → Python in which reals carry their derivatives, for machines without machine code.

The rules are those of `printer`: functions in `HELD` and reals that only decide have no derivatives. An array of reals
is a `Pair` of its numbers and of their derivatives, the record a `Table`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from typing import Any

import numpy as np

from mbd.kernel.records import Kernel
from mbd.sensitivity.tangent.printer import LANES, TangentBody, is_called_plain
from mbd.trees import tree


class Dual:
    """A real with its derivatives (`LANES`,)."""

    __slots__ = ("of", "value")
    __array_ufunc__ = None  # numbers of numpy leave operations to this class

    def __init__(self, value: Any, of: Any) -> None:
        self.value, self.of = value, of

    def __add__(self, other: Any) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value + other.value, self.of + other.of)
        return Dual(self.value + other, self.of)

    __radd__ = __add__

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.of)

    def __sub__(self, other: Any) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value - other.value, self.of - other.of)
        return Dual(self.value - other, self.of)

    def __rsub__(self, other: Any) -> Dual:
        return Dual(other - self.value, -self.of)

    def __mul__(self, other: Any) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value * other.value, other.value * self.of + self.value * other.of)
        return Dual(self.value * other, other * self.of)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Dual:
        value = value_of(self) / value_of(other)
        return Dual(value, (self.of - value * of(other)) / value_of(other))

    def __rtruediv__(self, other: Any) -> Dual:
        value = other / self.value
        return Dual(value, -value / self.value * self.of)

    def __mod__(self, other: Any) -> Dual:
        return Dual(self.value % value_of(other), self.of)

    def __abs__(self) -> Dual:
        return -self if self.value < 0.0 else self

    def __lt__(self, other: Any) -> bool:
        return bool(self.value < value_of(other))

    def __le__(self, other: Any) -> bool:
        return bool(self.value <= value_of(other))

    def __gt__(self, other: Any) -> bool:
        return bool(self.value > value_of(other))

    def __ge__(self, other: Any) -> bool:
        return bool(self.value >= value_of(other))

    def __eq__(self, other: object) -> bool:
        return bool(self.value == value_of(other))

    def __ne__(self, other: object) -> bool:
        return bool(self.value != value_of(other))

    __hash__ = None  # type: ignore[assignment]

    def __int__(self) -> int:
        return int(self.value)

    def __bool__(self) -> bool:
        return bool(self.value)


def value_of(x: Any) -> Any:
    """The value alone."""
    return x.value if isinstance(x, Dual) else x


def of(x: Any) -> Any:
    """The derivatives, 0.0 for those of a number without."""
    return x.of if isinstance(x, Dual) else 0.0


def derivative_of(x: Any) -> Any:
    """0 with the derivatives."""
    return Dual(0.0, x.of) if isinstance(x, Dual) else 0.0


def as_real(x: Any) -> Any:
    """A number as a real, whose division by zero is ±∞ or NaN."""
    return x if isinstance(x, Dual) else np.float64(x)


def power(a: Any, b: Any) -> Any:
    """``a ** b``."""
    x, y = np.float64(value_of(a)), value_of(b)
    found = x**y
    if not isinstance(a, Dual) and not isinstance(b, Dual):
        return found
    slope = y * x ** (y - 1.0) * of(a)
    return Dual(found, slope + found * np.log(x) * b.of if isinstance(b, Dual) else slope)


def root(x: Any) -> Any:
    """√x; its derivatives are 0 at 0."""
    value = np.float64(math.sqrt(value_of(x)) if value_of(x) >= 0.0 else math.nan)
    return Dual(value, 0.5 / value * x.of if value != 0.0 else 0.0 * x.of) if isinstance(x, Dual) else value


def at_root(place: Any, value: Dual) -> Dual:
    """The place at which a value is 0: see `printer.TangentBody.at_root`."""
    moved = -1.0 / value.of[-1] * value.of
    moved[-1] = 0.0
    return Dual(value_of(place), moved)


def seeded(place: Any) -> Dual:
    """A number that is differentiated by, in the last direction."""
    direction = np.zeros(LANES)
    direction[-1] = 1.0
    return Dual(value_of(place), direction)


def takes_part(x: Any) -> bool:
    """Whether a value or one of its derivatives is not 0."""
    return bool(value_of(x) != 0.0 or np.any(of(x) != 0.0))


class Pair:
    """An array with the derivatives of its numbers (L, `LANES`)."""

    __slots__ = ("of", "values")

    def __init__(self, values: Any, of: Any) -> None:
        self.values, self.of = values, of

    def __getitem__(self, place: int) -> Dual:
        return Dual(self.values[place], self.of[place].copy())

    def __setitem__(self, place: int, x: Any) -> None:
        self.values[place], self.of[place] = value_of(x), of(x)


class Table:
    """The record, its arrays of reals as pairs, and derivatives of programs.

    Parameters
    ----------
    kernel : the record
    tangent : gives the derivatives of an array by its name
    programs : in the order of the kernel's code (`mbd.sensitivity.tangent.programs.Derivative`)
    """

    def __init__(self, kernel: Kernel, tangent: Callable[[str], Any], programs: Sequence[Any]) -> None:
        self.kernel, self._tangent, self._programs = kernel, tangent, programs
        self._pairs = dict[str, Pair]()

    def pair(self, name: str) -> Pair:
        """An array of reals."""
        found = self._pairs.get(name)
        if found is None:
            found = self._pairs[name] = Pair(getattr(self.kernel, name), self._tangent(name))
        return found

    def evaluate(self, number: int, inputs: Pair | None, out: Pair) -> None:
        """A program with its derivatives."""
        block, parameters = self.pair("block") if inputs is None else inputs, self.pair("params")
        change = self._programs[number].product(block, parameters, out.values)
        self.kernel.code[number](block.values, parameters.values, out.values)
        out.of[: len(change)] = change


def interpreted(functions: Sequence[tree.Function], held: Collection[str]) -> Callable[[Table], int]:
    """The last of some functions, with derivatives."""
    known: dict[str, Any] = {
        "Dual": Dual, "value_of": value_of, "as_real": as_real, "power": power, "root": root, "at_root": at_root,
        "seeded": seeded, "takes_part": takes_part, "derivative_of": derivative_of, "np": np,
        "seed_rate": lambda x: float(of(x)[-1]) if isinstance(x, Dual) else 0.0,
        "largest": lambda x: float(np.max(np.abs(of(x)))) if isinstance(x, Dual) else 0.0,
    }  # fmt: skip
    texts = [_Printed(function, held, plain).text() for function in functions for plain in (True, False)]
    exec(compile("\n".join(texts), "kernel with derivatives", "exec"), known)
    found: Callable[[Table], int] = known[_named(functions[-1], plain=False)]
    return found


def _named(function: tree.Function, plain: bool) -> str:
    return f"{'plain' if plain else 'dual'}_{function.symbol.replace('.', '_')}"


class _Printed:
    """One function in Python; `plain`: without derivatives."""

    def __init__(self, function: tree.Function, held: Collection[str], plain: bool) -> None:
        self.function, self.held, self.plain = function, held, plain
        self.lines: list[str] = []
        self.count = 0

    def text(self) -> str:
        given = ", ".join(f"v_{name}" for name in self.function.arguments)
        self.block(self.function.body, 1)
        return "\n".join([f"def {_named(self.function, self.plain)}({given}):", *self.lines, "    return", ""])

    def add(self, depth: int, line: str) -> None:
        self.lines.append("    " * depth + line)

    def fresh(self) -> str:
        self.count += 1
        return f"t_{self.count}"

    def block(self, statements: Sequence[tree.Statement], depth: int) -> None:
        for statement in statements:
            self.statement(statement, depth)
        self.add(depth, "pass")

    def statement(self, node: tree.Statement, depth: int) -> None:
        match node:
            case tree.Do(value):
                self.add(depth, self.value(value))
            case tree.Assign(targets, value):
                name = self.fresh()
                self.add(depth, f"{name} = {self.value(value)}")
                for target in targets:
                    self.assign(depth, target, name)
            case tree.Update(target, operator, value, kind):
                array, place = self.fresh(), self.fresh()
                self.add(depth, f"{array} = {self.array(target)}; {place} = {self.value(target.index)}")
                changed = self.operation(operator, f"{array}[{place}]", self.value(value), kind)
                self.add(depth, f"{array}[{place}] = {self.stored(target, changed)}")
            case tree.Return(value):
                self.add(depth, "return" if value is None else f"return {self.value(value)}")
            case tree.If(test, yes, no):
                self.add(depth, f"if {self.value(test)}:")
                self.block(yes, depth + 1)
                self.add(depth, "else:")
                self.block(no, depth + 1)
            case tree.While(test, body):
                self.add(depth, f"while {self.value(test)}:")
                self.block(body, depth + 1)
            case tree.Range(target, first, last, step, body):
                self.add(depth, f"for v_{target.name} in range({self.value(first)}, {self.value(last)}, {step}):")
                self.block(body, depth + 1)
            case tree.Break():
                self.add(depth, "break")
            case tree.Continue():
                self.add(depth, "continue")
            case _:
                raise TypeError(node)

    def assign(self, depth: int, target: tree.Local | tree.Element, value: str) -> None:
        if isinstance(target, tree.Local):
            self.add(depth, f"v_{target.name} = {value}")
        else:
            self.add(depth, f"{self.array(target)}[{self.value(target.index)}] = {self.stored(target, value)}")

    def is_plain(self, node: tree.Element) -> bool:
        return self.plain or TangentBody.is_held(node)

    def array(self, node: tree.Element) -> str:
        """What an element is read from and written to: a pair, or an array of numbers."""
        found = self.value(node.array)
        return f"{found}.values" if not self.plain and node.kind == "real" and self.is_plain(node) else found

    def stored(self, node: tree.Element, value: str) -> str:
        return f"value_of({value})" if self.is_plain(node) and not self.plain else value

    def value(self, node: tree.Expression) -> str:
        match node:
            case tree.Number(value, kind):
                if kind == "real":
                    return f"np.float64('{float(value)!r}')" if not math.isfinite(value) else repr(float(value))
                return str(bool(value)) if kind == "bool" else str(int(value))
            case tree.Local(name, _):
                return f"v_{name}"
            case tree.Field(record, name, kind):
                if self.plain:
                    return f"{self.value(record)}.{name}"
                return f"{self.value(record)}.{f'pair({name!r})' if kind == 'reals' else f'kernel.{name}'}"
            case tree.Element(_, index, _, _):
                return f"{self.array(node)}[{self.value(index)}]"
            case tree.Convert(value, kind):
                word = {"bool": "({} != 0)", "int": "int({})"}.get(kind, "{}")
                return word.format(self.value(value))
            case tree.Operation(operator, left, right, kind):
                return self.operation(operator, self.value(left), self.value(right), kind)
            case tree.Unary(operator, value, _):
                word = {"not": "(not {})", "-": "(-{})", "abs": "abs({})", "sqrt": "root({})"}[operator]
                return word.format(self.value(value))
            case tree.Compare(first, rest):
                return f"({self.value(first)} {' '.join(f'{sign} {self.value(each)}' for sign, each in rest)})"
            case tree.Junction(every, conditions):
                return f"({(' and ' if every else ' or ').join(self.value(each) for each in conditions)})"
            case tree.Choice(test, yes, no, _):
                return f"({self.value(yes)} if {self.value(test)} else {self.value(no)})"
            case tree.Extreme(operator, values, _):
                return f"{'max' if operator == '>' else 'min'}({', '.join(self.value(each) for each in values)})"
            case tree.Call():
                return self.call(node)
            case tree.Evaluate(kernel, number, inputs, out):
                table, target = self.value(kernel), self.value(out)
                if not self.plain:
                    given = "None" if inputs is None else self.value(inputs)
                    return f"{table}.evaluate({self.value(number)}, {given}, {target})"
                block = f"{table}.block" if inputs is None else self.value(inputs)
                return f"{table}.code[{self.value(number)}]({block}, {table}.params, {target})"
        raise TypeError(node)

    def call(self, node: tree.Call) -> str:
        given = [self.value(argument) for argument in node.arguments]
        word = node.function.symbol.split(".")[1] if node.function.symbol.startswith("rules.") else ""
        if not self.plain:
            if word in ("seeded", "at_root", "seed_rate", "takes_part", "derivative_of"):
                return f"{word}({', '.join(given)})"
            own = {"without_tangent": "value_of({})", "is_differentiated": "True", "largest_derivative": "largest({})"}
            if word in own:
                return own[word].format(*given)
            if is_called_plain(node.function, self.held):
                ways = {"kernel": "{}.kernel", "reals": "{}.values", "real": "value_of({})"}
                kinds = node.function.arguments.values()
                given = [ways.get(kind, "{}").format(each) for kind, each in zip(kinds, given, strict=True)]
                return f"{_named(node.function, plain=True)}({', '.join(given)})"
        return f"{_named(node.function, self.plain)}({', '.join(given)})"

    @staticmethod
    def operation(operator: str, a: str, b: str, kind: str) -> str:
        if kind == "real" and operator == "/":
            return f"(as_real({a}) / {b})"
        return f"power({a}, {b})" if operator == "**" and kind == "real" else f"({a} {operator} {b})"
