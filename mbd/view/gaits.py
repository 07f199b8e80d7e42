"""Pictures of gaits: their cycle in the phase plane, and their multipliers beside the unit circle."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.gait.branch import Branch
from mbd.gait.cycle import LimitCycle
from mbd.gait.follow import PointCurve
from mbd.joints.reflected import exchanged
from mbd.results.interpolation import Grid
from mbd.results.trajectory import Trajectory
from mbd.view.curves import curves
from mbd.view.plots import drawing
from mbd.view.style import CYCLE, INK, NEUTRAL, as_label, tone

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MARKS = {
    "fold": "s", "doubling": "o", "torus": "^", "branch point": "D", "scuff": "X", "graze": "X", "release": "v",
    "slip": ">", "pull": "v", "new event": "P", "lost event": "P", "fall": "*",
}  # fmt: skip
"""How special points of branches are marked."""
UNITS = {"period": "s", "distance": "m", "speed": "m/s"}
AT_POINT = {
    "period": lambda point: point.period, "distance": lambda point: point.distance, "speed": lambda point: point.speed,
    "largest multiplier": lambda point: point.multipliers.largest,
}  # fmt: skip
"""Quantities of a branch at one of its points."""
MAX_DRAWN_MODULUS = 3.0
"""Modulus beyond which a multiplier is drawn at the edge of the picture [-]."""


def cycle(gait: LimitCycle, path: str | Path | None = None) -> Figure:
    """Each angle's rate against the angle over one period, in degrees, jumps dotted; the multipliers.

    Of orientations the parts of the rotation vector, and of the angular velocity in the same axes of the child.

    Of a walk that is mirrored each step, both sides of one step are one side over a stride: they have one color.
    """
    run = gait.run
    angles = _angles(run)
    time, values = curves(run, [part for pair in angles.items() for part in pair])
    shades: dict[str, str] = {}
    with drawing(path, 7.4, 3.6) as figure:
        left, right = figure.subplots(1, 2, width_ratios=[1.5, 1.0])
        for name, of_name in angles.items():
            partner = name if gait.mirror is None else exchanged(name, gait.mirror)
            first = partner not in shades
            shade = shades.setdefault(name, shades.get(partner, CYCLE[len(shades) % len(CYCLE)]))
            label = as_label(name if partner == name else f"{name}, then {partner}") if first or partner == name else ""
            place, rate = (180.0 / np.pi * values[each] for each in (name, of_name))
            for start, stop in pairwise(Grid(time).cuts):
                left.plot(place[start:stop], rate[start:stop], color=tone(shade), label=label or None)
                left.plot(place[stop - 1 : stop + 1], rate[stop - 1 : stop + 1], ":", color=tone(shade))
                label = ""
            left.plot(place[:1], rate[:1], "o", color=tone(shade), markersize=4)
        left.set_xlabel("angle [°]")
        left.set_ylabel("rate [°/s]")
        if angles:
            left.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=1, borderaxespad=0.2)
        _multipliers(right, gait)
    return figure


def _angles(run: Trajectory) -> dict[str, str]:
    """Angles with their rates; of orientations the parts of the rotation vector, with the angular velocity there."""
    coordinates = run.facts.coordinates[: run.facts.coordinate_count]
    found = {name: f"{name}.rate" for name, kind in coordinates if kind == "rad" and f"{name}.rate" in run}
    joints = [name.removesuffix(".orientation.w") for name, _ in coordinates if name.endswith(".orientation.w")]
    found |= {f"{j}.rotation_vector.{axis}": f"{j}.angular_velocity.{axis}" for j in joints for axis in "xyz"}
    return dict(list(found.items())[:6])  # angles that the phase plane shows


def _multipliers(axes: Any, gait: LimitCycle) -> None:
    """The multipliers in the complex plane."""
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    axes.plot(np.cos(turn), np.sin(turn), color=tone(NEUTRAL), linewidth=0.8)
    sizes = np.abs(gait.multipliers)
    near = sizes <= MAX_DRAWN_MODULUS
    for part, shade in ((sizes < 1.0, CYCLE[2]), ((sizes >= 1.0) & near, CYCLE[1])):
        axes.plot(gait.multipliers.real[part], gait.multipliers.imag[part], "o", color=tone(shade), markersize=5)
    for value in gait.multipliers[~near]:  # at the edge, with what it is
        place = MAX_DRAWN_MODULUS * value / abs(value)
        axes.plot(place.real, place.imag, "D", color=tone(CYCLE[1]), markersize=5)
        text = f"{value.real:.4g}" if value.imag == 0.0 else f"{abs(value):.4g}"
        axes.annotate(text, (place.real, place.imag), (0, 6), textcoords="offset points", ha="center", color=tone(INK))
    axes.set_aspect("equal")
    axes.set_xlabel("real part")
    axes.set_ylabel("imaginary part")
    axes.set_title(f"multipliers: {gait.stability}", color=tone(INK))


def branch(found: Branch, quantity: str, path: str | Path | None = None) -> Figure:
    """A quantity over the parameter: stable gaits solid, unstable ones dashed, special points marked by kind."""
    values, heights, stable = found[found.parameter], found[quantity], np.array([each.stable for each in found.curve])
    with drawing(path, 6.4, 4.0) as figure:
        axes = figure.subplots()
        shade = tone(CYCLE[0])
        solid = stable[:-1] & stable[1:]
        cuts = [0, *(np.flatnonzero(solid[1:] != solid[:-1]) + 1), len(solid)]
        for first, last in pairwise(cuts):
            piece = slice(first, last + 1)
            axes.plot(values[piece], heights[piece], "-" if solid[first] else "--", color=shade)
        for number, kind in enumerate(dict.fromkeys(point.kind for point in found.special), start=1):
            points = [point for point in found.special if point.kind == kind]
            place = [point.value for point in points]
            height = [np.nan if quantity not in AT_POINT else AT_POINT[quantity](point.point) for point in points]
            axes.plot(place, height, MARKS.get(kind, "o"), color=tone(CYCLE[number]), label=kind, markersize=6)
        axes.set_xlabel(as_label(found.parameter))
        axes.set_ylabel(as_label(quantity if quantity not in UNITS else f"{quantity} [{UNITS[quantity]}]"))
        if found.special:
            axes.legend()
    return figure


def point_curve(found: PointCurve, path: str | Path | None = None) -> Figure:
    """The parameter of the branch at special points over the second parameter."""
    first, second = found.parameters
    with drawing(path, 6.4, 4.0) as figure:
        axes = figure.subplots()
        axes.plot(found[second], found[first], "-", color=tone(CYCLE[0]))
        axes.plot(found[second], found[first], MARKS.get(found.kind, "o"), color=tone(CYCLE[1]), markersize=4,
                  label=f"{found.kind} of {found.what}" if found.what else found.kind)  # fmt: skip
        axes.set_xlabel(as_label(second))
        axes.set_ylabel(as_label(first))
        axes.legend()
    return figure
