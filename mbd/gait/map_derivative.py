"""Derivatives of a return map by the start and by parameters.

Central differences of runs with equal steps, of steps h, 2h, 4h, with two Richardson extrapolations (order 6); the
entries of least estimated error are taken. Where a run beside the base does not arrive, h shrinks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.errors import SimulationError
from mbd.gait.return_map import Arrival, ReturnMap, Values
from mbd.gait.section import Chart

__all__ = ["MapDerivative", "Measured", "map_derivative"]

STATE_STEP, PARAMETER_STEP = 2e-4, 2e-3
"""Least of the three differences of coordinates of the section [m, rad, 1/s of them], and of parameters over them."""
COARSE_STEP = 1e-5
"""Difference where two runs a direction must do."""
LEVELS = 3
"""Differences of each direction: h, 2h, 4h."""
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
    how : 'differences of order 6', 'differences of order 2' or 'exact'
    missing : why directions have no derivative, by number
    """

    matrix: Matrix
    error: Matrix
    how: str
    missing: dict[int, str]


def measured(map_: ReturnMap, chart: Chart, c: Vector, values: Values) -> Measured | Arrival:
    """The numbers of one application from the coordinates c; the arrival alone where it does not arrive."""
    state = chart.at(c, map_.vector(values))
    arrival = map_(state, values)
    if not arrival.outcome.good or not map_.against(chart.section, arrival).good:
        return arrival
    steps = [number for _, time, length in arrival.steps for number in (time, length)]
    numbers = np.concatenate([chart.of(arrival.state), [arrival.period], arrival.travel, steps])
    return Measured(numbers, chart.size, arrival)


def map_derivative(
    map_: ReturnMap, chart: Chart, c: Vector, values: Values, names: Sequence[str] = (), fine: bool = True,
    state: bool = True,
) -> MapDerivative:  # fmt: skip
    """The derivatives at c, by all coordinates of the section (unless `state` is False), then by parameters `names`."""
    directions: list[tuple[Vector, str, float]] = []
    if state:
        directions += [(unit, "", STATE_STEP) for unit in np.eye(chart.size)]
    directions += [(np.zeros(chart.size), name, PARAMETER_STEP * (abs(values[name]) or 1.0)) for name in names]
    base = measured(map_, chart, c, values)
    if isinstance(base, Arrival):
        raise SimulationError(f"the base of derivatives {base.outcome}")
    columns, errors, missing = [], [], {}
    for number, (move, name, step) in enumerate(directions):
        found = _column(map_, chart, (c, values), (move, name), step if fine else step * COARSE_STEP / STATE_STEP,
                        LEVELS if fine else 1, len(base.numbers))  # fmt: skip
        if isinstance(found, str):
            missing[number] = found
            found = (np.full(len(base.numbers), np.nan),) * 2
        columns.append(found[0])
        errors.append(found[1])
    shape = (0, len(base.numbers))
    matrix, error = (np.array(part).T if part else np.zeros(shape).T for part in (columns, errors))
    return MapDerivative(matrix, error, f"differences of order {2 * LEVELS if fine else 2}", missing)


def _column(
    map_: ReturnMap, chart: Chart, base: tuple[Vector, Values], direction: tuple[Vector, str], step: float,
    levels: int, size: int,
) -> tuple[Vector, Vector] | str:  # fmt: skip
    """The derivative along one direction and its estimated error; why there is none, in a phrase."""
    reason, best = "", None
    for _ in range(TRIES):
        slopes: list[Vector] = []
        for level in range(levels):
            h = step * 2.0**level
            pair = [_beside(map_, chart, base, direction, sign * h) for sign in (1.0, -1.0)]
            bad = next((each for each in pair if isinstance(each, str)), None)
            if bad is None and any(len(each) != size for each in pair):
                bad = "has other steps"
            if bad is not None:
                reason = f"beside the base it {bad}"
                break
            slopes.append((pair[0] - pair[1]) / (2.0 * h))  # type: ignore[operator]
        if len(slopes) < levels:
            step *= SHRINK
            continue
        found = _extrapolated(slopes)
        if best is not None:
            better = found[1] < best[1]
            found = np.where(better, found[0], best[0]), np.where(better, found[1], best[1])
        if levels == 1 or best is not None or np.all(found[1] <= ENOUGH * np.maximum(1.0, np.abs(found[0]))):
            return found
        best, step = found, step * CLOSER
    return reason if best is None else best


def _beside(
    map_: ReturnMap, chart: Chart, base: tuple[Vector, Values], direction: tuple[Vector, str], h: float
) -> Vector | str:
    """The numbers of the map beside its base; why it does not arrive."""
    c, values = base
    move, name = direction
    if name:
        values = {**values, name: values[name] + h}
    try:
        found = measured(map_, chart, c + h * move, values)
    except SimulationError as error:
        return str(error)
    return str(found.outcome) if isinstance(found, Arrival) else found.numbers


def _extrapolated(slopes: Sequence[Vector]) -> tuple[Vector, Vector]:
    """Richardson's table of central differences of h, 2h, 4h: for each number the entry of least error estimate."""
    if len(slopes) == 1:
        return slopes[0], np.full(len(slopes[0]), np.nan)
    best, error = slopes[0], np.abs(slopes[0] - slopes[1])
    table = list(slopes)
    for order in range(1, len(slopes)):
        power = 4.0**order
        table = [(power * fine - coarse) / (power - 1.0) for fine, coarse in pairwise(table)]
        doubt = np.abs(table[0] - best)
        better = doubt <= error
        best, error = np.where(better, table[0], best), np.where(better, doubt, error)
    return best, error
