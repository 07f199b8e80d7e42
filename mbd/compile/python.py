"""Tape outputs → plain Python: the reference twin of the machine code, and a vectorized one for results.

Both write one assignment per operation, in the order of the tape. Division by zero, logarithms of negative numbers
and overflow give ±∞ or NaN as IEEE 754 has it: the scalar twin first runs plain arithmetic, which is fast, and only
if Python raises does it run the same source again with operations that cannot raise.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.compile.layout import Layout
from mbd.errors import UnknownNameError, nearest
from mbd.tape.derivatives import live
from mbd.tape.node import CONDITIONS, Node, Table, Tape

SCALAR = {
    "add": "{} + {}", "sub": "{} - {}", "mul": "{} * {}", "div": "{} / {}", "neg": "-{}",
    "lt": "{} < {}", "le": "{} <= {}", "and": "{} and {}", "or": "{} or {}", "not": "not {}",
    "where": "{1} if {0} else {2}", "abs": "fabs({})", "floor": "floor({}) + 0.0",
    "min": "{0} if {0} < {1} or {0} != {0} else {1}", "max": "{0} if {0} > {1} or {0} != {0} else {1}",
    "sign": "1.0 if {0} > 0.0 else -1.0 if {0} < 0.0 else {0} + 0.0",
    "atan2": "atan2({}, {})", "pow": "pow({}, {})",
}  # fmt: skip
"""Operations on floats that are not a function of one argument. A NaN given to min, max or sign comes out again."""

ARRAYS = SCALAR | {
    "and": "{} & {}", "or": "{} | {}", "not": "logical_not({})", "where": "where({}, {}, {})",
    "min": "where(({0} < {1}) | ({0} != {0}), {0}, {1})", "max": "where(({0} > {1}) | ({0} != {0}), {0}, {1})",
    "sign": "where({0} > 0.0, 1.0, where({0} < 0.0, -1.0, {0} + 0.0))",
}  # fmt: skip
"""Operations on columns."""

_PLAIN: dict[str, Any] = {
    name: getattr(math, name)
    for name in (
        "acos", "asin", "atan", "atan2", "cos", "cosh", "exp", "fabs", "floor", "inf", "log", "nan", "pow", "sin",
        "sinh", "sqrt", "tan", "tanh",
    )
}  # fmt: skip

_UFUNCS: dict[str, Any] = {
    "acos": np.arccos, "asin": np.arcsin, "atan": np.arctan, "atan2": np.arctan2, "pow": np.power, "inf": math.inf,
    "nan": math.nan, "where": np.where, "logical_not": np.logical_not,
    **{
        name: getattr(np, name)
        for name in ("cos", "cosh", "exp", "fabs", "floor", "log", "sin", "sinh", "sqrt", "tan", "tanh")
    },
}  # fmt: skip


def _never_raises(function: Callable[..., float], special: Callable[..., Any]) -> Callable[..., float]:
    """The function of `math`, with numpy's value (∞ or NaN) where `math` raises."""

    def safe(*arguments: float) -> float:
        try:
            return function(*arguments)
        except (ValueError, OverflowError):
            with np.errstate(all="ignore"):
                return float(special(*(float(x) for x in arguments)))

    return safe


def _divide(x: float, y: float) -> float:
    try:
        return x / y
    except ZeroDivisionError:
        return math.nan if x == 0.0 or x != x else math.copysign(math.inf, x) * math.copysign(1.0, y)


_SAFE: dict[str, Any] = _PLAIN | {
    name: _never_raises(function, _UFUNCS[name]) for name, function in _PLAIN.items() if callable(function)
}
_SAFE["divide"] = _divide


def _piece(parameters: Vector, start: int, n: int, x: float) -> int:
    """Number of the piece of a table that x falls into."""
    return max(bisect_right(parameters, x, start, start + n) - start - 1, 0)


_PLAIN["piece"] = _SAFE["piece"] = _piece


def _literal(value: float) -> str:
    return f"({value!r})" if value < 0.0 or value != value else repr(value)


# one state ------------------------------------------------------------------------------------------------------


_CAREFUL = SCALAR | {"div": "divide({}, {})"}


def _cubic(row: str, s: str, order: int) -> str:
    """The order-th derivative of ``Σ_k row_k s^k`` (Horner)."""
    text = "0.0" if order == 3 else ""  # so that a NaN comes out again
    for power in range(3, order - 1, -1):
        factor = math.perm(power, order)
        c = f"{row}[{power}]" if factor == 1 else f"{factor}.0 * {row}[{power}]"
        text = f"({text}) * {s} + {c}" if text else c
    return text


