"""Closing a mechanism: positions and velocities that satisfy its rows, moved least in the metric of the mass matrix."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.assembly.orientation import faced
from mbd.assembly.pose import Posture
from mbd.assembly.turns import choose_turns, hold_directions
from mbd.compile.orders import MIN_UNKNOWNS
from mbd.equal import EQUAL_RTOL, HALF_PRECISION_RTOL, SMALL_SUM_RTOL

REFINEMENTS = 3
"""Solutions of the linear equations for velocities: bodies without mass leave an error in the first [-]."""
MAX_LEVER = 2.0
"""Derivative of a row over what rows are off, up to which it may come from that alone; √3 at most [1/rad]."""
MAX_STEPS_TO_HALVE = 20
"""Steps of Newton's method in which the largest residual of a start must come down to half [-]."""
NUDGE, NUDGES = 0.01, 3
"""Step [m, rad] out of a flat spot of the rows, and how often it is tried."""
MAX_STARTS, MAX_DESCENT_STEPS = 4, 400
"""Starts of a descent of the sum of squares of the rows, and its most steps [-]."""


def position_rows(work: Posture) -> list[int]:
    """Active rows that fix positions: bilateral ones and the gaps of closed contacts; anchors adapt to the position.

    Rows on velocities leave positions free.
    """
    normals = {contact.rows[0] for contact in work.manager.contacts if contact.rows}
    rows, active = work.equations.rows, work.active_rows
    return [k for k in active if not rows[k].is_velocity and (rows[k].contact < 0 or k in normals)]


def _involved(B: Matrix, free: Matrix, missing: float = 0.0) -> Any:
    """The free coordinates that the rows act on; the others stay where they are.

    missing : what the rows are off: a base that carries all they compare turns that along, and changes it by no more
    """
    size = float(np.max(np.abs(B), initial=0.0))
    least = max(1e-12 * size, SMALL_SUM_RTOL, MAX_LEVER * missing)
    return np.flatnonzero(free & (np.max(np.abs(B), axis=0, initial=0.0) > least))


def _weighted(M: Matrix) -> Matrix:
    """The mass matrix made definite, so that coordinates without inertia move at almost no cost."""
    size = float(np.max(np.abs(np.diag(M)), initial=0.0)) or 1.0
    return np.asarray(M + 1e-9 * size * np.eye(len(M)))


class _LeastChange:
    """The change d with B d = −residual nearest to `pull` in the M-norm; least squares where rows depend."""

    def __init__(self, M: Matrix, B: Matrix) -> None:
        self.B, self.flow = B, np.linalg.inv(_weighted(M)) @ B.T
        self.matrix = B @ self.flow
        self.inverse = _regular_inverse(self.matrix) if len(B) >= MIN_UNKNOWNS else None

    def __call__(self, residual: Vector, pull: Vector) -> Vector:
        right = residual + self.B @ pull
        if self.inverse is None:
            multiplier = np.linalg.lstsq(self.matrix, right, rcond=1e-12)[0]
        else:
            multiplier = self.inverse @ right
        return np.asarray(pull - self.flow @ multiplier)


def _regular_inverse(matrix: Matrix) -> Matrix | None:
    """The inverse of the matrix of many rows, much cheaper than its singular values; None where rows may depend."""
    try:
        inverse = np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return None
    condition = float(np.linalg.norm(inverse) * np.linalg.norm(matrix))
    return np.asarray(inverse) if condition * HALF_PRECISION_RTOL < 1.0 else None


