"""Functions of coordinates in files of OpenSim, as functions that a measure can trace."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.dataclass import dataclass
from mbd.equal import NOMINAL_RTOL
from mbd.errors import ModelError
from mbd.forces.samples import Samples
from mbd.laboratory.models.xml import Element

MAX_ORDER = 12
"""Order of a polynomial of several coordinates that is read."""
FUNCTIONS = (
    "Constant", "LinearFunction", "PolynomialFunction", "SimmSpline", "NaturalCubicSpline", "natCubicSpline",
    "NatCubicSpline", "MultiplierFunction", "PiecewiseLinearFunction", "MultivariatePolynomialFunction",
)  # fmt: skip
"""Functions that are read."""


@dataclass(frozen=True)
class Linear:
    """``Σ slopes_k q_k + offset``."""

    slopes: tuple[float, ...]
    offset: float

    def __call__(self, *q: Any) -> Any:
        return sum((slope * x for slope, x in zip(self.slopes, q, strict=True)), self.offset)

    def scaled(self, factor: float) -> Linear:
        """The function times a number."""
        return Linear(tuple(factor * slope for slope in self.slopes), factor * self.offset)


@dataclass(frozen=True)
class Polynomial:
    """``c₀ q^n + … + c_n``, the highest power first."""

    coefficients: tuple[float, ...]

    def __call__(self, q: Any) -> Any:
        value: Any = self.coefficients[0]
        for coefficient in self.coefficients[1:]:
            value = value * q + coefficient
        return value

    def scaled(self, factor: float) -> Polynomial:
        """The function times a number."""
        return Polynomial(tuple(factor * coefficient for coefficient in self.coefficients))


@dataclass(frozen=True)
class Powers:
    """``Σ c q₁^k₁ … q_n^k_n`` over all powers up to an order; those of the last coordinate run first."""

    coefficients: tuple[float, ...]
    powers: tuple[tuple[int, ...], ...]

    def __call__(self, *q: Any) -> Any:
        total: Any = 0.0
        for coefficient, powers in zip(self.coefficients, self.powers, strict=True):
            term: Any = coefficient
            for x, power in zip(q, powers, strict=True):
                for _ in range(power):
                    term = term * x
            total = total + term
        return total

    def scaled(self, factor: float) -> Powers:
        """The function times a number."""
        return Powers(tuple(factor * coefficient for coefficient in self.coefficients), self.powers)


@dataclass(frozen=True)
class Curve:
    """A factor times a spline of one coordinate."""

    samples: Samples
    factor: float = 1.0

    def __call__(self, q: Any) -> Any:
        return self.factor * self.samples(q)

    def scaled(self, factor: float) -> Curve:
        """The function times a number."""
        return Curve(self.samples, factor * self.factor)


def is_left_out(owner: Element) -> bool:
    """Whether a function is there, and none of those that are read."""
    inside = [child for child in owner if child.tag.endswith(("Function", "Spline"))]
    return len(inside) == 1 and inside[0].tag not in FUNCTIONS


def function_of(owner: Element, arguments: int, what: str) -> Linear | Polynomial | Powers | Curve:
    """The function in an element of its own, or within <function>.

    Raises
    ------
    ModelError
        for none or several, those of another kind, and wrong coefficients; the error says of what.
    """
    inside = owner.find("function") or owner
    found = [child for child in inside if child.tag.endswith(("Function", "Spline")) or child.tag == "Constant"]
    if len(found) != 1:
        raise owner.wrong(f"one function of {what} is expected, got {len(found)}")
    function = found[0]
    if function.tag not in FUNCTIONS:
        raise function.wrong(
            f"is the function of {what}, which cannot be stated exactly; there are Constant, LinearFunction, "
            "PolynomialFunction, MultivariatePolynomialFunction, SimmSpline, PiecewiseLinearFunction and "
            "MultiplierFunction"
        )
    if function.tag == "Constant":
        return Linear((0.0,) * arguments, _values(function, "value", what, 1)[0])
    if function.tag == "MultiplierFunction":
        (scale,) = _values(function, "scale", what, 1) if function.find("scale") else (1.0,)
        return function_of(function, arguments, what).scaled(scale)
    if function.tag == "LinearFunction":
        *slopes, offset = _values(function, "coefficients", what, arguments + 1)
        return Linear(tuple(slopes), offset)
    if function.tag == "MultivariatePolynomialFunction":
        return _powers(function, arguments, what)
    if arguments != 1:
        raise function.wrong(f"is a function of {what} of one coordinate, got {arguments}")
    if function.tag == "PolynomialFunction":
        return Polynomial(_values(function, "coefficients", what))
    x, y = (np.array(_values(function, axis, what)) for axis in "xy")
    if len(x) != len(y) or len(x) < 2 or not np.all(np.diff(x) > 0.0):
        raise function.wrong(
            f"of {what} needs at least two points with increasing x and as many y, got {len(x)} and {len(y)}"
        )
    if function.tag == "PiecewiseLinearFunction" and not has_corners(x, y):
        slope = float((y[-1] - y[0]) / (x[-1] - x[0]))
        return Linear((slope,), float(y[0] - slope * x[0]))
    try:
        return Curve(simm_spline(x, y))
    except (ModelError, np.linalg.LinAlgError) as error:
        raise function.wrong(f"of {what} is no spline of finite numbers: {error}") from None


def has_corners(x: Vector, y: Vector) -> bool:
    """Whether points do not lie on one line, but for the digits of a file."""
    line = y[0] + (y[-1] - y[0]) * (x - x[0]) / (x[-1] - x[0])
    return bool(np.abs(y - line).max() > NOMINAL_RTOL * np.abs(y).max())


def _powers(function: Element, arguments: int, what: str) -> Powers:
    """A polynomial of several coordinates."""
    dimension, order = (int(_values(function, tag, what, 1)[0]) for tag in ("dimension", "order"))
    if dimension != arguments or not 0 <= order <= MAX_ORDER:
        raise function.wrong(
            f"of {what} needs the dimension {arguments} and an order from 0 to {MAX_ORDER}, got {dimension} and {order}"
        )
    powers = [p for p in np.ndindex(*(order + 1,) * dimension) if sum(p) <= order]
    return Powers(_values(function, "coefficients", what, len(powers)), tuple(powers))


def _values(function: Element, tag: str, what: str, count: int | None = None) -> tuple[float, ...]:
    child = function.find(tag)
    if child is None:
        raise function.wrong(f"of {what} needs <{tag}>")
    return child.parsed(child.text, count or max(len(child.text.split()), 1), tag)


def simm_spline(x: Vector, y: Vector) -> Samples:
    """The cubic spline of SIMM and OpenSim through points, straight outside.

    Its second derivatives m solve ``h₋ m₋ + 2 (h₋ + h) m + h m₊ = 6 (s − s₋)`` with widths h and slopes s of the
    intervals; at each end the third derivative is that of the cubic through the four points there, 0 with three points
    (G. E. Forsythe, M. A. Malcolm and C. B. Moler, Computer Methods for Mathematical Computations, 1977, ch. 4).

    Parameters
    ----------
    x, y : (n) points, n ≥ 2, x increasing
    """
    from scipy.interpolate import PPoly

    n, h = len(x), np.diff(x)
    s = np.diff(y) / h
    A, b = np.zeros((n, n)), np.zeros(n)
    if n == 2:
        A = np.eye(2)
    else:
        for k in range(1, n - 1):
            A[k, k - 1 : k + 2] = h[k - 1], 2.0 * (h[k - 1] + h[k]), h[k]
            b[k] = 6.0 * (s[k] - s[k - 1])
        A[0, :2], A[-1, -2:] = (-1.0, 1.0), (-1.0, 1.0)
        if n > 3:
            b[0] = h[0] * _third_derivative(x[:4], y[:4])
            b[-1] = h[-1] * _third_derivative(x[-4:], y[-4:])
    m = np.linalg.solve(A, b)
    slope = s - h * (2.0 * m[:-1] + m[1:]) / 6.0
    last = s[-1] + h[-1] * (m[-2] + 2.0 * m[-1]) / 6.0
    pieces = np.stack([np.diff(m) / h / 6.0, 0.5 * m[:-1], slope, y[:-1]])
    before, after = ([0.0, 0.0, slope[0], y[0] - slope[0]], [0.0, 0.0, last, y[-1]])
    table = np.concatenate([np.array([before]).T, pieces, np.array([after]).T], axis=1)
    return Samples.of(PPoly(table, np.concatenate([[x[0] - 1.0], x, [x[-1] + 1.0]])), "SimmSpline")  # type: ignore[return-value]


def _third_derivative(x: Vector, y: Vector) -> float:
    """Of the cubic through four points, by divided differences."""
    for order in (1, 2, 3):
        y = np.diff(y) / (x[order:] - x[:-order])
    return 6.0 * float(y[0])
