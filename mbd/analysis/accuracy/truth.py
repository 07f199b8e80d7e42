"""The reference of the lab, its own error bound, and how fast errors grow by themselves."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace
from time import perf_counter
from typing import Any

import numpy as np

from mbd.analysis.accuracy.compare import Difference, differences, ranges
from mbd.analysis.accuracy.reference import Method, RungeKuttaReference
from mbd.arrays import Vector
from mbd.assembly.manager import manager_of
from mbd.compile.mechanisms import mechanism_of
from mbd.dataclass import dataclass
from mbd.errors import MbdError
from mbd.integrators import Integrator, RadauIIA, RungeKutta853
from mbd.results.trajectory import Trajectory
from mbd.simulation.interrupted import stopped
from mbd.simulation.simulate import simulate
from mbd.state import State

TIGHT, LOOSE = 1e-12, 1e-10
"""Tolerances of the reference and of the run that bounds its error [-]."""
MAX_INSTANTS = 400
"""Common instants at which runs are compared, at most: stored rows of the reference, which need no interpolation."""
VELOCITY_PERTURBATION = 1e-9
"""Part of their range by which the velocities of the start are changed, to measure how errors grow [-]."""
CHECKS = (2.0, 8.0, 32.0)
"""Steps between rows of the reference over those of the runs that check it, one after the other [-]."""
MIN_REPORTED_OVER_BOUND = 10.0
"""An error is reported where it is this many times the bound of what it was judged by [-]."""
WORDS = {"DOP853": "Dormand–Prince 8(5,3)", "Radau": "Radau IIA of order 5"}
KIN: dict[Method, type[Integrator]] = {"DOP853": RungeKutta853, "Radau": RadauIIA}
"""Schemes with the formulas of a reference."""

Share = Callable[[float], None]
"""Told which share of a run is done, 0 … 1."""


@dataclass(frozen=True, eq=False)
class Truth:
    """A run that others are judged by.

    Parameters
    ----------
    run : of the reference
    method : what it was integrated with, in words
    instants : at which runs are compared [s]
    scales : range of each quantity
    bound : of the reference's own error of each quantity, relative to its range: the difference between two runs, with
        tolerances of 1e-12 and 1e-10 and half the step between rows
    event_bound : the same of its event times [s]
    same_events : whether both have the same events
    growth : how many times a small change of the start has grown at most [-]; None where it could not be measured
    seconds : wall time of all that [s]
    kind : which formulas it has
    checked : bound by another scheme: difference to a run of `RadauIIA`, of each quantity; for schemes that have the
        formulas of the reference and might share its errors; None: there is none
    """

    run: Trajectory = field(repr=False)
    method: str
    instants: Vector = field(repr=False)
    scales: Mapping[str, float]
    bound: Mapping[str, float]
    event_bound: float
    same_events: bool
    growth: float | None
    seconds: float
    kind: Method = "DOP853"
    checked: Mapping[str, float] | None = None

    def is_kin(self, scheme: Integrator) -> bool:
        """Whether a scheme has the formulas of the reference."""
        return isinstance(scheme, KIN[self.kind])

    def bound_of(self, scheme: Integrator) -> Mapping[str, float]:
        """What the reference is known to where it judges a scheme, for each quantity [-]."""
        return self.checked if self.checked is not None and self.is_kin(scheme) else self.bound

    @property
    def error(self) -> float:
        """The largest bound of all quantities [-]."""
        return max(self.bound.values(), default=0.0)

    @property
    def origin(self) -> str:
        """What it is and how far it may be trusted, in a sentence or two."""
        events = len(self.run.events)
        growth = "" if self.growth is None else f"; a small change of the start grows {self.growth:.2g} times"
        text = f", its events ({events}) to {self.event_bound:.1g} s" if events else ""
        return f"{self.method}, known to {self.error:.1g}{text}{growth}; {self.seconds:.1f} s"

    @property
    def struck(self) -> bool:
        """Whether there are impacts."""
        return any(event.kind == "closed" for event in self.run.events)

    def judged(self, run: Trajectory) -> Difference:
        """How far a run is from this one."""
        return differences(run, self.run, self.scales, self.instants)

    def unlike(self, run: Trajectory) -> str:
        """Why a run is not to be compared with this one; '' where it is."""
        early = run.time[-1] < self.run.time[-1] - 1e-9 * abs(self.run.time[-1]) and run.status == 1
        return f"{run.message}, where the reference goes on" if early and self.run.status != 1 else ""

    def achieved(self, run: Trajectory) -> float | None:
        """Largest error of a coordinate [m, rad]; None where it is not clear beside the reference's own."""
        names = [name for name, _ in run.facts.coordinates][: run.facts.coordinate_count]
        found = differences(run, self.run, dict.fromkeys(names, 1.0), self.instants)
        floor = max((self.bound[name] * self.scales[name] for name in names if name in self.bound), default=0.0)
        return found.error if found.error >= MIN_REPORTED_OVER_BOUND * floor else None

    def remark(self, found: Difference) -> str:
        """What else is to be said of a difference."""
        return f"{found.left_out:.0%} of the instants lie beside events" if found.left_out > 0.2 else ""


