"""Exact derivatives of model code, entry by entry, as the kernel with derivatives multiplies them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix
from mbd.compile.mechanism import Mechanism
from mbd.dataclass import dataclass
from mbd.equations import programs
from mbd.equations.charts import chart_end, chart_motion
from mbd.equations.inputs import Inputs
from mbd.sensitivity.tangent.interpreted import Pair
from mbd.sensitivity.tangent.printer import LANES
from mbd.simulation.run.shelves import CACHE_LINE_BYTES, NUMBER_BYTES
from mbd.tape.derivatives import jvps, live
from mbd.tape.node import Node

__all__ = ["Derivative", "derivatives_of_modes", "derivatives_of_programs", "lanes", "no_values"]

BALANCE, NO_VALUES = "tangent_balance", "tangent_without_values"
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
    address : of ``[code, outputs, ends of their lines, columns, numbers, inputs, places, second places, room,
        found]``, with the best code that there is now, as `printer.PRODUCT` reads it: columns are numbers of inputs;
        where their derivatives are is found first, of sums of two places in the room
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

        def made() -> tuple[_Entries, int]:
            nodes = outputs()
            return _made(mechanism, f"tangent_{len(mechanism.common)}", nodes, places, without), len(nodes)

        known, count = mechanism.kept((Derivative, symbol), made)
        self._known, self._size, self._lines = known, first + count, known.lines + first
        self._ends = np.searchsorted(self._lines, np.arange(self._size), side="right")
        self._numbers, self._room = np.zeros(max(len(known.lines), 1)), lanes(len(known.inputs))
        self._found = np.zeros(max(len(known.inputs), 1), dtype=np.int64)
        arrays = self._ends, known.columns, self._numbers, known.inputs, known.others, self._room, self._found
        ends, columns, numbers, inputs, *others = (each.ctypes.data for each in arrays)
        words = [0, self._size, ends, columns, numbers, len(known.inputs), inputs, *others]
        self._words = np.array(words, dtype=np.int64)
        self._address = int(self._words.ctypes.data)

    @property
    def address(self) -> int:
        if self._known.function is not None:
            self._words[0] = self._known.function.address
        return self._address

    @property
    def provisional(self) -> bool:
        """Whether better code is being made."""
        return self._known.function is not None and self._known.function.provisional

    def product(self, block: Pair, parameters: Pair) -> Matrix:
        """The derivatives of its outputs, in Python."""
        out = np.zeros((self._size, LANES))
        known = self._known
        if known.function is not None:
            known.function(block.values, parameters.values, self._numbers)
            inputs = block.of[np.maximum(known.inputs, 0)]
            inputs[known.inputs < 0] = parameters.of[-1 - known.inputs[known.inputs < 0]]
            inputs[known.others >= 0] += block.of[known.others[known.others >= 0]]
            np.add.at(out, self._lines, self._numbers[: len(known.columns), None] * inputs[known.columns])
        return out


def lanes(count: int) -> Matrix:
    """Room for the derivatives of so many numbers, each of which begins on a cache line."""
    words = np.zeros(count * LANES + CACHE_LINE_BYTES // NUMBER_BYTES - 1)
    first = -words.ctypes.data % CACHE_LINE_BYTES // NUMBER_BYTES
    return words[first : first + count * LANES].reshape(count, LANES)


@dataclass(frozen=True)
class _Entries:
    """Compiled entries, their lines and the numbers of their inputs.

    inputs : places in the block, or −1 − place of a parameter; others : a second place whose derivatives are added, −1
        for none: where coordinates add, of what depends on q + x alone
    """

    function: Any
    lines: NDArray[np.int64]
    columns: NDArray[np.int64]
    inputs: NDArray[np.int64]
    others: NDArray[np.int64]


def _made(
    mechanism: Mechanism, symbol: str, outputs: Sequence[Node], places: Sequence[int], without: Sequence[str]
) -> _Entries:
    """The derivatives of some outputs that are not always 0."""
    layout, wanted = mechanism.layout, set(places)
    inputs = [node for node in live(outputs) if node.op == "input"]
    inputs = [
        each for each in inputs if each.data[0] not in without and (each.data[0] != "p" or each.data[1] in wanted)
    ]
    slopes = jvps(outputs, [{node: 1.0} for node in inputs]) if inputs else []
    found = {node.data: each for node, each in zip(inputs, slopes, strict=True)}
    made, own, others = list[tuple[int, int, Node]](), list[int](), list[int]()
    for (kind, index), column in found.items():
        beside = found.get(("q" if kind == "x" else "x", index), ())
        if kind in "qx" and [each.index for each in column] == [each.index for each in beside]:
            if kind == "x":
                continue
            others.append(layout.place("x", index))
        else:
            others.append(-1)
        made += [(line, len(own), entry) for line, entry in enumerate(column) if not entry.is_zero]
        own.append(-1 - index if kind == "p" else layout.place(kind, index))
    made.sort(key=lambda each: each[0])
    if made:
        mechanism.common.add({symbol: [entry for _, _, entry in made]}, soon=True)
    function = mechanism.common[symbol] if made else None
    lines, columns = ([each[k] for each in made] for k in (0, 1))
    return _Entries(function, *(np.array(each, dtype=np.int64) for each in (lines, columns, own, others)))


def derivatives_of_programs(mechanism: Mechanism, places: Sequence[int]) -> list[Derivative]:
    """Of the programs that every mode has, in the order of the kernel's code."""
    equations, vector = mechanism.equations, mechanism.vector

    def none() -> Sequence[Node]:
        return ()

    named: dict[str, Callable[[], Sequence[Node]]] = {
        "accelerations": lambda: mechanism._accelerations, "guards": lambda: programs.guards(equations),
        "scales": none, "compose": none if vector else lambda: programs.compose(equations) or (), "terms": none,
        "increment_rates": none if vector else lambda: programs.increment_rates(equations),
        "chart_end": none if vector else lambda: chart_end(equations),
        "chart_motion": none if vector else lambda: chart_motion(equations), "free_rates": none,
    }  # fmt: skip
    found = [Derivative(mechanism, name, outputs, places) for name, outputs in named.items()]
    held = (*WITHOUT, "a", "s", "lam", "c")
    return [*found, Derivative(mechanism, BALANCE, lambda: balance(mechanism), places, without=held)]


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


