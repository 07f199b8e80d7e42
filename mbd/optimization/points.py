"""Numbers and their derivatives at trial values of the unknowns: from gaits, from runs, from a user's function."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from functools import partial
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.bodies.values import is_number, shown
from mbd.dataclass import dataclass
from mbd.equal import HALF_PRECISION_RTOL
from mbd.errors import GaitError, MbdError, ModelError, SimulationError, UnknownNameError, nearest
from mbd.gait.cycle import LimitCycle
from mbd.gait.derivatives import parameter_value
from mbd.sensitivity.result import Sensitivities
from mbd.simulation.interrupted import stopped

DIFFERENCE_STEP = 1e-3
"""Difference of an unknown, over its value or its scale, at which numbers without derivatives are found again [-]."""
SMOOTH_DIFFERENCE_STEP = 1e-5
"""The same for a user's function of numbers alone."""
CENTRAL = {2: (1.0,), 4: (4.0 / 3.0, -1.0 / 3.0), 6: (1.5, -0.6, 0.1)}
"""Weights of the slopes of central differences h, 2h, 3h, by their order [-]."""


@dataclass(eq=False)
class Point:
    """Numbers at some values of the unknowns.

    values : of the unknowns, by name; numbers : by name; outcome : '' or why there are none
    slope_of : gives the derivative of a number by all unknowns; made : the run or gait behind them
    """

    values: Mapping[str, float]
    numbers: Mapping[str, float] = field(default_factory=dict)
    outcome: str = ""
    slope_of: Callable[[str], Vector] = field(repr=False, default=lambda name: np.zeros(0))
    made: Any = field(repr=False, default=None)
    error: Exception | None = field(repr=False, default=None)


class Source(ABC):
    """Where numbers come from."""

    kind = "number"
    """What its numbers are, for errors."""

    @abstractmethod
    def check(self, name: str) -> None:
        """Raise `UnknownNameError` for a number that it never has."""

    @abstractmethod
    def at(self, values: Mapping[str, float], wanted: Sequence[str]) -> Point:
        """The numbers at these values; a point with an outcome where there are none.

        Raises
        ------
        KeyboardInterrupt
            where the user ended the run.
        """


def failed(values: Mapping[str, float], error: Exception) -> Point:
    """The point of an error, whose first sentence is its outcome; an interruption goes on."""
    run, gait = getattr(error, "run", None), getattr(error, "gait", None)
    text = str(gait.outcome) if gait is not None else str(error)
    if (run is not None and stopped(run)) or text.startswith("interrupted"):
        raise KeyboardInterrupt
    return Point(values, outcome=text, made=run if gait is None else gait, error=error)


