"""Numbers and sides of a page, as small as a picture allows."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["QUANTIZATION_STEPS", "finite", "packed", "side", "step_of"]

QUANTIZATION_STEPS = 5000.0
"""Steps into which a range of values is divided; finer than a pixel."""


def side(name: str) -> str:
    """'left', 'right' or ''."""
    words = name.replace(".", " ").split()
    return next((word for word in ("left", "right") if word in words), "")


def finite(value: float) -> float | None:
    """A number JSON can hold, rounded to nine figures."""
    return float(f"{value:.9g}") if np.isfinite(value) else None


def packed(values: ArrayLike, step: float) -> dict[str, Any]:
    """A series as whole multiples of `step`: the first, then differences; one number if it never changes."""
    numbers = np.asarray(values, dtype=np.float64)
    whole = np.rint(np.nan_to_num(numbers / step)).astype(np.int64)
    constant = len(whole) > 0 and bool(np.all(whole == whole[0]))
    return {"step": step, "d": [int(whole[0])] if constant else np.diff(whole, prepend=0).tolist()}


def step_of(*series: ArrayLike) -> float:
    """A round step that divides the common range of some series finely enough."""
    both = np.concatenate([np.ravel(np.asarray(values, dtype=np.float64)) for values in series])
    both = both[np.isfinite(both)]
    span = float(np.max(np.abs(both), initial=0.0))
    return float(f"{span / QUANTIZATION_STEPS:.1g}") if span > 0.0 else 1.0
