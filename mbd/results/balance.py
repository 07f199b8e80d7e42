"""Accelerations and multipliers that are consistent with given positions and velocities, many states at once.

``M a + f + R λ = 0`` with ``B a + γ = 0`` on the rows that hold: those of joints and bilateral constraints, of closed
contacts and of frictions that stick. Where rows depend on others only a largest independent set is solved with: beside
the constraint manifold, as at a stage of an explicit step, all of them together are nearly singular and contradict each
other. Their multipliers are those of least norm among all that give the same forces.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from itertools import accumulate, pairwise
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.compile.many import at_inputs
from mbd.compile.python import ArrayFunction, array_function
from mbd.compile.trivial_rows import parts_of_row
from mbd.dataclass import dataclass
from mbd.equal import NOMINAL_RTOL, REST_SPEED, ROUND_OFF_RTOL
from mbd.equations import programs
from mbd.equations.equations import Equations
from mbd.equations.magnitudes import magnitudes
from mbd.kernel.algebra.redundancy import JOINT_SHARE, MIN_LIMIT_SHARE
from mbd.kernel.stepping.restart import MAX_LOAD_ITERATIONS
from mbd.later import later
from mbd.results.polynomials import Index
from mbd.results.record import Rows
from mbd.results.stored_states import StoredStates
from mbd.tape.derivatives import live
from mbd.tape.node import Node, Tape

RANK_RTOL = 1e-6
"""What is left of a row beside the earlier ones, relative, below which it depends on them [-].

