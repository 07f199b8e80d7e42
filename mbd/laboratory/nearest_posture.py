"""Postures nearest to measured places, by Gauss–Newton steps from frame to frame and then of all frames at once."""

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.compile.many import at_inputs
from mbd.compile.mechanism import Mechanism
from mbd.dataclass import dataclass
from mbd.equal import RANK_RTOL
from mbd.errors import ModelError
from mbd.laboratory.marker_program import MarkerProgram

NEAR, CHORD, CONVERGED = 0.03, 1e-3, 1e-10
"""Largest step of a frame after which the next one begins, step of all frames below which JᵀWJ is kept, and error
after which all frames are done [m, rad]."""
MAX_STEPS, MAX_FIRST, MAX_POLISH, MAX_HALVINGS = 30, 300, 400, 12
"""Steps of a frame, of the first one, of all frames together; halvings of one."""
BLOCK = 16
"""Frames that are taken together."""
MAX_TURN = 0.5
"""Largest turn of one step, so that no angle winds up by a whole turn [rad]."""
DAMPING = 1e-12
"""What is added to the diagonal of JᵀWJ, over its largest entry: directions that nothing measures stay [-]."""


@dataclass(frozen=True, eq=False)
class Problem:
    """What is measured, and what holds.

    measured, weight : (R, k) components and their weights, 0 where one is missing
    rows, gaps : numbers of the rows that hold and of the gaps that must not be negative, behind the components in the
        program
    """

    program: MarkerProgram
    measured: Matrix
    weight: Matrix
    rows: int
    gaps: int

    @property
    def components(self) -> int:
        return int(self.measured.shape[1])

    @property
    def held(self) -> int:
        """How many rows and gaps there are."""
        return self.rows + self.gaps


@dataclass(frozen=True, eq=False)
class Postures:
    """q (R, n_q), residuals (R, k) measured − model, covariance of increments (R, n_v) without the variance of noise,
    steps of all frames, closed stops (R, gaps), and directions that nothing measures (n_v,) anywhere."""

    q: Matrix
    residual: Matrix
    spread: Matrix
    steps: int
    stopped: NDArray[np.bool_]
    unseen: NDArray[np.bool_]


def nearest_postures(
    problem: Problem, time: Vector, begin: Vector, first: int, parameters: Vector, mechanism: Mechanism
) -> Postures:
    """The postures of all frames, from one of them forwards and backwards."""
    count, n_q = len(time), len(begin)
    q = np.zeros((count, n_q))
    closed = np.zeros((count, problem.gaps), dtype=bool)
    step = _Step(problem, mechanism, parameters)
    # from frame to frame, each from the ones beside it
    q[first], closed[first], total = step.frame(first, float(time[first]), begin, MAX_FIRST, closed[first])
    for order, beside in (range(first + 1, count), -1), (range(first - 1, -1, -1), 1):
        for k in order:
            q[k], closed[k], used = step.frame(k, float(time[k]), q[k + beside], MAX_STEPS, closed[k + beside])
            total += used
    # all frames at once that are not done yet
    left, before = np.arange(count, dtype=np.intp), np.full(count, np.inf)
    inverse = np.zeros((count, 0, 0))
    for _ in range(MAX_POLISH):
        own, stops = q[left], closed[left]
        if not problem.held and before[left].max(initial=0.0) < CHORD:
            if not inverse.size:
                inverse = step.inverse(time, q)
            x, lam = step.chord(left, time[left], own, inverse[left]), np.zeros((len(left), 0))
        else:
            x, lam, _ = step.all(left, time[left], own, stops)
        q[left] = own = step.composed(own, x)
        total += len(left)
        changed = step.stops(time[left], own, stops, lam)
        closed[left] = stops
        size = np.abs(x).max(axis=1, initial=0.0)
        ratio = np.minimum(size / before[left], 0.999)  # of steps of a sequence that converges linearly
        before[left] = size
        done = ~changed & (size * np.maximum(1.0, ratio / (1.0 - ratio)) <= CONVERGED)
        left = left[~done]
        if not len(left):
            break
    if len(left) and before[left].max() > NEAR:
        worst = left[int(np.argmax(before[left]))]
        raise ModelError(f"t = {time[worst]:.6g} s: the nearest posture was not found; try another start=")
    if problem.held:
        _, _, spread = step.all(np.arange(count, dtype=np.intp), time, q, closed, spread=True)
    else:
        spread = step.inverse(time, q).diagonal(axis1=1, axis2=2)
    y, _ = problem.program.at_all(time, q, parameters)
    residual = problem.measured - y[:, : problem.components]
    return Postures(q, residual, spread, total, closed, step.unseen(time, q))