def _arguments(node: Node, name: Callable[[Node], str], as_number: str = "{}") -> list[str]:
    """Texts of a node's arguments, numbers turned into conditions and back where the operation wants the other."""
    conditions = 1 if node.op == "where" else len(node.args) if node.op in ("and", "or", "not") else 0
    texts = []
    for k, arg in enumerate(node.args):
        text = name(arg)
        if k < conditions and arg.op not in CONDITIONS:
            text = f"({text} != 0.0)"
        elif k >= conditions and arg.op in CONDITIONS:
            text = as_number.format(text)
        texts.append(text)
    return texts


def scalar_source(outputs: Sequence[Node], layout: Layout, operations: Mapping[str, str] = SCALAR) -> str:
    """Source of ``function(block, parameters, out)``: an assignment for each operation, in the order of the tape."""
    names: dict[int, str] = {}
    pieces: dict[tuple[int, int], int] = {}
    lines: list[str] = []

    def name(node: Node) -> str:
        text = names.get(node.index)
        if text is None:  # a constant, or an input that is asked for the first time
            if node.op == "const":
                text = _literal(node.data)
            elif node.is_untouched:
                text = "0.0"
            else:
                kind, index = node.data
                text = f"v{node.index}"
                lines.append(f"    {text} = {f'p[{index}]' if kind == 'p' else f'b[{layout.place(kind, index)}]'}")
            names[node.index] = text
        return text

    for node in live(outputs):
        if not node.args:
            continue
        if node.op == "table":
            table, order = node.data
            start, n, x = layout.table_offsets[table.index], len(table.breaks), name(node.args[0])
            k = pieces.get((table.index, node.args[0].index))
            if k is None:
                k = pieces[table.index, node.args[0].index] = len(pieces)
                row = f"{start + n} + 4 * k{k}"
                lines += (
                    f"    k{k} = piece(parameters, {start}, {n}, {x})",
                    f"    s{k} = {x} - float(parameters[{start} + k{k}])",
                    f"    c{k} = parameters[{row} : {row} + 4].tolist()",
                )
            text = _cubic(f"c{k}", f"s{k}", order)
        else:
            text = operations.get(node.op, f"{node.op}({{}})").format(*_arguments(node, name))
        lines.append(f"    v{node.index} = {text}")
        names[node.index] = f"v{node.index}"
    results = [name(node) for node in outputs]
    return "\n".join(
        (
            "def function(block, parameters, out):",
            f"    b, p = block.tolist(), parameters[:{layout.n_parameters}].tolist()",
            *lines,
            f"    out[:{len(results)}] = ({''.join(f'{result}, ' for result in results)})\n",
        )
    )


class ScalarFunction:
    """``f(block, parameters, out)`` in plain Python; its address is 0, for there is no machine code."""

    address = 0
    provisional = False

    def __init__(self, name: str, outputs: Sequence[Node], layout: Layout) -> None:
        self.name, self.size = name, len(outputs)
        self._outputs, self._layout = tuple(outputs), layout
        self._plain = _execute(scalar_source(outputs, layout), _PLAIN, name)
        self._safe: Callable[..., None] | None = None

    def __call__(self, block: Vector, parameters: Vector, out: Vector) -> None:
        try:
            self._plain(block, parameters, out)
        except (ZeroDivisionError, OverflowError, ValueError):
            if self._safe is None:
                source = scalar_source(self._outputs, self._layout, _CAREFUL)
                self._safe = _execute(source, _SAFE, self.name)
            self._safe(block, parameters, out)


def scalar_function(outputs: Sequence[Node], layout: Layout, name: str = "function") -> ScalarFunction:
    """The reference twin: what compiled code computes, in plain Python."""
    return ScalarFunction(name, outputs, layout)


def _execute(source: str, names: Mapping[str, Any], name: str) -> Callable[..., None]:
    scope = dict(names)
    exec(compile(source, f"<{name}>", "exec"), scope)
    function: Callable[..., None] = scope["function"]
    return function


# many states ----------------------------------------------------------------------------------------------------

ROWS = 4096
"""Rows that are worked on at once, so that a column of intermediate values stays in the processor's cache."""


def _lookup(breaks: Vector, coefficients: Any, order: int, x: Any) -> Any:
    """The order-th derivative of a table at every row."""
    piece = np.maximum(np.searchsorted(breaks, x, side="right") - 1, 0)
    s = x - breaks[piece]
    result = 0.0 if order == 3 else None  # so that a NaN comes out again
    for power in range(3, order - 1, -1):
        c = math.perm(power, order) * coefficients[piece, power]
        result = c if result is None else result * s + c
    return result


