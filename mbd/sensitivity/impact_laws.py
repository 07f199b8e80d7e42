"""Poisson's law and the sequential one, differentiated phase by phase in the order in which the run made them.

A run stores the velocities before and after; its impacts are made again between these, by the rules of
`mbd.kernel.contact.impact`, and hold only if they end in what the run stores.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from mbd.arrays import Vector
from mbd.dataclass import dataclass
from mbd.equal import EQUAL_RTOL, HALF_PRECISION_RTOL, LAW_RTOL
from mbd.kernel.contact.impact import MAX_IMPACTS
from mbd.sensitivity.motion import Mode, Motion
from mbd.sensitivity.phases import Law, OneSided, Unknown, chosen, speeds, undecided
from mbd.sensitivity.programs import Programs

__all__ = ["Struck", "poisson", "sequential"]


@dataclass(frozen=True)
class Struck:
    """Who takes part in an impact.

    touched : numbers of contacts that are closed or close; closing : of those that close
    of_e : rates (D,) of restitutions by numbers of contacts; trivial : rows that never act
    """

    touched: frozenset[int]
    closing: frozenset[int]
    of_e: Mapping[int, Vector]
    trivial: Collection[int]


def _with_rule(programs: Programs, who: Struck) -> frozenset[int]:
    """Contacts that take part with a rule for when they open, which hold whatever the sign of their impulses."""
    return frozenset(c for c in who.touched if programs.equations.contacts[c].opens_on != "pull")


def poisson(programs: Programs, before: Motion, mode: Mode, who: Struck) -> Motion:
    """The motion after compression, and restitution of e times its impulses.

    Raises
    ------
    Unknown
        where its derivative is not known, or exists on one side only.
    """
    contacts, held = programs.equations.contacts, _with_rule(programs, who)
    free = who.touched - held
    first = chosen(programs, before, mode, Law(held, free), who.trivial)
    given, of_given, parting = np.zeros_like(first.impulse), np.zeros_like(first.of_impulse), set[int]()
    for c in who.closing:
        row, e = contacts[c].rows[0], contacts[c].restitution
        given[row], of_given[row] = e * first.impulse[row], e * first.of_impulse[row]
        if c in who.of_e:
            of_given[row] += who.of_e[c] * first.impulse[row]
        if given[row] != 0.0:
            parting.add(c)
        elif np.any(of_given[row]):
            raise OneSided(f"the restitution of {contacts[c].name!r} is 0, and has a derivative on one side only")
    if not parting:
        return first.motion
    law = Law(held - parting, free - parting, given=given, of_given=of_given, parting=frozenset(parting))
    return chosen(programs, first.motion, mode, law, who.trivial).motion


def sequential(programs: Programs, before: Motion, mode: Mode, who: Struck) -> Motion:
    """The motion after impact upon impact of the contacts that approach fastest.

    Raises
    ------
    Unknown
        where its derivative is not known, or exists on one side only: contacts that approach equally fast, and one
        that neither approaches nor leaves at the end.
    """
    contacts, motion, fastest = programs.equations.contacts, before, 0.0
    held = frozenset(
        c for c in _with_rule(programs, who) if c not in who.closing or contacts[c].restitution == 0.0
    )  # fmt: skip
    size = np.zeros(len(before.tangent.t))
    normal = {c: contacts[c].rows[0] for c in sorted(who.touched)}
    for _ in range(MAX_IMPACTS):
        speed, of_speed, terms = speeds(programs, motion, mode)
        size = np.maximum(size, np.max(terms[list(normal.values())], axis=0, initial=0.0))
        approach = {c: abs(speed[k]) if c in held else -speed[k] for c, k in normal.items()}
        most = max(approach.values(), default=0.0)
        fastest = max(fastest, most)
        if most <= LAW_RTOL * fastest or most < 1e-14:
            edges = [
                c for c, k in normal.items()
                if c not in held and abs(speed[k]) <= EQUAL_RTOL * fastest
                and np.any(np.abs(of_speed[k]) > HALF_PRECISION_RTOL * size)
            ]  # fmt: skip
            if edges:
                raise OneSided(undecided([contacts[c].name for c in edges]))
            return motion
        first = [c for c in normal if approach[c] >= (1.0 - EQUAL_RTOL) * most]
        if not held.issuperset(first):
            changes = [(1.0 if c in held and speed[normal[c]] > 0.0 else -1.0) * of_speed[normal[c]] for c in first]
            _refuse_ties([contacts[c].name for c in first], changes, size)
        free = frozenset(first) - held
        e = {normal[c]: contacts[c].restitution for c in free}
        law = Law(held, free, e, {normal[c]: who.of_e[c] for c in free if c in who.of_e})
        motion = chosen(programs, motion, mode, law, who.trivial).motion
    raise Unknown(f"its sequence has more than {MAX_IMPACTS} impacts")


def _refuse_ties(names: Sequence[str], changes: Sequence[Vector], terms: Vector) -> None:
    """Contacts approach equally fast, and a direction tells one of them from another."""
    if any(np.any(np.abs(change - changes[0]) > HALF_PRECISION_RTOL * terms) for change in changes[1:]):
        listed = " and ".join(repr(name) for name in names)
        raise OneSided(
            f"{listed} approach equally fast in its sequence, and a change decides which strikes first: it has "
            "derivatives on one side only"
        )
