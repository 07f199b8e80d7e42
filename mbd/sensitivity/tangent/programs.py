"""Exact derivatives of model code, entry by entry, as the kernel with derivatives multiplies them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mbd.arrays import Matrix
from mbd.compile.mechanism import Mechanism
from mbd.equations import programs
from mbd.equations.charts import chart_end, chart_motion
from mbd.equations.inputs import Inputs
from mbd.sensitivity.tangent.interpreted import Pair
from mbd.sensitivity.tangent.printer import LANES
from mbd.tape.derivatives import jvps, live
from mbd.tape.node import Node

__all__ = ["Derivative", "balance_function", "derivatives_of_modes", "derivatives_of_programs"]

BALANCE = "tangent_balance"
WITHOUT = ("switch",)
"""Inputs that never have derivatives: whether penalties act."""


class Derivative:
    """Derivatives of one program by its inputs, those that are not always 0.

    Parameters
    ----------
    mechanism, name : of the program
    outputs : gives its outputs where its derivatives are not known yet
    places : of parameters that are differentiated by

    Attributes
    ----------
    address : of ``[code, outputs, ends of their lines, columns, numbers]``, as `printer.PRODUCT` reads it
    """

    def __init__(
        self,
        mechanism: Mechanism,
        name: str,
        outputs: Callable[[], Sequence[Node]],
        places: Sequence[int],
        first: int = 0,
        without: Sequence[str] = WITHOUT,
    ) -> None:
        symbol = f"tangent_{name}_by_{'_'.join(map(str, places))}"

        def made() -> tuple[Any, Any, Any, int]:
            nodes = outputs()
            return *_made(mechanism, f"tangent_{len(mechanism.common)}", nodes, places, without), len(nodes)

        function, lines, columns, count = mechanism.kept((Derivative, symbol), made)
        size = first + count
        ends = np.searchsorted(lines + first, np.arange(size), side="right")
        numbers = np.zeros(max(len(lines), 1))
        self._function, self._ends = function, ends
        self._lines, self._columns, self._numbers = lines + first, columns, numbers
        self._size = size
        places = [each.ctypes.data for each in (ends, columns, numbers)]
        self._words = np.array([0 if function is None else function.address, size, *places], dtype=np.int64)
        self.address = int(self._words.ctypes.data)

    def product(self, block: Pair, parameters: Pair) -> Matrix:
        """The derivatives of its outputs, in Python."""
        out = np.zeros((self._size, LANES))
        if self._function is not None:
            self._function(block.values, parameters.values, self._numbers)
            columns = self._columns
            inputs = block.of[np.maximum(columns, 0)]
            inputs[columns < 0] = parameters.of[-1 - columns[columns < 0]]
            np.add.at(out, self._lines, self._numbers[: len(columns), None] * inputs)
        return out


def _made(
    mechanism: Mechanism, symbol: str, outputs: Sequence[Node], places: Sequence[int], without: Sequence[str]
) -> tuple[Any, Any, Any]:
    """The compiled entries, their lines and columns: places in the block, or −1 − place of a parameter."""
    layout, wanted = mechanism.layout, set(places)
    inputs = [node for node in live(outputs) if node.op == "input"]
    inputs = [
        each for each in inputs if each.data[0] not in without and (each.data[0] != "p" or each.data[1] in wanted)
    ]
    found = jvps(outputs, [{node: 1.0} for node in inputs]) if inputs else []
    made = list[tuple[int, int, Node]]()
    for node, column in zip(inputs, found, strict=True):
        kind, index = node.data
        place = -1 - index if kind == "p" else layout.place(kind, index)
        for line, entry in enumerate(column):
            if not entry.is_zero:
                made.append((line, place, entry))
    made.sort(key=lambda each: each[0])
    if made:
        mechanism.common.add({symbol: [entry for _, _, entry in made]}, True)
    function = mechanism.common[symbol] if made else None
    lines, columns = ([each[k] for each in made] for k in (0, 1))
    return function, np.array(lines, dtype=np.int64), np.array(columns, dtype=np.int64)


def derivatives_of_programs(mechanism: Mechanism, places: Sequence[int]) -> list[Derivative]:
    """Of the programs that every mode has, in the order of the kernel's code."""
    equations, vector = mechanism.equations, mechanism.vector

    def none() -> Sequence[Node]:
        return ()

    named: dict[str, Callable[[], Sequence[Node]]] = {
        "accelerations": lambda: _all_accelerations(mechanism), "guards": lambda: programs.guards(equations),
        "scales": none, "compose": none if vector else lambda: programs.compose(equations) or (), "terms": none,
        "increment_rates": none if vector else lambda: programs.increment_rates(equations),
        "chart_end": none if vector else lambda: chart_end(equations),
        "chart_motion": none if vector else lambda: chart_motion(equations), "free_rates": none,
    }  # fmt: skip
    found = [Derivative(mechanism, name, outputs, places) for name, outputs in named.items()]
    held = (*WITHOUT, "a", "s", "lam", "c")
    return [*found, Derivative(mechanism, BALANCE, lambda: balance(mechanism), places, without=held)]


