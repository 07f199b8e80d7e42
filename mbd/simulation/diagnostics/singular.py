"""Whether a run ends because something is to happen at a singular configuration, and what."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from mbd.arrays import Matrix
from mbd.assembly.islands import islands_of_rows
from mbd.compile.mechanism import AccelerationTerms
from mbd.kernel import codes
from mbd.simulation.run.data import RunData

SINGULAR_RTOL = 1e-3
"""Smallest singular value of the rows there, over that a step away, below which they depend on each other [-]."""
EVENT_WINDOW = 0.1
"""How far from there something that is to happen may be to be the cause, in steps [-]."""
SINGULAR_START = 1e-7
"""Smallest singular value of the rows at a start, over the largest, below which branches of motions cross there [-]."""
FEW_ROWS, CLEARLY = 24, 1e3
"""Rows whose islands are looked at only where their smallest singular value is below so many times that bound [-]."""
STEP_FAILURES = frozenset(
    {
        codes.NOT_CONVERGED, codes.SINGULAR, codes.STAGNATED, codes.DEPENDENT, codes.CONFLICT, codes.TOO_NEAR,
        codes.SINGULAR_ROWS_MOVE, codes.OUTGROWN, codes.GAINED,
        codes.NO_LOCATION, codes.TOO_TIGHT, codes.AT_POSE,
    }
)  # fmt: skip
"""What steps fail with there."""
WORDS = {
    codes.CLOSE: "closing of {!r}", codes.OPEN_PULL: "opening of {!r}", codes.OPEN_GAP: "opening of {!r}",
    codes.OPEN_FORCE: "opening of {!r}", codes.PRESS: "closing of {!r}", codes.CROSS: "event {!r}",
    codes.CROSS_BACK: "event {!r}",
    codes.STICK: "sticking of {!r}",
    codes.SLIP: "sliding of {!r}",
}  # fmt: skip
"""What happens, by the kernel's kind of guard."""


def at_singular_configuration(run: RunData, status: int) -> str:
    """A sentence on what is to happen where constraints depend on each other for an instant, '' if nothing is.

    Such a configuration is stepped over. It cannot be stepped to: the velocities across the motion follow from
    round-off there, so that neither an event that changes something nor the end of a run may lie at it.
    """
    v = run.kernel
    if status not in STEP_FAILURES or int(v.n_active) == 0:
        return ""
    if status == codes.AT_POSE:
        share = f" (round-off would make up {float(v.failure_size):.1g} of them)"
        fired = int(v.event_kind)
        cause = _guard(run, fired, int(v.event_index)) if fired in WORDS else _boundary(run, np.inf)[0]
        return _sentence(run, float(v.failure_time), int(v.failure_index) - v.n, cause, share)
    with np.errstate(all="ignore"):
        found = _nearest(run)
    if found is None:
        return ""
    away, row = found
    cause = _cause(run, away)
    return _sentence(run, run.now + away, row, cause, "") if cause else ""


def _sentence(run: RunData, time: float, row: int, cause: str, share: str) -> str:
    """The sentence; `row` counts among those that are stepped with."""
    v = run.kernel
    title = run.mechanism.equations.rows[int(v.rows[min(max(row, 0), int(v.n_active) - 1)])].title
    advice = (
        "choose another end or period" if cause.startswith(("the end", "a sample", "a jump")) else
        "move the event or contact"
    )  # fmt: skip
    return (
        f"{cause} lies at a singular configuration (t = {time:.6g} s), where constraint {title} depends on the others "
        f"and branches of motions cross: velocities are not determined there{share}, so that nothing can restart from "
        f"it; {advice}, or take another start"
    )


def _guard(run: RunData, kind: int, index: int) -> str:
    """What a guard of the kernel is, in words."""
    manager = run.manager
    if kind in (codes.CROSS, codes.CROSS_BACK):
        name = manager.guards[index].name
    elif kind in (codes.STICK, codes.SLIP):
        name = manager.frictions[index].name
    else:
        name = manager.names[index]
    return "the " + WORDS[kind].format(name)


def _boundary(run: RunData, most: float) -> tuple[str, float]:
    """The boundary of steps that comes next, and in what time; '' if it is further than `most`."""
    target, due = run.boundaries.next(run.end)
    away = target - run.now
    if not away <= most:
        return "", away
    return ("a sample of a controller or a jump of a signal" if due else "the end of the run"), away


def _cause(run: RunData, away: float) -> str:
    """What is to happen at that time from now, '' if nothing is: a boundary, an event, a contact that closes."""
    v, near = run.kernel, EVENT_WINDOW * run.dt
    cause, time = _boundary(run, np.inf)
    if abs(time - away) < near:
        return cause
    contacts, guards, values = v.n_contacts, v.n_guards, v.guards0
    found = [(codes.CROSS, e, 4 * contacts + e, 4 * contacts + guards + e) for e in range(guards)]
    found += [(codes.CLOSE, c, c, contacts + c) for c in range(contacts) if v.closed[c] == 0]
    for kind, index, place, rate in found:
        fall = -values[rate]
        if fall != 0.0 and abs(values[place] / fall - away) < near + EVENT_WINDOW * abs(away):
            return _guard(run, kind, index)
    return ""


