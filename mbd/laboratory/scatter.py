"""How far noise in measured angles scatters the moments that inverse dynamics finds from them."""

from math import comb
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.equations.equations import Equations
from mbd.equations.net_moments import effort_name
from mbd.laboratory.motion import Motion

FEWEST, MOST = 20, 600
"""Frames from which the scatter is estimated: of more, those in the middle."""
MIN_RATIO = 0.6
"""Scatter by fifth over that by fourth differences above which it is noise: 1 of noise, ω h of a smooth signal [-]."""
MIN_SHARE = 0.05
"""Scatter of a moment over its range above which it is reported [-]."""
DEVIATION_OF_MEDIAN = 1.482602218505602
"""Standard deviation of a normal distribution over its median deviation [-]."""
SPLINE_NOISE_GAIN = 6.0
"""Standard deviation of h² s̈ at the knots of a cubic spline through white noise of deviation 1 [-]."""
DIFFERENCES = {4: SPLINE_NOISE_GAIN * 13.676571703571772, 5: SPLINE_NOISE_GAIN * 26.64328436439567}
"""Standard deviations of the kth differences of such h² s̈: √(1/π ∫ (6 (1 − cos θ)/(2 + cos θ))² (2 − 2 cos θ)ᵏ dθ), θ
from 0 to π [-]."""


class Scatter(NamedTuple):
    """Standard deviation of a moment and of the coordinate it belongs to."""

    moment: float
    coordinate: float


def scatter_of(time: Vector, coordinates: Matrix, moments: Matrix) -> list[Scatter | None]:
    """The scatter of moments (R, n) whose accelerations are those of splines through noisy values (R, n).

    None where there is little. Differences of high order leave noise and remove motion; their median does not see
    single impacts. White noise of deviation σ in the values gives accelerations of deviation 6 σ/h², and moments with
    the same spectrum.
    """
    middle, count = max(len(time) - MOST, 0) // 2, moments.shape[1]
    part = slice(middle, middle + MOST)
    time, coordinates, moments = time[part], coordinates[part], moments[part]
    widths = np.diff(time)
    if len(time) < FEWEST or np.ptp(widths) > 0.01 * widths.mean():  # unevenly spaced
        return [None] * count
    differences, ranges = np.diff(moments.T, 4), np.ptp(moments, axis=0)
    gain, noisy = SPLINE_NOISE_GAIN / DIFFERENCES[4], np.zeros(count, dtype=bool)
    # a median is at most twice the mean: what is smooth by that needs none
    doubtful = 2.0 * DEVIATION_OF_MEDIAN * gain * np.abs(differences).mean(axis=1) >= MIN_SHARE * ranges
    if not doubtful.any():
        return [None] * count
    differences = differences[doubtful]
    fourth = gain * _deviation(differences)
    fifth = SPLINE_NOISE_GAIN / DIFFERENCES[5] * _deviation(np.diff(differences))
    found_noisy = (fifth >= MIN_RATIO * fourth) & (fourth >= MIN_SHARE * ranges[doubtful]) & (fourth != 0.0)
    noisy[doubtful] = found_noisy
    own = _deviation(np.diff(coordinates[:, noisy].T, 4)) / np.sqrt(comb(8, 4))
    found = iter(zip(fourth[found_noisy], own, strict=True))
    return [Scatter(*map(float, next(found))) if each else None for each in noisy]


def _deviation(differences: Matrix) -> Vector:
    return np.asarray(DEVIATION_OF_MEDIAN * np.median(np.abs(differences), axis=1))


def noise_remarks(equations: Equations, motion: Motion, effort: Matrix, driven: NDArray[np.bool_]) -> list[str]:
    """A sentence on the moment (R, n_v) that noise in a recorded motion scatters most; none where it hardly does."""
    whole = equations.configuration
    asked = np.flatnonzero(driven)
    places = np.array(whole.places)[asked]
    coordinates = np.where(places >= 0, motion.q[:, places], 0.0)
    scatters = scatter_of(motion.time, coordinates, effort[:, asked])
    found = [(each.moment / float(np.ptp(effort[:, k])), int(k), each)
             for k, each in zip(asked, scatters, strict=True) if each is not None]  # fmt: skip
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
