"""Contacts that close by impact: which rows took part, and what is held from then on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from mbd.arrays import Vector
from mbd.equations.equations import Contact
from mbd.errors import OneSidedError
from mbd.results.record import EventRecord
from mbd.sensitivity.balance import Impact, impact
from mbd.sensitivity.impact_laws import Struck, poisson, sequential
from mbd.sensitivity.motion import Mode, Motion
from mbd.sensitivity.phases import MOVES, OneSided, Unknown
from mbd.sensitivity.programs import Programs, State
from mbd.sensitivity.run_data import RunRows, refused, unknown

__all__ = ["captured", "refuse_touching_by_chance", "struck"]

ACCOUNTED = 1e-7
"""Misfit of velocities after an impact up to which its rows are the right ones [-]."""


def struck(
    rows: RunRows, programs: Programs, before: Motion, mode: Mode, events: Sequence[EventRecord], row: int, fired: int,
    restitutions: Mapping[str, Vector],
) -> Motion:  # fmt: skip
    """The motion after the impact of the contacts that close at a row, one of which, number `fired`, brought it about.

    restitutions : rates (D,) of those of contacts, by name

    By Newton's law its rows are those of bilateral constraints, of contacts that stay or close and push, and of
    frictions that stick; by the other laws the impact is made again phase by phase.
    """
    after, contacts = rows.y[row], programs.equations.contacts
    impulses = impulses_by_row(programs, events)
    closing = {event.name for event in events if event.kind == "closed"}
    tried, law, why, chance = list[float](), str(rows.record.settings.get("impact", "newton")), "", False
    names = " and ".join(repr(name) for name in sorted(closing))
    which = f"the impact of {names} at t = {before.t:.9g} s (law {law!r}): "
    who = _partners(rows, programs, mode, closing, restitutions)
    _leave_falling(programs, who, law, which)
    if law != "newton" and len(who.touched) > (1 if law == "sequential" else 0):
        try:
            _refuse_chance(programs, before, mode, who, fired)
            moved = (sequential if law == "sequential" else poisson)(programs, before, mode, who)
            tried.append(float(np.max(np.abs(moved.y - after)) / np.max(np.abs(before.y))))
            if tried[0] <= ACCOUNTED:
                return replace(moved, y=after)
        except Unknown as reason:
            why, chance = str(reason), isinstance(reason, OneSided)
            if isinstance(reason, OneSided) and not any(contacts[c].restitution for c in who.closing):
                raise OneSidedError(str(refused(which + why))) from None
    if law == "newton":
        try:
            _refuse_chance(programs, before, mode, who, fired)
        except OneSided as reason:
            raise OneSidedError(str(refused(which + str(reason)))) from None
    bounces = {contacts[c].rows[0]: rate for c, rate in who.of_e.items()}
    end = replace(before, y=after).at(rows.mode(row), np.zeros(programs.columns.n), np.zeros(programs.columns.rows))
    for slow in (True,) if tried or why else (False, True):  # what comes to rest does so at once, by every law
        what = _rows_of(rows, mode, impulses, closing, end, slow, programs)
        moved, found = impact(programs, before, after, mode, what, {} if slow else bounces)
        tried.append(found.misfit)
        if found.misfit <= ACCOUNTED:
            return moved
    instead = "" if law == "newton" or why else "take impact='newton'"
    if chance:
        raise refused(which + why)
    raise unknown(which + (why or f"its velocities differ by {min(tried):.2g} from those of its law"), instead)


def _partners(
    rows: RunRows, programs: Programs, mode: Mode, closing: set[str], restitutions: Mapping[str, Vector]
) -> Struck:
    """Who takes part in an impact of Poisson's law or the sequential one."""
    contacts = [(c, each) for c, each in enumerate(programs.equations.contacts) if each.kind != "penalty"]
    closed = frozenset(c for c, each in contacts if each.name in closing)
    touched = closed | {
        c for c, each in contacts
        if mode.closed[c] and not any(name in closing and not late for name, late in each.when)
    }  # fmt: skip
    of_e = {c: restitutions[each.name] for c, each in contacts if each.name in restitutions}
    return Struck(touched, closed, of_e, rows.manager.trivial)


def refuse_touching_by_chance(
    rows: RunRows, programs: Programs, before: Motion, mode: Mode, events: Sequence[EventRecord], fired: int
) -> None:
    """Raise a `OneSidedError` for contacts that close with the one that fired, and a direction moves them apart."""
    closing = {event.name for event in events if event.kind == "closed"}
    try:
        _refuse_chance(programs, before, mode, _partners(rows, programs, mode, closing, {}), fired)
    except OneSided as reason:
        names = " and ".join(repr(name) for name in sorted(closing))
        law = str(rows.record.settings.get("impact", "newton"))
        which = f"the impact of {names} at t = {before.t:.9g} s (law {law!r}): "
        raise OneSidedError(str(refused(which + str(reason)))) from None


def _leave_falling(programs: Programs, who: Struck, law: str, which: str) -> None:
    """Friction that changes with its slip: its size is that before the impact, in a plane its direction that after."""
    frictions, contacts = programs.equations.frictions, programs.equations.contacts
    falling = [contacts[each.contact].name for each in frictions
               if each.falls and each.contact in who.touched and (each.partner >= 0 or law != "newton")]  # fmt: skip
    if falling:
        raise unknown(f"{which}the friction of {falling[0]!r} changes with its slip")


def _refuse_chance(programs: Programs, before: Motion, mode: Mode, who: Struck, fired: int) -> None:
    """Contacts that close with the one that fired, and a direction moves them apart."""
    contacts, zero = programs.equations.contacts, (np.zeros(programs.columns.n), np.zeros(programs.columns.rows))
    slopes = programs.watched(before.at(mode, *zero))[1][: len(contacts)]
    Z = before.tangent.stacked(programs.columns)
    found = []
    for c in sorted(who.closing - {fired}):
        terms = np.abs(slopes[c]) @ np.abs(Z)
        if not mode.closed[c] and np.any(np.abs(slopes[c] @ Z) > MOVES * terms + 1e-12 * np.max(terms)):
            found.append(repr(contacts[c].name))
    if found:
        raise OneSided(
            f"{' and '.join(found)} may touch in it or not, which a change decides: it has derivatives on one side only"
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
            if not _sticks(programs, each.friction, impulses, after):
                in_plane = equations.frictions[each.friction].partner >= 0
                slip[each.friction] = 1.0 if in_plane else -np.sign(impulses[k])
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


def _sticks(programs: Programs, f: int, impulses: Vector, after: State) -> bool:
    """Whether a friction sticks in the impact: its rows do not move after it, and bear an impulse."""
    equations = programs.equations
    own = [f] if equations.frictions[f].partner < 0 else [f, equations.frictions[f].partner]
    if not np.any(impulses[[equations.frictions[k].row for k in own]]):
        return False
    places = [2 * len(equations.contacts) + len(equations.guards) + k for k in own]
    speed = float(np.max(np.abs(programs.watched(after)[0][places])))
    return speed <= 1e-9 * max(1.0, float(np.max(np.abs(after.y), initial=0.0)))


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
