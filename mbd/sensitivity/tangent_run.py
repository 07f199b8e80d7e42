"""A run once more, by the kernel with derivatives: every scheme, law and strategy, as the kernel itself takes them."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.equations.equations import Guard
from mbd.equations.programs import ActiveSet
from mbd.kernel.records import TABLE
from mbd.sensitivity.tangent.build import entry, plain_entry
from mbd.sensitivity.tangent.follow_coupled_stages import MAX_COUPLED
from mbd.sensitivity.tangent.interpreted import Table
from mbd.sensitivity.tangent.printer import HELD_ARRAYS, LANES
from mbd.sensitivity.tangent.programs import (
    Derivative,
    derivatives_of_modes,
    derivatives_of_programs,
    lanes,
    no_values,
)
from mbd.sensitivity.tangent.words import edge_place, every_row_place
from mbd.simulation.marching import Run
from mbd.simulation.run.call_table import BOUND, PLACES
from mbd.simulation.run.stepper import Stepper

DIRECTIONS = LANES - 1
"""Directions of one run: the last derivative is that by the size of a step."""
WITH_DERIVATIVES = frozenset(TABLE.real_arrays) - {"shift1"}
"""Arrays that have derivatives of their own: `shift1` is a part of another."""
WRITTEN_FIRST = HELD_ARRAYS.union(("store", "log", "starts", "spare", "out", "kkt", "acc", "rhs", "work", "coupled"))
"""Large arrays that have no derivatives, or whose derivatives are written before they are read: rows, events, and what
is computed at once.
"""
Lanes = NDArray[np.float64]


class Kept:
    """In the place of a scheme's memory, which goes into savepoints: the derivatives that the next step depends on."""

    def __init__(self, stepper: TangentStepper) -> None:
        self._room = stepper.rooms[0]

    @property
    def memory(self) -> Lanes:
        """A copy of them."""
        return self._room.copy()

    @memory.setter
    def memory(self, kept: Lanes) -> None:
        self._room[:] = kept


def _read(places: Mapping[str, slice]) -> Iterator[slice]:
    """Parts of a shelf without those arrays that are written before they are read."""
    last = 0
    for name, place in places.items():
        if name in WRITTEN_FIRST:
            yield slice(last, place.start)
            last = place.stop
    yield slice(last, None)


