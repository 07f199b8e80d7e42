"""Lowering sympy expressions to the tape, and raising tape nodes to sympy for printing.

sympy is the symbolic face only; it is imported inside the functions and stays out of the derivation.
"""

import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from mbd.errors import TraceError, nearest
from mbd.tape.derivatives import live
from mbd.tape.node import Node, Scalar, Tape
from mbd.tape.operations import ARITHMETIC


def lower(expression: Any, symbols: Mapping[Any, Scalar], tape: Tape) -> Node:
    """The tape node of a sympy expression.

    Parameters
    ----------
    expression : a real sympy expression; Piecewise, Min, Max, Heaviside and relations included
    symbols : the scalar of every symbol; keys may be any sympy expressions, such as ``theta(t)`` or its derivative.
        A symbol that differs in its assumptions only is matched by its name
    tape : where it is recorded; subexpressions that occur twice are recorded once
    """
    import sympy

    known: dict[Any, Node] = {symbol: tape.lift(value) for symbol, value in symbols.items()}
    by_name = {str(getattr(symbol, "name", symbol)): node for symbol, node in known.items()}
    root = sympy.sympify(expression)
    pending = [root]
    while pending:
        part = pending[-1]
        if part in known:
            pending.pop()
            continue
        operands = _operands(part)
        missing = [operand for operand in operands if operand not in known]
        if missing:
            pending.extend(reversed(missing))
            continue
        known[part] = _build(part, [known[operand] for operand in operands], by_name, tape)
        pending.pop()
    return known[root]


def _operands(part: Any) -> tuple[Any, ...]:
    """The subexpressions whose nodes `_build` wants, in its order."""
    import sympy

    if isinstance(part, sympy.Piecewise):
        return tuple(side for piece in part.args for side in piece.args)
    if isinstance(part, sympy.Mul):
        above, below = _fraction(part)
        return (*above, *below)
    if isinstance(part, sympy.Pow) and part.base is sympy.E:
        return (part.exp,)
    if isinstance(part, sympy.Heaviside):
        return tuple(part.args[:2])
    if part.is_Function and type(part).__name__ not in _FUNCTIONS:
        return ()
    return () if isinstance(part, sympy.Derivative) else tuple(part.args)


def _fraction(product: Any) -> tuple[list[Any], list[Any]]:
    """Factors above and below the fraction line; numbers stay above."""
    import sympy

    above, below = [], []
    for factor in product.args:
        if isinstance(factor, sympy.Pow) and factor.exp.could_extract_minus_sign() and factor.base is not sympy.E:
            below.append(sympy.Pow(factor.base, -factor.exp))
        else:
            above.append(factor)
    return above, below


def _build(part: Any, args: list[Node], by_name: Mapping[str, Node], tape: Tape) -> Node:
    """One sympy operation on nodes."""
    import sympy

    if part.is_Symbol or isinstance(part, sympy.core.function.AppliedUndef):
        name = part.name
        if name in by_name:
            return by_name[name]
        if part.is_Symbol:
            raise TraceError(nearest(name, by_name, "symbol", "Given are"))
    if (part.is_Number or part.is_NumberSymbol) and part.is_comparable:
        return tape.constant(float(part))
    if part in (sympy.true, sympy.false):
        return tape.constant(1.0 if part == sympy.true else 0.0)
    if part.is_Add:
        return _chain(tape.add, args)
    if part.is_Mul:
        above = len(_fraction(part)[0])
        numerator = _chain(tape.mul, args[:above]) if above else tape.one
        return tape.div(numerator, _chain(tape.mul, args[above:])) if len(args) > above else numerator
    if part.is_Pow:
        return tape.unary("exp", args[0]) if len(args) == 1 else tape.power(args[0], args[1])
    if isinstance(part, sympy.Piecewise):
        result = tape.constant(float("nan"))
        for value, condition in zip(args[-2::-2], args[-1::-2], strict=True):
            result = tape.where(condition, value, result)
        return result
    rule = _FUNCTIONS.get(type(part).__name__)
    if rule is None:
        raise TraceError(_unknown(part))
    return rule(tape, args)


def _unknown(part: Any) -> str:
    """Why a sympy object cannot be lowered, and what to try."""
    kind = type(part).__name__
    if part.is_number and not part.is_real:
        return f"it contains {part}, which is not a real number"
    if kind in ("Derivative", "re", "im", "arg", "conjugate", "Subs"):
        return (
            f"sympy left '{part}' unevaluated; declare the symbols real, sympy.Symbol('x', real=True), "
            "call .doit(), or give a value for it among the symbols"
        )
    relations = ("StrictLessThan", "LessThan", "StrictGreaterThan", "GreaterThan", "Equality", "Unequality")
    known = ", ".join(sorted(name for name in _FUNCTIONS if name not in relations))
    return f"the sympy function '{kind}' in '{part}' is not recorded; known are {known}, Piecewise and relations"


def _chain(operation: Callable[[Scalar, Scalar], Node], args: Sequence[Node]) -> Node:
    result = args[0]
    for arg in args[1:]:
        result = operation(result, arg)
    return result


