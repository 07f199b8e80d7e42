"""The pass: from the start over every step and event of a run to its end, with the derivatives of its numbers."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.integrators.family import NewmarkFamily
from mbd.sensitivity.balance import consistent_rates, independent, on_rows
from mbd.sensitivity.guards import Trigger, shift_of_end, trigger
from mbd.sensitivity.motion import Mode, Motion, Rates, Tangent
from mbd.sensitivity.newmark import Memory, NewmarkSteps
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.run_data import RunRows, refused
from mbd.sensitivity.strikes import captured, struck

__all__ = ["Instant", "Passed", "Walk"]

SAME = 1e-9
"""Distance of a row from where the pass says that it is, over the size of the state, that is round-off [-]."""


@dataclass(frozen=True)
class Instant:
    """An event with its derivatives: the rows before and after it, and the motions there."""

    row: int
    fired: Trigger
    before: Motion
    after: Motion


@dataclass
class Passed:
    """What the pass has found: the motion and rates at the end, and the events."""

    motion: Motion
    mode: Mode
    rates: Rates
    instants: list[Instant] = field(default_factory=list)


class Walk:
    """The pass over one run.

    Parameters
    ----------
    rows : the run
    programs : for the parameters that are differentiated by
    """

    def __init__(self, rows: RunRows, programs: Programs) -> None:
        self.rows, self.programs = rows, programs
        self.record = rows.record
        self._modes: dict[tuple[Any, ...], Mode] = {}
        scheme = rows.integrator
        if not isinstance(scheme, NewmarkFamily) or scheme.form != "endpoint":
            raise refused(f"steps of {scheme!r} are not differentiated yet", "take HHT, GeneralizedAlpha or Newmark")
        self.stabilized = bool(scheme.stabilized)
        self.steps = NewmarkSteps(programs, scheme.numbers(), self.stabilized, rows.full)

    def mode(self, row: int, motion: Motion) -> Mode:
        """What acts from a row on, with its rows that do not depend on others."""
        raw = self.rows.mode(row)
        key = (raw.held, tuple(raw.closed), tuple(raw.slip))
        if key not in self._modes:
            rate, lam = self.rows.rate[row], np.asarray(self.record.lam[row])
            self._modes[key] = independent(self.programs, motion, raw, rate, lam)
        return self._modes[key]

    def whole(self, tangent: Tangent) -> Passed:
        """From the start with these derivatives to the end of the run."""
        record, rows = self.record, self.rows
        motion = Motion(
            float(record.time[0]), np.array(record.q[0]), rows.y[0].copy(), rows.start_anchors(), tangent
        )  # fmt: skip
        mode = self.mode(0, motion)
        found, row, last = [], 0, len(record.time) - 1
        rates = self._restarted(motion, mode, 0)
        memory = self.steps.start(motion, mode, rates)
        fresh = True
        while row < last:
            if record.time[row + 1] == record.time[row]:
                if row + 1 in rows.events:
                    fired = rows.events[row + 1][0].name
                    raise refused(
                        f"{fired!r} happens at t = {record.time[row]:.9g} s right after another event or the start, "
                        "with no time between: the run has a derivative on one side only"
                    )
                row, fresh = row + 1, True  # a boundary in time, where the scheme starts again
                rates = self._restarted(motion, mode, row)
                memory = self.steps.start(motion, mode, rates)
                continue
            if row + 2 <= last + 1 and row + 2 in rows.events:
                instant = self._event(motion, memory, mode, row + 1)
                found.append(instant)
                row, motion, fresh = row + 2, instant.after, True
                mode = self.mode(row, motion)
                rates = self._restarted(motion, mode, row)
                memory = self.steps.start(motion, mode, rates)
                continue
            fixed = row + 1 == last or record.time[row + 2] == record.time[row + 1]
            motion, memory = self._step(motion, memory, mode, row + 1, fixed, fresh)
            row, fresh = row + 1, False
        return Passed(motion, mode, memory.rates if not fresh else rates, found)

    def _restarted(self, motion: Motion, mode: Mode, row: int) -> Rates:
        """Consistent rates at a row, which are those that it holds."""
        c = self.programs.columns
        none = np.zeros((c.n, len(motion.tangent.t))), np.zeros((c.rows, len(motion.tangent.t)))
        guess = Rates(self.rows.rate[row].copy(), np.array(self.record.lam[row]), *none)
        found = consistent_rates(self.programs, motion, mode, guess)
        size = float(np.max(np.abs(guess.rate), initial=1e-300))
        if not np.max(np.abs(found.rate - guess.rate), initial=0.0) <= 1e-6 * size:
            raise refused(
                f"accelerations at t = {motion.t:.9g} s are not those of the rows that act there",
                "a start that goes on from another run keeps its memory: give it without, by "
                "dataclasses.replace(start, memory=None)",
            )
        return found

    def _step(
        self, motion: Motion, memory: Memory, mode: Mode, row: int, fixed: bool, fresh: bool
    ) -> tuple[Motion, Memory]:
        """A step to a row; `fixed`: at a time of its own, whatever came before; `fresh`: the first after a start."""
        record, time = self.record, float(self.record.time[row])
        h = time - motion.t
        dh = -motion.tangent.t if fixed else np.zeros_like(motion.tangent.t)
        rate, y = self.rows.rate[row], self.rows.y[row]
        if not self.steps.follows(motion, memory, h, y, rate):
            other = self._other_start(motion, memory, mode, h, row, fresh)
            if other is None:
                return self._uneven(motion, memory, mode, row, dh)
            memory = other
        none = np.zeros((0, 0)), np.zeros((0, 0))
        rates = Rates(rate, np.array(record.lam[row]), *none)
        return self.steps.step(motion, memory, mode, (time, np.array(record.q[row]), y), rates, dh)

    def _other_start(
        self, motion: Motion, memory: Memory, mode: Mode, h: float, row: int, fresh: bool
    ) -> Memory | None:
        """The memory of a start that the row is a step from: of another size, or one that was not stored."""
        rate, y, rates = self.rows.rate[row], self.rows.y[row], memory.rates
        tries = [self.steps.start(motion, mode, rates, h)] if fresh else []
        if fresh:
            tries.append(Memory(rates, rates.rate.copy(), rates.of_rate.copy(), self.steps.full))
        else:
            again = consistent_rates(self.programs, motion, mode, rates)
            tries.append(self.steps.start(motion, mode, again))
        return next((each for each in tries if self.steps.follows(motion, each, h, y, rate)), None)

    def _uneven(self, motion: Motion, memory: Memory, mode: Mode, row: int, dh: Vector) -> tuple[Motion, Memory]:
        """A step whose end lost what it had of velocities across the rows, or a brief one; the scheme starts again."""
        end, rates = self._ended(motion, memory, mode, row, dh)
        again = consistent_rates(self.programs, end, mode, rates)
        return end, self.steps.start(end, mode, again)

    def _ended(self, motion: Motion, memory: Memory, mode: Mode, row: int, dh: Vector) -> tuple[Motion, Rates]:
        """The end of a step that the scheme does not go on from as it is: solved for, put on the rows.

        Rates are those of the step itself.
        """
        time, steps = float(self.record.time[row]), self.steps
        brief = steps.is_brief(time - motion.t, mode)
        for way in (brief, not brief):
            if way:
                end, after = steps.brief(motion, memory, mode, time, dh)
                rates = after.rates
            else:
                guess = Rates(self.rows.rate[row].copy(), np.array(self.record.lam[row]), *(np.zeros((0, 0)),) * 2)
                reached, solved = steps.ended(motion, memory, mode, time, guess)
                end, after = steps.step(motion, memory, mode, (time, reached.q, reached.y), solved, dh)
                rates = after.rates
            if not self.stabilized and mode.rows:
                end = on_rows(self.programs, end, mode, end.y, end.tangent.y)
            if self._is_at(end, row):
                return end, rates
        raise refused(
            f"the step to t = {time:.9g} s is not one that the pass knows: it was shortened, or began in a way that "
            "the run does not store"
        )

    def _is_at(self, motion: Motion, row: int) -> bool:
        """Whether a row is where the pass is."""
        q, y = self.record.q[row], self.rows.y[row]
        size = np.max(np.abs(np.concatenate([q, y])), initial=1e-3)
        off = np.max(np.abs(np.concatenate([motion.q - q, motion.y - y])), initial=0.0)
        return bool(off <= SAME * size)

    def _event(self, motion: Motion, memory: Memory, mode: Mode, row: int) -> Instant:
        """The step to an event at a row, the event, and the state after it."""
        events, equations, n_c = (
            self.rows.events[row + 1],
            self.programs.equations,
            len(self.programs.equations.contacts),
        )
        wide = replace(motion, tangent=motion.tangent.widened())
        dh = np.zeros(len(wide.tangent.t))
        dh[-1] = 1.0
        end, rates = self._ended(wide, memory.widened(), mode, row, dh)
        gaps, slopes = self.programs.watched(end.at(mode, rates.rate, rates.lam))
        gap_rates = (slopes @ end.tangent.stacked(self.programs.columns))[:n_c, -1]
        fired = trigger(equations, events, gaps, gap_rates, mode.slip, end.t)
        slowest = float(self.record.settings.get("rest_speed", 1e-6))
        along = shift_of_end(self.programs, end, mode, rates, fired, slowest)
        before = replace(end, tangent=end.tangent.combined(along))
        return Instant(row + 1, fired, before, self._after(before, mode, fired, row + 1))

    def _after(self, before: Motion, mode: Mode, fired: Trigger, row: int) -> Motion:
        """The state after an event: impact, what contacts hold from now on."""
        equations, events = self.programs.equations, self.rows.events[row]
        later = self.rows.mode(row)
        fresh = [c for c in range(len(equations.contacts)) if later.closed[c] and not mode.closed[c]]
        rigid = [c for c in fresh if equations.contacts[c].kind != "penalty"]
        closing = fired.kind == "closed" and equations.contacts[fired.number].kind != "penalty"
        motion = before
        if closing:
            motion, _ = struck(self.rows, self.programs, before, mode, events, row)
        elif fired.kind == "event" and equations.guards[fired.number].reset is not None:
            raise refused(f"the reset of {fired.name!r} is not differentiated yet")
        moved = np.concatenate([motion.q - self.record.q[row], motion.y - self.rows.y[row]])
        size = np.max(np.abs(np.concatenate([motion.q, motion.y])), initial=1e-3)
        if not np.max(np.abs(moved), initial=0.0) <= SAME * size:
            raise refused(f"the state after {fired.name!r} at t = {before.t:.9g} s is not the one that was expected")
        held = captured(self.programs, before, mode, rigid)
        motion = replace(motion, anchors=held.anchors).with_tangent(anchors=held.tangent.anchors)
        soft = [c for c in fresh if equations.contacts[c].kind == "penalty"]
        return captured(self.programs, motion, mode, soft)
