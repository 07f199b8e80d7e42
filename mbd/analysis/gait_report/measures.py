"""Numbers of a gait by side, and where its energy goes."""

from collections.abc import Callable, Sequence
from dataclasses import field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mbd.analysis.gait_report.curves import forces_at, grips_of
from mbd.analysis.gait_report.strides import Side, Stride, of_side
from mbd.arrays import Vector
from mbd.dataclass import dataclass
from mbd.results.impulses import Impulse
from mbd.results.interpolation import OneSide
from mbd.results.trajectory import Trajectory

MIN_SAMPLES = 9
"""Samples of a part between two events at least, and of each refinement [-]."""

NO_SIDE = "both"
"""Of what belongs to no side."""

MIDDLE = (0.25, 0.85)
"""Shares of swing between which clearance is sought: near both ends every foot is close to the ground."""

CANCELLATION_RTOL = 1e-3
"""Part of what braking and driving come to, below which their sum is none: they cancel [-]."""

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(4)

FORWARD = ("forward", "friction")
"""Parts of impulses along the way: in space, and in the plane."""

Values = dict[tuple[str, str], float]
"""By quantity and unit."""


@dataclass(frozen=True)
class Measure:
    """A number of a gait: quantity, unit, and by side the mean over the strides and its standard deviation.

    gross : what the parts of a sum come to without their signs, by side: of a forward impulse braking and driving
    """

    quantity: str
    unit: str
    mean: dict[str, float]
    spread: dict[str, float]
    gross: dict[str, float] = field(default_factory=dict)

    def cancels(self, sides: Sequence[str]) -> bool:
        """Whether the numbers of these sides are but what is left where their parts cancel."""
        return sum(abs(self.mean[side]) for side in sides) <= CANCELLATION_RTOL * sum(
            self.gross.get(side, 0.0) for side in sides
        )


@dataclass(frozen=True)
class Spent:
    """Energy that a cause gave in a stride, negative where it took it [J]: its side, kind and name."""

    side: str
    kind: str
    name: str
    energy: float


def measures_of(run: Trajectory, sides: Sequence[Side], mass: float | None) -> list[Measure]:
    """Spatio-temporal numbers and loads, each by side."""
    found: dict[str, list[Values]] = {}
    found_gross: dict[str, float] = {}
    impulses = run.impulses
    for side in sides:
        others = [each for each in sides if each is not side]
        sampled = zip(_peaks(run, side), _clearances(run, side), _impulses(run, side), strict=True)
        strides = [
            _of_stride(run, side, others, stride, mass, impulses, own)
            for stride, own in zip(side.strides, sampled, strict=True)
        ]
        found[side.name] = [values for values, _ in strides]
        found_gross[side.name] = float(np.mean([gross for _, gross in strides]))
    measures = []
    for quantity, unit in next(iter(found.values()))[0]:
        columns = {side: np.array([each[quantity, unit] for each in rows]) for side, rows in found.items()}
        known = {side: column[np.isfinite(column)] for side, column in columns.items()}
        mean = {side: float(np.mean(column)) if len(column) else float("nan") for side, column in known.items()}
        spread = {side: float(np.std(column)) if len(column) else float("nan") for side, column in known.items()}
        gross = {side: found_gross[side] for side in found if quantity == "forward impulse"}
        measures.append(Measure(quantity, unit, mean, spread, gross))
    return measures


