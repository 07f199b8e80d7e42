"""Steps that a run shortens where the velocity γ of a contact that slides in a plane turns fast, or is nearly zero.

Such a step has the size ``h = ½ ‖γ‖/‖γ̇‖`` at its start (`mbd.kernel.cone_steps`), which depends on the state as all
else does; the step after it ends on the grid again, which begins at the last restart.
"""

from __future__ import annotations

import numpy as np

from mbd.arrays import Vector
from mbd.kernel.cone_steps import PART
from mbd.results.stored_states import StoredStates
from mbd.sensitivity.held_directions import first_of_pair
from mbd.sensitivity.motion import Mode, Motion, Rates
from mbd.sensitivity.programs import Programs, paired
from mbd.sensitivity.run_data import RunRows

__all__ = ["Shortened"]

SAME = 1e-9
"""Difference of a step from that size, over it, that is round-off [-]."""


class Shortened:
    """The steps of a run that were shortened.

    pairs : by the row at which such a step begins, the frictions (both directions) whose γ gave its size
    rows : those at which they begin, and at which the step after them does
    """

    def __init__(self, rows: RunRows, programs: Programs) -> None:
        self.programs, self.pairs = programs, dict[int, tuple[int, int]]()
        record, equations = rows.record, programs.equations
        first = [f for f in paired(equations) if first_of_pair(equations, f) == f]
        if not first or rows.is_adaptive:
            first = []
        states, steps = StoredStates(record, equations), np.diff(record.time)
        for f in first:
            both = f, equations.frictions[f].partner
            nodes = [equations.frictions[k].rate for k in both] + [equations.frictions[k].change for k in both]
            x, y, ax, ay = (each[:-1] for each in states.evaluate(nodes, states.rows))
            slides = (np.abs(record.phase[:-1, f]) == 1) & (np.hypot(ax, ay) > 0.0)
            size = PART * np.hypot(x, y) / np.where(slides, np.hypot(ax, ay), 1.0)
            for row in np.flatnonzero(slides & (np.abs(steps - size) <= SAME * size)):
                self.pairs[int(row)] = both
        self.rows = np.array(sorted({*self.pairs, *(row + 1 for row in self.pairs)}), dtype=np.intp)

    def next_row(self, row: int, last: int) -> int:
        """The last row up to which even steps go from a row."""
        later = self.rows[np.searchsorted(self.rows, row) :]
        return min(last, int(later[0])) if len(later) else last

    def size(self, row: int, motion: Motion, mode: Mode, rates: Rates) -> Vector:
        """Derivatives (D,) of the size of the step that begins at a row."""
        programs, own = self.programs, list(self.pairs[row])
        equations, at = programs.equations, motion.at(mode, rates.rate, rates.lam)
        Z = motion.tangent.stacked(programs.columns, rates.of_rate, rates.of_lam)
        values, slopes = programs.watched(at)
        places = [2 * len(equations.contacts) + len(equations.guards) + k for k in own]
        speeds, of_speeds = values[places], slopes[places] @ Z
        nodes = [equations.frictions[k].change for k in own]
        of_growth = programs.derivatives_of(f"changes {own}", nodes, at) @ Z
        c, flow = programs.columns, np.zeros(programs.columns.count)
        flow[c.x], flow[c.y], flow[c.t] = motion.y[: c.n_v], rates.rate, 1.0
        growth = slopes[places] @ flow
        speed, change = float(np.hypot(*speeds)), float(np.hypot(*growth))
        relative = speeds @ of_speeds / speed**2 - growth @ of_growth / change**2
        return np.asarray(PART * speed / change * relative)
