"""Exact derivatives of model code, entry by entry, as the kernel with derivatives multiplies them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.compile.llvm import Machine
from mbd.compile.mechanism import Mechanism
from mbd.dataclass import dataclass
from mbd.equations import programs
from mbd.equations.charts import chart_end, chart_motion
from mbd.sensitivity.tangent.answers import Answer, Place, answer_of
from mbd.sensitivity.tangent.interpreted import Pair
from mbd.sensitivity.tangent.printer import LANES
from mbd.sensitivity.tangent.systems import System, balance, metric, plus, rates, step
from mbd.simulation.run.shelves import CACHE_LINE_BYTES, NUMBER_BYTES
from mbd.tape.derivatives import jvps, live, substitute
from mbd.tape.node import Node

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
    places : of parameters that are differentiated by, each with the number of the direction that changes it by 1 and
        nothing else does; −1 where there is none such
    first : numbers before the outputs, without derivatives

    Attributes
    ----------
    address : of ``[code, numbers, answer, bytes of values, values]``, with the best code that there is now, as
        `printer.PRODUCT` reads it: the code computes factors, of which and of the derivatives of its inputs the answer
        makes its own, and behind them the values of a program that solves
    """

    def __init__(
        self,
        mechanism: Mechanism,
        name: str,
        outputs: Callable[[], Sequence[Node] | System],
        places: Sequence[Place],
        first: int = 0,
        without: Sequence[str] = WITHOUT,
    ) -> None:
        def made() -> _Code:
            found = outputs()
            system = found if isinstance(found, System) else System(found)
            return _made(mechanism, f"tangent_{len(mechanism.common)}", system, places, first, without)

        self._known = known = mechanism.kept((Derivative, name, first, *places), made)
        self._numbers = np.zeros(max(known.before + known.values, 1))
        numbers = int(self._numbers.ctypes.data)
        words = [0, numbers, known.answer.address, NUMBER_BYTES * known.values, numbers + NUMBER_BYTES * known.before]
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
        known = self._known
        if known.function is not None:
            known.function(block.values, parameters.values, self._numbers)
        factors = len(known.answer.factors)
        values[: known.values] = self._numbers[known.before : known.before + known.values]
        own, others = np.array(known.inputs, dtype=np.int64).reshape(-1, 2).T
        inputs = block.of[np.maximum(own, 0)]
        inputs[own < 0] = parameters.of[-1 - own[own < 0]]
        inputs[others >= 0] += block.of[others[others >= 0]]
        ready = self._numbers[factors : known.before].reshape(-1, LANES)
        return known.answer.taken(self._numbers[:factors], ready, inputs)


def lanes(count: int) -> Matrix:
    """Room for the derivatives of so many numbers, each of which begins on a cache line."""
    words = np.zeros(count * LANES + CACHE_LINE_BYTES // NUMBER_BYTES - 1)
    first = -words.ctypes.data % CACHE_LINE_BYTES // NUMBER_BYTES
    return words[first : first + count * LANES].reshape(count, LANES)


@dataclass(frozen=True)
class _Code:
    """Compiled factors of an answer, derivatives that are ready, and values; how many numbers stand before the values
    and how many these are; the places of its inputs, and the answer itself.
    """

    function: Any
    before: int
    values: int
    inputs: Sequence[Place]
    answer: Answer


def _made(
    mechanism: Mechanism, symbol: str, system: System, places: Sequence[Place], first: int, without: Sequence[str]
) -> _Code:
    """The derivatives of some outputs that are not always 0."""
    outputs, tape = system.lines, mechanism.equations.tape
    layout, alone = mechanism.layout, dict(places)
    inputs = [node for node in live(outputs) if node.op == "input"]
    inputs = [
        each for each in inputs
        if each.data[0] not in without and (each.data[0] != "p" or each.data[1] in alone) and each not in system.known
    ]  # fmt: skip
    slopes = jvps(outputs, [{node: 1.0} for node in inputs]) if inputs else []
    given = substitute([entry for column in slopes for entry in column], system.known)
    columns = [given[k : k + len(outputs)] for k in range(0, len(given), max(len(outputs), 1))]
    found = {node.data: each for node, each in zip(inputs, zip(slopes, columns, strict=True), strict=True)}
    own, lines = list[Place](), [tape.zero for _ in outputs]
    ready: dict[int, list[Node]] = {}
    for (kind, index), (slope, column) in found.items():
        direction = alone[index] if kind == "p" else -1
        if direction >= 0:
            for line, entry in enumerate(column):
                if not entry.is_zero:
                    ready.setdefault(line, [tape.zero] * LANES)[direction] = entry
            continue
        beside, other = found.get(("q" if kind == "x" else "x", index), ((), ()))[0], -1
        if kind in "qx" and [each.index for each in slope] == [each.index for each in beside]:
            if kind == "x":
                continue
            other = layout.place("x", index)
        lane = tape.input("lane", len(own))
        own.append((-1 - index if kind == "p" else layout.place(kind, index), other))
        for line, entry in enumerate(column):
            lines[line] = lines[line] + entry * lane
    for k, line in enumerate(ready):
        lines[line] = lines[line] + tape.input("ready", k)
    load = partial(_loaded, mechanism) if mechanism.backend.name == "llvm" else None
    answer = answer_of(lines if system.answer is None else system.answer(lines), own, first, load)
    before = [*answer.factors, *(entry for entries in ready.values() for entry in entries)]
    numbers = [*before, *system.values]
    if numbers:
        mechanism.common.add({symbol: numbers}, soon=True)
    return _Code(mechanism.common[symbol] if numbers else None, len(before), len(system.values), own, answer)


def _loaded(mechanism: Mechanism, code: bytes, symbol: str) -> int:
    """The address of an answer, in memory as long as the mechanism."""
    machine = mechanism.kept(_loaded, Machine)
    return mechanism.kept((_loaded, symbol), lambda: machine.load(code, [symbol])[0])


def derivatives_of_programs(mechanism: Mechanism, places: Sequence[Place]) -> list[Derivative]:
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
    mechanism: Mechanism, active: programs.ActiveSet, places: Sequence[Place], stepping: bool
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
