"""The verdict on a run, by mechanics written apart from the library's own."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

import mbd
from tests.fuzz import laws, steps
from tests.fuzz.bodies import Bodies
from tests.fuzz.faults import Fault, Faults
from tests.fuzz.geometry import Array
from tests.fuzz.loads import loads
from tests.fuzz.readings import Readings, readings
from tests.fuzz.stiffness import unknown_force

MOST = 48
"""Rows at which forces are balanced, at most."""
FEW = 12
"""Instants of a run that follows a tolerance below which steps are too long for laws from row to row.

An event stores several rows of one instant, which are no steps.
"""
BRIEFEST = 3e-7
"""Duration of steps [s] in which round-off of positions of a metre is a velocity of 10⁻⁹ m/s."""
SHARE = 1e-6
"""What the balance of a body may miss at a row, where Newton's method ends, over the sum of its terms [-]."""


@dataclass(frozen=True)
class Judgement:
    """faults : broken laws; tried : how often each law was tried; unjudged : words that this judge does not know."""

    faults: tuple[Fault, ...]
    tried: Mapping[str, int]
    unjudged: str = ""

    def __str__(self) -> str:
        return "\n".join(map(str, self.faults)) or f"{len(self.tried)} laws hold"


def judge(run: mbd.Trajectory, model: mbd.Model, parameters: Mapping[str, float] | None = None) -> Judgement:
    """Whether a run keeps the laws of mechanics.

    Places and motions of bodies come from forward kinematics of the description, with the coordinates that the run
    reports; forces from their laws, but reactions, contact forces and dry friction as reported; then every body
    is in balance, constraints hold, contacts push, friction opposes, and rows follow each other as a motion does.

    Parameters
    ----------
    run : of `model`; it may have failed, its rows count all the same
    parameters : those that differ from the model's
    """
    given = dict(parameters or {})
    told = readings(run, model, given)
    if not run.success:
        told = told.part(told.time < _until(run))
    found = Faults(told.time)
    for name, values in told.values.items():
        found.small("numbers are finite", name, ~np.isfinite(values), 0.5)
    if found.found or not len(told):
        return Judgement(tuple(found.found), found.tried)
    smooth = run.settings["contact"] != "nonsmooth"
    with np.errstate(all="ignore"):
        if run.settings["store"] == 1:
            _motion(found, run, told, smooth)
        try:
            _rows(found, run, model, told, smooth)
        except NotImplementedError as error:
            return Judgement(tuple(found.found), found.tried, str(error))
        if smooth and run.success:
            steps.passive(found, run)
    return Judgement(tuple(found.found), found.tried)


def _motion(found: Faults, run: mbd.Trajectory, told: Readings, smooth: bool) -> None:
    """Laws along rows, unless a note tells that dt resolves no steps: schemes that lag behind those err for a while."""
    if any("not resolved by dt" in str(note) for note in run.stats["notes"]):
        return
    tol = float(run.settings.get("tol") or 0.0)
    if tol and np.count_nonzero(np.diff(told.time) > 0.0) + 1 < FEW:
        return
    scheme, tied = run.settings["integrator"], bool(run.record.lam.shape[1])
    jumps = sum("beyond half a turn" in str(note) for note in run.stats["notes"])  # of a torque within a step
    uncertain, share = int(run.stats["singular_steps"]) + jumps, steps.error_share(scheme)
    warned = any("estimated errors of velocities add up" in str(note) for note in run.stats["notes"])
    err = float(run.stats["local_errors"]) if warned else 0.0
    left = steps.fading(scheme)
    steps.motion(found, told, smooth, "index3" not in scheme, uncertain, tied, share, tol, err, left)


def _unresolved(run: mbd.Trajectory, times: Array) -> Array:
    """Change of the accelerations over the step that holds a time, over their size (n,)."""
    a, k = run.record.a, np.searchsorted(run.time, times, side="right") - 1
    change = np.linalg.norm(a[k + 1] - a[k], axis=1)
    return np.asarray(change / (np.linalg.norm(a[k + 1], axis=1) + np.linalg.norm(a[k], axis=1) + 1e-9))


def _until(run: mbd.Trajectory) -> float:
    """The instant from which on a failed run says that its rows are none [s]."""
    head = run.message.partition(" s: ")[0].removeprefix("t = ")
    try:
        return float(head)
    except ValueError:
        return float(np.inf)