def truth(
    model: Any, start: State, until: Any, names: Sequence[str], step: float, sizes: Sequence[float],
    options: Mapping[str, Any], shares: Sequence[Share], schemes: Sequence[Integrator] = (),
) -> Truth | str:  # fmt: skip
    """The reference, or in a sentence why there is none.

    Parameters
    ----------
    until : end time, or (event, latest time)
    names : the quantities
    step : between two rows of the reference [s]
    sizes : of q, v and z
    options : of `simulate`
    shares : progress of the three runs, and of a fourth with `RadauIIA` where it is needed
    schemes : that will be judged
    """
    located = {**options, "contact": "events", "locate": "root"}
    last = until[1] if isinstance(until, tuple) else until
    began = perf_counter()

    def run(method: Method, tolerance: float, dt: float, begin: State, share: Share) -> Trajectory:
        """One run of the reference scheme."""
        return simulate(
            model, begin, RungeKuttaReference(tolerance, tuple(sizes), method), dt=dt, until=until, **located,
            on_failure="return",
            progress=lambda t, _: share((t - start.time) / max(last - start.time, 1e-300)),
        )  # fmt: skip

    messages = []
    for method in ("DOP853", "Radau"):
        tight = run(method, TIGHT, step, start, shares[0])
        loose = run(method, LOOSE, step / 2.0, start, shares[1]) if tight.success else tight
        if stopped(tight) or stopped(loose):
            raise KeyboardInterrupt
        if tight.success and loose.success:
            break
        messages.append(f"{method}: {tight.message if not tight.success else loose.message}")
    else:
        return "there is no reference: " + "; ".join(messages)
    instants = chosen(tight.time)
    scales = ranges(tight, names, instants)
    apart = differences(loose, tight, scales, instants)
    bound = {name: max(apart.largest.get(name, 0.0), apart.at_end.get(name, 0.0)) for name in scales}
    if max(bound.values(), default=0.0) > 0.01:  # it has not converged, and judges nobody
        return _unconverged(bound, method, apart)
    growth = _growth(model, start, tight, options, lambda begin: run(method, TIGHT, step, begin, shares[2]))
    found = Truth(
        tight, f"{WORDS[method]}, tolerance {TIGHT:g}", instants, scales, bound,
        apart.event_time, apart.same_events, growth, perf_counter() - began, method,
    )  # fmt: skip
    if method != "DOP853" or not any(found.is_kin(scheme) for scheme in schemes):
        return found

    def other(dt: float) -> Trajectory:
        """One run of another scheme."""
        return simulate(
            model, start, RadauIIA(), dt=dt, until=until, **located, on_failure="return",
            progress=lambda t, _: shares[-1]((t - start.time) / max(last - start.time, 1e-300)),
        )  # fmt: skip

    return replace(found, checked=_by_another(found, other, step), seconds=perf_counter() - began)


def _by_another(found: Truth, run: Callable[[float], Trajectory], step: float) -> dict[str, float] | None:
    """Bound of the reference by runs of another scheme, finer ones until they agree with it or take long."""
    checked: dict[str, float] | None = None
    for parts in CHECKS:
        try:
            other = run(step / parts)
        except MbdError:  # a scheme that cannot integrate this checks nothing
            return checked
        checked = _checked(other, found, checked)
        known = max(checked.values(), default=0.0) if checked is not None else np.inf
        if (
            # near enough is three times the bound of the reference
            known <= 3.0 * found.error or other.stats["wall_seconds"] > 3.0
        ):  # no finer one is made after 3 s
            break
    return checked