def slope_by_differences(
    number: Callable[[float], float], value: float, scale: float, share: float, order: int
) -> float:
    """The derivative of a number by an unknown: central differences h, 2h, 3h, of order 2, 4 or 6.

    h is that share of the value. Where the value is far below the scale of the unknown, the number may change by no
    more than its round-off: there h grows, up to the same share of the scale.
    """
    known: dict[float, tuple[float, float]] = {}

    def ends(h: float) -> tuple[float, float]:
        if h not in known:
            known[h] = number(value + h), number(value - h)
        return known[h]

    most = share * max(abs(value), scale)
    h = share * abs(value) or most
    while h < most and abs(np.subtract(*ends(h))) <= HALF_PRECISION_RTOL * max(map(abs, ends(h))):
        h = min(100.0 * h, most)  # it changes the number by its round-off alone
    slopes = [(ends(k * h)[0] - ends(k * h)[1]) / (2.0 * k * h) for k in range(1, order // 2 + 1)]
    return float(np.dot(CENTRAL[order], slopes))


# gaits --------------------------------------------------------------------------------------------------------------
def gait_numbers(gait: LimitCycle) -> dict[str, float]:
    """Numbers of a gait by name: its `scalars`, and the cost of transport."""
    return {**gait.scalars, "cost of transport": gait.cost_of_transport}


class GaitSource(Source):
    """Gaits on one branch, each from the nearest one that is known.

    Newton's method may arrive at a gait of another branch, which a fold connects with this one: there the sign of
    det(1 − P) is another, so that such a gait is not taken and the way to it is cut into shorter pieces.
    """

    kind = "number of the gait"

    def __init__(self, gait: LimitCycle, scales: Mapping[str, float]) -> None:
        if not gait.success:
            raise GaitError(f"there is no gait to begin with: {gait.outcome}", gait)
        self.known = [({name: parameter_value(gait, name) for name in scales}, gait)]
        self.scales = scales

    def check(self, name: str) -> None:
        """Its numbers are those of the gait to begin with."""
        known = gait_numbers(self.known[0][1])
        if name not in known:
            raise UnknownNameError(nearest(name, known, self.kind, "It has"))

    def at(self, values: Mapping[str, float], wanted: Sequence[str]) -> Point:
        """The gait at these values, in shorter stretches where it is not found at once."""
        try:
            gait = self._reached(values)
        except (GaitError, SimulationError) as error:
            return failed(values, error)
        self.known.append((dict(values), gait))
        return gait_point(gait, values, self.scales)

    def _reached(self, values: Mapping[str, float]) -> LimitCycle:
        """The gait, with its way there cut into halves, quarters, … as long as that helps."""
        begin, gait = min(self.known, key=lambda pair: self._apart(pair[0], values))
        done, share = 0.0, 1.0
        while done < 1.0:
            target = min(done + share, 1.0)
            try:
                gait = _beside(gait, {name: begin[name] + target * (values[name] - begin[name]) for name in values})
                done = target
            except GaitError:
                share /= 2.0
                # how often the way to a gait is halved where Newton's method does not find it at once
                if share < 0.5**4:
                    raise
        return gait

    def _apart(self, one: Mapping[str, float], other: Mapping[str, float]) -> float:
        return max(abs(one[name] - other[name]) / scale for name, scale in self.scales.items())


def _beside(gait: LimitCycle, values: Mapping[str, float]) -> LimitCycle:
    """The gait of the same branch at other values."""
    found = gait.at(values)
    if _index(found) != _index(gait):
        raise GaitError("the search leads to a gait of another branch, beyond a fold or a branch point")
    return found


def _index(gait: LimitCycle) -> float:
    """The sign of det(1 − P)."""
    return float(np.sign(np.prod(1.0 - np.asarray(gait.multipliers)).real))


def gait_point(gait: LimitCycle, values: Mapping[str, float], scales: Mapping[str, float]) -> Point:
    """The numbers of a gait; their derivatives are those of the gait, differences where it has none."""
    names, known = list(values), dict[str, Vector]()

    def slope_of(number: str) -> Vector:
        if number not in known:
            own = number in gait.scalars
            known[number] = np.array([
                gait.derivatives[number, name] if own else _difference(gait, number, name, scales[name])
                for name in names
            ])  # fmt: skip
        return known[number]

    return Point(values, gait_numbers(gait), "", slope_of, gait)


def _difference(gait: LimitCycle, number: str, name: str, scale: float) -> float:
    """Of gaits found again beside this one, to the fourth order."""
    return slope_by_differences(
        lambda value: gait_numbers(gait.at({name: value}))[number], parameter_value(gait, name), scale,
        DIFFERENCE_STEP, 4,
    )  # fmt: skip


# functions ----------------------------------------------------------------------------------------------------------
class FunctionSource(Source):
    """A user's function of the unknowns: it gives a gait, a table of derivatives, or numbers by name.

    Gaits and tables have exact derivatives; numbers alone are differentiated by central differences.
    """

    kind = "number of what the function gives"

    def __init__(self, function: Callable[[dict[str, float]], Any], scales: Mapping[str, float]) -> None:
        self.function, self.scales = function, scales
        self.known: set[str] | None = None

    def check(self, name: str) -> None:
        """Names are known after the first call."""
        if self.known is not None and name not in self.known:
            raise UnknownNameError(nearest(name, self.known, self.kind, "There are"))

    def at(self, values: Mapping[str, float], wanted: Sequence[str]) -> Point:
        """What the function gives, or the error that it raises, if it is one of a model or a run."""
        try:
            found = self.function(dict(values))
        except MbdError as error:
            return failed(values, error)
        if isinstance(found, LimitCycle):
            point = gait_point(found, values, self.scales) if found.success else failed(values, GaitError("", found))
        elif isinstance(found, Sensitivities):
            point = table_point(found, values)
        elif isinstance(found, Mapping) and all(isinstance(k, str) and is_number(v) for k, v in found.items()):
            point = Point(values, dict(found), made=found)
            point.slope_of = lambda name: self._slopes(point, name)
        else:
            raise ModelError(
                "the function must give a LimitCycle, the derivatives of mbd.sensitivities, or numbers by name such as "
                f"{{'speed': 1.2}}, not {shown(found)}"
            )
        self.known = set(point.numbers) or self.known
        return point

    def _slopes(self, point: Point, name: str) -> Vector:
        def number(unknown: str, value: float) -> float:
            return float(self.function({**point.values, unknown: value})[name])

        return np.array([
            slope_by_differences(partial(number, unknown), value, self.scales[unknown], SMOOTH_DIFFERENCE_STEP, 2)
            for unknown, value in point.values.items()
        ])  # fmt: skip


def table_point(found: Sensitivities, values: Mapping[str, float]) -> Point:
    """The numbers of a table of derivatives, by the unknowns among its columns."""
    missing = [nearest(name, found.wrt, "column", "The table has") for name in values if name not in found.wrt]
    if missing:
        raise UnknownNameError(missing)

    def slope_of(number: str) -> Vector:
        return np.array([found[number, name] for name in values])

    return Point(values, dict(zip(found.of, map(float, found.values), strict=True)), "", slope_of, found.run)
