"""A double pendulum whose tip hits a wall (g5)."""

import math
from functools import cache, partial
from typing import Any

import numpy as np

import mbd
from mbd.arrays import Vector
from mbd.hardcases.case import Curve, Figure, Outcome, hard_case
from mbd.hardcases.convergence import study
from mbd.hardcases.impacts import deepest, impact_figures
from mbd.hardcases.references import limits_of, numbers, published, size


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


def model_of(id: str, cut: str = "auto") -> mbd.Model:
    """That of a case."""
    given = numbers(id)
    m, L = ((float(given[f"{name}1"]), float(given[f"{name}2"])) for name in ("m", "L"))
    return double_pendulum(m, L, float(given["g"]), float(given["xw"]), float(given["e"]), cut)


def swing(id: str, scheme: Any, dt: float, cut: str = "auto") -> Any:
    """The run a little beyond the last published impact."""
    given, model = numbers(id), model_of(id, cut)
    start = mbd.assemble(
        model,
        position={"pin.angle": given["theta1"], "elbow.angle": given["theta2"] - given["theta1"]},
        velocity={"pin.angle": given["w1"], "elbow.angle": given["w2"] - given["w1"]},
    )
    return mbd.simulate(model, start, scheme, dt=dt, until=1.02 * published(id, "tip impact times")[-1])


def errors_of(id: str, run: Any) -> dict[str, Vector]:
    """Errors at the impacts of one run, by what they are of; none where there are other impacts."""
    times = published(id, "tip impact times")
    events = [event for event in run.events if event.name == "wall"]
    if len(events) != len(times):
        return {}
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
    return dict(zip(LIMITS, errors, strict=True))


LIMITS = {
    "error of the impact times [s]": ("tip impact times", 2e-5),
    "error of the states after the impacts [rad, rad/s]": ("[theta1, theta2, w1, w2] just after", 1e-4),
    "error of the impulses [N s]": ("impulse magnitudes", 1e-4),
    "error of the clearance of the elbow [m]": ("clearance", 1e-4),
}
"""The reference of each error, and the most it may be at the finest step over the largest value."""


def tip(id: str, scheme: Any) -> Outcome:
    """Impacts to second order in tree and in absolute coordinates; impulses are impulses, rows hold after them."""
    period = 2.0 * math.pi * math.sqrt((numbers(id)["L1"] + numbers(id)["L2"]) / numbers(id)["g"])
    found = study(lambda dt: swing(id, scheme, dt), partial(errors_of, id), period / 1600.0, scheme, 2)
    run, reactions = found.finest, [size(each["pin.reaction_force"]) for each in found.runs]
    times = "error of the impact times [s]"
    figures = [
        *found.figures(*limits_of(id, LIMITS)),
        Figure("force of the wall between impacts [N]", size(run["wall.force"]), 0.0),
        Figure(
            "growth of the largest reaction as dt is quartered − 1 [-]", abs(reactions[-1] / reactions[0] - 1.0), 0.05
        ),
        Figure("penetration [m]", deepest(run), 1e-10),
        *impact_figures(model_of(id), run),
        *rows_after(id, scheme, float(found.steps[0]), size(found.errors[times][0])),
    ]
    return Outcome(
        figures,
        [
            Curve("distance of the tip from the wall", run.time, run["wall.gap"], y_label="gap [m]"),
            found.curve(times),
        ],
    )


def rows_after(id: str, scheme: Any, dt: float, tree: float) -> list[Figure]:
    """With all joints cut into rows: these hold after each impact, which comes at the instant of the tree's errors."""
    run, model = swing(id, scheme, dt, "all"), model_of(id, "all")
    off = size(errors_of(id, run).get("error of the impact times [s]", math.nan))
    rows = [event.row for event in run.events if event.name == "wall"]
    gaps = run["upper.end"] - run["lower.start"]
    slip = [run[f"upper.end.v{axis}"] - run[f"lower.start.v{axis}"] for axis in "xy"]
    return [
        Figure("joints cut: opening of the elbow after impacts [m]", size(gaps[rows]), 1e-10),
        Figure("joints cut: slip of the elbow after impacts [m/s]", size([each[rows] for each in slip]), 1e-10),
        Figure(
            "joints cut: error of the impact times over that in tree coordinates [-]",
            off / max(tree, 1e-12), 3.0,
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
