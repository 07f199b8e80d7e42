"""A run once more, by the kernel with derivatives: every scheme, law and strategy, as the kernel itself takes them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix
from mbd.equations.equations import Guard
from mbd.kernel.records import PROGRAMS, TABLE
from mbd.sensitivity.tangent.build import entry
from mbd.sensitivity.tangent.printer import LANES
from mbd.sensitivity.tangent.programs import derivatives_of_modes, derivatives_of_programs
from mbd.simulation.run.call_table import PLACES, CallTable
from mbd.simulation.run.run import Run
from mbd.simulation.run.stepper import Stepper

__all__ = ["TangentRun", "TangentStepper"]

DIRECTIONS = LANES - 1
"""Directions of one run: the last derivative is that by the size of a step."""
Lanes = NDArray[np.float64]


class Kept:
    """In the place of a scheme's memory, which goes into savepoints: the derivatives that the next step depends on."""

    def __init__(self, stepper: TangentStepper) -> None:
        self._stepper = stepper

    @property
    def memory(self) -> dict[str, Lanes]:
        """A copy of them."""
        return {name: self._stepper.tangent(name).copy() for name in TABLE.kept_reals}

    @memory.setter
    def memory(self, kept: dict[str, Lanes]) -> None:
        for name, found in kept.items():
            self._stepper.tangent(name)[:] = found


class TangentStepper(Stepper):
    """A run's numbers with the derivatives of each: those of an array (L,) are (L, `LANES`)."""

    places: Sequence[int] = ()

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.straight = self.judges_starts = False
        self.kernel.treelike = 0
        self._of: dict[str, tuple[Any, Lanes]] = {}
        self._words = np.zeros(len(PLACES), dtype=np.int64)
        self._programs: list[Any] = []
        self.scheme = Kept(self)
        layout = self.mechanism.layout
        self.kernel.starts = np.zeros(layout.size + layout.n + layout.n_rows + layout.n_v)  # see `rules.note_matrix`

    def tangent(self, name: str) -> Lanes:
        """The derivatives of an array, which stay as it grows."""
        array = getattr(self.kernel, name)
        before, found = self._of.get(name, (None, None))
        if array is not before:
            room = np.zeros((max(len(array), 1), LANES))
            if found is not None:
                count = min(len(found), len(room))
                room[:count] = found[:count]
            self._of[name], found = (array, room), room
        assert found is not None
        return found

    def differentiate_by(self, places: Sequence[int]) -> None:
        """Parameters that have derivatives."""
        self.places = tuple(places)
        self._programs = list(derivatives_of_programs(self.mechanism, self.places))
        assert len(self._programs) == len(self.functions)  # in the same order

    def add_mode(self) -> None:
        count = int(self.kernel.n_modes)
        super().add_mode()
        code = self.modes[-1]
        self.kernel.mode_code[PROGRAMS * count + 3] = len(self.functions)
        self.functions.append(code.residual)
        self._programs += derivatives_of_modes(self.mechanism, code, self.stabilized, self.places)

    def _advance_compiled(self) -> int:
        for name in TABLE.real_arrays:
            if name != "shift1":
                self._words[PLACES[name]] = self.tangent(name).ctypes.data
        shift = 8 * LANES * self.mechanism.layout.shift
        self._words[PLACES["shift1"]] = self._words[PLACES["block"]] + shift
        code = np.array([each.address for each in self._programs], dtype=np.int64)
        self._words[PLACES["code"]] = code.ctypes.data
        self._table = CallTable(self.functions, self.kernel, self.shelves.known)
        return int(entry()(self._table.address, self._words.ctypes.data))


class TangentRun(Run):
    """A run that is differentiated as it goes."""

    stepper_kind = TangentStepper
    stepper: TangentStepper
    ends_exactly = True
    every_row = False
    differentiated_reset: Callable[[Guard, dict[str, tuple[Any, Lanes]], Any, Any], tuple[Lanes, Lanes]]

    def at_state(self) -> dict[str, tuple[Any, Lanes]]:
        """Numbers of the accepted state, each with its derivatives."""
        layout, own = self.mechanism.layout, self.stepper
        sizes = {"q": layout.n_q, "y": layout.n, "rate": layout.n, "lam": layout.n_rows, "anchors": layout.n_anchors,
                 "clock": 1}  # fmt: skip
        return {
            name: (getattr(self.kernel, name)[:size].copy(), own.tangent(name)[:size, :DIRECTIONS].copy())
            for name, size in sizes.items()
        }

    def begin_tangents(self, places: Sequence[int]) -> None:
        """Before the start is put into the kernel's arrays: which parameters are differentiated by."""
        self.of_times: list[Lanes] = []
        self.of_rows: dict[int, Lanes] = {}
        self.stepper.differentiate_by(places)

    def seed(self, of_parameters: Matrix, of_q: Matrix, of_y: Matrix, of_anchors: Matrix, of_e: Matrix) -> None:
        """Derivatives of the start; of q number by number."""
        own, width = self.stepper, of_q.shape[1]
        own.tangent("params")[list(own.places), :width] = of_parameters
        for name, given in (("q", of_q), ("y", of_y), ("anchors", of_anchors), ("restitution", of_e)):
            own.tangent(name)[: len(given), :width] = given

    def collect(self) -> None:
        v, stored, known = self.kernel, self.stored, len(self.events)
        count, logged = int(v.n_stored), int(v.n_logged)
        lines = self.stepper.tangent("log").reshape(-1, v.event_width, LANES)[:logged, 0, :DIRECTIONS].copy()
        rows = self.stepper.tangent("store").reshape(-1, v.width, LANES)
        log = v.log[: logged * v.event_width].reshape(logged, v.event_width)
        near = {0, count - 1} | {int(line[4]) + k for line in log for k in (-1, 0)}
        for k in range(count) if self.every_row else sorted(near):
            if 0 <= k < count:
                self.of_rows[stored + k] = rows[k, :, :DIRECTIONS].copy()
        super().collect()
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
