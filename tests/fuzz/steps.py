"""Laws along rows: positions and velocities are integrals, guards that cross make events, passive parts only take."""

import ast
from typing import Any

import numpy as np

import mbd
from tests.fuzz.bodies import Bodies
from tests.fuzz.faults import Faults
from tests.fuzz.geometry import Array, of_quaternion
from tests.fuzz.quantities import gap_of
from tests.fuzz.readings import Readings
from tests.fuzz.turning import rotation_vector

PASSIVE = ("joint loss", "damper", "friction", "penalty", "impact")
"""Kinds of parts of the ledger that only take energy."""
FEW = 4
"""Steps between two events of a run that follows a tolerance below which they are too long for laws from row to row.

One of order 8 passes half an oscillation on a stiff ground.
"""


def error_share(integrator: str) -> float:
    """Error of a step over the change of its acceleration: of a velocity over h, or a third of a position's over h².

    ``|γ − 1/2 + α_m − α_f|``, 0 for order 2, and ``|1/6 − β − (α_m − α_f)/2|/3``.
    """
    c = _coefficients(integrator)
    if c is None:
        return 0.0
    shift = c.alpha_m - c.alpha_f
    return float(max(abs(c.gamma - 0.5 + shift), abs(1.0 / 6.0 - c.beta - 0.5 * shift) / 3.0))


def fading(integrator: str) -> float:
    """What is left after a step of an error of auxiliary accelerations, ``|α_m/(1 − α_m)|``; 0 without them."""
    c = _coefficients(integrator)
    return 0.0 if c is None else float(abs(c.alpha_m / (1.0 - c.alpha_m)))


def _coefficients(integrator: str) -> Any:
    """Those of a scheme of the Newmark family, None of others."""
    call = ast.parse(integrator, mode="eval").body
    assert isinstance(call, ast.Call)
    assert isinstance(call.func, ast.Name)
    given = {str(word.arg): ast.literal_eval(word.value) for word in call.keywords}
    return getattr(getattr(mbd, call.func.id)(**given), "coefficients", None)


