"""One point of the lab: a scheme with a step, its errors, and what it cost."""

import sys
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from time import perf_counter, thread_time
from typing import Any

import numpy as np

from mbd.analysis.accuracy.published import Published
from mbd.analysis.accuracy.settings import Setting
from mbd.analysis.accuracy.truth import MIN_REPORTED_OVER_BOUND, Truth
from mbd.compile.mechanisms import mechanism_of
from mbd.dataclass import dataclass
from mbd.errors import MbdError
from mbd.integrators import Integrator
from mbd.results.trajectory import Trajectory
from mbd.simulation.interrupted import stopped
from mbd.simulation.simulate import simulate
from mbd.state import State

CLOCK = perf_counter if sys.platform == "win32" else thread_time
"""Processor time of the thread [s]; wall time where the system counts the other in steps of 16 ms."""

MAX_REPEATS, MAX_REPEAT_SECONDS = 5, 0.2
"""A run is repeated up to this many times, but not once this much wall time [s] is spent on it."""


@dataclass(frozen=True)
class Point:
    """A scheme with a step or a tolerance: how accurate, and at what cost.

    Parameters
    ----------
    scheme : the integrator's label
    dt : step [s]; None with a tolerance
    error : largest error of all quantities, relative to their ranges, over all instants [-]; None where it is not known
    at_most : what the error does not exceed: it with the bound of the reference; None where nothing is known
    errors, end_errors : of each quantity: the largest over the instants, and at the end
    order : observed between this step and the next coarser one; None where none can be observed
    seconds : processor time of the call, the least of some repeats, without derivation and compilation [s]
    steps, iterations, tangents, residuals, factorizations : counts of the run; Newton's are 0 for schemes of one's own
    drift, drift_rate : largest |h| [m or rad] and |ḣ| of the rows that act
    energy : largest energy that the scheme itself gained or lost [J]
    event_time : largest error of an event's instant, of those that the reference has too [s]; None: not known
    events : how many happened
    same_events : whether they are those of the reference
    left_out : share of the instants between an event and its match [-]
    failure : why there is no run, '' after a success
    note : what else should be known
    tol : tolerance that was asked for [m, rad]; None with fixed steps
    achieved : largest error of a coordinate, which `tol` is about [m, rad]; None: not known
    estimated : what the run itself takes that to be [m, rad]
    runs : how many runs there were, trial runs with it; counts are those of the one that is returned
    trials : share of the wall time that all but that one took, and comparing them [-]
    """

    scheme: str
    dt: float | None
    error: float | None = None
    at_most: float | None = None
    errors: Mapping[str, float] = field(default_factory=dict, repr=False)
    end_errors: Mapping[str, float] = field(default_factory=dict, repr=False)
    order: float | None = None
    seconds: float = float("nan")
    steps: int = 0
    iterations: int = 0
    tangents: int = 0
    residuals: int = 0
    factorizations: int = 0
    drift: float = 0.0
    drift_rate: float = 0.0
    energy: float = 0.0
    event_time: float | None = None
    events: int = 0
    same_events: bool = True
    left_out: float = 0.0
    failure: str = ""
    note: str = ""
    tol: float | None = None
    achieved: float | None = None
    estimated: float | None = None
    runs: int = 1
    trials: float = 0.0

    @property
    def setting(self) -> Setting:
        """Its step or its tolerance."""
        return Setting(self.dt, self.tol)

    def reaches(self, target: float) -> bool:
        """Whether the error is certainly no larger than that."""
        return not self.failure and self.at_most is not None and self.at_most <= target


@dataclass(frozen=True)
class Timed:
    """A run, its processor time and its wall time [s], and whether something was derived or compiled on the way."""

    run: Trajectory
    seconds: float
    wall: float
    compiled: bool


@dataclass(frozen=True)
class Subject:
    """What is run again and again: a model from a start to an end, with the options of `simulate`."""

    model: Any
    start: State
    until: Any
    options: Mapping[str, Any]

    def run(self, scheme: Integrator, setting: Setting, share: Callable[[float], None]) -> Timed:
        """A run and the processor time of the call.

        Raises
        ------
        KeyboardInterrupt
            where the user stopped it.
        """
        mechanism = mechanism_of(self.model, self.options.get("backend", "auto"), self.options.get("parameters"))
        last, begin = self.until[1] if isinstance(self.until, tuple) else self.until, self.start.time
        made, began, clock = mechanism.seconds, perf_counter(), CLOCK()
        run = simulate(
            self.model, self.start, scheme, **setting.arguments, until=self.until, **self.options, on_failure="return",
            progress=lambda t, _: share((t - begin) / max(last - begin, 1e-300)),
        )  # fmt: skip
        if stopped(run):
            raise KeyboardInterrupt
        return Timed(run, CLOCK() - clock, perf_counter() - began, mechanism.seconds > made)


