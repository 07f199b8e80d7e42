"""Whole turns of angles of cut joints in space, counted along the stored rows.

A rotation shows an angle modulo a turn. Where nothing but a result asks for it, its turns are counted afterwards: from
one row to the next it changes by the multiple of 2π that brings it nearest to what its rate says,

    Δ ≈ h (r₀ + r₁)/2

Where the two differ by more than `MAX_TURN`, the count is a guess, which a note of the run tells.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Vector
from mbd.compile.python import ArrayFunction, array_function

MAX_TURN = 1.0
"""Change beside that of the rate up to which turns are certain [rad]; it would be π in the middle of two."""


def function_of(turns: Sequence[Any]) -> ArrayFunction:
    """Angle and rate of each of the turns, one after the other."""
    return array_function([node for turn in turns for node in (turn.angle, turn.rate)])


def counted(time: Vector, angle: Vector, rate: Vector) -> Vector:
    """Whole turns (R,) to add to an angle at rows so that it is continuous; none at the first."""
    change, expected = _changes(time, angle, rate)
    return np.concatenate([[0.0], np.cumsum(np.round((expected - change) / (2.0 * np.pi)))])[: len(time)]


def doubtful(time: Vector, angle: Vector, rate: Vector) -> NDArray[np.bool_]:
    """Between which rows (R − 1,) the count of a counted angle is a guess."""
    change, expected = _changes(time, angle, rate)
    return np.asarray(~(np.abs(change - expected) <= MAX_TURN))


def turns_to(angle: Vector, wanted: Vector) -> Vector:
    """Whole turns to add to angles so that they are nearest to others."""
    return np.asarray(np.round((wanted - angle) / (2.0 * np.pi)))


def _changes(time: Vector, angle: Vector, rate: Vector) -> tuple[Vector, Vector]:
    """Change of an angle from row to row, and what its rate says."""
    return np.diff(angle), 0.5 * np.diff(time) * (rate[1:] + rate[:-1])
