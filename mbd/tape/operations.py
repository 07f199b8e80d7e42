"""What every operation of the tape does to floats.

``min``, ``max`` and ``sign`` of a nan are nan, ``sign(0) = 0``; conditions are 1.0 or 0.0, false for a nan. The values
of UNARY and BINARY raise as `math` does; `value` never raises and follows IEEE 754.
"""

import math
import operator
from collections.abc import Callable
from typing import Any


def _sign(x: float) -> float:
    return 1.0 if x > 0.0 else -1.0 if x < 0.0 else x + 0.0


UNARY: dict[str, Callable[[Any], Any]] = {
    "sqrt": math.sqrt, "sin": math.sin, "cos": math.cos, "tan": math.tan, "asin": math.asin, "acos": math.acos,
    "atan": math.atan, "sinh": math.sinh, "cosh": math.cosh, "tanh": math.tanh, "exp": math.exp, "log": math.log,
    "abs": abs, "floor": lambda x: math.floor(x) + 0.0, "sign": _sign, "not": lambda x: not x,
}  # fmt: skip
"""Operations of one argument and their value on floats."""

BINARY: dict[str, Callable[[Any, Any], Any]] = {
    "atan2": math.atan2, "pow": math.pow,
    "min": lambda x, y: x if x < y or x != x else y, "max": lambda x, y: x if x > y or x != x else y,
    "lt": operator.lt, "le": operator.le, "and": lambda x, y: x and y, "or": lambda x, y: x or y,
}  # fmt: skip
"""Operations of two arguments besides add, sub, mul, div."""

ARITHMETIC: dict[str, Callable[..., Any]] = {
    "add": operator.add, "sub": operator.sub, "mul": operator.mul, "div": operator.truediv, "neg": operator.neg,
    "where": lambda condition, yes, no: yes if condition else no,
}  # fmt: skip
"""The operations that fold by rules of their own."""

CONDITIONS = frozenset({"lt", "le", "and", "or", "not"})
"""Operations whose value is true or false; only ``where`` takes them."""

ODD = frozenset({"sin", "tan", "asin", "atan", "sinh", "tanh", "sign"})
"""``f(-x) = -f(x)``"""

EVEN = frozenset({"cos", "cosh", "abs"})
"""``f(-x) = f(x)``"""

_ALL: dict[str, Callable[..., Any]] = {**UNARY, **BINARY, **ARITHMETIC}

_NUMPY = {"div": "divide", "pow": "power"}
"""numpy's names of operations that are not its own."""


def value(op: str, *args: float) -> float:
    """The float that an operation gives: infinite or nan where `math` would raise.

    >>> value("div", 1.0, 0.0), value("log", -1.0), value("exp", 1e3), value("lt", 1.0, 2.0)
    (inf, nan, inf, 1.0)
    """
    try:
        return float(_ALL[op](*args))
    except (ValueError, OverflowError, ZeroDivisionError):
        import numpy as np

        with np.errstate(all="ignore"):
            return float(getattr(np, _NUMPY.get(op, op))(*args))