def no_values(mechanism: Mechanism) -> Any:
    """The code of a program that is asked for its derivatives alone."""

    def made() -> Any:
        mechanism.common.add({NO_VALUES: []}, soon=True)
        return mechanism.common[NO_VALUES]

    return mechanism.kept(no_values, made)


def derivatives_of_modes(mechanism: Mechanism, active: programs.ActiveSet, places: Sequence[int]) -> list[Derivative]:
    """Of the tangent and the residual of a mode, and of the matrix times a correction W of positions.

    The matrix by itself is held, as Newton's method may take any; where it is a metric, `rules.begin_corrections` asks
    for ``K W`` with W held, which stands behind the block, and of rows on positions the part that is a change.
    """
    equations, layout, tape = mechanism.equations, mechanism.layout, mechanism.equations.tape
    n, m = layout.n, len(active.rows)
    name, size = f"residual_{active}", (n + m) ** 2

    def residual() -> Sequence[Node]:
        return programs.residual(equations, active)

    def turned() -> Sequence[Node]:
        entries = programs.newton(equations, active)
        whole = [tape.input("held", layout.size + k) for k in range(n + m)]
        parts = [tape.input("held", layout.size + n + m + k) for k in range(layout.n_v)]
        entire = [*(True for _ in range(n)), *(equations.rows[row].is_velocity for row in active.rows)]
        return [_dot(entries[k * (n + m) : (k + 1) * (n + m)], whole if entire[k] else parts) for k in range(n + m)]

    found = [Derivative(mechanism, name, residual, places, first) for first in (size, 0)]
    if not active.stabilized or not m:
        return [*found, found[-1]]
    return [*found, Derivative(mechanism, f"turned_{active}", turned, places, without=("switch", "held", "shift"))]


def _dot(a: Sequence[Node], b: Sequence[Node]) -> Node:
    found = a[0] * b[0]
    for left, right in zip(a[1:], b[1:], strict=False):
        found = found + left * right
    return found