def _rows(found: Faults, run: mbd.Trajectory, model: mbd.Model, told: Readings, smooth: bool) -> None:
    """Laws at rows: guards and impacts at all of them, forces at a choice."""
    if model.events or model.contacts:
        everywhere = Bodies(model, told)
        if smooth:
            steps.crossings(found, everywhere)
            steps.impacts(found, everywhere, run, told["kinetic_energy"])
        steps.openings(found, everywhere, run, 10.0 * laws.HELD * laws.size_of(everywhere))
    chosen = _choice(run, len(told))
    bodies = Bodies(model, told.part(chosen))
    there = found.at(bodies.told.time)
    laws.places(there, bodies)
    uncertain = int(run.stats["singular_steps"])
    laws.closure(there, bodies, rates=smooth and "index3" not in run.settings["integrator"], told=uncertain)
    laws.constraints(there, bodies)
    acting = loads(bodies)
    if smooth and "index3" not in run.settings["integrator"]:
        laws.drives(there, bodies, run)
    if smooth:
        laws.balance(there, bodies, acting, SHARE, np.where(laws.kinks(bodies), np.inf, 0.0))
    laws.contacts(there, bodies, acting, run)
    laws.energies(there, bodies, acting)


def _choice(run: mbd.Trajectory, n: int) -> Array:
    """Some of n rows: the first and last, those at events, and others evenly."""
    rows = {0, n - 1, *np.linspace(0, n - 1, min(n, MOST // 2)).astype(int)}
    at_events = [row for event in run.events for row in (event.row - 1, event.row, event.row + 1) if 0 <= row < n]
    rows |= set(at_events[: MOST // 2])
    return np.array(sorted(rows))


def between(run: mbd.Trajectory, model: mbd.Model, parameters: Mapping[str, float] | None = None) -> Judgement:
    """Whether what a run tells between its rows keeps the laws as its rows do.

    Loops and constraints hold as at rows, velocities too but in index 3. Where the scheme's own interpolation is of low
    order, forces may miss a fiftieth of what they are made of; where a tolerance was asked for, what such an error of
    velocities changes of them; in a step to rest, which takes the mean direction of a friction in a plane, what that
    turns.
    """
    time = run.time
    steps_of = np.flatnonzero(np.diff(time) > BRIEFEST)
    if run.settings["contact"] == "nonsmooth" or len(steps_of) < 4:
        return Judgement((), {})
    some = steps_of[np.unique(np.linspace(0, len(steps_of) - 1, 12).astype(int))]
    times = np.concatenate([(1.0 - part) * time[some] + part * time[some + 1] for part in (0.3, 0.62)])
    times = np.sort(times[(times > np.repeat(0.0, len(times)))])
    given = dict(parameters or {})
    told = readings(run, model, given, times)
    found = Faults(told.time)
    tol = run.settings["tol"] if run.settings.get("tol") else 0.0
    # with dry friction no step is taken again: curves pass through rows, as good as the order of the scheme
    has_friction = run.record.equations is None or bool(run.record.equations.frictions)
    again = run.settings["between"].startswith("stages") and not has_friction
    precise = again or run.settings["integrator"].startswith(("RungeKutta853", "Radau"))
    with np.errstate(all="ignore"):
        try:
            bodies = Bodies(model, told)
            laws.places(found, bodies)
            h = np.diff(time)[np.searchsorted(time, times, side="right") - 1]
            uncertain = 4 * int(run.stats["singular_steps"])  # a row ends two steps, each looked at twice
            laws.closure(found, bodies, rates="index3" not in run.settings["integrator"], told=uncertain)
            share = 1e-5 if precise else 0.02 + _unresolved(run, times)
            stiff = unknown_force(bodies, tol, h, laws.size_of(bodies)) if tol and not again else 0.0
            laws.balance(found, bodies, loads(bodies), share, stiff + _turned(run, model, times))
            laws.constraints(found, bodies)
        except NotImplementedError as error:
            return Judgement(tuple(found.found), found.tried, str(error))
    return Judgement(tuple(found.found), found.tried)


def _turned(run: mbd.Trajectory, model: mbd.Model, times: Array) -> Array:
    """Change of the frictions in planes over the steps at whose ends they stick, 0 elsewhere (n,) [N]."""
    found, k = np.zeros(len(times)), np.searchsorted(run.time, times, side="right") - 1
    known = set(run.names)
    ends = {(event.name, event.row - 2) for event in run.events if event.kind == "stuck"}
    for name in (word.name for word in model.contacts):
        for part in (f"{name}.friction.forward", f"{name}.friction.sideways"):
            if part in known:
                there = np.array([(name, row) in ends for row in k])
                found += there * np.abs(run[part][k + 1] - run[part][k])
    return found
