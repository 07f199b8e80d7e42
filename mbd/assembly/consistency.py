"""Whether a state satisfies the rows that are active in it, and how far it is off."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Vector
from mbd.assembly.sizes import terms_and_sizes
from mbd.compile.mechanism import Mechanism
from mbd.equal import NOMINAL_RTOL
from mbd.equations.equations import Row

ASSEMBLED_RTOL = 1e-8
"""Residual over the length or speed of its row below which it holds: ten times what an assembly leaves [-]."""


def residuals(
    mechanism: Mechanism, time: float, q: Vector, y: Vector, parameters: Vector, anchors: Vector
) -> NDArray[np.float64]:
    """(6, n_rows): h and ḣ of every row, the sizes of their terms, its length, and its speed as its cluster moves."""
    terms, sizes, natural = terms_and_sizes(mechanism, time, q, y, parameters, anchors)
    speeds = natural.lengths * natural.swiftest(y, terms)[natural.cluster_of_row]
    return np.array([terms.h, terms.rate, *sizes, natural.lengths, speeds])


def violations(
    rows: Sequence[Row], active: Sequence[int], found: NDArray[np.float64], usual: Vector | None = None
) -> list[str]:
    """The active rows that do not hold, one part of a sentence each: "'rod' is violated by 0.1 m".

    Parameters
    ----------
    rows, active : all rows, and the numbers of those that act
    found : from `residuals`
    usual : (2, n_rows) residuals that are not to blame on the state, such as those that a scheme leaves
    """
    faults = []
    for k in active:
        h, rate, h_size, rate_size, far, fast = (float(value) for value in found[:, k])
        left = (0.0, 0.0) if usual is None else (2.0 * abs(float(usual[0, k])), 2.0 * abs(float(usual[1, k])))
        if not abs(h) <= max(ASSEMBLED_RTOL * far, NOMINAL_RTOL * min(far, h_size), left[0]):
            faults.append(f"{rows[k].title} is violated by {h:.3g} {rows[k].unit}".rstrip())
        elif not abs(rate) <= max(ASSEMBLED_RTOL * fast, NOMINAL_RTOL * min(fast, rate_size), left[1]):
            faults.append(f"{rows[k].title} is violated by {rate:.3g} {rows[k].unit}/s in its velocity")
    return faults
