"""What every run must keep, whatever its scene is; run as a program, the worker of a batch (`tests.fuzz.batch`)."""

import json
import re
import sys
import time
import traceback
from pathlib import Path

import numpy as np

import mbd
from tests.simulation.wild import wild_scene

ADVICE = re.compile(r"; |: |use |try |give |leave |hold |raise |name |move |change |make |lower |lock ")
"""A message that tells what to try has a second part."""


def verdict(seed: int, scenes=wild_scene) -> dict:
    """How a scene ended: 'ok', 'stopped' in the run, 'refused' before it, or 'bad' with reasons."""
    began = time.perf_counter()
    told = {"number": seed, "scene": "", "message": "", "reasons": []}
    try:
        scene = scenes(seed)
        told["scene"] = f"{scene.integrator!r} dt={scene.dt:.3g} until={scene.until:.3g} {dict(scene.options)}"
        run = scene.run()
        told["reasons"] = complaints(run)
    except mbd.MbdError as error:
        told |= {"kind": "refused", "message": f"{type(error).__name__}: {error}"}
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        reason = f"crashed: {error!r} at {Path(place.filename).name}:{place.lineno}"
        told |= {"kind": "bad", "message": repr(error), "reasons": [reason]}
    else:
        told |= {"kind": "ok" if run.success else "stopped", "message": run.message}
    if told["kind"] != "ok" and not explains(told["message"]):
        told["reasons"].append("the message names nothing of the model, or nothing to try")
    if told["reasons"]:
        told["kind"] = "bad"
    return told | {"seconds": round(time.perf_counter() - began, 2)}


def explains(message: str) -> bool:
    """Whether a message quotes a name, and has a part that says what to do."""
    return bool(re.search(r"'[^']+'", message)) and bool(ADVICE.search(message))


def complaints(run: mbd.Trajectory) -> list[str]:
    """What a run, whether it went to its end or not, does not keep."""
    found = []
    record = run.record
    for name in ("time", "q", "v", "z", "a", "s", "lam"):
        if not np.isfinite(getattr(record, name)).all():
            found.append(f"{name} is not finite")
    if found:
        return found
    held = run.violation
    size = 1.0 + float(np.max(np.abs(record.q), initial=0.0)) + _extent(run)
    floor = 1e-8 * size + (_located_roughly(run) if run.settings["locate"] == "linear" else 0.0)
    if max(held.length, held.angle) > floor:
        found.append(f"rows do not hold: {held}")
    return found + _ledger(run) + _gifts(run) + _penetration(run, floor) + _friction(run)


def _extent(run: mbd.Trajectory) -> float:
    """Largest length of the model [m]."""
    given = {name: abs(value) for name, value in run.parameters.items() if not name.startswith("gravity")}
    return max([value for name, value in given.items() if name.endswith((".x", ".y", ".z", ".length"))], default=0.0)


def _located_roughly(run: mbd.Trajectory) -> float:
    """What linear location promises: dt² times accelerations [m, rad]."""
    return run.settings["dt"] ** 2 * float(np.max(np.abs(run.record.a), initial=0.0))


def _ledger(run: mbd.Trajectory) -> list[str]:
    books = run.energy
    values = [*books.sums.values(), books.numerical, books["kinetic"]]
    if not all(np.isfinite(value).all() for value in values):
        return ["the energy books are not finite"]
    blows = books.by_kind().get("impact", np.zeros(0))
    largest = float(np.max(np.abs(books["kinetic"]), initial=0.0))
    gained = float(np.max(np.diff(blows), initial=0.0))
    if run.settings["contact"] == "events" and gained > 1e-9 * largest:  # non-smooth steps lift bodies too
        return [f"an impact gives {gained:.3g} J, the largest kinetic energy is {largest:.3g} J"]
    return []


PASSIVE = ("joint loss", "damper", "friction", "impact")


def _gifts(run: mbd.Trajectory) -> list[str]:
    """Passive parts that give more energy than they take, unless the run failed or doubts its own energy."""
    if not run.success or "numerical energy" in run.message:
        return []
    size = 1.0 + float(np.max(run.energy.kinetic))
    gains = {
        part.name: float(np.max(part.energy - part.energy[0]))
        for part in run.energy.parts
        if part.kind in PASSIVE and not part.withheld
    }
    return [f"{name!r} gives {gain:.3g} J" for name, gain in gains.items() if gain > 1e-9 * size]


