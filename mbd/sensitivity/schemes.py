"""What the derivatives of a scheme's steps are to the pass."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.equal import EQUAL_RTOL
from mbd.sensitivity.motion import Mode, Motion, Rates
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.run_data import RunRows, unknown

__all__ = ["Memory", "SchemeSteps", "is_at"]


@dataclass(frozen=True)
class Memory:
    """What a scheme remembers at a row: rates, auxiliary accelerations a with their derivatives, the last step.

    slope, lam_slope, shift, shift_change : of rates, multipliers, position corrections, which predict the next step
        of the stabilized form, with derivatives of them
    """

    rates: Rates
    aux: Vector
    of_aux: Matrix
    step: float
    slope: Vector | None = None
    lam_slope: Vector | None = None
    shift: Vector | None = None
    shift_change: Vector | None = None
    of_slope: Matrix | None = None
    of_shift: Matrix | None = None
    of_change: Matrix | None = None
    of_lam_slope: Matrix | None = None

    @classmethod
    def of_rates(cls, rates: Rates, step: float) -> Memory:
        """That of rates alone."""
        return cls(rates, rates.rate, rates.of_rate, step)

    def widened(self) -> Memory:
        """With one more direction, in which nothing changes."""

        def wide(part: Matrix) -> Matrix:
            return np.hstack([part, np.zeros((len(part), 1))])

        def kept(part: Matrix | None) -> Matrix | None:
            return None if part is None else wide(part)

        return replace(
            self, rates=self.rates.widened(), of_aux=wide(self.of_aux), of_slope=kept(self.of_slope),
            of_shift=kept(self.of_shift), of_change=kept(self.of_change), of_lam_slope=kept(self.of_lam_slope),
        )  # fmt: skip


class SchemeSteps(ABC):
    """Derivatives of the steps of a run by one scheme."""

    def __init__(self, rows: RunRows, programs: Programs) -> None:
        self.rows, self.programs = rows, programs

    @abstractmethod
    def start(self, motion: Motion, mode: Mode, rates: Rates) -> Memory:
        """The memory of a start from consistent rates."""

    def leap(self, motion: Motion, memory: Memory, mode: Mode, first: int, last: int) -> tuple[int, Motion, Memory]:
        """Many steps whose sizes do not change, from a start at the row `first` on: as far as they are known, not
        beyond the row `last`; the row that was reached."""
        return first, motion, memory

    @abstractmethod
    def along(
        self, motion: Motion, memory: Memory, mode: Mode, row: int, dh: Vector, fresh: bool
    ) -> tuple[Motion, Memory]:
        """A step to a row from which the scheme goes on.

        dh (D,) : derivatives of its size; fresh : whether it is the first after a start

        Raises
        ------
        CapabilityError
            for a row that is not the end of such a step.
        """

    @abstractmethod
    def reached(
        self, motion: Motion, memory: Memory, mode: Mode, time: float, dh: Vector, row: int
    ) -> Iterator[tuple[Motion, Rates]]:
        """A step to any time, with its own rates, as an event takes it over; first the likeliest way to take it.

        row : one that is near
        """

    def ended(self, motion: Motion, memory: Memory, mode: Mode, row: int, dh: Vector) -> tuple[Motion, Rates]:
        """A step to a row at which an event ends it; with the rates of the step itself.

        Raises
        ------
        CapabilityError
            for a row that is not the end of such a step.
        """
        time = float(self.rows.ends[row])
        for end, rates in self.reached(motion, memory, mode, time, dh, row):
            if is_at(self.rows, end, row):
                return end, rates
        raise unknown(
            f"the step to t = {time:.9g} s is not one that the pass knows: it was shortened, or began in a way that "
            "the run does not store"
        )


def is_at(rows: RunRows, motion: Motion, row: int, share: float = EQUAL_RTOL) -> bool:
    """Whether a row is where the pass is."""
    q, y = rows.record.q[row], rows.y[row]
    size = np.max(np.abs(np.concatenate([q, y])), initial=1e-3)
    off = np.max(np.abs(np.concatenate([motion.q - q, motion.y - y])), initial=0.0)
    return bool(off <= share * size)
