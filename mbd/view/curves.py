"""Curves through the rows of a run, smooth where rows are few."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mbd.arrays import Vector
from mbd.results.interpolation import Grid

if TYPE_CHECKING:
    from mbd.trajectory import Trajectory

__all__ = ["curves"]

SMOOTH = 600
"""Points of a curve that look smooth over the width of a plot [-]."""


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
    if len(time) >= SMOOTH or not np.any(length > 0.0):
        return np.zeros(0)
    counts = np.ceil(length / (time[-1] - time[0]) * SMOOTH).astype(int)
    steps = [a + h * np.arange(1, n) / n for a, h, n in zip(lower, length, counts, strict=True) if n > 1]
    found = np.concatenate(steps) if steps else np.zeros(0)
    return np.setdiff1d(found, time)
