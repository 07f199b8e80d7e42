"""The scene of a page as plain lists."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbd.arrays import Matrix, Vector
from mbd.view.camera import FIRST, VIEWS, camera
from mbd.view.forms import mesh
from mbd.view.scene import Scene
from mbd.view.scenery import SURFACE_LINES, Sheet

QUANTIZATION_STEPS = 5000.0
"""Steps into which a range of values is divided; finer than a pixel."""

OBLIQUE = np.deg2rad(np.arange(-45.0, -66.0, -5.0))
"""Yaws tried, from halfway between the side and the front to nearly the front [rad]."""
FIRST_PITCH = 0.3
"""Pitch of a walker's first view [rad]."""
QUANTILE = 0.2
"""Part of the time in which the sides may be nearer to each other than what is compared."""
MIN_DISTANCE_RATIO = 0.9
"""Part of the largest distance between the sides at which the least turned view is taken [-]."""

TURN_STEP = 1e-4
"""Steps of directions and quaternions [-]."""


def geometry(picture: Scene) -> dict[str, Any]:
    """Points, lines, grounds, wheels, blades and forces as plain lists."""
    axes = 3 if picture.spatial else 2
    used = picture.positions[:, :, :axes]
    size = float(np.max(np.ptp(used, axis=1))) if used.size else 0.0
    size = max([size, *(float(np.max(each.radius)) for each in picture.around.rounds)])
    size = size or float(np.max(np.abs(used), initial=0.0)) or 1.0
    step = float(f"{size / QUANTIZATION_STEPS:.1g}")
    heaviest = max(picture.masses.values(), default=1.0)
    return {
        "spatial": picture.spatial,
        "points": [
            {"name": name, "at": [packed(used[:, k, axis], step) for axis in range(axes)]}
            for k, name in enumerate(picture.points)
        ],
        "segments": [
            {
                "body": body, "side": side(body), "points": list(members),
                "mass": finite(picture.masses.get(body, 0.0) / heaviest),
                **({"radius": finite(picture.limbs[body])} if picture.limbs.get(body) and len(members) == 2 else {}),
            }
            for body, members in picture.segments
        ],
        "markers": list(picture.markers),
        "grounds": [
            {"normal": [finite(x) for x in ground.normal], "offset": finite(ground.offset)}
            for ground in picture.grounds
        ],
        "touches": [
            {
                "side": side(touch.contact), "where": [finite(round(float(x), 6)) for x in touch.where[:axes]],
                "begin": touch.begin, "end": touch.end,
            }
            for touch in picture.touches
        ],
        "pushes": [
            {
                "name": push.contact,
                "at": [packed(push.place[:, axis], step) for axis in range(axes)],
                "force": [packed(push.force[:, axis], step_of(push.force)) for axis in range(axes)],
            }
            for push in picture.pushes
        ],
        **_scenery(picture, axes, step),
        **(_space(picture, step) if picture.spatial else {}),
    }  # fmt: skip


def _scenery(picture: Scene, axes: int, step: float) -> dict[str, Any]:
    """Grounds that move, height functions, wheels, balls, blades."""
    around = picture.around

    def series(places: Matrix, fine: float) -> list[dict[str, Any]]:
        return [packed(places[:, axis], fine) for axis in range(axes)]

    def sheet_of(sheet: Sheet) -> dict[str, Any]:
        return _surface(sheet, picture.turn[:, 1], step) if picture.spatial else _sheet(sheet, step)

    return {
        "decks": [
            {
                "at": series(deck.place, step),
                "normal": series(deck.normal, TURN_STEP),
                "along": series(deck.forward, TURN_STEP),
            }
            for deck in around.decks
        ],
        "sheets": [sheet_of(sheet) for sheet in around.sheets],
        "wheels": [
            {
                "side": side(wheel.name), "at": series(wheel.center, step), "radius": packed(wheel.radius, step),
                "spoke": series(wheel.spoke, TURN_STEP), "down": series(np.cross(wheel.spoke, wheel.axle), TURN_STEP),
            }
            for wheel in around.wheels
        ],
        "balls": [
            {"side": side(ball.name), "at": series(ball.center, step), "radius": packed(ball.radius, step)}
            for ball in around.balls
        ],
        "blades": [
            {"side": side(blade.name), "at": series(blade.place, step), "along": series(blade.along, TURN_STEP)}
            for blade in around.blades
        ],
    }  # fmt: skip


