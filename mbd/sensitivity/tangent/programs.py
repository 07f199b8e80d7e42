"""Exact derivatives of model code, entry by entry, as the kernel with derivatives multiplies them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mbd.compile.mechanism import Mechanism
from mbd.equations import programs
from mbd.equations.charts import chart_end, chart_motion
from mbd.sensitivity.tangent.printer import LANES
from mbd.tape.derivatives import jvps, live
from mbd.tape.node import Node

__all__ = ["Derivative", "derivatives_of_modes", "derivatives_of_programs"]

WITHOUT = ("switch",)
"""Inputs that never have derivatives: whether penalties act."""


class Derivative:
    """Derivatives of one program by its inputs, those that are not always 0.

    Parameters
    ----------
    mechanism, name, outputs : the program; outputs without derivatives are None
    places : of parameters that are differentiated by

    Attributes
    ----------
    address : of ``[code, entries, outputs, lines, columns, numbers, room]``, as `printer.PRODUCT` reads it
    """

    def __init__(
        self,
        mechanism: Mechanism,
        name: str,
        outputs: Sequence[Node],
        places: Sequence[int],
        first: int = 0,
        without: Sequence[str] = WITHOUT,
    ) -> None:
        symbol = f"tangent_{name}_by_{'_'.join(map(str, places))}"
        known = mechanism.named.get(symbol)
        if known is None:
            with mechanism.equations.tape.lock:
                known = mechanism.named[symbol] = _made(
                    mechanism, f"tangent_{len(mechanism.common)}", outputs, places, without
                )
        function, lines, columns = known
        self._lines, self._columns = lines + first, columns
        self._numbers = np.zeros(max(len(lines), 1))
        size = first + len(outputs)
        self._room = np.zeros((max(size, 1), LANES))
        self._keep = function
        self._words = np.array(
            [0 if function is None else function.address, len(lines), size, self._lines.ctypes.data,
             self._columns.ctypes.data, self._numbers.ctypes.data, self._room.ctypes.data],
            dtype=np.int64,
        )  # fmt: skip
        self.address = int(self._words.ctypes.data)


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
    lines, columns, entries = list[int](), list[int](), list[Node]()
    for node, column in zip(inputs, found, strict=True):
        kind, index = node.data
        place = -1 - index if kind == "p" else layout.place(kind, index)
        for line, entry in enumerate(column):
            if not entry.is_zero:
                lines.append(line)
                columns.append(place)
                entries.append(entry)
    if entries:
        mechanism.common.add({symbol: entries}, True)
    function = mechanism.common[symbol] if entries else None
    return function, np.array(lines, dtype=np.int64), np.array(columns, dtype=np.int64)


def derivatives_of_programs(mechanism: Mechanism, places: Sequence[int]) -> list[Derivative]:
    """Of the programs that every mode has, in the order of the kernel's code."""
    equations = mechanism.equations
    with equations.tape.lock:
        named: dict[str, Sequence[Node]] = {
            "accelerations": mechanism._accelerations, "guards": programs.guards(equations), "scales": (),
            "compose": (), "terms": (), "increment_rates": (), "chart_end": (), "chart_motion": (), "free_rates": (),
        }  # fmt: skip
        if not mechanism.vector:
            named |= {
                "compose": programs.compose(equations) or (), "increment_rates": programs.increment_rates(equations),
                "chart_end": chart_end(equations), "chart_motion": chart_motion(equations),
            }  # fmt: skip
    return [Derivative(mechanism, name, outputs, places) for name, outputs in named.items()]


def derivatives_of_modes(mechanism: Mechanism, code: Any, stabilized: bool, places: Sequence[int]) -> list[Derivative]:
    """Of the tangent and the residual of a mode, and of the matrix times a correction W of positions.

    The matrix by itself is held, as Newton's method may take any; where it is a metric, `rules.follow_matrix` asks for
    ``K W`` with W held, which stands behind the block, and of rows the part that is a change.
    """
    key = (code.rows, code.penalties, code.sliding, code.given_rows, stabilized)
    n, m, layout, tape = mechanism.layout.n, len(code.rows), mechanism.layout, mechanism.equations.tape
    with tape.lock:
        outputs = mechanism._of(key, programs.residual)
    name, size = f"residual_{key}", (n + m) ** 2
    found = [Derivative(mechanism, name, outputs, places, first) for first in (size, 0)]
    if not stabilized or not m:
        return [*found, found[-1]]
    with tape.lock:
        entries = mechanism._of(key, programs.newton)
        whole = [tape.input("held", layout.size + k) for k in range(n + m)]
        parts = [tape.input("held", layout.size + n + m + k) for k in range(layout.n_v)]
        turned = [_dot(entries[k * (n + m) : (k + 1) * (n + m)], whole if k < n else parts) for k in range(n + m)]
    return [*found, Derivative(mechanism, f"turned_{key}", turned, places, without=("switch", "held", "shift"))]


def _dot(a: Sequence[Node], b: Sequence[Node]) -> Node:
    found = a[0] * b[0]
    for left, right in zip(a[1:], b[1:], strict=False):
        found = found + left * right
    return found
