"""Contacts that close by impact: whether a change decides what they do, and what is held from then on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from mbd.equal import HALF_PRECISION_RTOL
from mbd.errors import OneSidedError
from mbd.results.record import EventRecord
from mbd.sensitivity.impact_laws import Struck, poisson, sequential
from mbd.sensitivity.motion import Mode, Motion
from mbd.sensitivity.phases import OneSided, Unknown
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.run_data import RunRows, refused

__all__ = ["captured", "refuse_sided_impact"]


def _partners(rows: RunRows, programs: Programs, mode: Mode, closing: set[str]) -> Struck:
    """Who takes part in an impact of Poisson's law or the sequential one."""
    contacts = [(c, each) for c, each in enumerate(programs.equations.contacts) if each.kind != "penalty"]
    closed = frozenset(c for c, each in contacts if each.name in closing)
    touched = closed | {
        c for c, each in contacts
        if mode.closed[c] and not any(name in closing and not late for name, late in each.when)
    }  # fmt: skip
    return Struck(touched, closed, {}, rows.manager.trivial)


def refuse_sided_impact(
    rows: RunRows, programs: Programs, at: Callable[[], Motion], mode: Mode, events: Sequence[EventRecord], fired: int
) -> None:
    """Raise a `OneSidedError` for an impact in which a change however small decides who takes part.

    That is for contacts that close with the one that fired, which a direction moves apart, and where the phases of
    Poisson's law or of the sequential one lie on an edge between two choices. What comes to rest does so at once.
    Phases beside impulses of the user's are not decided again here.

    at : gives the motion just before it
    """
    closing = {event.name for event in events if event.kind == "closed"}
    law = str(rows.record.settings.get("impact", "newton"))
    if law == "newton" and len(closing) == 1:
        return
    who, before = _partners(rows, programs, mode, closing), at()
    try:
        _refuse_chance(programs, before, mode, who, fired)
        if any(programs.equations.contacts[push.contact].name in closing for push in programs.equations.impulses):
            return
        if law == "sequential" and len(who.touched) > 1:
            sequential(programs, before, mode, who)
        elif law == "poisson":
            poisson(programs, before, mode, who)
    except OneSided as reason:
        names = " and ".join(repr(name) for name in sorted(closing))
        which = f"the impact of {names} at t = {before.t:.9g} s (law {law!r}): "
        raise OneSidedError(str(refused(which + str(reason)))) from None
    except Unknown:  # the kernel's own impact has derivatives all the same
        return


def _refuse_chance(programs: Programs, before: Motion, mode: Mode, who: Struck, fired: int) -> None:
    """Contacts that close with the one that fired, and a direction moves them apart."""
    contacts, zero = programs.equations.contacts, (np.zeros(programs.columns.n), np.zeros(programs.columns.rows))
    slopes = programs.watched(before.at(mode, *zero))[1][: len(contacts)]
    Z = before.tangent.stacked(programs.columns)
    found = []
    for c in sorted(who.closing - {fired}):
        terms = np.abs(slopes[c]) @ np.abs(Z)
        if not mode.closed[c] and np.any(np.abs(slopes[c] @ Z) > HALF_PRECISION_RTOL * terms + 1e-12 * np.max(terms)):
            found.append(repr(contacts[c].name))
    if found:
        raise OneSided(
            f"{' and '.join(found)} may touch in it or not, which a change decides: it has derivatives on one side only"
        )


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