def _all_accelerations(mechanism: Mechanism) -> Sequence[Node]:
    return mechanism._accelerations


def balance(mechanism: Mechanism) -> list[Node]:
    """``M v̇ + f + R λ`` (n) and ``B v̇ + γ`` of all rows (R), at any v̇ and λ."""
    equations, n, rows = mechanism.equations, mechanism.layout.n, mechanism.layout.n_rows
    inputs, known, one = Inputs.of(equations), mechanism._accelerations, equations.tape.one
    at_R, at_B = n * n + n, n * n + n + n * rows
    at_bias = at_B + n * rows + 2 * rows
    rates = [*inputs.a, *inputs.s, one, *inputs.lam]
    lines = [
        [*known[i * n : (i + 1) * n], known[n * n + i], *known[at_R + i * rows : at_R + (i + 1) * rows]]
        for i in range(n)
    ]
    lines += [[*known[at_B + k * n : at_B + (k + 1) * n], known[at_bias + k]] for k in range(rows)]
    return [_dot(line, rates[: len(line)]) for line in lines]


def balance_function(mechanism: Mechanism) -> Any:
    """The code of `balance`."""

    def made() -> Any:
        mechanism.common.add({BALANCE: balance(mechanism)}, True)
        return mechanism.common[BALANCE]

    return mechanism.kept(balance_function, made)


def derivatives_of_modes(mechanism: Mechanism, code: Any, stabilized: bool, places: Sequence[int]) -> list[Derivative]:
    """Of the tangent and the residual of a mode, and of the matrix times a correction W of positions.

    The matrix by itself is held, as Newton's method may take any; where it is a metric, `rules.begin_corrections` asks
    for ``K W`` with W held, which stands behind the block, and of rows on positions the part that is a change.
    """
    key = (code.rows, code.penalties, code.sliding, code.given_rows, stabilized)
    n, m, layout, tape = mechanism.layout.n, len(code.rows), mechanism.layout, mechanism.equations.tape
    name, size = f"residual_{key}", (n + m) ** 2

    def residual() -> Sequence[Node]:
        return mechanism._of(key, programs.residual)

    def turned() -> Sequence[Node]:
        entries = mechanism._of(key, programs.newton)
        whole = [tape.input("held", layout.size + k) for k in range(n + m)]
        parts = [tape.input("held", layout.size + n + m + k) for k in range(layout.n_v)]
        entire = [*(True for _ in range(n)), *(mechanism.equations.rows[row].is_velocity for row in code.rows)]
        return [_dot(entries[k * (n + m) : (k + 1) * (n + m)], whole if entire[k] else parts) for k in range(n + m)]

    found = [Derivative(mechanism, name, residual, places, first) for first in (size, 0)]
    if not stabilized or not m:
        return [*found, found[-1]]
    return [*found, Derivative(mechanism, f"turned_{key}", turned, places, without=("switch", "held", "shift"))]


def _dot(a: Sequence[Node], b: Sequence[Node]) -> Node:
    found = a[0] * b[0]
    for left, right in zip(a[1:], b[1:], strict=False):
        found = found + left * right
    return found