def array_source(outputs: Sequence[Node]) -> tuple[str, dict[str, int], dict[str, Any]]:
    """Source of ``function(inputs, out)`` over columns; kinds of inputs with their number; tables by name.

    A name is used again as soon as its value has no further use.
    """
    order = live(outputs)
    uses: dict[int, int] = {}
    for node in order:
        for arg in node.args:
            uses[arg.index] = uses.get(arg.index, 0) + 1
    for node in outputs:
        uses[node.index] = uses.get(node.index, 0) + len(order)  # never freed
    names: dict[int, str] = {}
    free: list[str] = []
    kinds: dict[str, int] = {}
    tables: dict[str, Any] = {}
    lines = ["def function(inputs, out):"]
    made = 0
    for node in order:
        if node.op == "const":
            names[node.index] = _literal(node.data)
            continue
        if node.op == "input":
            kind, index = node.data
            kinds[kind] = max(kinds.get(kind, 0), index + 1)
            text = f"inputs[{kind!r}][{index}]"
        elif node.op == "table":
            table: Table = node.data[0]
            tables[f"T{table.index}"] = np.array(table.breaks), np.array(table.coefficients)
            text = f"lookup(*T{table.index}, {node.data[1]}, {names[node.args[0].index]})"
        else:
            text = ARRAYS.get(node.op, f"{node.op}({{}})").format(
                *_arguments(node, lambda arg: names[arg.index], "({} + 0.0)")
            )
        for arg in node.args:
            uses[arg.index] -= 1
            if not uses[arg.index] and arg.op != "const":
                free.append(names[arg.index])
        if free:
            name = free.pop()
        else:
            name, made = f"v{made}", made + 1
        lines.append(f"    {name} = {text}")
        names[node.index] = name
    lines += [f"    out[{k}] = {names[node.index]}" for k, node in enumerate(outputs)]
    if len(lines) == 1:
        lines.append("    pass")
    return "\n".join(lines) + "\n", kinds, tables


_KNOWN: WeakKeyDictionary[Tape, dict[tuple[int, ...], ArrayFunction]] = WeakKeyDictionary()


class ArrayFunction:
    """Outputs at many states at once: ``f({'t': (R,), 'q': (R, n_q), …}, parameters) → one (R,) array per output``.

    Parameters are one vector for all rows, or an (R, n_p) array. Kinds that no output asks for may be absent, and
    so may 'x': an absent increment is zero. Tables are those of the tape.
    """

    def __init__(self, outputs: Sequence[Node]) -> None:
        self.size = len(outputs)
        source, self._kinds, tables = array_source(outputs)
        self._function = _execute(source, _UFUNCS | tables | {"lookup": _lookup}, "results")

    def __call__(self, inputs: Mapping[str, Any], parameters: Any) -> list[Vector]:
        return list(self.lines(inputs, parameters))

    def lines(self, inputs: Mapping[str, Any], parameters: Any) -> Matrix:
        """The same in one array, (outputs, R)."""
        columns = {kind: self._columns(kind, inputs) for kind in self._kinds if kind != "p"}
        constants = np.asarray(parameters, dtype=float)
        rows = max((len(array) for array in inputs.values()), default=1)
        results = np.empty((self.size, rows))
        with np.errstate(all="ignore"):
            for first in range(0, rows, ROWS):
                part = slice(first, first + ROWS)
                state = {kind: np.ascontiguousarray(array[:, part]) for kind, array in columns.items()}
                state["p"] = constants if constants.ndim == 1 else np.ascontiguousarray(constants[part].T)
                self._function(state, results[:, part])
        return results

    def _columns(self, kind: str, inputs: Mapping[str, Any]) -> Any:
        """The input of a kind as (k, R)."""
        if kind not in inputs:
            if kind == "x":
                rows = max((len(array) for array in inputs.values()), default=1)
                return np.zeros((self._kinds[kind], rows))
            raise UnknownNameError(nearest(kind, inputs, "input", "There are"))
        array = np.asarray(inputs[kind], dtype=float)
        return array[np.newaxis] if array.ndim == 1 else array.T


def array_function(outputs: Sequence[Node]) -> ArrayFunction:
    """The vectorized twin for results after a run, made once for the same outputs of a tape."""
    if not outputs:
        return ArrayFunction(outputs)
    known = _KNOWN.setdefault(outputs[0].tape, {})
    key = tuple(node.index for node in outputs)
    made = known.get(key)
    if made is None:
        if len(known) >= 256:  # functions of one tape that are kept at most
            known.clear()
        made = known[key] = ArrayFunction(outputs)
    return made
