"""The runs of one model with one scheme, laid out once for many batches of starts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.assembly.manager import manager_of
from mbd.compile.mechanism import Mechanism
from mbd.compile.mechanisms import mechanism_of
from mbd.integrators import Integrator
from mbd.kernel import codes
from mbd.simulation.batch.alone import Alone, made_alone, needs_judgement
from mbd.simulation.batch.changes import Changes, telling_values
from mbd.simulation.batch.workers import Interrupted, Workers
from mbd.simulation.many_runs import Ends, may_be_many
from mbd.simulation.marching import Run
from mbd.simulation.run.late_resets import reset_ends
from mbd.simulation.simulate import laid_out
from mbd.state import State


class Runner:
    """Makes the runs of one model with one scheme: laid out once, used for many batches of starts.

    Parameters
    ----------
    changes : parameters that differ from the model's: numbers, or columns (N,)
    options : contact, impact, locate, store, rest_speed, backend, as for `simulate`
    """

    def __init__(
        self, model: Any, base: State, scheme: Integrator, dt: float, until: Any, changes: Mapping[str, Vector],
        options: Mapping[str, Any], threads: int,
    ) -> None:  # fmt: skip
        self.model, self.scheme, self.dt, self.until = model, scheme, dt, until
        self.options = dict(options)
        self.folded = getattr(model, "parameters", {})
        first = telling_values(changes, self.folded)
        self.mechanism: Mechanism = mechanism_of(model, options["backend"], first)
        self.manager = manager_of(self.mechanism, self.mechanism.parameters(first, self.folded))
        base = replace(base, memory=None)

        def lay_out() -> Run:
            return laid_out(model, base, scheme, dt, until, first, self.options)

        self.workers = Workers(lay_out, threads)
        self.run = self.workers.run
        self.slow = may_be_many(self.run, late_resets=True)
        self.changes = Changes(model, self.mechanism, changes)
        guards = {guard.name for guard in self.manager.guards if guard.terminal}
        self.terminal = frozenset(guards | ({self.run.stop} if self.run.stop else set()))

    def ends(self, starts: Matrix, changes: Changes, report: Callable[[int], None] | None = None) -> Ends:
        """The ends of runs from lines of starts, reset where the event that ended them does so.

        Raises
        ------
        Interrupted
            by Ctrl-C, with the runs that were over.
        """
        try:
            ends = self.workers(starts, changes.vectors if changes.varies else changes.constant, report)
        except Interrupted as stop:
            self._reset(stop.ends, changes, stop.done)
            raise
        self._reset(ends, changes, np.ones(len(starts), dtype=bool))
        return ends

    def _reset(self, ends: Ends, changes: Changes, done: NDArray[np.bool_]) -> None:
        v = self.run.kernel
        for e, guard in enumerate(self.manager.guards):
            by = (ends.stopped_by == v.n_contacts + e) & done
            here = np.flatnonzero(by) if guard.reset is not None else ()
            if not len(here):
                continue
            q, y = ends.row[here, 1 : 1 + v.n_q], ends.row[here, 1 + v.n_q : 1 + v.n_q + v.n]
            sound = reset_ends(self.run, guard, q, y, changes.rows(here))
            ends.row[here, 1 : 1 + v.n_q], ends.row[here, 1 + v.n_q : 1 + v.n_q + v.n] = q, y
            ends.status[here[~sound]] = codes.NEEDS_PYTHON

    def inputs(self, lines: Matrix) -> dict[str, Matrix]:
        """Inputs of expressions from lines of starts, or rows of ends."""
        v = self.run.kernel
        at_y = 1 + v.n_q
        return {
            "t": lines[:, 0], "q": lines[:, 1:at_y], "v": lines[:, at_y : at_y + v.n_v],
            "z": lines[:, at_y + v.n_v : at_y + v.n],
        }  # fmt: skip

    def judged(self, lines: Matrix, ends: Ends, changes: Changes) -> Any:
        """Which runs `simulate` has to judge."""
        v = self.run.kernel
        at = 1 + v.n_q + v.n
        starts = {**self.inputs(lines), "anchor": lines[:, at : at + v.n_anchors]}
        finals = {**self.inputs(ends.row), "anchor": ends.anchors}
        return needs_judgement(self.mechanism, starts, finals, ends, changes.all_vectors(len(lines)))

    def alone(self, start: State, parameters: Mapping[str, float]) -> Alone:
        """One run by `simulate`."""
        arguments = {**self.options, "integrator": self.scheme, "dt": self.dt, "until": self.until,
                     "parameters": dict(parameters)}  # fmt: skip
        return made_alone(self.model, start, arguments, self.terminal)
