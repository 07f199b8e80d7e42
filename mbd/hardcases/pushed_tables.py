"""A table on four legs with friction, which more legs hold than are needed: p6."""

from math import cos, sin
from typing import Any

import numpy as np

import mbd
from mbd.hardcases.case import Curve, Figure, HardCase, Outcome, definition
from mbd.hardcases.references import size
from mbd.hardcases.schemes import EVERY

P6 = "p6-four-legged-table-pushed"
ORDERS = ((0, 1, 2, 3), (2, 0, 3, 1))
"""Orders in which the legs are given."""


def pushed_table(order: tuple[int, ...] = ORDERS[0]) -> tuple[mbd.Model, mbd.State]:
    """A table that a growing push makes slide; neither the loads of its legs nor their frictions are determined."""
    case = definition(P6)
    numbers, largest = case["definition"], case["quantities"][0]["value"]
    model = mbd.Model("table", gravity=(0.0, 0.0, -numbers["g"]))
    table = mbd.RigidBody("table", numbers["M"], tuple(numbers["I"]))
    model.connect(mbd.Free("place", model.ground.origin, table.origin))
    for k in order:
        x, y = numbers["legs"][k]
        leg = mbd.touchdown(table.point(x, y, -numbers["height"]), mbd.Plane(normal=(0.0, 0.0, 1.0)))
        model.constrain(mbd.Unilateral(f"leg {k}", leg, friction=numbers["mu"]))
    way = cos(numbers["push_angle"]), sin(numbers["push_angle"])

    def push(t: Any) -> Any:
        size = largest * (numbers["first"] + numbers["rate"] * t)
        return size * way[0], size * way[1], 0.0

    model.apply(mbd.Applied("push", table.point(*numbers["push_point"]), force=push))
    legs = [f"leg {k}" for k in order]
    return model, mbd.assemble(model, position={"place.z": numbers["height"]}, closed=legs)


def judge_pushed_table(integrator: Any) -> Outcome:
    """It rests until the largest push that friction bears in any way, whatever the order of its legs, then slides."""
    numbers = definition(P6)["definition"]
    onset = (1.0 - numbers["first"]) / numbers["rate"]
    runs = [
        mbd.simulate(*pushed_table(order), integrator, dt=numbers["dt"], until=numbers["until"]) for order in ORDERS
    ]
    run = runs[0]
    slips = [next(event.time for event in each.events if event.kind == "slipped") for each in runs]
    before = run.t < slips[0]
    outside = max(
        float(np.max(np.hypot(run[f"leg {k}.friction.forward"], run[f"leg {k}.friction.sideways"])
                     - numbers["mu"] * run[f"leg {k}.force"]))
        for k in range(4)
    )  # fmt: skip
    ends = [np.array([each["place.x"][-1], each["place.y"][-1]]) for each in runs]
    moved = float(np.linalg.norm(ends[0]))
    figures = [
        Figure("error of the instant at which it slides [s]", max(abs(t - onset) for t in slips), 1e-8),
        Figure("moved before [m]", float(np.max(np.hypot(run["place.x"], run["place.y"])[before])), 1e-12),
        Figure("friction outside of its cones [N]", outside, 1e-8),
        Figure("change with the order of the legs [m]", size(ends[0] - ends[1]), 1e-3 * moved),
    ]
    return Outcome(figures, [Curve("way of the table", run.t, np.hypot(run["place.x"], run["place.y"]), y_label="[m]")])


CASES = (
    HardCase(
        P6, "A table on four legs rests until the largest push that friction bears in any way, and slides then.",
        judge_pushed_table, EVERY,
    ),
)  # fmt: skip
