"""C99 text of functions: of typed trees (`mbd.trees.tree`), and of straight ones (`compile.lowering.Target`).

Compiled with ``-ffp-contract=off`` (gcc contracts by default) it gives the bits of LLVM's code, where that does
without fused multiply-add, which is used in sines and cosines only. C may compute the operands of an operation in
any order; of the kernel's functions no two that stand in one expression change what the other reads.
"""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise

from mbd.trees import tree
from mbd.trees.trigonometry import sincos_in_c

C = {
    "bool": "int", "int": "int64_t", "real": "double", "ints": "int64_t *", "reals": "double *", "kernel": "int64_t *",
    "none": "void",
}  # fmt: skip
HEAD = f"""\
#include <math.h>
#include <stdint.h>
#include <string.h>

typedef void model(const double *, const double *, double *);
static double (*volatile const power)(double, double) = pow; /* never x * x */
static double real_at(const int64_t *table, int place) {{ double x; memcpy(&x, table + place, 8); return x; }}
static int64_t floor_mod_i(int64_t a, int64_t b) {{ int64_t r = a % b; return r && (r < 0) != (b < 0) ? r + b : r; }}
static int64_t floor_div_i(int64_t a, int64_t b) {{ return (a - floor_mod_i(a, b)) / b; }}
static double floor_mod_r(double a, double b)
{{
    double r = fmod(a, b);
    return !(r != 0.0) ? copysign(0.0, b) : (r < 0.0) != (b < 0.0) ? r + b : r;
}}
static int64_t abs_i(int64_t a) {{ return a < 0 ? -a : a; }}
static int64_t larger_i(int64_t a, int64_t b) {{ return b > a ? b : a; }}
static int64_t smaller_i(int64_t a, int64_t b) {{ return b < a ? b : a; }}
static double larger_r(double a, double b) {{ return b > a ? b : a; }}
static double smaller_r(double a, double b) {{ return b < a ? b : a; }}
static int64_t piece(const double *breaks, int64_t n, double x) /* number of the last one not above x, at least 0 */
{{
    int64_t low = 0;
    for (; n > 1; n -= n / 2)
        if (!(x < breaks[low + n / 2])) low += n / 2;
    return low;
}}
{sincos_in_c()}
"""
"""What functions call; it stands before them once."""


def c_text(functions: Sequence[tree.Function], entry: str, places: Mapping[str, int]) -> str:
    """C source of some functions, of which the last is called from outside, by the name `entry`; `HEAD` goes before it.

    Parameters
    ----------
    places : of the record's fields in its table, of 8 bytes each
    """
    return "\n".join(_Functions(places).function(each, entry if each is functions[-1] else "") for each in functions)


