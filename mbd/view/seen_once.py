"""What two words describe is drawn once: a body of some inertia that also rolls as a wheel or touches as a ball."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from mbd.arrays import Matrix
from mbd.equal import NOMINAL_RTOL
from mbd.view.scenery import Ball, Scenery, Wheel
from mbd.view.solids import Solid, rotations

__all__ = ["once", "solid_ones"]

MIN_DENSITY = 1.2
"""Density below which a solid is none that anyone builds [kg/m³]."""

RADIUS_RTOL = 0.02
"""Radii that differ less, over the radius, are one [-]."""


def once(around: Scenery, solids: tuple[Solid, ...]) -> tuple[Scenery, tuple[Solid, ...]]:
    """Without the wheels and balls that solids of equal radius show, and without the solids that others stand for.

    A solid has the inertia of its body, a wheel or a ball the radius with which it touches: where these differ, as of a
    wheel of a bicycle, whose mass is at its rim, or a ball that is heavier on one side, what touches is drawn, a ball
    with the tones of its body, by which turning shows.
    """
    hidden: set[str] = set()
    wheels = tuple(each for each in around.wheels if not _shown(each, solids, hidden))
    touching = {ball.name: own for ball in around.balls if (own := _body_of(ball, solids)) is not None}
    balls = tuple(ball for ball in around.balls if ball.name not in touching)
    whole = {own.name: own for own in touching.values()}
    return replace(around, wheels=wheels, balls=balls), tuple(
        whole.get(each.name, each) for each in solids if each.name not in hidden
    )


def _body_of(ball: Ball, solids: Iterable[Solid]) -> Solid | None:
    """The solid of a body that is a ball, in which its center of mass lies anywhere, with the radius that touches."""
    radius = float(ball.radius[0])
    for solid in solids:
        if solid.form.kind == "ball" and ball.name.startswith(f"{solid.name}.") and not np.any(ball.radius != radius):
            away = float(np.max(np.linalg.norm(solid.center - ball.center, axis=1)))
            if away <= NOMINAL_RTOL * radius and abs(float(solid.form.half[0]) - radius) < RADIUS_RTOL * radius:
                return solid
            if away < radius:
                return replace(solid, center=ball.center, form=replace(solid.form, half=np.full(3, radius)))
    return None


def solid_ones(solids: tuple[Solid, ...], points: Sequence[str], places: Matrix) -> tuple[Solid, ...]:
    """Without those that are lighter than air and larger than all other bodies together, which would hide these: of an
    inertia that was made up, such as that of a hip without mass.

    points : names of the points of the mechanism; places : theirs at one instant (P, 3) [m]
    """
    found = []
    for solid in solids:
        others = [k for k, point in enumerate(points) if point.rpartition(".")[0] != solid.name]
        size = float(np.max(np.ptp(places[others], axis=0), initial=0.0)) if others else 0.0
        if not (solid.density < MIN_DENSITY and 0.0 < size < 2.0 * float(np.max(solid.form.half))):
            found.append(solid)
    return tuple(found)


def _shown(wheel: Wheel, solids: Iterable[Solid], hidden: set[str]) -> bool:
    """Whether a solid shows it; one of another radius that lies in it is hidden instead."""
    radius = float(wheel.radius[0])
    for solid in solids:
        own = wheel.name.startswith(f"{solid.name}.")
        if not own or solid.form.kind != "cylinder" or not _along(wheel, solid):
            continue
        if float(np.max(np.abs(solid.center - wheel.center))) > NOMINAL_RTOL * radius:
            continue
        if abs(float(solid.form.half[0]) - radius) < RADIUS_RTOL * radius:
            return True
        hidden.add(solid.name)
    return False


def _along(wheel: Wheel, solid: Solid) -> bool:
    """Whether a wheel's axle is the axis of a cylinder."""
    return bool(abs(float(rotations(solid.turn[:1])[0][:, 2] @ wheel.axle[0])) > 1.0 - RADIUS_RTOL)
