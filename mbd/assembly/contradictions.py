"""What is wrong with a start that does not close: constraints in conflict, or named values that contradict them."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.assembly.conflicts import loops_of
from mbd.assembly.infeasibility import MAX_CONFLICTING_SETS, Held, named_conflict, position_conflicts, velocity_conflict
from mbd.assembly.pose import Posture
from mbd.dataclass import dataclass
from mbd.equal import EQUAL_RTOL

PROJECT_ADVICE = ", or use assemble(..., project=True) to move all"
"""Advice to those who have not followed it yet."""


@dataclass(frozen=True)
class Attempt:
    """How a start was to be closed.

    rows : numbers of the rows on positions; q, y : the values from which closing began
    held_q, held_v : named coordinates and rates, which stay
    projected : whether named coordinates and rates were free to move
    misfit, speed_misfit : what is left of `rows` and named positions, of the active rows and named rates
    """

    rows: Sequence[int]
    q: Vector
    y: Vector
    held_q: Sequence[Held]
    held_v: Sequence[Held]
    misfit: Vector
    speed_misfit: Vector
    projected: bool = False


def infeasible(work: Posture, rows: Sequence[int], start: Vector, misfit: Vector, model: Any, named: bool) -> list[str]:
    """Rows on positions that cannot hold together, whatever is named: each irreducible set, and what to relax.

    Parameters
    ----------
    work : the posture that closing reached
    rows, start : numbers of the rows, and q from which closing began
    misfit : what is left of the rows and of named positions
    named : whether values were held, so that the rows alone might close
    """
    if np.max(np.abs(misfit), initial=0.0) <= EQUAL_RTOL or not np.isfinite(misfit).all():
        return []
    return [str(each) for each in position_conflicts(work, rows, start, loops_of(model), tried=not named)]


def contradictions(work: Posture, attempt: Attempt, model: Any) -> list[str]:
    """Every row and named result that the named values contradict, with both residuals and who is in conflict."""
    equations, rows, misfit, speed_misfit = work.equations, attempt.rows, attempt.misfit, attempt.speed_misfit
    active = work.active_rows
    if not (active or rows or work.places or work.rates):
        return []
    speed = 1.0 + float(np.max(np.abs(work.y[: equations.n_v]), initial=0.0))
    fast = bool(np.max(np.abs(speed_misfit), initial=0.0) > EQUAL_RTOL * speed)
    if fast and np.isfinite(speed_misfit).all():
        conflict = velocity_conflict(work, loops_of(model))
        if conflict is not None:
            return [str(conflict)]
    sets = _sets(work, attempt, bool(np.max(np.abs(misfit), initial=0.0) > EQUAL_RTOL), fast, model)
    h = dict(zip(rows, misfit, strict=False))
    rate = dict(zip(active, speed_misfit, strict=False))
    wanted = [
        *(("", *each) for each in zip(work.places, misfit[len(rows) :], strict=True)),
        *(("the rate of ", *each) for each in zip(work.rates, speed_misfit[len(active) :], strict=True)),
    ]
    found = [
        f"{'' if condition.name.endswith('.rate') else which}{condition.name!r} = {condition.target:.9g} cannot be "
        f"reached: off by {off:.6g}; name fewer values" + sets.get(repr(condition.name), "")
        for which, condition, off in wanted
        if not abs(off) <= EQUAL_RTOL * speed
    ]
    for k in active:
        row = equations.rows[k]
        position, velocity = float(h.get(k, 0.0)), float(rate[k])
        if not np.isfinite(position + velocity):
            found.append(
                f"{row.title} is not finite at the start: check roots, logarithms and divisions, and "
                "whether a disk lies flat, which touches with all its edge"
            )
        elif abs(position) > EQUAL_RTOL or abs(velocity) > EQUAL_RTOL * speed:
            place = "" if row.is_velocity else f"position residual {position:.6g} {row.unit}, "
            sticks = row.contact >= 0 and k != equations.contacts[row.contact].rows[0] and row.friction < 0
            slide = f"{row.owner!r} sticks while it is closed, and slides with friction=mu; "
            found.append(
                f"the start contradicts {row.title}: {place}velocity residual {velocity:.6g} {row.unit}/s; "
                f"{slide if sticks and not row.is_velocity else ''}name fewer values"
                f"{'' if attempt.projected else PROJECT_ADVICE}" + sets.get(repr(row.owner), "")
            )
    return found


def _sets(work: Posture, attempt: Attempt, off: bool, fast: bool, model: Any) -> Mapping[str, str]:
    """For each name, the irreducible set of rows and named values in conflict that it belongs to."""
    finite = np.isfinite(attempt.misfit).all() and np.isfinite(attempt.speed_misfit).all()
    levels = [(False, attempt.rows, attempt.q, attempt.held_q)] if off else []
    levels += [(True, work.active_rows, attempt.y, attempt.held_v)] if fast else []
    if not (finite and levels):
        return {}
    loops, conflicts = loops_of(model), dict[str, str]()
    for speeds, rows, start, held in levels:
        left = list(rows)
        for _ in range(MAX_CONFLICTING_SETS):
            names = named_conflict(work, left, start, held, loops, speeds)
            if not names:
                break
            for name in names:
                conflicts.setdefault(name, f" (in conflict: {', '.join(names)})")
            fewer = [k for k in left if repr(work.equations.rows[k].owner) not in names]
            if len(fewer) == len(left):
                break
            left = fewer
    return conflicts
