"""What tests share: the machinery of `mbd.testing` that they use most, and runs whose results are altered."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import mbd
from mbd.testing.order import SECOND_ORDER, assert_second_order, halved
from mbd.testing.scope import FreeScope, skew

__all__ = ["SECOND_ORDER", "FreeScope", "altered", "assert_second_order", "halved", "skew"]


def altered(run: mbd.Trajectory, column: str, where: Any, change: Callable[[Any], Any]) -> mbd.Trajectory:
    """A run with other numbers in one array of its record, whose own cannot be written to."""
    values = getattr(run.record, column).copy()
    values[where] = change(values[where])
    return mbd.Trajectory(replace(run.record, **{column: values}))
