"""The accuracy lab: a reference, then every scheme with every step against it."""

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from itertools import pairwise
from time import perf_counter
from typing import Any

from mbd.analysis.accuracy.choices import Plan, plan
from mbd.analysis.accuracy.points import Point, Subject, measured
from mbd.analysis.accuracy.published import Known, Published
from mbd.analysis.accuracy.result import Accuracy
from mbd.analysis.accuracy.settings import Setting, is_high, steps_for
from mbd.analysis.accuracy.truth import Truth, truth
from mbd.bodies.values import is_number
from mbd.errors import ModelError
from mbd.integrators import Integrator
from mbd.progress import Progress, share_bar
from mbd.state import State

MAX_ROUNDS, MIN_TIMED_SECONDS = 10, 0.3
"""Rounds over all points, the quickest first, that time each once more until it took this much time [s]."""

COUNTS = ("steps", "iterations", "tangents", "residuals", "factorizations", "events")
"""What a run does: one that does no less of anything takes no less time."""

OPTIONS = ("contact", "impact", "locate", "parameters", "rest_speed", "backend")
"""Of `simulate`, which every run shares."""
MAX_TIMING_SECONDS = 5.0
"""Wall time for timing all points some more [s]."""
REFERENCE_RUNS = 4
"""Runs of the reference: itself, its bound, the growth of errors, and a check by another scheme."""


def accuracy(
    model: Any,
    start: State,
    until: float | str | tuple[str, float],
    quantities: Sequence[str] | str | None = None,
    integrators: Sequence[Integrator] | Mapping[str, Integrator] | None = None,
    dts: Sequence[float] | None = None,
    target: float | None = None,
    progress: Progress | bool | None = None,
    also: Integrator | None = None,
    tols: Sequence[float] | None = None,
    known: Mapping[str, Known | float] | None = None,
    **options: Any,
) -> Accuracy:
    """Measure what accuracy costs: errors, orders and processor times of schemes, steps and tolerances, across impacts.

    The reference is Dormand & Prince's method 8(5,3) with error control on the mechanism's own accelerations; its own
    error is bounded by a second run with another tolerance and other steps, and where it judges `RungeKutta853`, which
    has its formulas, by a run of `RadauIIA` too. An error that is less than ten times that bound is not told.

    Parameters
    ----------
    model : a `Model` or `Lagrangian`
    start : from `mbd.assemble`
    until : end time [s], or the event that ends the runs, or (event, latest time)
    quantities : names of results; default all coordinates and their rates
    integrators : a list, or a dictionary by label; default four of the Newmark family, `RadauIIA` and `RungeKutta853`
    dts : steps [s] of all schemes; default six, halved each time, from the time scales of the model, longer ones for
        schemes of high order, which stop where their error is that of the reference
    tols : tolerances of ``simulate(tol=)`` [m, rad], for the schemes that follow one. Where either of dts and tols is
        given only that is measured; where none is, tolerances around the target, or of three sizes
    target : error that is wanted, relative to the range of a quantity, for the recommendation [-]
    progress : True for a bar on a terminal, or ``progress(done, total)`` in runs
    also : an integrator that joins the default ones where it is none of them
    known : published values to judge by, by quantity, in place of quantities and of a reference of the lab's own: over
        times for which that would take hours, or where only such a number says which of two runs is right
    options : those of `mbd.simulate`: contact, impact, locate, parameters, rest_speed, backend; store with known values

    Returns
    -------
    Accuracy
        with what was measured until then if it was interrupted (Ctrl-C).
    """
    _check(target, options, known)
    options["parameters"] = {
        **(start.parameters if isinstance(start, State) else {}),
        **(options.get("parameters") or {}),
    }
    chosen = plan(model, start, until, quantities, integrators, dts, options, also, tols, target, known)
    with share_bar() if progress is True else nullcontext(progress or None) as report:
        bench = Bench(model, start, chosen, options, report)
        reference = bench.reference()
        points, complete = bench.points(target)
    notes = _notes(reference, bench.chosen, points, complete)
    ordered = points if _unordered(bench) else with_orders(points, chosen.schemes)
    return Accuracy(
        chosen.probe.name, chosen.quantities, tuple(ordered), bench.known, target, complete, tuple(notes),
    )  # fmt: skip


