"""A ball that bounces to rest (g1, j8), and one that flies into a corner (j9b)."""

import math
from functools import cache
from typing import Any

import numpy as np

import mbd
from mbd.constraints import height
from mbd.equal import ROUND_OFF_RTOL
from mbd.hardcases.case import Curve, Figure, Outcome, hard_case
from mbd.hardcases.convergence import halved
from mbd.hardcases.impacts import deepest, difference, impact_figures
from mbd.hardcases.references import accuracy, numbers, published, size
from mbd.hardcases.stepped import HOW, stepped_figures, within_steps
from mbd.simulation.simulate import REST_SPEED


@cache
def ball(m: float, g: float, e: float) -> mbd.Model:
    """A ball over a floor."""
    model = mbd.Model("ball", gravity=(0.0, -g, 0.0))
    body = mbd.PointMass("ball", mass=m)
    model.connect(mbd.Prismatic("fall", model.ground.origin, body.origin, axis=(0, 1, 0)))
    model.constrain(mbd.Unilateral("floor", height(body.origin), restitution=e))
    return model


def zeno(h: float, g: float, e: float) -> tuple[float, float]:
    """Time of the first impact and of the last of infinitely many [s]."""
    first = math.sqrt(2.0 * h / g)
    return first, first * (1.0 + e) / (1.0 - e)


def rest_figures(run: Any, m: float, g: float, after: float, what: str) -> list[Figure]:
    """At rest on the floor at all rows after a time, with the force m g."""
    still = run.time > after
    force = run["floor.force"][still] if still.any() else np.array([math.nan])
    height = size(run["fall.displacement"][still])
    return [
        Figure(f"{what}: contact force / m g − 1 [-]", size(force / (m * g) - 1.0), 1e-10),
        Figure(f"{what}: height at rest [m]", height, 1e-10),
        Figure(f"{what}: speed at rest [m/s]", size(run["fall.rate"][still]), 1e-10),
    ]


def bounces(model: mbd.Model, h: float, v: float, scheme: Any, dt: float, until: float, **settings: Any) -> Any:
    """The run of a ball let go at a height."""
    start = mbd.assemble(model, position={"fall.displacement": h}, velocity={"fall.displacement": v})
    return mbd.simulate(model, start, scheme, dt=dt, until=until, **settings)


def stepped_figures_of(model: mbd.Model, h: float, v: float, scheme: Any, m: float, g: float, e: float) -> list[Figure]:
    """In non-smooth steps: the first impact within one of them, rest after the Zeno time, with m g."""
    first, last = zeno(h, g, e)
    steps = halved(first / 20.3)
    runs = [bounces(model, h, v, scheme, float(dt), 1.3 * last, contact="nonsmooth") for dt in steps]
    fine = runs[-1]
    return [
        *within_steps("the first impact time [s]", steps, [run.events[0].time - first for run in runs], 1.0),
        *rest_figures(fine, m, g, 1.05 * last, "non-smooth steps"),
        *stepped_figures(model, fine),
    ]


