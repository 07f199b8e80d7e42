"""Forces of fiber and tendon over their lengths and velocity, normalized: De Groote & Fregly, and Millard et al."""

import math
from abc import ABC, abstractmethod
from functools import cache, cached_property
from itertools import pairwise
from math import comb
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.forces.samples import Samples
from mbd.tape.functions import cosh, exp, log, minimum, sign, sinh, sqrt

EXTENSION_LENGTH = 1.0
"""Length of the straight pieces in the table before the first and after the last corner, which continue [-]."""

Corner = tuple[Vector, Vector]
"""Six control points each of x and y."""

NEWTON_STEPS = 12
"""The same from rest with the velocity curve of Millard et al., for damping ≥ 0.01; 10 suffice for 0.1."""


class Curves(ABC):
    """Functions of traced scalars, floats and arrays; lengths in optimal fiber lengths or tendon slack lengths.

    With activation a, fiber length l, fiber velocity v in largest velocities and damping β the fiber carries
    ``a f_L(l) f_V(v) + f_P(l) + β v``.
    """

    least_damping: float
    """Below which a fiber with an elastic tendon has no velocity of its own [-]."""

    @abstractmethod
    def active(self, length: Any) -> Any:
        """f_L, 1 at l = 1."""

    @abstractmethod
    def passive(self, length: Any) -> Any:
        """f_P of the parallel elastic fiber."""

    @abstractmethod
    def speed(self, velocity: Any) -> Any:
        """f_V, 1 at rest, 0 where fibers shorten with v = −1."""

    @abstractmethod
    def tendon(self, length: Any) -> Any:
        """f_T, 0 at slack length."""

    @abstractmethod
    def velocity(self, active: Any, damping: Any, force: Any, damped: bool) -> Any:
        """v with ``A f_V(v) + β v = force``, A = a f_L; `damped` says whether β may be other than 0."""


class DeGrooteFregly(Curves):
    """F. De Groote, A. L. Kinney, A. V. Rao and B. J. Fregly, Ann. Biomed. Eng. 44 (2016) 2922.

    Three Gaussians, exponentials and an inverse hyperbolic sine, differentiable without end; tendon and passive force
    with the constants of OpenSim's class, so that f_T is 0 at slack length and 1 at a strain of 4.9 %.
    """

    GAUSSIANS = (
        (0.8150671134243542, 1.055033428970575, 0.162384573599574, 0.063303448465465),
        (0.433004984392647, 0.716775413397760, -0.029947116970696, 0.200356847296188),
        (0.1, 1.0, 0.5 * math.sqrt(0.5), 0.0),
    )
    D1, D2, D3, D4 = -0.3211346127989808, -8.149, -0.374, 0.8825327733249912
    STRAIN, STEEPNESS, SHORTEST = 0.6, 4.0, 0.2
    """Of the passive fiber: strain at one norm force, exponent, length without force."""
    TENDON_STRAIN, TENDON = 0.049, 0.2
    """Strain at one norm force, and the force before the exponential."""
    least_damping = 0.0

    def active(self, length: Any) -> Any:
        """Three Gaussians."""
        total: Any = 0.0
        for b1, b2, b3, b4 in self.GAUSSIANS:
            z = (length - b2) / (b3 + b4 * length)
            total = total + b1 * exp(-0.5 * z * z)
        return total

    def passive(self, length: Any) -> Any:
        """An exponential."""
        rate = self.STEEPNESS / self.STRAIN
        offset = math.exp(rate * (self.SHORTEST - 1.0))
        return (exp(rate * (length - 1.0)) - offset) / (math.exp(self.STEEPNESS) - offset)

    def speed(self, velocity: Any) -> Any:
        """``d₁ asinh(d₂ v + d₃) + d₄``."""
        return self.D1 * _asinh(self.D2 * velocity + self.D3) + self.D4

    def tendon(self, length: Any) -> Any:
        """An exponential."""
        rate = math.log((1.0 + self.TENDON) / self.TENDON) / self.TENDON_STRAIN
        return self.TENDON * (exp(rate * (length - 1.0)) - 1.0)

    def velocity(self, active: Any, damping: Any, force: Any, damped: bool) -> Any:
        """With ``u = asinh(d₂ v + d₃)`` it is ``P u + Q sinh u = S``, monotone: Halley's method from an upper bound.

        Without damping it is ``u = S / P``.
        """
        P = -self.D1 * active
        S = self.D4 * active - force
        if not damped:
            return (sinh(S / P) - self.D3) / self.D2
        Q = -damping / self.D2
        S = S + Q * self.D3
        size = abs(S)
        u = sign(S) * minimum(size / (P + Q), _asinh(size / Q))
        # corrections after which the velocity of a fiber is exact to 1e-15 for every damping > 0 and activation
        for _ in range(4):
            bend = Q * sinh(u)
            off, slope = P * u + bend - S, P + Q * cosh(u)
            u = u - 2.0 * off * slope / (2.0 * slope * slope - off * bend)
        return (sinh(u) - self.D3) / self.D2


