"""The pass: from the start over every step and event of a run to its end, with the derivatives of its numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.equations.switching_times import instant_slopes
from mbd.integrators import RadauIIA
from mbd.integrators.family import NewmarkFamily
from mbd.integrators.runge_kutta import ExplicitRungeKutta
from mbd.results.record import EventRecord
from mbd.sensitivity.balance import consistent_rates, independent, pushed
from mbd.sensitivity.guards import Trigger, shift_of_end, trigger
from mbd.sensitivity.motion import Mode, Motion, Rates, Tangent
from mbd.sensitivity.newmark_rows import NewmarkRows
from mbd.sensitivity.one_sided import refuse_sided_end, refuse_sided_start
from mbd.sensitivity.passed import Instant, Passed
from mbd.sensitivity.programs import Programs, paired
from mbd.sensitivity.radau import RadauSteps
from mbd.sensitivity.resets import after_reset
from mbd.sensitivity.run_data import RunRows, refused, sided, unknown
from mbd.sensitivity.runge_kutta import RungeKuttaSteps
from mbd.sensitivity.schemes import Memory, SchemeSteps, is_at
from mbd.sensitivity.strikes import captured, struck
from mbd.sensitivity.transitions import with_transitions
from mbd.sensitivity.watching import Watching

__all__ = ["Walk"]


def steps_of(rows: RunRows, programs: Programs) -> SchemeSteps:
    """The derivatives of the steps of the run's scheme.

    Raises
    ------
    CapabilityError
        for a scheme whose steps no pass knows.
    """
    scheme = rows.integrator
    if isinstance(scheme, NewmarkFamily) and scheme.form == "endpoint":
        return NewmarkRows(rows, programs, scheme)
    if isinstance(scheme, ExplicitRungeKutta):
        return RungeKuttaSteps(rows, programs, scheme.tableau)
    if isinstance(scheme, RadauIIA):
        return RadauSteps(rows, programs)
    raise unknown(f"steps of {scheme!r} are not differentiated", "take RungeKutta853(), RadauIIA() or HHT()")


class Walk:
    """The pass over one run.

    Parameters
    ----------
    rows : the run
    programs : for the parameters that are differentiated by
    restitutions : rates (D,) of the restitutions of contacts, by name
    """

    def __init__(self, rows: RunRows, programs: Programs, restitutions: Mapping[str, Vector] | None = None) -> None:
        self.rows, self.programs, self.restitutions = rows, programs, restitutions or {}
        settings = rows.record.settings
        if settings.get("contact") == "nonsmooth":
            raise unknown("its contacts were treated by non-smooth steps", "take contact='events'")
        if settings.get("store", 1) != 1:
            raise unknown(f"it kept one row in {settings['store']}", "take store=1")
        if np.any(np.abs(rows.record.phase[:, paired(programs.equations)]) == 1):
            raise unknown("a contact slides in a plane in space", "take backend='auto' with llvmlite")
        self.record = rows.record
        self._modes: dict[tuple[Any, ...], Mode] = {}
        self.steps = steps_of(rows, programs)
        self._watching = Watching(rows, programs, self.steps)
        self._written = dict(rows.changes)
        self.visit: Callable[[int, Motion, Mode, Rates], None] | None = None
        """Called with every row that a step starts from, and what the pass knows there."""

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
            float(rows.ends[0]), np.array(record.q[0]), rows.y[0].copy(), rows.start_anchors(), tangent
        )  # fmt: skip
        self._take_written(0)
        mode = self.mode(0, motion)
        found, row, last, looked = list[Instant](), 0, len(record.time) - 1, set[int]()
        motion, mode, rates, memory = self._started(motion, mode, 0)
        refuse_sided_start(rows, self.programs, motion, mode, rates)
        fresh = True
        while row < last:
            if self.visit is not None:
                self.visit(row, motion, mode, rates if fresh else memory.rates)
            same = record.time[row + 1] == record.time[row]
            if same and (row + 1 in rows.events or (fresh and row + 2 in rows.events)):
                fired = rows.events[row + 1 if row + 1 in rows.events else row + 2][0].name
                raise sided(
                    f"{fired!r} happens at t = {record.time[row]:.9g} s right after another event or the start, "
                    "with no time between"
                )
            if same and row + 2 not in rows.events:
                motion = replace(self._moved_with_jump(motion, row), t=float(record.time[row + 1]))
                row, fresh = row + 1, True  # a boundary in time, where the scheme starts again
                self._take_written(row)
                motion, mode, rates, memory = self._started(motion, self.mode(row, motion), row)
                continue
            if self.visit is None and not rows.begins_late(motion.t, row):
                before, far = row, self._watching.unwatched(mode, row, rows.segment_end(row) - 1)
                row, motion, memory = self.steps.leap(motion, memory, mode, row, far)
                fresh = fresh and row == before
            if row not in looked:
                looked.add(row)
                begun = self._watching.begins(motion, memory, mode, row)
                if begun is not None:
                    motion, memory, rates = begun
                    fresh = True
            if row + 2 <= last + 1 and row + 2 in rows.events:
                instant = self._event(motion, memory, mode, row + 1)
                found.append(instant)
                row, motion, fresh = row + 2, instant.after, True
                self._take_written(row)
                motion, mode, rates, memory = self._started(motion, self.mode(row, motion), row)
                continue
            dh = -motion.tangent.t if rows.is_fixed(row + 1) else np.zeros_like(motion.tangent.t)
            motion, memory = self.steps.along(motion, memory, mode, row + 1, dh, fresh)
            row, fresh = row + 1, False
        if self._written:
            raise unknown(f"a controller wrote parameters at t = {record.time[min(self._written)]:.9g} s within a step")
        rates = rates if fresh else memory.rates
        refuse_sided_end(rows, self.programs, motion, mode, rates, [(each.fired.name, each.before) for each in found])
        return Passed(motion, mode, rates, found)

    def _moved_with_jump(self, motion: Motion, row: int) -> Motion:
        """The motion behind an instant T(p) at which forces jump: ``δy⁺ = δy⁻ + (ẏ⁻ − ẏ⁺) δT`` at a fixed time."""
        rows, p = self.rows, motion.tangent.p
        if not self.programs.places:
            return motion
        slopes = instant_slopes(
            self.programs.equations, self.programs.values, float(motion.t), rows.full, self.programs.places
        )
        if not len(slopes) or not any(slope.any() for slope in slopes):
            return motion
        if len(slopes) > 1:
            raise refused(
                f"forces jump at t = {motion.t:.9g} s for several reasons, whose instants parameters move apart: the "
                "run has a derivative on one side only"
            )
        change = rows.rate[row] - rows.rate[row + 1]
        return motion.with_tangent(y=motion.tangent.y + np.outer(change, slopes[0] @ p))

    def _take_written(self, row: int) -> None:
        """From a row on, take the parameters that controllers wrote there, which are held as they are."""
        values = self._written.pop(row, None)
        if values is not None:
            self.programs.values = values

    def _started(self, motion: Motion, mode: Mode, row: int) -> tuple[Motion, Mode, Rates, Memory]:
        """The scheme from a row on, with what acts there."""
        rates = self._restarted(motion, mode, row)
        return motion, mode, rates, self.steps.start(motion, mode, rates)

    def _restarted(self, motion: Motion, mode: Mode, row: int) -> Rates:
        """Consistent rates at a row, which are those that it holds."""
        c = self.programs.columns
        none = np.zeros((c.n, len(motion.tangent.t))), np.zeros((c.rows, len(motion.tangent.t)))
        guess = Rates(self.rows.rate[row].copy(), np.array(self.record.lam[row]), *none)
        found = consistent_rates(self.programs, motion, mode, guess)
        size = float(np.max(np.abs(guess.rate), initial=1e-300))
        off = np.max(np.abs(found.rate - guess.rate), initial=0.0)
        if not off <= 1e-6 * size and not off <= 1e-6 * pushed(self.programs, motion, mode, found):
            raise refused(
                f"accelerations at t = {motion.t:.9g} s are not those of the rows that act there",
                "a start that goes on from another run keeps its memory: give it without, by "
                "dataclasses.replace(start, memory=None)",
            )
        return found

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
        end, rates = self.steps.ended(wide, memory.widened(), mode, row, dh)
        gaps, slopes = self.programs.watched(end.at(mode, rates.rate, rates.lam))
        gap_rates = (slopes @ end.tangent.stacked(self.programs.columns))[:n_c, -1]
        fired = trigger(equations, events, gaps, gap_rates, mode.slip, end.t)
        slowest = float(self.record.settings.get("rest_speed", 1e-6))
        along = shift_of_end(self.programs, end, mode, rates, fired, slowest)
        before = replace(end, tangent=end.tangent.combined(along))
        return Instant(row + 1, fired, before, self._after(before, mode, fired, row + 1, rates))

    def _after(self, before: Motion, mode: Mode, fired: Trigger, row: int, rates: Rates) -> Motion:
        """The state after an event: impact, what contacts hold from now on."""
        equations, events = self.programs.equations, self.rows.events[row]
        sets = {guard.name for guard in equations.guards if guard.transition is not None and guard.reset is not None}
        if late := [event.name for event in events if event.kind == "event" and event.name in sets]:
            raise unknown(f"{late[0]!r} sets values beside what it happens with, at t = {before.t:.9g} s")
        later = self.rows.mode(row)
        fresh = [c for c in range(len(equations.contacts)) if later.closed[c] and not mode.closed[c]]
        rigid = [c for c in fresh if equations.contacts[c].kind != "penalty"]
        closing = fired.kind == "closed" and equations.contacts[fired.number].kind != "penalty"
        motion = before
        if closing:
            striking = captured(self.programs, before, mode, self._held_in_impact(events, mode))
            motion = struck(self.rows, self.programs, striking, mode, events, row, fired.number, self.restitutions)
        elif fired.kind == "event" and equations.guards[fired.number].reset is not None:
            row_after = np.array(self.record.q[row]), self.rows.y[row]
            there = consistent_rates(self.programs, before, mode, rates)
            motion = after_reset(self.programs, before, mode, there, fired.number, row_after)
        if not is_at(self.rows, motion, row):
            raise unknown(f"the state after {fired.name!r} at t = {before.t:.9g} s is not the one that was expected")
        gripped = {
            row.contact for k, row in enumerate(equations.rows)
            if row.friction >= 0 and row.contact >= 0 and k in later.held and k not in mode.held
        }  # fmt: skip
        held = captured(self.programs, before, mode, sorted({*rigid, *gripped}))
        motion = replace(motion, anchors=held.anchors).with_tangent(anchors=held.tangent.anchors)
        soft = [c for c in fresh if equations.contacts[c].kind == "penalty"]
        return with_transitions(self.programs, captured(self.programs, motion, mode, soft), mode, events)

    def _held_in_impact(self, events: Sequence[EventRecord], mode: Mode) -> list[int]:
        """Contacts whose tangents an impact takes where they are: those that close, and those that slide."""
        equations = self.programs.equations
        closing = {event.name for event in events if event.kind == "closed"}
        sliding = {each.contact for f, each in enumerate(equations.frictions) if mode.slip[f] != 0.0}
        return [
            c for c, contact in enumerate(equations.contacts)
            if contact.kind != "penalty" and (contact.name in closing or (c in sliding and mode.closed[c]))
        ]  # fmt: skip
