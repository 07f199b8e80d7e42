"""What the pass carries from row to row: a state with the derivatives of all its parts, and the mode that holds.

A direction is one thing that the run may be differentiated by. Derivatives are total: those of an instant t* that an
event determines are part of them, and what is differentiated are the numbers of the row, at its own instant.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.sensitivity.programs import Columns, State


@dataclass(frozen=True)
class Mode:
    """What acts: numbers of the rows; closed; signs of sliding."""

    held: tuple[int, ...]
    closed: Vector
    switch: Vector
    slip: Vector


@dataclass(frozen=True)
class First:
    """The first row: t, q, y = (v, z), what contacts hold there, what acts, and whether a run has ended there."""

    t: float
    q: Vector
    y: Vector
    anchors: Vector
    mode: Mode
    is_end: bool = False


@dataclass(frozen=True)
class Tangent:
    """Derivatives of a state in D directions: t (D,), q (n_v, D), y (n, D), anchors (A, D); of the parameters p (P, D).

    q is along velocities.
    """

    t: Vector
    q: Matrix
    y: Matrix
    anchors: Matrix
    p: Matrix

    def stacked(self, columns: Columns, rate: Matrix | None = None, lam: Matrix | None = None) -> Matrix:
        """As the columns of `Programs` stand, with derivatives of rates and multipliers where they are given."""
        out = np.zeros((columns.count, len(self.t)))
        out[columns.x], out[columns.y], out[columns.t] = self.q, self.y, self.t
        out[columns.anchor], out[columns.p] = self.anchors, self.p
        if rate is not None:
            out[columns.rate] = rate
        if lam is not None:
            out[columns.lam] = lam
        return out


@dataclass(frozen=True)
class Motion:
    """t, q, y = (v, z), anchors, and their derivatives."""

    t: float
    q: Vector
    y: Vector
    anchors: Vector
    tangent: Tangent

    def at(self, mode: Mode, rate: Vector, lam: Vector) -> State:
        """Where programs are evaluated, with the multipliers of the rows that act."""
        active = np.zeros_like(lam)
        active[list(mode.held)] = lam[list(mode.held)]
        return State(self.t, self.q, self.y, rate, active, self.anchors, mode.switch, mode.slip)

    def with_tangent(self, **parts: Matrix) -> Motion:
        """The same with other derivatives."""
        return replace(self, tangent=replace(self.tangent, **parts))


@dataclass(frozen=True)
class Rates:
    """(v̇, ż) (n,) and λ (R,), and their derivatives (n, D), (R, D)."""

    rate: Vector
    lam: Vector
    of_rate: Matrix
    of_lam: Matrix
