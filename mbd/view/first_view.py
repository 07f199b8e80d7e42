"""The direction from which a spatial mechanism is seen first: one from which its two sides do not cover each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Vector
from mbd.view.camera import FIRST, camera
from mbd.view.packing import side
from mbd.view.scene import Scene

__all__ = ["first_view"]

OBLIQUE = np.deg2rad(np.arange(-45.0, -66.0, -5.0))
"""Yaws tried, from halfway between the side and the front to nearly the front [rad]."""
FIRST_PITCH = 0.3
"""Pitch of a walker's first view [rad]."""
QUANTILE = 0.2
"""Part of the time in which the sides may be nearer to each other than what is compared."""
DISTANCE_WEIGHT = 0.01
"""Weight of the distance of a pair, over the largest one, beside how much it changes [-]."""
MIN_DISTANCE_RATIO = 0.9
"""Part of the largest distance between the sides at which the least turned view is taken [-]."""


def first_view(picture: Scene) -> tuple[float, float]:
    """Yaw and pitch [rad]; `FIRST` for mechanisms without a left and a right side.

    1. The points of one side that have a partner on the other, 'left leg.foot' and 'right leg.foot', are taken.
    2. The way from left to right, at the start and levelled, of the pair whose distance changes least (the sockets of a
       pelvis) is the sideways axis, to which yaws are relative.
    3. Of the oblique yaws that one counts from which partners stay apart in the picture.
    """
    pairs = _pairs(picture)
    if not len(pairs):
        return FIRST
    # pictures of a run that are judged, at most
    rows = np.unique(np.linspace(0, len(picture.positions) - 1, 40).round().astype(int))
    apart = picture.positions[rows][:, pairs[:, 1]] - picture.positions[rows][:, pairs[:, 0]]  # from left to right
    length = np.linalg.norm(apart, axis=-1)
    usual = np.maximum(length.mean(axis=0), 1e-9)
    steadiest = int(np.argmin(np.std(length, axis=0) / usual + DISTANCE_WEIGHT * usual / usual.max()))
    level = apart[0, steadiest] * [1.0, 0.0, 1.0]
    size = float(np.linalg.norm(level))
    if size < 1e-9:
        return FIRST
    sideways = level / size
    forward = np.array([sideways[2], 0.0, -sideways[0]])
    yaws = [_yaw(forward, sideways, angle) for angle in OBLIQUE]
    scores = np.array([_distance(apart, yaw) for yaw in yaws])
    return yaws[int(np.argmax(scores >= MIN_DISTANCE_RATIO * scores.max()))], FIRST_PITCH


def _pairs(picture: Scene) -> NDArray[np.intp]:
    """(k, 2) numbers of points on the left and their partners on the right that are drawn."""
    drawn = {k for _, members in picture.segments for k in members}
    number = {name: k for k, name in enumerate(picture.points) if k in drawn}
    found = [
        (k, number[partner])
        for name, k in number.items()
        if side(name) == "left" and (partner := name.replace("left", "right")) in number
    ]
    return np.array(found, dtype=np.intp).reshape(-1, 2)


def _yaw(forward: Vector, sideways: Vector, angle: float) -> float:
    """The yaw from which forward is to the right in the picture, turned by an angle."""
    right = np.cos(angle) * forward + np.sin(angle) * sideways
    return float(np.arctan2(right[2], right[0]))


def _distance(apart: NDArray[np.float64], yaw: float) -> float:
    """How far partners are apart across the picture, but for `QUANTILE` of the time [m]."""
    across = np.abs(apart @ camera(yaw, FIRST_PITCH)[0])
    return float(np.quantile(across, QUANTILE, axis=0).mean())
