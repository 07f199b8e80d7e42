"""Bodies on a blade, which lets them slide along it but not sideways: d1 and d2."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

import mbd
from mbd.hardcases.case import ROUND_OFF, Curve, Figure, HardCase, Outcome, definition
from mbd.hardcases.convergence import allowance, study
from mbd.hardcases.references import distance_to, quantity, size
from mbd.hardcases.schemes import EVERY

D1, D2 = "d1-chaplygin-sleigh", "d2-knife-edge-incline"
SLEIGH, EDGE, FORCE = 0.4, 1.0, 0.01
"""Factors of the allowance of errors: of the sleigh, of the knife edge, of its multiplier, which has order 3."""


def sleigh() -> tuple[mbd.Model, mbd.State]:
    """The sleigh, its mass center ahead of the blade's point of contact P, and its start."""
    numbers, begin = definition(D1)["definition"], definition(D1)["initial_conditions"]
    inertia = numbers["I_G"]
    model = mbd.Model("sleigh", gravity=(0.0, 0.0, 0.0))
    body = mbd.RigidBody("sleigh", numbers["m"], (0.5 * inertia, 0.5 * inertia, inertia), center=(numbers["a"], 0, 0))
    model.connect(mbd.Planar("body", model.ground.origin, body.origin))
    model.constrain(mbd.KnifeEdge("blade", body.origin))
    angle, speed = begin["theta0"], begin["v_along_blade"]
    x, y = begin["P"]
    start = mbd.assemble(
        model,
        position={"body.x": x, "body.y": y, "body.angle": angle},
        velocity={
            "body.x": speed * math.cos(angle),
            "body.y": speed * math.sin(angle),
            "body.angle": begin["thetadot0"],
        },
    )
    return model, start


def knife_edge() -> tuple[mbd.Model, mbd.State]:
    """The knife edge in axes of the incline, x downhill, held by a row of the user's own."""
    numbers, begin = definition(D2)["definition"], definition(D2)["initial_conditions"]
    inertia = numbers["I"]
    model = mbd.Model("knife edge", gravity=mbd.on_slope(numbers["slope"], numbers["g"]))
    body = mbd.RigidBody("edge", numbers["m"], (0.5 * inertia, 0.5 * inertia, inertia))
    plane = model.ground.origin.turned(0.5 * math.pi, (1.0, 0.0, 0.0))
    model.connect(mbd.Planar("body", plane, body.origin))
    names = ("body.x.rate", "body.y.rate", "body.angle")
    model.constrain(
        mbd.Nonholonomic("blade", lambda vx, vy, angle: vx * mbd.sin(angle) - vy * mbd.cos(angle), arguments=names)
    )
    angle, speed = begin["theta"], begin["v"]
    start = mbd.assemble(
        model,
        position={"body.x": begin["x"], "body.y": begin["y"], "body.angle": angle},
        velocity={
            "body.x": speed * math.cos(angle),
            "body.y": speed * math.sin(angle),
            "body.angle": begin["thetadot"],
        },
    )
    return model, start


