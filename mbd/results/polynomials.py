"""Polynomials between two rows of a run: cubic Hermite, of degree 5 with second derivatives, and a parabola.

On an interval of length h, with θ from 0 to 1,
``y(θ) = (1+2θ)(1−θ)² y₀ + θ(1−θ)² h ẏ₀ + θ²(3−2θ) y₁ − θ²(1−θ) h ẏ₁``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass

Index = NDArray[np.intp]

CHUNK = 1024
"""Intervals of a run whose states, forces and steps are found together."""


@dataclass(frozen=True, eq=False)
class Places:
    """Where times lie: between rows `lower` and `upper`, at the fraction `theta` of the interval `step` [s].

    A time that meets a row has lower = upper, theta = 0 and step = 0.
    """

    time: Vector
    lower: Index
    upper: Index
    theta: Vector
    step: Vector

    def part(self, chosen: Index) -> Places:
        """Some of the places."""
        return Places(self.time[chosen], self.lower[chosen], self.upper[chosen], self.theta[chosen], self.step[chosen])

    def blend(self, values: Matrix, rates: Matrix) -> Matrix:
        """Cubic Hermite interpolation of a column or of several."""
        return hermite(self, values[self.lower], rates[self.lower], values[self.upper], rates[self.upper])


def theta_and_step(places: Places, like: Matrix) -> tuple[Any, Any]:
    """θ and h, shaped to multiply a column or several."""
    shape = (-1,) + (1,) * (like.ndim - 1)
    return places.theta.reshape(shape), places.step.reshape(shape)


def hermite(places: Places, y0: Matrix, rate0: Matrix, y1: Matrix, rate1: Matrix) -> Matrix:
    """y(θ) of the module's formula."""
    x, h = theta_and_step(places, y0)
    left = (1 - x) ** 2 * ((1 + 2 * x) * y0 + x * h * rate0)
    right = x**2 * ((3 - 2 * x) * y1 - (1 - x) * h * rate1)
    return np.asarray(left + right)


def quintic(places: Places, y: Matrix, rate: Matrix, change: Matrix) -> Matrix:
    """The polynomial of degree 5 with values y, rates and their changes ÿ at both ends of each interval."""
    return quintics(places, y, rate, change)[0]


def quintics(places: Places, y: Matrix, rate: Matrix, change: Matrix) -> tuple[Matrix, Matrix, Matrix]:
    """The same with its first two derivatives; where a time meets a row, what is stored there."""
    x, h = theta_and_step(places, y)
    low, high = places.lower, places.upper
    ends = (y[low], rate[low], y[high], rate[high])
    span = y[high] - y[low]
    first = h * h * change[low] - (6.0 * span - h * (4.0 * rate[low] + 2.0 * rate[high]))
    last = h * h * change[high] - (-6.0 * span + h * (2.0 * rate[low] + 4.0 * rate[high]))
    mean, tilt = first * (1.0 - x) + last * x, last - first  # beyond the cubic: ½ x² (1−x)² of these
    bell, slope, bend = (x * (1.0 - x)) ** 2, 2.0 * x * (1.0 - x) * (1.0 - 2.0 * x), 2.0 - 12.0 * x * (1.0 - x)
    length = np.where(h > 0.0, h, 1.0)
    speed = hermite_rate(places, *ends) + 0.5 * (slope * mean + bell * tilt) / length
    curved = (6.0 - 12.0 * x) * span + h * ((6.0 * x - 4.0) * rate[low] + (6.0 * x - 2.0) * rate[high])
    turning = (curved + 0.5 * (bend * mean + 2.0 * slope * tilt)) / length**2
    value = hermite(places, *ends) + 0.5 * bell * mean
    return np.asarray(value), np.asarray(speed), np.asarray(np.where(h > 0.0, turning, change[low]))


def hermite_rate(places: Places, y0: Matrix, rate0: Matrix, y1: Matrix, rate1: Matrix) -> Matrix:
    """dy/dt of the module's formula; the stored rate where a time meets a row."""
    x, h = theta_and_step(places, y0)
    chord = np.divide(y1 - y0, h, out=np.zeros_like(y0), where=h > 0)
    inside = 6 * x * (1 - x) * chord + (1 - x) * (1 - 3 * x) * rate0 - x * (2 - 3 * x) * rate1
    return np.asarray(np.where(h > 0, inside, rate0))


def parabola(places: Places, y0: Matrix, rate0: Matrix, y1: Matrix) -> tuple[Matrix, Matrix]:
    """The polynomial of degree 2 with both values and the first rate, and its rate."""
    x, h = theta_and_step(places, y0)
    bend = y1 - y0 - h * rate0
    rate = rate0 + np.divide(2.0 * x * bend, h, out=np.zeros_like(y0), where=h > 0)
    return np.asarray(y0 + x * h * rate0 + x * x * bend), np.asarray(rate)
