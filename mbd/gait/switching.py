"""From a period doubling onto the branch of gaits of twice the period."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mbd.errors import GaitError
from mbd.gait.continuation import BranchPoint, Continuation, Corrected
from mbd.gait.cycle import LimitCycle
from mbd.gait.map_derivative import Measured, measured
from mbd.gait.search import Search, search

__all__ = ["doubled"]

AMPLITUDES = (0.02, 0.01, 0.04, 0.005)
"""Distances from the gait along its critical mode at which the other branch is looked for, in turn [-]."""
APART = 0.2
"""Least distance of two steps of the doubled gait from each other, over twice the amplitude [-]."""


def doubled(given: Continuation, special: Any, base: Any) -> LimitCycle:
    """The gait of two periods beside a doubling.

    With φ the mode of the multiplier −1, ``F(F(c, p), p) = c`` is solved for (c, p) on the plane φᵀ c = ε: the doubled
    branch leaves the point along φ, p changes with ε².
    """
    point: BranchPoint = special.point
    critical = int(np.argmin(np.abs(point.multipliers.values + 1.0)))
    mode = np.real(point.multipliers.modes[:, critical])
    plane = np.append(mode / np.linalg.norm(mode), 0.0)
    twice = replace(given.map, strides=2 * given.map.strides)
    branch = Continuation(twice, given.section, given.name, given.values, given.width, given.tol)
    for amplitude in AMPLITUDES:
        beside = branch.matrix_at(point.chart, amplitude * plane, given.with_value(point.value))
        if beside is None:  # at the point itself the matrix is singular
            continue
        corrected = branch.corrected(replace(point, matrix=beside), plane, amplitude)
        if not isinstance(corrected, Corrected):
            continue
        values = branch.with_value(corrected.value)
        once = measured(given.map, point.chart, point.chart.of(corrected.state), values)
        if not isinstance(once, Measured):
            continue
        apart = float(np.linalg.norm(once.c - point.chart.of(corrected.state)))
        if apart > APART * 2.0 * amplitude:
            found = search(Search(twice, given.section, given.tol), corrected.state, values)
            if found.success:
                return found
    raise GaitError(f"no gait of two periods was found beside {special!r}", base)
