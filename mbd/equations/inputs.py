"""The inputs of a set of equations as nodes, by their letters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mbd.equations.equations import Equations
from mbd.tape.node import Node, Scalar, Tape

__all__ = ["Inputs"]


@dataclass(frozen=True)
class Inputs:
    """t; c = (c_C, c_K); q (n_q); x, v, a (n_v); z, s (n_z, s = ż); lam (rows)."""

    t: Node
    c: tuple[Node, Node]
    q: tuple[Node, ...]
    x: tuple[Node, ...]
    v: tuple[Node, ...]
    a: tuple[Node, ...]
    z: tuple[Node, ...]
    s: tuple[Node, ...]
    lam: tuple[Node, ...]

    @classmethod
    def of(cls, equations: Equations) -> Inputs:
        """The inputs that these equations may depend on, besides parameters, anchors and switches."""
        if "inputs" not in equations.memory:
            sizes = equations.n_q, equations.n_v, equations.n_z, len(equations.rows)
            equations.memory["inputs"] = cls.sized(equations.tape, *sizes)
        found: Inputs = equations.memory["inputs"]
        return found

    @classmethod
    def sized(cls, tape: Tape, n_q: int, n_v: int, n_z: int = 0, n_rows: int = 0) -> Inputs:
        """The inputs of given sizes."""

        def block(kind: str, size: int) -> tuple[Node, ...]:
            return tuple(tape.input(kind, k) for k in range(size))

        return cls(
            tape.input("t"), (tape.input("c", 0), tape.input("c", 1)), block("q", n_q), block("x", n_v),
            block("v", n_v), block("a", n_v), block("z", n_z), block("s", n_z), block("lam", n_rows),
        )  # fmt: skip

    def directions(self, known: Sequence[Mapping[Node, Node]]) -> list[dict[Node, Scalar]]:
        """Those of the columns of S: (1, c_C, c_K) in (a_j, v_j, x_j), and (1, c_C) in (ż_j, z_j).

        known : for each x_j, ∂node/∂x_j of nodes that need not be differentiated through
        """
        c_C, c_K = self.c
        found: list[dict[Node, Scalar]] = []
        for j, (x, v, a) in enumerate(zip(self.x, self.v, self.a, strict=True)):
            found.append({a: 1.0, v: c_C, x: c_K, **{node: c_K * slope for node, slope in known[j].items()}})
        return found + [{s: 1.0, z: c_C} for s, z in zip(self.s, self.z, strict=True)]

    @property
    def n(self) -> int:
        """Number of rates, n_v + n_z."""
        return len(self.v) + len(self.z)
