"""Positions and velocities that cannot be closed: how far they miss, and the smallest sets in conflict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.assembly.conditions import Condition
from mbd.assembly.conflicts import HELD_ROW_WEIGHT, Conflict, Member, irreducible, linear_conflict, member_of, solvable
from mbd.assembly.pose import Posture
from mbd.assembly.posture import close_positions, descend, descents
from mbd.dataclass import dataclass
from mbd.equal import EQUAL_RTOL

MAX_CONFLICTING_SETS = 5
"""Conflicting sets that are reported at once."""


@dataclass(frozen=True)
class Held:
    """A coordinate or rate whose value a start names, or all of a joint.

    moves : numbers of the velocities that it fixes
    """

    name: str
    value: float
    moves: tuple[int, ...]


Item = Member | Condition | Held
"""What may be left out of a conflict: rows by their owner, a named result, a named coordinate."""
Loops = Mapping[str, tuple[str, ...]]
"""Cut joints and the joints of their loops."""


def position_conflicts(
    work: Posture, rows: Sequence[int], start: Vector, loops: Loops, tried: bool = False
) -> list[Conflict]:
    """Irreducible sets of rows that no position satisfies, whatever is named; disjoint ones, each once.

    Parameters
    ----------
    work : where closing gave up; its `iterations` are reported
    rows : numbers of the rows on positions
    start : q from which closing began
    loops : see `loops_of`
    tried : whether it is known that not all rows can hold
    """
    everywhere = np.ones(work.equations.n_v, dtype=bool)
    spent, found = work.iterations, dict[int, Conflict]()
    left = list(rows)
    while left and len(found) < MAX_CONFLICTING_SETS:
        members = {k: member_of(work.equations.rows[k], work.equations, loops) for k in left}
        if not tried and _closes(work, start, left, (), everywhere):
            break
        tried = False
        missing, _ = _nearest(work, start, left, (), everywhere)
        off = {k: abs(value) for k, value in zip(left, missing, strict=True)}
        chosen = _least(work, start, members, off, everywhere)
        involved = [k for k in left if members[k] in chosen]
        found[involved[0]] = _conflict(work, start, involved, loops, spent)
        left = [k for k in left if members[k] not in chosen]
    return [found[k] for k in sorted(found)]


def _least(
    work: Posture, start: Vector, members: Mapping[int, Member], off: Mapping[int, float], free: Matrix
) -> list[Member]:
    """An irreducible set: at the nearest posture Σ h ∇h = 0, so rows with h = 0 are hardly ever part of it."""

    def holds(chosen: Sequence[Member]) -> bool:
        return _closes(work, start, [k for k, member in members.items() if member in chosen], (), free)

    every = list(dict.fromkeys(members.values()))
    largest = max(off.values())
    likely = [each for each in every if any(off[k] > 1e-6 * largest for k, m in members.items() if m == each)]
    return irreducible(every if len(likely) < len(every) and holds(likely) else likely, holds)


def _conflict(work: Posture, start: Vector, rows: Sequence[int], loops: Loops, spent: int) -> Conflict:
    """The conflict of rows that form an irreducible set: how far the last member misses as the others hold."""
    equations = work.equations
    members = [member_of(equations.rows[k], equations, loops) for k in rows]
    weights = np.array([1.0 if member == members[-1] else HELD_ROW_WEIGHT for member in members])
    missing, _ = _nearest(work, start, rows, (), np.ones(equations.n_v, dtype=bool), weights)
    sizes: dict[str, float] = {}
    for k, member, value in zip(rows, members, missing, strict=True):
        if member == members[-1]:
            unit = equations.rows[k].unit
            sizes[unit] = float(np.hypot(sizes.get(unit, 0.0), value))
    unit = max(sizes, key=lambda each: sizes[each])
    return Conflict("position", tuple(dict.fromkeys(members)), sizes[unit], unit, members[-1], spent)


def _closes(work: Posture, start: Vector, rows: Sequence[int], places: Sequence[Condition], free: Matrix) -> bool:
    """Whether positions satisfy some of the rows and named results."""
    trial = replace(work, q=start.copy(), places=tuple(places), anchors=work.anchors.copy())
    return bool(np.max(np.abs(close_positions(trial, rows, free)), initial=0.0) <= EQUAL_RTOL)


def _nearest(
    work: Posture,
    start: Vector,
    rows: Sequence[int],
    places: Sequence[Condition],
    free: Matrix,
    weights: Vector | float = 1.0,
) -> tuple[Vector, Matrix]:
    """Residuals and Jacobian where Σ (w h)² is least: Levenberg–Marquardt from a few starts."""
    best: tuple[Vector, Matrix] | None = None
    for q in descents(work, start, free):
        trial = replace(work, q=q, places=tuple(places))
        came = descend(trial, rows, free, np.broadcast_to(weights, len(rows) + len(places)))
        if best is None or np.linalg.norm(weights * came[0]) < np.linalg.norm(weights * best[0]) * (1.0 - 1e-9):
            best = came
    assert best is not None
    return best


def velocity_conflict(work: Posture, loops: Loops) -> Conflict | None:
    """An irreducible set of active rows that no velocity satisfies at the position of `work`, whatever is named."""
    equations = work.equations
    active = work.active_rows
    y = work.y.copy()
    y[: equations.n_v] = 0.0
    terms = work.terms(y=y)
    right = -terms.rate[active]
    tolerance = EQUAL_RTOL * (1.0 + float(np.max(np.abs(right), initial=0.0)))
    members = [member_of(equations.rows[k], equations, loops) for k in active]
    units = [equations.rows[k].unit for k in active]
    return linear_conflict(terms.B[active][:, : equations.n_v], right, members, units, "velocity", tolerance)


def acceleration_conflict(work: Posture, loops: Loops) -> Conflict | None:
    """An irreducible set of active rows that no acceleration satisfies at the state of `work`."""
    equations = work.equations
    active = work.active_rows
    terms = work.terms()
    right = -terms.bias[active]
    tolerance = 1e-6 * (1.0 + float(np.max(np.abs(right), initial=0.0)))
    members = [member_of(equations.rows[k], equations, loops) for k in active]
    units = [equations.rows[k].unit for k in active]
    return linear_conflict(terms.B[active][:, : equations.n_v], right, members, units, "acceleration", tolerance)


def named_conflict(
    work: Posture, rows: Sequence[int], start: Vector, held: Sequence[Held], loops: Loops, speeds: bool
) -> tuple[str, ...]:
    """Names of an irreducible set of rows and named values that contradict each other, rows first.

    Parameters
    ----------
    work, rows, start : as for `position_conflicts`; `start` is (v, z) for speeds
    held : named coordinates, or rates
    speeds : whether velocities are meant instead of positions
    """
    members = {k: member_of(work.equations.rows[k], work.equations, loops) for k in rows}
    conditions = list(work.rates if speeds else work.places)

    def holds(chosen: Sequence[Item]) -> bool:
        picked = [k for k, member in members.items() if member in chosen]
        wanted = [condition for condition in conditions if condition in chosen]
        if speeds:
            return _moves(work, start, picked, wanted, [each for each in held if each in chosen])
        free = np.ones(work.equations.n_v, dtype=bool)
        free[[k for each in held if each in chosen for k in each.moves]] = False
        return _closes(work, start, picked, wanted, free)

    items: list[Item] = [*dict.fromkeys(members.values()), *conditions, *held]
    likely = items if speeds else _suspects(work, rows, start, members, held)
    if len(likely) < len(items) and not holds(likely):
        items = likely
    elif holds(items):
        return ()
    return tuple(repr(item.name) for item in irreducible(items, holds))


def _suspects(
    work: Posture, rows: Sequence[int], start: Vector, members: Mapping[int, Member], held: Sequence[Held]
) -> list[Item]:
    """Those that push against each other at the nearest posture, where Σ h ∇h = 0 along all that may move."""
    free = np.ones(work.equations.n_v, dtype=bool)
    free[[k for each in held for k in each.moves]] = False
    h, B = _nearest(work, start, rows, work.places, free)
    large = 1e-6 * float(np.max(np.abs(h), initial=0.0))
    items: list[Item] = list(dict.fromkeys(m for m, off in zip(members.values(), h, strict=False) if abs(off) > large))
    items += [c for c, off in zip(work.places, h[len(rows) :], strict=True) if abs(off) > large]
    push = np.abs(B.T @ h)
    large = 1e-6 * float(np.max(push, initial=0.0))
    return [*items, *(each for each in held if any(push[k] > large for k in each.moves))]


def _moves(work: Posture, y: Vector, rows: Sequence[int], wanted: Sequence[Condition], held: Sequence[Held]) -> bool:
    """Whether velocities satisfy rows, named rates of results and named rates of coordinates."""
    n_v = work.equations.n_v
    still = replace(work, y=np.concatenate([np.zeros(n_v), y[n_v:]]))
    terms = still.terms()
    picked = list(rows)
    rate, B = still.with_conditions(terms.rate[picked], terms.B[picked][:, :n_v], wanted)
    unit = np.eye(n_v)[[k for each in held for k in each.moves]]
    right = np.concatenate([-rate, [each.value for each in held]])
    scale = 1.0 + float(np.max(np.abs(right), initial=0.0))
    return solvable(np.vstack([B, unit]), right, EQUAL_RTOL * scale)
