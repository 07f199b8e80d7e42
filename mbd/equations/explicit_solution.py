"""Accelerations and the way back to the rows in straight-line code, from the matrices that `accelerations` gives.

Stages of explicit steps solve ``[M R; B 0] (v̇, λ) = −(f, γ)``, their ends ``[M Bᵀ; B 0] (δ, ·) = −(0, h)`` and the same
with ḣ for the velocities. Both matrices have the same places of zeros at every state, so that the order of pivots is
chosen when a mode is met (`mbd.tape.elimination`).
"""

from __future__ import annotations

from collections.abc import Sequence

from mbd.dataclass import dataclass
from mbd.equal import DIRECT_PIVOT_RTOL
from mbd.equations.equations import Equations
from mbd.tape.elimination import Factors, factors
from mbd.tape.node import Node

MAX_UNKNOWNS = 64
"""Unknowns above which a system is not eliminated on the tape."""
MAX_OPERATIONS = 12000
"""Operations of an elimination with one solution above which making its code takes longer than it is likely to save."""


@dataclass(frozen=True)
class ExplicitSolution:
    """Programs whose inputs are the output of `mbd.equations.programs.accelerations`.

    rates : sound, v̇ and ż (n), λ (m); sound is 1.0 where every pivot kept four of its digits
    returns : sound, δ of positions (n), δ of velocities (n)
    """

    rates: list[Node]
    returns: list[Node]


def explicit_solution(
    equations: Equations, accelerations: Sequence[Node], rows: Sequence[int]
) -> ExplicitSolution | None:
    """The programs of a mode with these active rows; None where pivots must be searched for, or that takes less."""
    n, n_rows, m = equations.n_v + equations.n_z, len(equations.rows), len(rows)
    if not m or n + m > MAX_UNKNOWNS:
        return None
    tape, places = equations.tape, dict[int, int]()

    def held(place: int) -> Node:
        node = accelerations[place]
        return node if node.is_constant else tape.input("held", places.setdefault(node.index, place))

    at_R, at_B = n * n + n, n * n + n + n * n_rows
    at_h = at_B + n_rows * n
    M = [[held(i * n + j) for j in range(n)] for i in range(n)]
    B = [[held(at_B + k * n + j) for j in range(n)] for k in rows]
    R = [[held(at_R + i * n_rows + k) for k in rows] for i in range(n)]
    massless = {k for k in range(n) if M[k][k].is_zero}

    def eliminated(right: list[list[Node]]) -> Factors | None:
        corner = [tape.zero] * m
        matrix = [M[i] + right[i] for i in range(n)] + [line + corner for line in B]
        return factors(matrix, n, MAX_OPERATIONS, massless, DIRECT_PIVOT_RTOL)

    turned = [[line[i] for line in B] for i in range(n)]
    first = eliminated(R)
    symmetric = all(
        one is other for line, its in zip(R, turned, strict=True) for one, other in zip(line, its, strict=True)
    )
    second = first if symmetric else eliminated(turned)
    if first is None or second is None:
        return None
    f = [-held(n * n + i) for i in range(n)]
    gamma = [-held(at_h + 2 * n_rows + k) for k in rows]
    h = [tape.zero if equations.rows[k].is_velocity else -held(at_h + k) for k in rows]
    rate = [-held(at_h + n_rows + k) for k in rows]
    still = [tape.zero] * n
    return ExplicitSolution(
        [first.sound, *first.solve([*f, *gamma])],
        [second.sound, *second.solve([*still, *h])[:n], *second.solve([*still, *rate])[:n]],
    )
