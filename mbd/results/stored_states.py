"""The stored states of a run with the model's equations, which evaluate any expression there."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.compile.python import array_function
from mbd.equations.equations import Equations
from mbd.results.interpolation import Grid
from mbd.results.record import Record, Rows
from mbd.results.turning import counted, doubtful, function_of
from mbd.tape.node import Node, Scalar

ONSET, LEAST = 1e-7, 1e-200
"""As in `contact.cones`: how much the direction of λ_T counts beside that of γ, and what stands for none of it."""

END_RTOL = 8.0 * float(np.finfo(float).eps)
"""How far from the time of the next row a step ends that is taken again up to it, over the time [-]."""


class StoredStates:
    """States at the rows of a run, with what contacts and turns hold there."""

    def __init__(self, record: Record, equations: Equations) -> None:
        self.record, self.equations = record, equations
        self.grid = Grid(record.time)

    @property
    def machine(self) -> Any:
        """Layout, common programs and `accelerations` in machine code; None where there is none, as for a file."""
        return getattr(self.equations, "memory", {}).get("machine code")

    @cached_property
    def rows(self) -> Rows:
        """The stored states."""
        return self.record.rows(self.anchors)

    @cached_property
    def _inputs_of_rows(self) -> Mapping[str, NDArray[Any]]:
        """The inputs of expressions at the stored states, which every name that is read is evaluated with."""
        return self.all_inputs(self.rows)

    def part(self, chosen: NDArray[np.intp], nodes: Sequence[Node]) -> Rows:
        """Some of the stored states; what contacts have captured is found only where these expressions need it."""
        from mbd.tape.derivatives import live

        with self.equations.tape.lock:
            needed = any(node.op == "input" and node.data[0] == "anchor" for node in live(nodes))
        anchors = self.anchors[chosen] if needed else np.zeros((len(chosen), self.equations.n_anchors))
        return self.record.part(chosen, anchors)

    @property
    def q_rate(self) -> Matrix:
        """q̇ = ∂(q ⊕ x)/∂x · v at x = 0; v itself where ⊕ is +."""
        compose = self.equations.compose
        if compose is None:
            return self.record.v
        from mbd.tape.derivatives import jvp

        tape = self.equations.tape
        with tape.lock:
            seeds: dict[Node, Scalar] = {tape.input("x", k): tape.input("v", k) for k in range(self.equations.n_v)}
            rates = jvp(compose, seeds)
        return np.column_stack(self.evaluate(rates, self.rows))

    def evaluate_stored(self, nodes: Sequence[Node]) -> list[Vector]:
        """Each expression at each stored row, (R,)."""
        return self.evaluate(nodes, self.rows, self._inputs_of_rows)

    def evaluate(
        self, nodes: Sequence[Node], rows: Rows, inputs: Mapping[str, NDArray[Any]] | None = None
    ) -> list[Vector]:
        """Each expression at each row, (R,); `inputs` are `all_inputs` of these rows where they are known."""
        if not nodes:
            return []
        unique = list({node.index: node for node in nodes}.values())
        inputs = self.all_inputs(rows) if inputs is None else inputs
        values = array_function(unique)(inputs, self.record.parameters_at(rows.source))
        found = {node.index: value for node, value in zip(unique, values, strict=True)}
        return [found[node.index] for node in nodes]

    def all_inputs(self, rows: Rows) -> Mapping[str, NDArray[Any]]:
        """The same, with the way of two directions that slide together: a little along λ_T, as γ is zero at onsets.

        The row before a jump in time has the time before it, and so has the end of a step that is taken again up to it.
        """
        inputs = self.inputs(rows)
        if self.times_beside_jumps is not None:
            known, beside = self.record.time, self.times_beside_jumps
            after = np.minimum(rows.source + 1, len(known) - 1)
            early = known[rows.source] - rows.time  # a little, where somebody asks for the side before the row
            own = (early >= 0.0) & (early <= END_RTOL * np.abs(known[rows.source]))
            ends = ~own & (np.abs(rows.time - known[after]) <= END_RTOL * np.abs(known[after]))
            there = np.where(early > 0.0, np.minimum(rows.time, beside[rows.source]), beside[rows.source])
            time = np.where(own, there, np.where(ends, beside[after], rows.time))
            inputs = {**inputs, "t": time}
        if not any(friction.group for friction in self.equations.frictions):
            return inputs
        slips = inputs["slip"].astype(float)
        for number, friction in enumerate(self.equations.frictions):
            if friction.group:
                pull = rows.lam[:, friction.row]
                every = [self.equations.frictions[each].row for each in friction.group]
                size = np.linalg.norm(rows.lam[:, every], axis=1)
                cosine = np.divide(pull, size, out=np.ones_like(pull), where=size > 0.0)
                slips[:, number] *= ONSET * np.where(np.abs(cosine) < LEAST, LEAST, cosine)
        return {**inputs, "slip": slips}

    @staticmethod
    def inputs(rows: Rows) -> Mapping[str, NDArray[Any]]:
        """The inputs of expressions, at the center of each chart (x = 0)."""
        return {
            "t": rows.time, "q": rows.q, "v": rows.v, "z": rows.z, "a": rows.a, "s": rows.s, "lam": rows.lam,
            "anchor": rows.anchors, "switch": rows.closed, "slip": np.where(np.abs(rows.phase) == 1, rows.phase, 0),
        }  # fmt: skip

    @cached_property
    def times_beside_jumps(self) -> Vector | None:
        """The times of the rows as steps end and begin there; None where the equations never jump in time.

        The first row of an instant at which they do is before the jump, and a run that begins there is behind it.
        """
        from mbd.equations.equations import Equations
        from mbd.equations.switching_times import jumps_between, switches_of

        time, record = self.record.time, self.record
        if not isinstance(self.equations, Equations) or not switches_of(self.equations):
            return None
        again = np.concatenate([[False], time[1:] == time[:-1], [True]])  # a run ends before a jump at its end
        first = np.flatnonzero(again[1:] & ~again[:-1])  # an event at the instant stores more rows, behind the jump
        step = float(time[-1] - time[0]) / len(time)
        found, near = time.copy(), 1e-12 * max(abs(float(time[0])), abs(float(time[-1])))
        for vector in (record.parameters, *(values for _, values in record.parameter_changes)):
            span = float(time[0]) - step, float(time[-1]) + step
            jumps = jumps_between(self.equations, vector, *span, step, highest=0)
            rights, lefts = np.array([jump.right for jump in jumps]), np.array([jump.left for jump in jumps])
            if len(rights) and np.any((lefts <= time[0]) & (time[0] < rights)):
                found[0] = rights[np.argmin(np.abs(rights - time[0]))]
            for row in first if len(rights) else ():
                place = int(np.argmin(np.abs(rights - time[row])))
                if abs(rights[place] - time[row]) <= near:
                    found[row] = min(found[row], lefts[place])
        return found

    def held_by_machines(self) -> Matrix:
        """Of `anchors` those of machines, and turns that were counted before the run; the others are 0."""
        start = self.record.start
        held = np.zeros((len(self.record.time), self.equations.n_anchors))
        counts = [turn.anchor for turn in self.equations.turns]
        if counts and start is not None and len(start.anchors) == held.shape[1]:
            held[:, counts] = start.anchors[counts]
        self._follow_machines(held)
        return held

    @cached_property
    def anchors(self) -> Matrix:
        """What each contact captured where it closed or began to stick, or holds from the start, until it opens."""
        start, wrapped, held = self.record.start, self.equations.wrapped, self.held_by_machines()
        if not held.size:
            return held
        rows = self.record.rows(held)
        for number, contact in enumerate(self.equations.contacts):
            closed = self.record.closed[:, number].astype(bool)
            if not contact.anchors or not closed.any():
                continue
            own = [place for place, friction in enumerate(self.equations.frictions) if friction.contact == number]
            sticks = np.any(self.record.phase[:, own] == 2, axis=1)  # see `Rows`
            fresh = closed.copy()
            fresh[1:] &= ~closed[:-1] | (sticks[1:] & ~sticks[:-1])
            captured = np.column_stack(self.evaluate(contact.captured, rows.part(np.flatnonzero(fresh))))
            if closed[0] and start is not None and contact.name in start.mode.closed:
                captured[0] = start.anchors[list(contact.anchors)]
            held[np.ix_(closed, np.array(contact.anchors))] = captured[np.cumsum(fresh)[closed] - 1]
        for turn, (angle, rate) in zip(wrapped, self._turning(self.record.rows(held)), strict=True):
            held[:, turn.anchor] += counted(self.record.time, angle, rate)
        return held

    def _follow_machines(self, held: Matrix) -> None:
        """Write what machines hold at each row, from the start and from their events."""
        machines, record = self.equations.machines, self.record
        if not machines:
            return
        count = self.equations.n_held_by_machines
        start = record.start
        if start is not None and len(start.anchors) == held.shape[1]:
            held[:, :count] = start.anchors[:count]
        guards = {guard.name: guard.transition for guard in self.equations.guards if guard.transition is not None}
        changes = [
            (event.row, guards[event.name]) for event in record.events
            if event.kind == "event" and event.name in guards and event.row < len(held)
        ]  # fmt: skip
        nodes = {anchor: node for each in machines for anchor, node in zip(each.anchors, each.captured, strict=True)}
        rows = np.array([row for row, _ in changes], dtype=np.intp)
        # before each change and after the last; from `known` on guesses, as what one stores another may read
        states = np.repeat(held[:1, :count], len(changes) + 1, axis=0)
        known, some = 0, len(changes)
        while known < len(changes):
            chosen = slice(known, known + some)
            before = held[rows[chosen]]
            before[:, :count] = states[:-1][chosen]
            stored = sorted({anchor for _, taken in changes[chosen] for anchor in taken.stored})
            values = self.evaluate([nodes[each] for each in stored], record.part(rows[chosen], before))
            captured = dict(zip(stored, values, strict=True))
            found = states[known : known + some + 1].copy()
            for k, (_, taken) in enumerate(changes[chosen]):
                found[k + 1] = found[k]
                for anchor in taken.stored:
                    found[k + 1, anchor] = captured[anchor][k]
                found[k + 1, machines[taken.machine].anchors[0]] = taken.target
            wrong = np.flatnonzero(np.any(found[:-1] != before[:, :count], axis=1))
            states[known : known + some + 1] = found
            known += max(int(wrong[0]), 1) if len(wrong) else some
            some = max(some // 2, 1) if len(wrong) else 2 * some
        held[:, :count] = states[np.searchsorted(rows, np.arange(len(held)), side="right")]

    def _turning(self, rows: Rows) -> list[tuple[Vector, Vector]]:
        """Angle and rate of every cut joint whose turns are counted along the motion."""
        wrapped = self.equations.wrapped
        if not wrapped:
            return []
        found = function_of(wrapped)(self.inputs(rows), self.record.parameters_at(rows.source))
        return list(zip(found[::2], found[1::2], strict=True))

    def doubtful_turns(self) -> list[tuple[str, float]]:
        """(name, time) of angles of cut joints whose turns are a guess from some row on."""
        found = []
        for turn, (angle, rate) in zip(self.equations.wrapped, self._turning(self.rows), strict=True):
            doubts = np.flatnonzero(doubtful(self.record.time, angle, rate))
            if len(doubts):
                found.append((turn.name, float(self.record.time[doubts[0]])))
        return found


def is_smooth(record: Record, plain: bool) -> bool:
    """Whether the scheme is of high order, with accelerations as accurate as positions.

    plain : whether q̇ = v, or charts are known in which positions are interpolated
    """
    return plain and record.extension.uses_accelerations
