"""Compiled derivatives of what steps, restarts, guards and contacts are made of.

Each program lists values and, row by row, those of their derivatives by the columns

    x (n_v) | v, z (n) | v̇, ż (n) | λ (R) | t | anchors | chosen parameters

that are not always zero. Where coordinates do not add, x is the increment from the q of the
block (`_chart_columns`).

=============  =============================================================================================
`steps`        r (n), h (R), ḣ (R): the balance over all rows, penalties behind their switches, frictions behind slips
`watched`      gaps (nC), penalty forces (nC), values of users' guards, sliding velocities and limits of frictions,
               measures that must be positive for a contact to be watched (nC)
`limits`       limits of frictions at rest
`stored`       what machines store by their transitions
`captured`     what closing contacts hold
=============  =============================================================================================
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from itertools import pairwise
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.compile.backend import Function
from mbd.compile.layout import Layout
from mbd.compile.many import at_blocks
from mbd.compile.mechanism import Mechanism
from mbd.dataclass import dataclass
from mbd.equations.equations import Equations
from mbd.equations.inputs import Inputs
from mbd.equations.linearization import along_places
from mbd.equations.programs import switched_balance
from mbd.tape.derivatives import jvps
from mbd.tape.node import Node, Scalar

EMPTY: Mapping[int, int] = MappingProxyType({})
RESULT_SEPARATOR = "\n"
"""Between names of results that one program lists; no name has it."""


@dataclass(frozen=True)
class Columns:
    """Where the columns of the derivatives lie."""

    n_v: int
    n: int
    rows: int
    anchors: int
    parameters: int

    @classmethod
    def of(cls, equations: Equations, layout: Layout, parameters: int) -> Columns:
        """Those of a mechanism with so many chosen parameters."""
        return cls(layout.n_v, layout.n, layout.n_rows, layout.n_anchors, parameters)

    @cached_property
    def _starts(self) -> list[int]:
        lengths = [0, self.n_v, self.n, self.n, self.rows, 1, self.anchors, self.parameters]
        return [int(start) for start in np.cumsum(lengths)]

    def _part(self, number: int) -> slice:
        return slice(self._starts[number], self._starts[number + 1])

    @cached_property
    def x(self) -> slice:
        return self._part(0)

    @cached_property
    def y(self) -> slice:
        return self._part(1)

    @cached_property
    def rate(self) -> slice:
        return self._part(2)

    @cached_property
    def lam(self) -> slice:
        return self._part(3)

    @cached_property
    def t(self) -> slice:
        return self._part(4)

    @cached_property
    def anchor(self) -> slice:
        return self._part(5)

    @cached_property
    def p(self) -> slice:
        return self._part(6)

    @cached_property
    def count(self) -> int:
        return self._starts[-1]


@dataclass
class State:
    """Where derivatives are evaluated: t, q, y = (v, z), rates (v̇, ż), λ, anchors, switches, slips."""

    t: float
    q: Vector
    y: Vector
    rate: Vector
    lam: Vector
    anchors: Vector
    switch: Vector
    slip: Vector


@dataclass(frozen=True)
class Sparse:
    """A compiled program: its values, and of their derivatives those that are not always 0, by line and column.

    size : how many numbers all of these are
    """

    function: Function
    lines: NDArray[np.int64]
    columns: NDArray[np.int64]
    size: int


class Programs:
    """The programs of a mechanism for some of its parameters, made when they are called first.

    Parameters
    ----------
    places : numbers of the parameters
    values : of all parameters, then of the tables, as a run holds them
    alone : numbers of directions that each change one of these parameters, by 1, and no other, by its number
    """

    def __init__(
        self, mechanism: Mechanism, places: Sequence[int], values: Vector, alone: Mapping[int, int] = EMPTY
    ) -> None:
        self.mechanism, self.places = mechanism, tuple(places)
        self.directed = tuple((place, alone.get(place, -1)) for place in self.places)
        self.equations, self.layout = mechanism.equations, mechanism.layout
        count = len(self.places)
        self.columns = mechanism.kept((Columns, count), lambda: Columns.of(self.equations, self.layout, count))
        self.values = np.ascontiguousarray(values, dtype=float) if len(values) else np.zeros(1)
        self._block = np.zeros(self.layout.size)
        self._given: dict[str, list[Node]] = {}

    def steps(self, at: State) -> tuple[Vector, Vector, Vector, Matrix, Matrix, Matrix]:
        """r, h, ḣ and their derivatives."""
        n, rows = self.layout.n, self.layout.n_rows
        values, slopes = self._call("steps", at, n + 2 * rows)
        cuts = [0, n, n + rows, n + 2 * rows]
        r, h, rate = (values[a:b] for a, b in pairwise(cuts))
        of_r, of_h, of_rate = (slopes[a:b] for a, b in pairwise(cuts))
        return r, h, rate, of_r, of_h, of_rate

    def watched(self, at: State) -> tuple[Vector, Matrix]:
        """Gaps | penalty forces | users' guards | sliding velocities | limits | conditions, and their derivatives."""
        size = 3 * self.layout.n_contacts + len(self.equations.guards) + 2 * self.layout.n_frictions
        return self._call("watched", at, size)

    def watched_flow(self, at: State, flow: Matrix) -> tuple[Matrix, Matrix, Matrix]:
        """`watched` at N states (N, W), its change along `flow` (N, columns), and the sums of sizes of its terms."""
        program, blocks = self.sparse("watched"), np.zeros((len(flow), self.layout.size))
        self.fill(blocks, at)
        size = program.size - len(program.lines)
        out = at_blocks(program.function, blocks, self.values)
        by_line = np.zeros((len(program.lines), size))
        by_line[np.arange(len(program.lines)), program.lines] = 1.0
        terms = out[:, size:] * flow[:, program.columns]
        return out[:, :size], terms @ by_line, np.abs(terms) @ by_line

    def limits(self, at: State) -> tuple[Vector, Matrix]:
        """Limits of frictions at rest, and their derivatives."""
        return self._call("limits", at, self.layout.n_frictions)

    def stored(self, at: State) -> tuple[Vector, Matrix]:
        """What machines would store, and its derivatives."""
        return self._call("stored", at, self.equations.n_held_by_machines)

    def captured(self, at: State) -> tuple[Vector, Matrix]:
        """What contacts would hold if they closed here, in the order of contacts, and its derivatives."""
        size = sum(len(contact.captured) for contact in self.equations.contacts)
        return self._call("captured", at, size)

    def results(self, names: Sequence[str], at: State) -> tuple[Vector, Matrix]:
        """Named results and their derivatives."""
        return self._call(f"results {RESULT_SEPARATOR.join(names)}", at, len(names))

    def derivatives_of(self, name: str, nodes: Sequence[Node], at: State) -> Matrix:
        """Derivatives (len(nodes), columns) of expressions, compiled under a name."""
        self._given[name] = list(nodes)
        return self._call(name, at, len(nodes))[1]

    def sparse(self, name: str) -> Sparse:
        """A program, made when it is called first."""
        return self.mechanism.kept((Sparse, name, self.places), lambda: self._sparse(name))

    def _sparse(self, name: str) -> Sparse:
        common = self.mechanism.common
        symbol = f"derivative_{len(common)}"
        values = self._values(name)
        columns = derivatives(self.equations, values, self.places)
        found = [
            (i, j, column[i]) for i in range(len(values)) for j, column in enumerate(columns) if not column[i].is_zero
        ]
        common.add({symbol: [*values, *(node for _, _, node in found)]})
        lines, places = ([each[k] for each in found] for k in (0, 1))
        size = len(values) + len(found)
        return Sparse(common[symbol], np.array(lines, dtype=int), np.array(places, dtype=int), size)

    def fill(self, block: Matrix, at: State) -> None:
        """Write a state into a block, or states into blocks (N, block)."""
        layout = self.layout
        block[..., 0] = at.t
        block[..., layout.q : layout.x] = at.q
        block[..., layout.v : layout.a] = at.y
        block[..., layout.a : layout.lam] = at.rate
        block[..., layout.lam : layout.anchor] = at.lam
        block[..., layout.anchor : layout.switch] = at.anchors
        block[..., layout.switch : layout.slip] = at.switch
        block[..., layout.slip : layout.shift] = at.slip

    def _call(self, name: str, at: State, size: int) -> tuple[Vector, Matrix]:
        slopes = np.zeros((size, self.columns.count))
        if not size:
            return np.zeros(0), slopes
        self.fill(self._block, at)
        program = self.sparse(name)
        out = np.empty(size + len(program.lines))
        program.function(self._block, self.values, out)
        slopes[program.lines, program.columns] = out[size:]
        return out[:size], slopes

    def _values(self, name: str) -> list[Node]:
        """What a program lists."""
        equations = self.equations
        if name in self._given:
            return list(self._given[name])
        if name == "steps":
            values = switched_balance(equations)
            return values + [row.value for row in equations.rows] + [row.rate for row in equations.rows]
        if name == "watched":
            return watched_nodes(equations)
        if name == "limits":
            return [friction.limit for friction in equations.frictions]
        if name == "stored":
            return [value for machine in equations.machines for value in machine.captured]
        if name == "captured":
            return [value for contact in equations.contacts for value in contact.captured]
        return [equations.output(each) for each in name.removeprefix("results ").split(RESULT_SEPARATOR)]


