"""Where the events of a walk change along a branch: a foot scuffs, a knee no longer locks, a foot lets go or slips.

Up to such a point the return map is smooth; beyond it the walk has other events or is lost. It is located by bisection
along the tangent between a gait with the events of before and what lies beyond.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from mbd.equal import BRACKET_RTOL
from mbd.errors import MbdError
from mbd.gait.continuation import BranchPoint, Continuation, Corrected, way_of
from mbd.gait.outcome import Outcome
from mbd.gait.return_map import Arrival
from mbd.gait.special_points import SpecialPoint

__all__ = ["changed_events", "limit_between", "limit_beyond"]

NEAREST, FURTHEST = 1e-6, 2e-2
"""Distances along the tangent at which a limit is looked for ahead of the last gait [-]."""
BY_OUTCOME = {"scuffs": "scuff", "falls": "fall", "misses": "lost event"}
"""Kinds of points at which a walk is lost, where its events do not tell."""


def limit_between(
    given: Continuation, last: BranchPoint, ds: float, beyond: Arrival | None = None, back: float = 0.0
) -> SpecialPoint | None:
    """The point between a gait and the place ds along its tangent up to which the events are those of the gait.

    beyond : what the walk comes to at ds, where that is known
    back : distance from the limit at which its `before` lies, at least that of the gait given
    """
    low, high, good, beyond = _bracket(given, last, ds, beyond)
    if beyond is None:
        beyond = _lost_at(given, last, high)
    kind, what = _kind(given, last, beyond)
    if not kind:
        return None
    point = _point(given, last, good)
    finer = _bracket(given.with_half_steps(), last, ds, None)[2]
    of_steps = 0.0 if finer is None or good is None else abs(finer.value - good.value) + finer.left
    error = (high - low) * given.width + (0.0 if good is None else good.left) + of_steps
    return SpecialPoint(kind, point.value, point, error, what, _before(given, last, low - back if back else 0.0))


def _bracket(
    given: Continuation, last: BranchPoint, ds: float, beyond: Arrival | None
) -> tuple[float, float, Corrected | None, Arrival | None]:  # fmt: skip
    """Places along the tangent up to and from which events are those of before and others, with what there is."""
    low, high, good = 0.0, ds, None
    for _ in range(60):  # halvings of a bracket at most
        middle = 0.5 * (low + high)
        corrected = _corrected(given, last, middle)
        if isinstance(corrected, Corrected) and not changed_events(last.events, corrected.found.arrival.events):
            low, good = middle, corrected
        else:
            high = middle
            beyond = corrected.found.arrival if isinstance(corrected, Corrected) else beyond
        if high - low <= BRACKET_RTOL:
            break
    return low, high, good, beyond


def _before(given: Continuation, last: BranchPoint, place: float) -> BranchPoint:
    """A gait of the branch at a place along the tangent; the given one where there is none."""
    corrected = _corrected(given, last, place) if place else None
    if not isinstance(corrected, Corrected) or changed_events(last.events, corrected.found.arrival.events):
        return last
    try:
        return given.point(corrected, given.whole(last))
    except MbdError:
        return last


def limit_beyond(given: Continuation, last: BranchPoint) -> SpecialPoint | None:
    """The point at which a branch is lost that cannot go on from a gait; None where no event tells."""
    ds = NEAREST
    while ds <= FURTHEST:
        corrected = _corrected(given, last, ds)
        if not isinstance(corrected, Corrected):
            lost = _lost_at(given, last, ds)
            if lost is not None and not (lost.outcome.good and not changed_events(last.events, lost.events)):
                return limit_between(given, last, ds, lost)
        elif changed_events(last.events, corrected.found.arrival.events):
            return limit_between(given, last, ds)
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
            distance=way_of(given.map, arrival), multipliers=nothing,
        )  # fmt: skip
