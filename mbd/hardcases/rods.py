"""A rod dropped on one end (g4)."""

import math
from functools import cache
from typing import Any

import numpy as np

import mbd
from mbd.equal import ROUND_OFF_RTOL
from mbd.hardcases.case import Curve, Figure, Outcome, hard_case
from mbd.hardcases.impacts import deepest, impact_figures
from mbd.hardcases.references import accuracy, numbers, published, size

KINDS = ("frictionless", "sticking")
"""The two laws at the end that strikes, in the order of the reference energies."""


@cache
def rod(L: float, m: float, g: float, e: float, kind: str) -> mbd.Model:
    """A uniform rod along its own x; 'place' is that of its middle.

    An end that is 'held' sticks, and may pull, until the other end strikes. An end that is 'sticking' may not pull:
    after the impact the spin would pull it off the floor if it stuck, and the rod would fall through if it did not,
    so that no force continues the motion; the impact itself is the same.
    """
    model = mbd.Model("rod", gravity=(0.0, -g, 0.0))
    body = mbd.RigidBody("rod", mass=m, inertia=m * L * L / 12.0)
    model.connect(mbd.Planar("place", model.ground.origin, body.origin))
    friction = 0.0 if kind == "frictionless" else None
    release = mbd.When("upper end") if kind == "held" else None
    lower, upper = (mbd.touchdown(body.point(x, 0.0)) for x in (-0.5 * L, 0.5 * L))
    model.constrain(
        mbd.Unilateral("lower end", lower, restitution=e, friction=friction, release=release),
        mbd.Unilateral("upper end", upper, restitution=e, friction=friction),
    )
    return model


def drop(id: str, kind: str, scheme: Any) -> tuple[mbd.Model, Any]:
    """The rod until its lower end has struck."""
    given = numbers(id)
    L, angle, height = given["L"], given["theta_from_horizontal"], given["drop_height_of_lower_end"]
    model = rod(L, given["m"], given["g"], given["e"], kind)
    start = mbd.assemble(model, position={"place.y": height + 0.5 * L * math.sin(angle), "place.angle": angle})
    time = published(id, "impact time")
    until = ("lower end", 3.0 * time)
    return model, mbd.simulate(model, start, scheme, dt=time / 25.3, until=until, on_failure="return")


def law_figures(id: str, kind: str, scheme: Any) -> list[Figure]:
    """What holds where the end slides freely, or sticks."""
    time = published(id, "impact time")
    _, run = drop(id, kind, scheme)
    name = f"{kind}: [vx, vz, omega] after"
    # where no force lets the end stick after the impact, the run stops before it, and tells what it took back
    last, events = (run.failure.candidate, run.failure.undone) if run.failure else (run.final, run.events)
    final = np.array([last[f"place.{part}.rate"] for part in ("x", "y", "angle")])
    event = next(each for each in events if each.name == "lower end")
    scale = size(published(id, name))
    is_named = run.success or "'lower end'" in run.message
    figures = [
        Figure(f"{kind}: failures that do not name the end [-]", float(not is_named), 0.0),
        Figure(
            f"{kind}: error of the impact time [s]",
            abs(event.time - time), accuracy(id, "impact time") + ROUND_OFF_RTOL * time,
        ),
        Figure(
            f"{kind}: error of the velocity after [m/s, rad/s]",
            size(final - published(id, name)), accuracy(id, name) + ROUND_OFF_RTOL * scale,
        ),
    ]  # fmt: skip
    if kind == "sticking":
        along, up = published(id, "sticking impulse")
        off = [event.impulse[0] - up, event.impulse[1] - along]
        limit = accuracy(id, "sticking impulse") + ROUND_OFF_RTOL * up
        figures.append(Figure(f"{kind}: error of the impulse [N s]", size(off), limit))
    return figures


def impact_of(id: str, kind: str, scheme: Any) -> tuple[list[Figure], Any]:
    """Energy, momentum and complementarity of the impact of an end that slides, or sticks and may pull later."""
    model, run = drop(id, "held" if kind == "sticking" else kind, scheme)
    wanted = published(id, "kinetic energy after")[KINDS.index(kind)]
    off = abs(run.energy.kinetic[-1] - wanted)
    figures = [
        Figure("error of the kinetic energy after [J]", off, accuracy(id, "kinetic energy after")),
        Figure("penetration [m]", deepest(run), 1e-10),
        *impact_figures(model, run),
    ]
    return [Figure(f"{kind}: {each.what}", each.value, each.limit) for each in figures], run


def dropped(id: str, scheme: Any) -> Outcome:
    """The oblique impact of one end, without friction and sticking."""
    figures: list[Figure] = []
    curves = []
    for kind in KINDS:
        found, run = impact_of(id, kind, scheme)
        figures += [*law_figures(id, kind, scheme), *found]
        curves.append(Curve(f"kinetic energy, {kind}", run.time, run.energy.kinetic, y_label="energy [J]"))
    return Outcome(figures, curves)


CASES = (
    hard_case(
        "g4-dropped-rod",
        "The oblique impact of one end turns the rod as the impulse balance says, frictionless and sticking.",
        dropped,
    ),
)
