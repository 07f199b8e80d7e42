"""A mass on a vibrating table (j10)."""

import math
import re
from functools import cache
from typing import Any

import numpy as np

import mbd
import mbd.tape.functions as tape
from mbd.hardcases.case import Curve, Figure, Outcome, hard_case
from mbd.hardcases.convergence import halved, study
from mbd.hardcases.impacts import deepest, impact_figures
from mbd.hardcases.references import accuracy, numbers, published, quantity, size
from mbd.hardcases.stepped import stepped_figures, within_steps

SETTLING_PERIODS = 8.0
"""Periods after which the error of the first steps of a scheme in positions only has died out."""

THROWING_PERIODS = 10
"""Periods of the shaker that throws the mass."""


@cache
def table(m: float, g: float, A: float, w: float) -> mbd.Model:
    """A mass over a table at the height A sin(ωt)."""
    model = mbd.Model("shaker", gravity=(0.0, -g, 0.0))
    body = mbd.PointMass("mass", mass=m)
    model.connect(mbd.Prismatic("rise", model.ground.origin, body.origin, axis=(0, 1, 0)))
    gap = mbd.measure(lambda y, t: y - A * tape.sin(w * t), "rise.displacement", "t")
    model.constrain(mbd.Unilateral("table", gap))
    return model


def shaken(
    id: str, scheme: Any, dt: float, periods: float, amplitude: float | None = None, contact: Any = "events"
) -> Any:
    """The run of a mass that begins on the table and moves with it."""
    given = numbers(id)
    A, w = float(given["A"]) if amplitude is None else amplitude, float(given["w"])
    if not given["on_table"]:
        raise ValueError("the mass begins on the table, got on_table = false")
    model = table(float(given["m"]), float(given["g"]), A, w)
    velocity = {"rise.displacement": A * w + float(given["relative_velocity"])}
    start = mbd.assemble(model, position={"rise.displacement": 0.0}, velocity=velocity, closed=["table"])
    until = periods * 2.0 * math.pi / w
    return mbd.simulate(model, start, scheme, dt=dt, until=until, contact=contact)


def staying_figures(id: str, scheme: Any, period: float) -> tuple[list[Figure], list[Curve]]:
    """Γ < 1: the contact persists, and its force is m (g + z¨)."""
    given = numbers(id)
    m, g, A, w = (float(given[name]) for name in ("m", "g", "A", "w"))
    extremes = published(id, "contact force extremes")
    limits = dict.fromkeys(
        ("error of the contact force [N]", "error of the extremes of the contact force [N]"), 2e-3 * m * g
    )

    def errors(run: Any) -> dict[str, Any]:
        exact = m * (g - A * w * w * np.sin(w * run.time))
        last = run.time > period * (SETTLING_PERIODS - 1.001)
        force = run["table.force"][last]
        peaks = np.array([np.min(force), np.max(force)]) - extremes
        return dict(zip(limits, (size(force - exact[last]), peaks), strict=True))

    # rows at the quarters of the period
    found = study(lambda dt: shaken(id, scheme, dt, SETTLING_PERIODS), errors, period / 40.0, scheme, 2)
    count = int(re.findall(r"in (\d+) periods", quantity(id, "number of releases").name)[0])
    run = shaken(id, scheme, float(found.steps[0]), float(count))
    opened = [event for event in run.events if event.kind == "opened"]
    figures = [
        Figure(f"releases in {count} periods [-]", abs(len(opened) - published(id, "number of releases")), 0.0),
        Figure(f"switches in {count} periods [-]", len(run.events), 0.0),
        Figure("error of Γ, A ω²/g [-]", abs(A * w * w / g - published(id, "Gamma")), accuracy(id, "Gamma") + 1e-15),
        *found.figures(limits, 1e-9 * m * g),
        Figure("error of the height of the mass on the table [m]", size(run["table.gap"]), 1e-10),
    ]
    fine = found.finest
    curves = [Curve("contact force", fine.time, fine["table.force"], y_label="force [N]")]
    return figures, curves