class TangentStepper(Stepper):
    """A run's numbers with the derivatives of each: those of an array (L,) are (L, `LANES`).

    rooms : of derivatives, for each shelf of arrays (see `mbd.simulation.run.shelves`); those of integers are empty
    """

    places: Sequence[tuple[int, int]] | None = None
    follows = True
    """Whether compiled code carries derivatives; not where values alone are asked for."""

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        plan, reals = self.shelves.plan, TABLE.real_arrays
        self.rooms = [
            lanes(length if own and own.keys() <= set(reals) else 0)
            for length, own in zip(plan.lengths, plan.places, strict=True)
        ]
        self._cleared = [room[part] for room, own in zip(self.rooms, plan.places, strict=True) for part in _read(own)]
        self.functions.append(no_values(self.mechanism))  # see `follow_accelerations.BALANCE`
        self._shelved = {name: (K_array, room) for name, K_array, room in self._on_shelves()}
        bases = np.array([*(room.ctypes.data for room in self.rooms), 0])
        self._bound = bases[plan.shelf] + LANES * plan.offset
        self._words = np.zeros(len(PLACES), dtype=np.int64)
        self._programs: list[Any] = []
        self._code = np.zeros(0, dtype=np.int64)  # their addresses
        self._code_settled = False
        self._of_modes: dict[Hashable, list[Derivative]] = {}
        self._others: list[int] = []  # of each mode, functions that run without derivatives only
        self.scheme = Kept(self)
        self._begin()

    def _begin(self) -> None:
        """No derivatives yet, in arrays that are as they were."""
        self._of = dict(self._shelved)
        self._words[BOUND] = self._bound

    @property
    def size(self) -> int:
        return super().size + sum(room.size for room in self.rooms)

    def begin_again(self, parameters: Vector, end: float) -> None:
        super().begin_again(parameters, end)
        del self._others[len(self.modes) :]
        for room in self._cleared:
            room[:] = 0.0
        self._begin()

    def _lengths(self, given: dict[str, int]) -> dict[str, int]:
        K, size = self.kernel, self.mechanism.layout.size
        unknowns = K.n + 2 * K.n_rows  # of `follow_newmark.follow_newton`
        starts = 2 * size + 10 * (K.n + K.n_rows + K.n_v + 2) + K.n_q + K.n_watched + K.n_frictions
        own = {"kkt": unknowns * unknowns, "rhs": unknowns, "pivots": unknowns}
        own["block"] = size + K.n + (K.n_rows + 1) * (K.n_v + 1)  # with W and Z behind it
        own["out"] = K.n + K.n_rows + K.n_v + 1
        if given.get("coupled", 0):
            coupled = min(3 * unknowns, MAX_COUPLED)
            own |= {"coupled": coupled * coupled, "coupled_rhs": coupled, "coupled_pivots": coupled}
        more = {name: max(length, given.get(name, 0)) for name, length in own.items()}
        return given | more | {"starts": starts + K.n_rows * (K.n_v + K.n + K.n_rows)}

    def _on_shelves(self) -> Iterator[tuple[str, Any, Lanes]]:
        """Names of arrays of reals, the arrays, and the derivatives of each."""
        for room, places in zip(self.rooms, self.shelves.plan.places, strict=True):
            for name, place in places.items():
                if name in TABLE.real_arrays:
                    yield name, self.shelves.arrays[name], room[place]

    def tangent(self, name: str) -> Lanes:
        """The derivatives of an array, which stay as it grows."""
        array = getattr(self.kernel, name)
        before, found = self._of.get(name, (None, None))
        if array is not before:
            room = lanes(max(len(array), 1))
            if found is not None:
                count = min(len(found), len(room))
                room[:count] = found[:count]
            self._of[name], found = (array, room), room
            self._words[PLACES[name]] = room.ctypes.data
        assert found is not None
        return found

    def differentiate_by(self, places: Sequence[tuple[int, int]]) -> None:
        """Parameters that have derivatives, see `mbd.sensitivity.tangent.programs.Derivative`."""
        if tuple(places) != self.places:
            self.places, self._of_modes = tuple(places), {}
            self._programs = derivatives_of_programs(self.mechanism, self.places)
        del self._programs[len(self.functions) - self._n_of_modes :]
        for code, others in zip(self.modes, self._others, strict=True):  # of earlier runs
            self._programs += self._derivatives_of_mode(code.active, others)
        self._code = self._code[:0]
        assert len(self._programs) == len(self.functions)  # in the same order

    def follow_rows(self) -> None:
        """Store the derivatives of all rows, not only of those at events."""
        self.kernel.starts[every_row_place(self.kernel)] = 1.0

    def add_mode(self) -> None:
        known = len(self.functions)
        super().add_mode()
        self._others.append(len(self.functions) - known - 2)
        found = self._derivatives_of_mode(self.modes[-1].active, self._others[-1])
        self._programs += found
        behind = len(found) - (len(self.functions) - known)
        self.functions += behind * [no_values(self.mechanism)]
        self._n_of_modes += behind

    def _derivatives_of_mode(self, key: ActiveSet, others: int) -> list[Derivative]:
        """In the order of its functions, and behind them see `words.turned_program` and what follows."""
        if key not in self._of_modes:
            newton = self.own.programs == "stepping"
            self._of_modes[key] = derivatives_of_modes(self.mechanism, key, self.places or (), newton)
        tangent, residual, turned, *solved = self._of_modes[key]
        return [tangent, residual, *others * [turned], turned, residual, *solved]

    def _advance_compiled(self) -> int:
        known = self._table is not None and not self._provisional
        for name in self.kernel.renewed & WITH_DERIVATIVES if known else WITH_DERIVATIVES:
            self.tangent(name)
        shift = 8 * LANES * self.mechanism.layout.shift
        self._words[PLACES["shift1"]] = self._words[PLACES["block"]] + shift
        if len(self._code) != len(self._programs) or not self._code_settled:
            self._code_settled = not any(each.provisional for each in self._programs)  # before the addresses
            self._code = np.array([each.address for each in self._programs], dtype=np.int64)
            self._words[PLACES["code"]] = self._code.ctypes.data
        return super()._advance_compiled()

    def _advance_plain(self) -> int:
        with np.errstate(all="ignore"):
            return plain_entry()(Table(self.kernel, self._derivatives_of, self._programs))

    def _derivatives_of(self, name: str) -> Lanes:
        """Of an array; `shift1` lies in another."""
        return self.tangent("block")[self.mechanism.layout.shift :] if name == "shift1" else self.tangent(name)

    def _enter(self, address: int) -> int:
        if self.kernel.many or not self.follows:  # a start is judged by its values
            return super()._enter(address)
        return int(entry()(address, self._words.ctypes.data))


