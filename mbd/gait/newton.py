"""Fixed points of a return map: Newton's method with step control, and walks where it does not lead on."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mbd.arrays import Vector
from mbd.errors import SimulationError
from mbd.gait.map_derivative import MapDerivative, Measured, map_derivative, measured
from mbd.gait.outcome import Outcome
from mbd.gait.return_map import Arrival, ReturnMap, Values
from mbd.gait.section import Chart, Section
from mbd.state import State

__all__ = ["FixedPoint", "fixed_point"]

MOST = 30
"""Newton iterations [-]."""
SHORTEST = 1.0 / 64.0
"""Least part of a Newton step that is tried [-]."""
DECREASE = 0.25
"""Share of the decrease that the linear model promises which a step must reach [-]."""
WALKS, AGAIN = 6, 3
"""Plain applications of the map where no part of a Newton step helps, and how often that is done [-]."""
FLAT = 1e-9
"""Singular value of 1 − P relative to its largest below which a direction is left where it is [-]."""
REST = 1e3
"""Speed over `tol` below which what repeats itself is rest [-]."""


@dataclass
class FixedPoint:
    """What the search came to.

    chart : around the last state; c = 0 is that state; outcome : 'walks', or why there is no fixed point
    residual : largest |c' − c| there; residuals : of all iterations; attempts : outcomes of what did not arrive
    derivative : the last one, from the iterations
    """

    chart: Chart
    outcome: Outcome
    residual: float
    residuals: list[float] = field(default_factory=list)
    attempts: list[Outcome] = field(default_factory=list)
    derivative: MapDerivative | None = None

    @property
    def state(self) -> State:
        """The last state."""
        return self.chart.state


def fixed_point(map_: ReturnMap, section: Section, start: State, values: Values, tol: float) -> FixedPoint:
    """The fixed point near a start on the section, ``c'(c) = c`` to `tol` in every coordinate.

    Steps d of ``(1 − P) d = c' − c`` are halved until the residual falls as promised; where none does, the walker walks
    on for some steps, which leads towards an attractive gait, and Newton's method begins again.
    """
    parameters = map_.vector(values)
    point = FixedPoint(Chart(section, start, parameters), Outcome("does not converge", ""), np.inf)
    found: Measured | Outcome | None = _measure(map_, point.chart, np.zeros(point.chart.size), values, point)
    walked = 0
    for _ in range(MOST):
        if not isinstance(found, Measured):
            assert found is not None
            point.outcome = map_.explained(point.state, found, values)
            return point
        gap = found.c
        point.residual = float(np.max(np.abs(gap), initial=0.0))
        point.residuals.append(point.residual)
        if point.residual <= tol:
            point.outcome = _rest(map_, point, tol) or Outcome("walks", "walks")
            return point
        step = _step(map_, point, gap, values)
        found = _damped(map_, point, step, gap, values) if step is not None else None
        if found is None and point.residual <= 100.0 * tol:
            break
        if found is None:
            walked += 1
            if walked > AGAIN:
                break
            found = _walked(map_, point, values)
    if resting := _rest(map_, point, tol):
        point.outcome = resting
        return point
    last = f"; beside it the walker {point.attempts[-1]}" if point.attempts else ""
    text = (
        f"no gait that repeats itself was found: {point.residual:.2g} is left after {len(point.residuals)} iterations"
    )
    point.outcome = Outcome("does not converge", text + last)
    return point


def _rest(map_: ReturnMap, point: FixedPoint, tol: float) -> Outcome | None:
    """That nothing moves any more, which repeats itself too."""
    if float(np.max(np.abs(point.state.v), initial=0.0)) > REST * tol:
        return None
    return Outcome("rests", f"comes to rest at {map_.section!r}: nothing moves where it repeats itself")


def _measure(map_: ReturnMap, chart: Chart, c: Vector, values: Values, point: FixedPoint) -> Measured | Outcome:
    """The numbers of the map, or what became of it, which is noted."""
    try:
        found = measured(map_, chart, c, values)
    except SimulationError as error:
        point.attempts.append(Outcome("not on the section", str(error)))
        return point.attempts[-1]
    if isinstance(found, Arrival):
        point.attempts.append(map_.against(chart.section, found))
        return point.attempts[-1]
    return found


def _step(map_: ReturnMap, point: FixedPoint, gap: Vector, values: Values) -> Vector | None:
    """Newton's step; None where derivatives are missing."""
    try:
        point.derivative = map_derivative(map_, point.chart, np.zeros(point.chart.size), values, fine=False)
    except SimulationError:
        return None
    P = point.derivative.matrix[: point.chart.size]
    if not np.all(np.isfinite(P)):
        return None
    return np.asarray(np.linalg.lstsq(np.eye(len(P)) - P, gap, rcond=FLAT)[0])


def _damped(map_: ReturnMap, point: FixedPoint, step: Vector, gap: Vector, values: Values) -> Measured | Outcome | None:
    """A part of the step after which the residual is smaller, from where the next begins; None if there is none."""
    before, part = float(np.max(np.abs(gap))), 1.0
    while part >= SHORTEST:
        c = part * step
        found = _measure(map_, point.chart, c, values, point)
        if isinstance(found, Measured):
            after = float(np.max(np.abs(found.c - c)))
            if after <= (1.0 - DECREASE * part) * before:
                return _moved(map_, point, point.chart.at(c, map_.vector(values)), values)
        part *= 0.5
    return None


def _moved(map_: ReturnMap, point: FixedPoint, state: State, values: Values) -> Measured | Outcome:
    """Go on from another state, with a chart around it."""
    point.chart = Chart(point.chart.section, state, map_.vector(values))
    return _measure(map_, point.chart, np.zeros(point.chart.size), values, point)


def _walked(map_: ReturnMap, point: FixedPoint, values: Values) -> Measured | Outcome:
    """Walk on for some steps."""
    state = point.state
    for _ in range(WALKS):
        arrival = map_(state, values)
        outcome = map_.against(point.chart.section, arrival)
        if not outcome.good:
            point.attempts.append(outcome)
            return map_.explained(state, outcome, values)
        state = arrival.state
    chart = Chart(point.chart.section, state, map_.vector(values))
    return _moved(map_, point, chart.at(np.zeros(chart.size), map_.vector(values)), values)
