"""Follow a gait as a parameter changes: stability along it, folds, doublings, where it ends and why."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.arrays import Vector
from mbd.bodies.values import is_finite_number, shown
from mbd.dataclass import dataclass
from mbd.errors import MbdError, ModelError, UnknownNameError, nearest
from mbd.gait.continuation import QUICK, BranchPoint, Continuation, Corrected, Forbidden
from mbd.gait.cycle import LimitCycle
from mbd.gait.derivatives import parameter_value, require_member
from mbd.gait.follow import PointCurve, follow
from mbd.gait.limits import changed_events, limit_between, limit_beyond
from mbd.gait.map_derivative import Measured, map_derivative, measured
from mbd.gait.margins import Margin, Margins, least_margins, margin_points, watched_feet
from mbd.gait.special_points import KINDS, SpecialPoint, special_points
from mbd.gait.switching import doubled
from mbd.later import later
from mbd.notebook import table
from mbd.results.titled import Titled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIRST_DISTANCE, MAX_DISTANCE, MIN_DISTANCE = 0.02, 0.1, 1e-6
"""First, largest and least distance of two points in (c, p/σ) [-]."""
MIN_DISTANCE_RATIO = 1e-3
"""Part of the first distance from which a test function that jumps is no reason for a shorter one [-]."""
MAX_TURN = 0.3
"""Largest angle between the tangents of two points [rad]."""


@dataclass(frozen=True, eq=False)
class Branch(Titled):
    """Gaits along a parameter.

    parameter : its name; curve : points in order; special : folds, doublings, tori and branch points, located
    stopped : why it ends where it does; complete : False where Ctrl-C ended it
    """

    known_as = "branch"

    name: str
    parameter: str
    curve: tuple[BranchPoint, ...]
    special: tuple[SpecialPoint, ...]
    stopped: str
    start: LimitCycle = field(repr=False)
    given: Continuation = field(repr=False)
    complete: bool = True

    def __len__(self) -> int:
        return len(self.curve)

    @property
    def columns(self) -> dict[str, list[Any]]:
        """Parameter, period, speed, largest multiplier and stability of every point, by title."""
        return {
            self.parameter: [point.value for point in self.curve],
            "period": [point.period for point in self.curve],
            "distance": [point.distance for point in self.curve],
            "speed": [point.speed for point in self.curve],
            "largest multiplier": [point.multipliers.largest for point in self.curve],
            "stable": [point.stable for point in self.curve],
        }

    def points(self, *kinds: str) -> tuple[SpecialPoint, ...]:
        """The special points of these kinds; without names all.

        'fold', 'doubling', 'torus', 'branch point': of the map. 'scuff' (a foot touches down early), 'graze' (another
        contact begins to close), 'lost event' (a knee no longer locks), 'new event', 'release' (a foot would have to
        pull and lets go), 'slip', 'fall': beyond it other things happen. 'pull': a foot that its rule holds begins to
        pull.
        """
        wrong = [nearest(kind, KINDS, "kind of point", "There are") for kind in kinds if kind not in KINDS]
        if wrong:
            raise UnknownNameError(wrong)
        return tuple(point for point in self.special if not kinds or point.kind in kinds)

    def gait(self, value: float) -> LimitCycle:
        """The gait at a value of the parameter, from the nearest point of the branch.

        Raises
        ------
        GaitError
            where there is none near.
        """
        near = min(self.curve, key=lambda point: abs(point.value - value))
        return self._at(near).at({self.parameter: value})

    def switch(self, point: SpecialPoint) -> LimitCycle:
        """The gait of twice the period beside a doubling, from which `mbd.branch` goes on.

        Raises
        ------
        ModelError
            for a point of another kind.
        GaitError
            where none is found.
        """
        if not isinstance(point, SpecialPoint) or point.kind != "doubling":
            raise ModelError(
                f"point must be a doubling of this branch, such as branch.points('doubling')[0], not {shown(point)}"
            )
        return doubled(self.given, point, self._at(point.point))

    def follow(self, point: SpecialPoint, parameter: str, to: float, *, steps: int = 20) -> PointCurve:
        """The special point over a second parameter, ``slopes.follow(doubling, "hip.mass", to=15.0)``.

        Folds, doublings, tori, branch points, pulls, slips, and limits at which events change, such as scuffs.

        Parameters
        ----------
        point : of this branch
        parameter : another parameter, or function of parameters
        to : its value at which the curve ends
        steps : points between; more where the next one is not found

        Raises
        ------
        ModelError, UnknownNameError
            for arguments that cannot be meant.
        """
        return follow(self, point, parameter, to, steps)

    def _at(self, point: BranchPoint) -> LimitCycle:
        """A gait of the branch to go on from."""
        values = self.given.with_value(point.value)
        return replace(self.start, state=point.state, chart=point.chart, parameters=values)

    def __repr__(self) -> str:
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        first, last = self.curve[0].value, self.curve[-1].value
        yield f"{self.name}: {len(self)} gaits, {self.parameter} from {first:.6g} to {last:.6g}; {self.stopped}"
        yield from (f"  {point!r}" for point in self.special)

    def _repr_html_(self) -> str:
        columns = self.columns
        rows = [[f"{value:.6g}" if isinstance(value, float) else str(value) for value in line]
                for line in zip(*columns.values(), strict=True)]  # fmt: skip
        notes = "; ".join([self.stopped, *map(repr, self.special)])
        return table(f"gaits of {self.name}", list(columns), rows, notes)

    def plot(self, path: str | Path | None = None, quantity: str = "speed") -> Figure:
        """A quantity of `columns` over the parameter: stable gaits solid, others dashed, special points marked."""
        figure: Figure = later("Branch.plot")(self, quantity, path)
        return figure


def branch(
    gait: LimitCycle, parameter: str, to: float, *, steps: int = 200, step: float | None = None,
    friction: float | None = None,
) -> Branch:  # fmt: skip
    """The gaits that a gait becomes as a parameter changes.

    Pseudo-arclength continuation goes around folds. Where a test function of a fold, a doubling, a torus (Neimark &
    Sacker) or a branch point changes sign, the point is located; so are those from which on other events happen (a foot
    scuffs, a knee no longer locks) or a foot that a rule holds would have to pull. The branch ends at `to`; where the
    walk is lost, which its `stopped` says; or after so many points. Ctrl-C keeps the points that are found.

    Parameters
    ----------
    gait : from `mbd.limit_cycle`, `mbd.find_gait` or `Branch.switch`
    parameter : its name, or that of a function of parameters that the gait was found with
    to : value at which the branch ends
    steps : points at most
    step : first distance of two points, with the parameter over the range to go and coordinates in SI units [-]
    friction : coefficient that the ground has: where a foot that sticks would need more, a 'slip' is marked [-]

    Returns
    -------
    Branch

    Raises
    ------
    ModelError, UnknownNameError
        for arguments that cannot be meant: no gait, a parameter that is none or that changes nothing.
    """
    given, first = _begun(gait, parameter, to, steps, step, friction)
    toward = np.sign(to - first.value)
    if first.tangent[-1] * toward < 0.0:
        first = _turned(first)
    curve, special, complete = [first], list[SpecialPoint](), True
    ds = FIRST_DISTANCE if step is None else float(step)
    try:
        stopped = _grown(given, curve, special, to, steps, ds, watched_feet(gait.map, friction))
    except KeyboardInterrupt:
        stopped, complete = f"interrupted after {len(curve)} points", False
    return Branch(gait.name, parameter, tuple(curve), tuple(special), stopped, gait, given, complete)


def _grown(
    given: Continuation, curve: list[BranchPoint], special: list[SpecialPoint], to: float, steps: int, ds: float,
    watched: list[Margin],
) -> str:  # fmt: skip
    """Add points and special points to those of a branch until it ends, and say why it does."""
    parameter, toward = given.name, np.sign(to - curve[0].value)
    margins = _margins(given, watched, curve[0])
    while len(curve) < steps:
        last = curve[-1]
        made = _next(given, last, ds)
        if isinstance(made, Forbidden):
            value = given.last_allowed(last.value, made.value)
            curve += _last(given, last, value, made.value)
            return f"ends at {parameter} = {value:.9g}: beyond it {made}"
        if isinstance(made, str):
            limit = limit_beyond(given, curve)
            special += [] if limit is None else [limit]
            return _ended(given, last, limit, made)
        new, taken, quick = made
        beyond = (new.value - to) * toward >= 0.0
        between, all_located = special_points(given, last, new, taken)
        if not (all_located or changed_events(last.events, new.events)) and taken > MIN_DISTANCE_RATIO * FIRST_DISTANCE:
            ds = 0.5 * taken
            continue
        if changed_events(last.events, new.events):
            limit = limit_between(given, curve, taken)
            between += [] if limit is None else [limit]
        before, margins = margins, _margins(given, watched, new)
        between += margin_points(given, watched, (last, new), (before, margins), taken)
        between.sort(key=lambda point: abs(point.value - curve[-1].value))
        special += [point for point in between if not (point.value - to) * toward > 0.0]
        if beyond:
            guess = taken * last.tangent * (to - last.value) / (new.value - last.value or 1.0)
            curve += _last(given, last, to, new.value, guess) or [new]
            return f"reached {parameter} = {to:g}"
        curve.append(new)
        ds = min(taken * (1.5 if quick else 1.0), MAX_DISTANCE)
    return f"ended after {len(curve)} points"


def _margins(given: Continuation, watched: list[Margin], point: BranchPoint) -> Margins:
    return least_margins(given.map, watched, point.state, given.with_value(point.value), exact=False)


def _begun(
    gait: Any, parameter: Any, to: Any, steps: Any, step: Any, friction: Any
) -> tuple[Continuation, BranchPoint]:
    """What the branch shares, and its first point; every fault of the arguments."""
    if not isinstance(gait, LimitCycle) or not gait.success:
        raise ModelError(f"gait must be one that mbd.limit_cycle has found, not {shown(gait)}")
    faults = [] if isinstance(parameter, str) else [f"parameter must be a name, not {shown(parameter)}"]
    faults += [] if is_finite_number(to) else [f"to must be a finite number, not {shown(to)}"]
    if isinstance(steps, bool) or not isinstance(steps, int) or steps < 2:
        faults.append(f"steps must be a whole number from 2 on, not {shown(steps)}")
    if step is not None and not (is_finite_number(step) and MIN_DISTANCE <= step <= 1.0):
        faults.append(f"step must be a number from {MIN_DISTANCE:g} to 1, not {shown(step)}")
    if friction is not None and not (is_finite_number(friction) and friction > 0.0):
        faults.append(f"friction must be a positive coefficient or None, not {shown(friction)}")
    if faults:
        raise ModelError(faults)
    value = parameter_value(gait, parameter)
    if to == value:
        raise ModelError(f"to={to!r} is the value of {parameter!r} at which the gait was found; give another")
    width = abs(float(to) - value)
    require_member(gait)
    given = Continuation(
        gait.map, gait.chart.section, parameter, gait.parameters, width, gait.given.tol, friction, gait.given.member
    )
    found = measured(gait.map, gait.chart, np.zeros(gait.chart.size), given.with_value(value))
    assert isinstance(found, Measured)
    first = given.point(Corrected(gait.state, value, found, 0), None)
    if given.follows_member:
        return given, first
    zero = np.zeros(gait.chart.size)
    by = map_derivative(gait.map, gait.chart, zero, given.with_value(value), [parameter], levels=2, state=False)
    if not by.missing and np.nanmax(np.abs(width * by.matrix), initial=0.0) <= 1e-13:  # it changes nothing
        raise ModelError(f"parameter: {parameter!r} changes nothing of this gait")
    return given, first


def _turned(point: BranchPoint) -> BranchPoint:
    return replace(point, tangent=-point.tangent)


def _next(given: Continuation, last: BranchPoint, ds: float) -> tuple[BranchPoint, float, bool] | Forbidden | str:
    """The next point, its distance, and whether it came quickly; why there is none."""
    why = ""
    while ds >= MIN_DISTANCE:
        corrected = given.corrected(last, last.tangent, ds)
        if isinstance(corrected, Corrected):
            try:
                new = given.point(corrected, given.whole(last))
            except MbdError as error:
                why = str(error)
                ds *= 0.5
                continue
            cosine = float(given.lifted(given.whole(last), new.chart) @ new.tangent)
            if given.leaves_smooth_part(last, new.how):
                why = "the map has no derivative there"
            elif cosine >= np.cos(MAX_TURN):
                return new, ds, corrected.corrections <= QUICK
            else:
                why = "it turns too sharply"
        elif isinstance(corrected, Forbidden) and last.tangent[-1] * (corrected.value - last.value) > 0.0:
            return corrected
        else:
            why = str(corrected)
        ds *= 0.5
    return why


def _ended(given: Continuation, last: BranchPoint, limit: SpecialPoint | None, why: str) -> str:
    """Why a branch ends where it does, in words."""
    if limit is None:
        return f"ends at {given.name} = {last.value:.9g}: beyond it {_beyond(why)}"
    where = f"ends at {given.name} = {limit.value:.12g}"
    what = repr(limit.what) if limit.what else "the walker"
    ends = {
        "scuff": f"beyond it {what} scuffs", "graze": f"beyond it {what} closes", "fall": "beyond it the walker falls",
        "lost event": f"beyond it {what} does not happen any more", "new event": f"beyond it {what} happens",
        "release": f"beyond it {what} lets go", "slip": f"beyond it {what} slips",
    }  # fmt: skip
    return f"{where}: {ends[limit.kind]}"


def _beyond(why: str) -> str:
    """A reason behind 'beyond it the walker'."""
    return f"the walker {why}" if why.split(" ")[0] in ("falls", "scuffs", "ends", "comes") else why


def _last(
    given: Continuation, last: BranchPoint, to: float, beyond: float, guess: Vector | None = None
) -> Sequence[BranchPoint]:  # fmt: skip
    """The point at which the parameter has its last value, which lies before another one; none where none is found."""
    plane = np.zeros(len(last.tangent))
    plane[-1] = 1.0
    share = (to - last.value) / given.width
    if guess is None:
        slope = last.tangent[-1] * given.width
        guess = last.tangent * (to - last.value) / slope if slope * (beyond - last.value) > 0.0 else share * plane
    guess = np.append(guess[:-1], share)
    corrected = given.corrected(last, plane, share, guess, goal=to)
    try:
        return [given.point(corrected, given.whole(last))] if isinstance(corrected, Corrected) else []
    except MbdError:
        return []
