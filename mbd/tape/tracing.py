"""Users' functions on the tape: plain Python functions of scalars, sympy expressions, or numbers."""

import inspect
import math
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from numbers import Complex, Real
from typing import Any, TypeAlias

from mbd.errors import TraceError
from mbd.tape.node import CONDITIONS, Node, Scalar, Tape
from mbd.tape.sympy import lower

CURVES = re.compile(r"[/\\\\]scipy[/\\\\]interpolate[/\\\\]")
"""Files of the curves of scipy."""

Argument: TypeAlias = tuple[str, Scalar | Sequence[Scalar]]
"""Name and value of what a user's function is called with; a value is a scalar or a triple."""


def traced(
    function: Any,
    arguments: Sequence[Argument],
    what: str,
    tape: Tape,
    parameter: Callable[[float], Scalar] | None = None,
    symbols: Mapping[Any, Scalar] | None = None,
) -> Node | tuple[Node, ...]:
    """What a user's function gives, recorded on the tape.

    Parameters
    ----------
    function : a Python function of scalars, a sympy expression, a number, or a sequence of expressions and numbers
    arguments : (name, scalar or triple) in the order in which a Python function receives them; the symbols of a
        sympy expression are matched by name, those of a triple ``p`` as ``p.x``, ``p.y``, ``p.z``
    what : the user's object, for errors: ``"force of 'push'"``
    parameter : turns a number into a run-time input; without it a number is a constant
    symbols : further sympy symbols and their scalars

    Returns
    -------
    a node, or a tuple of them where the function returns several
    """
    if _is_sympy(function):
        return _lowered(function, arguments, what, tape, symbols or {})
    if isinstance(function, Sequence) and not isinstance(function, str):
        return tuple(traced_scalar(part, arguments, what, tape, parameter, symbols) for part in function)
    if callable(function):
        return _called(function, arguments, what, tape)
    value = _component(function, what, "its value", tape)
    return value if parameter is None or value.op != "const" else tape.lift(parameter(value.data))


def traced_scalar(
    function: Any,
    arguments: Sequence[Argument],
    what: str,
    tape: Tape,
    parameter: Callable[[float], Scalar] | None = None,
    symbols: Mapping[Any, Scalar] | None = None,
) -> Node:
    """`traced` where one scalar is expected."""
    result = traced(function, arguments, what, tape, parameter, symbols)
    if isinstance(result, Node):
        return result
    raise TraceError(
        f"{what}: one number is expected, a sequence of {len(result)} came from {_title(function)}; "
        "return the number itself"
    )


# plain functions ----------------------------------------------------------------------------------------------------
def _called(
    function: Callable[..., Any], arguments: Sequence[Argument], what: str, tape: Tape
) -> Node | tuple[Node, ...]:
    values = [tape.lift(v) if isinstance(v, Node | float | int) else tuple(v) for _, v in arguments]
    names = ", ".join(repr(name) for name, _ in arguments) or "none"
    title = _title(function)
    try:
        inspect.signature(function).bind(*values)
    except TypeError as exc:
        raise TraceError(
            f"{what}: {title} is called with {_count(values)}, in order {names}, but cannot take them ({exc}); "
            "change its parameters, or say which arguments it wants"
        ) from exc
    except ValueError:
        pass  # builtins without a signature
    try:
        result = function(*values)
    except Exception as exc:  # the user's code may raise anything; all of it is reported as one kind of error
        raise TraceError(_failure(what, title, names, exc)) from exc
    parts = _parts(result)
    if parts is None:
        return _component(result, what, title, tape)
    return tuple(_component(part, what, f"{title}, component {k}", tape) for k, part in enumerate(parts))


def _parts(result: Any) -> Sequence[Any] | None:
    """The components of a sequence or one-dimensional array; None for a scalar."""
    if hasattr(result, "ndim") and hasattr(result, "tolist"):
        return list(result) if result.ndim == 1 else None
    return result if isinstance(result, tuple | list) else None