def motion(
    found: Faults,
    told: Readings,
    smooth: bool = True,
    rates: bool = True,
    uncertain: int = 0,
    tied: bool = True,
    share: float = 0.0,
    tol: float = 0.0,
    err: float = 0.0,
    left: float = 0.0,
) -> None:
    """Each coordinate is the integral of its rate, and that of its acceleration, from one row to the next.

    ``Δq = h (v₀+v₁)/2 − h² (a₁−a₀)/12`` and ``Δv = h (a₀+a₁)/2`` but for what accelerations change meanwhile: h² and
    h times the largest change of a of the steps around, and what schemes with a memory keep of earlier ones; one step
    alone between two events has none around.

    Parameters
    ----------
    smooth : whether velocities change by accelerations alone, not by impulses within steps
    rates : whether those of velocities count, which index 3 corrects without
    uncertain : how many steps next to singular poses the run says to have less accurate velocities
    tied : whether there are rows, onto which corrections move all velocities by what one of them errs
    share : error of a step over the change of its acceleration, see `error_share` [-]
    tol : what positions may err by in the whole run [m, rad]: long steps pass more than these laws see
    err : what a note of the run says that velocities err [m/s, rad/s]
    left : see `fading` [-]
    """
    h = np.diff(told.time)
    steps = np.flatnonzero(h > 0.0)
    stretch = np.cumsum(h == 0.0)[steps]
    steps = steps[np.bincount(stretch)[stretch] >= (FEW if tol else 2)]
    if len(steps) < 2:
        return
    h = h[steps]
    there = found.at(told.time[steps])
    spins = [name for name in told.values if ".angular_velocity." in name and f"{name}.acceleration" in told]
    rated = [told[name] for name in told.values if name.endswith(".rate") or name in spins]
    fastest = 3.0 * np.max(np.abs(rated)) if rated else 0.0
    accelerations = [_around(np.abs(np.diff(told[n]))[steps], left) for n in told.values if n.endswith(".acceleration")]
    part = max(0.05, share)  # corrections onto rows move everything by twice what one of them errs
    jumps = part * np.max(accelerations, axis=0) if accelerations else 0.0
    for name in [name for name in told.values if f"{name}.rate" in told and f"{name}.acceleration" in told]:
        q, v, a = told.coordinate(name)
        change = _around(np.abs(np.diff(a))[steps], left) + 1e-3 * (np.abs(a[steps]) + np.abs(a[steps + 1]))
        fast = np.maximum(np.abs(v[steps]), np.abs(v[steps + 1]))
        off = np.diff(q)[steps] - h * (v[steps] + v[steps + 1]) / 2.0
        if smooth:
            off = off + h**2 * np.diff(a)[steps] / 12.0
        limit = 6.0 * h**2 * (change + jumps) + 1e-8 * (1.0 + np.abs(q[steps]) + h * fast) + tol + h * err
        if not smooth:  # bodies are lifted out of surfaces
            limit = limit + h * (10.0 * _range(v)[steps] + fastest)
        elif not rates:
            limit = limit + 0.2 * h * _range(v)[steps]
        there.small("a coordinate is the integral of its rate", name, off, limit)
        if smooth and rates:
            off = np.diff(v)[steps] - h * (a[steps] + a[steps + 1]) / 2.0
            limit = 2.0 * h * (change + tied * jumps) + 1e-7 * (1.0 + fast) + tol / h + err
            there.small("a rate is the integral of the acceleration", name, off, limit, told=2 * uncertain)

    for name in spins if smooth and rates else []:
        v, a = told[name], told[f"{name}.acceleration"]
        change = _around(np.abs(np.diff(a))[steps], left) + 1e-3 * (np.abs(a[steps]) + np.abs(a[steps + 1]))
        fast = np.maximum(np.abs(v[steps]), np.abs(v[steps + 1]))
        off = np.diff(v)[steps] - h * (a[steps] + a[steps + 1]) / 2.0
        limit = 2.0 * h * (change + tied * jumps) + 1e-7 * (1.0 + fast) + tol / h + err
        there.small("an angular velocity is the integral of its rate", name, off, limit, told=2 * uncertain)
    for owner in [name.removesuffix(".orientation.w") for name in told.values if name.endswith(".orientation.w")]:
        turning = told.attitude(owner)
        q, v, a = turning.quaternion, turning.angular, turning.angular_second
        there.small("a quaternion has length 1", owner, (np.linalg.norm(q, axis=1) - 1.0)[steps], 1e-12)
        step = h[:, None] * (v[steps] + v[steps + 1]) / 2.0
        bend = h**2 * np.linalg.norm(np.cross(v[steps], v[steps + 1]), axis=1)
        between = of_quaternion(q[steps]).swapaxes(1, 2) @ of_quaternion(q[steps + 1])
        turned = rotation_vector(between)
        if smooth:
            step = step - h[:, None] ** 2 * (a[steps + 1] - a[steps]) / 12.0
        change = np.linalg.norm(_around(np.abs(np.diff(a, axis=0)).max(axis=1)[steps], left)[:, None], axis=1)
        fast = np.maximum(np.linalg.norm(v[steps], axis=1), np.linalg.norm(v[steps + 1], axis=1))
        limit = 6.0 * h**2 * (change + jumps) + 2.0 * bend + 1e-8 * (1.0 + h * fast) + tol
        if not smooth:
            limit = limit + h * 10.0 * _range(np.linalg.norm(v, axis=1))[steps] + h * fastest
        elif not rates:
            limit = limit + 0.2 * h * _range(np.linalg.norm(v, axis=1))[steps]
        off = np.linalg.norm(turned - step, axis=1)
        there.small("an orientation is the integral of its angular velocity", owner, off, limit, h * fast < 1.5)


def _around(values: Array, left: float) -> Array:
    """The largest of each value and its two neighbours on either side, and what is left of those before."""
    wide = np.pad(values, 2, mode="edge")
    found = np.asarray(np.max(np.stack([wide[k : k + len(values)] for k in range(5)]), axis=0))
    for k in range(1, len(found)):
        found[k] = max(found[k], left * found[k - 1])
    return found


def _range(values: Array) -> Array:
    """Largest minus smallest of each value and its four neighbours on either side."""
    wide = np.pad(values, 4, mode="edge")
    around = np.stack([wide[k : k + len(values)] for k in range(9)])
    return np.asarray(np.ptp(around, axis=0))


