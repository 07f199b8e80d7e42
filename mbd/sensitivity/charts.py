"""Steps in charts, where coordinates do not add: what moves with the base of a chart, and what moves in it.

A step goes from q₀ to q₁ = q₀ ⊕ x₁. Tangents δq of configurations are along velocities (for a quaternion a rotation
vector in the child's axes); with δq₀ before the step and δx₁ of its increment

    δq₁ = A(x₁) δq₀ + D(x₁) δx₁,   v = D(x) ẋ,   A(x) = R(x)ᵀ of a rotation

exactly, which carries tangents from chart to chart. Programs therefore have derivatives by the increment x, and by the
base of the chart, along velocities there, which takes part like a parameter that is constant over a step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.compile.backend import Function
from mbd.compile.mechanism import Mechanism
from mbd.equations.charts import chart_maps
from mbd.equations.equations import Equations
from mbd.equations.inputs import Inputs
from mbd.tape.derivatives import jvp, jvps, substitute
from mbd.tape.node import Node, Scalar

__all__ = ["Charts", "Group", "Moves", "based", "chart_columns", "groups"]


@dataclass(frozen=True)
class Group:
    """The velocities of one joint whose coordinates do not add: the first of them, and how many."""

    first: int
    size: int


def groups(equations: Equations) -> tuple[Group, ...]:
    """Of all joints whose coordinates do not add, in order."""
    return tuple(
        Group(first + joint.adding, len(joint.freedoms) - joint.adding)
        for joint, _, first in equations.configuration.charts
    )


def based(equations: Equations) -> list[int]:
    """Numbers of the velocities along which charts have bases."""
    return [group.first + k for group in groups(equations) for k in range(group.size)]


def chart_columns(
    equations: Equations, values: Sequence[Node], bases: bool
) -> tuple[list[list[Node]], list[list[Node]]]:
    """∂values/∂x (n_v lists), and by the bases of charts along velocities there (see `based`), zeros unless `bases`."""
    inputs, chart = Inputs.of(equations), equations.chart
    assert chart is not None
    n_v, tape = len(inputs.x), equations.tape
    known: Sequence[Any] = [{} for _ in range(n_v)]
    if equations.geometry is not None:
        known = equations.geometry.partials(values)
    moving = inputs.by_increments(known)
    seeds: list[dict[Node, Scalar]] = [{x: 1.0, **moving[j]} for j, x in enumerate(inputs.x)]
    places = based(equations)
    if not bases:
        return jvps(values, seeds), [[tape.zero] * len(values) for _ in places]
    along = inputs.along
    for group, A in zip(groups(equations), carried(equations), strict=True):
        for k in range(group.size):
            own: dict[Node, Node] = {}
            for i in range(group.size):
                entry, velocity = A[i][k], group.first + i
                for node, slope in (*along[velocity].items(), *known[velocity].items()):
                    part = entry * slope
                    own[node] = own[node] + part if node in own else part
            seeds.append(dict(own))
    found = jvps(values, seeds)
    return found[:n_v], found[n_v:]


def carried(equations: Equations) -> list[list[list[Node]]]:
    """A(x) of each group on the tape: where a tangent of the base is along velocities at q ⊕ x."""
    memory = equations.memory
    if "carried tangents" not in memory:
        memory["carried tangents"] = [_carried(equations, *each) for each in equations.configuration.charts]
    found: list[list[list[Node]]] = memory["carried tangents"]
    return found


def _carried(equations: Equations, joint: Any, first_q: int, first_v: int) -> list[list[Node]]:
    """``∂((q ⊕ ξ) ⊕ x ⊖ (q ⊕ x))/∂ξ`` at ξ = 0 of one joint."""
    inputs, tape, adding = Inputs.of(equations), equations.tape, joint.adding
    n_q, n_v = len(joint.labels), len(joint.freedoms)
    q, x = inputs.q[first_q : first_q + n_q], inputs.x[first_v : first_v + n_v]
    other, way = ([tape.input(kind, k) for k in range(equations.n_q, equations.n_q + n_q)] for kind in ("q", "held"))
    there = [tape.lift(value) for value in joint.compose(q, x)]
    apart = [tape.lift(value) for value in joint.difference(q, other)]
    moved = jvp(apart, dict(zip(other, way, strict=True)))
    columns = []
    for k in range(adding, n_v):
        unit = [1.0 if i == k else 0.0 for i in range(n_v)]
        shift = jvp(there, dict(zip(q, joint.coordinate_rates(q, unit), strict=True)))
        here: dict[Node, Scalar] = {
            **dict(zip(q, there, strict=True)), **dict(zip(other, there, strict=True)),
            **dict(zip(way, shift, strict=True)),
        }  # fmt: skip
        columns.append(substitute(moved, here)[adding:])
    return [list(line) for line in zip(*columns, strict=True)]


def moves(equations: Equations) -> list[Node]:
    """Of each group A | D | D⁻¹ | ∂(D⁻¹ v)/∂x, line by line, then D⁻¹ v, at the x and v of the block."""
    inputs, chart, out = Inputs.of(equations), equations.chart, list[Node]()
    assert chart is not None
    for group, A in zip(groups(equations), carried(equations), strict=True):
        own = slice(group.first, group.first + group.size)
        rates, x, v = list(chart.rates[own]), inputs.x[own], inputs.v[own]
        out += [entry for line in A for entry in line]
        out += [entry for line in chart.velocities[own] for entry in line[own]]
        for by in (v, x):
            columns = jvps(rates, [{node: 1.0} for node in by])
            out += [columns[j][i] for i in range(group.size) for j in range(group.size)]
        out += rates
    return out


def differences(equations: Equations) -> list[Node]:
    """other ⊖ q (n_v) by the numbers q | other."""
    tape, n_q = equations.tape, equations.n_q
    held = {tape.input("q", k): tape.input("held", k) for k in range(2 * n_q)}
    return substitute(chart_maps(equations)[1], held)


@dataclass(frozen=True)
class Moves:
    """At an increment x and velocities v: A, D, D⁻¹ and ∂(D⁻¹ v)/∂x (n_v, n_v), ẋ = D⁻¹ v."""

    A: Matrix
    D: Matrix
    inverse: Matrix
    turning: Matrix
    rates: Vector


class Charts:
    """Charts by numbers.

    Parameters
    ----------
    mechanism : whose coordinates may add, where ⊕ is +
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, self.equations = mechanism, mechanism.equations
        self.is_vector = mechanism.vector
        self.groups = groups(self.equations)
        self._parameters = np.zeros(max(1, len(mechanism.parameters())))  # on which charts do not depend

    def programs(self) -> list[Function]:
        """What the kernel of derivatives calls: `moves`, q ⊕ x, `differences`; none where coordinates add."""
        if self.is_vector:
            return []
        common, tape = self.mechanism.common, self.equations.tape
        with tape.lock:
            if "moves" not in common:
                common.add({"moves": moves(self.equations), "differences": differences(self.equations)})
        return [common[name] for name in ("moves", "compose", "differences")]

    def room(self, width: int) -> tuple[Vector, Vector, Vector]:
        """For the kernel: what its programs give, what they are given, tangents (n_v, width)."""
        if self.is_vector:
            return np.empty(1), np.empty(1), np.empty(1)
        layout = self.mechanism.layout
        largest = max(layout.n_v, layout.n_q, sum(4 * each.size**2 + each.size for each in self.groups))
        return np.empty(largest), np.empty(max(2 * layout.n_q, layout.size)), np.empty(layout.n_v * width)

    def stage_room(self, width: int) -> tuple[Any, ...]:
        """The same for stages of the Radau IIA method (`mbd.sensitivity.kernel.radau_charts`)."""
        sizes = [3 * each.size for each in self.groups] or [1]
        turns, _, own = self.room(3 * width)
        outputs, most = sum(4 * each.size**2 + each.size for each in self.groups), max(sizes)
        return (
            turns, np.empty(most), own, np.zeros(3 * self.mechanism.layout.n_v), np.empty(max(1, 3 * outputs)),
            np.empty(2 * sum(size**2 for size in sizes)), np.empty(most**2), np.empty(most, dtype=np.int64),
        )  # fmt: skip

    def compose(self, q: Vector, x: Vector) -> Vector:
        """q ⊕ x."""
        return q + x if self.is_vector else self.equations.configuration.compose(q, x)

    def difference(self, q: Vector, other: Vector) -> Vector:
        """other ⊖ q."""
        return other - q if self.is_vector else self.equations.configuration.difference(q, other)

    def carried(self, q: Vector, x: Vector, base: Matrix, change: Matrix) -> Matrix:
        """δ(q ⊕ x) = A(x) δq + D(x) δx of δq, δx (n_v, D)."""
        if self.is_vector:
            return base + change
        found = self.at(q, x, np.zeros_like(x))
        return np.asarray(found.A @ base + found.D @ change)

    def at(self, q: Vector, x: Vector, v: Vector) -> Moves:
        """The matrices of charts around q."""
        n_v, layout = len(x), self.mechanism.layout
        A, D, inverse = np.eye(n_v), np.eye(n_v), np.eye(n_v)
        turning, rates, first = np.zeros((n_v, n_v)), v.copy(), 0
        if self.is_vector:
            return Moves(A, D, inverse, turning, rates)
        block, out = np.zeros(layout.size), np.empty(sum(4 * each.size**2 + each.size for each in self.groups))
        block[layout.q : layout.x], block[layout.x : layout.v] = q, x
        block[layout.v : layout.v + n_v] = v
        self.programs()[0](block, self._parameters, out)
        for each in self.groups:
            own, size = slice(each.first, each.first + each.size), each.size
            for matrix in (A, D, inverse, turning):
                matrix[own, own] = out[first : first + size * size].reshape(size, size)
                first += size * size
            rates[own] = out[first : first + size]
            first += size
        return Moves(A, D, inverse, turning, rates)
