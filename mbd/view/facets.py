"""A spatial scene at one instant as facets, for matplotlib; the script of the page makes the same ones.

Facets are so small that painting them from the farthest to the nearest hides what is behind.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.view.forms import mesh
from mbd.view.scene import Scene
from mbd.view.scenery import SURFACE_LINES
from mbd.view.solids import rotations
from mbd.view.style import INK, NEUTRAL, PAPER, color, tone

MAX_FACET_EDGE = 0.035
"""Longest edge of a facet, over the size of the mechanism [-]."""


@dataclass(frozen=True, eq=False)
class Facets:
    """corners (n, 3, 3) [m] in the axes of the scene, counterclockwise from outside; color of each, unlit (n, 3)."""

    corners: NDArray[np.float64]
    color: Matrix


def size_of(picture: Scene) -> float:
    """Twice the farthest distance of anything from the middle [m]."""
    reaches = [(picture.positions[0], 0.0)]
    reaches += [(solid.center[:1], float(np.linalg.norm(solid.form.half))) for solid in picture.solids]
    reaches += [(each.center[:1], float(each.radius[0])) for each in picture.around.rounds]
    low = np.min([np.min(at, axis=0) - reach for at, reach in reaches], axis=0)
    high = np.max([np.max(at, axis=0) + reach for at, reach in reaches], axis=0)
    middle = 0.5 * (low + high)
    far = max(float(np.max(np.linalg.norm(at - middle, axis=1))) + reach for at, reach in reaches)
    return 2.0 * far or 1.0


def facets(picture: Scene) -> Facets:
    """Bodies, wheels, blades and joints of the first instant."""
    r = 0.016 * size_of(picture)
    parts = [*_bodies(picture, r), *_joints(picture, r), *_around(picture, r)]
    return Facets(np.concatenate([part.corners for part in parts]), np.concatenate([part.color for part in parts]))


def surfaces(picture: Scene) -> Facets | None:
    """Grounds of given height at the first instant."""
    found = []
    for sheet in picture.around.sheets:
        at = sheet.lines[0, :SURFACE_LINES]
        a, b, c, d = at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]
        both = np.concatenate([np.stack(way, axis=2).reshape(-1, 3, 3) for way in ((a, c, b), (a, d, c))])
        found.append(both[np.all(np.isfinite(both), axis=(1, 2))])
    if not found:
        return None
    corners = np.concatenate(found)
    return Facets(corners, np.tile(_mixed(tone(PAPER), tone(INK), 0.1), (len(corners), 1)))


def _bodies(picture: Scene, r: float) -> Iterator[Facets]:
    """Solids of their inertia, capsules along the lines of their frames."""
    heaviest = max(picture.masses.values(), default=1.0)
    solids = {solid.name: solid for solid in picture.solids}
    for solid in picture.solids:
        first, second = (_mixed(color(solid.name), tone(PAPER), share) for share in (0.25, 0.5))
        turn = rotations(solid.turn[:1])[0]
        yield _placed(solid.form.kind, solid.form.half, solid.center[0], turn, first, second)
    for body, members in picture.segments:
        at, shade = picture.positions[0][list(members)], _mixed(color(body), tone(PAPER), 0.0)
        if body in solids:
            center, form = solids[body].center[0], solids[body].form
            local = (at - center) @ rotations(solids[body].turn[:1])[0]
            for place in at[np.any(np.abs(local) > 1.02 * form.half, axis=1)]:
                yield _capsule(center, place, 0.55 * r, shade)
        elif len(at) == 1:
            share = picture.masses.get(body, 0.0) / heaviest
            yield _capsule(at[0], at[0], r * (1.2 + 1.6 * share ** (1.0 / 3.0)), shade)
        else:
            radius = picture.limbs.get(body, 0.0) if len(at) == 2 else 0.0
            for a, b in zip(at if len(at) > 2 else at[:-1], np.roll(at, -1, axis=0), strict=False):
                yield _capsule(*_within(a, b, radius), radius or r, shade)


def _joints(picture: Scene, r: float) -> Iterator[Facets]:
    """A pin along each axis, a ball where lines meet."""
    light = _mixed(tone(NEUTRAL), tone(PAPER), 0.55)
    for hinge in picture.hinges:
        half = r * np.array([1.45, 1.45, 2.8])
        yield _placed("cylinder", half, hinge.place[0], _along(hinge.axis[0]), light, light)
    centers = {solid.name: solid.center[0] for solid in picture.solids}
    for number in sorted({number for _, members in picture.segments for number in members}):
        place = picture.positions[0][number]
        center = centers.get(picture.points[number].rpartition(".")[0])
        if center is None or np.linalg.norm(place - center) > 0.1 * r:
            yield _capsule(place, place, 1.3 * r, light)


def _around(picture: Scene, r: float) -> Iterator[Facets]:
    """Wheels, balls and blades."""
    for wheel in picture.around.wheels:
        radius, spoke, axle = wheel.radius[0], wheel.spoke[0], wheel.axle[0]
        turn = np.column_stack([spoke, np.cross(axle, spoke), axle])
        shade, second = (_mixed(color(wheel.name), tone(PAPER), share) for share in (0.0, 0.5))
        yield _placed(
            "wheel", np.array([radius, radius, max(0.05 * radius, 0.3 * r)]), wheel.center[0], turn, shade, second
        )
    for ball in picture.around.balls:
        yield _capsule(
            ball.center[0], ball.center[0], float(ball.radius[0]), _mixed(color(ball.name), tone(PAPER), 0.0)
        )
    for blade in picture.around.blades:
        ink = _mixed(tone(INK), tone(PAPER), 0.0)
        yield _placed("box", r * np.array([0.5, 0.9, 4.4]), blade.place[0], _along(blade.along[0]), ink, ink)


def _placed(kind: str, half: Vector, center: Vector, turn: Matrix, first: Vector, second: Vector) -> Facets:
    form = mesh(kind)
    places = center + (form.at * half) @ turn.T
    return Facets(places[form.faces], np.where(form.marked[:, None], second, first))


def _within(a: Vector, b: Vector, radius: float) -> tuple[Vector, Vector]:
    """Ends of a capsule that reaches no farther than from a to b."""
    length = float(np.linalg.norm(b - a))
    cut = min(radius, 0.45 * length) / length if length > 0.0 else 0.0
    return a + cut * (b - a), b - cut * (b - a)


def _capsule(a: Vector, b: Vector, r: float, shade: Vector) -> Facets:
    form, length = mesh("capsule"), float(np.linalg.norm(b - a))
    local = r * form.normal + 0.5 * length * (form.at - form.normal)
    turn = _along((b - a) / length if length > 1e-12 else np.array([0.0, 1.0, 0.0]))
    places = 0.5 * (a + b) + local @ turn.T
    return Facets(places[form.faces], np.tile(shade, (len(form.faces), 1)))


def _along(z: Vector) -> Matrix:
    """A rotation whose third column is along a direction."""
    z = z / np.linalg.norm(z)
    x = np.cross([1.0, 0.0, 0.0] if abs(z[0]) < 0.6 else [0.0, 1.0, 0.0], z)
    x = x / np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _mixed(first: str, second: str, share: float) -> Vector:
    from matplotlib.colors import to_rgb

    return (1.0 - share) * np.array(to_rgb(first)) + share * np.array(to_rgb(second))


def shaded(found: Facets, rows: Matrix, longest: float, closed: bool = True) -> tuple[NDArray[np.float64], Any]:
    """Facets to paint in this order: corners in the picture (n, 3, 2) and colors (n, 3).

    rows : the camera; longest : edges are halved until they are shorter [m]; closed : whether those that look away are
    hidden by others. Light comes from above and some from the viewer.
    """
    corners, tint = found.corners, found.color
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.where(size > 0.0, size, 1.0)
    facing = normals @ rows[2]
    upwards = np.where(facing < 0.0, -1.0, 1.0) * normals[:, 1]
    light = 0.56 + 0.17 * (1.0 + upwards) + 0.2 * np.abs(facing)
    tint = np.clip(tint * light[:, None], 0.0, 1.0)
    seen = facing > 0.0 if closed else np.ones(len(corners), dtype=bool)
    corners, tint = _halved(corners[seen] @ rows.T, tint[seen], longest)
    order = np.argsort(corners[:, :, 2].mean(axis=1), kind="stable")
    return corners[order, :, :2], tint[order]


def _halved(corners: NDArray[np.float64], tint: Matrix, longest: float) -> tuple[NDArray[np.float64], Matrix]:
    """Facets cut across their longest edge until none is longer; twelve times at most."""
    for _ in range(12):
        edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        long = edges.max(axis=1) > longest
        if not long.any():
            break
        first = np.argmax(edges[long], axis=1)[:, None]
        a, b, c = (corners[long][np.arange(len(first))[:, None], (first + k) % 3][:, 0] for k in range(3))
        middle = 0.5 * (a + b)
        cut = [np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)]
        corners, tint = np.concatenate([corners[~long], *cut]), np.concatenate([tint[~long], tint[long], tint[long]])
    return corners, tint
