"""What the page of a spatial mechanism holds beside that of a planar one: solids, hinges, surfaces, axes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Vector
from mbd.view.camera import VIEWS
from mbd.view.first_view import first_view
from mbd.view.forms import mesh
from mbd.view.packing import finite, packed, side
from mbd.view.scene import Scene
from mbd.view.scenery import SURFACE_LINES, Sheet

__all__ = ["TURN_STEP", "space", "surface"]

TURN_STEP = 1e-4
"""Steps of directions and quaternions [-]."""


def space(picture: Scene, step: float) -> dict[str, Any]:
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


def surface(sheet: Sheet, upwards: Vector, step: float) -> dict[str, Any]:
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
