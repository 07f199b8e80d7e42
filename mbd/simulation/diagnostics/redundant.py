"""What a run says of rows that depend on each other, and of rows that conflict."""

from collections.abc import Mapping, Sequence

import numpy as np

from mbd.assembly.conflicts import Member, linear_conflict
from mbd.assembly.dependence import Dependence, dependences
from mbd.equations.equations import Equations, Row
from mbd.kernel.records import Kernel
from mbd.simulation.diagnostics.circular import multipliers_in

MAX_SHOWN = 8
"""Redundant rows that a note tells one by one."""


def redundancy(
    rows: Sequence[Row], dependent: Mapping[int, tuple[int, ...]], slid: bool, moved: bool = True,
    passed: bool = False, readers: Sequence[str] = (),
) -> str:  # fmt: skip
    """The note on rows that left the solve; '' if none did.

    Parameters
    ----------
    rows : of the equations
    dependent : numbers of the rows that left, and of those on which each depends
    slid : whether friction that follows multipliers has slid beside them
    moved : whether the run went far enough to tell a singular configuration from rows that depend on others anywhere
    passed : whether rows that depended on each other do so no longer, all of them acting: a singular configuration
    readers : names of laws that read multipliers of such rows, from `readers_of`
    """
    if not dependent:
        return ""
    texts = [
        str(Dependence(rows[row].title, tuple((rows[k].title, 1.0) for k in on), row, on))
        for row, on in sorted(dependent.items())
    ]
    more = ["…"] if len(texts) > MAX_SHOWN else []
    what = (
        "how they share a load is not determined, nor is the drag of friction that slides: multipliers of least norm "
        "are taken"
        if slid
        else "they did so in a singular configuration only, where branches of motions cross: the motion from there is "
        "not unique; start beside it"
        if passed
        else f"how they share a load is not determined, nor is the motion under {', '.join(map(repr, readers))}, which "
        "reads it: give the mechanism fewer rows, or read what they hold together"
        if readers
        else "the motion is unique, their multipliers are not: those of least norm are given"
        if moved
        else "their multipliers are not unique; nor is the motion, if this is a singular configuration, where branches "
        "of motions cross: start beside it"
    )
    return f"redundant constraints: {len(texts)} ({'; '.join(texts[:MAX_SHOWN] + more)}); {what}"


def readers_of(equations: Equations, dependent: Mapping[int, tuple[int, ...]]) -> list[str]:
    """Names of the laws that read multipliers of rows that depend on each other; a sum of them may be determined."""
    if not dependent or not equations.held_forces:
        return []
    shared = {row for group in dependent.items() for row in (group[0], *group[1])}
    return [effect.name for effect in equations.effects if shared & multipliers_in(effect.generalized())]


def clash(rows: Sequence[Row], K: Kernel) -> str:
    """Which rows conflict or depend on each other in the kernel's last solve; '' where none can be told apart.

    Parameters
    ----------
    rows : of the equations
    K : of which B and the right-hand sides are those of the solve that failed
    """
    B = K.acc[K.acc_B : K.acc_h].reshape(K.n_rows, K.n)
    on = [int(flags[row.contact]) for row in rows for flags in (K.closed, K.closing, K.active)]
    acting = [k for k, row in enumerate(rows) if row.contact < 0 or any(on[3 * k : 3 * k + 3])]
    acting = [k for k in acting if not K.row_trivial[k]]
    right, jacobian = -K.bias[acting], B[acting]
    if not np.isfinite(jacobian).all() or not np.isfinite(right).all():
        return ""
    members = [Member(rows[k].title, "row") for k in acting]
    units = [rows[k].unit for k in acting]
    tolerance = 1e-9 * (1.0 + float(np.max(np.abs(right), initial=0.0)))
    found = linear_conflict(jacobian, right, members, units, "velocity", tolerance)
    if found is not None:
        return ", ".join(found.names)
    return "; ".join(str(row) for row in dependences(jacobian, [member.name for member in members])[:MAX_SHOWN])
