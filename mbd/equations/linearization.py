"""The linear motion about a state, as a program: exact derivatives of the balance and of the rows at every level."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.equations.equations import Equations
from mbd.equations.inputs import Inputs
from mbd.equations.programs import balance_with, constraint_jacobian
from mbd.tape.derivatives import jvp, jvps
from mbd.tape.node import Node, Scalar


@dataclass(frozen=True)
class LinearTerms:
    """Derivatives at a point, with N = n_v + n_z rates and m active rows.

    Attributes
    ----------
    r : (N,) balance ``M v̇ + f + Bᵀλ``, for first-order states ż − s
    M, C : (N, N) ∂r/∂(v̇, ż) and ∂r/∂(v, z)
    K : (N, n_v) ∂r/∂x with accelerations and multipliers held: ∂(M v̇)/∂x and ∂(Bᵀλ)/∂x are part of it
    R : (N, m) ∂r/∂λ, Bᵀ unless forces depend on multipliers
    h, rate, change : (m,) h, ḣ and ḧ; of rows on velocities h = 0, their rate and its change
    B : (m, n_v) ∂h/∂x = ∂ḣ/∂v, of rows on velocities ∂rate/∂v
    turning : (m, n_v) ∂ḣ/∂x
    change_speed, change_place : (m, n_v) ∂ḧ/∂v and ∂ḧ/∂x with accelerations held
    carried : (n_v, n_v) ``ẋ = v + carried x`` of a small displacement x from a motion with velocities v: −[v, x], with
        which displacements measured in axes that turn change; 0 where coordinates add

    Where coordinates do not add, derivatives by x are those along velocities, at the state that is reached.
    """

    r: Vector
    M: Matrix
    C: Matrix
    K: Matrix
    R: Matrix
    h: Vector
    rate: Vector
    change: Vector
    B: Matrix
    turning: Matrix
    change_speed: Matrix
    change_place: Matrix
    carried: Matrix

    @classmethod
    def shapes(cls, n: int, n_v: int, m: int) -> list[tuple[int, ...]]:
        """The shapes of the fields, in the order in which the program lists them."""
        return [
            (n,), (n, n), (n, n), (n, n_v), (n, m), (m,), (m,), (m,), (m, n_v), (m, n_v), (m, n_v), (m, n_v),
            (n_v, n_v),
        ]  # fmt: skip

    @classmethod
    def of(cls, out: Vector, n: int, n_v: int, m: int) -> LinearTerms:
        """The fields from the numbers that the program gives."""
        shapes = cls.shapes(n, n_v, m)
        parts = np.split(out, np.cumsum([int(np.prod(shape)) for shape in shapes]))
        return cls(*(part.reshape(shape) for part, shape in zip(parts, shapes, strict=False)))


def linearization(
    equations: Equations, rows: Sequence[int], penalties: Sequence[int], sliding: Sequence[int] = ()
) -> list[Node]:
    """The fields of `LinearTerms` in their order, matrices row by row, for one contact mode.

    Parameters
    ----------
    rows : numbers of the active rows
    penalties : numbers of the penalty contacts that act
    sliding : numbers of the frictions that slide
    """
    inputs, rows = Inputs.of(equations), sorted(rows)
    r = balance_with(equations, rows, penalties, sliding)
    B = constraint_jacobian(equations, rows)
    h, rate = [equations.rows[k].value for k in rows], [equations.rows[k].rate for k in rows]
    change = row_changes(equations, rows)
    rates, speeds = (*inputs.a, *inputs.s), (*inputs.v, *inputs.z)
    matrices = [
        across(jvps(r, [{rate: 1.0} for rate in rates]), len(r)),
        across(jvps(r, [{speed: 1.0} for speed in speeds]), len(r)),
        across(along_places(equations, r), len(r)),
        across(jvps(r, [{inputs.lam[k]: 1.0} for k in rows]), len(r)),
    ]
    of_rows = [
        [entry for line in B for entry in line],
        across(along_places(equations, rate), len(rows)),
        across(jvps(change, [{speed: 1.0} for speed in inputs.v]), len(rows)),
        across(along_places(equations, change), len(rows)),
        across(_carried(inputs), len(inputs.v)),
    ]
    return [*r, *chain(*matrices), *h, *rate, *change, *chain(*of_rows)]


def row_changes(equations: Equations, rows: Sequence[int]) -> list[Node]:
    """ḧ of rows: the rates of ḣ along the motion, with its accelerations."""
    inputs, rate = Inputs.of(equations), [equations.rows[k].rate for k in rows]
    seeds: dict[Node, Scalar] = {inputs.t: 1.0, **inputs.clock}
    known = {} if equations.geometry is None else equations.geometry.rates(rate)
    change = jvp(rate, {**seeds, **known})
    for k, line in enumerate(constraint_jacobian(equations, rows)):
        for slope, acceleration in zip(line, inputs.a, strict=True):
            change[k] = change[k] + slope * acceleration
    return change


def along_places(equations: Equations, values: Sequence[Node]) -> list[list[Node]]:
    """Derivatives along each velocity, ∂value/∂x where coordinates add, one list a velocity."""
    along = Inputs.of(equations).along
    known = [{} for _ in along] if equations.geometry is None else equations.geometry.partials(values)
    return jvps(values, [{**seeds, **known[j]} for j, seeds in enumerate(along)])


def _carried(inputs: Inputs) -> list[list[Node]]:
    """Columns of ``x ↦ D⁻¹(x) v − D⁻¹(v) x`` to first order, which is [x, v]."""
    if inputs.chart is None:
        zero = 0.0 * inputs.t
        return [[zero] * len(inputs.v) for _ in inputs.v]
    flow, along = inputs.chart.rates, dict(zip(inputs.x, inputs.v, strict=True))
    moved = jvps(flow, [{x: 1.0} for x in inputs.x])
    turned = [jvp(jvp(flow, {v: 1.0}), along) for v in inputs.v]
    return [[a - b for a, b in zip(*pair, strict=True)] for pair in zip(moved, turned, strict=True)]


def across(columns: Sequence[Sequence[Node]], height: int) -> list[Node]:
    """Columns as a matrix, row by row."""
    return [column[i] for i in range(height) for column in columns]
