"""Derivatives of methods that begin each step from consistent rates and remember nothing else."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator

import numpy as np

from mbd.arrays import Vector
from mbd.sensitivity.motion import Mode, Motion, Rates
from mbd.sensitivity.run_data import Rows, unknown
from mbd.sensitivity.schemes import Memory, SchemeSteps

__all__ = ["OneStepMethod"]


class OneStepMethod(SchemeSteps):
    """Derivatives of the steps of a Runge–Kutta method, explicit or implicit."""

    @abstractmethod
    def taken(
        self, motion: Motion, rates: Rates, mode: Mode, rows: Rows, dh: Vector, checked: bool = True
    ) -> tuple[int, Motion, Rates]:
        """As many of the steps between these rows as the kernel takes from here; the state and rates after them.

        checked : false for one step whose end q, y is not known; rows then get it
        """

    def start(self, motion: Motion, mode: Mode, rates: Rates) -> Memory:
        """It remembers nothing but its rates."""
        return Memory.of_rates(rates, 0.0)

    def leap(self, motion: Motion, memory: Memory, mode: Mode, first: int, last: int) -> tuple[int, Motion, Memory]:
        """All of them at once."""
        if last <= first:
            return first, motion, memory
        still, rows = np.zeros_like(motion.tangent.t), self.rows.between(first, last)
        done, motion, rates = self.taken(motion, memory.rates, mode, rows, still)
        return first + done, motion, Memory.of_rates(rates, 0.0)

    def along(
        self, motion: Motion, memory: Memory, mode: Mode, row: int, dh: Vector, fresh: bool
    ) -> tuple[Motion, Memory]:
        """A step to a row."""
        end, rates = self.ended(motion, memory, mode, row, dh)
        return end, Memory.of_rates(rates, 0.0)

    def ended(self, motion: Motion, memory: Memory, mode: Mode, row: int, dh: Vector) -> tuple[Motion, Rates]:
        """The same at an event."""
        rows = self.rows.step_to(row, motion, memory.rates)
        done, end, rates = self.taken(motion, memory.rates, mode, rows, dh)
        return (end, rates) if done else super().ended(motion, memory, mode, row, dh)

    def reached(
        self, motion: Motion, memory: Memory, mode: Mode, time: float, dh: Vector, row: int
    ) -> Iterator[tuple[Motion, Rates]]:
        """All steps are alike."""
        rows = self.rows.step_to(row, motion, memory.rates)
        rows[0][1] = time
        done, end, found = self.taken(motion, memory.rates, mode, rows, dh, False)
        if not done:
            raise unknown(f"the equations of the step to t = {time:.9g} s are singular")
        yield end, found