class Millard(Curves):
    """M. Millard, T. Uchida, A. Seth and S. L. Delp, J. Biomech. Eng. 135 (2013) 021005: Bézier curves.

    The constants are theirs, without the least active force that an undamped fiber needs. The curves here are splines
    through points of the Bézier curves, with errors of some 1e-8.
    """

    least_damping = 0.01

    @cached_property
    def _active(self) -> Samples:
        x0, x1, x2, x3, shallow = 0.4441, 0.73, 1.0, 1.8123, 0.8616
        half = 0.05 * x2  # of the plateau
        y1 = 1.0 - shallow * (x2 - half - x1)
        steep = (x0 + 0.5 * (x1 - x0), 0.5 * y1, 1.25 * y1 / (x1 - x0))
        ascending = (x1 + 0.5 * (x2 - half - x1), y1 + 0.5 * (1.0 - y1), shallow)
        top = (x2, 1.0, 0.0)
        descending = (x2 + half + 0.5 * (x3 - x2 - half), 0.5, -1.0 / (x3 - x2 - 2.0 * half))
        ends = ((x0, 0.0, 0.0), (x3, 0.0, 0.0))
        line = (ends[0], steep, ascending, top, descending, ends[1])
        return _curve(*(_corner(a, b, 1.0) for a, b in pairwise(line)))

    @cached_property
    def _passive(self) -> Samples:
        strain, low, stiffness = 0.7, 0.2, 2.0 / 0.7
        width = min(0.1 / stiffness, 0.1 * strain)
        foot = (1.0 + width, 0.5 * low * width, low)
        return _curve(_corner((1.0, 0.0, 0.0), foot, 0.75), _corner(foot, (1.0 + strain, 1.0, stiffness), 0.75))

    @cached_property
    def _tendon(self) -> Samples:
        strain, toe, curviness = 0.049, 2.0 / 3.0, 0.5
        stiffness = 1.375 / strain
        x_toe = (toe - 1.0) / stiffness + 1.0 + strain
        foot = 1.0 + (x_toe - 1.0) / 10.0
        middle = (0.5 * toe - 1.0) / stiffness + 1.0 + strain
        slope = 0.5 * toe / (middle - foot)
        control = (foot + 0.5 * (middle - foot), 0.5 * slope * (middle - foot), slope)
        return _curve(
            _corner((1.0, 0.0, 0.0), control, curviness), _corner(control, (x_toe, toe, stiffness), curviness)
        )

    @cached_property
    def _speed(self) -> Samples:
        near_c, isometric, near_e, most = 0.25, 5.0, 0.15, 1.4
        line = ((-1.0, 0.0, 0.0), (-0.9, 0.05 * near_c, near_c), (0.0, 1.0, isometric))
        back = ((0.0, 1.0, isometric), (0.9, most - 0.05 * near_e, near_e), (1.0, most, 0.0))
        return _curve(
            *(_corner(a, b, 0.6) for a, b in pairwise(line)),
            *(_corner(a, b, 0.9) for a, b in pairwise(back)),
        )

    def active(self, length: Any) -> Any:
        """Five corners between 0.4441 and 1.8123."""
        return self._active(length)

    def passive(self, length: Any) -> Any:
        """Two corners up to a strain of 0.7, straight above."""
        return self._passive(length)

    def speed(self, velocity: Any) -> Any:
        """Four corners between −1 and 1."""
        return self._speed(velocity)

    def tendon(self, length: Any) -> Any:
        """Two corners up to the end of the toe, straight above."""
        return self._tendon(length)

    def velocity(self, active: Any, damping: Any, force: Any, damped: bool) -> Any:
        """Newton's method from rest, where the curve bends the other way, so that it converges from everywhere."""
        slope, v = _slope_of(self._speed), 0.0 * force
        for _ in range(NEWTON_STEPS):
            v = v - (active * self.speed(v) + damping * v - force) / (active * slope(v) + damping)
        return v


