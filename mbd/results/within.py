"""Works of long steps: powers integrated within the intervals between rows, where runs of high order know their states.

Four points of Gauss–Legendre quadrature on each interval have an error of order 8 with a constant a hundred times below
that of a polynomial through rows around (Davis & Rabinowitz 1984, ch. 2.7), and look at no other step: samples of
controllers and events, beside which stretches are short, do no harm.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Vector
from mbd.results.charts import Charts
from mbd.results.columns import ModelColumns, asks_for_forces
from mbd.results.dense import Restepping
from mbd.results.polynomials import CHUNK, Places
from mbd.results.stored_states import is_smooth
from mbd.tape.node import Node

POINTS = 0.5 * (np.array([-0.8611363115940526, -0.33998104358485626, 0.33998104358485626, 0.8611363115940526]) + 1.0)
WEIGHTS = 0.5 * np.array([0.34785484513745357, 0.6521451548625464, 0.6521451548625464, 0.34785484513745357])
"""Of Gauss and Legendre with four points over a step: numbers, as `numpy.polynomial` takes 3 ms to import."""

Index = NDArray[np.intp]


def readable(columns: ModelColumns) -> NDArray[np.bool_]:
    """Between which rows the states of a run are as accurate as the rows, (R − 1,)."""
    record = columns.record
    step = np.diff(record.time)
    known = columns.equations.compose is None or Charts.of(columns.equations) is not None
    smooth = is_smooth(record, known) and record.settings.get("store", 1) == 1
    return np.asarray((step > 0.0) & (smooth or Restepping.serves(columns)))


def within(columns: ModelColumns, asked: Sequence[tuple[Node, Index]]) -> list[Vector]:
    """∫ P dt of each power over its intervals, (k,).

    States are found once for all powers: where these ask for forces, the balance is solved mode by mode.

    Parameters
    ----------
    asked : powers as expressions, with the rows that begin their intervals (k,)
    """
    found = [np.zeros(len(lower)) for _, lower in asked]
    for forces in False, True:
        mine = [k for k, (power, lower) in enumerate(asked) if len(lower) and asks_for_forces([power]) is forces]
        union = np.unique(np.concatenate([asked[k][1] for k in mine])) if mine else np.zeros(0, dtype=np.intp)
        for first in range(0, len(union), CHUNK):
            part = union[first : first + CHUNK]
            states = columns.between(_places(columns.record.time, part), forces)
            step = columns.record.time[part + 1] - columns.record.time[part]
            for k, power in zip(mine, columns.evaluate([asked[k][0] for k in mine], states), strict=True):
                there = np.broadcast_to(power, (len(part) * len(POINTS),)).reshape(len(part), len(POINTS))
                _, own, place = np.intersect1d(asked[k][1], part, assume_unique=True, return_indices=True)
                found[k][own] = (step * (there @ WEIGHTS))[place]
    return found


def _places(time: Vector, lower: Index) -> Places:
    """The points of quadrature in each interval, one interval after the other."""
    begin, step = np.repeat(lower, len(POINTS)), np.repeat(time[lower + 1] - time[lower], len(POINTS))
    theta = np.tile(POINTS, len(lower))
    return Places(time[begin] + theta * step, begin, begin + 1, theta, step)
