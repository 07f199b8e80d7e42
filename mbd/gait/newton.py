"""Fixed points of a return map: Newton's method with step control, and walks where it does not lead on.

Of a family of gaits, where one number more picks the member (`mbd.gait.family`), the residual has one entry more.
"""

from dataclasses import field, replace

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.equal import HALF_PRECISION_RTOL, RANK_RTOL
from mbd.errors import SimulationError
from mbd.gait.family import Member, energy_of
from mbd.gait.map_derivative import Measured, differences, measured, numbers_of
from mbd.gait.outcome import Outcome
from mbd.gait.return_map import Arrival, ReturnMap, Values
from mbd.gait.section import Chart, Section
from mbd.state import State

MIN_DAMPING = 1.0 / 64.0
"""Least part of a Newton step that is tried [-]."""
MIN_DECREASE = 0.25
"""Share of the decrease that the linear model promises which a step must reach [-]."""
WALKS, AGAIN = 6, 3
"""Plain applications of the map where no part of a Newton step helps, and how often that is done [-]."""
MAX_CONTRACTION = 0.2
"""Factor by which a step with a derivative of before must shrink the residual, else it is made again [-]."""
SINGULAR_RTOL = 1e-3
"""Singular value of 1 − P relative to its largest below which gaits near may form a family [-]."""


@dataclass
class FixedPoint:
    """What the search came to.

    chart : around the last state; c = 0 is that state; found : what the map gives there
    outcome : 'walks', or why there is no fixed point
    residual : largest |c' − c| there; residuals : of all iterations; attempts : outcomes of what did not arrive
    slope : ∂(c − c')/∂c in the chart, as derivatives at some state of it and the steps since tell; None: not known. The
        row below it is that of the member
    member : of a family, that is asked for; None: the one near the start
    gap : what is left at the last state: c' − c, then of the member
    energies : T + V [J] of the states from which the walker came back, where a member of some energy is asked for
    """

    chart: Chart
    outcome: Outcome
    residual: float
    residuals: list[float] = field(default_factory=list)
    attempts: list[Outcome] = field(default_factory=list)
    found: Measured | None = None
    slope: Matrix | None = None
    exact: bool = False
    member: Member | None = None
    gap: Vector = field(default_factory=lambda: np.zeros(0))
    energies: list[float] = field(default_factory=list)

    @property
    def state(self) -> State:
        """The last state."""
        return self.chart.state


def fixed_point(
    map_: ReturnMap, section: Section, start: State, values: Values, tol: float,
    near: tuple[Chart, Matrix] | None = None, member: Member | None = None,
) -> FixedPoint:  # fmt: skip
    """The fixed point near a start on the section, ``c'(c) = c`` to `tol` in every coordinate.

    Of a family of them it is the `member` that is asked for, to `tol` of its energy or speed, relative to 1 or that.

    Steps d of ``(1 − P) d = c' − c`` are halved until the residual falls as promised; where none does, the walker walks
    on for some steps, which leads towards an attractive gait, and Newton's method begins again. While the residual
    falls quickly the derivative is not made again but follows the steps (Broyden 1965, Math. Comput. 19:577); `near`
    has the chart and P of a gait near the start.
    """
    point = FixedPoint(Chart(section, start, map_.vector(values)), Outcome("does not converge", ""), np.inf)
    point.member = member
    if near is not None and near[0].size == point.chart.size and member is None:
        turn = point.chart.basis.T @ near[0].basis
        point.slope = turn @ (np.eye(point.chart.size) - near[1]) @ turn.T
    _search(map_, point, values, tol)
    if member is not None and member.kind == "energy" and not point.outcome.good:
        point.outcome = replace(
            point.outcome, text=f"{_energies(map_, point, start, values, member.value)}; {point.outcome.text}"
        )
    return point


