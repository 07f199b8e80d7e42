"""The scene of a page as plain lists."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix
from mbd.view.packing import QUANTIZATION_STEPS, finite, packed, side, step_of
from mbd.view.scene import Scene
from mbd.view.scenery import Sheet
from mbd.view.space import TURN_STEP, space, surface

__all__ = ["geometry"]


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
        **(space(picture, step) if picture.spatial else {}),
    }  # fmt: skip


def _scenery(picture: Scene, axes: int, step: float) -> dict[str, Any]:
    """Grounds that move, height functions, wheels, balls, blades."""
    around = picture.around

    def series(places: Matrix, fine: float) -> list[dict[str, Any]]:
        return [packed(places[:, axis], fine) for axis in range(axes)]

    def sheet_of(sheet: Sheet) -> dict[str, Any]:
        return surface(sheet, picture.turn[:, 1], step) if picture.spatial else _sheet(sheet, step)

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