def _of_stride(
    run: Trajectory, side: Side, others: Sequence[Side], stride: Stride, mass: float | None,
    impulses: Sequence[Impulse], sampled: tuple[float, float, NDArray[np.float64]],
) -> tuple[Values, float]:  # fmt: skip
    """The numbers of a stride, and what its forward impulse comes to without signs.

    sampled : its largest normal force [N], the clearance of its swing [m] and what its forces come to [N s]
    """
    period, (step_time, step_length) = stride.duration, stride.step
    stance = (stride.off - stride.begin) / period * 100.0
    together = [
        max(0.0, min(b, d) - max(a, c))
        for a, b in _within(side, stride)
        for other in others
        for c, d in _within(other, stride)
    ]
    peak, clearance, (normal, forward, gross) = sampled
    if stride.begin > run.time[0]:
        struck, impacts = _impacts(run, side, stride, impulses)
    else:  # of a foot that stands at the start the strike is not known
        struck, impacts = float("nan"), np.full(2, np.nan)
    normal, forward = normal + impacts[0], forward + impacts[1]
    gross += abs(impacts[1]) if np.isfinite(impacts[1]) else 0.0
    per, scale = ("", 1.0) if mass is None else ("/kg", 1.0 / mass)
    values = {
        ("step length", "m"): step_length,
        ("step time", "s"): step_time,
        ("stride length", "m"): stride.length,
        ("stride time", "s"): period,
        ("speed", "m/s"): stride.length / period,
        ("cadence", "1/min"): 60.0 * (1 + len(others)) / period,
        ("stance", "%"): stance,
        ("swing", "%"): 100.0 - stance,
        ("double support", "%"): sum(together) / period * 100.0,
        ("clearance", "mm"): 1e3 * clearance,
        ("normal impulse", f"N s{per}"): scale * normal,
        ("forward impulse", f"N s{per}"): scale * forward,
        ("strike impulse", f"N s{per}"): scale * struck,
        ("peak normal force", f"N{per}"): scale * peak,
    }
    return values, scale * gross


def _impacts(
    run: Trajectory, side: Side, stride: Stride, impulses: Sequence[Impulse]
) -> tuple[float, NDArray[np.float64]]:
    """Normal impulse of the strikes of a foot; normal and forward impulse of all impacts in which it stands, as of a
    knee that locks (2,) [N s].
    """
    strikes = {event.time for event in run.events if event.kind == "closed" and event.name in side.contacts}
    bearers = {*side.contacts, *grips_of(run, side)}
    taken = [one for one in impulses if one.name in bearers and stride.begin <= one.time < stride.end]
    normal = [one for one in taken if one.part == "normal"]
    struck = sum(one.impulse for one in normal if one.time in strikes)
    forward = sum(one.impulse for one in taken if one.part in FORWARD)
    return struck, np.array([sum(one.impulse for one in normal), forward])


def _impulses(run: Trajectory, side: Side) -> list[NDArray[np.float64]]:
    """∫ of the normal force, of the forward force and of its size over each stride (3,) [N s], without impacts.

    It is taken from one event to the next, at which forces may jump.
    """
    times, weights = [], []
    for stride in side.strides:
        events = [event.time for event in run.events if stride.begin < event.time < stride.end]
        # parts of a stride on each of which these points integrate a force, besides those that events make
        knots = np.unique([*np.linspace(stride.begin, stride.end, 251), *events])
        half = np.diff(knots)[:, None] / 2.0
        times.append((knots[:-1, None] + half * (1.0 + POINTS)).ravel())
        weights.append((half * WEIGHTS).ravel())
    forces = forces_at(run, side, np.concatenate(times))
    normal, forward = forces["normal force"], forces["forward force"]
    ends = np.cumsum([len(own) for own in times])[:-1]
    parts = zip(weights, *(np.split(column, ends) for column in (normal, forward, np.abs(forward))), strict=True)
    return [np.array([np.sum(weight * force) for force in columns]) for weight, *columns in parts]


def _within(side: Side, stride: Stride) -> list[tuple[float, float]]:
    """Stances of a side, cut to a stride."""
    cut = [(max(a, stride.begin), min(b, stride.end)) for a, b in side.stances]
    return [(a, b) for a, b in cut if b > a]


def _peaks(run: Trajectory, side: Side) -> list[float]:
    """The largest normal force of each stride [N]."""
    strides = [(stride.begin, stride.end) for stride in side.strides]
    events = [event.time for event in run.events]
    return largest(lambda times, at: forces_at(run, side, times, at)["normal force"], strides, events)