def _search(map_: ReturnMap, point: FixedPoint, values: Values, tol: float) -> None:
    """Newton's method from the state of the point; its outcome tells how it ended."""
    found: Measured | Outcome | None = _measure(map_, point.chart, np.zeros(point.chart.size), values, point)
    walked = 0
    for _ in range(30):
        if not isinstance(found, Measured):
            assert found is not None
            point.outcome = _since(map_, map_.explained(point.state, found, values), 0)
            return
        point.found, point.gap = found, _gap(map_, point, np.zeros(point.chart.size), found, values)
        point.residual = float(np.max(np.abs(point.gap), initial=0.0))
        point.residuals.append(point.residual)
        if point.residual <= tol:
            _polish(map_, point, values, tol)
            point.outcome = _rest(map_, point, tol) or Outcome("walks", "walks")
            return
        found = _stepped(map_, point, found, values)
        if found is None and point.residual <= 100.0 * tol:
            break
        if found is None:
            walked += 1
            if walked > AGAIN:
                break
            found = _walked(map_, point, values)
    _give_up(map_, point, values, tol)


def _since(map_: ReturnMap, outcome: Outcome, returns: int) -> Outcome:
    """A fall with what its time counts from: the section, which is not the start of the search."""
    since = f" after {map_.section!r}"
    if outcome.kind != "falls" or since in outcome.text:
        return outcome
    later = f", in return {returns + 1} from where the search has come to" if returns else ""
    return replace(outcome, text=f"{outcome.text}{since}{later}")


def _energies(map_: ReturnMap, point: FixedPoint, start: State, values: Values, wanted: float) -> str:
    """The energy asked for, that of the start, and the nearest with which the walker came back, in words."""
    text = (
        f"energy={wanted:g} J: the start has T + V = {energy_of(map_, [start], values)[0]:.4g} J just after "
        f"{map_.section!r}"
    )
    if not point.energies:
        return text
    nearest = min(point.energies, key=lambda energy: abs(energy - wanted))
    return f"{text}, and {nearest:.4g} J is the nearest energy with which the walker came back"


def _polish(map_: ReturnMap, point: FixedPoint, values: Values, tol: float) -> None:
    """One more step where the derivative is known and the residual not much below `tol`."""
    if point.slope is None or point.found is None or point.residual <= 0.01 * tol:  # above it one more step is made
        return
    found = _damped(map_, point, point.gap, values, MAX_CONTRACTION, 1.0)
    if isinstance(found, Measured):
        point.found, point.gap = found, _gap(map_, point, np.zeros(point.chart.size), found, values)
        point.residual = float(np.max(np.abs(point.gap), initial=0.0))
        point.residuals.append(point.residual)


def _give_up(map_: ReturnMap, point: FixedPoint, values: Values, tol: float) -> None:
    """The outcome of a search that came to no fixed point."""
    if resting := _rest(map_, point, tol):
        point.outcome = resting
        return
    if point.member is not None and (alone := _alone(map_, point, values)):
        point.outcome = Outcome("does not converge", alone)
        return
    last = f"; beside it the walker {point.attempts[-1]}" if point.attempts else ""
    text = (
        f"no gait that repeats itself was found: {point.residual:.2g} is left after {len(point.residuals)} iterations"
    )
    point.outcome = Outcome("does not converge", text + last)


def _alone(map_: ReturnMap, point: FixedPoint, values: Values) -> str:
    """That gaits near the last state are isolated, so that none has the energy or speed asked for; '' if they are not.

    It is so where a return changes the energy, what Newton's method cannot reduce is that of the member, and no
    multiplier there is 1.
    """
    size = point.chart.size
    if point.slope is None or point.found is None or len(point.gap) == size:
        return ""
    before, after = energy_of(map_, [point.state, point.found.arrival.state], values)
    if abs(after - before) <= HALF_PRECISION_RTOL * max(abs(before), abs(after)):
        return ""
    sizes = np.linalg.svd(point.slope[:size], compute_uv=False)
    if not size or sizes[-1] <= SINGULAR_RTOL * sizes[0]:
        return ""
    return (
        f"no gait with {point.member} was found: the gaits near are isolated, none of their multipliers is 1. "
        "Something takes or gives energy, so that energy and speed follow from the parameters; leave energy= and "
        "speed= out, or change a parameter until the gait has them"
    )


def _stepped(map_: ReturnMap, point: FixedPoint, found: Measured, values: Values) -> Measured | Outcome | None:
    """What the map gives after a step of Newton's method; None where no part of it leads nearer."""
    if point.slope is not None and not point.exact:
        after = _damped(map_, point, point.gap, values, MAX_CONTRACTION, 1.0)
        if after is not None:
            return after
    point.slope, point.exact = _slope(map_, point, found, values), True
    return None if point.slope is None else _damped(map_, point, point.gap, values)


