"""Starts that contradict the rows, and loops that cannot close: j14 and j15."""

import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

import mbd
from mbd.hardcases.case import Curve, Figure, HardCase, Outcome, definition
from mbd.hardcases.references import Reference, quantity, size
from mbd.hardcases.schemes import DAMPED, EVERY

J14, J15 = "j14-inconsistent-initial", "j15-infeasible-constraints"
NUMBER = r"(-?[\d.]+(?:e[-+]?\d+)?)"
NUMBER_RTOL = 1e-5
"""Relative accuracy of a number in a message [-]."""


def bob(case: str = J14) -> mbd.Model:
    """A point mass held by the row ``(x² + y² − L²)/L`` [m], named 'rod'."""
    numbers = definition(case)["definition"]
    L = numbers["L"]
    model = mbd.Model("bob", gravity=(0.0, -numbers["g"], 0.0))
    mass = mbd.PointMass("bob", numbers["m"])
    model.connect(mbd.Translation("place", model.ground.origin, mass.origin))
    row = mbd.measure(lambda x, y: (x * x + y * y - L * L) / L, "place.x", "place.y")
    model.constrain(mbd.Bilateral("rod", row))
    return model


def _named(case: str = J14) -> dict[str, Any]:
    """The start as the definition gives it."""
    begin = definition(case)["initial_conditions"]
    return {
        "position": {"place.x": begin["x"], "place.y": begin["y"]},
        "velocity": {"place.x": begin["vx"], "place.y": begin["vy"]},
    }


def judge_inconsistent_start(integrator: Any) -> Outcome:
    """Refused with both residuals and the name; projected on request, telling how far; then free of transients."""
    model, named = bob(), _named()
    L = definition(J14)["definition"]["L"]
    found, found_rate = _residuals(model, named)
    position, velocity = quantity(J14, "position residual"), quantity(J14, "velocity residual")
    place, speed = (quantity(J14, f"mass-orthogonal projection of the {what}") for what in ("position", "velocity"))
    tension = quantity(J14, "tension")
    start = mbd.assemble(model, **named, project=True)
    moved = np.array([start.moved.get(name, math.nan) for name in ("place.x", "place.y", "place.x.rate",
                                                                   "place.y.rate")])  # fmt: skip
    change = np.concatenate([place.value, speed.value]) - [*named["position"].values(), *named["velocity"].values()]
    dt = 1e-3
    run = mbd.simulate(model, start, integrator, dt=dt, until=10 * dt)
    pull = 2.0 * run["rod.multiplier"]  # the row's gradient is 2 on the circle
    largest = float(start.moved[max(start.moved, key=lambda name: abs(start.moved[name]))])
    rate = 2.0 * float(velocity.value) / L
    return Outcome(
        [
            Figure("error of the position residual told [-]", _off(found, float(position.value) / L), NUMBER_RTOL),
            Figure("error of the velocity residual told [-]", _off(found_rate, rate), NUMBER_RTOL),
            Figure("error of the projected place [m]", _worst(start.q, place), place.accuracy),
            Figure("error of the projected velocity [m/s]", _worst(start.v, speed), speed.accuracy),
            Figure("error of the changes that the start tells [m, m/s]", size(moved - change), 1e-12),
            Figure("starts that do not print their largest change", float(f"{largest:.2g}" not in repr(start)), 0),
            Figure("error of the tension of the projected start [N]", abs(float(pull[0]) - float(tension.value)),
                   max(tension.accuracy, 1e-12)),
            Figure("change of the tension in ten steps [N]", size(pull - pull[0]), _transient(dt)),
        ],
        [Curve("tension from the projected start on", run.time, pull, y_label="tension [N]")],
    )  # fmt: skip


def _transient(dt: float) -> float:
    """Most that the pull may change in ten steps: gravity's own change and an index-3 transient of first order.

    From the inconsistent start it would be of the size residual/(β dt²), thousands of newtons.
    """
    numbers, begin = definition(J14)["definition"], definition(J14)["initial_conditions"]
    speed = math.hypot(begin["vx"], begin["vy"])
    return float(2.0 * 10 * dt * 3.0 * numbers["m"] * numbers["g"] * speed / numbers["L"])


def _residuals(model: mbd.Model, named: Mapping[str, Any]) -> tuple[float, float]:
    """Both residuals of 'rod' in the refusal, NaN where it does not tell them."""
    try:
        mbd.assemble(model, **named)
    except mbd.AssemblyError as error:
        found = re.search(rf"'rod'.*position residual {NUMBER} .*velocity residual {NUMBER} ", str(error))
        return (float(found[1]), float(found[2])) if found else (math.nan, math.nan)
    return math.nan, math.nan


def _off(found: float, value: float) -> float:
    return abs(found - value) / abs(value)


def _worst(found: Any, reference: Reference) -> float:
    return size(np.asarray(found) - reference.value)


def four_bar_that_cannot_close() -> mbd.Model:
    """Three links in a row between two points of the ground that are too far apart."""
    numbers = definition(J15)["definition"]
    model = mbd.Model("four-bar")
    links = [mbd.Link(f"link {k}", 1.0, length, 0.5 * length, length**2 / 12.0)
             for k, length in enumerate(numbers["links"])]  # fmt: skip
    frames = [model.ground.origin]
    for k, link in enumerate(links):
        model.connect(mbd.Revolute(f"pin {k}", frames[-1], link.start))
        frames.append(link.end)
    model.connect(mbd.Revolute("far pin", frames[-1], model.ground.point(numbers["ground"], 0.0, name="far end")))
    return model


def judge_infeasible(integrator: Any) -> Outcome:
    """No simulation starts: the error tells the smallest closure error, a joint of the loop, and the iterations."""
    model = four_bar_that_cannot_close()
    closure = quantity(J15, "smallest closure error")
    joints = {joint.name for joint in model.joints}
    pattern = (
        "constraints cannot be satisfied: closure error " + NUMBER + r" m at joint '([^']+)' after (\d+) iterations"
    )
    off, unnamed, begun = math.nan, 1.0, 1.0
    try:
        start = mbd.assemble(model)
        mbd.simulate(model, start, integrator, dt=1e-3, until=1e-2)
    except mbd.AssemblyError as error:
        begun = 0.0
        found = re.search(pattern, str(error))
        if found:
            off = _off(float(found[1]), float(closure.value))
            unnamed = float(found[2] not in joints or int(found[3]) < 1)
    return Outcome(
        [
            Figure("simulations that start", begun, 0),
            Figure("error of the closure error told, relative [-]", off, NUMBER_RTOL),
            Figure("errors without a joint of the loop and the iterations", unnamed, 0),
        ],
        [Curve("stretched links; the last part is missing", *_chain(), "x [m]", "y [m]")],
    )


def _chain() -> tuple[list[float], list[float]]:
    """Corners of the stretched links, and the pivot that they do not reach."""
    numbers = definition(J15)["definition"]
    x = [0.0, *np.cumsum(numbers["links"]), numbers["ground"]]
    return x, [0.0] * len(x)


CASES = (
    HardCase(J14, "A start off its rows is refused with residuals and name, or projected on request, never run.",
             judge_inconsistent_start, EVERY),
    HardCase(J15, "A loop that cannot close is refused with its closure error and the joint's name.",
             judge_infeasible, DAMPED[:1], notes={"schemes": "one is enough: it is refused before any would begin"}),
)  # fmt: skip