def judge_sleigh(integrator: Any) -> Outcome:
    """Motion, place and side force against their references; no slip; energy kept to the scheme's order."""
    model, start = sleigh()
    motion, place, force = (quantity(D1, name) for name in ("[blade speed", "contact point P", "side force"))
    energy, final = quantity(D1, "kinetic energy"), quantity(D1, "limit speed")

    def slide(dt: float) -> Any:
        return mbd.simulate(model, start, integrator, dt=dt, until=float(motion.times[-1]))

    def errors(run: Any) -> Mapping[str, float]:
        at = run.at(motion.times)
        angle = at["body.angle"]
        speed = at["body.x.rate"] * np.cos(angle) + at["body.y.rate"] * np.sin(angle)
        return {
            "error of the motion [m/s, rad/s, rad]": distance_to(
                np.column_stack([speed, at["body.angle.rate"], angle]), motion
            ),
            "error of the place [m]": distance_to(np.column_stack([at["body.x"], at["body.y"]]), place),
            "error of the side force [N]": distance_to(at["blade.force"], force),
            "change of energy [J]": size(run["kinetic_energy"] - run["kinetic_energy"][0]),
        }

    found = study(slide, errors, 0.01, integrator)
    finest, dt = found.finest, found.dt
    tail = mbd.simulate(model, finest.final, integrator, dt=0.01, until=3.0 * float(motion.times[-1]))
    speed = math.hypot(tail["body.x.rate"][-1], tail["body.y.rate"][-1])
    rate = definition(D1)["initial_conditions"]["thetadot0"]
    sizes = (motion.size, place.size, force.size, float(energy.value))
    limits = (allowance(SLEIGH, rate, dt, each) for each in sizes)
    return Outcome(
        [
            *found.figures(dict(zip(found.errors, limits, strict=True))),
            Figure(
                "error of the energy at the start [J]", abs(finest["kinetic_energy"][0] - energy.value), energy.accuracy
            ),
            Figure(
                "error of the limit speed [m/s]",
                abs(speed - float(final.value)),
                allowance(SLEIGH, rate, dt, final.size),
            ),
            Figure("slip [m/s]", max(size(run["blade.residual"]) for run in found.runs), ROUND_OFF),
        ],
        [Curve("rate of turning [rad/s]", finest.time, finest["body.angle.rate"]), *found.curves()],
    )


def judge_knife_edge(integrator: Any) -> Outcome:
    """Places and multiplier against their references; bounded downhill, steady sideways; no slip."""
    model, start = knife_edge()
    place, force = quantity(D2, "[x, y](t)"), quantity(D2, "multiplier")
    lowest, drift = quantity(D2, "max downhill excursion"), quantity(D2, "mean sideways speed")
    rate = definition(D2)["initial_conditions"]["thetadot"]
    turn = 2.0 * math.pi / rate

    def slide(dt: float) -> Any:
        return mbd.simulate(model, start, integrator, dt=dt, until=float(place.times[-1]))

    def errors(run: Any) -> Mapping[str, float]:
        at = run.at(place.times)
        return {"error of the place [m]": distance_to(np.column_stack([at["body.x"], at["body.y"]]), place)}

    found = study(slide, errors, 0.01, integrator)
    forces = [
        distance_to(each.at(place.times)["blade.multiplier"], force) / allowance(FORCE, rate, float(step), force.size)
        for each, step in zip(found.runs, found.steps, strict=True)
    ]
    dt = turn / 1600
    run = mbd.simulate(model, start, integrator, dt=dt, until=20 * turn)
    return Outcome(
        [
            *found.figures({"error of the place [m]": allowance(EDGE, rate, found.dt, place.size)}),
            Figure("error of the multiplier over what is allowed, at every dt [-]", max(forces), 1.0),
            Figure(
                "error of the farthest place downhill [m]",
                abs(float(np.max(run["body.x"])) - float(lowest.value)),
                allowance(EDGE, rate, dt, lowest.size),
            ),
            Figure(
                "downhill after whole turns [m]", abs(float(run["body.x"][-1])), allowance(EDGE, rate, dt, lowest.size)
            ),
            Figure(
                "error of the mean speed sideways [m/s]",
                abs(float(run["body.y"][-1] / run.time[-1]) - float(drift.value)),
                allowance(EDGE, rate, dt, drift.size),
            ),
            Figure("slip [m/s]", max(size(each["blade.residual"]) for each in (*found.runs, run)), ROUND_OFF),
        ],
        [Curve("path: y over x", run["body.x"], run["body.y"], "downhill [m]", "sideways [m]"), *found.curves()],
    )


CASES = (
    HardCase(D1, "The blade never slips sideways, energy is kept, the motion tends to a straight line.",
             judge_sleigh, EVERY),
    HardCase(D2, "The edge swings downhill and back and moves on sideways; it never slides down.",
             judge_knife_edge, EVERY),
)  # fmt: skip
