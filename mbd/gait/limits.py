"""Where the events of a walk change along a branch: a foot scuffs, a knee no longer locks, a foot lets go or slips.

Up to such a point the return map is smooth; beyond it the walk has other events or is lost. It is located by bisection
along the tangent between a gait with the events of before and what lies beyond.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mbd.dataclass import dataclass
from mbd.equal import BRACKET_RTOL
from mbd.errors import MbdError
from mbd.gait.continuation import NOT_CONVERGED, BranchPoint, Continuation, Corrected
from mbd.gait.outcome import Outcome
from mbd.gait.return_map import Arrival
from mbd.gait.special_points import SpecialPoint

NEAREST, FURTHEST = 1e-6, 2e-2
"""Distances along the tangent at which a limit is looked for ahead of the last gait [-]."""
MAX_TRIALS, CLOSER = 200, 8.0
"""Places that are tried at most; how much nearer to a limit than to where it began a search begins again [-]."""
GROWTH, POLE_RTOL = (0.5, 0.25), 0.1
"""Sizes of derivatives, over that at the last gait, of the gaits that tell where it is infinite; what two of these
places may differ by, over their distance [-]."""
BY_OUTCOME = {"scuffs": "scuff", "falls": "fall", "misses": "lost event"}
"""Kinds of points at which a walk is lost, where its events do not tell."""


@dataclass(frozen=True, eq=False)
class _Bracket:
    """Places along the tangent of a gait up to which events are those of before, and from which they are not.

    curve : gaits up to the one whose tangent it is; good : at `low`, None of the gait itself
    beyond : what the walk comes to at `high`, where that is known
    advance : distance of the last two gaits: round-off may hide a limit that is nearer
    """

    curve: tuple[BranchPoint, ...]
    low: float
    high: float
    good: Corrected | None
    beyond: Arrival | None
    advance: float = 0.0

    @property
    def base(self) -> BranchPoint:
        """The gait whose tangent it is."""
        return self.curve[-1]

    @property
    def value(self) -> float:
        """Of the parameter, at `low`."""
        return self.base.value if self.good is None else self.good.value


def limit_between(
    given: Continuation, curve: Sequence[BranchPoint], ds: float, beyond: Arrival | None = None, back: float = 0.0
) -> SpecialPoint | None:
    """The point between the last gait and the place ds along its tangent up to which the events are those of the gait.

    beyond : what the walk comes to at ds, where that is known
    back : distance from the limit at which its `before` lies, at least that of the gait given
    """
    last = curve[-1]
    found = _bracket(given, curve, ds, beyond)
    beyond = _lost_at(given, found.base, found.high) if found.beyond is None else found.beyond
    kind, what = _kind(given, last, beyond)
    if not kind:
        return None
    finer = _bracket(given.with_half_steps(), curve, ds, None)
    left = [max(each.good.left, each.good.alone) for each in (found, finer) if each.good is not None]
    width = max(each.high - each.low + each.advance for each in (found, finer)) * given.width
    error = width + sum(left) + abs(finer.value - found.value)
    point = found.base if found.good is None else _point(given, found.base, found.good)
    pole = _pole(found.curve)
    value = point.value if pole is None else pole
    before = _before(given, found.base, found.low - back) if back else last
    return SpecialPoint(kind, value, point, error + abs(value - point.value), what, before)


def _bracket(
    given: Continuation, curve: Sequence[BranchPoint], ds: float, beyond: Arrival | None
) -> _Bracket:  # fmt: skip
    """The limit between a gait and a place ds along its tangent, by bisection.

    1. Halve the distance between the last place with a gait and the first without one.
    2. Once the last gait is much nearer to the limit than to the gait whose tangent leads there, go on from it: a place
       was lost by what tangent and curve differ by, that is the square of the distance, and is tried again.
    3. Where corrections do not converge nothing is known: that place is no end of the bracket.
    """
    advance = abs(curve[-1].value - curve[-2].value) / given.width if len(curve) > 1 else 0.0
    found, reach, tested, refused = _Bracket(tuple(curve), 0.0, ds, None, beyond, advance), ds, True, False
    for _ in range(MAX_TRIALS):
        if min(found.high, reach) - found.low <= BRACKET_RTOL:
            break
        if found.good is not None and not refused and found.low > CLOSER * (reach - found.low):
            nearer = _gait_at(given, found.base, found.good)
            refused = nearer is found.base
            if not refused:
                reach, tested = found.high - found.low, False
                found = replace(found, curve=(*found.curve, nearer), low=0.0, high=reach, good=None)
        place = 0.5 * (found.low + reach) if tested else reach
        corrected = _corrected(given, found.base, place)
        if isinstance(corrected, Corrected) and not changed_events(curve[-1].events, corrected.found.arrival.events):
            found = replace(found, low=place, good=corrected, advance=place - found.low)
            if not tested:
                reach = 2.0 * place
                found = replace(found, high=reach)
            continue
        reach, tested = place, True
        if isinstance(corrected, Corrected):
            found = replace(found, high=place, beyond=corrected.found.arrival)
        elif corrected is None or corrected.kind != NOT_CONVERGED:
            found = replace(found, high=place)
    return found


def _pole(curve: Sequence[BranchPoint]) -> float | None:
    """Where the derivative of the map becomes infinite; None where it does not.

    Beside a graze its size is proportional to 1/distance, whatever the state loses there to round-off: two pairs of
    gaits then tell the same place.
    """
    last, found = curve[-1], list[float]()
    size = float(np.linalg.norm(last.matrix))
    for share in GROWTH:
        other = next((each for each in reversed(curve) if np.linalg.norm(each.matrix) <= share * size), None)
        if other is None:
            return None
        own = float(np.linalg.norm(other.matrix))
        found.append(last.value + (last.value - other.value) * own / (size - own))
    near = abs(found[0] - last.value)
    return found[0] if abs(found[1] - found[0]) <= POLE_RTOL * near else None


def _before(given: Continuation, last: BranchPoint, place: float) -> BranchPoint:
    """A gait of the branch at a place along the tangent; the given one where there is none."""
    corrected = _corrected(given, last, place) if place else None
    if not isinstance(corrected, Corrected) or changed_events(last.events, corrected.found.arrival.events):
        return last
    return _gait_at(given, last, corrected)


def _gait_at(given: Continuation, last: BranchPoint, corrected: Corrected) -> BranchPoint:
    """The gait of a solution with its derivatives; the last one where it has none."""
    try:
        found = given.point(corrected, given.whole(last))
    except MbdError:
        return last
    return last if given.leaves_smooth_part(last, found.how) else found


def limit_beyond(given: Continuation, curve: Sequence[BranchPoint]) -> SpecialPoint | None:
    """The point at which a branch is lost that cannot go on from its last gait; None where no event tells."""
    last, ds = curve[-1], NEAREST
    while ds <= FURTHEST:
        corrected = _corrected(given, last, ds)
        if isinstance(corrected, Corrected):
            if changed_events(last.events, corrected.found.arrival.events):
                return limit_between(given, curve, ds)
        else:
            lost, tells = _lost_at(given, last, ds), corrected is not None and corrected.kind != NOT_CONVERGED
            if lost is not None and (tells or not lost.outcome.good or changed_events(last.events, lost.events)):
                return limit_between(given, curve, ds, lost)
        ds *= 4.0
    return None


def _corrected(given: Continuation, last: BranchPoint, place: float) -> Corrected | Outcome | None:
    try:
        return given.corrected(last, last.tangent, place)
    except MbdError:
        return None


def _lost_at(given: Continuation, last: BranchPoint, place: float) -> Arrival | None:
    """What the walk comes to at a place along the tangent."""
    u = place * last.tangent
    values = given.with_value(last.value + given.width * float(u[-1]))
    if given.map.faults(values):
        return None
    try:
        return given.map(last.chart.at(u[:-1], given.map.vector(values)), values)
    except MbdError:
        return None


def changed_events(before: tuple[tuple[str, str], ...], after: tuple[tuple[str, str], ...]) -> bool:
    """Whether other events happen; their order alone is no change."""
    return Counter(before) != Counter(after)


def _kind(given: Continuation, last: BranchPoint, beyond: Arrival | None) -> tuple[str, str]:
    """What happens beyond a limit, and to which contact or event; ('', '') where nothing tells."""
    if beyond is None:
        return "", ""
    if beyond.outcome.good and not changed_events(last.events, beyond.events):
        return "lost event", given.map.section  # it comes together with another event, and gaits end there
    known = BY_OUTCOME.get(beyond.outcome.kind, "")
    # time of a step over that of before below which its foot touched down early
    early = given.map.section in given.map.feet and beyond.period < 0.999 * last.period
    if known == "scuff" or (early and changed_events(last.events, beyond.events)):
        return "scuff", given.map.section
    before, after = Counter(last.events), Counter(beyond.events)
    for name, kind in after - before:
        if kind == "closed":
            return ("scuff" if name in given.map.feet else "graze"), name
        if kind in ("opened", "slipped", "event"):
            return {"opened": "release", "slipped": "slip", "event": "new event"}[kind], name
    for name, kind in before - after:
        if kind in ("closed", "event"):
            return ("fall" if known == "fall" else "lost event"), name
    return known, ""


def _point(given: Continuation, last: BranchPoint, corrected: Corrected | None) -> BranchPoint:
    """The gait at the limit; beside it there may be no derivative, and then no multipliers either."""
    if corrected is None:
        return last
    try:
        return given.point(corrected, given.whole(last))
    except MbdError:
        arrival = corrected.found.arrival
        nothing = replace(
            last.multipliers, values=np.full_like(last.multipliers.values, np.nan), error=float("nan"), trivial={}
        )
        return replace(
            last, value=corrected.value, state=corrected.state, period=arrival.period, steps=arrival.steps,
            distance=given.map.way_of(arrival), multipliers=nothing,
        )  # fmt: skip
