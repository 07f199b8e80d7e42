"""What the lab does unless it is told otherwise: schemes, steps from the model's time scales, all coordinates."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.analysis.accuracy.truth import motion, stopped
from mbd.assembly import is_number
from mbd.errors import ModelError, SimulationError, UnknownNameError, nearest
from mbd.integrators import HHT, GeneralizedAlpha, Integrator, Newmark
from mbd.simulation.simulate import simulate
from mbd.state import State

if TYPE_CHECKING:
    from mbd.trajectory import Trajectory

__all__ = ["Plan", "label", "plan", "steps_for"]

FINENESS = 5
"""Largest step: this part of the shortest time in which accelerations change velocities by their range [-]."""
COUNT = 6
"""Steps, each half the one before."""
TENTH = 10.0
"""The finest step is for an error this many times less than that wanted [-]."""
MOST_STEPS = 400000
"""Of the finest of these steps."""
PROBES = (2000, 20000, 200000)
"""Steps of the run that looks for time scales, until one succeeds."""
PROBE_STEP = 1e-3
"""Its step where the end is an event [s]."""
SEARCH = 200000
"""Steps after which the event that ends the run is no longer waited for."""
LEAST_ROWS, MOST_ROWS = 1500, 4000
"""Rows of the reference."""


@dataclass(frozen=True, eq=False)
class Plan:
    """What is compared: schemes by label, steps [s], quantities, the end, step [s] and sizes of the reference."""

    schemes: Mapping[str, Integrator]
    dts: tuple[float, ...]
    quantities: tuple[str, ...]
    until: Any
    step: float
    sizes: tuple[float, ...]
    probe: Trajectory = field(repr=False)

    @property
    def count(self) -> int:
        """How many points there are."""
        return len(self.schemes) * len(self.dts)


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
) -> Plan:
    """Arguments checked, all faults at once, and completed from a first run."""
    faults = [] if isinstance(start, State) else [f"start must be a State from mbd.assemble(model, …), not {start!r}"]
    faults += _wrong_schemes(integrators) + _wrong_schemes(None if also is None else [also]) + _wrong_steps(dts)
    if faults:
        raise ModelError(faults)
    probe, until = _probe(model, start, until, options)
    chosen = _quantities(probe, quantities)
    schemes = integrators if integrators is not None else _schemes(bool(probe.record.lam.shape[1]), also)
    named = dict(schemes) if isinstance(schemes, Mapping) else {label(scheme): scheme for scheme in schemes}
    span = float(probe.time[-1]) - start.time
    steps = tuple(sorted(map(float, dts), reverse=True)) if dts is not None else steps_of(probe, span)
    step = float(np.clip(steps_of(probe, span)[0], span / MOST_ROWS, span / LEAST_ROWS))
    columns = (probe.record.q, probe.record.v, probe.record.z)
    sizes = np.concatenate([np.max(np.abs(column), axis=0, initial=0.0) for column in columns])
    sizes = np.where(sizes > 1e-6, sizes, np.max(sizes, initial=0.0) or 1.0)
    return Plan(named, steps, chosen, until, step, tuple(map(float, sizes)), probe)


def _wrong_schemes(integrators: Any) -> list[str]:
    if integrators is None:
        return []
    given = list(integrators.values()) if isinstance(integrators, Mapping) else integrators
    if not isinstance(given, Sequence) or isinstance(given, str) or not given:
        return [f"integrators must be a list of integrators, or a dictionary by label, not {integrators!r}"]
    return [
        f"{each!r} is no integrator; give values such as mbd.HHT(alpha=0.05)"
        for each in given if not isinstance(each, Integrator)
    ]  # fmt: skip


def _wrong_steps(dts: Any) -> list[str]:
    if dts is None:
        return []
    if isinstance(dts, str) or not isinstance(dts, Sequence | np.ndarray) or len(dts) == 0:
        return [f"dts must be a list of steps [s], not {dts!r}"]
    return [
        f"a step must be a positive number of seconds, not {dt!r}"
        for dt in dts if not is_number(dt) or not math.isfinite(dt) or dt <= 0.0
    ]  # fmt: skip


def _schemes(rows: bool, also: Any) -> tuple[Integrator, ...]:
    """Five of the family, from no damping to much, index 3 where there are rows; and one more if it is not there."""
    last = HHT(alpha=0.05, formulation="index3") if rows else HHT(alpha=0.3)
    known = (Newmark(), HHT(alpha=0.05), GeneralizedAlpha(rho_inf=0.9), GeneralizedAlpha(rho_inf=0.5), last)
    return known if also is None or also in known else (*known, also)


def _probe(model: Any, start: State, until: Any, options: Mapping[str, Any]) -> tuple[Trajectory, Any]:
    """A run that finds the end and the time scales; and the end as (event, latest time) or a time."""
    scheme = GeneralizedAlpha(rho_inf=0.8)
    if isinstance(until, str):
        latest = start.time + SEARCH * PROBE_STEP
        run = simulate(model, start, scheme, dt=PROBE_STEP, until=(until, latest), **options)
        if run.status != 1:
            raise ModelError(f"until: {until!r} did not happen before t = {latest:g} s; give (name, latest time)")
        return run, (until, start.time + 1.5 * (float(run.time[-1]) - start.time) + 1e-3)
    last = until[1] if isinstance(until, tuple) and len(until) == 2 else until
    given = is_number(last) and math.isfinite(last)
    if not given or last <= start.time:
        raise ModelError(f"until must be a time [s] after the start at {start.time:g} s, an event's name, or "
                         f"(name, latest time), not {until!r}")  # fmt: skip
    for steps in PROBES:
        run = simulate(
            model, start, scheme, dt=(last - start.time) / steps, until=until, **options, on_failure="return"
        )
        if stopped(run):
            raise KeyboardInterrupt
        if run.success:
            return run, until
    raise SimulationError(f"no run of {PROBES[-1]} steps reaches the end: {run.message}", run)


def _quantities(probe: Trajectory, wanted: Any) -> tuple[str, ...]:
    """Scalars behind the names; every wrong name with the nearest."""
    if wanted is None:
        return tuple(motion(probe))
    names = [wanted] if isinstance(wanted, str) else list(wanted)
    if not names:
        raise ModelError("quantities is empty; give names such as those in run.names")
    wrong = [str(name) for name in names if name not in probe]
    if wrong:
        known = (*probe.names, *probe.columns.vectors)
        raise UnknownNameError([nearest(name, known, "quantity") for name in wrong])
    return tuple(dict.fromkeys(part for name in names for part in probe.columns.components(name)))


def steps_of(probe: Trajectory, span: float) -> tuple[float, ...]:
    """Six steps, halved each time, from a fifth of the model's shortest time scale on."""
    record = probe.record
    swing = np.ptp(record.v, axis=0) if len(record.v) else np.zeros(0)
    rise = np.percentile(np.abs(record.a), 99, axis=0) if len(record.a) else np.zeros(0)
    times = [s / r for s, r in zip(swing, rise, strict=True) if r > 1e-9 * np.max(rise) and s > 0.0]
    largest = rounded(min([*times, span / 4.0]) / FINENESS)
    return tuple(largest / 2**k for k in range(COUNT))


def steps_for(target: float, error: float, dt: float, span: float) -> tuple[float, ...]:
    """Six steps around that of an error, if `dt` has another and the order is 2; the finest for a tenth of it.

    >>> steps_for(1e-4, error=1e-3, dt=1e-3, span=1.0)
    (0.00256, 0.00128, 0.00064, 0.00032, 0.00016, 8e-05)
    """
    finest = max(0.9 * dt * math.sqrt(target / TENTH / error), span / MOST_STEPS)
    least = rounded(min(finest, span / 2**COUNT))
    return tuple(least * 2.0**k for k in reversed(range(COUNT)))


def rounded(value: float) -> float:
    """The next of 1, 2, 4, 5, 8 times a power of ten below.

    >>> rounded(0.0123), rounded(0.0079)
    (0.01, 0.005)
    """
    power = 10.0 ** math.floor(math.log10(value))
    digit = max(d for d in (1, 2, 4, 5, 8) if d <= value / power * (1.0 + 1e-9))
    return float(f"{digit * power:.3g}")