@cache
def _slope_of(signal: Samples) -> Samples:
    """The derivative of a curve, a curve of its own."""
    from scipy.interpolate import PPoly

    breaks, rows = signal.pieces("spline")
    table = [[3.0 * row[3] for row in rows], [2.0 * row[2] for row in rows], [row[1] for row in rows]]
    width = 2.0 * breaks[-1] - breaks[-2]
    made: Any = Samples.of(PPoly(table, [*breaks, width]), "slope")
    return made  # type: ignore[no-any-return]


def _asinh(x: Any) -> Any:
    return log(x + sqrt(x * x + 1.0))


CURVES: dict[str, Curves] = {"de groote": DeGrooteFregly(), "millard": Millard()}
"""Curves by name."""


def _corner(first: tuple[float, float, float], last: tuple[float, float, float], curviness: float) -> Corner:
    """The quintic Bézier curve between two lines, each given as (x, y, slope).

    The third control point lies where the lines meet; a curviness of 1 draws the curve into that corner, 0 makes it
    nearly straight (M. Millard, T. Uchida, A. Seth and S. L. Delp, J. Biomech. Eng. 135 (2013) 021005, appendix).
    """
    (x0, y0, s0), (x1, y1, s1) = first, last
    part = 0.1 + 0.8 * curviness
    x = (y1 - y0 - x1 * s1 + x0 * s0) / (s0 - s1)
    y = (x - x1) * s1 + y1
    a, b = x0 + part * (x - x0), y0 + part * (y - y0)
    c, d = x1 + part * (x - x1), y1 + part * (y - y1)
    return np.array([x0, a, a, c, c, x1]), np.array([y0, b, b, d, d, y1])


def _curve(*corners: Corner) -> Samples:
    """Corners one after another, straight before the first and after the last, as one function of x."""
    from scipy.interpolate import CubicSpline, PPoly

    u = np.linspace(0.0, 1.0, 101)  # intervals of the spline through one corner, which leave errors of some 1e-8
    x, y, before, after = [], [], 0.0, 0.0
    for k, (across, up) in enumerate(corners):
        last = slice(None) if k == len(corners) - 1 else slice(-1)
        x.append(_bernstein(across, u)[last])
        y.append(_bernstein(up, u)[last])
        slope = np.diff(up[[0, 1, -2, -1]])[[0, 2]] / np.diff(across[[0, 1, -2, -1]])[[0, 2]]
        before, after = (slope[0] if k == 0 else before), slope[1]
    xs, ys = np.concatenate(x), np.concatenate(y)
    ends: Any = ((1, before), (1, after))
    inside = CubicSpline(xs, ys, bc_type=ends)
    first, last_one = [0.0, 0.0, before, ys[0] - EXTENSION_LENGTH * before], [0.0, 0.0, after, ys[-1]]
    table = np.concatenate([np.array([first]).T, inside.c, np.array([last_one]).T], axis=1)
    made: Any = Samples.of(
        PPoly(table, np.concatenate([[xs[0] - EXTENSION_LENGTH], xs, [xs[-1] + EXTENSION_LENGTH]])), "curve"
    )
    return made  # type: ignore[no-any-return]


def _bernstein(points: Vector, u: Vector) -> Vector:
    n = len(points) - 1
    return np.asarray(sum(comb(n, i) * u**i * (1.0 - u) ** (n - i) * points[i] for i in range(n + 1)))
