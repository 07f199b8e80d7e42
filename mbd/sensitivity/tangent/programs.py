"""Exact derivatives of model code, entry by entry, as the kernel with derivatives multiplies them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.compile.mechanism import Mechanism
from mbd.dataclass import dataclass
from mbd.equations import programs
from mbd.equations.charts import chart_end, chart_motion
from mbd.sensitivity.tangent.answers import Answer, answer_of
from mbd.sensitivity.tangent.interpreted import Pair
from mbd.sensitivity.tangent.printer import LANES
from mbd.sensitivity.tangent.systems import System, balance, metric, plus, rates, step
from mbd.simulation.run.shelves import CACHE_LINE_BYTES, NUMBER_BYTES
from mbd.tape.derivatives import jvps, live, substitute
from mbd.tape.node import Node

__all__ = ["Derivative", "derivatives_of_modes", "derivatives_of_programs", "lanes", "no_values"]

BALANCE, NO_VALUES = "tangent_balance", "tangent_without_values"
WITHOUT = ("switch",)
"""Inputs that never have derivatives: whether penalties act."""
OF_STEPS = (*WITHOUT, "a", "s", "lam", "held")
OF_TURNED = (*WITHOUT, "held", "shift")
OF_METRICS = (*OF_TURNED, "turned", "c")
OF_RATES = (*WITHOUT, "a", "s", "lam", "c")
"""The same of systems that are solved for rates and multipliers, and of what turns with a matrix."""


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
        found, answer, values, their bytes, factors]``, with the best code that there is now, as `printer.PRODUCT` reads
        it: columns are numbers of inputs; where their derivatives are is found first, of sums of two places in the
        room; of a program that solves, `answer` turns what was found into the derivatives of its values
    """

    def __init__(
        self,
        mechanism: Mechanism,
        name: str,
        outputs: Callable[[], Sequence[Node] | System],
        places: Sequence[int],
        first: int = 0,
        without: Sequence[str] = WITHOUT,
    ) -> None:
        symbol = f"tangent_{name}_by_{'_'.join(map(str, places))}"

        def made() -> tuple[_Entries, int]:
            found = outputs()
            system = found if isinstance(found, System) else System(found)
            entries = _made(mechanism, f"tangent_{len(mechanism.common)}", system, places, without)
            return entries, len(system.lines)

        known, count = mechanism.kept((Derivative, symbol), made)
        self._known, self._size, self._lines = known, first + count, known.lines + first
        self._ends = np.searchsorted(self._lines, np.arange(self._size), side="right")
        solved, answer = len(known.lines) + known.values, known.answer
        self._numbers = np.zeros(max(solved + (0 if answer is None else len(answer.factors)), 1))
        self._room = lanes(len(known.inputs))
        self._found = np.zeros(max(len(known.inputs), 1), dtype=np.int64)
        arrays = self._ends, known.columns, self._numbers, known.inputs, known.others, self._room, self._found
        ends, columns, numbers, inputs, *others = (each.ctypes.data for each in arrays)
        words = [0, self._size, ends, columns, numbers, len(known.inputs), inputs, *others]
        words += [0 if answer is None else answer.address, numbers + NUMBER_BYTES * len(known.lines)]
        words += [NUMBER_BYTES * known.values, numbers + NUMBER_BYTES * solved]
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

    def product(self, block: Pair, parameters: Pair, values: Vector) -> Matrix:
        """The derivatives of its outputs, in Python; values : of outputs that are solved for, which it writes."""
        out = np.zeros((self._size, LANES))
        known = self._known
        if known.function is not None:
            known.function(block.values, parameters.values, self._numbers)
            inputs = block.of[np.maximum(known.inputs, 0)]
            inputs[known.inputs < 0] = parameters.of[-1 - known.inputs[known.inputs < 0]]
            inputs[known.others >= 0] += block.of[known.others[known.others >= 0]]
            np.add.at(out, self._lines, self._numbers[: len(known.columns), None] * inputs[known.columns])
        solved = len(known.lines) + known.values
        values[: known.values] = self._numbers[len(known.lines) : solved]
        return out if known.answer is None else known.answer.taken(self._numbers[solved:], out)


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
    values: int
    answer: Answer | None
    lines: NDArray[np.int64]
    columns: NDArray[np.int64]
    inputs: NDArray[np.int64]
    others: NDArray[np.int64]


