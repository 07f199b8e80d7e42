"""Angles that are too large to tell a pose, and turns that the steps of a run do not resolve."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.equations.equations import Equations
from mbd.results.record import Record
from mbd.simulation.lengths import RUNGE_KUTTA
from mbd.tape.derivatives import live

if TYPE_CHECKING:
    from mbd.simulation.run import Run

__all__ = ["LARGEST_ANGLE", "beyond_angles", "blocks", "overturned", "unresolved_turns"]

LARGEST_ANGLE = 1e12
"""Beyond this, neighbouring numbers differ by more than 1e-4 rad: poses, and what depends on them, are round-off."""
HALF_TURN = np.pi
"""Turn in a step above which forces that follow the angle are read at too few places of a turn [rad]."""
BLOCK = 4096
"""Rows that are looked at together."""


def blocks(values: Matrix) -> Iterator[Matrix]:
    """Successive rows of a large table, few enough to need little memory; each begins with the end of the last."""
    for first in range(0, max(len(values) - 1, 1), BLOCK):
        yield values[first : first + BLOCK + 1]


def beyond_angles(equations: Equations, q: Vector) -> list[str]:
    """Which angles of a position (n_q,) are too large, one phrase each."""
    return [
        f"{coordinate.name!r} = {value:.6g} rad, where neighbouring numbers are {np.spacing(abs(value)):.2g} rad apart"
        for coordinate, value in zip(equations.coordinates, q, strict=True)
        if coordinate.unit == "rad" and abs(value) > LARGEST_ANGLE
    ]


def overturned(run: Run) -> str:
    """An angle at the end of a run that is too large to tell a pose, in a sentence; '' without one."""
    found = beyond_angles(run.mechanism.equations, run.values["q"][: run.values["n_q"]])
    return f"t = {run.now:.9g} s: {found[0]}: poses can no longer be told apart; end the run earlier" if found else ""


def unresolved_turns(run: Run, record: Record) -> list[str]:
    """A note on each angle that turns by more than half a turn in a step, where the motion follows from the angle.

    Forces are then read at instants that may fall on the same angle again and again. Steps that follow a tolerance, and
    the explicit scheme, estimate that error themselves.
    """
    if run.values["adaptive"] or run.values["scheme"] == RUNGE_KUTTA or len(record.time) < 2:
        return []
    equations = run.mechanism.equations
    ways = np.zeros(equations.n_q)
    for part in blocks(record.q):
        if len(part) > 1:
            ways = np.maximum(ways, np.max(np.abs(np.diff(part, axis=0)), axis=0))
    ways /= record.settings.get("store", 1)
    fast = [k for k, coordinate in enumerate(equations.coordinates) if coordinate.unit == "rad" and ways[k] > HALF_TURN]
    if not fast:
        return []
    with equations.tape.lock:
        nodes = [*equations.balance, *(node for row in equations.rows for node in (row.value, row.rate))]
        known = {node.data[1] for node in live(nodes) if node.op == "input" and node.data[0] == "q"}
    return [
        f"{equations.coordinates[k].name!r} turns by up to {ways[k]:.3g} rad in one step, and forces or masses follow "
        f"from it: read at so few places of a turn they may be far off; use dt below "
        f"{0.1 * run.dt * HALF_TURN / ways[k]:.1g} s"
        for k in fast
        if k in known
    ]
