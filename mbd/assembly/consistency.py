"""Whether a state satisfies the rows that are active in it, and how far it is off."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Vector
from mbd.compile.mechanism import Mechanism
from mbd.equal import NOMINAL_RTOL
from mbd.equations.equations import Row

ASSEMBLED_RESIDUAL = 1e-8
"""The same residuals below which it always is: ten times what an assembly leaves."""


def residuals(
    mechanism: Mechanism, time: float, q: Vector, y: Vector, parameters: Vector, anchors: Vector
) -> NDArray[np.float64]:
    """(5, n_rows): h and ḣ of every row, the sizes of their terms, and the longest lever arms |∂h/∂angle| [m]."""
    layout, freedoms = mechanism.layout, mechanism.equations.configuration.freedoms
    block = mechanism.block(time, q, y, anchors)
    terms, sizes = mechanism.terms_of(block, parameters), np.zeros(mechanism.sizes["scales"])
    mechanism.common["scales"](block, parameters, sizes)
    turning = np.abs(terms.B[:, [k for k, (_, unit) in enumerate(freedoms) if unit == "rad"]])
    return np.array([terms.h, terms.rate, *np.split(sizes[layout.n :], 2), np.max(turning, axis=1, initial=0.0)])


def violations(
    rows: Sequence[Row], active: Sequence[int], found: NDArray[np.float64], speed: float, usual: Vector | None = None
) -> list[str]:
    """The active rows that do not hold, one part of a sentence each: "'rod' is violated by 0.1 m".

    Parameters
    ----------
    rows, active : all rows, and the numbers of those that act
    found : from `residuals`
    speed : the largest velocity [m/s, rad/s]
    usual : (2, n_rows) residuals that are not to blame on the state, such as those that a scheme leaves
    """
    faults, fast, small = [], max(1.0, speed), NOMINAL_RTOL * _extent(rows, active, found)
    for k in active:
        h, rate, h_size, rate_size = (float(value) for value in found[:4, k])
        left = (0.0, 0.0) if usual is None else (2.0 * abs(float(usual[0, k])), 2.0 * abs(float(usual[1, k])))
        floor = min(ASSEMBLED_RESIDUAL, small) if rows[k].unit == "m" else ASSEMBLED_RESIDUAL
        if not abs(h) <= max(floor, NOMINAL_RTOL * min(1.0, h_size), left[0]):
            faults.append(f"{rows[k].title} is violated by {h:.3g} {rows[k].unit}".rstrip())
        elif not abs(rate) <= max(floor * fast, NOMINAL_RTOL * min(fast, rate_size), left[1]):
            faults.append(f"{rows[k].title} is violated by {rate:.3g} {rows[k].unit}/s in its velocity")
    return faults


def _extent(rows: Sequence[Row], active: Sequence[int], found: NDArray[np.float64]) -> float:
    """The length that rows in metres tell of [m]: their longest lever arm or largest term; 1 where nothing turns."""
    metres = [k for k in active if rows[k].unit == "m"]
    levers = float(np.max(found[4, metres], initial=0.0))
    return max(levers, float(np.max(found[2, metres], initial=0.0))) if levers > 0.0 else 1.0
