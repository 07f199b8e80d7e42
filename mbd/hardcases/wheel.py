"""A wheel that rolls down a slope without slip: d3."""

import math
import re
from typing import Any

import numpy as np

import mbd
from mbd.hardcases.case import Curve, Figure, HardCase, Outcome, definition
from mbd.hardcases.convergence import EPS
from mbd.hardcases.references import quantity, size
from mbd.hardcases.schemes import EVERY

D3 = "d3-rolling-wheel"
STEPS = (0.5, 0.1, 0.013, 0.001)
"""Of very different sizes, one that does not divide the time [s]."""


def rolling_wheel(held: str = "row", case: str = D3) -> mbd.Model:
    """The wheel, kept on its road by a 'row' or by a 'contact' that could open.

    x points down the slope. The name of the place is 'roll.x', of the angle 'roll.angle', of the tyre 'tyre'.
    """
    numbers = definition(case)["definition"]
    inertia, radius = numbers["J"], numbers["R"]
    model = mbd.Model("wheel", gravity=mbd.on_slope(numbers["slope"], numbers["g"]))
    wheel = mbd.RigidBody("wheel", numbers["m"], (0.5 * inertia, 0.5 * inertia, inertia))
    roll = mbd.Planar("roll", model.ground.origin, wheel.origin)
    model.connect(roll)
    if numbers["drive_torque"]:
        model.apply(mbd.Applied("drive", wheel.origin, torque=(0.0, 0.0, -numbers["drive_torque"])))
    height = mbd.touchdown(wheel.origin, mbd.Plane(offset=radius))
    model.constrain(
        mbd.Bilateral("road", height) if held == "row" else mbd.Unilateral("road", height, friction=0),
        mbd.Rolling("tyre", wheel.origin, radius),
    )
    return model


def _end() -> float:
    """The time at which the reference tells the place, which stands in its name: 'x(3 s)'."""
    names = " ".join(entry["name"] for entry in definition(D3)["quantities"])
    found = re.search(r"x\(([\d.]+) s\)", names)
    assert found is not None
    return float(found[1])


def judge_wheel(integrator: Any) -> Outcome:
    """Constant acceleration, which every scheme of the family integrates exactly: round-off at any step."""
    values = {name: quantity(D3, name) for name in ("acceleration", "friction force", "x(", "wheel angle", "minimum")}
    until = _end()
    worst = dict.fromkeys(values, 0.0)
    slip, opened = 0.0, 0
    curves = []
    for held in "row", "contact":
        model = rolling_wheel(held)
        start = mbd.assemble(model, closed=["road"] if held == "contact" else [])
        for dt in STEPS:
            run = mbd.simulate(model, start, integrator, dt=dt, until=until)
            normal = run["road.force"] if held == "contact" else -run["road.multiplier"]
            found = {
                "acceleration": run["roll.x.acceleration"],
                "friction force": run["tyre.force"],
                "x(": run["roll.x"][-1],
                "wheel angle": -run["roll.angle"][-1],
                "minimum": np.abs(run["tyre.force"]) / normal,
            }
            for name, value in found.items():
                worst[name] = float(np.maximum(worst[name], np.max(np.abs(value - values[name].value))))
            slip = max(slip, size(run["tyre.residual"]))
            opened += len(run.events)
            curves.append(Curve(f"speed, {held}, dt = {dt:g} s", run.time, run["roll.x.rate"], y_label="speed [m/s]"))
    numbers = definition(D3)["definition"]
    count, scale, speed = until / min(STEPS), float(values["x("].value), until * float(values["acceleration"].value)
    # places gather round-off once a step, forces are differences of speeds over dt
    length = EPS * scale * count
    force = max(50.0, 5.0 * math.sqrt(count)) * EPS * numbers["m"] * speed / min(STEPS)
    limits = {"acceleration": force / numbers["m"], "friction force": force, "x(": length,
              "wheel angle": length / numbers["R"], "minimum": force / (numbers["m"] * numbers["g"])}  # fmt: skip
    what = {"x(": "place at the end [m]", "acceleration": "acceleration [m/s²]", "friction force": "friction force [N]",
            "wheel angle": "angle at the end [rad]", "minimum": "least friction coefficient [-]"}  # fmt: skip
    figures = [Figure(f"error of the {what[name]}, worst of all steps", worst[name], limits[name]) for name in worst]
    figures += [Figure("slip [m/s]", slip, 1e-10), Figure("switches of the road", opened, 0)]
    return Outcome(figures, curves[:1])


CASES = (
    HardCase(
        D3,
        "A rolling wheel is exact to round-off at any step, held by a row or by a contact.",
        judge_wheel,
        EVERY,
    ),
)