def _made(mechanism: Mechanism, symbol: str, system: System, places: Sequence[int], without: Sequence[str]) -> _Entries:
    """The derivatives of some outputs that are not always 0."""
    outputs = system.lines
    layout, wanted = mechanism.layout, set(places)
    inputs = [node for node in live(outputs) if node.op == "input"]
    inputs = [
        each for each in inputs
        if each.data[0] not in without and (each.data[0] != "p" or each.data[1] in wanted) and each not in system.known
    ]  # fmt: skip
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
    numbers, answer = substitute([entry for _, _, entry in made], system.known), None
    if system.answer is not None:
        given = [mechanism.equations.tape.input("lane", k) for k in range(len(outputs))]
        answer = answer_of(system.answer(given), mechanism.backend.name == "llvm")
        numbers = [*numbers, *system.values, *answer.factors]
    if numbers:
        mechanism.common.add({symbol: numbers}, soon=True)
    function = mechanism.common[symbol] if numbers else None
    lines, columns = ([each[k] for each in made] for k in (0, 1))
    arrays = [np.array(each, dtype=np.int64) for each in (lines, columns, own, others)]
    return _Entries(function, len(system.values), answer, *arrays)


def derivatives_of_programs(mechanism: Mechanism, places: Sequence[int]) -> list[Derivative]:
    """Of the programs that every mode has, in the order of the kernel's code."""
    equations, vector = mechanism.equations, mechanism.vector

    def none() -> Sequence[Node]:
        return ()

    named: dict[str, Callable[[], Sequence[Node]]] = {
        "accelerations": lambda: mechanism.acceleration_nodes, "guards": lambda: programs.guards(equations),
        "scales": none, "compose": none if vector else lambda: programs.compose(equations) or (), "terms": none,
        "increment_rates": none if vector else lambda: programs.increment_rates(equations),
        "chart_end": none if vector else lambda: chart_end(equations),
        "chart_motion": none if vector else lambda: chart_motion(equations), "free_rates": none,
    }  # fmt: skip
    found = [Derivative(mechanism, name, outputs, places) for name, outputs in named.items()]
    every = range(mechanism.layout.n_rows)
    return [*found, Derivative(mechanism, BALANCE, lambda: balance(mechanism, every), places, 0, OF_RATES)]


def no_values(mechanism: Mechanism) -> Any:
    """The code of a program that is asked for its derivatives alone."""

    def made() -> Any:
        mechanism.common.add({NO_VALUES: []}, soon=True)
        return mechanism.common[NO_VALUES]

    return mechanism.kept(no_values, made)


def derivatives_of_modes(
    mechanism: Mechanism, active: programs.ActiveSet, places: Sequence[int], stepping: bool
) -> list[Derivative]:
    """Of the tangent and the residual of a mode, and with `stepping` of the matrix times a correction W of positions.

    The last is that of the system of a step, or else of that of rates (`systems`).

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
        return [
            plus(tape.zero, entries[k * (n + m) : (k + 1) * (n + m)], whole if entire[k] else parts)
            for k in range(n + m)
        ]

    found = [Derivative(mechanism, name, residual, places, first) for first in (size, 0)]
    found += found[-1:]
    if not stepping:
        return [*found, Derivative(mechanism, f"rates_{active}", lambda: rates(mechanism, active), places, 0, OF_RATES)]
    if active.stabilized and m:
        found[-1] = Derivative(mechanism, f"turned_{active}", turned, places, 0, OF_TURNED)
    found.append(Derivative(mechanism, f"step_{active}", lambda: step(mechanism, active), places, 0, OF_STEPS))
    return [*found, Derivative(mechanism, f"metric_{active}", lambda: metric(mechanism, active), places, 0, OF_METRICS)]
