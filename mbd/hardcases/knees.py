"""A leg whose knee runs into a stop of spring and damper, with two rules of release (h1, h1b)."""

import math
from functools import cache, partial
from typing import Any

import numpy as np

import mbd
from mbd.arrays import Vector
from mbd.hardcases.case import Curve, Figure, Outcome, hard_case
from mbd.hardcases.convergence import second_order, study
from mbd.hardcases.references import limits_of, numbers, published, size

RELEASES = {"unilateral": "pull"}
"""What the definition calls a law, by the word of `Penalty`; any other is that of the gap."""

TIMES = "error of the switching times [s]"
LIMITS = {
    TIMES: ("event times", 1e-4),
    "error of the knee's rate at the switches [rad/s]": ("d' = w2 - w1", 1e-3),
    "error of the hip's rate at the switches [rad/s]": ("w1 at the events", 2e-3),
    "error of the largest hyperextensions [rad]": ("max hyperextension", 1e-3),
    "error of the times of largest hyperextension [s]": ("time of max", 1e-4),
}
"""The reference of each error, and the most it may be at the finest step over the largest value."""


@cache
def leg(m: tuple[float, float], L: tuple[float, float], g: float, k: float, c: float, release: str) -> mbd.Model:
    """Uniform rods that hang from a fixed hip; the knee's angle is the hyperextension d."""
    model = mbd.Model("leg", gravity=(0.0, -g, 0.0))
    thigh, shank = (
        mbd.Link(name, mass, length=length, center=0.5 * length, inertia=mass * length**2 / 12.0)
        for name, mass, length in zip(("thigh", "shank"), m, L, strict=True)
    )
    knee = mbd.Revolute("knee", thigh.end, shank.start)
    model.connect(mbd.Revolute("hip", model.ground.origin, thigh.start), knee)
    model.constrain(
        mbd.Penalty("knee stop", mbd.flexion(knee), stiffness=k, damping=c, release=release),
        mbd.Event("deepest", mbd.measure("knee.rate", unit="rad"), direction=-1),
    )
    return model


def swing(id: str, scheme: Any, dt: float, locate: Any = "root") -> Any:
    """The run a little beyond the last published switch."""
    given = numbers(id)
    m, L = ((float(given[f"{name}1"]), float(given[f"{name}2"])) for name in ("m", "L"))
    release = RELEASES.get(given["law"], "gap")
    model = leg(m, L, float(given["g"]), float(given["k"]), float(given["c"]), release)
    start = mbd.assemble(
        model,
        position={"hip.angle": given["theta1"], "knee.angle": given["theta2"] - given["theta1"]},
        velocity={"hip.angle": given["w1"], "knee.angle": given["w2"] - given["w1"]},
    )
    times = published(id, "event times")
    return mbd.simulate(model, start, scheme, dt=dt, until=times[-1] + times[1] - times[0], locate=locate)


def errors_of(id: str, run: Any) -> dict[str, Vector]:
    """Errors of one run, by what they are of; none where the switches are not those of the reference."""
    times = published(id, "event times")
    events = [event for event in run.events if event.name == "knee stop"]
    kinds = [("closed", "opened")[k % 2] for k in range(len(times))]
    tops = np.array([event.time for event in run.events if event.name == "deepest"])
    if [event.kind for event in events[: len(times)]] != kinds or not len(tops):
        return {}
    rows = [event.row for event in events[: len(times)]]
    wanted = published(id, "time of max")
    deepest = tops[[int(np.argmin(np.abs(tops - time))) for time in wanted]]
    values = run.time[rows], run["knee.rate"][rows], run["hip.rate"][rows], run.at(deepest)["knee.angle"], deepest
    return {what: value - published(id, name) for (what, (name, _)), value in zip(LIMITS.items(), values, strict=True)}


def linear_figures(id: str, scheme: Any, steps: Any, rooted: float) -> list[Figure]:
    """Switching times with one linear step back: little worse than with roots, or of the order 2 that such a step has.

    rooted : the error with roots at the finest step [s]
    """
    used = steps if scheme.order() > 2 else steps[-1:]
    linears = [errors_of(id, swing(id, scheme, float(dt), "linear")).get(TIMES, math.nan) for dt in used]
    title = "error of the switching times with one linear step back"
    if scheme.order() <= 2:
        return [Figure(f"{title}, over that with roots [-]", size(linears) / max(rooted, 1e-300), 1.5)]
    limits, floors = limits_of(id, LIMITS)
    return second_order(
        f"{title} [s]", steps, linears, limits[TIMES], floors[TIMES], order=scheme.order(), erratic=True
    )


def stopped(id: str, scheme: Any) -> Outcome:
    """Switches at the reference instants to second order, never deeper than the reference but for the error."""
    times = published(id, "event times")
    found = study(lambda dt: swing(id, scheme, dt), partial(errors_of, id), (times[1] - times[0]) / 60.0, scheme, 2)
    figures = found.figures(*limits_of(id, LIMITS))
    run, depths = found.finest, published(id, "max hyperextension")
    beyond = float(np.max(run["knee.angle"])) - max(depths)
    allowed = 2.0 * size(found.errors["error of the largest hyperextensions [rad]"][-1])
    between = np.ones(len(run), dtype=bool)
    moments = [event.time for event in run.events if event.name == "knee stop"]
    for closes, opens in zip(moments[::2], moments[1::2], strict=False):
        between &= (run.time < closes) | (run.time > opens)
    if len(moments) % 2:
        between &= run.time < moments[-1]
    force = run["knee stop.force"]
    figures += [
        Figure("hyperextension beyond the largest of the reference [rad]", beyond, allowed),
        *linear_figures(id, scheme, found.steps, size(found.errors[TIMES][-1])),
        Figure("torque of the stop while it is open [N m]", size(force[between]), 0.0),
        *second_order("error of the energy, over what the stop took [-]", found.steps,
                      [_lost(each) for each in found.runs], 2e-3, 1e-9, order=scheme.order()),
    ]  # fmt: skip
    if RELEASES.get(numbers(id)["law"]) == "pull":
        figures.append(Figure("torque that pulls, over the largest [-]", float(np.max(-force)) / size(force), 1e-8))
    return Outcome(
        figures,
        [
            Curve("hyperextension of the knee", run.time, run["knee.angle"], y_label="angle [rad]"),
            found.curve(TIMES),
        ],
    )


def _lost(run: Any) -> float:
    """The energy that the scheme itself made, over that which the stop took."""
    sums = run.energy.sums
    return float(sums["numerical"] / abs(sums["knee stop"]))


CASES = (
    hard_case(
        "h1-knee-stop-gap-law",
        "A knee stop that lets go where the gap opens switches at the reference instants, to second order.",
        stopped,
    ),
    hard_case(
        "h1b-knee-stop-unilateral",
        "A knee stop that never pulls lets go as its torque falls to zero, at the reference instants to second order.",
        stopped,
    ),
)
