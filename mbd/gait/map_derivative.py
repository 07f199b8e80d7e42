"""Derivatives of a return map by the start and by parameters: exact where a pass over a run knows them.

Elsewhere (resets in Python, two events at one instant, plain Python without compiled code) they are central differences
of runs with equal steps, of steps h, 2h, 4h, with two Richardson extrapolations (order 6); the entries of least
estimated error are taken. Where a run beside the base does not arrive, or has other events, h shrinks. Of a parameter,
whose unit may be any, h is such that the numbers of the map change by as much as they do for the differences of
coordinates.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.equal import HALF_PRECISION_RTOL, ROUND_OFF_RTOL
from mbd.errors import SimulationError
from mbd.gait.exact_derivative import exact_derivative
from mbd.gait.extrapolation import extrapolated
from mbd.gait.return_map import Arrival, ReturnMap, Values
from mbd.gait.section import Chart

STATE_STEP, PARAMETER_STEP = 2e-4, 2e-3
"""Least of the three differences of coordinates of the section [m, rad, 1/s of them], and the first of parameters that
is tried, over them or 1."""
NEAR_ENOUGH, UNSEEN = 30.0, 1e-9
"""Factor by which what a parameter changes may differ from `STATE_STEP`, and the share of it that is no change [-]."""
MAX_RESCALING, MAX_RESCALINGS, WIDEST = 1e5, 12, 1e15
"""Factor by which its difference changes at most at once, how often, and how wide it gets, over it or 1 [-]."""
EXACT = "exact"
"""How derivatives were found that a pass over runs knows."""
MAX_DIFFERENCES = 3
"""Differences of each direction at most: h, 2h, 4h."""
ENOUGH, CLOSER = 1e-9, 0.125
"""Error estimate, relative to 1 or the derivative, above which smaller differences are tried, and how much smaller."""
SHRINK, TRIES = 0.1, 4
"""Factor of h where a run beside the base does not arrive, and how often."""


@dataclass(frozen=True, eq=False)
class Measured:
    """Where the map leads, as numbers: coordinates of the section, then period, travel, time and length of each step.

    The first `size` are the coordinates.
    """

    numbers: Vector
    size: int
    arrival: Arrival

    @property
    def c(self) -> Vector:
        """Coordinates of the section."""
        return self.numbers[: self.size]


@dataclass(frozen=True, eq=False)
class MapDerivative:
    """∂(coordinates, period, travel, steps)/∂(directions).

    matrix (n_out, n_directions); error : estimate of that of each entry
    how : 'exact', or 'differences of order 6', of 4 or of 2
    missing : why directions have no derivative, by number
    """

    matrix: Matrix
    error: Matrix
    how: str
    missing: dict[int, str]


def measured(map_: ReturnMap, chart: Chart, c: Vector, values: Values) -> Measured | Arrival:
    """The numbers of one application from the coordinates c; the arrival alone where it does not arrive."""
    return _of_arrival(map_, chart, map_(chart.at(c, map_.vector(values)), values))


def _of_arrival(map_: ReturnMap, chart: Chart, arrival: Arrival) -> Measured | Arrival:
    """The numbers of an arrival on the section; another one as it is."""
    good = arrival.outcome.good and map_.against(chart.section, arrival).good
    return numbers_of(chart, arrival) if good else arrival


def numbers_of(chart: Chart, arrival: Arrival) -> Measured:
    """The numbers of an arrival in the coordinates of a chart."""
    steps = [number for _, time, length in arrival.steps for number in (time, length)]
    numbers = np.array([*chart.of(arrival.state).tolist(), arrival.period, *arrival.travel.tolist(), *steps])
    return Measured(numbers, chart.size, arrival)


def map_derivative(
    map_: ReturnMap, chart: Chart, c: Vector, values: Values, names: Sequence[str] = (), levels: int = MAX_DIFFERENCES,
    state: bool = True, base: Measured | None = None,
) -> MapDerivative:  # fmt: skip
    """The derivatives at c, by all coordinates of the section (unless `state` is False), then by parameters `names`.

    levels : differences of each direction, 1 to 3, where no exact ones are known: of order 2 for steps of Newton, 4
        along branches, 6 of gaits
    base : what the map gives at c, where that is known

    Raises
    ------
    SimulationError
        where the map does not arrive.
    """
    found = measured(map_, chart, c, values) if base is None else base
    if isinstance(found, Arrival):
        raise SimulationError(f"the base of derivatives {found.outcome}")
    exact = exact_derivative(map_, chart, c, values, names) if map_.mechanism.backend.name != "python" else None
    if exact is not None:
        matrix = exact if state else exact[:, chart.size :]
        error = np.full_like(matrix, ROUND_OFF_RTOL * np.nanmax(np.abs(matrix), initial=0.0))
        return MapDerivative(matrix, error, EXACT, {})
    return differences(map_, chart, c, values, names, levels, state, found)


def differences(
    map_: ReturnMap, chart: Chart, c: Vector, values: Values, names: Sequence[str] = (), levels: int = MAX_DIFFERENCES,
    state: bool = True, base: Measured | None = None,
) -> MapDerivative:  # fmt: skip
    """The derivatives of `map_derivative`, by differences of runs."""
    found = measured(map_, chart, c, values) if base is None else base
    assert isinstance(found, Measured)
    scale = 1.0 if levels > 1 else 1e-5 / STATE_STEP  # coarser where two runs must do
    units = np.eye(chart.size) if state else ()
    columns = [_Column(unit, "", scale * STATE_STEP) for unit in units]
    none = np.zeros(chart.size)
    columns += [_Column(none, name, scale * PARAMETER_STEP * (abs(values[name]) or 1.0)) for name in names]
    size = len(found.numbers)
    for column in columns:
        if column.name:
            column.rescalings, column.step = (
                MAX_RESCALINGS,
                scale * map_.parameter_steps.get(column.name, column.step / scale),
            )
    for _ in range(TRIES + MAX_RESCALINGS):
        pending = [column for column in columns if not column.done]
        if not pending:
            break
        points = [point for column in pending for point in column.points((c, values), levels)]
        beside = iter(_beside(map_, chart, points, found))
        for column in pending:
            column.take([next(beside) for _ in range(2 * levels)], size, scale * STATE_STEP)
    map_.parameter_steps |= {column.name: column.first / scale for column in columns if column.name and column.first}
    missing = {number: column.reason for number, column in enumerate(columns) if column.best is None}
    nothing = np.full(size, np.nan), np.full(size, np.nan)
    pairs = [nothing if column.best is None else column.best for column in columns]
    matrix, error = (np.array([pair[k] for pair in pairs]).reshape(-1, size).T for k in (0, 1))
    return MapDerivative(matrix, error, f"differences of order {2 * levels}", missing)


@dataclass(eq=False)
class _Column:
    """The search for the derivative along one direction: its differences h, 2h, 4h and what they came to.

    tries, rescalings : that are left; first : h whose effect was as wanted
    bound : h from which on runs have other events
    """

    move: Vector
    name: str
    step: float
    best: tuple[Vector, Vector] | None = None
    done: bool = False
    reason: str = ""
    tries: int = TRIES
    rescalings: int = 0
    first: float = 0.0
    bound: float = np.inf

    def points(self, base: tuple[Vector, Values], levels: int) -> list[tuple[Vector, Values]]:
        """Where the map is asked for: ahead and behind at each distance."""
        c, values = base
        ends = [sign * self.step * 2.0**level for level in range(levels) for sign in (1.0, -1.0)]
        if self.name:
            return [(c, {**values, self.name: values[self.name] + h}) for h in ends]
        return [(c + h * self.move, values) for h in ends]

    def take(self, beside: Sequence[Vector | str], size: int, wanted: float) -> None:
        """What the map gave there, of which derivatives follow unless a run did not arrive: then h shrinks.

        wanted : change of the numbers of the map by h, where it may be chosen
        """
        bad = next((each for each in beside if isinstance(each, str) or len(each) != size), None)
        if bad is not None:
            self.reason = f"beside the base it {bad if isinstance(bad, str) else 'has other steps'}"
            self.bound, self.step = self.step, self.step * SHRINK
            self._tried(self.best is not None)
            return
        ends: Any = beside[:2]
        if self.rescalings and self._rescales(0.5 * float(np.nanmax(np.abs(ends[0] - ends[1]), initial=0.0)), wanted):
            return
        self.rescalings, self.first = 0, self.first or self.step
        pairs = zip(beside[::2], beside[1::2], strict=True)
        slopes = [(ahead - behind) / (2.0**level * 2.0 * self.step)  # type: ignore[operator]
                  for level, (ahead, behind) in enumerate(pairs)]  # fmt: skip
        found, last = extrapolated(slopes), self.best
        if last is not None:
            better = found[1] < last[1]
            found = np.where(better, found[0], last[0]), np.where(better, found[1], last[1])
        limits = np.maximum(1.0, np.abs(found[0]))
        if last is None:
            good = not bool(np.any(found[1] > ENOUGH * limits))
        else:
            good = not bool(np.any(found[1] > HALF_PRECISION_RTOL * limits))
        self.best = found
        self.step *= CLOSER
        self._tried(len(slopes) == 1 or good)

    def _tried(self, good: bool) -> None:
        """One try less, but for those by which the size of a parameter's difference is found."""
        if self.rescalings and not good:
            self.rescalings -= 1
            return
        self.tries -= 1
        self.done = good or self.tries <= 0

    def _rescales(self, change: float, wanted: float) -> bool:
        """Whether h is to change first, since its effect is much larger or smaller than wanted."""
        factor = wanted / change if change > UNSEEN * wanted else MAX_RESCALING
        factor = min(max(factor, 1.0 / MAX_RESCALING), MAX_RESCALING)
        step = min(self.step * factor, SHRINK * self.bound)
        if 1.0 / NEAR_ENOUGH <= step / self.step <= NEAR_ENOUGH or step > WIDEST:
            return False
        self.step, self.rescalings = step, self.rescalings - 1
        return True


def _beside(
    map_: ReturnMap, chart: Chart, points: Sequence[tuple[Vector, Values]], base: Measured
) -> list[Vector | str]:  # fmt: skip
    """The numbers of the map at points beside its base; why it does not arrive, or that other events happen."""
    starts: list[Any] = []
    for c, values in points:
        try:
            starts.append((chart.at(c, map_.vector(values)), values))
        except SimulationError as error:
            starts.append(str(error))
    arrivals = iter(map_.each([start for start in starts if not isinstance(start, str)]))
    results = [start if isinstance(start, str) else _of_arrival(map_, chart, next(arrivals)) for start in starts]
    return [
        each
        if isinstance(each, str)
        else str(map_.against(chart.section, each))
        if isinstance(each, Arrival)
        else map_.other_events(base.arrival, each.arrival) or each.numbers
        for each in results
    ]
