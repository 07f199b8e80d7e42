"""Contacts that close by impact: which rows took part, and what is held from then on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from mbd.arrays import Vector
from mbd.equations.equations import Contact
from mbd.results.record import EventRecord
from mbd.sensitivity.balance import Impact, impact
from mbd.sensitivity.motion import Mode, Motion
from mbd.sensitivity.programs import Programs, State
from mbd.sensitivity.run_data import RunRows, refused

__all__ = ["captured", "struck"]

ACCOUNTED = 1e-7
"""Misfit of velocities after an impact up to which its rows are the right ones [-]."""


def struck(
    rows: RunRows, programs: Programs, before: Motion, mode: Mode, events: Sequence[EventRecord], row: int,
    restitutions: Mapping[str, Vector],
) -> tuple[Motion, Impact]:  # fmt: skip
    """The motion after the impact of the contacts that close at a row, and the impact.

    restitutions : rates (D,) of those of contacts, by name

    Its rows are those of bilateral constraints, of contacts that stay or close and push, and of frictions that stick.
    """
    after = rows.y[row]
    impulses = impulses_by_row(programs, events)
    closing = {event.name for event in events if event.kind == "closed"}
    tried, law = [], rows.record.settings.get("impact", "newton")
    if law != "newton" and closing & set(restitutions):
        raise refused(f"restitutions are differentiated under impact='newton', not {law!r}")
    bounces = {
        each.rows[0]: restitutions[each.name] for each in programs.equations.contacts if each.name in restitutions
    }
    end = replace(before, y=after).at(rows.mode(row), np.zeros(programs.columns.n), np.zeros(programs.columns.rows))
    for slow in (False, True):
        what = _rows_of(rows, mode, impulses, closing, end, slow, programs)
        moved, found = impact(programs, before, after, mode, what, {} if slow else bounces)
        tried.append(found.misfit)
        if found.misfit <= ACCOUNTED:
            return moved, found
    names = " and ".join(repr(name) for name in sorted(closing))
    raise refused(
        f"the impact of {names} at t = {before.t:.9g} s (law {law!r}) is not one that reverses gap rates by their "
        f"restitution once; its velocities differ by {min(tried):.2g} of them",
        "take impact='newton'" if law != "newton" else "",
    )


def impulses_by_row(programs: Programs, events: Sequence[EventRecord]) -> Vector:
    """Impulses of contacts and frictions by the number of their row, as the log tells, pushing ≥ 0."""
    equations = programs.equations
    found = np.zeros(len(equations.rows))
    bearers: dict[str, tuple[int, ...]] = {contact.name: contact.rows for contact in equations.contacts}
    bearers |= {each.name: (each.row,) for each in equations.frictions if each.contact < 0}
    for event in events:
        for name, impulse in event.impulses.items():
            place = list(bearers.get(name, ()))
            if len(place) == len(impulse):
                found[place] = np.where(np.abs(impulse) > 0.0, impulse, found[place])
    return found


def _rows_of(
    rows: RunRows, mode: Mode, impulses: Vector, closing: set[str], after: State, slow: bool, programs: Programs
) -> Impact:
    """The rows that took part; `after` it."""
    equations, trivial = programs.equations, rows.manager.trivial
    takes = [_takes_part(contact, c, mode, impulses, closing) for c, contact in enumerate(equations.contacts)]
    chosen, slip = [], np.zeros(len(equations.frictions))
    restitution: dict[int, float] = {}
    for k, each in enumerate(equations.rows):
        if k in trivial or (each.contact >= 0 and not takes[each.contact]):
            continue
        if each.friction >= 0:
            if not _sticks(programs, each.friction, impulses[k], after):
                slip[each.friction] = -np.sign(impulses[k])
                continue
        chosen.append(k)
        if each.contact >= 0 and k == equations.contacts[each.contact].rows[0]:
            contact = equations.contacts[each.contact]
            if contact.name in closing and not slow:
                restitution[k] = contact.restitution
    picked = tuple(k for k in chosen if k in mode.rows or k not in mode.held)
    return Impact(picked, restitution, slip)


def _takes_part(contact: Contact, c: int, mode: Mode, impulses: Vector, closing: set[str]) -> bool:
    """Whether the rows of a contact act in the impact."""
    if contact.kind == "penalty":
        return False
    if contact.name in closing:
        return bool(np.any(impulses[list(contact.rows)]))
    if not mode.closed[c] or any(name in closing and not after for name, after in contact.when):
        return False
    return contact.opens_on != "pull" or bool(np.any(impulses[list(contact.rows)]))


def _sticks(programs: Programs, f: int, impulse: float, after: State) -> bool:
    """Whether a friction sticks in the impact: its row does not move after it, and it bears an impulse."""
    if impulse == 0.0:
        return False
    place = 2 * len(programs.equations.contacts) + len(programs.equations.guards) + f
    speed = float(programs.watched(after)[0][place])
    return abs(speed) <= 1e-9 * max(1.0, float(np.max(np.abs(after.y), initial=0.0)))


def captured(programs: Programs, motion: Motion, mode: Mode, contacts: Sequence[int]) -> Motion:
    """The motion with what these contacts hold from now on."""
    equations = programs.equations
    places = [place for c in contacts for place in equations.contacts[c].anchors]
    if not places:
        return motion
    order = [place for contact in equations.contacts for place in contact.anchors]
    lines = [order.index(place) for place in places]
    zero = np.zeros(programs.columns.n), np.zeros(programs.columns.rows)
    values, slopes = programs.captured(motion.at(mode, *zero))
    anchors, of_anchors = motion.anchors.copy(), motion.tangent.anchors.copy()
    anchors[places] = values[lines]
    of_anchors[places] = slopes[lines] @ motion.tangent.stacked(programs.columns)
    return replace(motion, anchors=anchors).with_tangent(anchors=of_anchors)
