"""Constraints that cannot hold together: the smallest sets of them by name, and what to relax.

The sets are found by a deletion filter (Chinneck & Dravnieks 1991, ORSA Journal on Computing 3:157): a constraint is
left out for good if the others still conflict; what remains conflicts, and no part of it does.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.equations.equations import Equations, Row

ADVICE = {
    "joint": "change a length in the loop of the joint, or give one of its joints another freedom",
    "constraint": "give up one of the constraints, change its value, or make it a force (mbd.Spring, mbd.Penalty)",
    "contact": "leave one of the contacts out of closed=[…]",
}
"""What to relax, by what takes part."""
LEVELS = {
    "position": ("constraints", "closure error", ""),
    "velocity": ("velocities", "error", "/s"),
    "acceleration": ("accelerations", "error", "/s²"),
}
"""What cannot be satisfied, what its error is called, and what its unit gets, at each level."""
HELD_ROW_WEIGHT = 1e4
"""Weight of rows that hold as the least error of another is looked for [-]."""


@dataclass(frozen=True)
class Member:
    """One side of a conflict: a 'joint', 'constraint' or 'contact'.

    loop : joints of the loop that a joint closes, itself included
    """

    name: str
    kind: str
    loop: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"the loop of {_listed(self.loop)}" if self.loop else f"{self.kind} {self.name!r}"


def _listed(names: Sequence[str]) -> str:
    return ", ".join(map(repr, names))


@dataclass(frozen=True)
class Conflict:
    """An irreducible set of constraints that cannot hold together: without any one of them, the others can.

    Attributes
    ----------
    level : 'position', 'velocity' or 'acceleration'
    members : what is in conflict
    error : the least by which one member misses as the others hold [m, rad, …/s, …/s²]; unit : of its position
    at : that member
    iterations : of Newton's method before it was given up
    """

    level: str
    members: tuple[Member, ...]
    error: float
    unit: str
    at: Member
    iterations: int = field(default=0, compare=False)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all joints, constraints and contacts in conflict, loops spelt out."""
        return tuple(dict.fromkeys(name for member in self.members for name in member.loop or (member.name,)))

    @property
    def relax(self) -> str:
        """What to try."""
        return "; or ".join(dict.fromkeys(ADVICE[member.kind] for member in self.members))

    def __str__(self) -> str:
        what, error, per = LEVELS[self.level]
        tried = f" after {self.iterations} iterations" if self.iterations else ""
        sets = ", ".join(str(member) for member in self.members)
        alone = "cannot close" if self.members[0].loop else "alone cannot hold"
        only = f" {alone}" if len(self.members) == 1 else " cannot hold together, any fewer of them can"
        return (
            f"{what} cannot be satisfied: {error} {self.error:.6g} {self.unit}{per} at {self.at.kind} "
            f"{self.at.name!r}{tried}; {sets}{only}: {self.relax}"
        )


def irreducible(items: Sequence[Any], holds: Callable[[list[Any]], bool]) -> list[Any]:
    """The items that remain when each is left out in turn for good if the others still conflict.

    Parameters
    ----------
    items : what conflicts together
    holds : whether some of them can hold together
    """
    kept = list(items)
    for item in items:
        fewer = [other for other in kept if other is not item]
        if not holds(fewer):
            kept = fewer
    return kept


def solvable(B: Matrix, right: Vector, tolerance: float) -> bool:
    """Whether ``B w = right`` has a solution, to a tolerance of the right-hand sides."""
    if not len(right):
        return True
    return bool(np.max(np.abs(misfit(B, right))) <= tolerance)


def misfit(B: Matrix, right: Vector, weights: Vector | float = 1.0) -> Vector:
    """What the least-squares solution of ``B w = right``, with weights, leaves of each row."""
    if not B.size:
        return -right
    scale = np.linalg.norm(B, axis=1) / weights
    scale[scale == 0.0] = 1.0
    w = np.linalg.lstsq(B / scale[:, None], right / scale, rcond=1e-10)[0]
    return np.asarray(B @ w - right)


def linear_conflict(
    B: Matrix, right: Vector, members: Sequence[Member], units: Sequence[str], level: str, tolerance: float
) -> Conflict | None:
    """An irreducible set of rows of ``B w = right`` without a solution, told by their members; None if there is one.

    Parameters
    ----------
    B, right : (m, n) and (m,) equations for velocities or accelerations w
    members, units : of each row; rows of one member stand or fall together
    level : 'velocity' or 'acceleration'
    tolerance : of the right-hand sides
    """
    if solvable(B, right, tolerance):
        return None

    def rows(chosen: Sequence[Member]) -> list[int]:
        return [k for k, member in enumerate(members) if member in chosen]

    every = list(dict.fromkeys(members))
    least = irreducible(every, lambda chosen: solvable(B[rows(chosen)], right[rows(chosen)], tolerance))
    picked = rows(least)
    weights = np.array([1.0 if members[k] == least[-1] else HELD_ROW_WEIGHT for k in picked])
    left = np.abs(misfit(B[picked], right[picked], weights)) * (weights == 1.0)
    worst = picked[int(np.argmax(left))]
    return Conflict(level, tuple(least), float(np.max(left)), units[worst], least[-1])


def member_of(row: Row, equations: Equations, loops: Mapping[str, tuple[str, ...]]) -> Member:
    """The member that a row belongs to; `loops` maps cut joints to the joints of their loops."""
    of_contact = row.contact >= 0 and not row.is_velocity
    kind = "contact" if of_contact else "joint" if row.owner in loops else "constraint"
    name = equations.contacts[row.contact].name if of_contact else row.owner
    return Member(name, kind, loops.get(row.owner, ()) if kind == "joint" else ())


def loops_of(model: Any) -> dict[str, tuple[str, ...]]:
    """For each cut joint, the joints of the loop that it closes on the tree, in the order of the model.

    None where all joints of the loop are cut: then each has rows of its own.
    """
    if not hasattr(model, "joints"):
        return {}
    from mbd.topology.plan import plan

    chosen, loops = plan(model), dict[str, tuple[str, ...]]()
    floats = {joint.name for joint in chosen.floating}
    for joint in chosen.cut:
        one, other = ({j.name for j in chosen.path(frame.body)} for frame in (joint.parent, joint.child))
        names = ((one ^ other) - floats) | {joint.name}
        loops[joint.name] = tuple(j.name for j in model.joints if j.name in names) if len(names) > 1 else ()
    return loops