The largest over some stored states counts: at one of them rows may depend on each other for an instant, and an error of
1e-9 in positions leaves as much of a row that depends on others.
"""
MAX_SAMPLES = 16
"""Stored states at which the dependence of rows is judged, at most [-]."""
SINGULAR_LOG_DETERMINANT = -1e6
"""Log |det| that stands for that of a singular matrix [-]."""

Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Solved:
    """Consistent values at k states.

    rate : (v̇, ż) (k, n); lam : all multipliers (k, m), zero where a row is off
    size : log |det| of the matrix (k,); 0 without rows
    sound : where the values are determined and finite (k,)
    unique : where no row depends on others, so that multipliers are the only ones (k,)
    inertia, load : M (k, n, n) and f (k, n), which weigh differences
    """

    rate: Matrix
    lam: Matrix
    size: Vector
    sound: Flags
    unique: Flags
    inertia: Any
    load: Matrix


@dataclass(frozen=True, eq=False)
class Held:
    """Rows that hold in one mode.

    every : their numbers; kept : those of an independent set, ascending
    """

    every: list[int]
    kept: list[int]

    @property
    def depend(self) -> bool:
        """Whether rows depend on others."""
        return len(self.kept) < len(self.every)


class Balance:
    """Solves for accelerations and multipliers at states of a run."""

    def __init__(self, states: StoredStates) -> None:
        self.states, self.equations = states, states.equations
        self.terms, self.follows = _terms(self.equations)
        self.loads_act = any(getattr(contact, "drags", ()) and contact.rows for contact in self.equations.contacts)
        self._held: dict[bytes, Held] = {}
        self._grouped: tuple[Any, Any, list[tuple[NDArray[np.int8], Any]]] = None, None, []

    @staticmethod
    def serves(equations: Equations) -> bool:
        """Whether the equations of motion are there; a table of columns may do without."""
        return equations.n_v > 0 and len(equations.balance) == equations.n_v + equations.n_z

    @np.errstate(all="ignore")
    def solve(self, rows: Rows) -> Solved:
        """Consistent values at states, which may be in several modes; multipliers in `rows` are a first guess."""
        n, m, count = self.equations.n_v + self.equations.n_z, len(self.equations.rows), len(rows)
        found = Solved(
            np.zeros((count, n)), np.zeros((count, m)), np.zeros(count), np.zeros(count, dtype=bool),
            np.ones(count, dtype=bool), np.zeros((count, n, n)), np.zeros((count, n)),
        )  # fmt: skip
        groups = self._groups(rows)
        if self.between is not None and (values := self._by_machine(rows, groups)) is not None:
            return values
        for mode, mine in groups:
            self._solve_in(mode, rows if len(groups) == 1 else rows.part(mine), mine, found)
        return found

    @cached_property
    def between(self) -> Any:
        """What solves by machine code, if there is any."""
        return later("results: states between rows")(self.states)

    def _by_machine(self, rows: Rows, groups: Sequence[tuple[NDArray[np.int8], Any]]) -> Solved | None:
        """The same by machine code; None where a mode has none. Which rows depend on others stored states tell."""
        samples = self.samples([mode for mode, _ in groups])
        found = None if samples is None else self.between.balanced(rows, samples)
        if found is None:
            return None
        rate, lam, size, sound, unique, inertia, load = found
        sound = sound & np.isfinite(rate).all(axis=1) & np.isfinite(lam).all(axis=1)
        return Solved(rate, lam, size, sound, unique, inertia, load)

    def samples(self, modes: Sequence[NDArray[Any]]) -> Rows | None:
        """A stored row of each mode; None if one has none."""
        chosen, stored = list[int](), self.states.rows
        for mode in modes:
            same = np.flatnonzero(np.all(stored.closed == mode[: stored.closed.shape[1]], axis=1))
            if not len(same):
                return None
            chosen.append(int(same[len(same) // 2]))
        return stored.part(np.array(chosen, dtype=np.intp))

    def _groups(self, rows: Rows) -> list[tuple[NDArray[np.int8], Any]]:
        """The modes of states, and where each holds; found once for states that share their flags, as stages do."""
        closed, phase, groups = self._grouped
        if closed is not rows.closed or phase is not rows.phase:
            patterns, group = modes_of(np.hstack([rows.closed.astype(np.int8), rows.phase]))
            alone = len(patterns) == 1
            groups = [(mode, slice(None) if alone else np.flatnonzero(group == k)) for k, mode in enumerate(patterns)]
            self._grouped = rows.closed, rows.phase, groups
        return groups

    def _solve_in(self, mode: NDArray[np.int8], rows: Rows, mine: Any, found: Solved) -> None:
        """The same in one mode; `mine` are the places of the results."""
        held = self.rows_in(mode)
        slides = bool(np.any(np.abs(rows.phase) == 1)) or self.loads_act
        turns = MAX_LOAD_ITERATIONS if self.follows or (held.depend and self.equations.frictions) else 1
        lam = rows.lam
        for _ in range(turns):
            M, f, R, B, _, _, bias, limits, here = self.terms_at(replace(rows, lam=lam))
            forces, spread = R[:, :, held.kept], None
            if held.depend:
                dependence, weight = _dependence(M, B, held), self._shares(held, limits)
                spread = _shared(dependence, weight, held) if slides else _least_norm(dependence, weight)
            if slides and spread is not None:  # how a load is shared moves the mechanism
                forces = R[:, :, held.every] @ spread
            rate, force, size, sound = saddle(M, f, forces, B[:, held.kept], bias[:, held.kept])
            before, lam = lam, np.zeros_like(rows.lam)
            lam[:, held.every] = force if spread is None else (spread @ force[:, :, None])[:, :, 0]
            if turns == 1:
                break
            change = np.max(np.abs(lam - before), axis=1, initial=0.0)
            if np.all((change <= 1e-13 * np.max(np.abs(lam), axis=1, initial=0.0)) | ~sound):
                break
        if slides:
            anchors = rows.anchors.copy()  # friction turns with the surface under it, not with that where it was struck
            for number, friction in enumerate(self.equations.frictions):
                if friction.group and friction.contact >= 0 and abs(mode[number - len(self.equations.frictions)]) == 1:
                    own = list(self.equations.contacts[friction.contact].anchors)
                    anchors[:, own] = here[:, own]
            *_, rates, _, limits, _ = self.terms_at(replace(rows, lam=lam, anchors=anchors))
            for number, friction in enumerate(self.equations.frictions):
                sliding = np.abs(rows.phase[:, number]) == 1
                way = self._way(rows, number, rates)
                lam[sliding, friction.row] = (way * limits[:, number])[sliding]
        sound &= np.isfinite(rate).all(axis=1) & np.isfinite(lam).all(axis=1)
        found.rate[mine], found.lam[mine], found.size[mine], found.sound[mine] = rate, lam, size, sound
        found.inertia[mine], found.load[mine], found.unique[mine] = M, f, not held.depend

    def _way(self, rows: Rows, number: int, rates: Matrix) -> Vector:
        """Sign with which a friction slides, or cosine of its direction to that of its group, (k,)."""
        own = self.equations.frictions[number]
        if not own.group:
            return np.asarray(rows.phase[:, number], dtype=float)
        every = [self.equations.frictions[each].row for each in own.group]
        resting = np.linalg.norm(rates[:, every], axis=1) < REST_SPEED  # γ has no direction yet
        ways = np.where(resting[:, None], rows.lam[:, every], rates[:, every])
        size = np.linalg.norm(ways, axis=1)
        way: Vector = np.divide(ways[:, own.group.index(number)], size, out=np.zeros_like(size), where=size > 0.0)
        return way

    def _shares(self, held: Held, limits: Matrix) -> Matrix:
        """W of the rows that hold (k, every): as of `mbd.kernel.algebra.redundancy.share`."""
        largest = np.max(limits, axis=1, initial=0.0)
        weight = np.ones((len(limits), len(held.every)))
        for place, row in enumerate(held.every):
            friction = self.equations.rows[row].friction
            if friction < 0 and self.equations.rows[row].contact < 0:
                weight[:, place] = JOINT_SHARE
            elif friction >= 0:
                part = np.divide(limits[:, friction], largest, out=np.ones_like(largest), where=largest > 0.0)
                weight[:, place] = np.maximum(part, MIN_LIMIT_SHARE)
        return weight

    def terms_at(self, rows: Rows) -> tuple[Any, ...]:
        """M (k, n, n), f (k, n), R (k, n, m), B (k, m, n), h, ḣ, γ (k, m), limits, what would be held.

        The limits are those of frictions (k, n_frictions), the last what anchors would be here (k, n_anchors).
        """
        n, m, count = self.equations.n_v + self.equations.n_z, len(self.equations.rows), len(rows)
        inputs, parameters = self.states.all_inputs(rows), self.states.record.parameters_at(rows.source)
        if self.states.machine is None:
            flat = self.terms.lines(inputs, parameters).T
        else:
            layout, _, function = self.states.machine
            flat = at_inputs(function, layout, inputs, parameters)[:, : self.terms.size]
        ends = accumulate((n * n, n, n * m, m * n, m, m, m, flat.shape[1]), initial=0)
        M, f, R, B, h, rates, bias, rest = (flat[:, first:end] for first, end in pairwise(ends))
        last = rest.shape[1] - len(self.equations.frictions)
        R, B = R.reshape(count, n, m), B.reshape(count, m, n)
        return M.reshape(count, n, n), f, R, B, h, rates, bias, rest[:, last:], rest[:, : last - 1]

    def rows_in(self, mode: NDArray[np.int8]) -> Held:
        """The rows that hold in a mode: flags of contacts, then phases of frictions."""
        key = mode.tobytes()
        return self._held[key] if key in self._held else self._held.setdefault(key, self._rows_of(mode))

    def _rows_of(self, mode: NDArray[np.int8]) -> Held:
        """The rows that hold in a mode, judged at stored states."""
        contacts = len(self.equations.contacts)
        closed, phase = mode[:contacts], mode[contacts:]
        every = [
            k for k, row in enumerate(self.equations.rows)
            if (row.contact < 0 or closed[row.contact]) and (row.friction < 0 or phase[row.friction] == 2)  # it sticks
        ]  # fmt: skip
        if not every:
            return Held([], [])
        record = self.states.record
        same = np.all(record.closed == closed, axis=1) & np.all(record.phase == phase, axis=1)
        places = np.flatnonzero(same)
        chosen = places[np.linspace(0, len(places) - 1, min(len(places), MAX_SAMPLES)).astype(np.intp)]
        there = self.states.rows.part(chosen)
        M, _, _, B, *_ = self.terms_at(there)
        every = self._acting(every, there, B)
        # in the metric of M one light coordinate makes all rows that move it parallel; dependent rows are so in any
        independent = _independent(B[:, every] / weights(M))
        if len(independent) < len(every):
            independent = max(independent, _independent(B[:, every]), key=len)
        return Held(every, [every[k] for k in independent])

    def _acting(self, every: list[int], rows: Rows, B: Any) -> list[int]:
        """The rows whose Jacobian exceeds round-off of its parts; redundant ones of joints on one axis are not."""
        largest = np.max(np.abs(B), axis=(0, 2), initial=0.0)
        bound = NOMINAL_RTOL * max(1.0, float(np.max(largest, initial=0.0)))
        doubtful = [k for k in every if largest[k] <= bound]
        if not doubtful:
            return every
        with self.equations.tape.lock:
            parts = [node for k in doubtful for node in self._parts_of_row(k)]
        sizes = np.array(self.states.evaluate(parts, rows)).reshape(len(doubtful), -1, len(rows))
        n_v = self.equations.n_v
        trivial = {
            k
            for k, size in zip(doubtful, sizes, strict=True)
            if np.all(np.abs(B[:, k, :n_v]) <= ROUND_OFF_RTOL * size.T)
        }
        return [k for k in every if k not in trivial]

    def _parts_of_row(self, k: int) -> list[Node]:
        """Σ|parts| of the entries of a row of B; of a file, which has no bodies, those of their expressions."""
        terms = getattr(self.equations, "terms", ())
        if not terms:
            return parts_of_row(self.equations, k)
        first = _last_of_R(self.equations) + k * (self.equations.n_v + self.equations.n_z)
        return magnitudes(self.equations.tape, terms[first : first + self.equations.n_v])


def modes_of(flags: NDArray[Any]) -> tuple[NDArray[Any], Index]:
    """The different rows among flags, most of which are those of their neighbours, and the number of each."""
    first = np.ones(len(flags), dtype=bool)
    first[1:] = np.any(flags[1:] != flags[:-1], axis=1)
    patterns, group = np.unique(flags[first], axis=0, return_inverse=True)
    return patterns, group.ravel()[np.cumsum(first) - 1]


def weights(M: Any) -> Any:
    """√M_ii (k, 1, n), by which columns of B are divided before rows are compared; 1 of what has no inertia."""
    found = np.sqrt(np.maximum(np.einsum("kii->ki", M), 0.0))
    return np.where(found > 0.0, found, 1.0)[:, None, :]


def _dependence(M: Any, B: Any, held: Held) -> Any:
    """T (k, every, kept) of ``B = T B_kept``, by least squares on columns divided by √M_ii."""
    scaled = np.nan_to_num(B / weights(M), posinf=0.0, neginf=0.0)
    basis, _ = np.linalg.qr(np.swapaxes(scaled[:, held.kept], 1, 2))
    along = scaled[:, held.every] @ basis
    kept = np.swapaxes(along[:, [held.every.index(k) for k in held.kept]], 1, 2).copy()
    kept[np.linalg.slogdet(kept)[0] == 0.0] = np.eye(len(held.kept))  # of the very matrix that is solved with
    return np.swapaxes(np.linalg.solve(kept, np.swapaxes(along, 1, 2)), 1, 2)


def _least_norm(dependence: Any, weight: Matrix) -> Any:
    """S (k, every, kept) of λ = S λ_kept: of all λ with the same forces that with the least λᵀ W⁻¹ λ."""
    heavy = weight[:, :, None] * dependence
    square = np.swapaxes(dependence, 1, 2) @ heavy
    lost = ~np.isfinite(square).all(axis=(1, 2))  # at a singular configuration, where no such λ is used
    square[lost] = 0.0
    square[lost | (np.linalg.slogdet(square)[0] == 0.0)] = np.eye(dependence.shape[2])
    return np.swapaxes(np.linalg.solve(square, np.swapaxes(heavy, 1, 2)), 1, 2)


def _shared(dependence: Any, weight: Matrix, held: Held) -> Any:
    """S (k, every, kept) of λ = S λ_kept with ``S = W T W_kept⁻¹``, the same λ, where λ_kept is part of it."""
    kept = [held.every.index(k) for k in held.kept]
    return weight[:, :, None] * dependence / weight[:, None, kept]


def saddle(M: Any, f: Matrix, R: Any, B: Any, bias: Matrix) -> tuple[Matrix, Matrix, Vector, Flags]:
    """a, λ and log |det| of ``M a + f + R λ = 0``, ``B a + γ = 0`` for each of k states, and where there are any."""
    count, n, m = len(f), f.shape[1], bias.shape[1]
    matrix = np.zeros((count, n + m, n + m))
    matrix[:, :n, :n], matrix[:, :n, n:], matrix[:, n:, :n] = M, R, B
    right = -np.hstack([f, bias])
    finite = np.isfinite(matrix).all(axis=(1, 2)) & np.isfinite(right).all(axis=1)
    if not finite.all():
        matrix[~finite] = np.eye(n + m)
    if not m:
        with suppress(np.linalg.LinAlgError):  # then some are singular, and told apart below
            rate = np.asarray(np.linalg.solve(matrix, right[:, :, None])[:, :, 0], dtype=float)
            return rate, np.zeros((count, 0)), np.zeros(count), np.asarray(finite)
    sign, size = np.linalg.slogdet(matrix)
    sound = finite & (sign != 0.0)
    if not sound.all():
        matrix[~sound] = np.eye(n + m)
    solved = np.linalg.solve(matrix, right[:, :, None])[:, :, 0]
    size = (
        np.where(sound, np.maximum(size, SINGULAR_LOG_DETERMINANT), SINGULAR_LOG_DETERMINANT) if m else np.zeros(count)
    )
    return np.asarray(solved[:, :n]), np.asarray(solved[:, n:]), np.asarray(size), np.asarray(sound)


def _independent(B: Any) -> list[int]:
    """The rows that do not depend on earlier ones at every one of k states, from B (k, m, n).

    A state next to a singular configuration tells nothing of later rows, since what is left of an earlier one is
    round-off there.
    """
    basis, kept = np.zeros((len(B), 0, B.shape[2])), []
    telling = np.ones(len(B), dtype=bool)
    for row in range(B.shape[1]):
        left, size = B[:, row], np.linalg.norm(B[:, row], axis=1)
        for _ in range(2):
            left = left - np.einsum("kbn,kb->kn", basis, np.einsum("kbn,kn->kb", basis, left))
        length = np.linalg.norm(left, axis=1)
        asked = telling if telling.any() else ~telling
        if np.any((length > RANK_RTOL * size)[asked]):
            telling &= length > 1e-5 * np.max(size)  # a row may vanish by itself there
            there = (length > RANK_RTOL**2 * size)[:, None]
            unit = np.divide(left, length[:, None], out=np.zeros_like(left), where=there)
            basis = np.concatenate([basis, unit[:, None]], axis=1)
            kept.append(row)
    return kept


def _terms(equations: Equations) -> tuple[ArrayFunction, bool]:
    """M, f, R, B, h, ḣ, γ and the rest of `programs.accelerations` at many states, made once for these equations.

    And whether R follows multipliers.
    """
    if equations.tape not in _KNOWN:
        with equations.tape.lock:
            nodes = list(getattr(equations, "terms", ())) or programs.accelerations(equations, impacts=False)
            follows = any(node.op == "input" and node.data[0] == "lam" for node in live(nodes[: _last_of_R(equations)]))
            _KNOWN[equations.tape] = array_function(nodes), follows
    return _KNOWN[equations.tape]


def _last_of_R(equations: Equations) -> int:
    n = equations.n_v + equations.n_z
    return n * n + n + n * len(equations.rows)


_KNOWN: WeakKeyDictionary[Tape, tuple[ArrayFunction, bool]] = WeakKeyDictionary()


def put(values: Matrix, where: Flags | Index, new: Matrix | Vector) -> Matrix:
    """The values with some replaced."""
    changed = values.copy()
    changed[where] = new
    return changed
