"""Prescribed motions of fuzzed drives: functions of time that models trace and judges call with arrays, and tables."""

import math
import random
from collections.abc import Callable
from typing import Any

import numpy as np

import mbd


def any_motion(rng: random.Random, start: float, size: float) -> tuple[Any, str]:
    """A value of a drive that begins at `start`, and which kind of motion it is."""
    w, end = rng.uniform(1.0, 8.0), rng.uniform(0.05, 0.4)
    kinds: dict[str, Callable[[], Any]] = {
        "held": lambda: start,
        "steady": lambda: lambda t: start + size * w * t,
        "swing": lambda: lambda t: start + size * np.sin(w * t),
        "swing from rest": lambda: lambda t: start + size * (1.0 - np.cos(w * t)),
        "cube": lambda: lambda t: start + size * w * t * t * t,
        "dwell": lambda: lambda t: start + size * mbd.where(t < end, _quintic(t / end), 1.0),
        "halt": lambda: lambda t: start + size * mbd.where(t < end, 0.5 - 0.5 * np.cos(math.pi / end * t), 1.0),
        "set off": lambda: lambda t: start + size * mbd.where(t < end, 0.0, (t - end) * (t - end) * w),
        "table": lambda: _table(rng, start, size, w),
        "short table": lambda: _short_table(rng, start, size, end),
        "cycle": lambda: _cycle(rng, start, size),
    }  # fmt: skip
    kind = rng.choice(list(kinds))
    return kinds[kind](), kind


def _quintic(x: Any) -> Any:
    """10 x³ − 15 x⁴ + 6 x⁵: from rest to rest with continuous accelerations."""
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


def _table(rng: random.Random, start: float, size: float, w: float) -> mbd.Samples:
    """A smooth motion as samples at a rate of a laboratory."""
    rate, length = rng.choice([50.0, 100.0, 200.0]), rng.uniform(0.3, 1.5)
    t = np.arange(0.0, length, 1.0 / rate)
    return mbd.Samples(t, start + size * np.sin(w * t), **_curve(rng))


def _short_table(rng: random.Random, start: float, size: float, end: float) -> mbd.Samples:
    """Few samples at uneven times, held behind the last."""
    t = np.cumsum([0.0, *(end * rng.uniform(0.2, 1.0) for _ in range(rng.randint(2, 6)))])
    return mbd.Samples(t, [start, *(start + size * rng.uniform(-1, 1) for _ in t[1:])], **_curve(rng))


def _curve(rng: random.Random) -> dict[str, Any]:
    """The curve through samples: at rest at their ends, mostly, where it is a spline."""
    return rng.choice([{}, {"kind": "spline", "ends": "clamped"}, {"kind": "spline", "ends": "clamped"}])


def _cycle(rng: random.Random, start: float, size: float) -> mbd.Samples:
    """A cycle that repeats itself."""
    t = np.linspace(0.0, rng.uniform(0.3, 1.1), rng.choice([11, 51, 101]))
    x = 2.0 * math.pi * t / t[-1]
    values = start + size * (np.sin(x) + 0.3 * (1.0 - np.cos(2.0 * x)))
    values[-1] = values[0]
    return mbd.Samples(t, values, periodic=True)


def any_jump(rng: random.Random, size: float) -> Callable[[Any], Any]:
    """A force of time that jumps once, or comes and goes."""
    first, last = sorted((rng.uniform(0.0, 0.3), rng.uniform(0.0, 0.3)))
    if rng.random() < 0.5:
        return lambda t: mbd.where(t < first, size, -0.5 * size)
    return lambda t: mbd.where(t < first, 0.0, mbd.where(t < last, size, 0.0))