def close_positions(work: Posture, rows: Sequence[int], free: Matrix) -> Vector:
    """The free coordinates that satisfy the rows nearest to the given ones; the remaining residual of each row.

    Newton's method from the given values; where it gets stuck, from others with the free angles turned, and at last
    from where the sum of squares of the rows is least, which Newton's method misses near singular poses.
    """
    if not rows and not work.places:
        return np.zeros(0)
    start = work.q.copy()
    choose_turns(work, rows)
    misfit = _newton(work, rows, free, start)
    if np.max(np.abs(misfit)) <= EQUAL_RTOL:
        return misfit
    first, angles, moved = work.q, _angles(work), work.equations.configuration.compose
    turns = np.random.default_rng(0).uniform(-1.5, 1.5, (12, len(free)))
    for turn in turns if bool((free & angles).any()) else ():
        work.q = moved(start, np.where(free & angles, turn, 0.0))
        choose_turns(work, rows)
        again = _newton(work, rows, free, start)
        if np.max(np.abs(again)) <= EQUAL_RTOL:
            return again
    weights = np.ones(len(rows) + len(work.places))
    for q in descents(work, start, free) if np.max(np.abs(misfit)) > EQUAL_RTOL else ():
        work.q = q
        missing, _ = descend(work, rows, free, weights)
        if np.max(np.abs(missing)) < 1e-3:  # from such residuals [m, rad] on Newton's method may go on
            again = _newton(work, rows, free, work.q.copy())
            if np.max(np.abs(again)) <= EQUAL_RTOL:
                return again
    work.q = first
    return misfit


def descents(work: Posture, start: Vector, free: Matrix) -> list[Vector]:
    """Positions to descend from: the given one, and others with the free angles turned and the rest shifted."""
    if not bool(np.any(free)):
        return [start.copy()]
    reach = np.where(_angles(work), 1.5, 0.5)
    turns = np.random.default_rng(1).uniform(-1.0, 1.0, (MAX_STARTS, len(free)))
    turns[0] = 0.0
    return [work.equations.configuration.compose(start, np.where(free, reach * turn, 0.0)) for turn in turns]


def _angles(work: Posture) -> Any:
    """(n_v,) booleans, increments that are angles."""
    return np.array([unit == "rad" for _, unit in work.equations.configuration.freedoms], dtype=bool)


def descend(work: Posture, rows: Sequence[int], free: Matrix, weights: Vector) -> tuple[Vector, Matrix]:
    """(h, B) at the end of a descent of Σ (w h)² from the position of `work`, which moves there."""
    choose_turns(work, rows)
    n_v, moving = work.equations.n_v, np.flatnonzero(free)
    h, B = _weighted_rows(work, rows, weights)
    damping = 1e-3
    for _ in range(MAX_DESCENT_STEPS):
        J = B[:, moving]
        steep = np.linalg.norm(J.T @ h) > 1e-13 * (1.0 + np.linalg.norm(h))
        if not len(moving) or not steep:  # nor where the rows have no derivative
            break
        before, x = work.q.copy(), np.zeros(n_v)
        x[moving] = damped_step(J, h, damping)
        x *= min(1.0, 0.5 / float(np.max(np.abs(x))))
        move(work, x)
        new_h, new_B = _weighted_rows(work, rows, weights)
        if np.linalg.norm(new_h) < np.linalg.norm(h) and np.all(np.isfinite(new_B)):
            h, B, damping = new_h, new_B, max(damping / 3.0, 1e-12)
        else:
            work.q, damping = before, 4.0 * damping
            if damping > 1e12:
                break
    return h / weights, B / weights[:, None]


def damped_step(J: Matrix, h: Vector, damping: float) -> Vector:
    """The x that makes |h + J x|² + damping |x|² least, for J = U Σ Vᵀ of any rank: −V Σ (Σ² + damping)⁻¹ Uᵀ h."""
    U, sizes, V = np.linalg.svd(J, full_matrices=False)
    return np.asarray(-V.T @ (sizes / (sizes**2 + damping) * (U.T @ h)))


def _weighted_rows(work: Posture, rows: Sequence[int], weights: Vector) -> tuple[Vector, Matrix]:
    """w h and w B of rows and named results."""
    terms = work.terms()
    picked = list(rows)
    h, B = work.with_conditions(terms.h[picked], terms.B[picked][:, : work.equations.n_v], work.places)
    h, B, _ = faced(work, picked, h, B)
    return weights * h, weights[:, None] * B


def close_nearby(work: Posture, rows: Sequence[int], free: Matrix) -> Vector:
    """Newton's method from the present position alone; the remaining residual of each row."""
    hold_directions(work.mechanism, work.time, work.q, work.parameters, work.anchors)
    return _newton(work, rows, free, work.q.copy()) if rows or work.places else np.zeros(0)


def move(work: Posture, x: Vector) -> None:
    """q ← q ⊕ x."""
    work.q = work.equations.configuration.compose(work.q, x)