def bouncing(id: str, scheme: Any) -> Outcome:
    """Impact times, apexes and impulse are those of the parabolas; after the Zeno time it rests in finite work."""
    given = numbers(id)
    h, g, e, m = (given[name] for name in ("y", "g", "e", "m"))
    first, last = zeno(h, g, e)
    model = ball(m, g, e)
    run = bounces(model, h, given["v"], scheme, first / 20.3, 1.3 * last)
    events = [event for event in run.events if event.kind == "closed"]
    times, apexes = published(id, "impact times"), published(id, "apex heights")
    found = np.array([event.time for event in events])
    tops = run.at(0.5 * (found[: len(apexes) - 1] + found[1 : len(apexes)]))["fall.displacement"]
    tail = 2.0 * REST_SPEED / (g * (1.0 - e))
    total = run.energy.kinetic + run.energy.potential
    limit = math.ceil(math.log(math.sqrt(2.0 * g * h) / REST_SPEED) / -math.log(e)) + 2  # until v eⁿ is below it
    coarse = bounces(model, h, given["v"], scheme, 2.0 * last, 4.0 * last)
    off = found[: len(times)] - times
    late = published(id, "Zeno time") + tail
    figures = [
        Figure("error of impact times [s]", size(off), accuracy(id, "impact times") + 1e-12),
        Figure("error of apex heights [m]", size(tops - apexes[1:]), accuracy(id, "apex heights") + ROUND_OFF_RTOL * h),
        Figure(
            "error of the first impulse, relative [-]",
            abs(events[0].impulse[0] / published(id, "total impulse") - 1.0), ROUND_OFF_RTOL,
        ),
        Figure("error of the Zeno time [s]", abs(found[-1] - published(id, "Zeno time")), tail + 1e-11),
        Figure("events [-]", len(run.events), limit),
        Figure("events with one step beyond the end [-]", len(coarse.events), limit),
        Figure("penetration [m]", deepest(run), 1e-10),
        Figure("energy gained, relative [-]", float(np.max(np.diff(total))) / total[0], ROUND_OFF_RTOL),
        Figure("error of the contact force at rest [N]",
               abs(run["floor.force"][-1] - published(id, "contact force")), 1e-10 * m * g),
        *rest_figures(run, m, g, late, "after the Zeno time"),
        *rest_figures(coarse, m, g, late, "one step beyond the end"),
        *impact_figures(model, run),
        *stepped_figures_of(model, h, given["v"], scheme, m, g, e),
    ]  # fmt: skip
    return Outcome(
        figures,
        [
            Curve("height", run.time, run["fall.displacement"], y_label="height [m]"),
            Curve("contact force", run.time, run["floor.force"], y_label="force [N]"),
        ],
    )


def counting(id: str, scheme: Any) -> Outcome:
    """As many impacts as the series has until the rebound is slower than the rest speed, then rest."""
    given = numbers(id)
    h, g, e, until, threshold = (given[name] for name in ("h", "g", "e", "t_end", "rest_speed_threshold"))
    m = given.get("m", 1.0)
    model = ball(m, g, e)
    first, _ = zeno(h, g, e)
    dt = first / 20.3
    run = bounces(model, h, 0.0, scheme, dt, until, rest_speed=threshold)
    after = [abs(run["fall.rate"][event.row]) for event in run.events if event.kind == "closed"]
    # where v e^n is just the threshold, round-off decides whether one more is counted; the references keep away from it
    count = next((n for n, speed in enumerate(after, 1) if speed < threshold), 0)
    allowed = published(id, "impacts until rebound")
    at_rest = published(id, "y(t_end)")
    close = accuracy(id, "y(t_end)") / 10.0
    zeno_time = published(id, "Zeno time")
    tail = 2.0 * threshold / (g * (1.0 - e))
    closing = [event.time for event in run.events if event.kind == "closed"]
    # the way to an event and the shortened step that may follow it are the only extra ones
    steps = run.stats["steps"] - math.ceil(until / dt)
    ends = [run["fall.displacement"][-1], run["fall.rate"][-1], run["floor.force"][-1] / (m * g)]
    figures = [
        Figure("impacts until the rebound is below the rest speed, error of the count [-]", abs(count - allowed), 0.0),
        Figure("events [-]", len(run.events), allowed + 1),
        Figure("steps more than t_end/dt, for each event [-]", steps / max(len(run.events), 1), 2.0),
        Figure("error of the Zeno time [s]", abs(closing[-1] - zeno_time), tail + 1e-11),
        *(
            Figure(f"error of {what}", abs(end - wanted), close)
            for what, end, wanted in zip(
                ("height at the end [m]", "speed at the end [m/s]", "force / m g at the end [-]"), ends, at_rest,
                strict=True,
            )
        ),
        *rest_figures(run, m, g, zeno_time + tail, "after the Zeno time"),
        Figure("penetration [m]", deepest(run), 1e-10),
        *impact_figures(model, run),
        *stepped_figures_of(model, h, 0.0, scheme, m, g, e),
    ]  # fmt: skip
    speeds = np.array([speed for speed in after if speed > 0.0])
    return Outcome(
        figures,
        [
            Curve("height", run.time, run["fall.displacement"], y_label="height [m]"),
            Curve("speed after each impact", np.arange(1, len(speeds) + 1), np.log10(speeds), "impact", "log10 of m/s"),
        ],
    )


