"""Instants at which a value of a run passes zero."""

from collections.abc import Callable
from typing import Any

import numpy as np


def crossing(run: Any, value: Callable[[Any], Any], left: float, right: float) -> float:
    """The instant between two others at which a value changes its sign, by the run's own interpolation.

    value : of what `run.at` gives, at many instants
    """
    for _ in range(4):
        times = np.linspace(left, right, 1001)  # four times: round-off is left
        positive = np.asarray(value(run.at(times))) > 0.0
        changed = np.flatnonzero(positive != positive[0])
        if not len(changed):
            break
        left, right = float(times[changed[0] - 1]), float(times[changed[0]])
    return right


def falls(run: Any, name: str) -> list[float]:
    """Instants at which a quantity falls through zero."""
    found = run[name]
    rows = np.flatnonzero((found[:-1] > 0.0) & (found[1:] <= 0.0))
    return [crossing(run, lambda at: at[name], float(run.time[row]), float(run.time[row + 1])) for row in rows]
