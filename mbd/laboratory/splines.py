"""Derivatives of what was sampled: those of not-a-knot cubic splines at their knots."""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg.lapack import dpttrf, dpttrs

from mbd.arrays import Matrix, Vector

GROUP = 8
"""Columns that are differentiated at once, so that they stay in the processor's cache; two orientations."""


def derivatives(time: Vector, values: Matrix) -> tuple[Matrix, Matrix]:
    """First and second derivative of the spline through values (R, n) at their times; zero of a single frame."""
    spline = Spline(time)
    first, second = np.empty((2, values.shape[1], len(time)))
    for start in range(0, values.shape[1], GROUP):
        part = slice(start, start + GROUP)
        first[part], second[part] = spline.slopes(values[:, part].T)
    return first.T, second.T


class Spline:
    """Derivatives at the knots of not-a-knot cubic splines, of a few columns at a time in memory that is used again.

    Continuity of the second derivative, ``c₀ s₀ + 2 (c₀ + c₁) s₁ + c₁ s₂ = 3 (c₀ m₀ + c₁ m₁)`` with slopes m of the
    chords and c one over their widths, is symmetric and positive definite, with the ends, ``s₀ = e − f s₁``, inserted.
    """

    def __init__(self, time: Vector) -> None:
        self.time = time
        if len(time) < 4:  # a line or a parabola
            return
        h = self.h = np.diff(time)
        c = self.c = 1.0 / h
        diagonal = 2.0 * (c[:-1] + c[1:])
        for k, other in (0, 1), (-1, -2):
            diagonal[k] -= (h[k] + h[other]) * c[k] * c[other]
        *self.factors, _ = dpttrf(diagonal, c[1:-1])
        count = len(time)
        self.chord, self.bend, self.right, self.first, self.second = (
            np.empty((GROUP, count - less)) for less in (1, 1, 2, 0, 0)
        )

    def slopes(self, rows: Matrix) -> tuple[Matrix, Matrix]:
        """First and second derivatives (n, R) of up to `GROUP` rows; the next call overwrites them."""
        if len(self.time) < 4:
            zero = np.zeros(rows.shape)
            curve = CubicSpline(self.time, rows.T) if len(self.time) > 1 and len(rows) else None
            return (zero, zero) if curve is None else (curve(self.time, 1).T, curve(self.time, 2).T)
        h, c = self.h, self.c
        n = len(rows)
        chord, bend, right, first, second = (
            each[:n] for each in (self.chord, self.bend, self.right, self.first, self.second)
        )
        np.subtract(rows[:, 1:], rows[:, :-1], out=chord)
        chord *= c
        np.multiply(chord, 3.0 * c, out=bend)
        np.add(bend[:, 1:], bend[:, :-1], out=right)
        ends = []
        for k, other in (0, 1), (-1, -2):
            width = h[k] + h[other]
            e = (h[k] + 2.0 * width) * h[other] * chord[:, k] + h[k] ** 2 * chord[:, other]
            e /= width * h[other]
            right[:, k] -= e * c[k]
            ends.append((e, width * c[other]))
        first[:, 1:-1] = dpttrs(*self.factors, right.T, overwrite_b=True)[0].T
        for (e, f), k, inner in zip(ends, (0, -1), (1, -2), strict=True):
            first[:, k] = e - f * first[:, inner]
        # s'' = 2 c (3 m - 2 s - s of the next knot), of the last knot from its left
        twice = 2.0 * c
        second[:, -1] = (4.0 * first[:, -1] + 2.0 * first[:, -2] - 6.0 * chord[:, -1]) * c[-1]
        inside = second[:, :-1]
        np.multiply(first[:, :-1], -2.0, out=inside)
        inside -= first[:, 1:]
        inside *= twice
        bend *= 2.0
        inside += bend
        return first, second
