"""Observed order: how fast an error falls with dt."""

from __future__ import annotations

from typing import Any

import numpy as np

__all__ = ["observed_order"]


def observed_order(errors: Any, floor: float = 0.0) -> float:
    """log₂ of the last fall of an error under halving of dt, above the floor of round-off; NaN where there is none.

    >>> observed_order([1.0, 0.3, 0.075])
    2.0
    """
    sizes = np.asarray(errors, dtype=float)
    clear = np.flatnonzero((sizes[1:] > floor) & (sizes[:-1] > floor))
    return float(np.log2(sizes[clear[-1]] / sizes[clear[-1] + 1])) if len(clear) else float("nan")
