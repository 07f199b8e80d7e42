"""A slider-crank whose slider has clearance in its guide (g6)."""

from functools import cache, partial
from typing import Any

import numpy as np

import mbd
from mbd.arrays import Vector
from mbd.hardcases.case import Curve, Figure, Outcome, hard_case
from mbd.hardcases.convergence import study
from mbd.hardcases.impacts import deepest, difference, impact_figures
from mbd.hardcases.references import limits_of, numbers, published, size

CORNERS = ("front-top", "front-bottom", "rear-top", "rear-bottom")
"""As the reference counts them."""

LIMITS = {
    "error of the impact times [s]": ("impact times", 1e-5),
    "error of the impulses [N s]": ("impulses", 2e-4),
    "error of the crank speed after each impact [rad/s]": ("crank speed after each", 1e-5),
}
"""The reference of each error, and the most it may be at the finest step over the largest value."""


@cache
def slider_crank(sizes: tuple[float, ...], turned: bool = False) -> mbd.Model:
    """Crank, rod and slider in a chain of three hinges; sizes are l1, l2, a, b, c, m1, m2, m3, J1, J2, J3, g, eN."""
    l1, l2, a, b, c, m1, m2, m3, J1, J2, J3, g, e = sizes
    model = mbd.Model("slider-crank", gravity=(0.0, -g, 0.0))
    crank = mbd.RigidBody("crank", mass=m1, inertia=J1, center=(0.5 * l1, 0.0, 0.0))
    rod = mbd.RigidBody("rod", mass=m2, inertia=J2, center=(0.5 * l2, 0.0, 0.0))
    slider = mbd.RigidBody("slider", mass=m3, inertia=J3)
    model.connect(
        mbd.Revolute("main", model.ground.origin, crank.origin),
        mbd.Revolute("pin", crank.point(l1, 0.0), rod.origin),
        mbd.Revolute("wrist", rod.point(l2, 0.0), slider.origin),
    )
    half = b + c
    corners = []
    for name in CORNERS:
        point = slider.point(a if "front" in name else -a, b if "top" in name else -b)
        gap = (lambda p: half - p[1]) if "top" in name else (lambda p: p[1] + half)
        corners.append(mbd.Unilateral(name, mbd.measure(gap, point), restitution=e))
    model.constrain(*(corners[::-1] if turned else corners))
    return model


def model_of(id: str, turned: bool = False) -> mbd.Model:
    """That of a case."""
    names = ("l1", "l2", "a", "b", "c", "m1", "m2", "m3", "J1", "J2", "J3", "g", "eN")
    return slider_crank(tuple(float(numbers(id)[name]) for name in names), turned)


def turning(id: str, scheme: Any, dt: float, turned: bool = False, beyond: float | None = None) -> Any:
    """The run until shortly after the last published impact, or until `beyond` times its time."""
    given, model = numbers(id), model_of(id, turned)
    (q1, q2, q3), (w1, w2, w3) = given["angles"], given["rates"]
    start = mbd.assemble(
        model,
        position={"main.angle": q1, "pin.angle": q2 - q1, "wrist.angle": q3 - q2},
        velocity={"main.angle": w1, "pin.angle": w2 - w1, "wrist.angle": w3 - w2},
    )
    times = published(id, "impact times")
    until = times[-1] + 0.1 * (times[-1] - times[-2]) if beyond is None else beyond * times[-1]
    return mbd.simulate(model, start, scheme, dt=dt, until=until, on_failure="return")


def turning_errors(id: str, run: Any) -> dict[str, Vector]:
    """Errors at the impacts of one run, by what they are of; none where the corners strike in another order."""
    count = len(published(id, "impact times"))
    events = [event for event in run.events if event.impulse.any()][:count]
    order = [CORNERS.index(event.name) for event in events]
    if order != list(published(id, "corner index sequence")):
        return {}
    values = (
        np.array([event.time for event in events]),
        np.array([event.impulse[0] for event in events]),
        run["main.angle.rate"][[event.row for event in events]],
    )
    return {what: value - published(id, name) for (what, (name, _)), value in zip(LIMITS.items(), values, strict=True)}


def steady_figures(run: Any) -> list[Figure]:
    """The corners of one side strike by turns without end, ever faster; then both are closed."""
    closed = {contact.name: bool(on) for contact, on in zip(run.facts.contacts, run.record.closed[-1], strict=True)}
    struck = {event.name for event in run.events}
    gains = np.diff(run.energy.kinetic)[[event.row - 1 for event in run.events if event.impulse.any()]]
    return [
        Figure("runs that stop at impacts without end [-]", float(not run.success), 0.0),
        Figure("corners that are not closed after them [-]", sum(not closed[name] for name in struck), 0.0),
        Figure("gap of these corners [m]", size([run[f"{name}.gap"][-1] for name in struck]), 1e-10),
        Figure("energy gained at an impact, relative [-]", float(np.max(gains)) / float(run.energy.kinetic[0]), 1e-12),
    ]


def rattling(id: str, scheme: Any) -> Outcome:
    """The corners strike in their order, at their instants, with their impulses, to second order."""
    found = study(
        lambda dt: turning(id, scheme, dt), partial(turning_errors, id), published(id, "impact times")[0] / 100.3,
        scheme, 2,
    )  # fmt: skip
    limits, floors = limits_of(id, LIMITS)
    floors = {what: min(floor, 1e-9 * size(published(id, LIMITS[what][0]))) for what, floor in floors.items()}
    run, other = found.finest, turning(id, scheme, found.dt, turned=True)
    figures = [
        *found.figures(limits, floors),
        Figure("runs in which the corners strike in another order [-]",
               sum(not turning_errors(id, each) for each in found.runs), 0.0),
        Figure("change with the order of the corners, relative [-]", difference(run, other), 1e-9),
        Figure("penetration [m]", deepest(run), 1e-10),
        *impact_figures(model_of(id), run),
        # past the instant at which the impacts pile up
        *steady_figures(turning(id, scheme, float(found.steps[0]), beyond=1.5)),
    ]  # fmt: skip
    late = run.time > 0.8 * run.time[-1]
    return Outcome(
        figures,
        [
            Curve(
                "gap of the corner front-top, last fifth", run.time[late], run["front-top.gap"][late], y_label="gap [m]"
            ),
            found.curve("error of the impact times [s]"),
        ],
    )


CASES = (
    hard_case(
        "g6-slider-crank-clearance",
        "The corners of a loose slider strike its guide in the right order and at the right instants, to second order.",
        rattling,
    ),
)
