"""Which pictures of a long run are kept: those between which straight interpolation misses what moves by too much."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix
from mbd.view.scene import Scene

__all__ = ["kept", "motion"]


def motion(picture: Scene) -> Matrix:
    """All that a page interpolates, (F, k), over the size of the mechanism: places, and quaternions by half of it.

    A page divides interpolated quaternions by their length, which stays on the rotations; what is missed there is at
    most what the straight line misses here.
    """
    count, around = len(picture.instants.time), picture.around
    places = [picture.positions.reshape(count, -1), *(solid.center for solid in picture.solids)]
    places += [hinge.place for hinge in picture.hinges] + [each.center for each in around.rounds]
    places += [deck.place for deck in around.decks] + [push.place for push in picture.pushes]
    largest = max((float(np.max(np.abs(push.force))) for push in picture.pushes), default=0.0) or 1.0
    turns = [solid.turn for solid in picture.solids] + [hinge.axis for hinge in picture.hinges]
    turns += [wheel.spoke for wheel in around.wheels] + [deck.normal for deck in around.decks]
    size = max(float(np.max(np.ptp(picture.positions, axis=1), initial=0.0)), 1e-9)
    pushes = [push.force / (3.0 * largest) for push in picture.pushes]
    return np.hstack([*(place / size for place in places), *(0.5 * turn for turn in turns), *pushes])


def kept(time: NDArray[np.float64], moving: Matrix, tolerance: float) -> NDArray[np.int64]:
    """Numbers of the pictures to keep, as few as go one after the other: ends, both sides of events, and others so that
    straight lines between them miss no column by more than `tolerance`."""
    last = len(time) - 1
    held = np.zeros(last + 1, dtype=bool)
    held[[0, last]] = True
    twice = np.flatnonzero(np.diff(time) <= 0.0)
    held[twice] = held[twice + 1] = True
    ends = np.flatnonzero(held)
    found = [0]
    for stop in ends[1:]:
        while found[-1] < stop:
            found.append(_farthest(time, moving, found[-1], int(stop), tolerance))
    return np.array(found)


def _farthest(time: NDArray[np.float64], moving: Matrix, first: int, stop: int, tolerance: float) -> int:
    """The last picture to which one straight line leads from the first."""
    good = first + 1
    for end in range(first + 2, min(stop, first + 60) + 1):  # most pictures that one interval stands for
        share = (time[first + 1 : end] - time[first]) / (time[end] - time[first])
        line = moving[first] + share[:, None] * (moving[end] - moving[first])
        if float(np.max(np.abs(moving[first + 1 : end] - line))) > tolerance:
            break
        good = end
    return good
