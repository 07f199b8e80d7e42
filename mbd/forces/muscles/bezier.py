"""Curves of Millard et al. (2013): quintic Bézier corners between straight lines, as splines of their abscissa."""

from __future__ import annotations

from math import comb
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.forces.samples import Samples

__all__ = ["Corner", "corner", "curve"]

EXTENSION_LENGTH = 1.0
"""Length of the straight pieces in the table before the first and after the last corner, which continue [-]."""

Corner = tuple[Vector, Vector]
"""Six control points each of x and y."""


def corner(first: tuple[float, float, float], last: tuple[float, float, float], curviness: float) -> Corner:
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


def curve(*corners: Corner) -> Samples:
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