class Bench:
    """Where the runs of one measurement are made."""

    def __init__(
        self, model: Any, start: State, chosen: Plan, options: Mapping[str, Any], report: Progress | None
    ) -> None:
        self.subject, self.chosen, self.report = Subject(model, start, chosen.until, options), chosen, report
        self.total = REFERENCE_RUNS + chosen.count + 1
        self.known: Truth | Published | None = None

    def share(self, place: int) -> Callable[[float], None]:
        """Progress of one run among all."""
        report, total = self.report, self.total
        return (lambda part: None) if report is None else lambda part: report(place + min(max(part, 0.0), 1.0), total)

    def reference(self) -> Truth | Published | str:
        """What to judge by, or why there is none."""
        subject, chosen = self.subject, self.chosen
        if chosen.known is not None:
            self.known = chosen.known
            return self.known
        found = truth(
            subject.model, subject.start, chosen.until, chosen.quantities, chosen.step, chosen.sizes, subject.options,
            [self.share(run) for run in range(REFERENCE_RUNS)], tuple(chosen.schemes.values()),
        )  # fmt: skip
        self.known = None if isinstance(found, str) else found
        return found

    def points(self, target: float | None) -> tuple[list[Point], bool]:
        """Every scheme with every setting, and whether it was not interrupted; own steps are around a target."""
        found: list[Point] = []
        try:
            if target is not None and self.chosen.own:
                self.chosen = self.chosen.with_steps(_around(self.chosen, target, self.point))
            place = 0
            for name, settings in self.chosen.settings.items():
                self._of(name, settings, place, found)
                place += len(settings)
            found = retimed(found, self.again, MAX_TIMING_SECONDS, self.share(self.total - 1))
            self.share(self.total - 1)(1.0)
        except KeyboardInterrupt:
            return found, False
        return found, True

    def _of(self, name: str, settings: Sequence[Setting], place: int, found: list[Point]) -> None:
        """The points of one scheme; own settings end where the error is no longer clear beside the reference's."""
        done: set[bool] = set()
        for k, setting in enumerate(settings):
            by_tolerance = setting.tol is not None
            if by_tolerance in done:
                continue
            point = self.point(name, setting, place + k)
            found.append(point)
            if self.chosen.own and self.known is not None and not point.failure and point.error is None:
                done.add(by_tolerance)

    def point(self, name: str, setting: Setting, place: int = 0) -> Point:
        """One measured point, the `place`-th of all."""
        share = self.share(REFERENCE_RUNS + place)
        return measured(self.subject, self.chosen.schemes[name], name, setting, self.known, share)

    def again(self, point: Point) -> float:
        """Processor time of one more run of a point [s]."""
        return self.subject.run(self.chosen.schemes[point.scheme], point.setting, lambda part: None).seconds


def _around(chosen: Plan, target: float, point: Callable[[str, Setting], Point]) -> tuple[float, ...]:
    """Steps of low order around the one that reaches the target, judged by a first point or two; else as planned."""
    low = [name for name, scheme in chosen.schemes.items() if not is_high(scheme)]
    dts = [setting.dt for setting in chosen.settings[low[0]] if setting.dt is not None] if low else []
    for dt in dts[-2:]:
        first = point(low[0], Setting(dt))
        if first.error and not first.failure and first.same_events:
            return steps_for(target, first.error, dt, float(chosen.probe.time[-1]) - float(chosen.probe.time[0]))
    return tuple(dts)


def _check(target: Any, options: Mapping[str, Any], known: Any) -> None:
    """Faults of the wanted error and of the options."""
    faults = []
    if target is not None and (not is_number(target) or not math.isfinite(target) or target <= 0.0):
        faults.append(f"target must be a positive relative error such as 1e-4, not {target!r}")
    allowed = (*OPTIONS, *(["store"] if known is not None else []))
    faults += [f"accuracy() has no option {name!r}; it has {', '.join(allowed)}" for name in options
               if name not in allowed]  # fmt: skip
    if faults:
        raise ModelError(faults)


def with_orders(points: Sequence[Point], schemes: Mapping[str, Any]) -> list[Point]:
    """The points with the orders between neighbouring steps, where both errors are known and of the same events."""
    found = []
    for scheme in schemes:
        before: Point | None = None
        for point in (each for each in points if each.scheme == scheme):
            known = before is not None and before.error and before.same_events and point.error and point.same_events
            if known and before is not None and before.error and point.error and before.dt and point.dt:
                order = math.log(before.error / point.error) / math.log(before.dt / point.dt)
                found.append(replace(point, order=order))
            else:
                found.append(replace(point, order=None))
            before = point
    return found


