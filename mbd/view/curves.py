"""Curves through the rows of a run, smooth where rows are few."""

from collections.abc import Sequence

import numpy as np

from mbd.arrays import Vector
from mbd.results.interpolation import Grid
from mbd.results.polynomials import Index
from mbd.results.trajectory import Trajectory

CURVE_POINTS = 600
"""Points of a curve that look smooth over the width of a plot [-]."""

PLOT_INTERVALS = 1000
"""Intervals of time of which a plot shows the first, last, least and largest value: finer than its pixels [-]."""


def curves(run: Trajectory, names: Sequence[str]) -> tuple[Vector, dict[str, Vector]]:
    """Times (k,) and values (k,) of scalars by name: the rows, and where they are few also places between them.

    A run of high order or with a tolerance has steps so long that lines from row to row have corners.
    """
    time, at_rows = run.time, run.columns.at_rows(names)
    between = _between(time)
    if not len(between):
        return time, dict(zip(names, at_rows, strict=True))
    inside = run.columns.at_places(names, Grid(time).places(between))
    times = np.concatenate([time, between])
    order = np.argsort(times, kind="stable")  # the two rows of a switch keep their order
    return times[order], {
        name: np.concatenate([row, more])[order] for name, row, more in zip(names, at_rows, inside, strict=True)
    }


def _between(time: Vector) -> Vector:
    """Places inside the intervals of the rows, evenly over the run; none where rows are many."""
    lower, length = time[:-1], np.diff(time)
    if len(time) >= CURVE_POINTS or not np.any(length > 0.0):
        return np.zeros(0)
    counts = np.ceil(length / (time[-1] - time[0]) * CURVE_POINTS).astype(int)
    steps = [a + h * np.arange(1, n) / n for a, h, n in zip(lower, length, counts, strict=True) if n > 1]
    found = np.concatenate(steps) if steps else np.zeros(0)
    return np.setdiff1d(found, time)


def extremes(time: Vector, *values: Vector) -> Index:
    """Indices (k,), ascending, of the rows that a plot can tell apart: all of them where rows are few.

    The span of time is divided into `PLOT_INTERVALS` equal parts; of each part the first and last row are kept and, for
    each curve, the row of its least and of its largest value, so that no peak is lost.

    time : (n,) ascending [s]
    values : (n,) each, of one or more curves
    """
    if len(time) <= 4 * PLOT_INTERVALS:
        return np.arange(len(time))
    part = np.floor((time - time[0]) * (PLOT_INTERVALS / (time[-1] - time[0])))
    last = np.append(np.flatnonzero(np.diff(part)), len(time) - 1)
    first = np.append(0, last[:-1] + 1)
    kept = [first, last]
    for curve in values:
        kept += [np.lexsort((each, part))[first] for each in (curve, -curve)]  # NaN comes last in both
    return np.unique(np.concatenate(kept))
