"""Samples to piecewise cubics: the breaks and coefficients of a `Table`."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Literal, NamedTuple, TypeAlias

from mbd.errors import ModelError

Beyond: TypeAlias = Literal["constant", "linear"]
"""How a table goes on outside its samples: at the last value, or along the last slope."""

Ends: TypeAlias = Literal["not-a-knot", "natural", "clamped", "periodic"]
"""Ends of a spline: its third derivative does not jump beside them, no second derivative, no slope, or they meet."""

Coefficients: TypeAlias = tuple[float, float, float, float]

MAX_COEFFICIENT = 1e290
"""Change over the cube of its width beyond which the coefficients of a cubic are no numbers [-]."""


class Pieces(NamedTuple):
    """n breaks and n rows of cubic coefficients, as `Tape.table` takes them: ``table(name, *pieces)``."""

    breaks: tuple[float, ...]
    coefficients: tuple[Coefficients, ...]


def linear(xs: Sequence[float], ys: Sequence[float], beyond: Beyond = "constant", what: str = "table") -> Pieces:
    """Straight lines through the samples.

    Parameters
    ----------
    xs, ys : n ≥ 2 samples, xs increasing
    beyond : how it goes on outside
    what : the user's object, for errors

    >>> linear([0.0, 2.0], [1.0, 5.0]).coefficients
    ((1.0, 0.0, 0.0, 0.0), (1.0, 2.0, 0.0, 0.0), (5.0, 0.0, 0.0, 0.0))
    """
    x, y = _checked(xs, ys, what)
    _checked_slopes(x, y, what)
    rows = [(y[k], (y[k + 1] - y[k]) / (x[k + 1] - x[k]), 0.0, 0.0) for k in range(len(x) - 1)]
    return _continued(x, y, rows, rows[0][1], rows[-1][1], beyond)


def monotone(xs: Sequence[float], ys: Sequence[float], beyond: Beyond = "linear", what: str = "table") -> Pieces:
    """Shape-preserving cubics through the samples (Fritsch & Butland 1984; `scipy.interpolate.PchipInterpolator`).

    No overshoot: where the samples rise the curve rises, and its slope is continuous.

    Parameters
    ----------
    xs, ys : n ≥ 2 samples, xs increasing
    beyond : how it goes on outside
    what : the user's object, for errors
    """
    from scipy.interpolate import PchipInterpolator

    x, y = _checked(xs, ys, what)
    _checked_slopes(x, y, what)
    curve = PchipInterpolator(x, y)
    rows: list[Coefficients] = [tuple(float(c) for c in reversed(column)) for column in curve.c.T]  # type: ignore[misc]
    first, last = (float(slope) for slope in curve.derivative()([x[0], x[-1]]))
    return _continued(x, y, rows, first, last, beyond)


def spline(xs: Sequence[float], ys: Sequence[float], ends: Ends = "not-a-knot", what: str = "table") -> Pieces:
    """Cubics with a continuous second derivative (`scipy.interpolate.CubicSpline`), constant outside.

    Parameters
    ----------
    xs, ys : n ≥ 2 samples, xs increasing; n ≥ 3 that repeat, of which the last is the first
    ends : what determines the first and the last cubic; one that repeats continues with the first behind the last
    what : the user's object, for errors
    """
    from scipy.interpolate import CubicSpline

    x, y = _checked(xs, ys, what)
    _checked_slopes(x, y, what)
    curve = CubicSpline(x, y, bc_type=ends)
    rows: list[Coefficients] = [tuple(float(c) for c in reversed(column)) for column in curve.c.T]  # type: ignore[misc]
    inside = _continued(x, y, rows, 0.0, 0.0, "constant")
    return inside if ends != "periodic" else Pieces(inside.breaks, (*inside.coefficients[:-1], rows[0]))


def hold(xs: Sequence[float], ys: Sequence[float], what: str = "table") -> Pieces:
    """Each sample until the next one comes.

    Parameters
    ----------
    xs, ys : n ≥ 1 samples, xs increasing
    what : the user's object, for errors

    >>> hold([0.0, 2.0], [1.0, 5.0]).coefficients
    ((1.0, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), (5.0, 0.0, 0.0, 0.0))
    """
    x, y = _checked(xs, ys, what)
    return _continued(x, y, [(value, 0.0, 0.0, 0.0) for value in y[:-1]], 0.0, 0.0, "constant")


def joined(known: Sequence[tuple[float, float, float]]) -> tuple[Pieces, float]:
    """The integral of the curve with given values and slopes, and its value at the end.

    The curve has two quadratics to an interval, which meet in its middle with one slope (L. L. Schumaker, On shape
    preserving quadratic spline interpolation, SIAM J. Numer. Anal. 20 (1983) 853); the integral begins at 0.

    Parameters
    ----------
    known : (abscissa, value, slope) in order

    >>> joined([(0.0, 0.0, 0.0), (2.0, 4.0, 4.0)])[1]  # of x²
    2.6666666666666665
    """
    breaks: list[float] = []
    rows: list[Coefficients] = []
    total = 0.0
    for (a, ya, sa), (b, yb, sb) in pairwise(known):
        half = 0.5 * (b - a)
        middle = (yb - ya) / half - 0.5 * (sa + sb)
        for start, y, slope, end in ((a, ya, sa, middle), (a + half, ya + 0.5 * half * (sa + middle), middle, sb)):
            bend = (end - slope) / (2.0 * half)
            breaks.append(start)
            rows.append((total, y, 0.5 * slope, bend / 3.0))
            total += half * (y + half * (0.5 * slope + half * bend / 3.0))
    return Pieces(tuple(breaks), tuple(rows)), total


def integral(xs: Sequence[float], ys: Sequence[float], what: str = "table") -> Pieces:
    """∫ y dx of the curve through samples by quadratics that keep their shape, which goes on straight outside.

    Parameters
    ----------
    xs, ys : n ≥ 2 samples, xs increasing; where they rise the curve rises
    what : the user's object, for errors
    """
    x, y = _checked(xs, ys, what)
    _checked_slopes(x, y, what)
    secants = [(d - c) / (b - a) for (a, b), (c, d) in zip(pairwise(x), pairwise(y), strict=True)]
    inner = [2.0 * a * b / (a + b) if a * b > 0.0 else 0.0 for a, b in pairwise(secants)]  # ≤ twice the smaller one
    slopes = [secants[0], *inner, secants[-1]]
    inside, total = joined(list(zip(x, y, slopes, strict=True)))
    width = x[1] - x[0]
    before = (-width * (y[0] - 0.5 * slopes[0] * width), y[0] - slopes[0] * width, 0.5 * slopes[0], 0.0)
    after = (total, y[-1], 0.5 * slopes[-1], 0.0)
    return Pieces((x[0] - width, *inside.breaks, x[-1]), (before, *inside.coefficients, after))


def _continued(
    x: list[float], y: list[float], rows: list[Coefficients], first: float, last: float, beyond: Beyond
) -> Pieces:
    """The inner pieces with one more on either side, of slopes `first` and `last` or constant."""
    if beyond not in ("constant", "linear"):
        raise ModelError(f"beyond = {beyond!r} is not known; use 'constant' or 'linear'")
    width = x[1] - x[0]
    before: Coefficients = (y[0], 0.0, 0.0, 0.0)
    after: Coefficients = (y[-1], 0.0, 0.0, 0.0)
    if beyond == "linear":
        before = (y[0] - first * width, first, 0.0, 0.0)
        after = (y[-1], last, 0.0, 0.0)
    return Pieces((x[0] - width, *x), (before, *rows, after))


def _checked_slopes(x: list[float], y: list[float], what: str) -> None:
    """Samples so close in time, or so far apart in value, that no number tells how steep they are."""
    for k in range(len(x) - 1):
        width, slope = x[k + 1] - x[k], abs(y[k + 1] - y[k])
        if (
            slope > 0.0 and not slope < MAX_COEFFICIENT * min(width, 1.0) ** 3
        ):  # the last coefficient divides by the cube
            raise ModelError(
                f"{what}: from number {k} to number {k + 1} the ordinate changes by {slope:.3g} over {width:.3g}, too "
                "steep for numbers; check the units, or take samples further apart"
            )


def _checked(xs: Sequence[float], ys: Sequence[float], what: str) -> tuple[list[float], list[float]]:
    """The samples as floats; every fault is an error that says which sample."""
    x, y = [float(value) for value in xs], [float(value) for value in ys]
    faults = []
    if len(x) != len(y):
        faults.append(f"{what}: {len(x)} abscissae and {len(y)} ordinates; give as many of one as of the other")
    if len(x) < 2:
        faults.append(f"{what}: at least two samples are needed, got {len(x)}")
    for kind, values in ("abscissa", x), ("ordinate", y):
        bad = [k for k, value in enumerate(values) if not math.isfinite(value)]
        if bad:
            more = f" and {len(bad) - 1} more" if len(bad) > 1 else ""
            faults.append(
                f"{what}: {kind} number {bad[0]} is {values[bad[0]]}{more}; remove missing samples or fill them first"
            )
    back = [k for k in range(len(x) - 1) if x[k + 1] <= x[k]]
    if back:
        k = back[0]
        faults.append(
            f"{what}: abscissae must increase, but number {k} is {x[k]:g} and number {k + 1} is {x[k + 1]:g}; sort them"
        )
    if faults:
        raise ModelError(faults)
    return x, y
