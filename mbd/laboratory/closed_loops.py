"""Coordinates that rows determine: closed loops, couplers and motions that are functions, at all frames at once."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.compile.backend import Function
from mbd.compile.many import at_inputs
from mbd.compile.mechanism import Mechanism
from mbd.dataclass import dataclass
from mbd.equal import EQUAL_RTOL, HALF_PRECISION_RTOL
from mbd.equations.equations import Equations
from mbd.equations.programs import constraint_terms
from mbd.errors import ModelError
from mbd.laboratory.least_norm import left_inverses

MAX_CORRECTIONS = 30
"""Newton corrections of a frame."""
MAX_SWEEPS = 6
"""Corrections of all frames from the frames before them, after which one frame follows the other."""
MAX_CONTRACTION = 0.1
"""Part of its distance to the solution that a Newton step from the frame before may leave, in the basin of it [-]."""
FAR, PARTS = 0.2, 32
"""Part of a change from frame to frame by which the rates at both may miss it [-]; parts in which one is followed."""


@dataclass(frozen=True, eq=False)
class ClosedFrames:
    """q (R, n_q), v and a (R, n_v) with the coordinates that were missing, and for each row its largest |h|."""

    q: Matrix
    v: Matrix
    a: Matrix
    off: Matrix


@dataclass(frozen=True, eq=False)
class _Rows:
    """``h(t, q)``, ḣ, γ and B of the rows at all frames.

    inverse : of ``∂h/∂x`` along the missing coordinates where it is the same in every posture, else None
    """

    mechanism: Mechanism
    function: Function
    free: Sequence[int]
    own: Sequence[int]
    parameters: Vector
    anchors: Vector
    held: NDArray[np.bool_]
    inverse: Matrix | None

    def at(self, time: Vector, q: Matrix, v: Matrix) -> tuple[Matrix, Matrix, Matrix, NDArray[np.float64]]:
        inputs = {"t": time, "q": q, "v": v, "anchor": np.tile(self.anchors, (len(time), 1))}
        out = at_inputs(self.function, self.mechanism.layout, inputs, self.parameters)
        m = len(self.held)
        h, rate, bias = (out[:, k * m : (k + 1) * m] for k in range(3))
        return np.where(self.held, 0.0, h), rate, bias, out[:, 3 * m :].reshape(len(out), m, -1)

    def solved(self, B: NDArray[np.float64], right: Matrix) -> Matrix:
        """x of the missing coordinates with ``B x = −right``, of least norm."""
        if self.inverse is not None:
            return -right @ self.inverse.T
        part = B[:, :, self.free]
        known = left_inverses(part)
        inverse = np.asarray(np.linalg.pinv(part) if known is None else known)
        return -np.asarray(np.einsum("kij,kj->ki", inverse, right))

    def moved(self, q: Matrix, step: Matrix) -> Matrix:
        x = np.zeros((len(q), self.mechanism.layout.n_v))
        x[:, self.free] = step
        return self.mechanism.equations.configuration.compose(q, x)

    def step(self, time: Vector, q: Matrix, v: Matrix) -> tuple[Matrix, Vector]:
        """One Newton step of each frame, and how long it is."""
        h, _, _, B = self.at(time, q, v)
        step = self.solved(B, h)
        return self.moved(q, step), np.abs(step).max(axis=1, initial=0.0)

    def newton(self, time: Vector, q: Matrix, v: Matrix) -> Matrix:
        """The postures that close the rows, each from its own guess; where there is none, where it ended."""
        left = np.arange(len(q))
        for _ in range(MAX_CORRECTIONS):
            q[left], size = self.step(time[left], q[left], v[left])
            if self.inverse is not None:
                break  # what the rows determine enters them linearly
            left = left[~(size <= EQUAL_RTOL * np.maximum(1.0, np.abs(q[left]).max(axis=1)))]
            if not len(left):
                break
        return q


def close_loops(
    mechanism: Mechanism, time: Vector, motion: tuple[Matrix, Matrix, Matrix], missing: Sequence[str],
    assembled: Callable[[], tuple[Vector, Vector]], parameters: Vector,
) -> ClosedFrames:  # fmt: skip
    """q, v and a at all frames with the coordinates that the rows determine.

    1. The first frame is solved by Newton's method from a start.
    2. All others are solved at once, from the same values of the missing coordinates.
    3. Every frame is tried from a guess that follows from the two frames before it. Where a Newton step does not lead
       to the solution of 2., the frame lies on another branch of the loop: it and those behind it are solved again from
       their guesses. As each frame then follows from those before it, this is what one frame after another would give.
    4. Where `MAX_SWEEPS` of this do not suffice, one frame after another is solved.
    5. Where the rates at two frames do not tell the change between them, the frames are far apart, or on two branches:
       the second is then followed from the first in parts, along which the known coordinates change evenly.

    Where the missing coordinates enter the rows linearly, as motions that are functions of coordinates and couplers do,
    one Newton step is exact, and 3. and 4. are left out.

    Parameters
    ----------
    motion : q (R, n_q), v and a (R, n_v), whose entries of missing coordinates are not used
    missing : names of coordinates
    assembled : gives a posture of the first frame from which Newton's method begins, (n_q), and the anchors; it is not
        called where any posture will do
    """
    rows, q = _rows_of(mechanism, missing, parameters), motion[0].copy()
    v, a = motion[1].copy(), motion[2].copy()
    own = list(rows.own)
    if rows.inverse is None or mechanism.layout.n_anchors:
        start, anchors = assembled()
        rows, q[0, own] = replace(rows, anchors=anchors), start[own]
    else:
        q[0, own] = 0.0
    q[:1] = rows.newton(time[:1], q[:1], v[:1])
    if len(q) > 1:
        q[1:, own] = q[0, own]
        q[1:] = rows.newton(time[1:], q[1:], v[1:])
        if rows.inverse is None:
            _follow(rows, time, q, v)
            _follow_far(rows, time, q, v)
    free = list(rows.free)
    h, _, _, B = _with_rates(rows, time, q, v)
    _, _, bias, _ = rows.at(time, q, v)
    a[:, free] += rows.solved(B, np.einsum("kij,kj->ki", B, a) + bias)
    return ClosedFrames(q, v, a, np.abs(h))


def _follow(rows: _Rows, time: Vector, q: Matrix, v: Matrix) -> None:
    """Let each posture be the one that follows from the two before it."""
    own, right, count = list(rows.own), 1, len(q)
    for _ in range(MAX_SWEEPS):
        guess = q[right:].copy()
        guess[:, own] = _foreseen(q, right, count, own)
        away = np.abs(guess - q[right:]).max(axis=1)
        tried, _ = rows.step(time[right:], guess.copy(), v[right:])
        size = np.maximum(1.0, np.abs(q[right:]).max(axis=1))
        same = np.abs(tried - q[right:]).max(axis=1) <= MAX_CONTRACTION * away + HALF_PRECISION_RTOL * size
        if same.all():
            return
        first = int(np.argmin(same))
        q[right + first :] = rows.newton(time[right + first :], guess[first:], v[right + first :])
        right += first + 1
        if right == count:
            return
    for k in range(right, count):
        q[k, own] = _foreseen(q, k, k + 1, own)[0]
        q[k : k + 1] = rows.newton(time[k : k + 1], q[k : k + 1], v[k : k + 1])


def _with_rates(rows: _Rows, time: Vector, q: Matrix, v: Matrix) -> tuple[Matrix, ...]:
    """The rows, with the rates of the missing coordinates put into v."""
    found = rows.at(time, q, v)
    v[:, list(rows.free)] += rows.solved(found[3], found[1])
    return found


def _follow_far(rows: _Rows, time: Vector, q: Matrix, v: Matrix) -> None:
    """Follow frames in parts from those before them where the rates at both do not tell the change between them."""
    own, rate = list(rows.own), v.copy()
    _with_rates(rows, time, q, rate)
    speed, step = rate[:, list(rows.free)], np.diff(time)[:, None]
    change, foreseen = np.diff(q[:, own], axis=0), 0.5 * step * (speed[:-1] + speed[1:])
    size = np.abs(change) + 0.5 * step * (np.abs(speed[:-1]) + np.abs(speed[1:]))
    near = np.abs(change - foreseen) <= FAR * size + HALF_PRECISION_RTOL * np.maximum(1.0, np.abs(q[1:, own]))
    moved = False
    for k in range(1, len(q)):
        if near[k - 1].all() and not moved:
            continue
        way = np.linspace(q[k - 1], q[k], PARTS + 1)
        for part in range(1, PARTS + 1):
            way[part, own] = _foreseen(way, part, part + 1, own)[0]
            instant = time[k - 1 : k] + part / PARTS * step[k - 1]
            way[part] = rows.newton(instant, way[part : part + 1], v[k : k + 1])[0]
        moved = bool(np.abs(way[-1] - q[k]).max() > HALF_PRECISION_RTOL * max(1.0, np.abs(q[k]).max()))
        q[k] = way[-1]


def _foreseen(q: Matrix, first: int, last: int, own: list[int]) -> Matrix:
    """Values of the missing coordinates at frames first ≥ 1 to last, straight on from the two frames before."""
    before = q[first - 1 : last - 1, own]
    two = q[np.maximum(np.arange(first - 2, last - 2), 0)][:, own]
    return np.asarray(2.0 * before - two)


def _rows_of(mechanism: Mechanism, missing: Sequence[str], parameters: Vector) -> _Rows:
    equations = mechanism.equations
    rows = list(equations.bilateral)

    def made() -> tuple[Function, list[float | None]]:
        functions = mechanism.backend.functions(mechanism.layout)
        terms = constraint_terms(equations, rows)
        functions.add({"constraint_terms": terms})
        return functions["constraint_terms"], [e.data if e.is_constant else None for e in terms[3 * len(rows) :]]

    function, entries = mechanism.kept(_Rows, made)
    names = [c.name for c in equations.coordinates]
    places = {int(place): k for k, place in enumerate(equations.configuration.places) if place >= 0}
    own = [names.index(name) for name in missing]
    free = [places[place] for place in own]
    held = np.array([equations.rows[k].is_velocity for k in rows])
    B = np.array(entries, dtype=object).reshape(len(rows), -1)[:, free]
    always = B.size > 0 and not any(entry is None for entry in B.ravel())
    inverse = np.linalg.pinv(B.astype(float)) if always else None
    return _Rows(mechanism, function, free, own, parameters, np.zeros(mechanism.layout.n_anchors), held, inverse)


def refuse_open_loops(frames: ClosedFrames, equations: Equations, time: Vector, missing: Sequence[str]) -> None:
    """Refuse frames whose rows are open.

    Raises
    ------
    ModelError
        with the first such frame and its row.
    """
    size = np.maximum(1.0, np.abs(frames.q).max(axis=1, initial=0.0))
    open_rows = ~(frames.off.max(axis=1, initial=0.0) <= HALF_PRECISION_RTOL * size)
    if not open_rows.any():
        return
    k = int(np.argmax(open_rows))
    worst = int(np.argmax(frames.off[k]))
    row = equations.rows[equations.bilateral[worst]]
    raise ModelError(
        f"motion: at t = {time[k]:.6g} s no {missing[0]!r} closes {row.title} (off by {frames.off[k, worst]:.3g} "
        f"{row.unit})"
    )