def _penetration(run: mbd.Trajectory, floor: float) -> list[str]:
    """Gaps of multiplier contacts that are below zero and not told of; contacts that keep pulling."""
    told, found, ends = " ".join(run.stats["notes"]), [], _at_ends(run)
    for contact in run.record.equations.contacts:
        if contact.kind != "unilateral":
            continue
        deepest = float(np.min(run[f"{contact.name}.gap"], initial=0.0, where=ends))
        if deepest < -10.0 * floor and f"{contact.name!r} lay" not in told and f"{contact.name!r} was rel" not in told:
            found.append(f"{contact.name!r} is {-deepest:.3g} {contact.unit} below its surface, and no note says so")
        found += _pulls(run, contact)
    return found


def _pulls(run: mbd.Trajectory, contact) -> list[str]:
    """A closed contact that opens on pull pushes in every row and in every impact, to round-off of all multipliers."""
    if contact.opens_on != "pull":
        return []
    lam = run.record.lam
    rows = np.max(np.abs(lam), axis=1, initial=0.0)
    size = 1e-7 * rows + 1e-12 * np.max(rows, initial=0.0)
    pull = np.where(lam[:, contact.rows[0]] > size, lam[:, contact.rows[0]], 0.0)
    blows = [
        event
        for event in run.events
        if event.name == contact.name and event.kind == "closed" and np.min(event.impulse[:1], initial=0.0) < -1e-12
    ]
    found = [f"{contact.name!r} has an impulse of {event.impulse[0]:.3g}" for event in blows[:1]]
    if pull.any():
        found.append(f"{contact.name!r} pulls in {np.count_nonzero(pull)} rows, with up to {np.max(pull):.3g}")
    return found


def _at_ends(run: mbd.Trajectory):
    """Rows at which gaps must be ≥ 0, (R,) booleans; instants located inside a non-smooth step are not among them.

    Non-smooth steps correct positions at their ends only; a mat, an event or a controller may cut them.
    """
    if run.settings["contact"] != "nonsmooth":
        return np.full(len(run.time), True)
    feet = {contact.name for contact in run.record.equations.contacts if contact.kind == "unilateral"}
    return ~np.isin(run.time, [event.time for event in run.events if event.name not in feet])


def lasts(run: mbd.Trajectory, wrong) -> bool:
    """Whether something is wrong at five instants one after the other: the multipliers of single steps may err."""
    later = np.diff(run.time, prepend=-np.inf) > 0.0
    return bool(np.convolve(wrong[later], np.ones(5)).max(initial=0.0) >= 5.0) if later.any() else False


def _friction(run: mbd.Trajectory) -> list[str]:
    """Dry friction that stays beyond its limit."""
    frictions, found = run.record.equations.frictions, []
    if not frictions:
        return []
    columns = run._model_columns
    limits = columns.evaluate([friction.limit for friction in frictions], columns.rows)
    largest = float(np.max(np.abs(run.record.lam), initial=0.0))
    for friction, limit in zip(frictions, limits, strict=True):
        force = np.abs(run.record.lam[:, friction.row])
        if lasts(run, force > 1.001 * np.abs(limit) + 1e-6 * largest):
            k = int(np.argmax(force - np.abs(limit)))
            found.append(f"friction of {friction.name!r} is {force[k]:.6g}, more than {np.ravel(limit)[k]:.6g}")
    return found + _drives(run, frictions)


def _drives(run: mbd.Trajectory, frictions) -> list[str]:
    """Friction that slides takes energy: its force and the velocity along it have opposite signs."""
    columns, found = run._model_columns, []
    if not run.success:
        return []
    later = np.diff(run.time, append=np.inf) > 0.0  # just before a switch it may have passed its rest already
    rates = columns.evaluate([friction.rate for friction in frictions], columns.rows)
    for number, (friction, rate) in enumerate(zip(frictions, rates, strict=True)):
        slides = (np.abs(run.record.phase[:, number]) == 1) & later
        power = np.where(slides, -run.record.lam[:, friction.row] * rate, 0.0)
        size = np.max(np.abs(run.record.lam[:, friction.row])) * 1e-6
        if np.any(power > size):
            k = int(np.argmax(power))
            found.append(f"friction of {friction.name!r} drives with {power[k]:.3g} W at t = {run.time[k]:.6g} s")
    return found


if __name__ == "__main__":
    for seed in json.load(sys.stdin):
        print(json.dumps(verdict(seed)), flush=True)
