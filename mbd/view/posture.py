"""The mechanism at one state, drawn with matplotlib as the page draws it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.arrays import Matrix
from mbd.bodies.ground import Ground
from mbd.errors import ModelError
from mbd.results.at_state import instant
from mbd.results.trajectory import Trajectory
from mbd.state import State
from mbd.view.camera import angles_of, camera
from mbd.view.plots import drawing
from mbd.view.posture_forces import draw_forces, with_forces
from mbd.view.posture_in_space import draw_in_space
from mbd.view.scene import Scene, scene, upright
from mbd.view.scenery import Wheel
from mbd.view.style import INK, NEUTRAL, as_label, color, tone

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["drawn", "instant"]

GROUND_COLOR = "#B9C0C9"

LETTER, LINE = 5.5, 10.0
"""Width of a letter and height of a line of names [pt]."""

HALF_WIDTH_RATIO = 0.62
"""Half of the side of the picture, over the larger side of the mechanism [-]."""


def drawn(model: Any, state: State, path: str | Path | None = None, view: Any = None) -> Axes:
    """The picture of a state; see `State.plot`."""
    rows = camera(*angles_of(view))
    run = instant(model, state)
    picture = scene(with_forces(model, state) or run, 1)
    if not picture.points:
        raise ModelError(f"'{run.name}' has no bodies to draw")
    rows = rows if picture.spatial else np.eye(3)
    places = picture.positions[0] @ rows[:2].T
    with drawing(path, 5.6, 5.6) as figure:
        axes: Axes = figure.subplots()
        if picture.spatial:
            _, _, size = _frame(axes, draw_in_space(axes, picture, rows))
        else:
            size = _draw_in_plane(axes, picture, places)
        draw_forces(axes, picture, rows, size)
        _pivots(axes, model, run, rows)
        _markers(axes, picture, places)
        axes.set_xlabel("[m]")
        axes.set_ylabel("[m]")
        closed = sorted(state.mode.closed)
        names = ", ".join(closed) if len(closed) <= 3 else f"{len(closed)} contacts"
        title = f"{run.name}, t = {state.time:g} s" + (f", closed: {names}" if closed else "")
        axes.set_title(as_label(title))
    return axes


def _frame(axes: Any, extent: Matrix) -> tuple[float, float, float]:
    """A square with some room around what is drawn; its left and right edge, and the size of what is drawn [m]."""
    low, high = extent.min(axis=0), extent.max(axis=0)
    size = float(np.max(high - low)) or 1.0
    left, below = (low + high) / 2.0 - HALF_WIDTH_RATIO * size
    right, above = (low + high) / 2.0 + HALF_WIDTH_RATIO * size
    axes.set(aspect="equal", xlim=(left, right), ylim=(below, above))
    return float(left), float(right), size


def _draw_in_plane(axes: Any, picture: Scene, places: Matrix) -> float:
    """A planar mechanism and what stands around it; its size [m]."""
    rims = [_rim(wheel)[:, :2] for wheel in picture.around.wheels]
    left, right, size = _frame(axes, np.vstack([places, *rims]))
    _ground(axes, picture, left, right)
    _scenery(axes, picture, rims, size)
    _bodies(axes, picture, places)
    return size


def _ground(axes: Any, picture: Scene, left: float, right: float) -> None:
    """Planes that contacts touch, as lines."""
    for ground in picture.grounds:
        normal = ground.normal[:2]
        if abs(normal[1]) > 1e-9:
            x = np.array([left, right])
            axes.plot(x, (ground.offset - normal[0] * x) / normal[1], color=GROUND_COLOR, lw=2.0, zorder=0)


def _rim(wheel: Wheel) -> Matrix:
    """The rim of a wheel from its spoke on, (65, 3) [m]."""
    angle = np.linspace(0.0, 2.0 * np.pi, 65)[:, None]
    down = np.cross(wheel.spoke[0], wheel.axle[0])
    return np.asarray(wheel.center[0] + wheel.radius[0] * (np.cos(angle) * wheel.spoke[0] + np.sin(angle) * down))


def _scenery(axes: Any, picture: Scene, rims: list[Matrix], size: float) -> None:
    """Surfaces and planes that move, as lines; wheels with a spoke; blades, dark and a tenth as long as the figure."""
    around = picture.around
    for sheet in around.sheets:
        for line in sheet.lines[0]:
            axes.plot(*line[:, :2].T, color=GROUND_COLOR, lw=2.0, zorder=0)
    for deck in around.decks:
        ends = deck.place[0] + np.array([[-9.0], [9.0]]) * size * deck.forward[0]
        axes.plot(*ends[:, :2].T, color=GROUND_COLOR, lw=2.0, zorder=0)
    for wheel, rim in zip(around.wheels, rims, strict=True):
        axes.plot(*rim.T, color=color(wheel.name), lw=2.0, zorder=2)
        axes.plot(*np.array([wheel.center[0, :2], rim[0]]).T, color=color(wheel.name), lw=1.5, zorder=2)
    for blade in around.blades:
        ends = blade.place[0] + np.array([[-0.05], [0.05]]) * size * blade.along[0]
        axes.plot(*ends[:, :2].T, color=tone(INK), lw=5.0, zorder=5, solid_capstyle="round")


def _pivots(axes: Any, model: Any, run: Trajectory, rows: Matrix) -> None:
    """Where joints that only turn hold bodies to the ground."""
    turn = upright(run)
    for joint in model.joints:
        frame = next((each for each in (joint.parent, joint.child) if isinstance(each.body, Ground)), None)
        if frame is not None and joint.labels and all(label.unit == "rad" for label in joint.labels):
            x, y, _ = rows @ turn @ run[frame.full_name][0]
            axes.plot([x], [y], marker=6, markersize=13, color=GROUND_COLOR, zorder=1)


def _bodies(axes: Any, picture: Scene, places: Matrix) -> None:
    """Lines through the frames of each body, joints as rings, single points as large as their mass."""
    heaviest = max(picture.masses.values(), default=1.0)
    for body, members in picture.segments:
        shade, points = color(body), places[list(members)]
        if len(points) == 1:
            size = 5.0 + 8.0 * (picture.masses.get(body, 0.0) / heaviest) ** (1.0 / 3.0)
            axes.plot(*points.T, "o", color=shade, markersize=size, zorder=3)
            continue
        if len(points) > 2:
            axes.fill(*points.T, color=shade, alpha=0.18, lw=0.0, zorder=2)
            points = np.vstack([points, points[:1]])
        axes.plot(*points.T, color=shade, lw=4.0, zorder=2, solid_joinstyle="round")
        axes.plot(*points.T, "o", color=shade, markerfacecolor="white", markersize=5.0, zorder=4)


def _markers(axes: Any, picture: Scene, places: Matrix) -> None:
    """Named points with their names, but for names that would lie on others."""
    from matplotlib.patheffects import withStroke

    figure = sorted({number for _, members in picture.segments for number in members} - set(picture.markers))
    taken: list[tuple[float, float, float]] = []
    for number in picture.markers:
        place, name = places[number], as_label(picture.points[number])
        apart = [place - places[other] for other in figure] or [np.ones(2)]
        nearest = min(apart, key=lambda d: float(np.hypot(*d)))  # the name stands on the other side
        shift, side = (7.0, "left") if nearest[0] >= 0.0 else (-7.0, "right")
        axes.plot(*place, ".", color=NEUTRAL, markersize=6.0, zorder=5)
        if not _is_free(axes, place, len(name) if side == "left" else -len(name), taken):
            continue
        axes.annotate(
            name, place, (shift, 0.0), textcoords="offset points", va="center", ha=side, zorder=6,
            path_effects=[withStroke(linewidth=3.0, foreground="white")],
        )  # fmt: skip


def _is_free(axes: Any, place: Any, letters: int, taken: list[tuple[float, float, float]]) -> bool:
    """Whether a text of so many letters to the right of a place (to the left of negative ones) covers no other."""
    x, y = axes.transData.transform(place) * 72.0 / axes.figure.dpi
    left, right = sorted((x, x + LETTER * letters))
    if any(left < b and a < right and abs(y - other) < LINE for a, b, other in taken):
        return False
    taken.append((float(left), float(right), float(y)))
    return True
