"""One phase of an impact: who pushes and sticks in it, the velocities after it, and the derivatives of both.

``M (v⁺ − v⁻) + R Λ = 0`` and ``ḣ(v⁺) + e ḣ(v⁻) = 0`` of the rows that take part, each contact and friction on the
branch of its law, differentiated as the implicit function that it is there. Where a branch is left by a change however
small (a contact that neither pushes nor parts), the impact has a derivative on one side only.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import field, replace
from itertools import product

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.equal import EQUAL_RTOL, HALF_PRECISION_RTOL, LAW_RTOL
from mbd.sensitivity.balance import independent, saddle
from mbd.sensitivity.motion import Mode, Motion, solved
from mbd.sensitivity.programs import Programs
from mbd.tape.derivatives import live

__all__ = ["Choice", "Law", "OneSided", "Phase", "Unknown", "chosen", "speeds", "undecided"]


class Unknown(Exception):
    """Why a law of impacts gives no derivative here."""


class OneSided(Unknown):
    """What decides between two ways in which an impact may go on."""


@dataclass(frozen=True)
class Choice:
    """Contacts that act, those of them whose normal row is off, and signs of the frictions that slide."""

    acting: frozenset[int]
    parting: frozenset[int]
    slip: Vector


@dataclass(frozen=True)
class Law:
    """What holds in a phase: contacts that act in any case and that may choose to; e of normal rows; given impulses.

    of_restitution : rates (D,) of these e; given (R,), of_given (R, D) : impulses of contacts that may part
    """

    held: frozenset[int]
    free: frozenset[int]
    restitution: Mapping[int, float] = field(default_factory=dict)
    of_restitution: Mapping[int, Vector] = field(default_factory=dict)
    given: Vector | None = None
    of_given: Matrix | None = None
    parting: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Phase:
    """The motion after a phase, its impulses (R,) with derivatives (R, D), and ``ḣ(v⁺) + e ḣ(v⁻)`` with derivatives."""

    motion: Motion
    impulse: Vector
    of_impulse: Matrix
    speed: Vector
    of_speed: Matrix
    terms: Vector


def speeds(programs: Programs, motion: Motion, mode: Mode) -> tuple[Vector, Matrix, Matrix]:
    """ḣ of all rows (R,), its derivatives (R, D), and the sums of the sizes of their terms (R, D)."""
    zero = np.zeros(programs.columns.n), np.zeros(programs.columns.rows)
    _, _, rate, _, _, slopes = programs.steps(motion.at(mode, *zero))
    Z = motion.tangent.stacked(programs.columns)
    return rate, slopes @ Z, np.abs(slopes) @ np.abs(Z)


def _rows(programs: Programs, mode: Mode, choice: Choice, trivial: Collection[int]) -> tuple[int, ...]:
    """Numbers of the rows that are solved for."""
    equations, found = programs.equations, list[int]()
    for k, row in enumerate(equations.rows):
        if k in trivial:
            continue
        if row.contact < 0 and row.friction < 0:
            if k in mode.rows or k not in mode.held:
                found.append(k)
        elif row.contact in choice.acting and (row.friction < 0 or choice.slip[row.friction] == 0.0):
            if row.contact not in choice.parting or k != equations.contacts[row.contact].rows[0]:
                found.append(k)
    return tuple(found)


def _phase(programs: Programs, before: Motion, mode: Mode, choice: Choice, law: Law, trivial: Collection[int]) -> Phase:
    """The phase on these branches."""
    c, n = programs.columns, programs.columns.n
    none = np.zeros(c.rows), np.zeros((c.rows, len(before.tangent.t)))
    given, of_given = (none[0] if law.given is None else law.given), (none[1] if law.of_given is None else law.of_given)
    picked = _rows(programs, mode, choice, trivial)
    here = replace(mode, rows=picked, held=picked, slip=choice.slip)
    here = independent(programs, before, here, np.zeros(n), none[0])
    rows = list(here.rows)
    shared = [programs.equations.rows[k] for k in picked if k not in rows]
    if any(row.contact >= 0 and row.friction < 0 for row in shared):  # frictions share theirs, which moves nothing
        raise Unknown("rows of its contacts depend on each other, which may share their impulses in several ways")
    here = replace(here, held=(*rows, *(int(k) for k in np.flatnonzero(given))))
    _, _, speed0, bare0, _, of_speed0 = programs.steps(before.at(here, np.zeros(n), none[0]))
    M, R, B = bare0[:, c.rate], bare0[:, c.lam], of_speed0[:, c.y]
    e = np.zeros(c.rows)
    for row, value in law.restitution.items():
        e[row] = value
    wanted = np.concatenate([-R @ given, -(1.0 + e[rows]) * speed0[rows]])
    found = solved(saddle(bare0, of_speed0[rows], B[rows], programs, rows), wanted)
    jump, impulse = found[:n], given.copy()
    impulse[rows] += found[n:]
    later = replace(before, y=before.y + jump)
    _, _, speed1, loaded, _, of_speed1 = programs.steps(later.at(here, jump, impulse))
    bare = programs.steps(later.at(here, np.zeros(n), none[0]))[3]
    A = saddle(loaded, of_speed1[rows], of_speed1[rows][:, c.y], programs, rows)
    Z = before.tangent.stacked(c)
    still = before.with_tangent(y=np.zeros_like(before.tangent.y)).tangent.stacked(c)
    back = e[:, np.newaxis] * (of_speed0 @ Z)
    for row, rate in law.of_restitution.items():
        back[row] += rate * speed0[row]
    right = [(loaded - bare) @ still - M @ before.tangent.y + loaded[:, c.lam] @ of_given]
    right.append(of_speed1[rows] @ still + back[rows])
    change = -solved(A, np.vstack(right))
    of_impulse = of_given.copy()
    of_impulse[rows] += change[n:]
    after = later.with_tangent(y=change[:n])
    terms = np.abs(B) @ (np.abs(before.y) + np.abs(jump))
    of_speed = of_speed1 @ after.tangent.stacked(c) + back
    return Phase(after, impulse, of_impulse, speed1 + e * speed0, of_speed, terms)


def _limits(programs: Programs, phase: Phase, mode: Mode) -> tuple[Vector, Matrix]:
    """Largest impulses of frictions and their derivatives."""
    c, equations = programs.columns, programs.equations
    first = 2 * len(equations.contacts) + len(equations.guards) + len(equations.frictions)
    every = replace(mode, held=tuple(range(c.rows)))
    place, zero = slice(first, first + len(equations.frictions)), np.zeros(c.n)
    values, slopes = programs.watched(phase.motion.at(every, zero, phase.impulse))
    base, of_base = programs.watched(phase.motion.at(every, zero, np.zeros(c.rows)))
    Z = phase.motion.tangent.stacked(c)
    of_limit = (slopes[place] - of_base[place]) @ Z + slopes[place][:, c.lam] @ phase.of_impulse
    return values[place] - base[place], of_limit


def _slacks(
    programs: Programs, phase: Phase, mode: Mode, choice: Choice, law: Law
) -> Iterator[tuple[str, int, float, Vector, float, float]]:
    """Of each contact and friction that chooses: kind, number, what must be ≥ 0, its derivative (D,), sizes of both."""
    equations, most = programs.equations, float(np.max(np.abs(phase.impulse), initial=1e-300))
    much = float(np.max(np.abs(phase.of_impulse), initial=1e-300))
    fast = float(np.max(np.abs(phase.motion.tangent.y), initial=1e-300))
    for c in sorted(law.free | law.parting):
        row = equations.contacts[c].rows[0]
        if c in choice.acting and c not in choice.parting:
            pushed = phase.impulse[row] - (0.0 if law.given is None else law.given[row])
            of_pushed = phase.of_impulse[row] - (0.0 if law.of_given is None else law.of_given[row])
            yield "contact", c, -pushed, -of_pushed, most, much
        else:
            yield "contact", c, phase.speed[row], phase.of_speed[row], phase.terms[row], fast
    acting = [f for f, each in enumerate(equations.frictions) if each.contact in choice.acting]
    if not acting:
        return
    limit, of_limit = _limits(programs, phase, mode)
    for f in acting:
        row, sign = equations.frictions[f].row, choice.slip[f]
        if sign == 0.0:
            pull = np.sign(phase.impulse[row])
            value, change = limit[f] - abs(phase.impulse[row]), of_limit[f] - pull * phase.of_impulse[row]
            yield "friction", f, value, change, most, much
        else:
            yield "friction", f, sign * phase.speed[row], sign * phase.of_speed[row], phase.terms[row], fast


def chosen(programs: Programs, before: Motion, mode: Mode, law: Law, trivial: Collection[int]) -> Phase:
    """The phase whose contacts and frictions all obey their laws.

    Raises
    ------
    Unknown
        if none is found, or where it lies on an edge between two branches from which a direction leads off.
    """
    _check_frictions(programs, law.held | law.free | law.parting)
    choice = Choice(law.held | law.free | law.parting, law.parting, np.zeros(len(programs.equations.frictions)))
    for _ in range(12):
        phase = _phase(programs, before, mode, choice, law, trivial)
        faults = _faults(programs, phase, mode, choice, law)
        if not faults:
            return phase
        for kind, k in faults:
            choice = _turned(choice, kind, k, law, phase, programs)
    for choice in _choices(programs, law):
        phase = _phase(programs, before, mode, choice, law, trivial)
        if not _faults(programs, phase, mode, choice, law):
            return phase
    raise Unknown("no set of its contacts and frictions was found that gives its impulses")


def _faults(programs: Programs, phase: Phase, mode: Mode, choice: Choice, law: Law) -> list[tuple[str, int]]:
    """Contacts and frictions that break their laws."""
    found, edges = list[tuple[str, int]](), list[str]()
    for kind, k, value, change, size, sizes in _slacks(programs, phase, mode, choice, law):
        equations = programs.equations
        if value < -LAW_RTOL * size:
            found.append((kind, k))
        elif abs(value) <= EQUAL_RTOL * size and np.max(np.abs(change), initial=0.0) > HALF_PRECISION_RTOL * sizes:
            edges.append(equations.contacts[k].name if kind == "contact" else equations.frictions[k].name)
    if edges and not found:
        raise OneSided(undecided(edges))
    return found


def undecided(names: Collection[str]) -> str:
    """That a change however small decides what these do."""
    listed = " and ".join(repr(name) for name in dict.fromkeys(names))
    return (
        f"{listed} may go on in either of two ways in it, which a change decides: it has derivatives on one side only"
    )


def _turned(choice: Choice, kind: str, k: int, law: Law, phase: Phase, programs: Programs) -> Choice:
    """With the other branch of a contact or friction."""
    if kind == "contact":
        return (
            replace(choice, parting=choice.parting ^ {k})
            if k in law.parting
            else replace(choice, acting=choice.acting ^ {k})
        )
    slip = choice.slip.copy()
    slip[k] = 0.0 if slip[k] != 0.0 else np.sign(phase.impulse[programs.equations.frictions[k].row])
    return replace(choice, slip=slip)


def _choices(programs: Programs, law: Law) -> Iterator[Choice]:
    """Every set of branches, while there are few."""
    every, frictions = law.held | law.free | law.parting, programs.equations.frictions
    free, parting = sorted(law.free), sorted(law.parting)
    loose = [f for f, each in enumerate(frictions) if each.contact in every]
    if 2 ** len(free + parting) * 3 ** len(loose) > 6561:
        return
    for signs in product((0.0, 1.0, -1.0), repeat=len(loose)):
        slip = np.zeros(len(frictions))
        slip[loose] = signs
        for on in product((True, False), repeat=len(free) + len(parting)):
            off = {c for c, is_on in zip(free + parting, on, strict=True) if not is_on}
            yield Choice(every - (off & law.free), law.parting & off, slip)


def _check_frictions(programs: Programs, acting: Collection[int]) -> None:
    """Frictions of contacts in the plane, and of joints under no load of the impact."""
    for each in programs.equations.frictions:
        if each.contact in acting and each.group:
            raise Unknown(f"friction in space, of {each.name!r}, is not differentiated in its phases")
        if each.contact < 0 and any(node.op == "input" and node.data[0] == "lam" for node in live([each.limit])):
            raise Unknown(f"friction that follows the load of a joint, of {each.name!r}, is not differentiated in it")
