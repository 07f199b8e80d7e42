"""Sympy expressions in the names of quantities: ``cos(theta)`` needs no list of what it depends on."""

import inspect
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any


def is_expression(value: Any) -> bool:
    """Whether a value is a sympy expression, with symbols or without."""
    sympy = sys.modules.get("sympy")
    return sympy is not None and isinstance(value, sympy.Expr)


def plain(expression: Any) -> Any:
    """An expression with the symbols ``theta`` and ``theta_rate`` in place of ``theta(t)`` and its derivative."""
    if not is_expression(expression):
        return expression
    import sympy
    from sympy.core.function import AppliedUndef

    t = sympy.Symbol("t")
    functions = {f: f.func.__name__ for f in expression.atoms(AppliedUndef) if f.args == (t,)}
    rates = {sympy.Derivative(f, t): sympy.Symbol(f"{name}_rate") for f, name in functions.items()}
    return expression.subs(rates).subs({f: sympy.Symbol(name) for f, name in functions.items()})


def quantities_in(functions: Sequence[Any]) -> tuple[str, ...]:
    """Names of what some functions depend on: symbols of expressions, arguments of the first Python function."""
    found: dict[str, None] = {}
    for function in functions:
        if is_expression(function):
            found |= dict.fromkeys(sorted(str(symbol) for symbol in function.free_symbols))
        elif not found and (inspect.isfunction(function) or inspect.ismethod(function)):
            found |= dict.fromkeys(inspect.signature(function).parameters)
    return tuple(found)


def evaluated(expression: Any, named: Mapping[str, float]) -> float:
    """The value of an expression of named quantities."""
    names, function = function_of_expression(expression)
    return float(function(*[named[name] for name in names]))


@lru_cache(maxsize=256)
def function_of_expression(expression: Any) -> tuple[tuple[str, ...], Callable[..., Any]]:
    """The names of the symbols of an expression, and the function of them; making it takes a millisecond."""
    import sympy

    symbols = sorted(expression.free_symbols, key=str)
    return tuple(map(str, symbols)), sympy.lambdify(symbols, expression, "math")
