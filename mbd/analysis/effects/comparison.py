"""How far a run without an effect is from the whole scene's: until their events differ."""

from collections.abc import Mapping, Sequence

import numpy as np

from mbd.analysis.accuracy.compare import gaps
from mbd.analysis.effects.contribution import Change
from mbd.arrays import Vector
from mbd.equal import INSTANT_RTOL
from mbd.equations.equations import Equations
from mbd.results.matching import apart
from mbd.results.trajectory import EventRecord, Trajectory

MATCHING_WINDOW = 4
"""Events among which the next one is looked for: those of about one instant may come in any order."""
MAX_SHIFT_RATIO = 2.0
"""How much farther one of two events that come in the other order may be shifted than the other or earlier ones [-]."""


def change(run: Trajectory, whole: Trajectory, scales: Mapping[str, float], instants: Vector) -> Change:
    """What sets a run without some effects apart from that of the whole scene.

    Parameters
    ----------
    scales : range of each output in the whole scene
    instants : at which they are compared [s]
    """
    if not run.success:
        return Change(failure=run.message)
    pairs, differs = common(run.events, _possible(whole.events, run.record.equations))
    begin, end = float(whole.time[0]), min(float(run.time[-1]), float(whole.time[-1]))
    shift = max((abs(a - b) for a, b in pairs), default=0.0)
    ends = _ends(run, whole)
    if ends:
        differs = min(end, end if differs is None else differs)
    elif differs is not None and end - differs <= 2.0 * shift:  # in the other run it comes after the end
        pairs, differs = [*pairs, (differs, end)], None
    until = end if differs is None else min(end, differs)
    inside = instants[instants <= until]
    keep = apart(inside, pairs, INSTANT_RTOL * max(end - begin, 1e-300))
    kept = inside[keep]
    outputs = {}
    if len(kept) > 1:
        found = gaps(run, whole, scales, kept, kept)
        outputs = {name: float(np.nanmax(gap, initial=0.0)) for name, gap in found.items()}
    left_out = 1.0 - float(np.mean(keep)) if len(keep) else 1.0
    return Change(outputs, until, shift, differs, left_out, ends, identical=same_rows(run, whole))


def _possible(events: Sequence[EventRecord], equations: Equations | None) -> list[EventRecord]:
    """The events that can happen in a scene: not those of contacts and frictions that it lacks."""
    assert equations is not None
    contacts = {contact.name for contact in equations.contacts}
    frictions = {friction.name for friction in equations.frictions}
    known = {"closed": contacts, "opened": contacts, "stuck": frictions, "slipped": frictions}
    known["pushed"] = {each.name for each in equations.impulses}
    return [event for event in events if event.kind == "event" or event.name in known[event.kind]]


def common(
    first: Sequence[EventRecord], second: Sequence[EventRecord]
) -> tuple[list[tuple[float, float]], float | None]:
    """Times of the events that two runs share from the start on, and the time of the first that one of them lacks."""
    mine, theirs = list(first), list(second)
    pairs: list[tuple[float, float]] = []
    shift = 0.0
    while mine and theirs:
        match = _like(mine[0], theirs[:MATCHING_WINDOW])
        if match is None:
            break
        pair = mine[0].time, theirs[match].time
        if match:
            back = _like(theirs[0], mine[:MATCHING_WINDOW])
            if back is None:
                break  # what the other run has first never comes in this one
            if not _about_one_instant(pair, (mine[back].time, theirs[0].time), shift):
                break  # the same name, but another event
        pairs.append(pair)
        shift = max(shift, abs(pair[0] - pair[1]))
        del mine[0], theirs[match]
    rest = [events[0].time for events in (mine, theirs) if events]
    return pairs, min(rest, default=None)


def _like(event: EventRecord, others: Sequence[EventRecord]) -> int | None:
    """The first of the others with this kind and name."""
    return next((k for k, other in enumerate(others) if (other.kind, other.name) == (event.kind, event.name)), None)


def _about_one_instant(pair: tuple[float, float], other: tuple[float, float], shift: float) -> bool:
    """Whether two events that come in the other order are shifted alike, and not one by much more than all the rest."""
    less, more = sorted(abs(a - b) for a, b in (pair, other))
    return more <= MAX_SHIFT_RATIO * max(less, shift) + INSTANT_RTOL * max(map(abs, (*pair, *other)))


def _ends(run: Trajectory, whole: Trajectory) -> str:
    """How a run ends where the whole scene does not end so."""
    mine, theirs = (each.message.partition(" at t =")[0] for each in (run, whole))
    return run.message if mine != theirs else ""


def same_rows(run: Trajectory, whole: Trajectory) -> bool:
    """Whether times, positions, velocities and accelerations of all rows are the same to the bit."""
    return all(
        getattr(run.record, name).tobytes() == getattr(whole.record, name).tobytes() for name in ("time", "q", "v", "a")
    )
