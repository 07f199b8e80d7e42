"""Typed trees of the kernel → C: a second target beside LLVM, which shows what a target is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from mbd.kernel.records import TABLE
from mbd.kernel.translation import tree

__all__ = ["c_text"]

C = {
    "bool": "int", "int": "int64_t", "real": "double", "ints": "int64_t *", "reals": "double *", "kernel": "int64_t *",
    "none": "void",
}  # fmt: skip
PLACES = {field: place for place, field in enumerate(TABLE.addresses)}
HEAD = """\
#include <math.h>
#include <stdint.h>
#include <string.h>

typedef void model(double *, double *, double *);
static double real_at(int64_t *table, int place) { double x; memcpy(&x, table + place, 8); return x; }
static int64_t floor_mod_i(int64_t a, int64_t b) { int64_t r = a % b; return r && (r < 0) != (b < 0) ? r + b : r; }
static int64_t floor_div_i(int64_t a, int64_t b) { return (a - floor_mod_i(a, b)) / b; }
static double floor_mod_r(double a, double b)
{
    double r = fmod(a, b);
    return !(r != 0.0) ? copysign(0.0, b) : (r < 0.0) != (b < 0.0) ? r + b : r;
}
static int64_t abs_i(int64_t a) { return a < 0 ? -a : a; }
"""


def c_text(functions: Sequence[tree.Function], entry: str) -> str:
    """C source of some functions, of which the last is called from outside, by the name `entry`."""
    bodies = [_function(function, entry if function is functions[-1] else "") for function in functions]
    return "\n".join([HEAD, *bodies])


def _name(function: tree.Function) -> str:
    return function.symbol.replace(".", "_")


def _function(function: tree.Function, entry: str) -> str:
    given = ", ".join(f"{C[kind]} v_{name}" for name, kind in function.arguments.items())
    head = f"{'' if entry else 'static '}{C[function.result]} {entry or _name(function)}({given})"
    own = [f"    {C[kind]} v_{name};" for name, kind in function.locals.items() if name not in function.arguments]
    return "\n".join([head, "{", *own, *_block(function.body), "}", ""])


def _block(statements: Sequence[tree.Statement]) -> list[str]:
    return ["    " + line for statement in statements for line in _statement(statement)]


def _statement(node: tree.Statement) -> list[str]:
    match node:
        case tree.Do(value):
            return [f"{_value(value)};"]
        case tree.Assign(targets, value):
            found = [f"{C[value.kind]} found = {_value(value)};"] + [f"{_value(target)} = found;" for target in targets]
            return ["{", *found, "}"]
        case tree.Update(target, operator, value, kind):
            changed = _operation(operator, "*place", _value(value), kind)
            return [f"{{ {C[target.kind]} *place = &{_value(target)}; *place = {changed}; }}"]
        case tree.Return(value):
            return ["return;" if value is None else f"return {_value(value)};"]
        case tree.If(test, yes, no):
            return [f"if ({_value(test)}) {{", *_block(yes), "} else {", *_block(no), "}"]
        case tree.While(test, body):
            return [f"while ({_value(test)}) {{", *_block(body), "}"]
        case tree.Range(target, first, last, step, body):
            count = (
                f"int64_t at = {_value(first)}, last = {_value(last)}; at {'<' if step > 0 else '>'} last; at += {step}"
            )
            return [f"for ({count}) {{", f"    {_value(target)} = at;", *_block(body), "}"]
        case tree.Break():
            return ["break;"]
        case tree.Continue():
            return ["continue;"]
    raise TypeError(node)


def _value(node: tree.Expression) -> str:
    match node:
        case tree.Number(value, kind):
            if kind == "real":
                return (
                    f"({float(value).hex()})"
                    if abs(value) < float("inf")
                    else ("INFINITY" if value > 0 else "-INFINITY")
                )
            return str(int(value)) + ("LL" if kind == "int" else "")
        case tree.Local(name, _):
            return f"v_{name}"
        case tree.Field(record, name, kind):
            if kind == "real":
                return f"real_at({_value(record)}, {PLACES[name]})"
            return f"(({C[kind]})({_value(record)})[{PLACES[name]}])"
        case tree.Element(array, index, _, _):
            return f"({_value(array)})[(int64_t)({_value(index)})]"
        case tree.Convert(value, kind):
            return f"(({_value(value)}) != 0)" if kind == "bool" else f"(({C[kind]})({_value(value)}))"
        case tree.Operation(operator, left, right, kind):
            return _operation(operator, _value(left), _value(right), kind)
        case tree.Unary("not", value, _):
            return f"(!({_value(value)}))"
        case tree.Unary("-", value, _):
            return f"(-({_value(value)}))"
        case tree.Unary(operator, value, kind):
            return f"{'sqrt' if operator == 'sqrt' else 'fabs' if kind == 'real' else 'abs_i'}({_value(value)})"
        case tree.Compare(first, rest):
            values = [_value(first), *(_value(value) for _, value in rest)]
            parts = [f"({a}) {rest[k][0]} ({b})" for k, (a, b) in enumerate(pairwise(values))]
            return f"({' && '.join(parts)})"
        case tree.Junction(every, conditions):
            return f"({(' && ' if every else ' || ').join(f'({_value(condition)})' for condition in conditions)})"
        case tree.Choice(test, yes, no, kind):
            return f"(({_value(test)}) ? ({C[kind]})({_value(yes)}) : ({C[kind]})({_value(no)}))"
        case tree.Extreme(operator, values, kind):
            found = f"(({C[kind]})({_value(values[0])}))"
            for value in values[1:]:
                found = f"({{ {C[kind]} best = {found}, next = {_value(value)}; next {operator} best ? next : best; }})"
            return found
        case tree.Call(function, arguments, _):
            return f"{_name(function)}({', '.join(_value(argument) for argument in arguments)})"
        case tree.Evaluate(kernel, number, inputs, out):
            table = _value(kernel)
            code, params, block = (f"({table})[{PLACES[name]}]" for name in ("code", "params", "block"))
            given = f"(double *){block}" if inputs is None else _value(inputs)
            return f"((model *)((int64_t *){code})[{_value(number)}])({given}, (double *){params}, {_value(out)})"
    raise TypeError(node)


def _operation(operator: str, left: str, right: str, kind: str) -> str:
    a, b = f"(({C[kind]})({left}))", f"(({C[kind]})({right}))"
    if operator in ("//", "%"):
        return f"floor_{'div' if operator == '//' else 'mod'}_{'r' if kind == 'real' else 'i'}({a}, {b})"
    return f"pow({a}, {b})" if operator == "**" else f"({a} {operator} {b})"