def _unconverged(bound: Mapping[str, float], method: Method, apart: Difference) -> str:
    """Why two runs that differ so much are no reference."""
    worst = max(bound, key=lambda name: bound[name])
    others = "" if apart.same_events else " and have other events"
    return (
        f"there is no reference, it has not converged: two runs of {WORDS[method]} with tolerances {TIGHT:g} and "
        f"{LOOSE:g} differ by {bound[worst]:.1g} of the range of {worst!r}{others}; the motion is too sensitive, try a "
        "shorter time"
    )


def _checked(other: Trajectory, found: Truth, before: dict[str, float] | None) -> dict[str, float] | None:
    """The larger of the reference's bound and its difference to a run of another scheme, by quantity.

    `before` is that of a coarser run, which stays where this one says no more.
    """
    if stopped(other):
        raise KeyboardInterrupt
    if not other.success:
        return before
    apart = differences(other, found.run, found.scales, found.instants)
    if not apart.same_events:
        return before
    now = {
        name: max(known, apart.largest.get(name, 0.0), apart.at_end.get(name, 0.0))
        for name, known in found.bound.items()
    }
    return now if before is None else {name: min(value, before[name]) for name, value in now.items()}


def chosen(times: Vector) -> Vector:
    """Some of the times of a run's rows, evenly spread, the last among them and the first not."""
    wanted = np.linspace(times[0], times[-1], MAX_INSTANTS + 1)[1:]
    places = np.clip(np.searchsorted(times, wanted - 0.5 * (wanted[1] - wanted[0])), 1, len(times) - 1)
    return np.unique(np.append(times[places], times[-1]))


def motion(run: Trajectory) -> list[str]:
    """Names of all coordinates and their rates."""
    names = [name for name, _ in run.facts.coordinates]
    return [*names, *(name for name in run.facts.rates if name in run)]


def _growth(
    model: Any, start: State, reference: Trajectory, options: Mapping[str, Any], run: Callable[[State], Trajectory]
) -> float | None:
    """Largest difference of two runs over that of their starts, all relative to the ranges of the motion."""
    instants = chosen(reference.time)
    scales = ranges(reference, motion(reference), instants)
    nudged = _nudged(model, start, reference, options)
    other = run(nudged)
    if stopped(other):
        raise KeyboardInterrupt
    if not other.success:
        return None
    apart = differences(other, reference, scales, instants)
    rates = np.array([scales.get(name, 1.0) for name in start.velocity_names])
    begun = float(np.max(np.abs(nudged.v - start.v) / rates, initial=0.0))
    if not begun > 0.0:
        return None
    return apart.error / begun


def _nudged(model: Any, start: State, reference: Trajectory, options: Mapping[str, Any]) -> State:
    """The start with velocities changed by `VELOCITY_PERTURBATION` of their range, as far as closed rows allow."""
    mechanism = mechanism_of(model, options.get("backend", "auto"), options.get("parameters"))
    manager = manager_of(mechanism, reference.record.parameters)
    y = np.concatenate([start.v, start.z])
    terms = mechanism.acceleration_terms(start.time, start.q, y, reference.record.parameters, start.anchors)
    rows = list(manager.active_rows(manager.flags(start.mode.closed)))
    n, n_v = len(y), len(start.v)
    swing = np.ptp(reference.record.v, axis=0) if len(reference.record.v) else np.ones(n_v)
    change = np.zeros(n)
    change[:n_v] = VELOCITY_PERTURBATION * swing * np.where(np.arange(n_v) % 2 == 0, 1.0, -0.7)
    if rows:
        B = terms.B[rows]
        matrix = np.block([[terms.M, B.T], [B, np.zeros((len(rows), len(rows)))]])
        right = np.concatenate([np.zeros(n), -B @ change])
        change = change + np.linalg.lstsq(matrix, right, rcond=None)[0][:n]
    return replace(start, v=start.v + change[:n_v], memory=None)