def crossings(found: Faults, bodies: Bodies) -> None:
    """Between two rows without an event no guard passes from one side to the other."""
    told = bodies.told
    steps = np.flatnonzero(np.diff(told.time) > 0.0)
    there = found.at(told.time[steps + 1])
    for word in bodies.model.events:
        g = gap_of(word.guard, bodies).value
        before, after = g[steps], g[steps + 1]
        rises, falls = np.minimum(-before, after), np.minimum(before, -after)
        crossed = np.maximum(
            rises if word.direction >= 0 else 0.0 * g[steps], falls if word.direction <= 0 else 0.0 * g[steps]
        )
        there.small(
            "an event happens where its guard crosses zero",
            word.name,
            np.maximum(crossed, 0.0),
            1e-7 * (1.0 + np.abs(g).max()),
        )


def impacts(found: Faults, bodies: Bodies, run: mbd.Trajectory, T: Array) -> None:
    """A single contact that strikes rebounds with its restitution; no impact makes energy, unless ground moves."""
    told, settings = bodies.told, run.settings
    words = {word.name: word for word in bodies.model.contacts if isinstance(word, mbd.Unilateral)}
    times = np.array([event.time for event in run.events])
    energetic = bool(run.stats["energetic_impacts"])  # Stronge's law took the place of Newton's
    driven = any(
        isinstance(word, mbd.Bilateral) and not isinstance(word.value, float) for word in bodies.model.constraints
    )
    for event in run.events:
        word = words.get(event.name)
        if event.kind != "closed" or word is None or not 0 < event.row < len(told):
            continue
        alone = np.count_nonzero(times == event.time) == 1
        k = event.row
        there = found.at(told.time[k : k + 1])
        gap = gap_of(word.measure, bodies)
        met = [each for name, each in words.items() if told.closed[name][k - 1] or told.closed[name][k]]
        grounds = [gap, *(gap_of(each.measure, bodies) for each in met)]
        moving = driven or any(bool(np.any(each.drift)) or bool(np.any(each.carried)) for each in grounds)
        if not moving and not any(e.time == event.time and e.kind == "event" for e in run.events):
            scale = float(np.max(T))
            there.small("an impact makes no energy", event.name, max(T[k] - T[k - 1], 0.0), 1e-8 * scale + 1e-12)
        others = any(told.closed[name][k - 1] or told.closed[name][k] for name in words if name != event.name)
        if not alone or others or settings["impact"] != "newton" or energetic:
            continue
        rate = gap.rate(bodies)
        before, after = rate[k - 1], rate[k]
        slow = abs(before) <= 1.01 * settings["rest_speed"]
        wanted = 0.0 if slow else -word.restitution * before
        speeds = 1.0 + np.max(np.abs(rate[k - 1 : k + 1]))
        there.small(
            "an impact rebounds with its restitution", event.name, after - wanted, 1e-6 * speeds + float(slow) * 1e-3
        )


def openings(found: Faults, bodies: Bodies, run: mbd.Trajectory, limit: float) -> None:
    """An open contact is outside, but behind its opening for what its gap misses of the integral of its rate.

    A force that has fallen to zero lets a gap rise as the cube of time, and the error of a step grows as that.
    """
    told, notes = bodies.told, " ".join(map(str, run.stats["notes"]))
    h = np.diff(told.time)
    for word in bodies.model.contacts:
        if not isinstance(word, mbd.Unilateral) or word.only_while is not None or word.releases:
            continue
        if f"{word.name!r}" in notes:
            continue
        gap, open_ = gap_of(word.measure, bodies), ~told.closed[word.name].astype(bool)
        value, rate = gap.value, gap.rate(bodies)
        missed = np.abs(np.diff(value) - h * (rate[:-1] + rate[1:]) / 2.0)
        excuse = np.zeros(len(value))
        for k in range(2, len(value)):
            opened = h[k - 2] == 0.0 and not open_[k - 2]
            if open_[k] and value[k] < 0.0 and (opened or excuse[k - 1] > 0.0):
                excuse[k] = missed[k - 1] + excuse[k - 1]
        found.small("an open contact is outside", word.name, np.minimum(value, 0.0), limit + excuse, open_)


def passive(found: Faults, run: mbd.Trajectory) -> None:
    """What only takes energy has given none at any row, unless a note tells so."""
    ledger = run.energy
    notes = " ".join(map(str, run.stats["notes"]))
    swing = np.max(np.abs(ledger.kinetic), initial=0.0) + np.ptp(ledger.potential)
    there = found.at(ledger.time)
    for part in ledger.parts:
        if part.kind in PASSIVE and f"'{part.name}'" not in notes:
            there.small("a passive part gives no energy", part.name, np.maximum(part.energy, 0.0), 1e-6 * swing + 1e-9)
