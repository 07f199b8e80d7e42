"""States between the rows of a run by explicit Runge–Kutta steps, as accurate as the steps themselves.

A step from the row before ends at the time that is asked for, all times side by side. Accelerations and multipliers are
the consistent ones there. A step that has a stage next to a pose in which rows lose rank would err by 1/x, x how far it
is from there: polynomials through the rows around, which lie far enough from such poses, take its place.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.compile.python import ArrayFunction, array_function
from mbd.equations import programs
from mbd.equations.equations import Equations
from mbd.integrators.dormand_prince import END, NODES, STAGES, WEIGHTS
from mbd.results.record import Rows
from mbd.tape.node import Tape

if TYPE_CHECKING:
    from mbd.results.columns import ModelColumns
    from mbd.results.interpolation import Places

__all__ = ["Restepping"]

NEAR_POSE = 0.2
"""Distance of a stage from a pose of lost rank, over that of the row before, below which it is not used [-]."""
DEPENDENCE = 1e-9
"""What is left of a row beside the earlier ones, relative, below which it depends on them at any pose [-]."""
LEAST_SIZE = -1e6
"""Log |det| that stands for that of a singular matrix [-]."""


class Restepping:
    """States between the rows of a run of `RungeKutta853` that stored every step."""

    def __init__(self, columns: ModelColumns) -> None:
        self.columns, self.equations = columns, columns.equations
        self.terms = _terms(self.equations)
        self._independent: dict[bytes, list[int]] = {}

    @staticmethod
    def serves(columns: ModelColumns) -> bool:
        """Whether the steps of this run can be taken again: all stored, in one mode each, with no dry friction.

        With dry friction rows do not tell which frictions stick, and those that follow loads would need a search.
        """
        settings, equations = columns.record.settings, columns.equations
        stepped = settings.get("between") == "stages" and settings.get("store") == 1
        return stepped and equations.compose is None and not equations.frictions

    def at(self, rows: Rows, places: Places) -> Rows:
        """The states at places; those that meet a row are that row."""
        inside = places.step > 0.0
        found = rows.part(places.lower)  # type: ignore[arg-type]
        if not inside.any():
            return found
        begin, time = found.part(inside), places.time[inside]
        state, least = self._stepped(begin, (time - begin.time)[:, None])
        q, v, z = self._parts(state)
        rate, lam, size = self._rates(replace(begin, time=time, q=q, v=v, z=z))
        changed: dict[str, Any] = {"time": time, "q": q, "v": v, "z": z, "lam": lam}
        changed["a"], changed["s"] = np.split(rate, [self.equations.n_v], axis=1)
        there: dict[str, Any] = {name: _put(getattr(found, name), inside, new) for name, new in changed.items()}
        found = replace(found, **there)
        near = np.zeros(len(inside), dtype=bool)
        near[inside] = np.minimum(least, size - self._rates(begin)[2]) < 2.0 * np.log(NEAR_POSE)
        return self._smoothed(rows, places, found, near) if near.any() else found

    def _smoothed(self, rows: Rows, places: Places, found: Rows, near: Any) -> Rows:
        """The states with those told by `near` interpolated."""
        between = self.columns.grid.between(rows, places, self.columns.record.v, True)
        names = ("q", "v", "z", "a", "s", "lam")
        put: dict[str, Any] = {name: _put(getattr(found, name), near, getattr(between, name)[near]) for name in names}
        return replace(found, **put)

    def _stepped(self, begin: Rows, h: Matrix) -> tuple[Matrix, Vector]:
        """(q, v, z) after a step of h (k, 1) from each of the rows, and the least change of log |det| at its stages."""
        base = np.hstack([begin.q, begin.v, begin.z])
        slopes = np.zeros((STAGES, *base.shape))
        slopes[0] = np.hstack([begin.v, begin.a, begin.s])
        before = self._rates(begin)[2]
        least = np.zeros(len(begin))
        for stage in range(1, STAGES):
            q, v, z = self._parts(base + h * np.tensordot(WEIGHTS[stage, :stage], slopes[:stage], 1))
            rate, _, size = self._rates(replace(begin, time=begin.time + NODES[stage] * h[:, 0], q=q, v=v, z=z))
            slopes[stage] = np.hstack([v, rate])
            least = np.minimum(least, size - before)
        return np.asarray(base + h * np.tensordot(END, slopes, 1)), least

    def _parts(self, state: Matrix) -> tuple[Matrix, Matrix, Matrix]:
        n_q, n_v = self.equations.n_q, self.equations.n_v
        return state[:, :n_q], state[:, n_q : n_q + n_v], state[:, n_q + n_v :]

    def _rates(self, rows: Rows) -> tuple[Matrix, Matrix, Vector]:
        """Consistent (v̇, ż) and multipliers at each row, which may have other contacts closed; log |det| of the matrix.

        That is 0 without rows, and without the rows that depend on others anywhere; at a pose in which others do so
        for an instant the determinant vanishes like x².
        """
        n, m, count = self.equations.n_v + self.equations.n_z, len(self.equations.rows), len(rows)
        inputs, parameters = self.columns.inputs(rows), self.columns.record.parameters_at(rows.source)
        flat = np.array(self.terms(inputs, parameters)).T
        cuts = np.cumsum([n * n, n, n * m, m * n, m, m, m])
        M, f, R, B, _, _, bias, _ = np.split(flat, cuts, axis=1)
        M, R, B = M.reshape(count, n, n), R.reshape(count, n, m), B.reshape(count, m, n)
        rate, lam, size = np.zeros((count, n)), np.zeros((count, m)), np.zeros(count)
        patterns, group = np.unique(rows.closed, axis=0, return_inverse=True)
        for number, closed in enumerate(patterns):
            mine = np.flatnonzero(group.ravel() == number)
            held = [k for k, row in enumerate(self.equations.rows) if row.contact < 0 or closed[row.contact]]
            width = n + len(held)
            matrix = np.zeros((len(mine), width, width))
            matrix[:, :n, :n] = M[mine]
            matrix[:, :n, n:] = R[mine][:, :, held]
            matrix[:, n:, :n] = B[mine][:, held]
            if held:
                key = closed.tobytes()
                kept = self._independent.setdefault(key, [*range(n), *(n + k for k in _independent(matrix[0, n:, :n]))])
                size[mine] = np.maximum(np.linalg.slogdet(matrix[:, kept][:, :, kept])[1], LEAST_SIZE)
            solved = _solved(matrix, -np.hstack([f[mine], bias[mine][:, held]]))
            rate[mine] = solved[:, :n]
            lam[np.ix_(mine, np.array(held, dtype=np.intp))] = solved[:, n:]
        return rate, lam, size


def _terms(equations: Equations) -> ArrayFunction:
    """M, f, R, B, h, ḣ, bias and the rest of `programs.accelerations` at many states, made once for these equations."""
    if equations.tape not in _KNOWN:
        with equations.tape.lock:
            _KNOWN[equations.tape] = array_function(programs.accelerations(equations))
    return _KNOWN[equations.tape]


_KNOWN: WeakKeyDictionary[Tape, ArrayFunction] = WeakKeyDictionary()


def _independent(B: Matrix) -> list[int]:
    """The rows that do not depend on earlier ones."""
    basis, kept = np.zeros((0, B.shape[1])), []
    for k, row in enumerate(B):
        left = row - basis.T @ (basis @ row)
        left = left - basis.T @ (basis @ left)
        length = float(np.linalg.norm(left))
        if length > DEPENDENCE * float(np.linalg.norm(row)):
            basis = np.vstack([basis, left / length])
            kept.append(k)
    return kept


def _solved(matrix: Any, right: Matrix) -> Matrix:
    """A x = b for each; of rows that depend on each other the multipliers of least norm."""
    try:
        found = np.linalg.solve(matrix, right[:, :, None])[:, :, 0]
        left = np.max(np.abs(np.einsum("kij,kj->ki", matrix, found) - right), axis=1)
        if np.all(left <= 1e-9 * (1.0 + np.max(np.abs(right), axis=1))):
            return np.asarray(found)
    except np.linalg.LinAlgError:
        pass
    return np.asarray(np.einsum("kij,kj->ki", np.linalg.pinv(matrix, rcond=1e-11), right))


def _put(values: Matrix, where: Any, new: Matrix | Vector) -> Matrix:
    """The values with some replaced."""
    changed = values.copy()
    changed[where] = new
    return changed