def thrown_figures(id: str, scheme: Any, period: float) -> tuple[list[Figure], list[Curve]]:
    """Γ > 1: one release a period, where g + z¨ passes zero."""
    given = numbers(id)
    m, g, w = (float(given[name]) for name in ("m", "g", "w"))
    entry = quantity(id, "first lift-off time")
    gamma = float(re.findall(r"Gamma = ([\d.]+)", entry.name)[0])
    amplitude = gamma * g / (w * w)
    first = float(entry.value)
    one, every = (f"error of the {what} at Γ = {gamma:g} [s]" for what in ("first lift-off time", "lift-off times"))

    def errors(run: Any) -> dict[str, Any]:
        opened = np.array([event.time for event in run.events if event.kind == "opened"])
        phases = first + period * np.arange(THROWING_PERIODS)
        return {
            one: opened[0] - first if len(opened) else math.nan,
            every: opened - phases if len(opened) == THROWING_PERIODS else math.nan,
        }

    # no row at the instant of lift-off
    found = study(lambda dt: shaken(id, scheme, dt, THROWING_PERIODS, amplitude), errors, period / 37.0, scheme, 2)
    run = found.finest
    figures = [
        *found.figures({one: 1e-4 * period}, 1e-10 * period),
        *found.figures({every: 1e-4 * period * THROWING_PERIODS**0.5}, 1e-9 * period),
        Figure(f"penetration at Γ = {gamma:g} [m]", float(np.max([deepest(each) for each in found.runs])), 1e-10),
        Figure(f"pull at Γ = {gamma:g} [N]", float(np.max(-run["table.force"])), 1e-9 * m * g),
        # the table, which moves, may give or take energy
        *(each for each in impact_figures(table(m, g, amplitude, w), run) if "energy" not in each.what),
    ]
    curves = [
        Curve(f"height over the table, Γ = {gamma:g}", run.time, run["table.gap"], y_label="gap [m]"),
        found.curve(one),
    ]
    return figures, curves


def stepped_shaking(id: str, scheme: Any, period: float) -> list[Figure]:
    """In non-smooth steps: it stays without a switch below Γ = 1, and leaves once a period within a step above."""
    given = numbers(id)
    g, w = (float(given[name]) for name in ("g", "w"))
    entry = quantity(id, "first lift-off time")
    amplitude = float(re.findall(r"Gamma = ([\d.]+)", entry.name)[0]) * g / (w * w)
    steps = halved(period / 37.0)
    stays = shaken(id, scheme, float(steps[0]), 100.0, contact="nonsmooth")
    runs = [shaken(id, scheme, float(dt), THROWING_PERIODS, amplitude, "nonsmooth") for dt in steps]
    phases = float(entry.value) + period * np.arange(THROWING_PERIODS)
    found = [leaving(run, period) for run in runs]
    errors = [each - phases if len(each) == THROWING_PERIODS else math.nan for each in found]
    moving = stepped_figures(table(float(given["m"]), g, amplitude, w), runs[-1])
    return [
        Figure("non-smooth steps: switches in 100 periods [-]", len(stays.events), 0.0),
        Figure("non-smooth steps: height of the mass on the table [m]", size(stays["table.gap"]), 1e-10),
        *within_steps("the lift-off times [s]", steps, errors, 1.0),
        *(each for each in moving if "energy" not in each.what),
    ]


def leaving(run: Any, period: float) -> Any:
    """The last instant of each period at which the mass leaves: it may touch again within a step or two."""
    opened = np.array([event.time for event in run.events if event.kind == "opened"])
    if not len(opened):
        return opened
    return opened[np.append(np.diff(opened) > 0.25 * period, True)]


def shaking(id: str, scheme: Any) -> Outcome:
    """No release below Γ = 1, one a period above."""
    period = 2.0 * math.pi / float(numbers(id)["w"])
    figures, curves = staying_figures(id, scheme, period)
    more, seen = thrown_figures(id, scheme, period)
    return Outcome([*figures, *more, *stepped_shaking(id, scheme, period)], [*curves, *seen][:2])


CASES = (
    hard_case(
        "j10-chatter-on-vibrating-table",
        "The mass stays on the table while A ω² < g; beyond, it leaves once a period, at the right phase.",
        shaking,
    ),
)
