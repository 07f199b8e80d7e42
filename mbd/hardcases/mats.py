"""A mass that falls on a very stiff spring (j6)."""

import math
from functools import cache
from typing import Any

import numpy as np

import mbd
from mbd.hardcases.case import Curve, Figure, Outcome, hard_case
from mbd.hardcases.convergence import error_curve, study
from mbd.hardcases.references import accuracy, numbers, published

STIFFER = (1.0, 10.0)
"""Stiffness over that of the definition."""

LONGER = (0.15, 0.3, 1.1, 3.0, 10.0, 100.0)
"""Steps over the duration of the impact that do not resolve it."""


@cache
def mat(m: float, g: float, k: float, c: float) -> mbd.Model:
    """A ball over a mat."""
    model = mbd.Model("ball", gravity=(0.0, -g, 0.0))
    body = mbd.PointMass("ball", mass=m)
    model.connect(mbd.Prismatic("fall", model.ground.origin, body.origin, axis=(0, 1, 0)))
    model.constrain(mbd.Penalty("mat", mbd.height(body.origin), stiffness=k, damping=c))
    return model


def exact_impact(m: float, g: float, k: float, c: float, drop: float) -> dict[str, float]:
    """The impact in closed form: m ẍ = m g − k x − c ẋ from x = 0 at the speed √(2 g h), until x = 0 again."""
    from scipy.optimize import brentq

    w, d, v = math.sqrt(k / m), 0.5 * c / m, math.sqrt(2.0 * g * drop)
    if d >= w:
        raise ValueError(f"the mat is damped beyond oscillation (c = {c:g}); this case needs c < {2.0 * m * w:g}")
    f, rest = math.sqrt(w * w - d * d), m * g / k
    one = (v - d * rest) / f

    def depth(t: float) -> float:
        return rest + math.exp(-d * t) * (one * math.sin(f * t) - rest * math.cos(f * t))

    def speed(t: float) -> float:
        wave = (f * one + d * rest) * math.cos(f * t) + (f * rest - d * one) * math.sin(f * t)
        return math.exp(-d * t) * wave

    top = float(brentq(speed, 0.0, math.pi / f, xtol=1e-22, rtol=1e-15))
    end = float(brentq(depth, top, top + math.pi / f, xtol=1e-22, rtol=1e-15))
    return {
        "contact start": math.sqrt(2.0 * drop / g), "max penetration": depth(top), "contact duration": end,
        "rebound speed": -speed(end), "peak contact force": k * depth(top) + c * speed(top),
    }  # fmt: skip


def dropped(given: dict[str, float], scheme: Any, dt: float) -> Any:
    """The end of the fall, from just above the mat and as fast as it is there, and the impact."""
    near = min(given["drop"], (2.3 * dt) * math.sqrt(2.0 * given["g"] * given["drop"]))
    speed = math.sqrt(2.0 * given["g"] * (given["drop"] - near))
    model = mat(given["m"], given["g"], given["k"], given["c"])
    start = mbd.assemble(model, position={"fall.displacement": near}, velocity={"fall.displacement": -speed})
    return mbd.simulate(model, start, scheme, dt=dt, until=6.0 * dt + 1.5 * exact_impact(**given)["contact duration"],
                    on_failure="return")  # fmt: skip


LIMITS = {"contact duration": 2e-4, "rebound speed": 1e-4, "max penetration": 1e-4, "work of the mat": 1e-6}
"""The most that each may be off at the finest step, over its size; the work over m g h."""


def impact_errors(given: dict[str, float], wanted: dict[str, float], run: Any) -> dict[str, float]:
    """Errors of the first impact of one run, relative."""
    closed, opened = [event for event in run.events if event.name == "mat"][:2]
    fine = run.at(np.linspace(closed.time, opened.time, 4001))["fall.displacement"]
    found = {
        "contact duration": opened.time - closed.time,
        "rebound speed": run["fall.rate"][opened.row],
        "max penetration": -float(np.min(fine)),
    }
    errors = {name: value / wanted[name] - 1.0 for name, value in found.items()}
    work = run.energy["mat"][opened.row] - run.energy["mat"][closed.row]
    spent = 0.5 * given["m"] * (wanted["rebound speed"] ** 2 - 2.0 * given["g"] * given["drop"])
    return errors | {"work of the mat": float(work - spent) / given_energy(given)}


