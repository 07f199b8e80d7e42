"""Observed order: how fast an error falls with dt."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

__all__ = ["SECOND_ORDER", "assert_second_order", "halved", "observed_order"]

SECOND_ORDER = (3.6, 4.4)
"""How many times an error of second order may fall as dt is halved; 4 in the limit."""


def halved(error: Callable[[float], Any], dt: float, halvings: int = 3) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Sizes of an error at dt, dt/2, dt/4, …: one line a step, one column a quantity."""
    sizes = [np.abs(np.atleast_1d(error(dt / 2**k))) for k in range(halvings + 1)]
    return np.array(sizes, dtype=float)


def assert_second_order(error: Callable[[float], Any], dt: float, halvings: int = 3) -> None:
    """Every error of `error(dt)`, a number or several, falls 3.6 to 4.4 times with each halving of dt."""
    sizes = halved(error, dt, halvings)
    falls = sizes[:-1] / sizes[1:]
    low, high = SECOND_ORDER
    report = f"errors at dt = {dt:g}, dt/2, …:\n{sizes}\nfall by\n{falls}"
    assert np.all((falls > low) & (falls < high)), report


def observed_order(errors: Any, floor: float = 0.0) -> float:
    """log₂ of the last fall of an error under halving of dt, above the floor of round-off; NaN where there is none.

    >>> observed_order([1.0, 0.3, 0.075])
    2.0
    """
    sizes = np.asarray(errors, dtype=float)
    clear = np.flatnonzero((sizes[1:] > floor) & (sizes[:-1] > floor))
    return float(np.log2(sizes[clear[-1]] / sizes[clear[-1] + 1])) if len(clear) else float("nan")