def _gap(map_: ReturnMap, point: FixedPoint, c: Vector, found: Measured, values: Values) -> Vector:
    """What is left at coordinates c from which the map gives the numbers `found`: c' − c, then of the member."""
    left = found.c - c
    if point.member is None:
        return left
    misfit = point.member.misfit(map_, point.chart, c, found, values)
    if point.member.kind == "energy":
        point.energies.append(point.member.value - misfit * point.member.size)
    return np.append(left, misfit)


def _rest(map_: ReturnMap, point: FixedPoint, tol: float) -> Outcome | None:
    """That nothing moves any more, which repeats itself too; a machine may go on from there by itself.

    Where the section is an event of velocities, such as an apex, all may be still for an instant.
    """
    if map_.mechanism.equations.machines or point.chart.section.speeds:
        return None
    if float(np.max(np.abs(point.state.v), initial=0.0)) > 1e3 * tol:  # what is slower and repeats itself is rest
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


def _slope(map_: ReturnMap, point: FixedPoint, found: Measured, values: Values) -> Matrix | None:
    """1 − P at the last state; None where derivatives are missing."""
    try:
        zero = np.zeros(point.chart.size)
        derivative = differences(map_, point.chart, zero, values, levels=1, base=found)
    except SimulationError:
        return None
    P = derivative.matrix[: point.chart.size]
    slope = np.eye(len(P)) - P
    if point.member is not None:
        slope = np.vstack([slope, point.member.slope(map_, point.chart, found, derivative.matrix, values)])
    return slope if np.all(np.isfinite(slope)) else None


def _damped(
    map_: ReturnMap, point: FixedPoint, gap: Vector, values: Values, needed: float = 1.0, shortest: float = MIN_DAMPING
) -> Measured | Outcome | None:
    """A part of Newton's step after which the residual is smaller, from where the next begins; None if there is none.

    needed : what the residual of a whole step may be at most, over that before
    """
    assert point.slope is not None
    step = np.asarray(np.linalg.lstsq(point.slope, gap, rcond=RANK_RTOL)[0])
    before, part = float(np.max(np.abs(gap))), 1.0
    while part >= shortest:
        c = part * step
        found = _measure(map_, point.chart, c, values, point)
        if isinstance(found, Measured):
            left = _gap(map_, point, c, found, values)
            if float(np.max(np.abs(left))) <= min(needed, 1.0 - MIN_DECREASE * part) * before:
                point.slope += np.outer(gap - left - point.slope @ c, c) / float(c @ c)
                point.exact = False
                if part < 1.0:
                    point.slope = None
                return _moved(map_, point, c, found, values)
        part *= 0.5
    return None


def _moved(map_: ReturnMap, point: FixedPoint, c: Vector, found: Measured, values: Values) -> Measured:
    """Go on from another state, with a chart around it: the same run, in other coordinates."""
    old, parameters = point.chart, map_.vector(values)
    point.chart = Chart(old.section, old.at(c, parameters), parameters)
    if point.slope is not None:
        turn = point.chart.basis.T @ old.basis
        size = len(turn)
        point.slope = np.vstack([turn @ point.slope[:size] @ turn.T, point.slope[size:] @ turn.T])
    return numbers_of(point.chart, found.arrival)


def _walked(map_: ReturnMap, point: FixedPoint, values: Values) -> Measured | Outcome:
    """Walk on for some steps."""
    state = point.state
    for number in range(WALKS):
        arrival = map_(state, values)
        outcome = map_.against(point.chart.section, arrival)
        if not outcome.good:
            point.attempts.append(outcome)
            return _since(map_, map_.explained(state, outcome, values), number)
        state = arrival.state
    parameters = map_.vector(values)
    chart = Chart(point.chart.section, state, parameters)
    point.chart, point.slope = Chart(chart.section, chart.at(np.zeros(chart.size), parameters), parameters), None
    return _measure(map_, point.chart, np.zeros(point.chart.size), values, point)