def _unordered(bench: Bench) -> bool:
    """Whether impacts are corrected at the ends of steps, so that no order can be observed."""
    return bench.known is not None and bench.known.struck and bench.chosen.probe.settings.get("contact") == "nonsmooth"


def _notes(reference: Truth | Published | str, chosen: Plan, points: Sequence[Point], complete: bool) -> list[str]:
    """What a reader must know before reading the errors."""
    notes = [] if complete else [f"interrupted: {len(points)} of {chosen.count} points were measured"]
    notes += chosen.skipped
    if isinstance(reference, str):
        return [*notes, reference]
    growth = reference.growth
    if not reference.same_events:
        notes.append("the two runs of the reference have not the same events; some are too short to be sure of")
    notes += _kinship(reference, chosen) if isinstance(reference, Truth) else []
    if growth is None and isinstance(reference, Truth):
        notes.append("the growth of errors could not be measured")
    elif growth is not None and growth > 1e3:
        notes.append(
            f"a small change of the start grows {growth:.1g} times: above 1e3 errors say little about a scheme"
        )
    failed = sum(bool(point.failure) for point in points)
    if failed:
        notes.append(f"{failed} {'point' if failed == 1 else 'points'} failed; the table says why")
    notes += [
        f"{point.scheme} with {point.setting} is off by {point.achieved:.2g} at or between its rows, more than asked"
        for point in points if point.tol is not None and point.achieved is not None and point.achieved > point.tol
    ]  # fmt: skip
    if any(not point.same_events for point in points):
        notes.append("where events are others than those of the reference (≠) no order can be observed")
    if chosen.probe.settings.get("contact") == "nonsmooth":
        notes.append("contacts are non-smooth, of first order at impacts whatever the scheme: no order can be observed")
    return notes


def _kinship(reference: Truth, chosen: Plan) -> list[str]:
    """Which schemes have the formulas of the reference, and what bounds the errors that both might share."""
    kin = [name for name, scheme in chosen.schemes.items() if reference.is_kin(scheme)]
    if not kin:
        return []
    if reference.checked is not None:
        apart = max(reference.checked.values(), default=0.0)
        known = f"a run of RadauIIA, another scheme, agrees with it to {apart:.1g}"
    else:
        known = "errors that both might share have not been looked for by another scheme"
    return [f"{', '.join(kin)}: the reference has the same formulas, with steps of its own; {known}"]


def retimed(
    points: Sequence[Point], once: Callable[[Point], float], patience: float, share: Callable[[float], None]
) -> list[Point]:
    """The points with the least time of some more rounds over all of them.

    Whatever else the machine did during one point's repeats then spoils no comparison. Neighbours of a scheme of which
    the one with more work takes less time (`folds`) are timed again and again until they do not, or patience ends.

    Parameters
    ----------
    once : time of one more run of a point [s]
    patience : wall time for all rounds [s]
    """
    found, began = list(points), perf_counter()
    places = sorted((k for k, point in enumerate(found) if not point.failure), key=lambda k: found[k].seconds)

    def again(chosen: Sequence[int], turn: int, until: float) -> bool:
        """Whether there was time to run them all once more."""
        for place in chosen:
            point, spent = found[place], perf_counter() - began
            if spent + point.seconds >= until:
                return False
            share(min(spent / patience, 1.0))
            if turn * point.seconds <= MIN_TIMED_SECONDS:
                found[place] = replace(point, seconds=min(point.seconds, once(point)))
        return True

    for turn in range(MAX_ROUNDS):
        if not again(places, turn, 0.8 * patience):
            break
    for _ in range(MAX_ROUNDS):
        folded = sorted({place for pair in folds(found) for place in pair})
        if not folded or not again(folded, 0, patience):
            break
    return found


def folds(points: Sequence[Point]) -> list[tuple[int, int]]:
    """Places of neighbours of a scheme, of which the second does no less of anything and yet takes less time."""
    lines: dict[str, list[int]] = {}
    for place, point in enumerate(points):
        if not point.failure and point.dt is not None:
            lines.setdefault(point.scheme, []).append(place)
    return [
        (first, second)
        for line in lines.values()
        for first, second in pairwise(sorted(line, key=lambda place: -(points[place].dt or 0.0)))
        if points[second].seconds < points[first].seconds
        and all(getattr(points[second], name) >= getattr(points[first], name) for name in COUNTS)
    ]
