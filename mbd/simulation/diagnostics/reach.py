"""Whether constraints that follow time ask for positions that do not exist, shortly after a run has failed."""

from __future__ import annotations

import numpy as np

from mbd.assembly.conflicts import Conflict, loops_of
from mbd.assembly.infeasibility import position_conflicts
from mbd.assembly.posture import Posture, close_positions, position_rows
from mbd.equal import EQUAL_RTOL
from mbd.kernel import codes
from mbd.simulation.run.data import RunData

__all__ = ["out_of_reach"]

AHEAD = (1.0, 4.0, 16.0)
"""How many steps beyond the last accepted state are looked at, one after the other [-]."""
STEP_FAILURES = frozenset(
    {
        codes.NOT_FINITE, codes.NOT_CONVERGED, codes.SINGULAR, codes.STAGNATED, codes.DEPENDENT, codes.CONFLICT,
        codes.NO_LOCATION, codes.TOO_TIGHT,
        codes.TOO_NEAR, codes.TOO_SMALL, codes.SINGULAR_ROWS_MOVE, codes.OUTGROWN, codes.GAINED, codes.LEAPT,
        codes.UNSTABLE,
    }
)  # fmt: skip
"""What steps fail with next to such a limit."""


def out_of_reach(run: RunData, status: int) -> str:
    """A sentence on the constraints that cannot hold together soon after the accepted state, '' if none.

    A linkage that a driver pulls to its limit ends next to a singular configuration, where steps fail for reasons of
    their own; that no position exists beyond it is the cause.
    """
    if status not in STEP_FAILURES or not _follows_time(run):
        return ""
    try:
        return _first_conflict(run)
    except np.linalg.LinAlgError:
        return ""


def _first_conflict(run: RunData) -> str:
    """The same of rows that follow time."""
    for steps in AHEAD:
        found = _conflict(run, steps * run.dt)
        if found is not None:
            return f"by t = {run.now + steps * run.dt:.6g} s {found}"
    return ""


def _follows_time(run: RunData) -> bool:
    """Whether a row on positions that acts changes with time while nothing moves."""
    rows = position_rows(_posture(run, 0.0))
    off = [np.max(np.abs(_heights(_posture(run, ahead * run.dt), rows)), initial=0.0) for ahead in AHEAD]
    return bool(rows) and bool(np.isfinite(off).all()) and max(off) > EQUAL_RTOL


def _posture(run: RunData, ahead: float) -> Posture:
    """The accepted positions at a later time."""
    v = run.kernel
    return Posture(
        run.mechanism, run.manager, v.params, v.q[: v.n_q].copy(), v.y[: v.n].copy(),
        v.closed[: v.n_contacts].copy(), v.anchors.copy(), time=run.now + ahead,
    )  # fmt: skip


def _heights(work: Posture, rows: list[int]) -> np.ndarray:
    """What the rows are off."""
    terms = work.terms()
    return np.asarray(terms.h[rows])


def _closes(run: RunData, ahead: float) -> bool:
    work = _posture(run, ahead)
    left = close_positions(work, position_rows(work), np.ones(work.equations.n_v, dtype=bool))
    return bool(np.max(np.abs(left), initial=0.0) <= EQUAL_RTOL)


def _conflict(run: RunData, ahead: float) -> Conflict | None:
    """The first irreducible set of constraints that no position satisfies at a later time."""
    if _closes(run, ahead):
        return None
    work = _posture(run, ahead)
    found = position_conflicts(work, position_rows(work), work.q.copy(), loops_of(run.model), tried=True)
    return found[0] if found else None
