"""How far noise in measured angles scatters the moments that inverse dynamics finds from them."""

from __future__ import annotations

from math import comb
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.equations.equations import Equations
from mbd.equations.net_moments import effort_name
from mbd.laboratory.motion import Motion

__all__ = ["Scatter", "noise_remarks", "scatter_of"]

FEWEST, MOST = 20, 600
"""Frames from which the scatter is estimated: of more, those in the middle."""
SPACING_RTOL = 0.01
"""How unevenly the frames may be spaced, relative [-]."""
MIN_RATIO = 0.6
"""Scatter by fifth over that by fourth differences above which it is noise: 1 of noise, ω h of a smooth signal [-]."""
MIN_SHARE = 0.05
"""Scatter of a moment over its range above which it is reported [-]."""
SPLINE_NOISE_GAIN = 6.0
"""Standard deviation of h² s̈ at the knots of a cubic spline through white noise of deviation 1 [-]."""
DIFFERENCES = {4: SPLINE_NOISE_GAIN * 13.676571703571772, 5: SPLINE_NOISE_GAIN * 26.64328436439567}
"""Standard deviations of the kth differences of such h² s̈: √(1/π ∫ (6 (1 − cos θ)/(2 + cos θ))² (2 − 2 cos θ)ᵏ dθ), θ
from 0 to π [-]."""


class Scatter(NamedTuple):
    """Standard deviation of a moment and of the coordinate it belongs to."""

    moment: float
    coordinate: float


def scatter_of(time: Vector, coordinate: Vector, moment: Vector) -> Scatter | None:
    """The scatter of a moment whose acceleration is that of a spline through noisy values; None where there is little.

    Differences of high order leave noise and remove motion; their median does not see single impacts. White noise of
    deviation σ in the values gives accelerations of deviation 6 σ/h², and moments with the same spectrum.
    """
    middle = max(len(time) - MOST, 0) // 2
    part = slice(middle, middle + MOST)
    time, coordinate, moment = time[part], coordinate[part], moment[part]
    widths = np.diff(time)
    if len(time) < FEWEST or np.ptp(widths) > SPACING_RTOL * widths.mean():
        return None
    fourth, fifth = (_deviation(moment, order) * SPLINE_NOISE_GAIN / DIFFERENCES[order] for order in (4, 5))
    if fifth < MIN_RATIO * fourth or fourth < MIN_SHARE * float(np.ptp(moment)) or fourth == 0.0:
        return None
    return Scatter(fourth, _deviation(coordinate, 4) / float(np.sqrt(comb(8, 4))))


def _deviation(values: Vector, order: int) -> float:
    # standard deviation of a normal distribution over its median deviation
    return 1.482602218505602 * float(np.median(np.abs(np.diff(values, order))))


def noise_remarks(equations: Equations, motion: Motion, effort: Matrix, driven: NDArray[np.bool_]) -> list[str]:
    """A sentence on the moment (R, n_v) that noise in a recorded motion scatters most; none where it hardly does."""
    whole = equations.configuration
    found: list[tuple[float, int, Scatter]] = []
    for k in map(int, np.flatnonzero(driven)):
        coordinate = motion.q[:, whole.places[k]] if whole.places[k] >= 0 else np.zeros(len(motion.time))
        scatter = scatter_of(motion.time, coordinate, effort[:, k])
        if scatter is not None:
            found.append((scatter.moment / float(np.ptp(effort[:, k])), k, scatter))
    if not found:
        return []
    share, k, scatter = max(found)
    turns = whole.velocity_units[k].startswith("rad")
    name, kind = whole.velocity_names[k], "moment" if turns else "force"
    owners = [each.removesuffix(".rate").rpartition(".")[0] for each in whole.velocity_names]
    alone = owners[k] and owners.count(owners[k]) == 1
    name = f"{owners[k]}.{kind}" if alone else effort_name(name, kind)
    others = f" (and {len(found) - 1} more)" if found[1:] else ""
    values = f" scatter by {scatter.coordinate:.2g} {'rad' if turns else 'm'}" if scatter.coordinate else " are noisy"
    return [
        f"{name!r}{others} scatters by about {scatter.moment:.3g} {'N m' if turns else 'N'}, {share:.0%} of its range: "
        f"its acceleration is a second derivative of values that{values}; smooth them before, with "
        "mbd.Samples(time, values, kind='smooth'), recording.smoothed(cutoff=6.0), or cutoff=6.0 of inverse_kinematics"
    ]
