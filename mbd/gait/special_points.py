"""Points of a branch at which it turns or its stability changes: test functions, and their zeros between two points.

fold : the part of the tangent along the parameter; a multiplier is 1
doubling : ``Π (μ + 1)``; a multiplier is −1, beside it gaits of two periods
torus : ``Π_{i<j} (μ_i μ_j − 1)`` with a complex pair of modulus 1 (Neimark & Sacker)
branch point : ``det [P − 1, σ F_p; τᵀ]``; another branch crosses, such as that of a walk that begins to limp

(Kuznetsov 2004, Elements of Applied Bifurcation Theory, ch. 10.)
"""

from collections.abc import Callable
from dataclasses import field, replace

import numpy as np

from mbd.arrays import Vector
from mbd.dataclass import dataclass
from mbd.equal import BRACKET_RTOL
from mbd.errors import GaitError, MbdError
from mbd.gait.continuation import BranchPoint, Continuation, Corrected

CLOSE, SECANTS = 1e-3, 8
"""Distance along the tangent from which on derivatives are found with least errors [-], and how often."""


@dataclass(frozen=True, eq=False)
class SpecialPoint:
    """Where a branch turns or its stability changes.

    kind : one of `KINDS`; value : of the parameter; point : the gait there
    error : of the parameter: the width of the bracket in which it lies, and what the error of P, that of the steps of
        the map, found with half of them, and what is left of its equations make of it
    what : the contact or event that it is about; '' of folds, doublings, tori and branch points
    before : where the events of the walk change there, a gait of the branch before it
    """

    kind: str
    value: float
    point: BranchPoint
    error: float
    what: str = ""
    before: BranchPoint | None = field(default=None, repr=False)

    def __repr__(self) -> str:
        name = f"{self.kind} of {self.what!r}" if self.what else self.kind
        return f"{name} at {self.value:.12g} (± {self.error:.1g})"


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


TESTS: dict[str, Callable[[BranchPoint], float]] = {
    "fold": _fold, "doubling": _doubling, "torus": _torus, "branch point": _crossing,
}  # fmt: skip
"""Test functions, whose zeros are the points of that kind."""
KINDS = (*TESTS, "scuff", "graze", "release", "slip", "pull", "new event", "lost event", "fall")
"""Kinds of special points; the others are found in `mbd.gait.limits` and `mbd.gait.margins`."""


def special_points(
    given: Continuation, one: BranchPoint, other: BranchPoint, ds: float
) -> tuple[list[SpecialPoint], bool]:
    """The special points between a point and the one that lies ds further along its tangent; whether these are all.

    They are not where a test function changes its sign and is zero nowhere between: both points may then lie on two
    branches.
    """
    found, complete = list[SpecialPoint](), True
    for kind, test in TESTS.items():
        ends = test(one), test(other)
        if kind == "torus" and len(one.multipliers.values) != len(other.multipliers.values):
            continue  # a direction was forgotten on the way, whose multiplier of 0 is a factor −1 of each pair
        if np.isfinite(ends).all() and ends[0] * ends[1] < 0.0:
            located = _located(given, one, other, ds, test)
            # at a zero the test function is far below its values at both ends
            if located is None or abs(test(located[0])) > 0.01 * min(map(abs, ends)):
                complete = False
            elif _is_one(kind, located[0]):
                found.append(SpecialPoint(kind, located[0].value, *located))
    return sorted(found, key=lambda special: abs(special.value - one.value)), complete


def _is_one(kind: str, point: BranchPoint) -> bool:
    """Of a torus that a complex pair has modulus 1; two real multipliers with product 1 are none."""
    if kind != "torus":
        return True
    values = point.multipliers.values
    at = int(np.argmin(np.abs(np.abs(values) - 1.0)))
    return bool(abs(values[at].imag) > 1e-7)  # the pair is complex


def _located(
    given: Continuation, one: BranchPoint, other: BranchPoint, ds: float, test: Callable[[BranchPoint], float]
) -> tuple[BranchPoint, float] | None:
    """The point where a test function is zero, and its error.

    By Brent's method, then by secants with derivatives of the least error.
    """

    def value(place: float) -> float:
        found = _at(given, one, place, 2)
        if found is None:
            raise GaitError("there is no gait between")
        return test(found[0])

    try:
        place, slope = zero_between(value, (test(one), test(other), ds), CLOSE)
    except GaitError:
        return None
    return polished(given, one, place, slope, test)


def zero_between(
    function: Callable[[float], float], bracket: tuple[float, float, float], xtol: float
) -> tuple[float, float]:
    """A zero of a function between 0 and ds by Brent's method, and the slope between its last two values.

    bracket : its values at 0 and ds, of unlike sign, and ds; xtol : width at which the zero counts as found
    """
    from scipy.optimize import brentq

    before, after, ds = bracket
    values = {0.0: before, ds: after}

    def value(place: float) -> float:
        if place not in values:
            values[place] = function(place)
        return values[place]

    place = float(brentq(value, 0.0, ds, xtol=xtol, maxiter=40, disp=False))
    (a, fa), (b, fb) = list(values.items())[-2:]
    return place, (fb - fa) / (b - a)


def polished(
    given: Continuation, one: BranchPoint, place: float, slope: float, test: Callable[[BranchPoint], float]
) -> tuple[BranchPoint, float] | None:
    """The zero of a test function near a place along the tangent, and its error."""
    along = np.inf
    best: tuple[BranchPoint, float, float, float] | None = None
    last: tuple[float, float] | None = None
    for _ in range(SECANTS):
        found = _at(given, one, place, 3)
        if found is None:
            break
        point, left = found
        now = test(point)
        if last is not None and place != last[0] and now != last[1]:
            slope = (now - last[1]) / (place - last[0])
        step = -now / slope if slope else 0.0
        rate = abs((point.value - one.value) / place if place else given.width * one.tangent[-1])
        if abs(step) >= along:  # no more is to be had from these derivatives
            break
        along, last = abs(step), (place, now)
        best = point, float(rate * along + abs(rate * point.multipliers.error / (slope or 1.0)) + left), place, rate
        if rate * along <= BRACKET_RTOL * given.width:
            break
        place += step
    if best is None:
        return None
    point, error, place, rate = best
    finer = _at(given.with_half_steps(), one, place, 3)
    if finer is None:
        return point, error
    of_steps = abs(finer[0].value - point.value) + rate * abs((test(finer[0]) - test(point)) / (slope or 1.0))
    return point, float(error + of_steps + finer[1])


def _at(given: Continuation, one: BranchPoint, place: float, levels: int) -> tuple[BranchPoint, float] | None:
    """The point at a distance along the tangent of another one, with what is left of its equations in the parameter;
    None where there is none.
    """
    best: Corrected | None = None
    guess: Vector | None = None
    try:
        for tol in (given.tol, 1e-3 * given.tol):  # the smaller one where it is reached
            corrected = replace(given, tol=tol).corrected(one, one.tangent, place, guess)
            if not isinstance(corrected, Corrected):
                break
            best, guess = corrected, corrected.u
        return None if best is None else (given.point(best, given.whole(one), levels), best.left)
    except MbdError:
        return None