def resolved(given: dict[str, float], scheme: Any) -> tuple[list[Figure], list[Curve]]:
    """Steps that resolve the impact: depth, duration, rebound and work to second order; nothing gained, no note."""
    wanted = exact_impact(**given)
    title, gains = f"k = {given['k']:g}", []

    def errors(run: Any) -> dict[str, float]:
        found = impact_errors(given, wanted, run)
        return {f"{title}: relative error of the {name} [-]": found[name] for name in LIMITS}

    found = study(lambda dt: dropped(given, scheme, dt), errors, wanted["contact duration"] / 40.0, scheme, 2)
    limits = {f"{title}: relative error of the {name} [-]": limit for name, limit in LIMITS.items()}
    for run in found.runs:
        closed, opened = (event.row for event in run.events[:2])
        gains.append((run.energy.total[opened] - run.energy.total[closed]) / given_energy(given))
    notes = [note for run in found.runs for note in _unresolved(run)]
    figures = [
        *found.figures(limits, 1e-7, better=True),
        Figure(f"{title}: notes of a step that is too long [-]", len(notes), 0.0),
        Figure(f"{title}: energy gained in the impact, relative [-]", float(np.max(gains)), 1e-9),
    ]
    run, late = found.finest, found.errors[f"{title}: relative error of the contact duration [-]"]
    return figures, [
        Curve(f"depth, {title}", run.time, -run["fall.displacement"], y_label="depth [m]"),
        error_curve(f"error of the duration, {title}", found.steps, late, "relative error"),
    ]


def _unresolved(run: Any) -> list[str]:
    """Notes that dt does not resolve an impact, which took shorter steps or was left so, or the error of the run."""
    words = "not resolve", "has too few for its impacts"
    return [note for note in (*run.stats["notes"], run.message) if any(word in note for word in words)]


def too_long(given: dict[str, float], scheme: Any) -> list[Figure]:
    """Steps longer than the impact: told, and without energy from nowhere, or refused."""
    duration = exact_impact(**given)["contact duration"]
    silent, gains = 0, []
    for factor in LONGER:
        run = dropped(given, scheme, factor * duration)
        total = run.energy.total
        silent += not _unresolved(run)
        gains.append((total[-1] - total[0]) / given_energy(given) if run.success else 0.0)
    title = f"k = {given['k']:g}"
    return [
        Figure(f"{title}: steps of 0.15 to 100 impacts that are not told [-]", silent, 0.0),
        Figure(f"{title}: energy gained in silence with such steps, relative [-]", float(np.max(gains)), 1e-9),
    ]


def given_energy(given: dict[str, float]) -> float:
    """m g h [J]."""
    return given["m"] * given["g"] * given["drop"]


def stiff(id: str, scheme: Any) -> Outcome:
    """An impact of microseconds is right where it is resolved, and told where it is not."""
    given = {name: float(numbers(id)[name]) for name in ("m", "g", "k", "c", "drop")}
    closed_form = exact_impact(**given)
    figures = [
        Figure(
            f"closed form against the reference, {name} [-]",
            abs(closed_form[name] - published(id, name)), accuracy(id, name) + 1e-12 * closed_form[name],
        )
        for name in closed_form
    ]  # fmt: skip
    model, fall = mat(*(given[name] for name in "mgkc")), closed_form["contact start"]
    start = mbd.assemble(model, position={"fall.displacement": given["drop"]})
    run = mbd.simulate(model, start, scheme, dt=fall / 20.3, until=("mat", 2.0 * fall))
    off = abs(run.events[0].time - published(id, "contact start"))
    figures.append(Figure("error of the contact start [s]", off, accuracy(id, "contact start") + 1e-12))
    curves: list[Curve] = []
    for factor in STIFFER:
        stiffer = given | {"k": factor * given["k"]}
        found, seen = resolved(stiffer, scheme)
        figures += [*found, *too_long(stiffer, scheme)]
        curves += seen
    return Outcome(figures, curves[:2])


CASES = (
    hard_case(
        "j6-stiff-penalty-1e9",
        "An impact of microseconds is of second order where steps resolve it; where not, it is reported and makes no "
        "energy.",
        stiff,
    ),
)
