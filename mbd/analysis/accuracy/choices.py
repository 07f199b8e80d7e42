"""What the lab does by default: schemes, steps from the model's time scales, all coordinates."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from typing import Any

import numpy as np

from mbd.analysis.accuracy.published import Published, published, table_of
from mbd.analysis.accuracy.settings import Setting, is_high, long_steps, steps_of, tolerances
from mbd.analysis.accuracy.truth import motion
from mbd.analysis.wanted import names_wanted, scalars_wanted
from mbd.bodies.values import is_number, shown
from mbd.compile.mechanisms import mechanism_of
from mbd.dataclass import dataclass
from mbd.errors import ModelError, SimulationError
from mbd.integrators import HHT, GeneralizedAlpha, Integrator, Newmark, RadauIIA, RungeKutta853
from mbd.kernel.contact.active_set import ActiveSetManager
from mbd.results.trajectory import Trajectory
from mbd.simulation.capabilities import refusals
from mbd.simulation.interrupted import stopped
from mbd.simulation.run.strategy import chosen as strategy_of
from mbd.simulation.simulate import simulate
from mbd.state import State

PROBES = (2000, 20000, 200000)
"""Steps of the run that looks for time scales, until one succeeds."""
PROBE_STEP = 1e-3
"""Its step where the end is an event [s]."""
MIN_ROWS, MAX_ROWS = 1500, 4000
"""Rows of the reference."""


@dataclass(frozen=True, eq=False)
class Plan:
    """What is compared: schemes and their settings by label, quantities, the end, step [s] and sizes of the reference.

    own : whether the lab chose the settings, and may leave out those that tell nothing new
    skipped : which schemes follow no tolerance, in a sentence each
    known : published values to judge by; None: the lab integrates a reference
    """

    schemes: Mapping[str, Integrator]
    settings: Mapping[str, tuple[Setting, ...]]
    quantities: tuple[str, ...]
    until: Any
    step: float
    sizes: tuple[float, ...]
    own: bool
    skipped: tuple[str, ...]
    probe: Trajectory = field(repr=False)
    known: Published | None = None

    @property
    def count(self) -> int:
        """How many points there are at most."""
        return sum(map(len, self.settings.values()))

    def with_steps(self, dts: Sequence[float]) -> Plan:
        """Other steps for the schemes of low order."""
        changed = {
            name: settings if is_high(self.schemes[name]) else (
                *(Setting(dt) for dt in dts), *(setting for setting in settings if setting.dt is None)
            )
            for name, settings in self.settings.items()
        }  # fmt: skip
        return replace(self, settings=changed)


def label(scheme: Integrator) -> str:
    """A scheme in short: 'HHT(alpha=0.05), index 3'."""
    text = repr(scheme)
    bare = text.replace(", formulation='index3'", "").replace("formulation='index3'", "")
    return f"{bare}, index 3" if bare != text else text


def plan(
    model: Any,
    start: Any,
    until: Any,
    quantities: Any,
    integrators: Any,
    dts: Any,
    options: Mapping[str, Any],
    also: Any = None,
    tols: Any = None,
    target: float | None = None,
    known: Any = None,
) -> Plan:
    """Arguments checked, all faults at once, and completed from a first run."""
    faults = [] if isinstance(start, State) else [f"start must be a State from mbd.assemble(model, …), not {start!r}"]
    faults += _wrong_schemes(integrators) + _wrong_schemes(None if also is None else [also])
    faults += _wrong_numbers(dts, "dts", "steps [s]", "a step must be a positive number of seconds")
    faults += _wrong_numbers(tols, "tols", "tolerances [m, rad]", "a tolerance must be a positive error of coordinates")
    faults += [] if quantities is None else names_wanted(quantities, "quantities")[1]
    if known is not None and quantities is not None:
        faults.append("either quantities or known values: with these, they are the quantities")
    if faults:
        raise ModelError(faults)
    options = {name: value for name, value in options.items() if name != "store"}
    given = None if known is None else table_of(known)
    probe, until = _probe(model, start, until, options, quantities, dts if known is not None else None)
    values = None if given is None else published(given, probe)
    wanted = _quantities(probe, quantities) if values is None else tuple(values.known)
    able = Able(model, options)
    schemes = integrators if integrators is not None else _schemes(able, bool(probe.record.lam.shape[1]), also)
    named = dict(schemes) if isinstance(schemes, Mapping) else {label(scheme): scheme for scheme in schemes}
    span = float(probe.time[-1]) - start.time
    settings, skipped = _settings(named, able, probe, span, dts, tols, target)
    step = float(np.clip(steps_of(probe, span)[0], span / MAX_ROWS, span / MIN_ROWS))
    columns = (probe.record.q, probe.record.v, probe.record.z)
    sizes = np.concatenate([np.max(np.abs(column), axis=0, initial=0.0) for column in columns])
    sizes = np.where(sizes > 1e-6, sizes, np.max(sizes, initial=0.0) or 1.0)
    own = dts is None and tols is None
    return Plan(named, settings, wanted, until, step, tuple(map(float, sizes)), own, tuple(skipped), probe, values)


class Able:
    """Which schemes can run, and follow a tolerance, with the rows and contacts of a model."""

    def __init__(self, model: Any, options: Mapping[str, Any]) -> None:
        self.equations = mechanism_of(model, options.get("backend", "auto"), options.get("parameters")).equations
        self.manager, self.options = ActiveSetManager(self.equations), options

    def refused(self, scheme: Integrator, tol: float | None = None) -> list[str]:
        """Why not, [] where it can."""
        contact, locate = self.options.get("contact", "auto"), self.options.get("locate", "root")
        contact, _ = strategy_of(contact, self.manager, locate, tol is not None)
        return refusals(self.equations, scheme, {**self.options, "contact": contact, "locate": locate, "tol": tol})


def _settings(
    schemes: Mapping[str, Integrator], able: Able, probe: Trajectory, span: float, dts: Any, tols: Any, target: Any
) -> tuple[dict[str, tuple[Setting, ...]], list[str]]:
    """Steps, then tolerances of each scheme, and which follow none; own ones where neither was given."""
    given = None if dts is None else sorted(map(float, dts), reverse=True)
    own, found, skipped = dts is None and tols is None, {}, []
    ranges = [float(np.ptp(column)) for column in probe.record.q.T]
    for name, scheme in schemes.items():
        steps = given or ((long_steps if is_high(scheme) else steps_of)(probe, span) if own else ())
        asked = tolerances(scheme, ranges, target) if own else sorted(map(float, () if tols is None else tols))[::-1]
        refused = able.refused(scheme, asked[0]) if len(asked) else []
        if refused and not able.refused(scheme):
            skipped.append(f"{name} follows no tolerance here: {refused[0]}")
        kept = () if refused else tuple(asked)
        found[name] = (*(Setting(dt) for dt in steps), *(Setting(tol=tol) for tol in kept))
    return found, skipped


def _wrong_schemes(integrators: Any) -> list[str]:
    if integrators is None:
        return []
    given = list(integrators.values()) if isinstance(integrators, Mapping) else integrators
    if not isinstance(given, Sequence) or isinstance(given, str | bytes) or not given:
        return [f"integrators must be a list of integrators, or a dictionary by label, not {integrators!r}"]
    return [
        f"{each!r} is no integrator; give values such as mbd.HHT(alpha=0.05)"
        for each in given if not isinstance(each, Integrator)
    ]  # fmt: skip


def _wrong_numbers(given: Any, name: str, what: str, rule: str) -> list[str]:
    if given is None:
        return []
    if isinstance(given, str | bytes) or not isinstance(given, Sequence | np.ndarray) or len(given) == 0:
        return [f"{name} must be a list of {what}, not {given!r}"]
    return [
        f"{name}: {rule}, not {shown(each)}"
        for each in given
        if not is_number(each) or not math.isfinite(each) or each <= 0.0
    ]


def _schemes(able: Able, rows: bool, also: Any) -> tuple[Integrator, ...]:
    """Four of the family, from no damping to much, index 3 where there are rows; two of high order; and one's own."""
    last = HHT(alpha=0.05, formulation="index3") if rows else HHT(alpha=0.3)
    wanted = (Newmark(), HHT(alpha=0.05), GeneralizedAlpha(rho_inf=0.5), last, RadauIIA(), RungeKutta853())
    known = tuple(scheme for scheme in wanted if not able.refused(scheme))
    return known if also is None or also in known else (*known, also)


