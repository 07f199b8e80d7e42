"""Curves of `scipy.interpolate` as tables: those that are cubics, piece by piece."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from mbd.errors import ModelError
from mbd.tape.interpolation import Pieces
from mbd.tape.table import Table

KIND = {"CubicSpline": "spline", "PchipInterpolator": "monotone", "Akima1DInterpolator": "monotone"}
"""Kinds of curves that their class tells."""
BY_JUMP = ("hold", "linear", "monotone", "spline", "spline")
"""Kinds of others by the lowest derivative that jumps."""
ADVICE = "give the samples themselves, mbd.Samples(time, values), or a CubicSpline"


class Curve(NamedTuple):
    """One component of a curve: its breaks, its values there, what kind it is, and its polynomials."""

    time: tuple[float, ...]
    values: tuple[float, ...]
    kind: str
    periodic: bool
    pieces: Pieces


def is_curve(value: Any) -> bool:
    """Whether a value is an object of `scipy.interpolate`."""
    module: str = getattr(type(value), "__module__", "") or ""
    return module.startswith("scipy.interpolate") and callable(value)


def curves_of(value: Any, what: str) -> list[Curve]:
    """The components of a curve of `scipy.interpolate`, flat.

    Raises
    ------
    ModelError
        for what is no piecewise polynomial of one variable and degree 3 at most with finite coefficients.
    """
    curve, outside = _polynomials(value, what)
    breaks, rows = np.asarray(curve.x, dtype=float), np.asarray(curve.c)
    if np.iscomplexobj(rows) or not (np.all(np.isfinite(rows)) and np.all(np.isfinite(breaks))):
        raise ModelError(f"{what}: the {type(value).__name__} has coefficients that are no finite real numbers")
    degree = len(rows) - 1
    if degree > 3:
        raise ModelError(
            f"{what}: a {type(value).__name__} of degree {degree} is no table of cubics; take k=3, or {ADVICE}"
        )
    if np.any(np.diff(breaks) < 0.0):
        raise ModelError(f"{what}: the breaks of the {type(value).__name__} do not increase; {ADVICE}")
    kept = np.diff(breaks) > 0.0
    rows = np.concatenate([rows[::-1], np.zeros((3 - degree, *rows.shape[1:]))])[:, kept].reshape(4, kept.sum(), -1)
    breaks = np.append(breaks[:-1][kept], breaks[-1])
    known = KIND.get(type(value).__name__)
    return [_component(breaks, rows[:, :, k].T, outside, known) for k in range(rows.shape[2])]


def _component(breaks: Any, rows: Any, outside: str, known: str | None) -> Curve:
    coefficients: list[tuple[float, ...]] = [tuple(map(float, row)) for row in rows]
    time = tuple(map(float, breaks))
    width = time[-1] - time[-2]
    last = sum(c * width**k for k, c in enumerate(coefficients[-1]))
    values = (*(row[0] for row in coefficients), last)
    inner = Table("curve", time[:-1], coefficients).jumps
    kind = known or BY_JUMP[min(inner, default=3)]
    if outside == "periodic":
        pieces = Pieces(time, (*coefficients, coefficients[0]))  # type: ignore[arg-type]
    elif outside == "continued":
        pieces = Pieces(time[:-1], tuple(coefficients))  # type: ignore[arg-type]
    else:
        before, after = ((value, 0.0, 0.0, 0.0) for value in (values[0], last))
        end = time[-1] + 64.0 * math.ulp(1.0) * max(abs(time[0]), abs(time[-1]))
        pieces = Pieces((time[0] - width, *time[:-1], end), (before, *coefficients, after))  # type: ignore[arg-type]
    return Curve(time, values, kind, outside == "periodic", pieces)


def _polynomials(value: Any, what: str) -> tuple[Any, str]:
    """The curve as a `PPoly`, and how it goes on outside: 'continued', 'periodic' or 'constant'."""
    from scipy.interpolate import BPoly, BSpline, PPoly, UnivariateSpline

    if isinstance(value, UnivariateSpline):
        knots, c, k = value._eval_args  # type: ignore[attr-defined]
        ways: Sequence[str] = ("continued", "zeros", "constant", "constant")
        outside = ways[int(getattr(value, "ext", 0))]
        if outside == "zeros":
            raise ModelError(f"{what}: a {type(value).__name__} with ext=1 jumps to zero outside; take ext=0 or ext=3")
        return PPoly.from_spline((knots, c, k)), outside
    given = getattr(value, "extrapolate", True)
    outside = "periodic" if given == "periodic" else "constant" if given is False else "continued"
    if isinstance(value, BSpline):
        if value.c.ndim > 1 and getattr(value, "axis", 0) != 0:
            raise ModelError(f"{what}: components of a BSpline stand along its last axis; take axis=0")
        inside = slice(value.k, len(value.t) - value.k)
        curve = PPoly.from_spline((value.t, value.c, value.k))
        keep = (curve.x[:-1] >= value.t[inside][0]) & (curve.x[1:] <= value.t[inside][-1])
        places = np.flatnonzero(keep)
        return PPoly(curve.c[:, places], np.append(curve.x[places], curve.x[places[-1] + 1])), outside
    if isinstance(value, BPoly):
        return PPoly.from_bernstein_basis(value), outside
    if isinstance(value, PPoly):
        if value.c.ndim > 2 and getattr(value, "axis", 0) != 0:
            raise ModelError(f"{what}: components of a {type(value).__name__} stand along its last axis; take axis=0")
        return value, outside
    name = type(value).__name__
    cure = "give mbd.Samples(curve.x, curve.y, kind='linear')" if name == "interp1d" else ADVICE
    raise ModelError(f"{what}: {name} of scipy is no curve whose polynomials are known; {cure}")
