"""What tests share: the machinery of `mbd.testing` that they use most, and runs whose results are altered."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

import mbd
from mbd.testing.scope import FreeScope, skew

__all__ = ["SECOND_ORDER", "FreeScope", "altered", "assert_second_order", "halved", "one_body", "skew"]

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


def altered(run: mbd.Trajectory, column: str, where: Any, change: Callable[[Any], Any]) -> mbd.Trajectory:
    """A run with other numbers in one array of its record, whose own cannot be written to."""
    values = getattr(run.record, column).copy()
    values[where] = change(values[where])
    return mbd.Trajectory(replace(run.record, **{column: values}))


def one_body(body: Any, joint: Any, name: str, title: str = "", **how: Any) -> tuple[mbd.Model, Any]:
    """A model of one body on a joint to the ground, and the body; `how` has words of the model and of the joint."""
    own = {word: how.pop(word) for word in ("gravity", "cut", "tunable") if word in how}
    model = mbd.Model(title or body.name, **own)
    model.connect(joint(name, model.ground.origin, body.start if isinstance(body, mbd.Link) else body.origin, **how))
    return model, body