def _probe(
    model: Any, start: State, until: Any, options: Mapping[str, Any], wanted: Any, steps: Any = None
) -> tuple[Trajectory, Any]:
    """A run that finds the end and the time scales; and the end as (event, latest time) or a time.

    wanted : names of results, whose faults are reported before a run fails
    steps : that will be taken, where time scales are of no use: the run is short then
    """
    scheme = GeneralizedAlpha(rho_inf=0.8)
    if isinstance(until, str):
        latest = start.time + 200000 * PROBE_STEP  # the event that ends the run is no longer waited for then
        run = simulate(model, start, scheme, dt=PROBE_STEP, until=(until, latest), **options)
        if run.status != 1:
            raise ModelError(f"until: {until!r} did not happen before t = {latest:g} s; give (name, latest time)")
        return run, (until, start.time + 1.5 * (float(run.time[-1]) - start.time) + 1e-3)
    last = until[1] if isinstance(until, tuple) and len(until) == 2 else until
    given = is_number(last) and math.isfinite(last)
    if not given or last <= start.time:
        raise ModelError(f"until must be a time [s] after the start at {start.time:g} s, an event's name, or "
                         f"(name, latest time), not {until!r}")  # fmt: skip
    if steps is not None:
        dt = float(min(steps))
        end = min(last, start.time + 20 * dt)
        run = simulate(model, start, scheme, dt, until=end, **options, on_failure="return")
        if stopped(run):
            raise KeyboardInterrupt
        return run, until
    for count in PROBES:
        run = simulate(
            model, start, scheme, dt=(last - start.time) / count, until=until, **options, on_failure="return"
        )
        if stopped(run):
            raise KeyboardInterrupt
        if run.success:
            return run, until
        _quantities(run, wanted)
    raise SimulationError(
        f"no run of {PROBES[-1]} steps reaches the end, so that there is nothing to choose steps and a reference by; "
        f"give an earlier end, or known values and dts to do without: {run.message}",
        run,
    )


def _quantities(probe: Trajectory, wanted: Any) -> tuple[str, ...]:
    """Scalars behind the names; every wrong name with the nearest."""
    if wanted is None:
        return tuple(motion(probe))
    return scalars_wanted(probe, wanted, "quantities", "quantity")
