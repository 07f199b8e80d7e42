"""Curves of special points in two parameters: the slope at which steps double, over the mass of the hip.

A point of a branch in p at a value of q leads to the one at the next value: the gait is corrected there, near where the
points before lead, and the test function of its kind, or the limit of its events, is located along the branch in p.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.bodies.values import is_finite_number, shown
from mbd.dataclass import dataclass
from mbd.errors import GaitError, MbdError, ModelError
from mbd.gait.continuation import BranchPoint, Continuation, Corrected
from mbd.gait.derivatives import parameter_value
from mbd.gait.limits import changed_events, limit_between
from mbd.gait.margins import margin_at, watched_feet
from mbd.gait.special_points import TESTS, SpecialPoint, polished
from mbd.later import later
from mbd.notebook import table
from mbd.results.titled import Titled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DIFFERENCE_STEP = 0.001
"""Distance along the tangent at which a test function is asked for a second time [-]."""
LIMIT_DISTANCE = 0.02
"""Distance before a limit of events from which it is looked for [-]."""
SECANTS, LOCATED = 12, 1e-12
"""Evaluations of a margin at most, and the distance at which it counts as zero [-]."""


@dataclass(frozen=True, eq=False)
class PointCurve(Titled):
    """Special points of one kind over a second parameter.

    parameters : names of the one that is found and of the other; over : values of the other; points : in order
    stopped : why it ends where it does; complete : False where Ctrl-C ended it
    """

    known_as = "curve"

    name: str
    kind: str
    what: str
    parameters: tuple[str, str]
    over: tuple[float, ...]
    points: tuple[SpecialPoint, ...]
    stopped: str
    given: Continuation = field(repr=False)
    complete: bool = True

    def __len__(self) -> int:
        return len(self.points)

    @property
    def columns(self) -> dict[str, list[Any]]:
        """Both parameters, period and speed there, and the error of the first, by title."""
        return {
            self.parameters[1]: list(self.over),
            self.parameters[0]: [point.value for point in self.points],
            "period": [point.point.period for point in self.points],
            "speed": [point.point.speed for point in self.points],
            "error": [point.error for point in self.points],
        }

    def __repr__(self) -> str:
        first, second = self.parameters
        what = f"{self.kind} of {self.what!r}" if self.what else self.kind
        ends = ", ".join(f"{self.points[k].value:.9g} at {second} = {self.over[k]:.6g}" for k in (0, -1))
        return f"{self.name}: {what} at {first} = {ends}; {len(self)} points; {self.stopped}"

    def _repr_html_(self) -> str:
        columns = self.columns
        rows = [[f"{value:.9g}" for value in line] for line in zip(*columns.values(), strict=True)]
        return table(f"{self.kind} of {self.name}", list(columns), rows, self.stopped)

    def plot(self, path: str | Path | None = None) -> Figure:
        """The first parameter over the second."""
        figure: Figure = later("PointCurve.plot")(self, path)
        return figure


def follow(branch: Any, point: Any, parameter: str, to: float, steps: int) -> PointCurve:
    """The points of the kind of `point` over another parameter; see `Branch.follow`."""
    given, value = _begun(branch, point, parameter, to, steps)
    over, found, why = [value], [point], ""
    step = (float(to) - value) / steps
    share, complete = 1.0, True
    while abs(over[-1] - to) > 1e-12 * abs(to - value):
        left = to - over[-1]
        move = left if abs(left) <= abs(share * step) * (1.0 + 1e-9) else share * step
        there = replace(given, values={**given.values, parameter: over[-1] + move})
        try:
            new = _next(there, over, found, over[-1] + move)
        except KeyboardInterrupt:
            complete = False
            break
        except (MbdError, np.linalg.LinAlgError) as error:
            new, why = None, str(error)
        if new is None:
            share *= 0.5
            if share < 1e-4:  # least part of a step in the second parameter that is tried
                break
            continue
        over.append(over[-1] + move)
        found.append(new)
        share = min(1.0, 2.0 * share)
    reached = abs(over[-1] - to) <= 1e-12 * abs(to - value)
    stopped = f"ends at {parameter} = {over[-1]:.9g}: beyond it no such point was found near"
    stopped += f" ({why})" if why else ""
    if not complete:
        stopped = f"interrupted after {len(found)} points"
    elif reached:
        stopped = f"reached {parameter} = {to:g}"
    names = (given.name, parameter)
    return PointCurve(branch.name, point.kind, point.what, names, tuple(over), tuple(found), stopped, given, complete)


def _begun(branch: Any, point: Any, parameter: Any, to: Any, steps: Any) -> tuple[Continuation, float]:
    """What the points share, and the first value of the second parameter; every fault of the arguments."""
    faults = []
    if not isinstance(point, SpecialPoint) or not any(point is each for each in branch.special):
        faults.append(f"point must be one of this branch, such as branch.points()[0], not {shown(point)}")
    if not isinstance(parameter, str):
        faults.append(f"parameter must be a name, not {shown(parameter)}")
    elif parameter == branch.parameter:
        faults.append(f"parameter {parameter!r} is that of the branch; give another one")
    faults += [] if is_finite_number(to) else [f"to must be a finite number, not {shown(to)}"]
    if isinstance(steps, bool) or not isinstance(steps, int) or not 1 <= steps <= 10_000:
        faults.append(f"steps must be a whole number from 1 to 10000, not {shown(steps)}")
    if faults:
        raise ModelError(faults)
    value = parameter_value(branch.start, parameter)
    if to == value:
        raise ModelError(f"to={to!r} is the value of {parameter!r} that the branch has; give another")
    given = branch.given
    return replace(given, values={**given.values, parameter: value}), value


def _next(given: Continuation, over: list[float], found: list[SpecialPoint], value: float) -> SpecialPoint | None:
    """The point at the next value of the second parameter; None where there is none near."""
    last = found[-1]
    if last.before is not None:
        return _limit(given, last)
    base = last.point
    guess = np.zeros(len(base.tangent))
    if len(found) > 1:
        share = (value - over[-1]) / (over[-1] - over[-2])
        earlier = found[-2].point
        guess[:-1] = -share * base.chart.of(earlier.state)
        guess[-1] = share * (base.value - earlier.value) / given.width
    corrected = given.corrected(base, base.tangent, float(base.tangent @ guess), guess)
    if not isinstance(corrected, Corrected):
        return None
    near = given.point(corrected, given.whole(base))
    if changed_events(base.events, near.events):
        raise GaitError("other events happen there")
    return _tested(given, near, last) if last.kind in TESTS else _margin(given, near, last)


def _tested(given: Continuation, near: BranchPoint, last: SpecialPoint) -> SpecialPoint | None:
    """The zero of the test function of a kind near a gait."""
    test = TESTS[last.kind]
    corrected = given.corrected(near, near.tangent, DIFFERENCE_STEP)
    if not isinstance(corrected, Corrected):
        return None
    here, beside = test(near), test(given.point(corrected, given.whole(near)))
    slope = (beside - here) / DIFFERENCE_STEP
    if slope == 0.0:
        return None
    located = polished(given, near, -here / slope, slope, test)
    return None if located is None else SpecialPoint(last.kind, located[0].value, *located)


def _margin(given: Continuation, near: BranchPoint, last: SpecialPoint) -> SpecialPoint | None:
    """The zero of a margin near a gait, by the secant method."""
    from scipy.optimize import root_scalar

    watched, places = watched_feet(given.map, given.friction), list[float]()

    def margin(place: float) -> float:
        places.append(place)
        return margin_at(given, watched, near, (last.kind, last.what), place)[0]

    ended = root_scalar(margin, method="secant", x0=0.0, x1=DIFFERENCE_STEP, xtol=LOCATED, maxiter=SECANTS)
    if not ended.converged:
        return None
    _, corrected = margin_at(given, watched, near, (last.kind, last.what), ended.root)
    point, along = given.point(corrected, given.whole(near)), abs(ended.root - places[-1])
    return SpecialPoint(last.kind, point.value, point, (along + given.tol) * given.width, last.what)


def _limit(given: Continuation, last: SpecialPoint) -> SpecialPoint | None:
    """The limit of the events of a walk near that at the last value of the second parameter."""
    assert last.before is not None
    near = last.before
    corrected = given.corrected(near, near.tangent, 0.0)
    if not isinstance(corrected, Corrected) or changed_events(near.events, corrected.found.arrival.events):
        return None
    inside = given.point(corrected, given.whole(near))
    for ds in _growing():
        ahead = given.corrected(inside, inside.tangent, ds)
        if isinstance(ahead, Corrected) and not changed_events(inside.events, ahead.found.arrival.events):
            continue
        limit = limit_between(given, [inside], ds, back=LIMIT_DISTANCE)
        return limit if limit is not None and (limit.kind, limit.what) == (last.kind, last.what) else None
    return None


def _growing() -> Iterator[float]:
    ds = 0.25 * LIMIT_DISTANCE
    while ds < 10.0 * LIMIT_DISTANCE:
        yield ds
        ds *= 1.5