class Straight:
    """A function without branches or loops on arrays of reals that share no number, written by the verbs of `Target`.

    Parameters
    ----------
    symbol, arguments : its name, in which dots become underscores, and those of the arrays
    """

    def __init__(self, symbol: str, arguments: Sequence[str], apart: bool = False) -> None:
        self.symbol, self.arguments, self.apart = symbol.replace(".", "_"), arguments, apart
        self.lines, self.data = list[str](), list[str]()

    def text(self) -> str:
        """The function."""
        kinds = {"table": "const int *", "out": "double *", "work": "double *"}
        given = (f"{kinds.get(name, 'const double *')}restrict {name}" for name in self.arguments)
        head = f"{'static ' if self.apart else ''}void {self.symbol}({', '.join(given)})"
        return "\n".join([*self.data, head, "{", *self.lines, "}", ""])

    def let(self, kind: str, expression: str) -> str:
        name = f"v{len(self.lines)}"
        self.lines.append(f"    const {kind} {name} = {expression};")
        return name

    def number(self, value: float) -> str:
        return _real(value)

    def load(self, array: str, place: int) -> str:
        return self.let("double", f"{array}[{place}]")

    def store(self, value: str, array: str, place: int) -> None:
        self.lines.append(f"    {array}[{place}] = {value};")

    def clear(self, array: str, first: int, count: int) -> None:
        self.lines.append(f"    for (int k = {first}; k < {first + count}; k++) {array}[k] = 0.0;")

    def arithmetic(self, sign: str, a: str, b: str) -> str:
        return self.let("double", f"{a} {sign} {b}")

    def unary(self, operator: str, operand: str, kind: str) -> str:
        return self.let(
            "double", f"-{operand}" if operator == "-" else f"{'fabs' if operator == 'abs' else 'sqrt'}({operand})"
        )

    def floor(self, x: str) -> str:
        return self.let("double", f"floor({x})")

    def library(self, name: str, *operands: str) -> str:
        return self.let("double", f"{'power' if name == 'pow' else name}({', '.join(operands)})")

    def compare(self, sign: str, a: str, b: str) -> str:
        return self.let("int", f"{a} {sign} {b}")

    def join(self, word: str, a: str, b: str) -> str:
        return self.let("int", f"{a} {'&' if word == 'and' else '|'} {b}")

    def negate(self, flag: str) -> str:
        return self.let("int", f"!{flag}")

    def select(self, flag: str, yes: str, no: str) -> str:
        return self.let("double", f"{flag} ? {yes} : {no}")

    def cast(self, value: tuple[str, str], kind: str) -> str:
        return self.let(C[kind], f"{value[0]} != 0.0" if kind == "bool" else value[0])

    def piece(self, array: str, first: int, count: int, x: str) -> str:
        return self.let("int64_t", f"piece({array} + {first}, {count}, {x})")

    def load_from(self, array: str, first: int, step: int, number: str) -> str:
        return self.let("double", f"{array}[{first} + {step} * {number}]")

    def sines_and_cosines(self, angles: Sequence[str]) -> tuple[list[str], list[str]]:
        sines, cosines = list[str](), list[str]()
        for x in angles:
            number = len(self.lines)
            self.lines.append(f"    double s{number}, c{number};\n    sine_and_cosine({x}, &s{number}, &c{number});")
            sines.append(f"s{number}")
            cosines.append(f"c{number}")
        return sines, cosines

    def room(self, name: str, size: int) -> None:
        self.lines.append(f"    double {name}[{size}];")

    def call(self, symbol: str, arrays: Sequence[str]) -> None:
        self.lines.append(f"    {symbol.replace('.', '_')}({', '.join(arrays)});")

    def load_at(self, array: str, entry: int) -> str:
        return self.let("double", f"{array}[table[{entry}]]")

    def store_at(self, value: str, array: str, entry: int) -> None:
        self.lines.append(f"    {array}[table[{entry}]] = {value};")

    def table(self, numbers: Sequence[int]) -> None:
        self.data.append(f"static const int {self.symbol}_table[] = {{{', '.join(map(str, numbers))}}};")

    def call_at(self, symbol: str, arrays: Sequence[str], entry: int) -> None:
        self.call(symbol, [*arrays, f"{self.symbol}_table + {entry}"])


def _real(value: float) -> str:
    if math.isnan(value):
        return "NAN"
    text = "INFINITY" if math.isinf(value) else abs(value).hex()
    return f"(-{text})" if math.copysign(1.0, value) < 0.0 else text


def _name(function: tree.Function) -> str:
    return function.symbol.replace(".", "_")