class TangentRun(Run):
    """A run that is differentiated as it goes."""

    stepper_kind = TangentStepper
    stepper: TangentStepper
    repeats = True
    rows_at_once = 256  # derivatives of more would not stay in the caches of processors
    every_row = False
    moved_with_jump: Callable[[], Matrix | None]
    differentiated_reset: Callable[[Guard, dict[str, tuple[Any, Lanes]], Any, Any], tuple[Lanes, Lanes]]

    @property
    def edge(self) -> tuple[float, int, int, float]:
        """What a change decides in an impact, about whom, and when: see `follow_impacts.note`; 0: nothing."""
        kind, first, second, time = self.kernel.starts[edge_place(self.kernel) :][:4].tolist()
        return kind, int(first), int(second), time

    def at_state(self) -> dict[str, tuple[Any, Lanes]]:
        """Numbers of the accepted state, each with its derivatives."""
        layout, own = self.mechanism.layout, self.stepper
        sizes = {"q": layout.n_q, "y": layout.n, "rate": layout.n, "lam": layout.n_rows, "anchors": layout.n_anchors,
                 "clock": 1}  # fmt: skip
        return {
            name: (getattr(self.kernel, name)[:size].copy(), own.tangent(name)[:size, :DIRECTIONS].copy())
            for name, size in sizes.items()
        }

    def begin_tangents(self, places: Sequence[tuple[int, int]]) -> None:
        """Before the start is put into the kernel's arrays: which parameters are differentiated by."""
        self.kernel.last_time, self.kernel.near_end = self.end, self.boundaries.near
        self.of_times: list[Lanes] = []
        self.of_rows: dict[int, Lanes] = {}
        self.stepper.differentiate_by(places)
        if self.every_row:
            self.stepper.follow_rows()

    def seed(self, of_parameters: Matrix, of_q: Matrix, of_y: Matrix, of_anchors: Matrix, of_e: Matrix) -> None:
        """Derivatives of the start; of q number by number."""
        own, width = self.stepper, of_q.shape[1]
        own.tangent("params")[[place for place, _ in own.places or ()], :width] = of_parameters
        for name, given in (("q", of_q), ("y", of_y), ("anchors", of_anchors), ("restitution", of_e)):
            own.tangent(name)[: len(given), :width] = given

    def collect(self) -> None:
        v, stored, known = self.kernel, self.stored, len(self.events)
        count, logged = int(v.n_stored), int(v.n_logged)
        if not count and not logged:
            return
        lines = self.stepper.tangent("log").reshape(-1, v.event_width, LANES)[:logged, 0, :DIRECTIONS].copy()
        rows = self.stepper.tangent("store").reshape(-1, v.width, LANES)
        log = v.log[: logged * v.event_width].reshape(logged, v.event_width)
        near = {0, count - 1} | {int(line[4]) + k for line in log for k in (-1, 0)}
        chosen = [k for k in (range(count) if self.every_row else near) if 0 <= k < count]
        self.of_rows.update(zip((stored + k for k in chosen), rows[chosen, :, :DIRECTIONS], strict=True))
        super().collect()
        change = self.moved_with_jump() if count else None
        if change is not None:
            self.stepper.tangent("y")[: len(change), : change.shape[1]] += change
        self.of_times[known:] = [line for _, line in zip(self.events[known:], lines, strict=True)]

    def reset(self, guard: Guard) -> None:
        """What a user's event sets, and the derivatives of that."""
        own, K, layout = self.stepper, self.kernel, self.mechanism.layout
        before = self.at_state()
        super().reset(guard)
        q, y = K.q[: layout.n_q].copy(), K.y[: layout.n].copy()
        after = self.differentiated_reset(guard, before, q, y)
        for name, found in zip(("q", "y"), after, strict=True):
            own.tangent(name)[: len(found), : found.shape[1]] = found
