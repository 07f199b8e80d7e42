"""Points of a branch at which it turns or its stability changes: test functions, and their zeros between two points.

fold : the part of the tangent along the parameter; a multiplier is 1
doubling : ``Π (μ + 1)``; a multiplier is −1, beside it gaits of two periods
torus : ``Π_{i<j} (μ_i μ_j − 1)`` with a complex pair of modulus 1 (Neimark & Sacker)
branch point : ``det [P − 1, σ F_p; τᵀ]``; another branch crosses, such as that of a walk that begins to limp

(Kuznetsov 2004, Elements of Applied Bifurcation Theory, ch. 10.)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mbd.errors import MbdError
from mbd.gait.continuation import BranchPoint, Continuation, Corrected

__all__ = ["KINDS", "SpecialPoint", "special_points"]

ITERATIONS = 40
"""Evaluations of a test function between two points at most."""
LOCATED = 1e-12
"""Width of the parameter, over that of its range, at which a point counts as located [-]."""
COMPLEX = 1e-7
"""Imaginary part from which on a pair of multipliers is complex [-]."""


@dataclass(frozen=True, eq=False)
class SpecialPoint:
    """Where a branch turns or its stability changes.

    kind : 'fold', 'doubling', 'torus' or 'branch point'; value : of the parameter; point : the gait there
    error : half the width of the bracket in which the parameter lies, and what the error of P makes of it
    """

    kind: str
    value: float
    point: BranchPoint
    error: float

    def __repr__(self) -> str:
        return f"{self.kind} at {self.value:.12g} (± {self.error:.1g})"


def _fold(point: BranchPoint) -> float:
    return float(point.tangent[-1])


def _doubling(point: BranchPoint) -> float:
    return float(np.prod(point.multipliers.values + 1.0).real)


def _torus(point: BranchPoint) -> float:
    values = point.multipliers.values
    pairs = [values[i] * values[j] - 1.0 for i in range(len(values)) for j in range(i)]
    return float(np.prod(pairs).real) if pairs else 1.0


def _crossing(point: BranchPoint) -> float:
    return float(np.linalg.det(np.vstack([point.matrix, point.tangent])))


KINDS: dict[str, Callable[[BranchPoint], float]] = {
    "fold": _fold, "doubling": _doubling, "torus": _torus, "branch point": _crossing,
}  # fmt: skip
"""Test functions, whose zeros are the points of that kind."""


def special_points(given: Continuation, one: BranchPoint, other: BranchPoint, ds: float) -> list[SpecialPoint]:
    """The special points between a point and the one that lies ds further along its tangent."""
    found = []
    for kind, test in KINDS.items():
        ends = test(one), test(other)
        if kind in ("torus", "doubling") and len(one.multipliers.values) != len(other.multipliers.values):
            continue  # a direction was forgotten on the way
        if np.isfinite(ends).all() and ends[0] * ends[1] < 0.0:
            located = _located(given, one, other, ds, test)
            if located is not None and _is_one(kind, located[0]):
                found.append(SpecialPoint(kind, located[0].value, *located))
    return sorted(found, key=lambda special: abs(special.value - one.value))


def _is_one(kind: str, point: BranchPoint) -> bool:
    """Of a torus that a complex pair has modulus 1; two real multipliers with product 1 are none."""
    if kind != "torus":
        return True
    values = point.multipliers.values
    at = int(np.argmin(np.abs(np.abs(values) - 1.0)))
    return bool(abs(values[at].imag) > COMPLEX)


def _located(
    given: Continuation, one: BranchPoint, other: BranchPoint, ds: float, test: Callable[[BranchPoint], float]
) -> tuple[BranchPoint, float] | None:
    """The point where a test function is zero, by the Illinois form of the rule of false position, and its error."""
    (a, fa), (b, fb) = (0.0, test(one)), (ds, test(other))
    best, side, values = other, 0, (one.value, other.value)
    whole = given.whole(one)
    for _ in range(ITERATIONS):
        middle = b - fb * (b - a) / (fb - fa)
        try:
            corrected = given.corrected(one, one.tangent, middle)
            if not isinstance(corrected, Corrected):
                return None
            point = given.point(corrected, whole)
        except MbdError:
            return None
        now, change = test(point), abs(point.value - best.value)
        best = point
        if now == 0.0 or change <= LOCATED * given.width:
            break
        if now * fb > 0.0:
            b, fb, fa, side = middle, now, fa * (0.5 if side == 1 else 1.0), 1
        else:
            a, fa, fb, side = middle, now, fb * (0.5 if side == -1 else 1.0), -1
    slope = abs((test(other) - test(one)) / (values[1] - values[0] or 1.0)) or 1.0
    return best, change + best.multipliers.error / slope
