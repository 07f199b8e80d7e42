"""A flyball governor whose rods are held by stiff spring-dampers: b5."""

import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

import mbd
from mbd.hardcases.case import Curve, Figure, HardCase, Outcome, definition
from mbd.hardcases.convergence import allowance, study
from mbd.hardcases.references import distance_to, quantity, size
from mbd.hardcases.schemes import is_explicit

B5 = "b5-iftomm-a05-flyball"
LARGE, LARGE_ERROR = 1e-2, 1e-3
"""A step [s] that must be taken without failure, and the most that the slider may be off then [m]."""
FIRST, BOUNDED = 2e-3, 5e-4
"""The largest of the smaller steps [s], and that of an explicit scheme: ω dt = 4 with the fastest rate, 8100/s."""
ERROR_FACTOR = 2.0
"""Of the allowance of errors, with the rate of the shaft; that of its angle is reckoned per radian."""


def governor() -> tuple[mbd.Model, mbd.State]:
    """A free shaft along z, a slider on it, two rods with balls hinged at its top, a spring-damper to each rod.

    Angles of the rods are measured from the downward vertical, outwards; 'shaft.angle', 'sleeve.displacement',
    'right.angle' and 'left.angle' name the motion.
    """
    data = definition(B5)
    number = {name: float(value) for name, value in data["definition"].items() if name != "geometry"}
    begin = data["initial_conditions"]
    length, thick, height, edge, off = (number[name] for name in ("L", "t", "H", "bx", "off"))
    model = mbd.Model("governor", gravity=(0.0, 0.0, -number["g"]))
    shaft = mbd.RigidBody("shaft body", **_bar(number["rho"], thick, height), center=(0.0, 0.0, 0.5 * height))
    cube = number["rho"] * edge**3
    slider = mbd.RigidBody("slider", cube, (cube * edge**2 / 6.0,) * 3)
    model.connect(
        mbd.Revolute("shaft", model.ground.origin, shaft.origin),
        mbd.Prismatic("sleeve", shaft.origin, slider.origin, axis=(0.0, 0.0, 1.0)),
    )
    for side, sign in ("right", 1.0), ("left", -1.0):
        rod = mbd.RigidBody(f"{side} rod", **_bar(number["rho"], thick, length), center=(0.0, 0.0, -0.5 * length))
        ball = mbd.PointMass(f"{side} ball", number["mp"])
        top = shaft.point(sign * off, 0.0, height, name=f"{side} hinge")
        model.connect(
            mbd.Revolute(side, top, rod.origin, axis=(0.0, -sign, 0.0)),
            mbd.Weld(f"{side} end", rod.point(0.0, 0.0, -length, name="end"), ball.origin),
        )
        ends = slider.point(sign * off, 0.0, 0.0, name=f"{side} ear"), rod.center
        model.apply(
            mbd.Spring(f"{side} spring", *ends, stiffness=number["k"], length=number["l0"]),
            mbd.Damper(f"{side} damper", *ends, number["c"]),
        )
    return model, mbd.assemble(
        model,
        position={"sleeve.displacement": begin["s"], "right.angle": begin["f"], "left.angle": begin["f"]},
        velocity={"shaft.angle": begin["shaft_rate"]},
    )


def _bar(density: float, thick: float, length: float) -> dict[str, Any]:
    """Mass and inertia of a bar along z with a square section."""
    mass = density * thick**2 * length
    across = mass * (length**2 + thick**2) / 12.0
    return {"mass": mass, "inertia": (across, across, mass * thick**2 / 6.0)}


def judge_governor(integrator: Any) -> Outcome:
    """Slider, rods and shaft with order 2; a hundred times the explicit limit of the step is no failure.

    An explicit scheme may end there with an error, and must not go on with another motion.
    """
    model, start = governor()
    slider, rod, turn = (quantity(B5, name) for name in ("slider height", "rod angle", "shaft angle"))
    skew = quantity(B5, "asymmetry")
    compared = {
        "error of the slider [m]": ("sleeve.displacement", slider, slider.size),
        "error of the rods [rad]": ("right.angle", rod, rod.size),
        "error of the shaft [rad]": ("shaft.angle", turn, 1.0),
    }

    def turning(dt: float) -> Any:
        return mbd.simulate(model, start, integrator, dt=dt, until=float(slider.times[-1]), on_failure="return")

    def errors(run: Any) -> Mapping[str, float]:
        at = run.at(slider.times)
        return {what: distance_to(at[name], reference) for what, (name, reference, _) in compared.items()}

    large, bounded = turning(LARGE), is_explicit(integrator)
    figures = _names_stable_steps(large) if bounded and not large.success else _taken(large)
    found = study(turning, errors, BOUNDED if bounded else FIRST, integrator, 1 if bounded else 3)
    rate = definition(B5)["initial_conditions"]["shaft_rate"]
    limits = {what: allowance(ERROR_FACTOR, rate, found.dt, size) for what, (_, _, size) in compared.items()}
    floors = {what: 2.0 * reference.accuracy for what, (_, reference, _) in compared.items()}
    uneven = [size(run["right.angle"] - run["left.angle"] - skew.value) for run in found.runs if run.success]
    return Outcome(
        [
            *figures,
            *found.figures(limits, floors),
            Figure("difference of the two rods [rad]", max(uneven, default=math.nan), skew.accuracy),
        ],
        [Curve("height of the slider [m]", large.time, large["sleeve.displacement"]), *found.curves()],
    )


def _taken(run: Any) -> list[Figure]:
    """Errors of the slider with the large step."""
    slider = quantity(B5, "slider height")
    off = np.full(len(slider.times), math.nan)
    if run.success:
        off = np.abs(run.at(slider.times)["sleeve.displacement"] - slider.value)
    rate, *before, last = definition(B5)["initial_conditions"]["shaft_rate"], *slider.times
    most, what = allowance(ERROR_FACTOR, rate, LARGE, slider.size), f"error of the slider at dt = {LARGE:g} s"
    return [
        Figure(f"{what}, t ≤ {before[-1]:g} s [m]", float(np.max(off[:-1])), LARGE_ERROR),
        Figure(f"{what}, t = {last:g} s [m]", float(off[-1]), most),
    ]


def _names_stable_steps(run: Any) -> list[Figure]:
    """Of an explicit scheme that stopped: whether it says below which step it is stable, and that this is smaller."""
    limit = re.search(r"an explicit scheme is stable for dt below ([\d.e+-]+) s", run.message)
    is_named = limit is not None and float(limit[1]) < LARGE
    return [Figure(f"dt = {LARGE:g} s refused without saying which steps are stable", float(not is_named), 0)]


CASES = (
    HardCase(B5, "Stiff spring-dampers do not limit the step: 0.01 s is within 1 mm, smaller ones have order 2.",
             judge_governor, ("HHT", "generalized-alpha", "Newmark", "RadauIIA", "RungeKutta853"),
             notes={"dt = 0.01 s": "after ten swings the phase error of order 2 alone is 2.4 mm, of the trapezoidal "
                                   "rule too; until three swings the slider is within 1 mm",
                    "RungeKutta853": "explicit: 0.01 s is ω dt = 81 for the fastest rate, where it is stable below 6; "
                                     "it must say so, and is compared at 0.5 and 0.25 ms",
                    "index 3": "not judged: there are no rows"}),
)  # fmt: skip