def measured(
    subject: Subject, scheme: Integrator, label: str, setting: Setting, truth: Truth | Published | None,
    share: Callable[[float], None],
) -> Point:  # fmt: skip
    """Run a scheme, some times over, and judge it; `KeyboardInterrupt` where the user stopped it."""
    spent, best = 0.0, None
    point = Point(label, setting.dt, tol=setting.tol)
    for _ in range(MAX_REPEATS):
        try:
            latest = subject.run(scheme, setting, share)
        except MbdError as error:
            return replace(point, failure=str(error))
        if not latest.run.success and not _fails_by_energy_alone(latest.run, truth, subject):
            return replace(point, failure=latest.run.message, **_tolerance(latest))
        if best is None or latest.seconds < best.seconds:
            best = latest
        spent += latest.wall
        if spent > MAX_REPEAT_SECONDS and not latest.compiled:
            break
    assert best is not None
    run = best.run
    violation, stats = run.violation, run.stats
    names = ("steps", "iterations", "tangents", "residuals", "factorizations")
    try:
        judged = _judged(run, truth, scheme) if truth is not None else {"note": "there is no reference"}
    except MbdError as error:
        return replace(point, failure=str(error))
    if not run.success:
        judged["note"] = "; ".join(filter(None, [judged["note"], run.message.partition(";")[0]]))
    if setting.tol is not None:
        judged |= _tolerance(best) | {"achieved": None if truth is None else truth.achieved(run)}
    return replace(
        point, seconds=best.seconds, **{name: stats[name] for name in names},
        drift=max(violation.length, violation.angle), drift_rate=violation.rate,
        energy=float(np.max(np.abs(run.energy.numerical), initial=0.0)), events=len(run.events), **judged,
    )  # fmt: skip


def _fails_by_energy_alone(run: Trajectory, truth: Truth | Published | None, subject: Subject) -> bool:
    """Whether published values judge a run that did not succeed: only its energy is wrong, at its end."""
    last = subject.until[1] if isinstance(subject.until, tuple) else subject.until
    return isinstance(truth, Published) and bool(run.time[-1] >= last)


def _tolerance(timed: Timed) -> dict[str, Any]:
    """What a run to a tolerance says of itself."""
    run = timed.run
    tolerance = run.stats.get("tolerance")
    if tolerance is None:
        return {}
    return {
        "estimated": tolerance["estimated"], "runs": len(tolerance["runs"]),
        "trials": max(1.0 - run.stats["wall_seconds"] / timed.wall, 0.0),
    }  # fmt: skip


def _judged(run: Trajectory, truth: Truth | Published, scheme: Integrator) -> dict[str, Any]:
    """Errors of a run against what it is judged by, as far as that can tell."""
    unlike = truth.unlike(run)
    if unlike:
        return {"failure": unlike}
    known = truth.bound_of(scheme)
    found = truth.judged(run)
    worst = {name: max(found.largest.get(name, 0.0), found.at_end.get(name, 0.0)) for name in known}
    clear = {name: worst[name] >= MIN_REPORTED_OVER_BOUND * bound for name, bound in known.items()}
    leading = max(worst, key=lambda name: worst[name])
    if np.isinf(worst[leading]):
        return {"failure": f"{leading!r} is no number where it is one in the reference, or the other way round"}
    is_clear = clear[leading]
    notes = [] if is_clear else [f"no clear error beside the reference's own, {known[leading]:.1g}"]
    notes += [remark] if (remark := truth.remark(found)) else []
    return {
        "error": found.error if is_clear else None,
        "at_most": max(worst[name] + bound for name, bound in known.items()),
        "errors": {name: value for name, value in found.largest.items() if clear[name]},
        "end_errors": {
            name: value for name, value in found.at_end.items() if value >= MIN_REPORTED_OVER_BOUND * known[name]
        },
        "event_time": found.event_time if isinstance(truth, Truth) else None,
        "same_events": found.same_events, "left_out": found.left_out, "note": "; ".join(notes),
    }  # fmt: skip