class _Functions:
    """Writes functions from their trees."""

    def __init__(self, places: Mapping[str, int]) -> None:
        self.places = places

    def function(self, function: tree.Function, entry: str) -> str:
        given = ", ".join(f"{C[kind]} v_{name}" for name, kind in function.arguments.items())
        head = f"{'' if entry else 'static '}{C[function.result]} {entry or _name(function)}({given})"
        own = [f"    {C[kind]} v_{name};" for name, kind in function.locals.items() if name not in function.arguments]
        return "\n".join([head, "{", *own, *self.block(function.body), "}", ""])

    def block(self, statements: Sequence[tree.Statement]) -> list[str]:
        return ["    " + line for statement in statements for line in self.statement(statement)]

    def statement(self, node: tree.Statement) -> list[str]:
        match node:
            case tree.Do(value):
                return [f"{self.value(value)};"]
            case tree.Assign(targets, value):
                found = [f"{C[value.kind]} found = {self.value(value)};"] + [
                    f"{self.value(target)} = found;" for target in targets
                ]
                return ["{", *found, "}"]
            case tree.Update(target, operator, value, kind):
                changed = self.operation(operator, "*place", self.value(value), kind)
                return [f"{{ {C[target.kind]} *place = &{self.value(target)}; *place = {changed}; }}"]
            case tree.Return(value):
                return ["return;" if value is None else f"return {self.value(value)};"]
            case tree.If(test, yes, no):
                return [f"if ({self.value(test)}) {{", *self.block(yes), "} else {", *self.block(no), "}"]
            case tree.While(test, body):
                return [f"while ({self.value(test)}) {{", *self.block(body), "}"]
            case tree.Range(target, first, last, step, body):
                sign, bounds = "<" if step > 0 else ">", f"at = {self.value(first)}, last = {self.value(last)}"
                return [
                    f"for (int64_t {bounds}; at {sign} last; at += {step}) {{",
                    f"    {self.value(target)} = at;",
                    *self.block(body),
                    "}",
                ]
            case tree.Break():
                return ["break;"]
            case tree.Continue():
                return ["continue;"]
        raise TypeError(node)

    def value(self, node: tree.Expression) -> str:
        match node:
            case tree.Number(value, kind):
                if kind == "real":
                    return _real(value)
                return str(int(value)) + ("LL" if kind == "int" else "")
            case tree.Local(name, _):
                return f"v_{name}"
            case tree.Field(record, name, kind):
                if kind == "real":
                    return f"real_at({self.value(record)}, {self.places[name]})"
                return f"(({C[kind]})({self.value(record)})[{self.places[name]}])"
            case tree.Element(array, index, _, _):
                return f"({self.value(array)})[(int64_t)({self.value(index)})]"
            case tree.Convert(value, kind):
                return f"(({self.value(value)}) != 0)" if kind == "bool" else f"(({C[kind]})({self.value(value)}))"
            case tree.Operation(operator, left, right, kind):
                return self.operation(operator, self.value(left), self.value(right), kind)
            case tree.Unary("not", value, _):
                return f"(!({self.value(value)}))"
            case tree.Unary("-", value, _):
                return f"(-({self.value(value)}))"
            case tree.Unary(operator, value, kind):
                return f"{'sqrt' if operator == 'sqrt' else 'fabs' if kind == 'real' else 'abs_i'}({self.value(value)})"
            case tree.Compare(first, rest):
                values = [self.value(first), *(self.value(value) for _, value in rest)]
                parts = [f"({a}) {rest[k][0]} ({b})" for k, (a, b) in enumerate(pairwise(values))]
                return f"({' && '.join(parts)})"
            case tree.Junction(every, conditions):
                word = " && " if every else " || "
                return f"({word.join(f'({self.value(condition)})' for condition in conditions)})"
            case tree.Choice(test, yes, no, kind):
                return f"(({self.value(test)}) ? ({C[kind]})({self.value(yes)}) : ({C[kind]})({self.value(no)}))"
            case tree.Extreme(operator, values, kind):
                found = self.value(values[0])
                for value in values[1:]:
                    word = f"{'larger' if operator == '>' else 'smaller'}_{'r' if kind == 'real' else 'i'}"
                    found = f"{word}({found}, {self.value(value)})"
                return found
            case tree.Call(function, arguments, _):
                return f"{_name(function)}({', '.join(self.value(argument) for argument in arguments)})"
            case tree.Evaluate(kernel, number, inputs, out):
                table = self.value(kernel)
                code, params, block = (f"({table})[{self.places[name]}]" for name in ("code", "params", "block"))
                given = f"(double *){block}" if inputs is None else self.value(inputs)
                program = f"(model *)((int64_t *){code})[{self.value(number)}]"
                return f"({program})({given}, (double *){params}, {self.value(out)})"
        raise TypeError(node)

    @staticmethod
    def operation(operator: str, left: str, right: str, kind: str) -> str:
        a, b = f"(({C[kind]})({left}))", f"(({C[kind]})({right}))"
        if operator in ("//", "%"):
            return f"floor_{'div' if operator == '//' else 'mod'}_{'r' if kind == 'real' else 'i'}({a}, {b})"
        return f"power({a}, {b})" if operator == "**" else f"({a} {operator} {b})"