def _component(value: Any, what: str, source: str, tape: Tape) -> Node:
    """One returned value as a node; everything that is not a finite real number is an error."""
    if isinstance(value, Node):
        if value.op in CONDITIONS:
            raise TraceError(
                f"{what}: {source} gives a condition, true or false, where a number is expected; "
                "write mbd.where(condition, x, y)"
            )
        if value.tape is not tape:
            raise TraceError(f"{what}: {source} gives a value kept from an earlier derivation; compute it again")
        node = value
    elif value is None:
        raise TraceError(f"{what}: {source} gives None where a number is expected; is a 'return' missing?")
    elif _is_sympy(value):
        node = lower(value, {}, tape)
    else:
        try:
            unreal = isinstance(value, bool | str) or (isinstance(value, Complex) and not isinstance(value, Real))
            number = math.nan if unreal else float(value)
        except (TypeError, ValueError):
            number = math.nan
        except OverflowError:  # an integer beyond every float
            number = math.inf
        if number != number and not isinstance(value, float):
            raise TraceError(f"{what}: {source} gives {value!r} where a number is expected")
        node = tape.constant(number)
    if node.op == "const" and not math.isfinite(node.data):
        raise TraceError(
            f"{what}: {source} gives {node.data}, which is not a finite number; "
            "check the numbers it uses (divisions by zero, logarithms, missing samples)"
        )
    return node


def _count(values: Sequence[object]) -> str:
    """'1 argument', '2 arguments'."""
    return f"{len(values)} argument{'s' * (len(values) != 1)}"


def _title(function: Any) -> str:
    """The user's function and where it stands: ``function 'push' (walk.py:12)``."""
    if not callable(function) or _is_sympy(function):
        return f"{function!r}"
    name = getattr(function, "__name__", type(function).__name__)
    code = getattr(function, "__code__", None)
    place = f" ({code.co_filename}:{code.co_firstlineno})" if code is not None else ""
    return f"the function {name!r}{place}"


def _failure(what: str, title: str, names: str, exc: Exception) -> str:
    """What went wrong inside a user's function, where, and what to try."""
    here = __file__.rsplit("tape", 1)[0]
    place, step = "", exc.__traceback__
    while step is not None:
        file = step.tb_frame.f_code.co_filename
        if CURVES.search(file):
            return (
                f"{what}: {title} calls a curve of scipy{place}, which takes plain numbers only; make it a table, "
                "curve = mbd.Samples.of(curve), and call that in its place"
            )
        if not file.startswith(here):
            place = f" at {file}:{step.tb_lineno}"
        step = step.tb_next
    text = f"{what}: {title} called with {names} raised {type(exc).__name__}{place}: {exc}"
    if isinstance(exc, TraceError):
        return text
    return (
        f"{text}. It is called once with values that are not known yet: use arithmetic, mbd.sin, mbd.sqrt, … "
        "and mbd.where; what needs plain numbers belongs in an mbd.Controller"
    )


# sympy --------------------------------------------------------------------------------------------------------------
def _is_sympy(value: Any) -> bool:
    sympy = sys.modules.get("sympy")
    return sympy is not None and isinstance(value, (sympy.Basic, sympy.MatrixBase))


def _lowered(
    expression: Any, arguments: Sequence[Argument], what: str, tape: Tape, symbols: Mapping[Any, Scalar]
) -> Node | tuple[Node, ...]:
    """A sympy expression, matrix or Lambda on the tape, its symbols matched by name."""
    import sympy

    source = f"the sympy expression {_short(expression)}"
    if isinstance(expression, sympy.Lambda):
        if len(expression.signature) != len(arguments):
            names = ", ".join(repr(name) for name, _ in arguments)
            raise TraceError(f"{what}: {source} takes {len(expression.signature)} arguments; given are {names}")
        return _called(lambda *values: _applied(expression, values, tape), arguments, what, tape)
    offered: dict[Any, Scalar] = {}
    for name, value in arguments:
        if isinstance(value, Sequence):
            axes = "xyz" if len(value) == 3 else "wxyz"
            offered |= {sympy.Symbol(f"{name}.{axis}"): part for axis, part in zip(axes, value, strict=True)}
        else:
            offered[sympy.Symbol(name)] = value
    offered |= symbols
    several = isinstance(expression, sympy.MatrixBase | sympy.Tuple)
    try:
        nodes = [lower(part, offered, tape) for part in (expression if several else [expression])]
    except TraceError as exc:
        raise TraceError(f"{what}, in {source}: {exc}") from exc
    checked = tuple(_component(node, what, source, tape) for node in nodes)
    return checked if several else checked[0]


def _applied(function: Any, values: Sequence[Any], tape: Tape) -> Node:
    """A sympy Lambda on nodes."""
    return lower(function.expr, dict(zip(function.signature, values, strict=True)), tape)


def _short(expression: Any) -> str:
    text = str(expression)
    return text if len(text) <= 60 else text[:59] + "…"
