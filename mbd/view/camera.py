"""How a spatial scene is seen: parallel rays, so that lengths across them are true and a scale holds everywhere."""

from typing import Any

import numpy as np

from mbd.arrays import Matrix
from mbd.bodies.values import is_number
from mbd.errors import ModelError, nearest

FIRST = (-0.6, 0.42)
"""From where a spatial mechanism is seen first: turned about the vertical, and raised [rad]."""

VIEWS = {"front": (-np.pi / 2.0, 0.0), "side": (0.0, 0.0), "top": (0.0, np.pi / 2.0)}
"""Looking against x, so that a walker comes along; against z, with x to the right; and down."""


def camera(yaw: float, pitch: float) -> Matrix:
    """From the axes of a scene to those of its picture: right, up, and toward the viewer; a rotation (3, 3).

    ``right = (cos ψ, 0, sin ψ)``, ``toward = (−sin ψ cos θ, sin θ, cos ψ cos θ)``, ``up = toward × right``, with ψ the
    yaw about the vertical y of the scene and θ the pitch [rad]. The page follows the same law.
    """
    cy, sy, cp, sp = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
    return np.array([[cy, 0.0, sy], [sp * sy, cp, -sp * cy], [-cp * sy, sp, cp * cy]])


def angles_of(view: Any) -> tuple[float, float]:
    """Yaw and pitch [rad] of a view by name, by both angles, or of the first one for None.

    >>> angles_of("side"), angles_of((0.5, 0.1))
    ((0.0, 0.0), (0.5, 0.1))
    """
    if view is None:
        return FIRST
    if isinstance(view, str):
        if view not in VIEWS:
            raise ModelError(nearest(view, VIEWS, "view", "There are"))
        return VIEWS[view]
    if isinstance(view, tuple | list) and len(view) == 2 and all(is_number(x) and np.isfinite(x) for x in view):
        return float(view[0]), float(view[1])
    raise ModelError(f"view is 'front', 'side', 'top', or yaw and pitch [rad] such as (0.5, 0.2), not {view!r}")
