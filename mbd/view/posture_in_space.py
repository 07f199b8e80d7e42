"""A spatial mechanism at one state, drawn with matplotlib as on the page: solids by depth, a grid, shadows."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.view.facets import MAX_FACET_EDGE, facets, shaded, size_of, surfaces
from mbd.view.scene import Scene
from mbd.view.style import FAINT, PALE, tone

__all__ = ["draw_in_space"]


def draw_in_space(axes: Any, picture: Scene, rows: Matrix) -> Matrix:
    """Grounds, shadows and solids seen by a camera; gives corners of the solids in the picture (n, 2) [m]."""
    from matplotlib.collections import PolyCollection

    axes.grid(False)
    found, size = facets(picture), size_of(picture)
    for normal, at in _floors(picture, size):
        _grid(axes, normal, at, found.corners, rows, size)
    sheet = surfaces(picture)
    for part, closed in ((sheet, False), (found, True)):
        if part is None:
            continue
        places, tint = shaded(part, rows, MAX_FACET_EDGE * size, closed)
        stack = PolyCollection(list(places), facecolors=tint, edgecolors=tint, linewidths=0.3, zorder=2)
        stack.set_rasterized(True)
        axes.add_collection(stack)
    if sheet is not None:
        for line in picture.around.sheets[0].lines[0, ::2]:
            axes.plot(*(line @ rows[:2].T).T, color=tone(FAINT), lw=0.4, alpha=0.5, zorder=2.1)
    return np.asarray(found.corners.reshape(-1, 3) @ rows[:2].T)


def _floors(picture: Scene, size: float) -> list[tuple[Vector, Vector]]:
    """Normal and a place below the mechanism of every plane; without any ground one below, for depth."""
    around = picture.around
    planes = [(ground.normal, ground.offset) for ground in picture.grounds]
    planes += [(deck.normal[0], float(deck.normal[0] @ deck.place[0])) for deck in around.decks]
    if not planes and not around.sheets:
        low = float(facets(picture).corners[:, :, 1].min())
        planes = [(np.array([0.0, 1.0, 0.0]), low - 0.12 * size)]
    middle = picture.positions[0].mean(axis=0)
    return [(normal, middle - (normal @ middle - offset) * normal) for normal, offset in planes]


def _grid(axes: Any, normal: Vector, at: Vector, corners: Any, rows: Matrix, size: float) -> None:
    """Lines on a plane around a place, and what is straight above as a shadow if the plane is seen from above."""
    from matplotlib.collections import LineCollection, PolyCollection

    flat = normal[1] < 0.5
    first = np.array([-normal[2], 0.0, normal[0]]) if flat else np.array([normal[1], -normal[0], 0.0])
    first = first / np.linalg.norm(first)
    second, half = np.cross(first, normal), 0.9 * size
    marks = np.linspace(-half, half, 9)
    ends = [(m * a - half * b, m * a + half * b) for a, b in ((first, second), (second, first)) for m in marks]
    lines = [np.array([at + start, at + stop]) @ rows[:2].T for start, stop in ends]
    axes.add_collection(LineCollection(lines, colors=tone(PALE), linewidths=0.8, zorder=0))
    if normal[1] > 0.2 and normal @ rows[2] > 0.0:
        below = corners.copy()
        below[:, :, 1] = (normal @ at - corners[:, :, 0] * normal[0] - corners[:, :, 2] * normal[2]) / normal[1]
        above = np.any(corners[:, :, 1] > below[:, :, 1], axis=1)
        shade = PolyCollection(list(below[above] @ rows[:2].T), facecolors=tone(PALE), linewidths=0.0, zorder=1)
        shade.set_rasterized(True)
        axes.add_collection(shade)