def _sheet(sheet: Sheet, step: float) -> dict[str, Any]:
    """Lines of a planar surface, each its points at the times it is known at; a line ends where the ground does."""
    lines: list[NDArray[np.float64]] = []
    for line in np.moveaxis(sheet.lines, 1, 0):
        there = np.all(np.isfinite(line), axis=(0, 2))
        edges = np.flatnonzero(np.diff(there.astype(np.int8), prepend=0, append=0))
        lines += [line[:, first:stop, :2] for first, stop in zip(edges[::2], edges[1::2], strict=True)]
    return {
        "times": [round(float(t), 9) for t in sheet.times],
        "lines": [
            {"count": line.shape[1], "at": [[packed(at[:, axis], step) for axis in range(2)] for at in line]}
            for line in lines
        ],
    }


def _space(picture: Scene, step: float) -> dict[str, Any]:
    """Solids, hinges and stops over time, facets of each kind of solid in use, ground axes (columns), camera views.

    step : of places [m]
    """
    kinds = {"capsule", "box", *(solid.form.kind for solid in picture.solids)}
    kinds |= {"cylinder"} if picture.hinges else set()
    kinds |= {"wheel"} if picture.around.wheels else set()
    kinds |= {"cone"} if picture.pushes else set()
    return {
        "solids": [
            {
                "body": solid.name, "side": side(solid.name), "kind": solid.form.kind,
                "half": [finite(x) for x in solid.form.half], "at": _series(solid.center, step),
                "turn": _series(solid.turn, TURN_STEP),
            }
            for solid in picture.solids
        ],
        "hinges": [
            {"name": hinge.name, "at": _series(hinge.place, step), "axis": _series(hinge.axis, TURN_STEP)}
            for hinge in picture.hinges
        ],
        "cones": [
            {
                "name": stop.name,
                "at": _series(stop.place, step),
                "axis": _series(stop.axis, TURN_STEP),
                "angle": stop.angle,
            }
            for stop in picture.stops
        ],
        "meshes": {kind: _mesh(kind) for kind in sorted(kinds)},
        "axes": picture.turn.round(9).T.tolist(),
        "views": {"reset": first_view(picture), **VIEWS},
    }  # fmt: skip


def _surface(sheet: Sheet, upwards: Vector, step: float) -> dict[str, Any]:
    """A surface by the corners of its lines along x, row after row: places at its first time, then how far each rose.

    upwards : the direction of heights in the scene; holes : numbers of corners without a height
    """
    rows, count = SURFACE_LINES, sheet.lines.shape[2]
    corners = sheet.lines[:, :rows].reshape(len(sheet.times), rows * count, 3)
    holes = np.flatnonzero(~np.all(np.isfinite(corners), axis=(0, 2)))
    risen = (corners - corners[0]) @ upwards
    return {
        "times": [round(float(t), 9) for t in sheet.times], "rows": rows, "count": count, "holes": holes.tolist(),
        "at": _series(corners[0], step), "up": [finite(x) for x in upwards],
        "risen": [packed(each, 5.0 * step) for each in risen[1:]],  # heights in coarser steps than places
    }  # fmt: skip


def _series(values: NDArray[np.float64], step: float) -> list[dict[str, Any]]:
    return [packed(column, step) for column in values.T]


def _mesh(kind: str) -> dict[str, list[Any]]:
    form = mesh(kind)
    return {
        "at": form.at.round(4).ravel().tolist(), "normal": form.normal.round(4).ravel().tolist(),
        "faces": form.faces.ravel().tolist(), "marked": form.marked.astype(int).tolist(),
    }  # fmt: skip


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
    # the distance counts little beside how much it changes
    steadiest = int(np.argmin(np.std(length, axis=0) / usual + 0.01 * usual / usual.max()))
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


def side(name: str) -> str:
    """'left', 'right' or ''."""
    words = name.replace(".", " ").split()
    return next((word for word in ("left", "right") if word in words), "")


def finite(value: float) -> float | None:
    """A number JSON can hold, rounded to nine figures."""
    return float(f"{value:.9g}") if np.isfinite(value) else None


def packed(values: ArrayLike, step: float) -> dict[str, Any]:
    """A series as whole multiples of `step`: the first, then differences; one number if it never changes."""
    numbers = np.asarray(values, dtype=np.float64)
    whole = np.rint(np.nan_to_num(numbers / step)).astype(np.int64)
    constant = len(whole) > 0 and bool(np.all(whole == whole[0]))
    return {"step": step, "d": [int(whole[0])] if constant else np.diff(whole, prepend=0).tolist()}


def step_of(*series: ArrayLike) -> float:
    """A round step that divides the common range of some series finely enough."""
    both = np.concatenate([np.ravel(np.asarray(values, dtype=np.float64)) for values in series])
    both = both[np.isfinite(both)]
    span = float(np.max(np.abs(both), initial=0.0))
    return float(f"{span / QUANTIZATION_STEPS:.1g}") if span > 0.0 else 1.0
