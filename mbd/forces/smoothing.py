"""Noisy samples made smooth before a spline goes through them."""

import math
from collections.abc import Sequence

import numpy as np

from mbd.arrays import Vector
from mbd.equal import NOMINAL_RTOL
from mbd.errors import ModelError

MIN_SAMPLES = 5
"""Samples that generalized cross-validation needs at least."""

MIN_CUTOFF = 1e-6
"""Of a filter over the sampling rate; round-off hides what is slower [-]."""


def smoothed(time: Sequence[float], values: Sequence[float], cutoff: float | None, periodic: bool) -> tuple[float, ...]:
    """The values (n,) of a smooth curve at the samples.

    Without a cutoff that of the cubic smoothing spline whose parameter generalized cross-validation finds
    (`scipy.interpolate.make_smoothing_spline`; Woltring 1986). With one that of a Butterworth filter of second order,
    forth and back, corrected for the two passes so that half of the power passes at `cutoff` (Robertson & Dowling 2003,
    J. Electromyogr. Kinesiol. 13, 569). Samples that repeat are smoothed as such.

    Parameters
    ----------
    time : (n,) increasing [s]
    values : (n,) samples
    cutoff : frequency [Hz], or None
    periodic : whether the last sample is the first of the next period

    Raises
    ------
    ModelError
        for fewer samples than are needed, uneven ones with a cutoff, and a cutoff beyond half the sampling frequency.
    """
    t, y = np.asarray(time, dtype=float), np.asarray(values, dtype=float)
    if len(t) < MIN_SAMPLES or np.any(np.diff(t) <= 0.0):
        raise ModelError(f"Samples of kind 'smooth' need {MIN_SAMPLES} samples at least, in order; got {len(t)}")
    inside = slice(None)
    if periodic:
        n, period = len(t) - 1, t[-1] - t[0]
        t = np.concatenate([t[:-1] + k * period for k in (-1, 0, 1)])
        y, inside = np.tile(y[:-1], 3), slice(n, 2 * n)
    found = _spline(t, y)[inside] if cutoff is None else _filtered(t, y, cutoff)[inside]
    return tuple(map(float, [*found, found[0]] if periodic else found))


def _spline(t: Vector, y: Vector) -> Vector:
    from scipy.interpolate import make_smoothing_spline

    width, size = (t[-1] - t[0]) / (len(t) - 1), float(np.max(np.abs(y))) or 1.0
    return np.asarray(size * make_smoothing_spline((t - t[0]) / width, y / size)((t - t[0]) / width))


def _filtered(t: Vector, y: Vector, cutoff: float) -> Vector:
    from scipy.signal import butter, sosfiltfilt

    widths = np.diff(t)
    if np.ptp(widths) > NOMINAL_RTOL * widths.mean():
        raise ModelError(
            f"Samples with a cutoff must be evenly spaced, but their distances are {widths.min():.6g} to "
            f"{widths.max():.6g} s; resample them, or leave cutoff out"
        )
    rate = 1.0 / float(widths.mean())
    if not MIN_CUTOFF * rate < cutoff < 0.5 * rate:
        raise ModelError(
            f"cutoff of Samples must be between {MIN_CUTOFF * rate:.6g} Hz and half the sampling rate, "
            f"{0.5 * rate:.6g} Hz, not {cutoff:g} Hz"
        )
    wider = math.tan(math.pi * cutoff / rate) / (math.sqrt(2.0) - 1.0) ** 0.25
    sections = butter(2, 2.0 * math.atan(wider) / math.pi, output="sos")
    return np.asarray(sosfiltfilt(sections, y, padlen=int(min(len(y) - 1, 3.0 * rate / cutoff))))
