"""Functions of scalars: they record traced values on the tape, and work on floats and arrays as numpy's do."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from mbd.errors import TraceError
from mbd.tape.node import BINARY, UNARY, Node

_ARRAY = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "atan2": "arctan2", "min": "minimum", "max": "maximum"}
"""numpy's names where they differ."""


def _on_arrays(op: str, *values: Any) -> Any:
    """The function on arrays of floats or of traced values."""
    import numpy as np

    name = _ARRAY.get(op, op)
    if any(np.asarray(value).dtype == object for value in values):
        return on_numpy(name, values)
    return getattr(np, name)(*values)


def on_numpy(name: str, values: Sequence[Any]) -> Any:
    """The numpy function called `name` of traced values or arrays of them."""
    import numpy as np

    function = NUMPY.get(name)
    if function is None:
        raise TraceError(f"numpy.{name} is not recorded; known are {', '.join(sorted(NUMPY))}")
    if any(getattr(value, "ndim", 0) for value in values):
        return np.frompyfunc(function, len(values), 1)(*[np.asarray(value, dtype=object) for value in values])
    if any(isinstance(value, complex) for value in values):
        raise TraceError(
            f"numpy.{name} of a complex number and a traced value is not recorded; real numbers are wanted"
        )
    return function(*[value if isinstance(value, Node) else float(value) for value in values])


def _unary(op: str, what: str) -> Callable[[Any], Any]:
    def function(x: Any) -> Any:
        if isinstance(x, Node):
            return x.tape.unary(op, x)
        return _on_arrays(op, x) if getattr(x, "ndim", 0) else UNARY[op](x)

    function.__name__ = function.__qualname__ = op
    function.__doc__ = f"{what} of a traced scalar, a float, or an array."
    return function


def _binary(op: str, name: str, what: str) -> Callable[[Any, Any], Any]:
    def function(x: Any, y: Any) -> Any:
        if getattr(x, "ndim", 0) or getattr(y, "ndim", 0):
            return _on_arrays(op, x, y)
        tape = x.tape if isinstance(x, Node) else y.tape if isinstance(y, Node) else None
        return BINARY[op](x, y) if tape is None else tape.binary(op, x, y)

    function.__name__ = function.__qualname__ = name
    function.__doc__ = f"{what} of two traced scalars, floats, or arrays."
    return function


sin = _unary("sin", "Sine (argument in radians)")
cos = _unary("cos", "Cosine (argument in radians)")
tan = _unary("tan", "Tangent (argument in radians)")
asin = _unary("asin", "Inverse sine [rad]")
acos = _unary("acos", "Inverse cosine [rad]")
atan = _unary("atan", "Inverse tangent [rad]")
sinh = _unary("sinh", "Hyperbolic sine")
cosh = _unary("cosh", "Hyperbolic cosine")
tanh = _unary("tanh", "Hyperbolic tangent")
exp = _unary("exp", "Exponential")
log = _unary("log", "Natural logarithm")
sqrt = _unary("sqrt", "Square root")
sign = _unary("sign", "Sign, −1, 0 or 1,")
floor = _unary("floor", "The largest whole number not above it,")
atan2 = _binary("atan2", "atan2", "Angle of the point (y, x), in that order [rad],")
minimum = _binary("min", "minimum", "The smaller")
maximum = _binary("max", "maximum", "The larger")


pi = math.pi
"""Half the circumference of the unit circle, 3.14159…"""


def clip(x: Any, low: Any, high: Any) -> Any:
    """x held between low and high: ``minimum(maximum(x, low), high)``.

    >>> clip(1.5, -1.0, 1.0), clip(0.2, -1.0, 1.0)
    (1.0, 0.2)
    """
    return minimum(maximum(x, low), high)


def hypot(x: Any, y: Any) -> Any:
    """``sqrt(x² + y²)``, whose derivative at 0 is not finite.

    >>> hypot(3.0, 4.0)
    5.0
    """
    return sqrt(x * x + y * y)


def mod(x: Any, y: Any) -> Any:
    """``x − y ⌊x / y⌋``, x modulo y with the sign of y: the phase of what repeats. It jumps where x / y is whole.

    >>> mod(7.5, 2.0), mod(-0.5, 2.0)
    (1.5, 1.5)
    """
    return x % y


def where(condition: Any, yes: Any, no: Any) -> Any:
    """`yes` where the condition holds, else `no`: the traced form of an ``if``.

    Both branches are evaluated; the one that is not taken may be infinite or not a number.

    >>> where(1.0 < 2.0, 3.0, 4.0)
    3.0
    """
    for value in (condition, yes, no):
        if isinstance(value, Node):
            return value.tape.where(condition, yes, no)
    if any(getattr(value, "ndim", 0) for value in (condition, yes, no)):
        import numpy as np

        return np.where(condition, yes, no)
    return yes if condition else no


NUMPY: dict[str, Callable[..., Any]] = {
    "sqrt": sqrt, "sin": sin, "cos": cos, "tan": tan, "arcsin": asin, "arccos": acos, "arctan": atan, "sinh": sinh,
    "cosh": cosh, "tanh": tanh, "exp": exp, "log": log, "sign": sign, "absolute": abs, "arctan2": atan2,
    "minimum": minimum, "maximum": maximum, "square": lambda x: x * x, "negative": lambda x: -x,
    "add": lambda x, y: x + y, "subtract": lambda x, y: x - y, "multiply": lambda x, y: x * y,
    "divide": lambda x, y: x / y, "power": lambda x, y: x**y, "less": lambda x, y: x < y,
    "less_equal": lambda x, y: x <= y, "greater": lambda x, y: x > y, "greater_equal": lambda x, y: x >= y,
    "floor": floor, "hypot": hypot, "remainder": mod,
}  # fmt: skip
"""The recorded function behind each numpy ufunc name."""

INSTEAD = {
    "interp": "mbd.Samples(time, values), which may be called in a function, or mbd.Tabulated for a loss",
    "piecewise": "mbd.where(condition, x, y)", "select": "mbd.where(condition, x, y)",
}  # fmt: skip
"""What to write for functions of numpy that are not recorded."""


def on_numpy_function(function: Any, args: Sequence[Any], keywords: Mapping[str, Any]) -> Any:
    """A function of numpy, other than a ufunc, that met traced values."""
    name, recorded = function.__name__, {"where": where, "clip": clip}
    if name in recorded and not keywords and len(args) == 3:
        return recorded[name](*args)
    if name in recorded or name in INSTEAD:
        instead = INSTEAD.get(name, f"mbd.{name} with three arguments")
        raise TraceError(f"numpy.{name} of traced values is not recorded; write {instead}")
    return function._implementation(*args, **keywords)
