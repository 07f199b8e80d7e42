"""Rows of a run by the Newmark family: which step each is the end of, and what the scheme remembers there.

Runs store neither auxiliary accelerations nor every start of the scheme. Both are found again and held against the
velocities of the rows: what does not agree with them to round-off is refused.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from mbd.arrays import Vector
from mbd.integrators.family import NewmarkFamily
from mbd.sensitivity.balance import consistent_rates, on_rows
from mbd.sensitivity.motion import Mode, Motion, Rates
from mbd.sensitivity.newmark import NewmarkSteps
from mbd.sensitivity.newmark_kernel import ended, taken
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.run_data import Rows, RunRows, unknown
from mbd.sensitivity.schemes import Memory, SchemeSteps, is_at

__all__ = ["NewmarkRows"]

GROWTH = 2.0
"""Size of a step over that of the last one, up to which what it extrapolates from that is known [-]."""
ITERATED = 3e-8
"""Distance of a row from the end of its step, solved for again, that Newton's method leaves of several steps [-]."""


def after_size(memory: Memory, h: float, dh: Vector) -> Memory:
    """What a scheme remembers after a step whose size has the derivatives dh (D,), before one of the size h.

    It begins with ``a₀ = v̇₀ + s (a − v̇₀)`` and predicts ``U = s³ (U₀ + s ΔU₀)``, s = h/step: derivatives of a and ΔU₀
    take the part of that of the step, which a memory does not have.
    """
    part = (memory.aux - memory.rates.rate) / memory.step
    after = replace(memory, of_aux=memory.of_aux - part[:, np.newaxis] * dh)
    if memory.of_change is None or memory.shift is None or memory.shift_change is None or h <= 0.0:
        return after
    growth = 3.0 * memory.shift / h + 4.0 * memory.shift_change / memory.step
    return replace(after, of_change=memory.of_change - growth[:, np.newaxis] * dh)