def _clearances(run: Trajectory, side: Side) -> list[float]:
    """The smallest gap of the foot in the middle of the swing of each stride [m]; NaN without a swing."""

    def sunk(times: Vector, at: OneSide) -> Vector:
        named = run.at(times, side=at)
        return np.asarray(-np.min([named[f"{name}.gap"] for name in side.contacts], axis=0))

    swings = {stride.begin: (stride.off, stride.end) for stride in side.strides if np.isfinite(stride.off)}
    middles = [(off + MIDDLE[0] * (end - off), off + MIDDLE[1] * (end - off)) for off, end in swings.values()]
    found = dict(zip(swings, largest(sunk, middles, [event.time for event in run.events]), strict=True))
    return [-found[stride.begin] if stride.begin in found else float("nan") for stride in side.strides]


def energy_of(run: Trajectory, sides: Sequence[Side]) -> list[Spent]:
    """What each cause gave in one stride, the mean over the strides of the first side [J]."""
    strides = sides[0].strides
    rows = np.searchsorted(run.time, [strides[0].begin, strides[-1].end], side="right") - 1
    first, last = (int(row) for row in rows)
    found = [
        Spent(
            next((side.name for side in sides if of_side(part.name, side.name)), NO_SIDE), part.kind, part.name,
            float(part.energy[last] - part.energy[first]) / len(strides),
        )
        for part in run.energy.parts
    ]  # fmt: skip
    numerical = float(run.energy.numerical[last] - run.energy.numerical[first]) / len(strides)
    return [*found, Spent(NO_SIDE, "numerical", "numerical", numerical)]


def largest(
    values: Callable[[Vector, OneSide], Vector], intervals: Sequence[tuple[float, float]], breaks: Sequence[float]
) -> list[float]:
    """The maximum in each interval of a function that is smooth between `breaks`, at which it may jump.

    1. each part of an interval is sampled from just after its beginning to just before its end;
    2. around the largest sample of all the function is sampled again between that sample's neighbours, several times.

    The samples of all intervals are asked for at once.

    Parameters
    ----------
    values : of the function at times [s], 'after' or 'before' what happens there
    """
    parts, owners = [], []
    for owner, (begin, end) in enumerate(intervals):
        knots = np.unique([begin, *(time for time in breaks if begin < time < end), end])
        for first, last in pairwise(knots):
            # samples of the whole interval among which the largest is looked for first
            count = max(MIN_SAMPLES, int(np.ceil(1001 * (last - first) / (end - begin))))
            parts.append(np.linspace(first, last, count))
            owners.append(owner)
    # of each interval the part with the largest sample
    best: dict[int, tuple[float, Vector]] = {}
    for owner, times, found in zip(owners, parts, _sampled(values, parts), strict=True):
        best[owner] = max(best.get(owner, (-np.inf, times[:2])), _around(found, times), key=lambda one: one[0])
    for _ in range(4):  # each four times as finely
        finer = [np.linspace(float(near[0]), float(near[1]), MIN_SAMPLES) for _, near in best.values()]
        for owner, times, found in zip(best, finer, _sampled(values, finer), strict=True):
            here, near = _around(found, times)
            best[owner] = max(best[owner][0], here), near
    return [float(best[owner][0]) for owner in range(len(intervals))]


def _sampled(values: Callable[[Vector, OneSide], Vector], parts: Sequence[Vector]) -> list[Vector]:
    """The function in each part, from just after its first time to just before its last one."""
    if not parts:
        return []
    inside = values(np.concatenate([times[:-1] for times in parts]), "after")
    ends = values(np.array([times[-1] for times in parts]), "before")
    split = np.split(inside, np.cumsum([len(times) - 1 for times in parts])[:-1])
    return [np.append(found, end) for found, end in zip(split, ends, strict=True)]


def _around(found: Vector, times: Vector) -> tuple[float, Vector]:
    """The largest sample, and the times of its neighbours."""
    place = int(np.argmax(found))
    return float(found[place]), times[[max(place - 1, 0), min(place + 1, len(times) - 1)]]
