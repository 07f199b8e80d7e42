"""Contacts that begin to be watched within a step, of whose instants the run stores no row."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mbd.arrays import Matrix
from mbd.results.stored_states import StoredStates
from mbd.sensitivity.balance import consistent_rates
from mbd.sensitivity.guards import Trigger, shift_of_end
from mbd.sensitivity.motion import Mode, Motion, Rates
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.run_data import RunRows, refused
from mbd.sensitivity.schemes import Memory, SchemeSteps
from mbd.tape.node import Node

__all__ = ["Watching"]

MOST = 8
"""Newton iterations for an instant of which the run stores no row [-]."""


@dataclass
class Watching:
    """Where conditions of contacts (`only_while`) begin to hold in a run."""

    rows: RunRows
    programs: Programs
    steps: SchemeSteps

    def unwatched(self, mode: Mode, first: int, last: int) -> int:
        """The last row up to which no open contact begins to be watched between rows."""
        values, closed = self.measures[first : last + 1], np.asarray(mode.closed) != 0
        begins = (values[:-1] <= 0.0) & (values[1:] > 0.0)
        begins[:, closed] = False
        found = np.flatnonzero(begins.any(axis=1))
        return first + int(found[0]) if len(found) else last

    def begins(self, motion: Motion, memory: Memory, mode: Mode, row: int) -> tuple[Motion, Memory, Rates] | None:
        """The start of the scheme where an open contact begins to be watched before the next row; None if none does.

        A step ends at that instant, of which the run stores no row.
        """
        crossed = self.measures[row : row + 2]
        open_now = np.asarray(mode.closed) == 0
        fired = np.flatnonzero(open_now & (crossed[0] <= 0.0) & (crossed[-1] > 0.0))
        if not len(fired):
            return None
        if len(fired) > 1:
            raise refused(f"several contacts begin to be watched in the step from t = {motion.t:.9g} s")
        c = int(fired[0])
        condition = Trigger("watched", c, f"only_while of {self.programs.equations.contacts[c].name}")
        place = len(self.programs.equations.guards) + 2 * len(self.programs.equations.frictions) + c
        place += 2 * len(self.programs.equations.contacts)
        wide = replace(motion, tangent=motion.tangent.widened())
        dh = np.zeros(len(wide.tangent.t))
        dh[-1] = 1.0
        span = float(self.rows.ends[row + 1]) - motion.t
        h = span * float(crossed[0, c] / (crossed[0, c] - crossed[1, c]))
        for _ in range(MOST):
            end, rates = next(self.steps.reached(wide, memory.widened(), mode, motion.t + h, dh, row))
            values, slopes = self.programs.watched(end.at(mode, rates.rate, rates.lam))
            change = float(slopes[place] @ end.tangent.stacked(self.programs.columns)[:, -1])
            step = -float(values[place]) / change
            if abs(step) <= 4e-16 * max(abs(motion.t), span):
                break
            h += step
        along = shift_of_end(self.programs, end, mode, rates, condition, 0.0)
        moved = replace(end, tangent=end.tangent.combined(along))
        fresh = consistent_rates(self.programs, moved, mode, Rates(rates.rate, rates.lam, rates.of_rate, rates.of_lam))
        return moved, self.steps.start(moved, mode, fresh), fresh

    @cached_property
    def measures(self) -> Matrix:
        """Of each contact at each row (R, nC), the measure that must be positive for it to be watched; 1 without."""
        record, contacts = self.rows.record, self.programs.equations.contacts
        nodes = [each.only_while for each in contacts if isinstance(each.only_while, Node)]
        out = np.ones((len(record.time), len(contacts)))
        if nodes:
            states = StoredStates(record, self.programs.equations)
            values = iter(states.evaluate(nodes, states.rows))
            for c, each in enumerate(contacts):
                if isinstance(each.only_while, Node):
                    out[:, c] = next(values)
        return out
