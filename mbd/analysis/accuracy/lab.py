"""The accuracy lab: a reference, then every scheme with every step against it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from typing import Any

from mbd.analysis.accuracy.choices import Plan, plan, steps_for
from mbd.analysis.accuracy.points import Point, Setting, measured, retimed
from mbd.analysis.accuracy.result import Accuracy
from mbd.analysis.accuracy.truth import Truth, stopped, truth
from mbd.assembly import is_number
from mbd.errors import ModelError
from mbd.integrators import Integrator
from mbd.simulation.simulate import simulate
from mbd.state import State
from mbd.trajectory import Trajectory
from mbd.view.progress import Progress, share_bar

__all__ = ["accuracy", "with_orders"]

PATIENCE = 5.0
"""Wall time for timing all points some more [s]."""
REFERENCE_RUNS = 3
"""Runs of the reference: itself, its bound, and the growth of errors."""


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
    **options: Any,
) -> Accuracy:
    """Measure what accuracy costs: errors, orders and wall times of schemes and steps, across impacts.

    The reference is of another kind than what it judges, Dormand & Prince's method 8(5,3) with error control on the
    mechanism's own accelerations; its own error is bounded by a second run with another tolerance and other steps. An
    error that is less than ten times that bound is not told.

    Parameters
    ----------
    model : a `Model` or `Lagrangian`
    start : from `mbd.assemble`
    until : end time [s], or the event that ends the runs, or (event, latest time)
    quantities : names of results; default all coordinates and their rates
    integrators : a list, or a dictionary by label; default five of the Newmark family
    dts : steps [s]; default six, halved each time, from the time scales of the model
    target : error that is wanted, relative to the range of a quantity, for the recommendation [-]
    progress : True for a bar on a terminal, or ``progress(done, total)`` in runs
    also : an integrator that joins the default ones where it is none of them
    options : those of `mbd.simulate`: contact, impact, locate, parameters, rest_speed, backend

    Returns
    -------
    Accuracy
        with what was measured until then if it was interrupted (Ctrl-C).
    """
    _check(target, options)
    options["parameters"] = {**getattr(start, "parameters", {}), **(options.get("parameters") or {})}
    chosen = plan(model, start, until, quantities, integrators, dts, options, also)
    with share_bar() if progress is True else nullcontext(progress or None) as told:
        bench = Bench(model, start, chosen, options, told)
        reference = bench.reference()
        points, complete = bench.points(target if dts is None else None)
    notes = _notes(reference, bench.chosen, points, complete)
    return Accuracy(
        chosen.probe.name, chosen.quantities, tuple(with_orders(points, chosen.schemes)), bench.known, target, complete,
        tuple(notes),
    )  # fmt: skip


class Bench:
    """Where the runs of one measurement are made."""

    def __init__(
        self, model: Any, start: State, chosen: Plan, options: Mapping[str, Any], told: Progress | None
    ) -> None:
        self.model, self.start, self.chosen, self.options, self.told = model, start, chosen, options, told
        self.total = REFERENCE_RUNS + chosen.count + 1
        self.known: Truth | None = None

    def share(self, place: int) -> Callable[[float], None]:
        """Progress of one run among all."""
        told = self.told
        return (lambda part: None) if told is None else lambda part: told(place + min(max(part, 0.0), 1.0), self.total)

    def reference(self) -> Truth | str:
        """What to judge by, or why there is none."""
        found = truth(
            self.model, self.start, self.chosen.until, self.chosen.quantities, self.chosen.step, self.chosen.sizes,
            self.options, [self.share(run) for run in range(REFERENCE_RUNS)],
        )  # fmt: skip
        self.known = None if isinstance(found, str) else found
        return found

    def points(self, target: float | None) -> tuple[list[Point], bool]:
        """Every scheme with every step, and whether it was not interrupted; steps around a target, if there is one."""
        found: list[Point] = []
        try:
            if target is not None:
                self.chosen = replace(self.chosen, dts=_around(self.chosen, target, self.point))
            for name, scheme in self.chosen.schemes.items():
                for dt in self.chosen.dts:
                    found.append(self.point(name, scheme, dt, len(found)))
            found = retimed(found, self.again, PATIENCE, self.share(self.total - 1))
            self.share(self.total - 1)(1.0)
        except KeyboardInterrupt:
            return found, False
        return found, True

    def point(self, name: str, scheme: Integrator, dt: float, place: int = 0) -> Point:
        """One measured point, the `place`-th of all."""
        share = self.share(REFERENCE_RUNS + place)
        return measured(
            self.model, self.start, self.chosen.until, scheme, name, Setting(dt), self.known, self.options, share
        )

    def again(self, point: Point) -> Trajectory:
        """One more run of a point."""
        scheme, until = self.chosen.schemes[point.scheme], self.chosen.until
        run = simulate(
            self.model, self.start, scheme, **Setting(point.dt).arguments, until=until, **self.options,
            on_failure="return",
        )  # fmt: skip
        if stopped(run):
            raise KeyboardInterrupt
        return run


def _around(chosen: Plan, target: float, point: Callable[[str, Integrator, float], Point]) -> tuple[float, ...]:
    """Steps around the one that reaches the target, judged by a first point or two; those of the plan otherwise."""
    name, scheme = next(iter(chosen.schemes.items()))
    for dt in chosen.dts[-2:]:
        first = point(name, scheme, dt)
        if first.error and not first.failure and first.same_events:
            return steps_for(target, first.error, dt, float(chosen.probe.time[-1]) - float(chosen.probe.time[0]))
    return chosen.dts


def _check(target: Any, options: Mapping[str, Any]) -> None:
    """Faults of the wanted error and of the options."""
    faults = []
    if target is not None and (not is_number(target) or not math.isfinite(target) or target <= 0.0):
        faults.append(f"target must be a positive relative error such as 1e-4, not {target!r}")
    allowed = ("contact", "impact", "locate", "parameters", "rest_speed", "backend")
    faults += [f"accuracy() has no option {name!r}; it has {', '.join(allowed)}" for name in options
               if name not in allowed]  # fmt: skip
    if faults:
        raise ModelError(faults)


def with_orders(points: Sequence[Point], schemes: Mapping[str, Any]) -> list[Point]:
    """The points with the orders between neighbours, where both errors are known and of the same events."""
    found = []
    for scheme in schemes:
        before: Point | None = None
        for point in (each for each in points if each.scheme == scheme):
            order = None
            if before is not None and point.error and before.error and point.same_events and before.same_events:
                order = math.log(before.error / point.error) / math.log(before.dt / point.dt)
            found.append(replace(point, order=order))
            before = point
    return found


def _notes(reference: Truth | str, chosen: Plan, points: Sequence[Point], complete: bool) -> list[str]:
    """What a reader must know before reading the errors."""
    notes = [] if complete else [f"interrupted: {len(points)} of {chosen.count} points were measured"]
    if isinstance(reference, str):
        return [*notes, reference]
    growth = reference.growth
    if not reference.same_events:
        notes.append("the two runs of the reference have not the same events; some are too short to be sure of")
    if reference.error > 0.01:
        notes.append(f"the reference has not converged: its two runs differ by {reference.error:.1g}")
    if growth is None:
        notes.append("the growth of errors could not be measured")
    elif growth > 1e3:
        notes.append(
            f"a small change of the start grows {growth:.1g} times: above 1e3 errors say little about a scheme"
        )
    failed = sum(bool(point.failure) for point in points)
    if failed:
        notes.append(f"{failed} {'point' if failed == 1 else 'points'} failed; the table says why")
    if any(not point.same_events for point in points):
        notes.append("where events are others than those of the reference (≠) no order can be observed")
    if chosen.probe.settings.get("contact") == "nonsmooth":
        notes.append("contacts are non-smooth: first order at impacts, whatever the scheme; orders scatter")
    return notes
