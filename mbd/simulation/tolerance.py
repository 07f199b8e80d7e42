"""A tolerance on the whole run: trial runs whose difference tells the error of their coordinates.

A scheme controls the error of each step; what becomes of it by the end depends on the motion, which may damp errors or
make them grow. With the local error held to `allowed` per second, the error E of a coordinate anywhere in the run goes
like ``E ∝ allowed^κ``, κ the order of the scheme over that of its estimate. Two runs A and B, allowed a > b, differ by
``D = E_A − E_B``, so that ``E_B = D / ((a/b)^κ − 1)``. A third run follows where that misses the tolerance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.results.dense import Restepping
from mbd.results.interpolation import quintic
from mbd.results.matching import apart, matched
from mbd.trajectory import Trajectory

if TYPE_CHECKING:
    from mbd.simulation.run import Run

__all__ = ["FIRST", "PILOT", "Gap", "Outcome", "Trial", "calibrated", "gap"]

PILOT = 10.0
"""Allowed error of the pilot run over that of the first run [-]."""
APART = 3.0
"""Ratio of allowed errors from which the errors of two runs are told apart [-]."""
FIRST = 0.5
"""Local errors of the first run, summed up, over the tolerance [-]."""
TARGET = 0.3
"""Part of the tolerance that a repeated run aims at [-]."""
WELL = 0.1
"""Estimated error over the tolerance below which a looser run is tried [-]."""
BLIND = 1e3
"""How much finer the next run is where two runs took the same steps [-]."""
EPS = float(np.finfo(float).eps)
ALIKE = 0.1
"""How far apart instants of two runs may be, over their mean step, where their steps are the same [-]."""
ROUND_OFF = 1e-14
"""Difference of two runs that is no more than round-off [m, rad]."""
BEYOND = 3.0
"""Estimated error over the tolerance above which it counts as missed once repeats are used up [-]."""
MOST_REPEATS = 3
"""Runs after the pilot and the first one [-]."""
CHANGE = 1e4
"""Most by which the allowed error changes from one run to the next [-]."""
SAMPLES = 400
"""Instants at which two runs are compared, at most, those of the rows of one of them [-]."""
GROWING = 1e3
"""Growth of errors above which a run says so [-]."""
BESIDE = 1e-9
"""Instants this close to an event are not compared, relative to the length of the run [-]."""


@dataclass(frozen=True)
class Gap:
    """Largest difference of a coordinate [m, rad] between two runs, which one, and the largest shift of an event [s].

    same : whether both runs have the same events
    """

    size: float
    name: str
    shift: float
    same: bool


@dataclass(frozen=True, eq=False)
class Trial:
    """A run with a local error of `allowed` [m/s, rad/s]; `error` is the estimate of its global one [m, rad]."""

    allowed: float
    run: Trajectory
    problem: str
    source: Run
    error: float = np.inf
    gap: Gap | None = None

    @property
    def spent(self) -> float:
        """Sum of the local errors [m, rad]."""
        return float(self.run.stats["local_errors"])

    @property
    def growth(self) -> float:
        """Global error over the sum of local errors [-]."""
        return self.error / self.spent if self.spent > 0.0 else np.nan


@dataclass(frozen=True, eq=False)
class Outcome:
    """The run that counts and what went wrong ('' if nothing did)."""

    trial: Trial
    problem: str


def calibrated(run: Callable[[float], Trial], tol: float, allowed: float, power: float) -> Outcome:
    """Runs until the estimated error of one agrees with the tolerance.

    Parameters
    ----------
    run : makes a run with a local error per second; tol : [m, rad]; allowed : what the tolerance would be per
        second if errors did not grow; power : κ
    """
    pilot = run(PILOT * FIRST * allowed)
    if not pilot.problem and pilot.run.stats["steps"] == 0:  # it ended where it began
        return _told([pilot], replace(pilot, error=0.0), tol, "")
    if pilot.source.interrupted:
        return _told([pilot], pilot, tol, pilot.problem)
    trials = [] if pilot.problem else [pilot]
    wanted: float | None = FIRST * allowed
    loosened = False
    for _ in range(MOST_REPEATS + 1):
        if wanted is None:
            break
        found = run(wanted)
        if found.problem:
            return _told([*trials, found], found, tol, found.problem)
        trials = _estimated([*trials, found], power)
        best = _best(trials, tol)
        wanted = _wanted(trials, best, tol, power, loosened)
        loosened = loosened or (wanted or 0.0) > best.allowed
    missed = not best.error <= BEYOND * tol
    return _told(trials, best, tol, _unreached(trials, best, tol) if missed else "")


def _wanted(trials: Sequence[Trial], best: Trial, tol: float, power: float, loosened: bool) -> float | None:
    """What the next run allows; None: the best is good. A run that is far too good is loosened once."""
    if not np.isfinite(best.error):
        return min(trial.allowed for trial in trials) / (BLIND if best.gap is None else PILOT)
    if best.error <= tol:
        coarsest = all(trial.allowed <= best.allowed or _same_steps(trial, best) for trial in trials)
        if best.error >= WELL * tol or loosened or (coarsest and len(trials) > 2):
            return None
        if best.error == 0.0 or best.gap is None or best.gap.size <= ROUND_OFF:
            return None  # runs differ by round-off: the motion is that easy
    reach = (TARGET * tol / best.error) ** (1.0 / power)
    return float(best.allowed * min(max(reach, 1.0 / CHANGE), CHANGE))


def _estimated(trials: Sequence[Trial], power: float) -> list[Trial]:
    """The error of each run by its difference from the finest, of that one by its difference from the next coarser.

    Two runs of the same steps tell nothing of each other: without a third their errors are infinite, without a gap,
    unless the steps are so short, as before an early event, that local errors are round-off.
    """
    finest = min(trials, key=lambda trial: trial.allowed)
    seen = {id(trial): _against(trial, finest, power) for trial in trials if not _same_steps(trial, finest)}
    coarser = [t for t in trials if id(t) in seen and t.allowed >= APART * finest.allowed]
    known = replace(finest, error=np.inf, gap=None)
    if coarser:
        other = seen[id(min(coarser, key=lambda trial: trial.allowed))]
        ratio = (finest.allowed / other.allowed) ** power
        known = replace(finest, error=max(ratio * other.error, _floor(finest, other)), gap=other.gap)
    elif len(trials) > 1 and not seen and _is_rounding(finest):
        known = replace(finest, error=_rounding(finest) * float(finest.run.stats["steps"]))
    return [seen.get(id(trial)) or replace(trial, error=known.error, gap=known.gap) for trial in trials]


def _against(trial: Trial, finest: Trial, power: float) -> Trial:
    """A run with the error that its difference from a finer one tells."""
    told = gap(trial.run, finest.run)
    ratio = (finest.allowed / trial.allowed) ** power
    part = 1.0 / (1.0 - ratio) if ratio < 0.5 else 2.0
    least = _rounding(trial) * float(trial.run.stats["steps"])
    return replace(trial, error=max(part * told.size, least) if told.same else np.inf, gap=told)


def _floor(trial: Trial, other: Trial) -> float:
    """Error by round-off: of the largest coordinate in each step, grown as local errors did in another run."""
    growth = other.growth if np.isfinite(other.growth) else 1.0
    return max(growth, 1.0) * _rounding(trial) * float(trial.run.stats["steps"])


def _rounding(trial: Trial) -> float:
    """Round-off of the largest coordinate [m, rad]."""
    return EPS * float(np.max(np.abs(trial.run.record.q), initial=0.0))


def _is_rounding(trial: Trial) -> bool:
    """Whether the local errors of a run are round-off."""
    return trial.spent <= _rounding(trial) * float(trial.run.stats["steps"])


def _same_steps(one: Trial, other: Trial) -> bool:
    """Whether two runs took about the same steps, so that they have about the same error."""
    first, second = one.run.time, other.run.time
    if len(first) != len(second):
        return False
    return bool(np.max(np.abs(first - second), initial=0.0) <= ALIKE * (first[-1] - first[0]) / len(first))


def _best(trials: Sequence[Trial], tol: float) -> Trial:
    """The run whose error comes nearest the tolerance from below; else the most accurate."""
    below = [trial for trial in trials if trial.error <= tol]
    return max(below, key=lambda trial: trial.error) if below else min(trials, key=lambda trial: trial.error)


def _told(trials: Sequence[Trial], best: Trial, tol: float, problem: str) -> Outcome:
    """The run that counts, with what the trials have shown among its statistics."""
    stats = best.run.record.stats
    stats["tolerance"] = {
        "requested": tol, "estimated": float(best.error), "growth": float(best.growth),
        "event_shift": best.gap.shift if best.gap is not None else 0.0,
        "runs": [
            {"allowed": trial.allowed, "estimated": float(trial.error), "steps": trial.run.stats["steps"],
             "rejected": trial.run.stats["rejected"], "seconds": trial.run.stats["wall_seconds"]}
            for trial in trials
        ],
    }  # fmt: skip
    if not problem and best.growth > GROWING and not _is_rounding(best):
        stats["notes"].append(
            f"errors grew {best.growth:.2g}-fold: the motion is so sensitive that small differences decide it"
        )
    if not problem and best.error > tol:
        stats["notes"].append(f"the estimated error {best.error:.2g} is above tol = {tol:g}")
    if best.gap is not None and not best.gap.same:
        stats["notes"].append("runs at different tolerances have different events; their error is not known")
    return Outcome(best, problem)


def _unreached(trials: Sequence[Trial], best: Trial, tol: float) -> str:
    """Why no run is as accurate as was asked for."""
    name = best.gap.name if best.gap is not None else ""
    where = f" (of {name!r})" if name else ""
    if not np.isfinite(best.error):
        why = (
            "took the same steps, so that their error is not known; give dt=" if best.gap is None else
            "have different events, so that their error is not known; the motion is too sensitive, or give dt="
        )  # fmt: skip
        return f"tol = {tol:g} was not reached: runs at tolerances down to {trials[-1].allowed:.2g} per second {why}"
    stuck = any(_is_rounding(trial) for trial in trials)
    why = "smaller steps do not make it smaller, which is the floor of round-off" if stuck else (
        f"{len(trials)} runs did not come nearer"
    )  # fmt: skip
    grew = f"; errors grew {best.growth:.2g}-fold" if best.growth > 1.0 else ""
    return (
        f"tol = {tol:g} was not reached: the best run has an estimated error of {best.error:.2g}{where}; {why}{grew}; "
        "ask for less, or for a shorter time"
    )


def gap(run: Trajectory, other: Trajectory) -> Gap:
    """How far apart the coordinates of two runs are, away from their events; also at their ends."""
    begin, end = float(run.time[0]), min(float(run.time[-1]), float(other.time[-1]))
    pairs = matched(run.events, other.events, begin, end)
    shifted = pairs.pairs + pairs.late
    own = np.unique(run.time[run.time <= end])
    instants = np.append(own[:: max(1, len(own) // SAMPLES)], end)
    instants = instants[apart(instants, shifted, BESIDE * (end - begin))]
    difference = np.max(np.abs(_positions(run, instants) - _positions(other, instants)), axis=0, initial=0.0)
    if not pairs.late:
        difference = np.maximum(difference, np.abs(run.record.q[-1] - other.record.q[-1]))
    worst = int(np.argmax(difference)) if difference.size else -1
    equations = run.record.equations
    names = [c.name for c in equations.coordinates] if equations is not None else []
    return Gap(
        float(difference[worst]) if worst >= 0 else 0.0, names[worst] if 0 <= worst < len(names) else "",
        max((abs(a - b) for a, b in shifted), default=0.0), pairs.alone == 0,
    )  # fmt: skip


def _positions(run: Trajectory, instants: Vector) -> Matrix:
    """Coordinates at instants: by steps that end there, else by quintic polynomials, which suit long steps best."""
    columns = run._model_columns
    places = columns.grid.places(instants)
    if Restepping.serves(columns) or columns.equations.compose is not None:
        return np.asarray(columns.between(places).q)
    record = run.record
    return quintic(places, record.q, record.v, record.a)
