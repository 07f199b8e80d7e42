"""Named values that contradict rows, moved to the nearest ones that do not, where some of them are no coordinates.

The places and rates that are named, coordinates and other results alike, are then off by as little as can be:

    min Σ (value − named)²  subject to the rows,

angles modulo a turn; rates follow at the pose that was found. What these leave open moves least.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.assembly.conditions import Condition
from mbd.assembly.pose import Posture
from mbd.assembly.posture import close_nearby, close_positions, move
from mbd.equal import EQUAL_RTOL, RANK_RTOL


def nearest_positions(work: Posture, rows: Sequence[int], named: Mapping[int, float]) -> bool:
    """Move `work` onto the rows, nearest to the named coordinates and places; False where the rows do not close.

    Parameters
    ----------
    rows : numbers of the rows on positions
    named : values of coordinates by number; those of other places are `work.places`
    """
    places, work.places = work.places, ()
    free = np.ones(work.equations.n_v, dtype=bool)
    try:
        if np.max(np.abs(close_positions(work, rows, free)), initial=0.0) > EQUAL_RTOL:
            return False
        off, slopes = _off(work, places, named)
        damping = 1e-3
        for _ in range(100):  # steps of the method of Gauss and Newton
            q, anchors = work.q.copy(), work.anchors.copy()
            change = _step(_jacobian(work, rows), off, slopes, damping)
            move(work, change / max(1.0, 2.0 * float(np.max(np.abs(change), initial=0.0))))
            closed = np.max(np.abs(close_nearby(work, rows, free)), initial=0.0) <= EQUAL_RTOL
            new, new_slopes = _off(work, places, named)
            if closed and new @ new < off @ off:
                off, slopes, damping = new, new_slopes, max(0.2 * damping, 1e-12)
                if np.max(np.abs(change), initial=0.0) < 1e-10:  # it has arrived
                    break
                continue
            work.q, work.anchors[:] = q, anchors
            damping *= 5.0
            if damping > 1e9:
                break
        return True
    finally:
        work.places = places


def nearest_velocities(work: Posture, rows: Sequence[int], named: Mapping[int, float]) -> bool:
    """Let velocities satisfy the rows, nearest to the named rates; False where the rows cannot be satisfied.

    Parameters
    ----------
    rows : numbers of the active rows
    named : rates by number; those of other results are `work.rates`
    """
    n_v = work.equations.n_v
    terms = work.terms()
    B, rate = terms.B[list(rows)][:, :n_v], terms.rate[list(rows)]
    off, slopes = _misfits(work, work.rates, named, work.y)
    first, free = _split(B, rate)
    wanted = -(off + slopes @ first)
    work.y[:n_v] += first + free @ np.linalg.lstsq(slopes @ free, wanted, rcond=RANK_RTOL)[0]
    terms = work.terms()
    speed = 1.0 + float(np.max(np.abs(work.y[:n_v]), initial=0.0))
    return bool(np.max(np.abs(terms.rate[list(rows)]), initial=0.0) <= EQUAL_RTOL * speed)


def _jacobian(work: Posture, rows: Sequence[int]) -> Matrix:
    """B of the rows."""
    terms = work.terms()
    return np.asarray(terms.B[list(rows)][:, : work.equations.n_v])


def _split(B: Matrix, residual: Vector) -> tuple[Vector, Matrix]:
    """The least change that takes the residual away, and the changes that leave it as it is, as columns."""
    n = B.shape[1]
    if not len(B):
        return np.zeros(n), np.eye(n)
    _, sizes, right = np.linalg.svd(B)
    rank = int(np.count_nonzero(sizes > RANK_RTOL * max(float(sizes[0]), 1e-300)))
    return -np.linalg.pinv(B, rcond=RANK_RTOL) @ residual, right[rank:].T


def _step(B: Matrix, off: Vector, slopes: Matrix, damping: float) -> Vector:
    """A change along the rows that brings the named values nearer."""
    _, free = _split(B, np.zeros(len(B)))
    if not free.shape[1]:
        return np.zeros(B.shape[1])
    reduced = slopes @ free
    # changes that no named value asks for weigh that much, relative to those that one does
    weight = np.sqrt(damping + 1e-6**2) * np.eye(free.shape[1])
    stacked = np.vstack([reduced, weight])
    return np.asarray(free @ np.linalg.lstsq(stacked, np.append(-off, np.zeros(free.shape[1])), rcond=None)[0])


def _off(work: Posture, places: Sequence[Condition], named: Mapping[int, float]) -> tuple[Vector, Matrix]:
    """How far named coordinates and places are off, and the derivatives of that."""
    off, slopes = _misfits(work, places, named, work.q)
    configuration = work.equations.configuration
    if len(named):
        turning = configuration.rates(work.q, np.eye(configuration.n_v)).T  # N(q), n_q × n_v
        slopes[: len(named)] = turning[list(named)]
    angles = [work.equations.coordinates[k].unit == "rad" for k in named] + [_turns(work, each.name) for each in places]
    return np.where(angles, np.remainder(off + np.pi, 2.0 * np.pi) - np.pi, off), slopes


def _turns(work: Posture, name: str) -> bool:
    """Whether a place is an angle of a cut joint, which gives one pose modulo a turn."""
    return any(turn.name == name for turn in work.equations.turns)


def _misfits(work: Posture, found: Sequence[Condition], named: Mapping[int, float], values: Any) -> Any:
    """Values less the named ones and their derivatives: of coordinates or rates, then of other results."""
    n_v = work.equations.n_v
    block = work.mechanism.block(work.time, work.q, work.y, work.anchors)
    others = [condition.at(block, work.parameters) for condition in found]
    off = np.array([*(values[k] - value for k, value in named.items()), *(residual for residual, _ in others)])
    slopes = np.zeros((len(off), n_v))
    for line, k in enumerate(named):
        slopes[line, min(k, n_v - 1)] = 1.0  # of rates; those of coordinates are N(q)
    for line, (_, slope) in enumerate(others, start=len(named)):
        slopes[line] = slope
    return off, slopes