Rule = Callable[[Tape, list[Node]], Node]


def _unary(op: str) -> Rule:
    return lambda tape, args: tape.unary(op, args[0])


def _many(op: str) -> Rule:
    return lambda tape, args: _chain(lambda a, b: tape.binary(op, a, b), args)


def _relation(op: str, *, swap: bool = False) -> Rule:
    return lambda tape, args: tape.binary(op, args[1], args[0]) if swap else tape.binary(op, args[0], args[1])


def _equal(tape: Tape, args: list[Node]) -> Node:
    return tape.binary("and", tape.binary("le", args[0], args[1]), tape.binary("le", args[1], args[0]))


def _heaviside(tape: Tape, args: list[Node]) -> Node:
    x, at_zero = args
    positive = tape.where(tape.binary("lt", 0.0, x), 1.0, at_zero)
    return tape.where(tape.binary("lt", x, 0.0), 0.0, positive)


def _log_of(expression: Callable[[Node, Tape], Node]) -> Rule:
    return lambda tape, args: tape.unary("log", expression(args[0], tape))


def _asinh(tape: Tape, args: list[Node]) -> Node:
    """log(|x| + √(x² + 1)) with the sign of x: x + √(x² + 1) loses its digits far below 0."""
    x, root = args[0], tape.unary("sqrt", args[0] * args[0] + 1.0)
    return tape.where(x < 0.0, -tape.unary("log", root - x), tape.unary("log", root + x))


_SAME = ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sign", "floor")
"""Functions that have one name in sympy and on the tape."""

_FUNCTIONS: dict[str, Rule] = {
    **{op: _unary(op) for op in _SAME},
    "Abs": _unary("abs"),
    "Mod": lambda tape, args: tape.remainder(args[0], args[1]),
    "atan2": lambda tape, args: tape.binary("atan2", args[0], args[1]),
    "Min": _many("min"),
    "Max": _many("max"),
    "And": _many("and"),
    "Or": _many("or"),
    "Not": _unary("not"),
    "StrictLessThan": _relation("lt"),
    "LessThan": _relation("le"),
    "StrictGreaterThan": _relation("lt", swap=True),
    "GreaterThan": _relation("le", swap=True),
    "Equality": _equal,
    "Unequality": lambda tape, args: tape.unary("not", _equal(tape, args)),
    "Heaviside": _heaviside,
    "sec": lambda tape, args: tape.div(1.0, tape.unary("cos", args[0])),
    "csc": lambda tape, args: tape.div(1.0, tape.unary("sin", args[0])),
    "cot": lambda tape, args: tape.div(1.0, tape.unary("tan", args[0])),
    "asinh": _asinh,
    "acosh": _log_of(lambda x, tape: x + tape.unary("sqrt", x * x - 1.0)),
    "atanh": lambda tape, args: 0.5 * tape.unary("log", (1.0 + args[0]) / (1.0 - args[0])),
}
"""Lowering of every sympy operation by the name of its class."""


def raise_to_sympy(nodes: Sequence[Node], names: Mapping[Node, Any] | None = None) -> list[Any]:
    """The nodes as sympy expressions, for printing and for checks.

    Parameters
    ----------
    nodes : what to raise
    names : the name or sympy symbol of a node, inputs or any others; inputs without a name become ``q0``, ``v1``, ``t``
    """
    import sympy

    from mbd.tape.printing import input_name

    raised: dict[int, Any] = {}
    for node, name in (names or {}).items():
        raised[node.index] = sympy.Symbol(name, real=True) if isinstance(name, str) else name
    for node in live(nodes, raised):
        if node.index in raised:
            continue
        if node.op == "input":
            raised[node.index] = sympy.Symbol(input_name(node), real=True)
        elif node.op == "const":
            raised[node.index] = _number(node.data)
        else:
            raised[node.index] = _expression(node, [raised[arg.index] for arg in node.args])
    return [raised[node.index] for node in nodes]


def _number(value: float) -> Any:
    """A short exact fraction where there is one, else the float."""
    import sympy

    if abs(value) < 1e6 and (value * 64.0).is_integer():
        return sympy.Rational(int(value * 64.0), 64)
    return sympy.Float(value)


def _expression(node: Node, args: list[Any]) -> Any:
    """One tape operation on sympy expressions."""
    import sympy

    op = node.op
    if op == "table":
        table, order = node.data
        return sympy.Function(table.name + "'" * order, real=True)(*args)
    if op == "where":
        return sympy.Piecewise((args[1], args[0]), (args[2], True))
    if op in ARITHMETIC or op == "pow":
        return (operator.pow if op == "pow" else ARITHMETIC[op])(*args)
    heads = {
        "abs": sympy.Abs, "min": sympy.Min, "max": sympy.Max, "lt": sympy.Lt, "le": sympy.Le, "and": sympy.And,
        "or": sympy.Or, "not": sympy.Not,
    }  # fmt: skip
    return heads[op](*args) if op in heads else getattr(sympy, op)(*args)