class _Step:
    """Gauss–Newton steps of one frame and of all."""

    def __init__(self, problem: Problem, mechanism: Mechanism, parameters: Vector) -> None:
        self.problem, self.mechanism, self.parameters = problem, mechanism, parameters
        layout, program = mechanism.layout, problem.program
        self.block = np.zeros(layout.size)
        self.out = np.zeros(program.function.size)
        self.J = np.zeros((program.size, layout.n_v))
        self.turning = np.array([unit == "rad" for _, unit in mechanism.equations.configuration.freedoms], dtype=bool)
        self.vector = mechanism.equations.compose is None

    def frame(
        self, k: int, time: float, q: Vector, most: int, closed: NDArray[np.bool_]
    ) -> tuple[Vector, NDArray[np.bool_], int]:
        """Posture, closed stops and steps of a frame that begins at q."""
        problem, n_v = self.problem, self.mechanism.layout.n_v
        closed = closed.copy()
        cost, x = np.inf, np.zeros(n_v)
        for number in range(most):
            y = self._evaluate(time, q)
            now = self._cost(k, y, closed)
            halvings = 0
            while not now <= cost * (1.0 + 1e-9) + 1e-300 and halvings < MAX_HALVINGS:  # farther: go half way back
                x = 0.5 * x
                q, halvings = self.composed(q, -x), halvings + 1
                y = self._evaluate(time, q)
                now = self._cost(k, y, closed)
            cost = now
            x, lam = self._solve(k, y, closed)
            x = x / max(1.0, np.abs(x[self.turning]).max(initial=0.0) / MAX_TURN)
            q = self.composed(q, x)
            if np.abs(x).max(initial=0.0) <= NEAR:
                y = self._evaluate(time, q) if problem.gaps else y
                if not self._stops(y, closed, lam):
                    return q, closed, number + 1
                cost = np.inf
        if np.abs(x).max(initial=0.0) > 10.0 * NEAR:
            raise ModelError(f"t = {time:.6g} s: the nearest posture was not found; try another start=")
        return q, closed, most

    def _evaluate(self, time: float, q: Vector) -> Vector:
        layout = self.mechanism.layout
        self.block[0] = time
        self.block[layout.q : layout.x] = q
        return self.problem.program.at(self.block, self.parameters, self.out, self.J)

    def _cost(self, k: int, y: Vector, closed: NDArray[np.bool_]) -> float:
        """½ Σ w² r², and ∞ where rows are far from holding counts as their size."""
        n = self.problem.components
        r = self.problem.weight[k] * (y[:n] - self.problem.measured[k])
        rows = np.concatenate([y[n : n + self.problem.rows], y[n + self.problem.rows :][closed]])
        return float(r @ r) + 1e3 * float(np.abs(rows).sum())

    def _solve(self, k: int, y: Vector, closed: NDArray[np.bool_]) -> tuple[Vector, Vector]:
        problem, n = self.problem, self.problem.components
        w = problem.weight[k]
        WJ = w[:, np.newaxis] * self.J[:n]
        H = WJ.T @ WJ
        H.flat[:: len(H) + 1] += DAMPING * max(H.max(initial=0.0), 1e-300)
        g = WJ.T @ (w * (problem.measured[k] - y[:n]))
        held = np.concatenate([np.ones(problem.rows, dtype=bool), closed])
        if not held.any():
            return np.linalg.solve(H, g), np.zeros(problem.gaps)
        B, h = self.J[n:][held], y[n:][held]
        m = len(h)
        size = H.max(initial=0.0)
        K = np.block([[H, B.T * size], [B * size, -DAMPING * size * np.eye(m)]])
        found = np.linalg.solve(K, np.concatenate([g, -h * size]))
        lam = np.zeros(problem.gaps)
        lam[closed] = found[len(H) + problem.rows :]
        return found[: len(H)], lam

    def _stops(self, y: Vector, closed: NDArray[np.bool_], lam: Vector) -> bool:
        """Close the stops that were passed, open those that pull; whether one changed."""
        gap = y[self.problem.components + self.problem.rows :]
        passed, pulls = ~closed & (gap < -1e-9), closed & (lam > 0.0)
        closed[passed], closed[pulls] = True, False
        return bool(passed.any() or pulls.any())

    # all frames ---------------------------------------------------------------------------------------------------
    def all(
        self, frames: NDArray[np.intp], time: Vector, q: Matrix, closed: NDArray[np.bool_], spread: bool = False
    ) -> tuple[Matrix, Matrix, Matrix]:
        """Of some frames increments (R, n_v), multipliers of stops (R, gaps), diagonals of the inverse (R, n_v).

        With `spread` the diagonals are found where rows or stops hold; see `inverse` for others.
        """
        problem, n = self.problem, self.problem.components
        weight, count = problem.weight[frames], len(frames)
        if count > BLOCK:  # whose derivatives fit into the cache
            blocks = [slice(k, k + BLOCK) for k in range(0, count, BLOCK)]
            parts = [self.all(frames[each], time[each], q[each], closed[each], spread) for each in blocks]
            x, lam, diagonal = (np.concatenate(each) for each in zip(*parts, strict=True))
            return x, lam, diagonal
        y, J = problem.program.at_all(time, q, self.parameters)
        WJ = weight[:, :, np.newaxis] * J[:, :n]
        H = WJ.transpose(0, 2, 1) @ WJ
        n_v = H.shape[1]
        size = np.maximum(H.max(axis=(1, 2), initial=0.0), 1e-300)
        H[:, range(n_v), range(n_v)] += DAMPING * size[:, np.newaxis]
        r = weight * (problem.measured[frames] - y[:, :n])
        g = (WJ.transpose(0, 2, 1) @ r[:, :, np.newaxis])[:, :, 0]
        m = problem.held
        if not m:
            return np.asarray(np.linalg.solve(H, g[:, :, np.newaxis])[:, :, 0]), np.zeros((count, 0)), g
        held = np.concatenate([np.ones((count, problem.rows), dtype=bool), closed], axis=1)
        B = J[:, n:] * held[:, :, np.newaxis] * size[:, np.newaxis, np.newaxis]
        h = y[:, n:] * held * size[:, np.newaxis]
        K = np.zeros((count, n_v + m, n_v + m))
        K[:, :n_v, :n_v], K[:, :n_v, n_v:], K[:, n_v:, :n_v] = H, B.transpose(0, 2, 1), B
        K[:, range(n_v, n_v + m), range(n_v, n_v + m)] = np.where(held, -DAMPING, -1.0) * size[:, np.newaxis]
        found = np.linalg.solve(K, np.concatenate([g, -h], axis=1)[:, :, np.newaxis])[:, :, 0]
        diagonal = np.linalg.inv(K)[:, range(n_v), range(n_v)] if spread else np.zeros((count, n_v))
        return found[:, :n_v], found[:, n_v + problem.rows :], np.asarray(diagonal)

    def inverse(self, time: Vector, q: Matrix) -> NDArray[np.float64]:
        """(JᵀWJ)⁻¹ of all frames (R, n_v, n_v)."""
        n_v, found = self.mechanism.layout.n_v, []
        for k in range(0, len(time), BLOCK):
            own = slice(k, k + BLOCK)
            WJ = (
                self.problem.weight[own, :, np.newaxis]
                * self.problem.program.at_all(time[own], q[own], self.parameters)[1]
            )
            H = WJ.transpose(0, 2, 1) @ WJ
            H[:, range(n_v), range(n_v)] += DAMPING * H.max(axis=(1, 2), initial=1e-300)[:, np.newaxis]
            found.append(np.linalg.inv(H))
        return np.concatenate(found)

    def chord(self, frames: NDArray[np.intp], time: Vector, q: Matrix, inverse: NDArray[np.float64]) -> Matrix:
        """Increments of some frames (R, n_v), by the JᵀWJ of postures nearby and the gradient of these."""
        problem = self.problem
        y, entries = problem.program.entries_at_all(time, q, self.parameters)
        r = problem.weight[frames] ** 2 * (problem.measured[frames] - y)
        g = problem.program.transposed(entries, r)
        return np.asarray((inverse @ g[:, :, np.newaxis])[:, :, 0])

    def stops(self, time: Vector, q: Matrix, closed: NDArray[np.bool_], lam: Matrix) -> NDArray[np.bool_]:
        """The same as for one frame; (R,) whether a stop changed."""
        if not self.problem.gaps:
            return np.zeros(len(time), dtype=bool)
        y, _ = self.problem.program.at_all(time, q, self.parameters)
        return np.array([self._stops(y[k], closed[k], lam[k]) for k in range(len(time))], dtype=bool)

    def composed(self, q: Matrix, x: Matrix) -> Matrix:
        """q ⊕ x of one state or of many."""
        if self.vector:
            return np.asarray(q + x)
        layout, function = self.mechanism.layout, self.mechanism.common["compose"]
        if q.ndim == 2:
            return at_inputs(function, layout, {"t": np.zeros(len(q)), "q": q, "x": x}, self.parameters)
        block, out = np.zeros(layout.size), np.zeros(layout.n_q)
        block[layout.q : layout.x], block[layout.x : layout.v] = q, x
        function(block, self.parameters, out)
        return out

    def unseen(self, time: Vector, q: Matrix) -> NDArray[np.bool_]:
        """(n_v,) whether some frame does not determine an increment: what is measured and held leaves it free."""
        problem, n = self.problem, self.problem.components
        patterns = np.unique(problem.weight > 0.0, axis=0, return_index=True)[1]
        _, J = problem.program.at_all(time[patterns], q[patterns], self.parameters)
        found = np.zeros(self.mechanism.layout.n_v, dtype=bool)
        for k, own in zip(patterns, J, strict=True):
            A = np.concatenate([problem.weight[k][:, np.newaxis] * own[:n], own[n : n + problem.rows]])
            sizes, V = np.linalg.eigh(A.T @ A)
            null = V[:, sizes <= RANK_RTOL * max(sizes[-1], 1e-300)]
            found |= np.linalg.norm(null, axis=1) > 1e-3
        return found
