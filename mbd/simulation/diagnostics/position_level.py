"""Multipliers of index 3, which the scheme does not know as it starts and damps away in its first steps."""

from __future__ import annotations

import numpy as np

from mbd.results.columns import ModelColumns
from mbd.results.record import Record
from mbd.simulation.diagnostics.coarse import percent

__all__ = ["position_level_multipliers"]

FIRST_ROWS = 16
"""Rows after the start whose multipliers are compared with the balance of forces."""
MAX_SHARE = 0.02
"""Difference from the balance, over the largest multiplier of the run, above which a run says so [-]."""


def position_level_multipliers(record: Record, columns: ModelColumns) -> list[str]:
    """The note of index 3 on rows whose multipliers differ from what the balance of forces has at the same state.

    A scheme of order 2 that holds ``h(q₁) = 0`` alone takes the error of its own position formula, O(dt³), for an
    acceleration: multipliers err by O(dt) in the first steps after a start or an event (Arnold, Brüls, Cardona 2015,
    Numerische Mathematik 129, 149-179).
    """
    if len(record.time) < 3:
        return []
    rows = columns.rows.part(np.arange(1, min(FIRST_ROWS, len(record.time))))
    solved = columns.balance.solve(rows)
    known = solved.sound & solved.unique
    off = np.max(np.abs(rows.lam - solved.lam)[known], axis=0, initial=0.0)
    share = off / np.maximum(np.max(np.abs(record.lam), axis=0, initial=0.0), 1e-300)
    worst = [
        k
        for k, row in enumerate(columns.equations.rows)
        if not row.is_velocity and row.friction < 0 and share[k] > MAX_SHARE
    ]
    if not worst:
        return []
    k = max(worst, key=lambda k: float(share[k]))
    row = columns.equations.rows[k]
    return [
        f"multipliers of the first steps are off, of {row.owner!r} by {percent(float(share[k]))} % of its largest: "
        "index 3 has them with an error of first order in dt after the start and each event, until its damping has "
        "taken that away; formulation='ggl' has them with order 2"
    ]
