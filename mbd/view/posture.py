"""The mechanism at one state, drawn with matplotlib as the page draws it."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.bodies.ground import Ground
from mbd.errors import MbdError, ModelError
from mbd.results.at_state import instant
from mbd.results.trajectory import Trajectory
from mbd.simulation.simulate import simulate
from mbd.state import State
from mbd.view.camera import angles_of, camera
from mbd.view.facets import MAX_FACET_EDGE, facets, shaded, size_of, surfaces
from mbd.view.plots import drawing
from mbd.view.pushes import Push
from mbd.view.scene import Scene, scene, upright
from mbd.view.scenery import Wheel
from mbd.view.style import FAINT, INK, NEUTRAL, PALE, as_label, color, tone

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FORCE_COLOR = "#009E73"

GROUND_COLOR = "#B9C0C9"

LETTER, LINE = 5.5, 10.0
"""Width of a letter and height of a line of names [pt]."""

HALF_WIDTH_RATIO = 0.62
"""Half of the side of the picture, over the larger side of the mechanism [-]."""


def drawn(model: Any, state: State, path: str | Path | None = None, view: Any = None) -> Axes:
    """The picture of a state; see `State.plot`."""
    rows = camera(*angles_of(view))
    run = instant(model, state)
    picture = scene(_with_forces(model, state) or run, 1)
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
        _draw_forces(axes, picture, rows, size)
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


def _with_forces(model: Any, state: State) -> Trajectory | None:
    """A run of one row, the state with the forces that act in it; None where none of a contact is known.

    Contacts that are open push nothing. Of models with controllers, which would have to be called, no force is shown.
    """
    if not state.mode.closed or model.controllers:
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            run = simulate(model, state, dt=1e-3, until=float(state.time))
    except MbdError:
        return None
    return run if len(run) == 1 else None


def _draw_forces(axes: Any, picture: Scene, rows: Matrix, size: float) -> None:
    """Arrows from where contacts touch, in proportion; the largest is labelled [N].

    rows : the camera; size : of the mechanism [m]
    """
    pushes = [push for push in picture.pushes if np.any(push.force[0])]
    forces = [float(np.linalg.norm(push.force[0])) for push in pushes]
    # the largest force, over the size of the mechanism
    ends = [_arrow(axes, push, rows, size / (3.0 * max(forces))) for push in pushes]
    if pushes:
        text, end = f"{max(forces):.3g} N", ends[int(np.argmax(forces))]
        axes.annotate(text, end, (4.0, 2.0), textcoords="offset points", color=tone(INK), fontsize=8.0, zorder=7)


def _arrow(axes: Any, push: Push, rows: Matrix, scale: float) -> Vector:
    """Where it ends in the picture."""
    start = rows[:2] @ push.place[0]
    end = start + scale * (rows[:2] @ push.force[0])
    how = {
        "arrowstyle": "-|>",
        "color": tone(FORCE_COLOR),
        "lw": 1.8,
        "shrinkA": 0.0,
        "shrinkB": 0.0,
        "mutation_scale": 11.0,
    }
    axes.annotate("", end, start, arrowprops=how, zorder=7)
    return np.asarray(end)


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
