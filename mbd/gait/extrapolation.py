"""Richardson's extrapolation of differences, and the slopes of functions of parameters."""

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise

import numpy as np

from mbd.arrays import Vector
from mbd.equal import EQUAL_RTOL, HALF_PRECISION_RTOL, MIN_DIVISOR

FUNCTION_LEVELS, FUNCTION_CHANGE, FUNCTION_TRIES = 6, 2.0**-7, 40
"""Differences of a function of parameters, each twice the one before; what the largest changes of a parameter, over its
size, and how often it is made longer or shorter for that [-]."""


def extrapolated(slopes: Sequence[Vector], errors: float = 4.0) -> tuple[Vector, Vector]:
    """Richardson's table of differences of h, 2h, 4h, …: for each number the entry of least error estimate.

    errors : by which an error of leading order grows from h to 2h: 4 of central differences, 2 of those to one side
    """
    if len(slopes) == 1:
        return slopes[0], np.full(len(slopes[0]), np.nan)
    best, error = slopes[0], np.abs(slopes[0] - slopes[1])
    table = list(slopes)
    for order in range(1, len(slopes)):
        power = errors**order
        table = [(power * fine - coarse) / (power - 1.0) for fine, coarse in pairwise(table)]
        doubt = np.abs(table[0] - best)
        better = doubt <= error
        best, error = np.where(better, table[0], best), np.where(better, doubt, error)
    return best, error


def slopes_of(function: Callable[[float], Mapping[str, float]], at: float) -> dict[str, float] | None:
    """Derivatives of the parameters that a function of one value gives, which may be any Python.

    None where differences do not agree to `EQUAL_RTOL`, or what has changed is lost to round-off, as of a parameter
    beside one that passes zero, which changes by all of itself however short a difference is.
    """
    names = list(function(at))

    def ends(h: float) -> Vector:
        return np.array([[float(function(at + sign * h)[name]) for name in names] for sign in (1.0, -1.0)])

    try:
        h = abs(at) or 1.0
        seen = np.not_equal(*ends(h))
        for _ in range(FUNCTION_TRIES):  # whatever the unit of the value
            high, low = ends(h)
            change = float(np.max(np.abs(high - low) / np.maximum(np.maximum(np.abs(high), np.abs(low)), MIN_DIVISOR)))
            if not change or FUNCTION_CHANGE / 8.0 <= change <= FUNCTION_CHANGE:
                break
            h *= 2.0 ** np.floor(np.log2(FUNCTION_CHANGE / change))
        levels = [h * 2.0 ** (level + 1 - FUNCTION_LEVELS) for level in range(FUNCTION_LEVELS)]
        found = [ends(each) for each in levels]
    except (ArithmeticError, ValueError, KeyError):
        return None
    if np.any(seen & (np.abs(np.subtract(*found[0])) <= HALF_PRECISION_RTOL * np.max(np.abs(found[0]), axis=0))):
        return None
    by, error = extrapolated([(high - low) / (2.0 * each) for (high, low), each in zip(found, levels, strict=True)])
    sizes = np.maximum(np.abs(by), np.max(np.abs(found[-1]), axis=0) / h)
    return dict(zip(names, map(float, by), strict=True)) if np.all(error <= EQUAL_RTOL * sizes) else None
