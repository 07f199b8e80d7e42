"""Derivatives by inputs and of outputs about a state, as a program: what B, C and D of a linearization are made of."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.equations.cones import sliding_force
from mbd.equations.equations import Equations
from mbd.equations.inputs import Inputs
from mbd.equations.linearization import across, along_places, row_changes
from mbd.equations.programs import balance_with
from mbd.tape.derivatives import jvps, live, substitute
from mbd.tape.node import Node


@dataclass(frozen=True)
class PortTerms:
    """Derivatives at a point, with N = n_v + n_z rates, m active rows, k parameters p as inputs and o outputs y.

    Attributes
    ----------
    r : (N, k) ∂r/∂p of the balance; h, rate, change : (m, k) ∂h/∂p, ∂ḣ/∂p, ∂ḧ/∂p, of a constant p
    y : (o,) values
    place, speed : (o, n_v) ∂y/∂x and ∂y/∂v; state : (o, n_z) ∂y/∂z
    acceleration, state_rate : (o, n_v) ∂y/∂v̇ and (o, n_z) ∂y/∂ż; multiplier : (o, m) ∂y/∂λ
    through : (o, k) ∂y/∂p with all these held
    """

    r: Matrix
    h: Matrix
    rate: Matrix
    change: Matrix
    y: Vector
    place: Matrix
    speed: Matrix
    state: Matrix
    acceleration: Matrix
    state_rate: Matrix
    multiplier: Matrix
    through: Matrix

    @classmethod
    def of(cls, out: Vector, equations: Equations, m: int, k: int, o: int) -> PortTerms:
        """The fields from the numbers that the program gives."""
        n_v, n_z = equations.n_v, equations.n_z
        shapes: list[tuple[int, ...]] = [
            (n_v + n_z, k), (m, k), (m, k), (m, k), (o,), (o, n_v), (o, n_v), (o, n_z), (o, n_v), (o, n_z), (o, m),
            (o, k),
        ]  # fmt: skip
        parts = np.split(out, np.cumsum([int(np.prod(shape)) for shape in shapes]))
        return cls(*(part.reshape(shape) for part, shape in zip(parts, shapes, strict=False)))


def ports(
    equations: Equations,
    rows: Sequence[int],
    penalties: Sequence[int],
    sliding: Sequence[int],
    given: Sequence[Node],
    outputs: Sequence[Node],
) -> list[Node]:
    """The fields of `PortTerms` in their order, matrices row by row, for one contact mode.

    Parameters
    ----------
    rows, penalties, sliding : as for `mbd.equations.linearization.linearization`
    given : the parameters that are inputs
    outputs : quantities on the tape
    """
    inputs, rows = Inputs.of(equations), sorted(rows)
    r = balance_with(equations, rows, penalties, sliding)
    chosen, change = [equations.rows[k] for k in rows], row_changes(equations, rows)
    levels = [r, [row.value for row in chosen], [row.rate for row in chosen], change]
    by_input = [across(jvps(values, [{p: 1.0} for p in given]), len(values)) for values in levels]
    outputs = sliding_forces(equations, sliding, outputs)
    kinds = inputs.v, inputs.z, inputs.a, inputs.s, tuple(inputs.lam[k] for k in rows), given
    of_outputs = [across(along_places(equations, outputs), len(outputs))]
    of_outputs += [across(jvps(outputs, [{node: 1.0} for node in kind]), len(outputs)) for kind in kinds]
    return [*chain(*by_input), *outputs, *chain(*of_outputs)]


def sliding_forces(equations: Equations, sliding: Sequence[int], values: Sequence[Node]) -> list[Node]:
    """Quantities with the multiplier of each friction that slides in terms of what it follows, λ_T = slip · limit."""
    known = {equations.tape.input("lam", equations.frictions[k].row): sliding_force(equations, k) for k in sliding}
    return substitute(values, known) if known else list(values)


def enters(p: Node, values: Sequence[Node]) -> bool:
    """Whether a parameter is in one of some expressions."""
    return any(node.index == p.index for node in live(values))