def watched_nodes(equations: Equations) -> list[Node]:
    """The values of `watched`."""
    zero, contacts, frictions = equations.tape.zero, equations.contacts, equations.frictions
    values = [contact.gap for contact in contacts]
    values += [zero if contact.force is None else contact.force for contact in contacts]
    values += [guard.value for guard in equations.guards]
    values += [friction.rate for friction in frictions] + [friction.sliding for friction in frictions]
    return values + [each.only_while if isinstance(each.only_while, Node) else zero for each in contacts]


def derivatives(equations: Equations, values: Sequence[Node], places: Sequence[int]) -> list[list[Node]]:
    """Columns of ∂values by x, (v, z), (v̇, ż), λ, t, anchors, these parameters."""
    if not values:
        return [[] for _ in range(Columns.of(equations, Layout.of(equations), len(places)).count)]
    inputs, tape = Inputs.of(equations), equations.tape
    anchors = [tape.input("anchor", k) for k in range(equations.n_anchors)]
    parameters = [tape.input("p", k) for k in places]
    others = (*inputs.v, *inputs.z, *inputs.a, *inputs.s, *inputs.lam, inputs.t, *anchors, *parameters)
    by_others = jvps(values, [{node: 1.0} for node in others])
    by_places = along_places(equations, values) if equations.chart is None else _chart_columns(equations, values)
    return [*by_places, *by_others]


def _chart_columns(equations: Equations, values: Sequence[Node]) -> list[list[Node]]:
    """∂values/∂x (n_v lists): at the center of a chart those along velocities, as tangents are here."""
    inputs = Inputs.of(equations)
    known: Sequence[Any] = [{} for _ in range(len(inputs.x))]
    if equations.geometry is not None:
        known = equations.geometry.partials(values)
    moving = inputs.by_increments(known)
    seeds: list[dict[Node, Scalar]] = [{x: 1.0, **moving[j]} for j, x in enumerate(inputs.x)]
    return jvps(values, seeds)
