"""Solids for pictures in space: which one has a body's inertia, and the facets of each kind.

A body is drawn as the uniform solid of equal mass and moments of inertia: the one that words of the model tell
(`mbd.box`, a disk that touches), else a cylinder where two moments are equal and a box where none or all are. What
`mbd.box`, `mbd.cylinder`, `mbd.disk` and `mbd.sphere` describe is drawn as it is; an inertia that was mistaken shows.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.equal import NOMINAL_RTOL


@dataclass(frozen=True, eq=False)
class Form:
    """A solid about its center: kind 'box', 'cylinder' or 'ball', half sizes (3,) [m] along its axes.

    axes : columns in body axes (3, 3), right-handed; a cylinder lies along the third
    """

    kind: str
    half: Vector
    axes: Matrix


def equal_inertia(mass: float, moments: Sequence[float], kind: str = "") -> Form | None:
    """The uniform solid of a mass and (Ixx, Iyy, Izz, Ixy, Ixz, Iyz) about its center; None without mass or moments.

    Box of sides a, b, c: ``a² = 6 (I₂ + I₃ − I₁)/m``. Cylinder: ``r² = 2 I₃/m``, ``L² = 12 I₁/m − 3 r²``. Ball:
    ``r² = 5 I/(2 m)``. Where the moments are not those of a given `kind`, it has their mean.

    kind : 'box', 'cylinder' or 'ball'; '': a cylinder where two moments are equal, else a box
    """
    xx, yy, zz, xy, xz, yz = moments
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    largest = float(np.max(np.abs(matrix)))
    if not (mass > 0.0 and np.isfinite(largest) and largest > 0.0):
        return None
    principal, axes = np.linalg.eigh(matrix) if np.any([xy, xz, yz]) else (np.array([xx, yy, zz]), np.eye(3))
    if np.linalg.det(axes) < 0.0:
        axes = -axes
    apart = [abs(principal[(k + 1) % 3] - principal[(k + 2) % 3]) for k in range(3)]
    equal = [gap < NOMINAL_RTOL * largest for gap in apart]
    if kind == "ball":
        return Form("ball", np.full(3, np.sqrt(2.5 * float(np.mean(principal)) / mass)), axes)
    if kind == "cylinder" or (kind == "" and any(equal) and not all(equal)):
        k = int(np.argmin(apart))
        radius = 2.0 * principal[k] / mass
        across = 0.5 * (principal[(k + 1) % 3] + principal[(k + 2) % 3])
        length = max(12.0 * across / mass - 3.0 * radius, 0.0)
        half = np.array([np.sqrt(radius), np.sqrt(radius), 0.5 * np.sqrt(length)])
        return Form("cylinder", _thick(half), axes[:, [(k + 1) % 3, (k + 2) % 3, k]])
    sides = 6.0 * (principal.sum() - 2.0 * principal) / mass
    return Form("box", _thick(0.5 * np.sqrt(np.maximum(sides, 0.0))), axes)


def _thick(half: Vector) -> Vector:
    return np.maximum(half, 0.03 * np.max(half))  # a disk or a rod is drawn with some thickness


@dataclass(frozen=True, eq=False)
class Mesh:
    """Facets of a solid of half sizes 1.

    at, normal : places and outward normals of its corners (n, 3) [-]; faces : three corners each, seen counterclockwise
    from outside (m, 3); marked : whether a face has the second of two tones, by which turning shows (m,)
    """

    at: Matrix
    normal: Matrix
    faces: NDArray[np.int64]
    marked: NDArray[np.bool_]


@cache
def mesh(kind: str) -> Mesh:
    """The facets of a 'box', a 'cylinder' along z, a 'ball', a 'cone' or 'capsule' along z, or a 'wheel' about z.

    A wheel is a rim with a marked spoke along x and another one against it.

    Of a capsule normals are places on the unit ball, and ``at − normal`` is the end, (0, 0, ±1), that they belong to:
    radius r and half length h give ``r normal + h (at − normal)``.
    """
    return {"box": _box, "cylinder": _cylinder, "ball": _ball, "capsule": _capsule, "cone": _cone, "wheel": _wheel}[
        kind
    ]()


def _box() -> Mesh:
    corners = np.array([[-1.0, -1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]])
    turns = [np.roll(corners, k, axis=1) * sign for k in range(3) for sign in (1.0, -1.0)]
    order = [(0, 1, 2), (0, 2, 3)], [(0, 2, 1), (0, 3, 2)]
    faces = [np.array(order[n % 2]) + 4 * n for n in range(6)]
    normals = [np.tile(np.roll([0.0, 0.0, sign], k), (4, 1)) for k in range(3) for sign in (1.0, -1.0)]
    marked = np.repeat([False, True] * 3, 2)
    return Mesh(np.concatenate(turns), np.concatenate(normals), np.concatenate(faces), marked)


def _circles(heights: Sequence[float], radii: Sequence[float], count: int) -> Matrix:
    """Circles about z, (circles, count + 1, 3); the last corner of each is the first again."""
    angle = np.linspace(0.0, 2.0 * np.pi, count + 1)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    tops = [np.column_stack([r * circle, np.full(count + 1, z)]) for z, r in zip(heights, radii, strict=True)]
    return np.array(tops)


def _walls(circles: int, count: int) -> NDArray[np.int64]:
    """Two faces between each pair of neighbors on two circles that follow each other upwards."""
    k, n = np.meshgrid(np.arange(circles - 1), np.arange(count), indexing="ij")
    low, wide = (k * (count + 1) + n).ravel(), count + 1
    return np.concatenate([
        np.column_stack([low, low + 1, low + wide + 1]), np.column_stack([low, low + wide + 1, low + wide])
    ])  # fmt: skip


def _round(heights: Sequence[float], shifts: Sequence[float], count: int, marks: bool) -> Mesh:
    """A ball cut at heights of itself, whose circles are shifted along z."""
    circles = _circles(heights, [np.sqrt(max(1.0 - z * z, 0.0)) for z in heights], count)
    places = circles + np.array([[[0.0, 0.0, shift]] for shift in shifts])
    faces = _walls(len(heights), count)
    corners = places.reshape(-1, 3)[faces]
    faces = faces[np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) > 1e-9]
    middle = circles.reshape(-1, 3)[faces].mean(axis=1)
    marked = np.prod(np.where(middle > 0.0, 1.0, -1.0), axis=1) < 0.0
    return Mesh(places.reshape(-1, 3), circles.reshape(-1, 3), faces, marked & marks)


def _ball() -> Mesh:
    heights = [float(z) for z in np.sin(np.linspace(-0.5 * np.pi, 0.5 * np.pi, 13))]
    return _round(heights, [0.0] * 13, 24, marks=True)


def _capsule() -> Mesh:
    low = [float(z) for z in np.sin(np.linspace(-0.5 * np.pi, 0.0, 4))]
    return _round([*low, *(-z + 0.0 for z in reversed(low))], [-1.0] * 4 + [1.0] * 4, 14, marks=False)


def _cylinder() -> Mesh:
    count = 32
    circles = _circles([-1.0, 1.0], [1.0, 1.0], count)
    side = circles.reshape(-1, 3)
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False) + np.pi / count
    quarter = np.cos(angle) * np.sin(angle) < 0.0
    places, normals = [side], [side * [1.0, 1.0, 0.0]]
    faces, marked = [_walls(2, count)], [np.tile(quarter, 2)]
    for sign, circle in zip((-1.0, 1.0), circles, strict=True):
        start, n = sum(map(len, places)), np.arange(count)
        pair = (n, n + 1) if sign > 0.0 else (n + 1, n)
        places.append(np.vstack([circle, [0.0, 0.0, sign]]))
        normals.append(np.tile([0.0, 0.0, sign], (count + 2, 1)))
        faces.append(start + np.column_stack([*pair, np.full(count, count + 1)]))
        marked.append(quarter)
    return Mesh(np.concatenate(places), np.concatenate(normals), np.concatenate(faces), np.concatenate(marked))


def _cone() -> Mesh:
    count, slope = 20, np.sqrt(0.2)
    circle = _circles([-1.0], [1.0], count)[0]
    flat = circle * [1.0, 1.0, 0.0]
    sides = 2.0 * slope * flat + [0.0, 0.0, slope]
    n, wide = np.arange(count), count + 1
    tips, base = np.tile([0.0, 0.0, 1.0], (wide, 1)), np.vstack([circle, [0.0, 0.0, -1.0]])
    faces = [np.column_stack([n, n + 1, wide + n]), 2 * wide + np.column_stack([n + 1, n, np.full(count, wide)])]
    normals = np.concatenate([sides, sides, np.tile([0.0, 0.0, -1.0], (wide + 1, 1))])
    return Mesh(np.concatenate([circle, tips, base]), normals, np.concatenate(faces), np.zeros(2 * count, dtype=bool))


def _wheel() -> Mesh:
    count, inner = 40, 0.86
    circle, parts = _circles([-1.0, 1.0], [1.0, 1.0], count), []
    around = circle * [1.0, 1.0, 0.0]
    walls, turned = _walls(2, count), _walls(2, count)[:, ::-1]
    shrunk = circle * [inner, inner, 1.0]
    for places, normal, faces in (
        (circle, around, walls), (shrunk, -around, turned),
        (np.array([circle[1], shrunk[1]]), around * 0.0 + [0.0, 0.0, 1.0], walls),
        (np.array([circle[0], shrunk[0]]), around * 0.0 - [0.0, 0.0, 1.0], turned),
    ):  # fmt: skip
        parts.append((places.reshape(-1, 3), normal.reshape(-1, 3), faces, np.zeros(len(faces), dtype=bool)))
    box = _box()
    for side in (1.0, -1.0):
        places = box.at * [0.45, 0.05, 0.5] + [0.45 * side, 0.0, 0.0]
        parts.append((places, box.normal, box.faces, np.full(len(box.faces), side < 0.0)))
    starts = np.cumsum([0, *(len(places) for places, *_ in parts[:-1])])
    joined = [part[2] + start for part, start in zip(parts, starts, strict=True)]
    at, normal, marked = (np.concatenate([part[k] for part in parts]) for k in (0, 1, 3))
    return Mesh(at, normal, np.concatenate(joined), marked)
