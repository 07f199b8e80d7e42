"""A mechanism as callable numbers: the compiled programs of its equations, made when they are needed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, pairwise
from time import perf_counter
from typing import Any
from weakref import ref

import numpy as np

from mbd.arrays import Vector
from mbd.compile.backend import Backend, Function, Functions, backend as choose_backend
from mbd.compile.layout import Layout
from mbd.compile.orders import elimination_order, may_pay
from mbd.compile.postponed import Postponed
from mbd.compile.python import ArrayFunction, array_function
from mbd.equations import programs
from mbd.equations.charts import chart_end, chart_motion
from mbd.equations.equations import Equations
from mbd.equations.sizes import require_room_for_tangent, tangent_refused
from mbd.errors import MemoryLimitError, UnknownNameError, nearest
from mbd.tape.node import Node

__all__ = ["AccelerationTerms", "Mechanism", "ModeCode", "rate_names"]


@dataclass(frozen=True)
class ModeCode:
    """Code of one contact mode: Newton tangent with residual, and residual alone.

    correction, solution : the tangent with its factors and what solves with these (see `programs.correction`), or None
    given_rows : rows that depend on `rows`; their multipliers are given and act
    order : in which the matrices of many unknowns are eliminated (see `orders`), or None
    """

    rows: tuple[int, ...]
    penalties: tuple[int, ...]
    sliding: tuple[int, ...]
    tangent: Any
    residual: Any
    correction: Any = None
    solution: Any = None
    given_rows: tuple[int, ...] = ()
    order: Any = None


@dataclass(frozen=True)
class AccelerationTerms:
    """The parts of ``M a + f + R λ = 0``, ``h``, ``ḣ``, ``ḧ = B a + bias`` of all rows, and what closing contacts hold.

    M (n, n), f (n,), R (n, n_rows), B (n_rows, n), h, rate, bias (n_rows,), captured (n_anchors,), kinetic [J],
    limits (n_frictions,) largest frictions [N, N m].
    """

    M: Vector
    f: Vector
    R: Vector
    B: Vector
    h: Vector
    rate: Vector
    bias: Vector
    captured: Vector
    kinetic: float
    limits: Vector


class Mechanism:
    """The programs of a set of equations in one backend.

    Common programs (accelerations, guards, magnitudes) are made at once; those of a contact mode
    the first time that mode occurs. Parameters stay run-time inputs.
    """

    def __init__(self, equations: Equations, backend: str = "auto") -> None:
        started = perf_counter()
        self.equations = equations
        self.backend: Backend = choose_backend(backend)
        common = {"accelerations": programs.accelerations(equations), "guards": programs.guards(equations)}
        composed = programs.compose(equations)
        if composed is not None:
            common["compose"] = composed
            common["increment_rates"] = programs.increment_rates(equations)
        self.layout = Layout.of(equations)
        self._accelerations = common["accelerations"]
        self.common: Functions = self.backend.functions(self.layout)
        self.common.add(common)
        if composed is not None:
            self.common.add({"chart_end": chart_end(equations), "chart_motion": chart_motion(equations)}, rarely=True)
        self.common.add({"scales": programs.scales(equations)}, rarely=True)  # twice a restart, and nowhere else
        self.judged = programs.is_judged(equations)
        if self.judged:
            self.common.add({"terms": programs.guard_terms(equations)}, rarely=True)
        self.vector = composed is None
        self.named: dict[str, Any] = {}
        self.notes: list[str] = []
        self.postponed: list[Postponed] = []
        self.without_effect: frozenset[str] = frozenset()
        self._modes: dict[tuple[Any, ...], ModeCode] = {}
        equations.memory["mechanism"] = ref(self)
        self.seconds = perf_counter() - started

    def mode(
        self,
        rows: Sequence[int],
        penalties: Sequence[int],
        stabilized: bool,
        sliding: Sequence[int] = (),
        given_rows: Sequence[int] = (),
    ) -> ModeCode:
        """Code of the mode with these rows, penalty contacts and sliding frictions, made on first use.

        given_rows : rows that depend on those, with given multipliers
        """
        key = (tuple(rows), tuple(penalties), tuple(sliding), tuple(given_rows), stabilized)
        with self.equations.tape.lock:  # runs in other threads share this mechanism
            if key not in self._modes:
                require_room_for_tangent(len(self.equations.tape.nodes))
                started = perf_counter()
                outputs = programs.newton(self.equations, rows, penalties, stabilized, sliding, given_rows)
                order = self._order(outputs, key[0])
                self.seconds += perf_counter() - started
                tangent, residual = self._add(
                    key, len(self._modes), tangent=lambda *_: outputs, residual=programs.residual
                )
                self._modes[key] = ModeCode(key[0], key[1], key[2], tangent, residual, given_rows=key[3], order=order)
            return self._modes[key]

    def stepping(
        self,
        rows: Sequence[int],
        penalties: Sequence[int],
        stabilized: bool,
        sliding: Sequence[int] = (),
        given_rows: Sequence[int] = (),
    ) -> ModeCode:
        """The same for the compiled kernel: with factors in straight-line code where that pays and no row is `given`.

        The tangent as a matrix is then needed only where a pivot of these is too small; it is made the first time.
        """
        if given_rows:
            return self.mode(rows, penalties, stabilized, sliding, given_rows)
        mode = (tuple(rows), tuple(penalties), tuple(sliding), (), stabilized)
        key = (*mode, "stepping")
        with self.equations.tape.lock:
            if key not in self._modes:
                self._modes[key] = self._straight(mode) or self.mode(rows, penalties, stabilized, sliding)
            return self._modes[key]

    def explicit(
        self,
        rows: Sequence[int],
        penalties: Sequence[int],
        stabilized: bool,
        sliding: Sequence[int] = (),
        given_rows: Sequence[int] = (),
    ) -> ModeCode:
        """The same for steps that ask for accelerations alone: tangent and residual are made if somebody calls them."""
        mode = (tuple(rows), tuple(penalties), tuple(sliding), tuple(given_rows), stabilized)
        key = (*mode, "explicit")
        with self.equations.tape.lock:
            if key not in self._modes:
                started, number, n, m = perf_counter(), len(self._modes), self.layout.n, len(rows)
                tail = n + (2 if stabilized else 1) * m
                size = (n + m) ** 2 + tail + (m * self.layout.n_v if stabilized else 0)
                tangent = self._later(mode, number, size, tangent=self._newton)
                residual = self._later(mode, number, tail, residual=programs.residual)
                order = None
                pays = may_pay(self._accelerations, n, self.layout.n_rows, sorted(rows))
                if pays and not tangent_refused(len(self.equations.tape.nodes)):  # whose pattern is that of both
                    outputs = programs.newton(self.equations, rows, penalties, stabilized, sliding, given_rows)
                    order = self._order(outputs, rows)
                self._modes[key] = ModeCode(*mode[:3], tangent, residual, given_rows=mode[3], order=order)
                self.seconds += perf_counter() - started
            return self._modes[key]

    def _straight(self, mode: Any) -> ModeCode | None:
        """A mode with factors, None where they do not pay."""
        require_room_for_tangent(len(self.equations.tape.nodes))
        started, number = perf_counter(), len(self._modes)
        rows, penalties, sliding, _, stabilized = mode
        found = programs.correction(self.equations, rows, penalties, stabilized, sliding)
        self.seconds += perf_counter() - started
        if found is None:
            return None
        outputs, solution = found.outputs, found.solution
        residual, first, again = self._add(
            mode, number, residual=programs.residual, correction=lambda *_: outputs, solution=lambda *_: solution
        )
        size = (self.layout.n + len(rows)) ** 2 + found.tail
        tangent = self._later(mode, number, size, tangent=self._newton)
        return ModeCode(rows, penalties, sliding, tangent, residual, first, again)

    def _newton(self, equations: Equations, *mode: Any) -> Sequence[Node]:
        """`programs.newton` within a run, which ends in order where it does not fit into the memory that is free."""
        refused = tangent_refused(len(equations.tape.nodes))
        if refused:
            raise MemoryLimitError(f"a step needs the tangent as a matrix: {refused}")
        return programs.newton(equations, *mode)

    def _later(self, mode: Any, number: int, size: int, **maker: Callable[..., Sequence[Node]]) -> Postponed:
        """A program of a mode, of so many outputs, that is compiled when it is called first."""
        later = Postponed(lambda: self._add(mode, number, **maker)[0], size)
        self.postponed.append(later)
        return later

    def _order(self, tangent: Sequence[Node], rows: Sequence[int]) -> Any:
        """The order in which the matrices of these rows are eliminated, None where it does not pay."""
        return elimination_order(tangent, self._accelerations, self.layout.n, self.layout.n_rows, sorted(rows))

    def _add(self, mode: Any, number: int, **makers: Callable[..., Sequence[Node]]) -> list[Function]:
        """Compile programs of a mode (rows, penalties, frictions, given rows, form), with its number in their names."""
        rows, penalties, sliding, given_rows, stabilized = mode
        with self.equations.tape.lock:
            started = perf_counter()
            names = {f"{name}_{number}": make for name, make in makers.items()}
            self.common.add(
                {
                    name: make(self.equations, rows, penalties, stabilized, sliding, given_rows)
                    for name, make in names.items()
                }
            )
            self.seconds += perf_counter() - started
            return [self.common[name] for name in names]

    @cached_property
    def energies(self) -> ArrayFunction:
        """T and V [J] at many states at once."""
        with self.equations.tape.lock:
            return array_function([self.equations.kinetic, self.equations.potential])

    @property
    def modes(self) -> int:
        """How many contact modes have code."""
        return len(self._modes)

    def parameters(
        self, values: Mapping[str, float] | None = None, folded: Mapping[str, float] | None = None
    ) -> Vector:
        """The parameter vector, with some values replaced by name; tables follow.

        A value equal to the one that `folded` gives for its name is already part of the equations; parameters
        `without_effect`, such as the rest of a spring of stiffness 0, are in no equation.

        Raises
        ------
        UnknownNameError
            for a name that is not a run-time parameter, with the nearest one.
        """
        names = [parameter.name for parameter in self.equations.parameters]
        p = [parameter.value for parameter in self.equations.parameters]
        for name, value in (values or {}).items():
            if name in self.without_effect or (name not in names and (folded or {}).get(name) == value):
                continue
            if name not in names:
                raise UnknownNameError(nearest(name, {*names, *(folded or {})}, "parameter", "There are"))
            p[names.index(name)] = float(value)
        for table in self.equations.tables:
            p += table.flat
        return np.array(p, dtype=float)

    def block(self, t: float, q: Vector, y: Vector, anchors: Vector, penalties: Sequence[int] = ()) -> Vector:
        """The block of inputs at a state, without accelerations and multipliers."""
        layout = self.layout
        block = np.zeros(layout.size)
        block[0] = t
        block[layout.q : layout.x] = q
        block[layout.v : layout.a] = y
        if len(anchors):
            block[layout.anchor : layout.switch] = anchors
        for contact in penalties:
            block[layout.switch + contact] = 1.0
        return block

    def acceleration_terms(
        self,
        t: float,
        q: Vector,
        y: Vector,
        parameters: Vector,
        anchors: Vector,
        penalties: Sequence[int] = (),
        slips: Vector | None = None,
        lam: Vector | None = None,
    ) -> AccelerationTerms:
        """M, f, R, B, h, ḣ, bias at a state; R follows multipliers `lam` where frictions slide (signs `slips`)."""
        layout = self.layout
        block = self.block(t, q, y, anchors, penalties)
        if slips is not None:
            block[layout.slip : layout.shift] = slips
        if lam is not None:
            block[layout.lam : layout.anchor] = lam
        return self.terms_of(block, parameters)

    def terms_of(self, block: Vector, parameters: Vector) -> AccelerationTerms:
        """The same at the inputs in a block; its accelerations and multipliers enter no more than R and the limits."""
        layout = self.layout
        n, rows = layout.n, layout.n_rows
        out = np.zeros(self.sizes["accelerations"])
        self.common["accelerations"](block, parameters, out)
        lengths = (n * n, n, n * rows, rows * n, rows, rows, rows, layout.n_anchors, 1)
        starts = list(accumulate(lengths, initial=0))
        M, f, R, B, h, rate, bias, captured, kinetic = (out[a:b] for a, b in pairwise(starts))
        limits = out[starts[-1] :]
        return AccelerationTerms(
            M.reshape(n, n), f, R.reshape(n, rows), B.reshape(rows, n), h, rate, bias, captured, float(kinetic[0]),
            limits,
        )  # fmt: skip

    @property
    def sizes(self) -> dict[str, int]:
        """Length of the output of each common program."""
        layout = self.layout
        n, rows = layout.n, layout.n_rows
        return {
            "accelerations": n * n + n + 2 * n * rows + 3 * rows + layout.n_anchors + 1 + layout.n_frictions,
            "guards": 4 * layout.n_contacts + 2 * len(self.equations.guards) + 3 * layout.n_frictions,
            "scales": n + 2 * rows,
            "compose": layout.n_q,
            "increment_rates": layout.n_v,
            "chart_end": 3 * layout.n_v,
            "chart_motion": 2 * layout.n_v,
        }


def rate_names(equations: Equations) -> dict[str, int]:
    """Every spelling of a velocity: 'left hip.angle.rate' and, for a joint of one coordinate, 'left hip.rate'."""
    names = {name: k for k, name in enumerate(equations.velocity_names)}
    owners: dict[str, list[int]] = {}
    for name, k in list(names.items()):
        base = name.removesuffix(".rate")
        names.setdefault(base, k)
        owners.setdefault(base.rpartition(".")[0], []).append(k)
    for owner, places in owners.items():
        if owner and len(places) == 1:
            names.setdefault(f"{owner}.rate", places[0])
    return names
