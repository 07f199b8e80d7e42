"""The inputs of a set of equations as nodes, by their letters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

from mbd.dataclass import dataclass
from mbd.equations.equations import Chart, Equations
from mbd.tape.derivatives import jvps, vjp
from mbd.tape.node import Node, Scalar, Tape


@dataclass(frozen=True)
class Inputs:
    """t; c = (c_C, c_K); q (n_q); x, v, a (n_v); z, s (n_z, s = ż); lam (rows).

    Two kinds of derivatives by place are the same only where coordinates add, and at the center of a chart: that along
    the velocity v_j, with which B and generalized forces are made, and ∂/∂x_j, with which Newton's matrices are. With
    v = D(x) ẋ, ∂/∂x_j = Σ_i D_ij · (along v_i).

    chart : ẋ = D⁻¹ v (n_v) as expressions, and the entries D_ij, line by line; None where coordinates add, D = 1
    """

    t: Node
    c: tuple[Node, Node]
    q: tuple[Node, ...]
    x: tuple[Node, ...]
    v: tuple[Node, ...]
    a: tuple[Node, ...]
    z: tuple[Node, ...]
    s: tuple[Node, ...]
    lam: tuple[Node, ...]
    chart: Chart | None = None

    @classmethod
    def of(cls, equations: Equations) -> Inputs:
        """The inputs that these equations may depend on, besides parameters, anchors and switches."""
        if "inputs" not in equations.memory:
            sizes = equations.n_q, equations.n_v, equations.n_z, len(equations.rows)
            found = cls.sized(equations.tape, *sizes)
            equations.memory["inputs"] = replace(found, chart=equations.chart)
        inputs: Inputs = equations.memory["inputs"]
        return inputs

    @classmethod
    def sized(cls, tape: Tape, n_q: int, n_v: int, n_z: int = 0, n_rows: int = 0) -> Inputs:
        """The inputs of given sizes."""

        def block(kind: str, size: int) -> tuple[Node, ...]:
            return tuple(tape.input(kind, k) for k in range(size))

        return cls(
            tape.input("t"), (tape.input("c", 0), tape.input("c", 1)), block("q", n_q), block("x", n_v),
            block("v", n_v), block("a", n_v), block("z", n_z), block("s", n_z), block("lam", n_rows),
        )  # fmt: skip

    @property
    def clock(self) -> dict[Node, Scalar]:
        """ẋ by x: the direction of d/dt among increments."""
        rates = self.v if self.chart is None else self.chart.rates
        return dict(zip(self.x, rates, strict=True))

    @cached_property
    def along(self) -> list[dict[Node, Scalar]]:
        """For each velocity v_j, its direction among the increments: {x_j: 1}, or the column D⁻¹ e_j."""
        if self.chart is None:
            return [{x: 1.0} for x in self.x]
        columns = jvps(self.chart.rates, [{v: 1.0} for v in self.v])
        return [{x: entry for x, entry in zip(self.x, column, strict=True) if not entry.is_zero} for column in columns]

    @cached_property
    def turning(self) -> list[list[tuple[int, Node]]]:
        """D column by column: numbers and entries of what is not zero."""
        lines = [] if self.chart is None else self.chart.velocities
        return [[(i, line[j]) for i, line in enumerate(lines) if not line[j].is_zero] for j in range(len(self.x))]

    def along_velocities(self, slopes: Sequence[Node]) -> list[Node]:
        """Derivatives along v_j of what has the derivatives ∂/∂x_i (n_v): D⁻ᵀ slopes."""
        return list(slopes) if self.chart is None else vjp(self.chart.rates, slopes, self.v)

    def by_increments(self, known: Sequence[Mapping[Node, Node]]) -> list[Mapping[Node, Node]]:
        """∂node/∂x_j of nodes whose derivatives along each v_i are known."""
        if self.chart is None:
            return list(known)
        found: list[Mapping[Node, Node]] = []
        for j in range(len(self.x)):
            sums: dict[Node, Node] = {}
            for i, entry in self.turning[j]:
                for node, slope in known[i].items():
                    part = entry * slope
                    sums[node] = sums[node] + part if node in sums else part
            found.append(sums)
        return found

    def row_by_increments(self, row: Sequence[Node]) -> list[Node]:
        """∂h/∂x (n_v) of a row with the derivatives B along velocities: B D."""
        if self.chart is None:
            return list(row)
        slopes: list[Node] = []
        for column in self.turning:
            total = 0.0 * row[0]
            for i, slope in column:
                if not row[i].is_zero:
                    total = total + row[i] * slope
            slopes.append(total)
        return slopes

    def directions(self, known: Sequence[Mapping[Node, Node]]) -> list[dict[Node, Scalar]]:
        """Those of the columns of S: (1, c_C, c_K) in (a_j, v_j, x_j), and (1, c_C) in (ż_j, z_j).

        known : for each v_j, the derivative along it of nodes that need not be differentiated through
        """
        c_C, c_K = self.c
        known = self.by_increments(known)
        found: list[dict[Node, Scalar]] = []
        for j, (x, v, a) in enumerate(zip(self.x, self.v, self.a, strict=True)):
            found.append({a: 1.0, v: c_C, x: c_K, **{node: c_K * slope for node, slope in known[j].items()}})
        return found + [{s: 1.0, z: c_C} for s, z in zip(self.s, self.z, strict=True)]

    @property
    def n(self) -> int:
        """Number of rates, n_v + n_z."""
        return len(self.v) + len(self.z)