def _newton(work: Posture, rows: Sequence[int], free: Matrix, start: Vector) -> Vector:
    """Newton on the free coordinates, close to `start` at the end; the remaining residual of each row.

    What has not halved in `MAX_STEPS_TO_HALVE` steps continues without the pull to `start`, and then is given up.
    """
    n_v = work.equations.n_v
    before, picked = np.inf, list(rows)
    least, since, astray = np.inf, 0, False
    for iteration in range(200):
        work.iterations += 1
        terms = work.terms()
        h, B = work.with_conditions(terms.h[picked], terms.B[picked][:, :n_v], work.places)
        h, B, opposite = faced(work, picked, h, B)
        if opposite and iteration < NUDGES:
            _turn_away(work, free)
            continue
        size = float(np.max(np.abs(h)))
        places = _involved(B, free)
        if not len(places) and size > EQUAL_RTOL and iteration < NUDGES:
            _nudge(work, rows, free)
            continue
        if not np.isfinite(size) or not len(places):
            return h
        least, since = (size, 0) if size < 0.5 * least else (least, since + 1)
        if since > MAX_STEPS_TO_HALVE and size > EQUAL_RTOL:
            if astray:
                return h
            least, since, astray = np.inf, 0, True
        near = (size < 1e-3 or iteration > 20) and not astray and iteration < 100
        change = np.zeros(n_v)
        if near:
            acting = _involved(B, free, size)
            places = acting if len(acting) else places
            change = np.where(free, work.equations.configuration.difference(work.q, start), 0.0)
        M = terms.M[:n_v, :n_v][np.ix_(places, places)]
        change[places] = _LeastChange(M, B[:, places])(h, change[places])
        limit = max(1.0, float(np.max(np.abs(change))) / 0.5)
        if size < 1e-13 and float(np.max(np.abs(change))) < 1e-12:
            return h
        if iteration > 60 and size > 0.5 * before and size < 1e-12:
            return h
        before = size
        move(work, change / limit)
    terms = work.terms()
    return faced(work, picked, *work.with_conditions(terms.h[picked], terms.B[picked][:, :n_v], work.places))[0]


def _turn_away(work: Posture, free: Matrix) -> None:
    """Leave a pose in which a joint is half a turn off, where its rows say nothing about the way back."""
    # turn [rad] of the free angles out of a pose in which a joint is half a turn off
    move(work, np.where(free & _angles(work), 0.2 * (1.0 + np.arange(len(free)) / 7.0), 0.0))


def _nudge(work: Posture, rows: Sequence[int], free: Matrix) -> None:
    """Leave a flat spot, where no free coordinate acts on the rows, along those that act on them nearby."""
    step = np.where(free, NUDGE * (1.0 + np.arange(len(free)) / 7.0), 0.0)
    nearby = work.equations.configuration.compose(work.q, step)
    terms = work.terms(nearby)
    acting = np.zeros(len(free))
    acting[_involved(terms.B[list(rows)][:, : work.equations.n_v], free)] = 1.0
    move(work, acting * step)


def capture(work: Posture) -> None:
    """Store what closed contacts hold, such as the place of touchdown, into the anchors."""
    if not any(work.flags):
        return
    terms = work.terms()
    for contact, flag in zip(work.manager.contacts, work.flags, strict=True):
        if flag:
            for anchor in contact.anchors:
                work.anchors[anchor] = terms.captured[anchor]


def close_velocities(work: Posture, free: Matrix) -> Vector:
    """Complete the free velocities; the remaining rate of each active row."""
    picked = work.active_rows
    if not picked and not work.rates:
        return np.zeros(0)
    n_v, least_change = work.equations.n_v, None
    for refinement in range(REFINEMENTS + 1):
        terms = work.terms()
        rate, B = work.with_conditions(terms.rate[picked], terms.B[picked][:, :n_v], work.rates)
        places = _involved(B, free)
        if refinement == REFINEMENTS or not len(places):
            break
        if least_change is None:  # neither M nor B follow velocities
            least_change = _LeastChange(terms.M[:n_v, :n_v][np.ix_(places, places)], B[:, places])
        work.y[places] += least_change(rate, np.zeros(len(places)))
    return rate