class NewmarkRows(SchemeSteps):
    """Derivatives of the steps of a run by the Newmark family."""

    def __init__(self, rows: RunRows, programs: Programs, scheme: NewmarkFamily) -> None:
        super().__init__(rows, programs)
        self.stabilized = bool(scheme.stabilized)
        self.driven = bool(rows.record.settings.get("driven"))
        self.steps = NewmarkSteps(programs, scheme.numbers(), self.stabilized, rows.full)

    def start(self, motion: Motion, mode: Mode, rates: Rates) -> Memory:
        """With the jerk of a difference of accelerations."""
        return self.steps.start(motion, mode, rates)

    def leap(self, motion: Motion, memory: Memory, mode: Mode, first: int, last: int) -> tuple[int, Motion, Memory]:
        """All of them at once."""
        if last <= first:
            return first, motion, memory
        still = np.zeros_like(motion.tangent.t)
        done, motion, memory = taken(self.steps, motion, memory, mode, self.rows.between(first, last), still)
        return first + done, motion, memory

    def along(
        self, motion: Motion, memory: Memory, mode: Mode, row: int, dh: Vector, fresh: bool
    ) -> tuple[Motion, Memory]:
        """A step to a row, from what the scheme remembers or from a start that the run does not store."""
        h = float(self.rows.ends[row]) - motion.t
        rate, y = self.rows.rate[row], self.rows.y[row]
        if self.driven and mode.rows:
            return self._balanced(motion, memory, mode, row, dh, fresh)
        if not self.steps.follows(motion, memory, h, y, rate):
            other = self._other_start(motion, memory, mode, h, row, fresh)
            if other is None:
                return self._uneven(motion, memory, mode, row, dh)
            memory = other
        rows = self.rows.step_to(row, motion, memory.rates)
        end, after = self._step(motion, memory, mode, rows, dh)
        ahead = self.rows.ends[row + 1 :]
        if not len(ahead) or not (np.any(dh) or self.rows.is_fixed(row)):
            return end, after
        if self.rows.is_fixed(row):
            self._check_growth(end.t, h, float(ahead[0]) - end.t, mode)
        return end, after_size(after, float(ahead[0]) - end.t, dh)

    def _check_growth(self, time: float, h: float, following: float, mode: Mode) -> None:
        """Refuse a step much longer than one that a sample cut, from which position corrections are extrapolated."""
        if self.stabilized and mode.rows and following > GROWTH * h:
            raise unknown(
                f"the sample at t = {time:.9g} s, at which nothing was written, cut a step to less than half of the "
                "next one: of position corrections that are extrapolated so far derivatives lose their digits",
                "take mbd.RungeKutta853() or mbd.RadauIIA(), or mbd.HHT(formulation='index3')",
            )

    def _step(self, motion: Motion, memory: Memory, mode: Mode, rows: Rows, dh: Vector) -> tuple[Motion, Memory]:
        """A step between two rows."""
        done, end, after = taken(self.steps, motion, memory, mode, rows, dh)
        if not done:
            raise unknown(f"the equations of the step to t = {float(rows[0][1]):.9g} s are singular")
        return end, after

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

    def _balanced(
        self, motion: Motion, memory: Memory, mode: Mode, row: int, dh: Vector, fresh: bool
    ) -> tuple[Motion, Memory]:
        """A step solved for again, whose end has the rates and multipliers of the balance (`schemes.newmark`)."""
        time = float(self.rows.record.time[row])
        guess = self._near(row)
        tries = [memory]
        if not fresh and not self.steps.is_brief(time - motion.t, mode):
            tries.append(self.steps.start(motion, mode, consistent_rates(self.programs, motion, mode, memory.rates)))
        for each in tries:
            rows = ended(self.steps, motion, each, mode, time, guess)
            if rows is not None:
                end, after = self._step(motion, each, mode, rows, dh)
                if is_at(self.rows, end, row, ITERATED):
                    end = replace(end, q=self.rows.record.q[row].copy(), y=self.rows.y[row].copy())
                    return end, self._with_balance(each, end, after, mode, dh)
        return self._uneven(motion, memory, mode, row, dh)

    def _near(self, row: int) -> Rates:
        """Rates and multipliers of a row, without derivatives."""
        return Rates(self.rows.rate[row].copy(), np.array(self.rows.record.lam[row]), *(np.zeros((0, 0)),) * 2)

    def _with_balance(self, before: Memory, end: Motion, after: Memory, mode: Mode, dh: Vector) -> Memory:
        """What the scheme remembers of a step where rates and multipliers of the balance take the place of its own."""
        own, last, h = after.rates, before.rates, after.step
        rates = consistent_rates(self.programs, end, mode, own)
        share = (1.0 - self.steps.alpha_f) / (1.0 - self.steps.alpha_m)
        aux, of_aux = after.aux + share * (rates.rate - own.rate), after.of_aux + share * (rates.of_rate - own.of_rate)
        found = replace(after, rates=rates, aux=aux, of_aux=of_aux)
        if after.of_slope is None:
            return found
        slope, lam_slope = (rates.rate - last.rate) / h, (rates.lam - last.lam) / h
        of_slope = (rates.of_rate - last.of_rate - slope[:, np.newaxis] * dh) / h
        of_lam_slope = (rates.of_lam - last.of_lam - lam_slope[:, np.newaxis] * dh) / h
        return replace(found, slope=slope, lam_slope=lam_slope, of_slope=of_slope, of_lam_slope=of_lam_slope)

    def _uneven(self, motion: Motion, memory: Memory, mode: Mode, row: int, dh: Vector) -> tuple[Motion, Memory]:
        """A step whose end lost what it had of velocities across the rows, or a brief one; the scheme starts again."""
        end, rates = self.ended(motion, memory, mode, row, dh)
        again = consistent_rates(self.programs, end, mode, rates)
        return end, self.steps.start(end, mode, again)

    def reached(
        self, motion: Motion, memory: Memory, mode: Mode, time: float, dh: Vector, row: int
    ) -> Iterator[tuple[Motion, Rates]]:
        """Solved for, as rows at events hold rates that are consistent in the place of those of the step."""
        steps = self.steps
        brief = steps.is_brief(time - motion.t, mode)
        for way in (brief, not brief):
            if way:
                end, after = steps.brief(motion, memory, mode, time, dh)
            else:
                rows = ended(steps, motion, memory, mode, time, self._near(row))
                if rows is None:
                    continue
                end, after = self._step(motion, memory, mode, rows, dh)
            if not self.stabilized and mode.rows:
                end = on_rows(self.programs, end, mode, end.y, end.tangent.y)
            yield end, after.rates