def _nearest(run: RunData) -> tuple[float, int] | None:
    """Time from now to a singular configuration within two steps, and the row that depends on the others there."""
    span = 2.0 * run.dt
    times = np.linspace(-span, span, 17)
    sizes = [_smallest(run, time)[0] for time in times]
    k = int(np.argmin(sizes))
    low, high = times[max(k - 1, 0)], times[min(k + 1, len(times) - 1)]
    for _ in range(60):
        first, second = low + (high - low) * 0.382, low + (high - low) * 0.618
        if _smallest(run, first)[0] < _smallest(run, second)[0]:
            high = second
        else:
            low = first
    place = 0.5 * (low + high)
    size, row = _smallest(run, place)
    return (float(place), row) if size < SINGULAR_RTOL * max(sizes) else None


def singular_start(run: RunData) -> Callable[[], list[str]]:
    """What tells, if asked, that the run started at a singular configuration, or so close to one that round-off chose
    the branch."""
    v, start, mechanism = run.kernel, run.start, run.mechanism
    acting = run.manager.active_rows(run.manager.flags(start.mode.closed))
    rows = [row for row in acting if not v.dropped[row]]
    if not 0 < len(rows) <= 200 or run.resumed or len(start.anchors) != v.n_anchors:
        return list
    at = start.time, start.q.copy(), np.concatenate([start.v, start.z]), run.first_parameters, start.anchors.copy()

    def sentences() -> list[str]:
        terms = mechanism.acceleration_terms(*at)
        if _is_clearly_regular(terms, rows):
            return []
        found = _part_left(terms, rows)
        if not found[0] < SINGULAR_START * found[2]:
            return []
        title = mechanism.equations.rows[rows[found[1]]].title
        return [
            f"the start lies at a singular configuration, where {title} depends on other constraints and branches of "
            "motions cross: the motion from there is not unique; start beside it"
        ]

    return sentences


def _smallest(run: RunData, ahead: float) -> tuple[float, int]:
    """Smallest singular value of the rows that act, `ahead` along the motion, and the row with the largest part."""
    v, mechanism = run.kernel, run.mechanism
    n_v = v.n_v
    y, rate = v.y[: v.n], v.rate[: v.n]
    q = run.stepper.system.compose(v.q[: v.n_q].copy(), ahead * (y[:n_v] + 0.5 * ahead * rate[:n_v]))
    anchors = v.anchors[: v.n_anchors]
    terms = mechanism.acceleration_terms(run.now + ahead, q, y + ahead * rate, v.params, anchors)
    return _part_left(terms, v.rows[: v.n_active].tolist())[:2]


def _scaled(terms: AccelerationTerms, rows: Sequence[int]) -> Matrix:
    """Rows of B on columns scaled by √M_ii."""
    mass = np.abs(terms.M.diagonal())
    return np.asarray(terms.B[list(rows)] / np.sqrt(np.where(mass > 0.0, mass, 1.0)))


def _is_clearly_regular(terms: AccelerationTerms, rows: Sequence[int]) -> bool:
    """Whether few rows are so far from a singular configuration that nothing closer need be known."""
    if not len(rows) <= min(FEW_ROWS, len(terms.M)):
        return False
    jacobian = _scaled(terms, rows)
    if not np.isfinite(jacobian).all():
        return False
    sizes = np.linalg.svd(jacobian, compute_uv=False)
    return bool(sizes[-1] > CLEARLY * SINGULAR_START * sizes[0])


def _part_left(terms: AccelerationTerms, rows: Sequence[int]) -> tuple[float, int, float]:
    """Smallest singular value of rows of B on columns scaled by √M_ii, the row with most part in it; the largest."""
    jacobian = _scaled(terms, rows)
    if not np.isfinite(jacobian).all():
        return np.inf, 0, 0.0
    least, weakest, largest = np.inf, 0, 0.0
    for own, lines in islands_of_rows(np.zeros_like(terms.M), jacobian):
        if not lines.shape[1]:
            continue
        left, sizes, _ = np.linalg.svd(jacobian[lines[:, :, np.newaxis], own[:, np.newaxis]], full_matrices=False)
        smallest = sizes[:, -1] if own.shape[1] >= lines.shape[1] else np.zeros(len(lines))
        place, largest = int(np.argmin(smallest)), max(largest, float(np.max(sizes, initial=0.0)))
        if smallest[place] < least:
            part = np.abs(left[place, :, -1]) if own.shape[1] else np.ones(1)
            least, weakest = float(smallest[place]), int(lines[place, np.argmax(part)])
    return least, weakest, largest
