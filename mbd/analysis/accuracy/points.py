"""One point of the lab: a scheme with a step, its errors, and what it cost."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.analysis.accuracy.compare import differences
from mbd.analysis.accuracy.truth import Truth, stopped
from mbd.compile.mechanisms import mechanism_of
from mbd.errors import MbdError
from mbd.integrators import Integrator
from mbd.simulation.simulate import simulate
from mbd.state import State

if TYPE_CHECKING:
    from mbd.trajectory import Trajectory

__all__ = ["Point", "Setting", "measured", "retimed"]

REPEATS, ENOUGH = 5, 0.2
"""A run is repeated up to this many times, but not once this much wall time [s] is spent on it."""
ROUNDS = 3
"""Rounds over all points that time them once more."""
CLEAR = 10.0
"""An error is told where it is this many times the bound of the reference [-]."""


@dataclass(frozen=True)
class Setting:
    """How fine a run is: its step [s]."""

    dt: float

    @property
    def arguments(self) -> dict[str, Any]:
        """For `simulate`."""
        return {"dt": self.dt}

    def __str__(self) -> str:
        return f"dt = {self.dt:.4g} s"


@dataclass(frozen=True)
class Point:
    """A scheme with a step: how accurate, and at what cost.

    Parameters
    ----------
    scheme : the integrator's label
    dt : step [s]
    error : largest error of all quantities, relative to their ranges, over all instants [-]; None where it is not known
    at_most : what the error does not exceed: it with the bound of the reference; None where nothing is known
    errors, end_errors : of each quantity: the largest over the instants, and at the end
    order : observed between this step and the next coarser one; None where none can be observed
    seconds : wall time, the least of some repeats, without derivation and compilation [s]
    steps, iterations, tangents, residuals, factorizations : counts of the run; Newton's are 0 for schemes of one's own
    drift, drift_rate : largest |h| [m or rad] and |ḣ| of the rows that act
    energy : largest energy that the scheme itself gained or lost [J]
    event_time : largest error of an event's instant, of those that the reference has too [s]; None: not known
    events : how many happened
    same_events : whether they are those of the reference
    left_out : share of the instants between an event and its match [-]
    failure : why there is no run, '' after a success
    note : what else should be known
    """

    scheme: str
    dt: float
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

    def reaches(self, target: float) -> bool:
        """Whether the error is certainly no larger than that."""
        return not self.failure and self.at_most is not None and self.at_most <= target


def measured(
    model: Any, start: State, until: Any, scheme: Integrator, label: str, setting: Setting, truth: Truth | None,
    options: Mapping[str, Any], share: Callable[[float], None],
) -> Point:  # fmt: skip
    """Run a scheme, some times over, and judge it.

    Raises
    ------
    KeyboardInterrupt
        where the user stopped it.
    """
    last = until[1] if isinstance(until, tuple) else until
    mechanism = mechanism_of(model, options.get("backend", "auto"), options.get("parameters"))
    spent, best, run = 0.0, float("inf"), None
    for repeat in range(REPEATS):
        made = mechanism.seconds
        try:
            run = simulate(
                model, start, scheme, **setting.arguments, until=until, **options, on_failure="return",
                progress=lambda t, _: share((t - start.time) / max(last - start.time, 1e-300)),
            )  # fmt: skip
        except MbdError as error:
            return Point(label, setting.dt, failure=str(error))
        if stopped(run):
            raise KeyboardInterrupt
        if not run.success:
            return Point(label, setting.dt, failure=run.message)
        seconds = run.stats["wall_seconds"]
        best = min(best, seconds - (mechanism.seconds - made))
        spent += seconds
        if spent > ENOUGH and (repeat > 0 or mechanism.seconds == made):
            break
    assert run is not None
    violation, stats = run.violation, run.stats
    names = ("steps", "iterations", "tangents", "residuals", "factorizations")
    judged = _judged(run, truth) if truth is not None else {"note": "there is no reference"}
    return Point(
        label, setting.dt, seconds=best, **{name: stats[name] for name in names},
        drift=max(violation.length, violation.angle), drift_rate=violation.rate,
        energy=float(np.max(np.abs(run.energy.numerical), initial=0.0)), events=len(run.events), **judged,
    )  # fmt: skip


def retimed(
    points: Sequence[Point], once: Callable[[Point], Trajectory], patience: float, share: Callable[[float], None]
) -> list[Point]:
    """The points with the least wall time of some more rounds over all of them.

    Whatever else the machine did during one point's repeats then spoils no comparison.

    Parameters
    ----------
    once : a run of a point
    patience : wall time for all rounds [s]
    """
    found, began = list(points), perf_counter()
    for _ in range(ROUNDS):
        for place, point in enumerate(found):
            spent = perf_counter() - began
            if spent + (0.0 if point.failure else point.seconds) >= patience:
                return found
            share(spent / patience)
            if not point.failure:
                found[place] = replace(point, seconds=min(point.seconds, once(point).stats["wall_seconds"]))
    return found


def _judged(run: Any, truth: Truth) -> dict[str, Any]:
    """Errors of a run against the reference, as far as that can tell."""
    early = run.time[-1] < truth.run.time[-1] - 1e-9 * abs(truth.run.time[-1]) and run.status == 1
    if early and truth.run.status != 1:
        return {"failure": f"{run.message}, where the reference goes on"}
    found = differences(run, truth.run, truth.scales, truth.instants)
    clear = {
        name: max(found.largest.get(name, 0.0), found.at_end.get(name, 0.0)) >= CLEAR * bound
        for name, bound in truth.bound.items()
    }
    worst = {name: max(found.largest.get(name, 0.0), found.at_end.get(name, 0.0)) for name in truth.bound}
    leading = max(worst, key=lambda name: worst[name])
    told = clear[leading]
    notes = [] if told else [f"no clear error beside the reference's own, {truth.bound[leading]:.1g}"]
    notes += [f"{found.left_out:.0%} of the instants lie beside events"] if found.left_out > 0.2 else []
    return {
        "error": found.error if told else None,
        "at_most": max(worst[name] + bound for name, bound in truth.bound.items()),
        "errors": {name: value for name, value in found.largest.items() if clear[name]},
        "end_errors": {name: value for name, value in found.at_end.items() if value >= CLEAR * truth.bound[name]},
        "event_time": found.event_time, "same_events": found.same_events, "left_out": found.left_out,
        "note": "; ".join(notes),
    }  # fmt: skip
