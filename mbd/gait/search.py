"""From a return map and a start to a gait: the section, the step, Newton's method, the multipliers."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.errors import SimulationError
from mbd.gait.cycle import LimitCycle, residual_by_unit
from mbd.gait.family import Member, floquet
from mbd.gait.floquet import Multipliers
from mbd.gait.map_derivative import MapDerivative, Measured, map_derivative, measured
from mbd.gait.newton import FixedPoint, fixed_point
from mbd.gait.outcome import Outcome
from mbd.gait.return_map import Arrival, ReturnMap, Values
from mbd.gait.samples import explain_samples
from mbd.gait.section import Chart, Section, section_of
from mbd.state import State

FIRST_STEPS, HALVINGS = 11.8, 9
"""Steps of the first return that is tried, no whole number lest its event fall on the end of a step, where light bodies
blur its instant; and how often they are halved until their error is below `tol`."""
SECTION_DISTANCE = 1e-2
"""Distance [m, rad] within which the rows of the section hold a start that is taken as one on it."""


@dataclass(frozen=True, eq=False)
class Search:
    """A map with its section: what searches share.

    tol : of coordinates of the section; member : of a family of gaits, that is looked for; None: the one near the start
    """

    map: ReturnMap
    section: Section
    tol: float
    member: Member | None = None


@dataclass(frozen=True, eq=False)
class Failed:
    """A first return that did not arrive: the state that it began at, and what it came to."""

    state: State
    outcome: Outcome


def first_return(
    map_: ReturnMap, start: State, values: Values, within: bool = True
) -> tuple[Section, tuple[State, ...]] | Failed:  # fmt: skip
    """The section, from where the first return arrives, and states on it to begin with in turn.

    The start is the first, if it is one; it may look like one within a step, as the feet pass each other.

    within : whether the start may lie within a step, whose foot may have passed the other already, so that it comes
        down on the side of the other on which it is; then the return after that tells whether it walks
    """
    arrival = map_(start, values, strides=1)
    if within and arrival.outcome.kind == "scuffs":
        later = first_return(map_, arrival.state, values, within=False)
        if not isinstance(later, Failed):
            return later
    if not arrival.outcome.good:
        return Failed(start, map_.explained(start, arrival.outcome, values))
    parameters = map_.vector(values)
    name = map_.section if map_.mirror is None else map_.mirror.name(map_.section)
    before = arrival.before if map_.mirror is None else map_.mirror.names(arrival.before)
    section = section_of(map_.mechanism, map_.manager, name, arrival.state, before, parameters, map_.fixed,
                         map_.heading, arrival.stored)  # fmt: skip
    near = on_section(section, start, parameters)
    return section, (arrival.state,) if near is None else (near, arrival.state)


def on_section(section: Section, start: State, parameters: Vector, near: float = SECTION_DISTANCE) -> State | None:
    """The nearest state of the section, if the start is as near."""
    same = start.mode.closed == section.mode.closed and len(start.anchors) == section.mechanism.layout.n_anchors
    if not same or section.other_states(start):
        return None
    y = np.concatenate([start.v, start.z])
    h, _ = section.positions(section.terms(start.q, y, parameters, start.anchors), start.q, parameters, start.anchors)
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
    if dt is not None:
        return search, float("nan")
    arrival = map_(start, values, strides=1)
    step = arrival.period / FIRST_STEPS if arrival.outcome.good else map_.dt
    if not arrival.outcome.good and arrival.outcome.kind != "numerical error":
        return search, float("nan")
    # beyond, the walk is over
    longest = min(map_.longest, 10.0 * arrival.period) if arrival.outcome.good else map_.longest
    chart = Chart(search.section, start, parameters)
    before: Vector | None = None
    error = np.inf
    for _ in range(HALVINGS):
        coarser, map_ = map_, map_.with_step(step, longest)
        arrival = map_(start, values, strides=1)
        now = np.append(chart.of(arrival.state), arrival.period) if arrival.outcome.good else None
        if now is not None and before is not None:
            error = float(np.max(np.abs(now - before)))
            if error <= 0.1 * search.tol:  # half the step changes little
                return replace(search, map=coarser), error
        before, step = now, step / 2.0
    return replace(search, map=map_), error


def search(given: Search, start: State, values: Values, near: tuple[Chart, Matrix] | None = None) -> LimitCycle:
    """The gait near a state of the section; `near`: chart and P of a gait beside it."""
    map_, tol = given.map, given.tol
    map_.runs = 0
    return gait_at(given, fixed_point(map_, given.section, start, values, tol, near, given.member), values)


def first_found(given: Search, states: Sequence[State], values: Values, dt: float | None) -> LimitCycle:
    """The gait near the first of some states of the section from which one is found; what the first came to if none."""
    first: LimitCycle | None = None
    for state in states:
        stepped, _ = with_step(given, state, values, dt)
        found = search(stepped, state, values)
        if found.success:
            return found
        first = first or found
    assert first is not None
    return first


def fallen_first(found: LimitCycle, start: State, values: Values) -> LimitCycle:
    """A search that failed, as a fall if the walker fell from its start before it came to the section otherwise."""
    if found.success:
        return found
    fall = found.map.fall(start, values)
    if fall is None:
        return replace(found, outcome=explain_samples(found.outcome, found.map, found.state, values))
    return replace(found, outcome=fall, attempts=(fall, *found.attempts))


def gait_at(given: Search, point: FixedPoint, values: Values) -> LimitCycle:
    """The gait at a fixed point, with its multipliers; without them where there is none."""
    map_, chart, zero = given.map, point.chart, np.zeros(point.chart.size)
    found: Measured | Arrival | None = None
    derivative: MapDerivative | None = None
    try:
        found = measured(map_, chart, zero, values) if point.found is None else point.found
        if point.outcome.good and isinstance(found, Measured):
            derivative = map_derivative(map_, chart, zero, values, base=found)
    except SimulationError as error:
        point.outcome = point.outcome if not point.outcome.good else Outcome("numerical error", str(error))
    multipliers = _multipliers(map_, chart, derivative, values)
    good = isinstance(found, Measured) and point.outcome.good
    arrival = found.arrival if isinstance(found, Measured) else found
    residual = residual_by_unit(chart, found.c) if isinstance(found, Measured) else {}
    if given.member is not None and isinstance(found, Measured):
        left = given.member.size * abs(given.member.misfit(map_, chart, zero, found, values))
        residual[given.member.unit] = max(residual.get(given.member.unit, 0.0), left)
    way = arrival.travel if arrival is not None else np.zeros(len(map_.fixed))
    state = replace(point.state, parameters=map_.plain(values))
    return LimitCycle(
        getattr(map_.model, "name", ""), map_.section, None if map_.mirror is None else map_.mirror.sides, map_.strides,
        state, point.outcome, tuple(point.attempts), arrival.period if arrival and good else float("nan"),
        map_.way_of(arrival) if arrival and good else float("nan"), arrival.steps if arrival and good else (),
        residual, tuple(point.residuals), multipliers, derivative, dict(values), map_.dt, map_.runs, chart, map_, way,
        given,
    )  # fmt: skip


def _multipliers(
    map_: ReturnMap, chart: Chart, derivative: MapDerivative | None, values: Mapping[str, float]
) -> Multipliers:
    if derivative is None or derivative.missing:
        return Multipliers(np.zeros(0, complex), np.zeros((chart.size, 0), complex), {}, float("nan"))
    return floquet(map_, chart, derivative, values)
