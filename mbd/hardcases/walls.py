"""A double pendulum whose tip hits a wall (g5)."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np

import mbd
from mbd.arrays import Vector
from mbd.hardcases.case import Curve, Figure, Outcome, hard_case
from mbd.hardcases.convergence import error_curve, halved, second_order
from mbd.hardcases.impacts import deepest, impact_figures
from mbd.hardcases.references import accuracy, numbers, published, size

__all__ = ["CASES"]


@cache
def double_pendulum(
    m: tuple[float, float], L: tuple[float, float], g: float, xw: float, e: float, cut: str
) -> mbd.Model:
    """Uniform rods; the tip slides freely on the wall x = xw."""
    model = mbd.Model("double pendulum", gravity=(0.0, -g, 0.0), cut=cut)
    upper, lower = (
        mbd.Link(name, mass, length=length, center=0.5 * length, inertia=mass * length**2 / 12.0)
        for name, mass, length in zip(("upper", "lower"), m, L, strict=True)
    )
    model.connect(mbd.Revolute("pin", model.ground.origin, upper.start), mbd.Revolute("elbow", upper.end, lower.start))
    wall = mbd.touchdown(lower.end, mbd.Plane((-1.0, 0.0, 0.0), -xw))
    model.constrain(mbd.Unilateral("wall", wall, restitution=e, friction=0.0))
    return model


def swing(id: str, scheme: Any, dt: float, cut: str) -> tuple[mbd.Model, Any]:
    """The run a little beyond the last published impact."""
    given = numbers(id)
    m, L = ((float(given[f"{name}1"]), float(given[f"{name}2"])) for name in ("m", "L"))
    model = double_pendulum(m, L, float(given["g"]), float(given["xw"]), float(given["e"]), cut)
    start = mbd.assemble(
        model,
        position={"pin.angle": given["theta1"], "elbow.angle": given["theta2"] - given["theta1"]},
        velocity={"pin.angle": given["w1"], "elbow.angle": given["w2"] - given["w1"]},
    )
    return model, mbd.simulate(model, start, scheme, dt=dt, until=1.02 * published(id, "tip impact times")[-1])


def swing_errors(id: str, run: Any) -> dict[str, Vector]:
    """Errors at the impacts of one run, by what they are of."""
    times = published(id, "tip impact times")
    events = [event for event in run.events if event.name == "wall"]
    if len(events) != len(times):
        return dict.fromkeys(SWING_LIMITS, np.array([math.nan]))
    rows = [event.row for event in events]
    pin, elbow = run["pin.angle"][rows], run["elbow.angle"][rows]
    w, u = run["pin.angle.rate"][rows], run["elbow.angle.rate"][rows]
    states = np.stack([pin, pin + elbow, w, w + u], axis=1)
    clearance = numbers(id)["xw"] - run["upper.end.x"][rows]
    errors = (
        [event.time for event in events] - times,
        (states - published(id, "[theta1, theta2, w1, w2] just after")).ravel(),
        np.array([event.impulse[0] for event in events]) - published(id, "impulse magnitudes"),
        clearance - published(id, "clearance of the middle joint"),
    )
    return dict(zip(SWING_LIMITS, errors, strict=True))


SWING_LIMITS = {
    "the impact times [s]": 2e-5, "the states after the impacts [rad, rad/s]": 1e-4, "the impulses [N s]": 1e-4,
    "the clearance of the elbow [m]": 1e-4,
}  # fmt: skip
"""The most that is off at the finest step, over the largest value."""

SWING_VALUES = ("tip impact times", "[theta1, theta2, w1, w2] just after", "impulse magnitudes", "clearance")


def tip(id: str, scheme: Any) -> Outcome:
    """Impacts to second order in tree and in absolute coordinates; impulses are impulses, rows hold after them."""
    period = 2.0 * math.pi * math.sqrt((numbers(id)["L1"] + numbers(id)["L2"]) / numbers(id)["g"])
    steps = halved(period / 1600.0)
    figures: list[Figure] = []
    errors: list[dict[str, Vector]] = []
    reactions = []
    for dt in steps:
        model, run = swing(id, scheme, float(dt), "auto")
        errors.append(swing_errors(id, run))
        reactions.append(size(run["pin.reaction_force"]))
    for (what, limit), name in zip(SWING_LIMITS.items(), SWING_VALUES, strict=True):
        most, floor = limit * size(published(id, name)), 10.0 * accuracy(id, name)
        figures += second_order(f"error of {what}", steps, [each[what] for each in errors], most, floor,
                                order=scheme.order())  # fmt: skip
    figures += [
        Figure("force of the wall between impacts [N]", size(run["wall.force"]), 0.0),
        Figure(
            "growth of the largest reaction as dt is quartered − 1 [-]", abs(reactions[-1] / reactions[0] - 1.0), 0.05
        ),
        Figure("penetration [m]", deepest(run), 1e-10),
        *impact_figures(model, run),
        *rows_after(id, scheme, float(steps[0]), errors[0]),
    ]
    return Outcome(
        figures,
        [
            Curve("distance of the tip from the wall", run.time, run["wall.gap"], y_label="gap [m]"),
            error_curve(
                "error of the impact times", steps, [each["the impact times [s]"] for each in errors], "error [s]"
            ),
        ],
    )


def rows_after(id: str, scheme: Any, dt: float, tree: dict[str, Vector]) -> list[Figure]:
    """With all joints cut into rows: these hold after each impact, which comes at the instant of the tree's errors."""
    model, run = swing(id, scheme, dt, "all")
    found = swing_errors(id, run)
    rows = [event.row for event in run.events if event.name == "wall"]
    gaps = run["upper.end"] - run["lower.start"]
    slip = [run[f"upper.end.v{axis}"] - run[f"lower.start.v{axis}"] for axis in "xy"]
    size_of = max(size(tree["the impact times [s]"]), 1e-12)
    return [
        Figure("joints cut: opening of the elbow after impacts [m]", size(gaps[rows]), 1e-10),
        Figure("joints cut: slip of the elbow after impacts [m/s]", size([each[rows] for each in slip]), 1e-10),
        Figure(
            "joints cut: error of the impact times over that in tree coordinates [-]",
            size(found["the impact times [s]"]) / size_of, 3.0,
        ),
        *(Figure(f"joints cut: {each.what}", each.value, each.limit) for each in impact_figures(model, run)),
    ]  # fmt: skip


CASES = (
    hard_case(
        "g5-double-pendulum-wall",
        "Tip impacts at the reference instants to second order; an impulse is an impulse, and all rows hold after it.",
        tip,
    ),
)
