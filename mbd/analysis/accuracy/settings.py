"""How fine runs are: steps from the model's time scales, tolerances from the ranges of its coordinates."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from mbd.dataclass import dataclass
from mbd.integrators import Integrator
from mbd.results.trajectory import Trajectory

STEP_COUNT = 6
"""Steps, each half the one before."""
TOLERANCES = {False: (1e-3, 1e-4, 1e-5), True: (1e-3, 1e-5, 1e-7)}
"""Of schemes of low and of high order, over the middle range of the coordinates, where no error is wanted [-]."""
PARTS = (1.0, 0.1, 0.01)
"""Tolerances where an error is wanted, over it and the middle range of the coordinates [-]."""


@dataclass(frozen=True)
class Setting:
    """How fine a run is: its step dt [s], or its tolerance tol [m, rad]."""

    dt: float | None = None
    tol: float | None = None

    @property
    def arguments(self) -> dict[str, Any]:
        """For `simulate`.

        >>> Setting(1e-3).arguments, Setting(tol=1e-6).arguments
        ({'dt': 0.001}, {'tol': 1e-06})
        """
        return {"dt": self.dt} if self.tol is None else {"tol": self.tol}

    def __str__(self) -> str:
        return f"dt = {self.dt:.4g} s" if self.tol is None else f"tol = {self.tol:.3g}"


def is_high(scheme: Integrator) -> bool:
    """Whether a scheme is of an order for which the steps of the others are far too short."""
    return scheme.order() >= 4  # from order 4 on a scheme gets steps of its own


def steps_of(probe: Trajectory, span: float) -> tuple[float, ...]:
    """Six steps, halved each time, from a fifth of the model's shortest time scale on."""
    record = probe.record
    swing = np.ptp(record.v, axis=0) if len(record.v) else np.zeros(0)
    rise = np.percentile(np.abs(record.a), 99, axis=0) if len(record.a) else np.zeros(0)
    times = [s / r for s, r in zip(swing, rise, strict=True) if r > 1e-9 * np.max(rise) and s > 0.0]
    # the largest step is a fifth of the shortest time in which accelerations change velocities by their range
    return _halved(rounded(min([*times, span / 4.0]) / 5))


def long_steps(probe: Trajectory, span: float) -> tuple[float, ...]:
    """Those of schemes of high order: the largest 16 times longer, at most a quarter of the run."""
    return _halved(rounded(min(16.0 * steps_of(probe, span)[0], span / 4)))  # at least four rows


def steps_for(target: float, error: float, dt: float, span: float) -> tuple[float, ...]:
    """Six steps around that of an error, if `dt` has another and the order is 2; the finest for a tenth of it.

    >>> steps_for(1e-4, error=1e-3, dt=1e-3, span=1.0)
    (0.00256, 0.00128, 0.00064, 0.00032, 0.00016, 8e-05)
    """
    # for a tenth of the error that is wanted, and of 400,000 steps at most
    finest = max(0.9 * dt * math.sqrt(target / 10.0 / error), span / 400000)
    least = rounded(min(finest, span / 2**STEP_COUNT))
    return tuple(least * 2.0**k for k in reversed(range(STEP_COUNT)))


def tolerances(scheme: Integrator, ranges: Sequence[float], target: float | None) -> tuple[float, ...]:
    """Three tolerances [m, rad] for an error over the range, the loosest first.

    >>> from mbd.integrators import HHT, RungeKutta853
    >>> tolerances(RungeKutta853(), [2.0, 0.5, 0.1], 1e-8), tolerances(HHT(), [2.0, 0.5, 0.1], 1e-8)
    ((5e-09, 5e-10, 5e-11), (5e-07,))
    """
    known, high = [each for each in ranges if each > 0.0], is_high(scheme)
    middle = sorted(known)[len(known) // 2] if known else 1.0
    wanted = TOLERANCES[high] if target is None else tuple(part * target for part in PARTS)
    # below, a scheme of order 2 takes millions of steps
    held = wanted if high else tuple(max(each, 1e-6) for each in wanted)
    return tuple(dict.fromkeys(rounded(each * middle) for each in held))


def _halved(largest: float) -> tuple[float, ...]:
    return tuple(largest / 2**k for k in range(STEP_COUNT))


def rounded(value: float) -> float:
    """The next of 1, 2, 4, 5, 8 times a power of ten below.

    >>> rounded(0.0123), rounded(0.0079)
    (0.01, 0.005)
    """
    power = 10.0 ** math.floor(math.log10(value))
    digit = max(d for d in (1, 2, 4, 5, 8) if d <= value / power * (1.0 + 1e-9))
    return float(f"{digit * power:.3g}")