@cache
def corner(m: float, e1: float, e2: float, turned: bool) -> mbd.Model:
    """A point mass in front of the walls x = 0 and y = 0, without gravity."""
    model = mbd.Model("corner", gravity=(0.0, 0.0, 0.0))
    body = mbd.PointMass("ball", mass=m)
    model.connect(mbd.Translation("flight", model.ground.origin, body.origin))
    walls = [
        mbd.Unilateral("wall x", mbd.measure("flight.x"), restitution=e1),
        mbd.Unilateral("wall y", mbd.measure("flight.y"), restitution=e2),
    ]
    model.constrain(*(walls[::-1] if turned else walls))
    return model


def cornered(id: str, scheme: Any) -> Outcome:
    """Both walls are met at one instant and give back e of the speed towards each."""
    given = numbers(id)
    m, e1, e2, (vx, vy) = given["m"], given["e1"], given["e2"], given["v"]
    wait = 1.0
    runs = []
    for turned, contact in HOW:
        model = corner(m, e1, e2, turned)
        start = mbd.assemble(
            model,
            position={"flight.x": -vx * wait, "flight.y": -vy * wait},
            velocity={"flight.x": vx, "flight.y": vy},
        )
        runs.append(mbd.simulate(model, start, scheme, dt=0.03 * wait, until=2.0 * wait, contact=contact))
    run, other, stepped = runs
    wanted = published(id, "velocity after")
    found = [run["flight.x.rate"][-1], run["flight.y.rate"][-1]]
    speed = math.hypot(vx, vy)
    times = [event.time for event in run.events]
    limit = accuracy(id, "velocity") + ROUND_OFF_RTOL * speed
    figures = [
        Figure("error of the velocity after [m/s]", size(found - wanted), limit),
        Figure("impacts more or less than two [-]", abs(len(run.events) - 2), 0.0),
        Figure("time between the two impacts [s]", max(times) - min(times) if times else math.nan, 0.0),
        Figure("error of the impact time [s]", size(np.array(times) - wait), 1e-12),
        Figure("change with the order of the walls, relative [-]", difference(run, other), ROUND_OFF_RTOL),
        Figure("penetration [m]", deepest(run), 1e-10),
        *impact_figures(corner(m, e1, e2, False), run),
        Figure("non-smooth steps: error of the velocity after [m/s]", size(stepped.record.v[-1] - wanted),
               accuracy(id, "velocity") + ROUND_OFF_RTOL * speed),
        *within_steps("the impact times [s]", [0.03 * wait], [[event.time - wait for event in stepped.events]], 1.0),
        *stepped_figures(corner(m, e1, e2, False), stepped),
    ]  # fmt: skip
    x, y = run["flight.x"], run["flight.y"]
    return Outcome(
        figures,
        [
            Curve("path", x, y, "x [m]", "y [m]"),
            Curve("distance from wall x", run.time, x, y_label="x [m]"),
        ],
    )


CASES = (
    hard_case(
        "g1-bouncing-ball",
        "The ball bounces at the instants of the parabolas, passes its Zeno time in finite work, and rests with m g.",
        bouncing,
    ),
    hard_case(
        "j8-zeno-event-count",
        "The number of impacts is that of the series, no more; the ball ends at rest with its weight on the floor.",
        counting,
    ),
    hard_case(
        "j9b-ball-into-corner",
        "Two walls are met at one instant; each gives back its own part of the speed, whichever is named first.",
        cornered,
    ),
)
