"""From a return map and a start to a gait: the section, the step, Newton's method, the multipliers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.errors import SimulationError
from mbd.gait.cycle import LimitCycle, residual_by_unit
from mbd.gait.floquet import Multipliers, multipliers_of
from mbd.gait.map_derivative import MapDerivative, Measured, map_derivative, measured
from mbd.gait.newton import FixedPoint, fixed_point
from mbd.gait.outcome import Outcome
from mbd.gait.return_map import Arrival, ReturnMap, Values
from mbd.gait.section import Chart, Section, section_of
from mbd.state import State

__all__ = ["Failed", "Search", "first_return", "gait_at", "search"]

FIRST_STEPS, HALVINGS = 47.3, 7
"""Steps of the first return that is tried, no whole number lest its event fall on the end of a step, where light bodies
blur its instant; and how often they are halved until their error is below `tol`."""
LATE = 10.0
"""Latest time of a return, over that of the first, beyond which the walk is over [-]."""
NEAR = 1e-2
"""Distance [m, rad] within which the rows of the section hold a start that is taken as one on it."""
RESOLVED = 0.1
"""Share of `tol` that the change with half the step may take [-]."""


@dataclass(frozen=True, eq=False)
class Search:
    """A map with its section: what searches share. tol : of coordinates of the section"""

    map: ReturnMap
    section: Section
    tol: float


@dataclass(frozen=True, eq=False)
class Failed:
    """A first return that did not arrive: the state that it began at, and what it came to."""

    state: State
    outcome: Outcome


def first_return(map_: ReturnMap, start: State, values: Values) -> tuple[Section, State] | Failed:
    """The section, from where the first return arrives, and a state on it to begin with: the start, if it is one."""
    arrival = map_(start, values, strides=1)
    if not arrival.outcome.good:
        return Failed(start, map_.explained(start, arrival.outcome, values))
    parameters = map_.vector(values)
    name = map_.section if map_.mirror is None else map_.mirror.name(map_.section)
    before = arrival.before if map_.mirror is None else map_.mirror.names(arrival.before)
    section = section_of(map_.mechanism, map_.manager, name, arrival.state, before, parameters, map_.fixed)
    return section, on_section(section, start, parameters) or arrival.state


def on_section(section: Section, start: State, parameters: Vector, near: float = NEAR) -> State | None:
    """The nearest state of the section, if the start is as near."""
    same = start.mode.closed == section.mode.closed and len(start.anchors) == section.mechanism.layout.n_anchors
    if not same:
        return None
    h, _ = section.positions(start.q, parameters, start.anchors)
    if not np.max(np.abs(h), initial=0.0) <= near:
        return None
    try:
        chart = Chart(section, start, parameters)
        return chart.at(np.zeros(chart.size), parameters)
    except (SimulationError, np.linalg.LinAlgError):
        return None


def with_step(search: Search, start: State, values: Values, dt: float | None) -> tuple[Search, float]:
    """The search with a step whose error is below `tol`, from the first return; and the error of its state."""
    map_, parameters = search.map, search.map.vector(values)
    chart = Chart(search.section, start, parameters)
    if dt is not None:
        return search, float("nan")
    arrival = map_(start, values, strides=1)
    step = arrival.period / FIRST_STEPS if arrival.outcome.good else map_.dt
    if not arrival.outcome.good and arrival.outcome.kind != "numerical error":
        return search, float("nan")
    if arrival.outcome.good:
        map_ = replace(map_, longest=min(map_.longest, LATE * arrival.period))
    before: Vector | None = None
    error = np.inf
    for _ in range(HALVINGS):
        map_ = map_.finer(step)
        arrival = map_(start, values, strides=1)
        now = np.append(chart.of(arrival.state), arrival.period) if arrival.outcome.good else None
        if now is not None and before is not None:
            error = float(np.max(np.abs(now - before)))
            if error <= RESOLVED * search.tol:
                break
        before, step = now, step / 2.0
    return replace(search, map=map_), error


def search(given: Search, start: State, values: Values, attempts: Sequence[Outcome] = ()) -> LimitCycle:
    """The gait near a state of the section."""
    map_, tol = given.map, given.tol
    map_.runs = 0
    point = fixed_point(map_, given.section, start, values, tol)
    return gait_at(given, point, values, attempts)


def gait_at(given: Search, point: FixedPoint, values: Values, attempts: Sequence[Outcome] = ()) -> LimitCycle:
    """The gait at a fixed point, with its multipliers; without them where there is none."""
    map_, chart, zero = given.map, point.chart, np.zeros(point.chart.size)
    found: Measured | Arrival | None = None
    derivative: MapDerivative | None = None
    try:
        found = measured(map_, chart, zero, values)
        if point.outcome.good:
            derivative = map_derivative(map_, chart, zero, values)
    except SimulationError as error:
        point.outcome = point.outcome if not point.outcome.good else Outcome("numerical error", str(error))
    multipliers = _multipliers(map_, chart, derivative, values)
    good = isinstance(found, Measured) and point.outcome.good
    arrival = found.arrival if isinstance(found, Measured) else found
    residual = residual_by_unit(chart, found.c) if isinstance(found, Measured) else {}
    way = arrival.travel if arrival is not None else np.zeros(len(map_.fixed))
    return LimitCycle(
        getattr(map_.model, "name", ""), map_.section, None if map_.mirror is None else map_.mirror.sides, map_.strides,
        point.state, point.outcome, (*attempts, *point.attempts), arrival.period if arrival and good else float("nan"),
        _distance(way, arrival) if good else float("nan"), arrival.steps if arrival and good else (), residual,
        tuple(point.residuals), _step_error(map_, chart, found, values) if good else float("nan"), multipliers,
        derivative, dict(values), map_.dt, map_.runs, chart, map_, way, given,
    )  # fmt: skip


def _distance(way: Vector, arrival: Arrival | None) -> float:
    """The way of one application; the sum of its steps where no coordinate tells it."""
    if len(way):
        return float(np.linalg.norm(way))
    lengths = [length for _, _, length in arrival.steps] if arrival is not None else []
    return float(np.sum(lengths)) if lengths else float("nan")


def _step_error(map_: ReturnMap, chart: Chart, found: Any, values: Values) -> float:
    """Change of the state after one application, and of its period, with half the step."""
    finer = measured(map_.finer(0.5 * map_.dt), chart, np.zeros(chart.size), values)
    if not isinstance(finer, Measured) or len(finer.numbers) != len(found.numbers):
        return float("nan")
    return float(np.nanmax(np.abs(finer.numbers - found.numbers)))


def _multipliers(
    map_: ReturnMap, chart: Chart, derivative: MapDerivative | None, values: Mapping[str, float]
) -> Multipliers:
    if derivative is None or derivative.missing:
        return Multipliers(np.zeros(0, complex), np.zeros((chart.size, 0), complex), {}, float("nan"))
    size = chart.size
    energy = _energy_slope(map_, chart, values)
    return multipliers_of(derivative.matrix[:size], derivative.error[:size], energy)


def _energy_slope(map_: ReturnMap, chart: Chart, values: Mapping[str, float]) -> Matrix | None:
    """∇(T + V) along the section, relative to the largest; None where the energy does not depend on the state."""
    parameters, h = map_.vector(values), 1e-5
    states = [chart.at(sign * h * unit, parameters) for unit in np.eye(chart.size) for sign in (1.0, -1.0)]
    inputs = {name: np.stack([getattr(state, name) for state in states]) for name in ("q", "v", "z")}
    inputs |= {"t": np.zeros(len(states)), "anchor": np.stack([state.anchors for state in states])}
    kinetic, potential = map_.mechanism.energies(inputs, parameters)
    total = (kinetic + potential).reshape(-1, 2)
    slope = (total[:, 0] - total[:, 1]) / (2.0 * h)
    size = float(np.linalg.norm(slope))
    return slope / size if np.isfinite(size) and size > 0.0 else None
