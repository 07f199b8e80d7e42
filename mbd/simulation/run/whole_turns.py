"""Whole turns of cut joints in space at the accepted state of a run, for the states that it hands over."""

from __future__ import annotations

import numpy as np

from mbd.arrays import Matrix
from mbd.compile.mechanism import Mechanism
from mbd.kernel.records import Kernel
from mbd.results.turning import counted, function_of

__all__ = ["TurnCounter"]


class TurnCounter:
    """Counts the turns made since a stored row, whenever a state is asked for; see `mbd.results.turning`."""

    def __init__(self) -> None:
        self._row = 0
        self._turns = self._first = np.zeros(0)

    def count(self, mechanism: Mechanism, v: Kernel, stored: int, table: Matrix) -> None:
        """Write the turns of the accepted state into the anchors of a run that has stored these rows."""
        wrapped = mechanism.equations.wrapped
        waiting = int(v.n_stored)
        if not wrapped or stored + waiting == 0:
            return
        anchors = [turn.anchor for turn in wrapped]
        if not len(self._first):
            self._first = v.anchors[anchors].copy()
        if stored <= self._row or not len(self._turns):  # none yet, or the run went back
            self._row, self._turns = 0, self._first
        n_q, n_v = v.n_q, v.n_v
        now = np.concatenate([[float(v.time)], v.q[:n_q], v.y[:n_v]])
        width = len(now)
        fresh = v.store.reshape(-1, v.width)[:waiting, :width]
        rows = np.vstack([table[self._row : stored, :width], fresh, now])
        inputs = {
            "t": rows[:, 0], "q": rows[:, 1 : 1 + n_q], "v": rows[:, 1 + n_q :],
            "anchor": np.tile(v.anchors[: v.n_anchors], (len(rows), 1)),
        }  # fmt: skip
        inputs["anchor"][:, anchors] = self._turns
        found = mechanism.kept(function_of, lambda: function_of(wrapped))(inputs, v.params)
        turns = np.array([counted(rows[:, 0], *found[2 * k : 2 * k + 2]) for k in range(len(wrapped))])
        v.anchors[anchors] = self._turns + turns[:, -1]
        if stored > self._row:
            self._turns = self._turns + turns[:, stored - 1 - self._row]
            self._row = stored - 1
