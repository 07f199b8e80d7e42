"""Steps taken again from the rows of a run by machine code: see `mbd.kernel.stepping.steps_again`."""

from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.assembly.manager import manager_of
from mbd.compile.mechanism import Mechanism
from mbd.errors import MbdError
from mbd.integrators import RungeKutta4, RungeKutta853
from mbd.kernel import codes
from mbd.kernel.schemes.determinant import FAR, STEPS_AGAIN
from mbd.kernel.schemes.tableau import FOURTH_ORDER
from mbd.results.polynomials import Places
from mbd.results.record import Record, Rows
from mbd.results.stored_states import StoredStates
from mbd.simulation.run.idle import keep_idle, stepper_of
from mbd.simulation.run.stepper import Stepper, is_compiled

OPTIONS = {
    "contact": "events", "impact": "newton", "locate": "root", "store": 1, "rest_speed": 1e-6, "capacity": 8,
}  # fmt: skip


def steps_of(states: StoredStates) -> "StepsAgain | None":
    """What takes steps again from the rows of a run; None where there is no machine code for it."""
    known = states.equations.memory.get("mechanism") if hasattr(states.equations, "memory") else None
    mechanism = None if known is None else known()
    scheme = RungeKutta4() if states.record.extension.formula is FOURTH_ORDER else RungeKutta853()
    return StepsAgain(mechanism, states.record, scheme) if mechanism and is_compiled(mechanism, scheme) else None


class StepsAgain:
    """Steps of an explicit scheme from the stored rows of a run."""

    def __init__(self, mechanism: Mechanism, record: Record, scheme: RungeKutta4 | RungeKutta853) -> None:
        self.mechanism, self.record, self.scheme = mechanism, record, scheme

    def __call__(self, rows: Rows, places: Places, begin: Vector, end: Vector) -> tuple[Rows, Matrix] | None:
        """States at the ends of steps from the rows before places, of which times are `begin`, to the times `end`.

        And log |det [M R; B 0]| at the row before, at the stages, at the end and at the row after (k, stages + 2), NaN
        where a step could not be taken; None if no step can.
        """
        known = np.unique(np.concatenate([places.lower, places.upper]))
        source = np.concatenate([known, places.lower])
        table = np.column_stack([
            source, np.concatenate([rows.time[known], begin]), np.concatenate([rows.time[known], end]), rows.q[source],
            rows.v[source], rows.z[source], rows.a[source], rows.s[source], rows.lam[source], rows.anchors[source],
            rows.closed[source],
        ])  # fmt: skip
        order = np.lexsort((np.arange(len(source)) >= len(known), source))
        try:
            taken = self._taken(table[order], self.record.parameters_at(rows.source[source[order]]))
        except MbdError:  # no code for a mode
            return None
        found = np.empty_like(taken)
        found[order] = taken
        count = self.scheme.tableau.stages + 1
        status, parts, powers, states = np.split(found, [1, 1 + count, 1 + 2 * count], axis=1)
        with np.errstate(all="ignore"):
            sizes = np.log(np.abs(parts)) + powers * np.log(FAR)
        sizes[status[:, 0] != codes.DONE] = np.nan
        at_rows, own = sizes[: len(known), 0], sizes[len(known) :].copy()
        own[:, 0] = at_rows[np.searchsorted(known, places.lower)]
        ends = states[len(known) :]
        widths = (each.shape[1] for each in (rows.q, rows.v, rows.z, rows.a, rows.s, rows.lam))
        q, v, z, a, s, lam = np.split(ends, np.cumsum(list(widths))[:-1], axis=1)
        there = rows.part(places.lower)
        there = Rows(places.time, q, v, z, a, s, lam, there.closed, there.anchors, there.source, there.phase)
        return there, np.column_stack([own, at_rows[np.searchsorted(known, places.upper)]])

    def _taken(self, lines: Matrix, parameters: Any) -> Matrix:
        """The lines of ends of the kernel."""
        vector = np.array(self.record.parameters, dtype=float)
        manager = manager_of(self.mechanism, vector)
        stepper = stepper_of(Stepper, self.mechanism, manager, self.scheme, vector, 1.0, dict(OPTIONS))
        v, count = stepper.kernel, self.scheme.tableau.stages + 1
        v.dt = v.step = max(float(np.ptp(self.record.time)) / len(self.record.time), 1e-300)
        width = 1 + 2 * count + v.n_q + 2 * v.n + v.n_rows
        ends = np.zeros((len(lines), width))
        ends[:, 1 : 1 + count] = 1.0
        v.starts, v.ends = np.ascontiguousarray(lines).ravel(), ends.ravel()
        if parameters.ndim == 2:
            v.given_parameters, v.n_parameters = np.ascontiguousarray(parameters).ravel(), parameters.shape[1]
        v.closed[: v.n_contacts] = lines[0, lines.shape[1] - v.n_contacts :]
        v.run, v.n_runs, v.begun = 0, len(lines), 0
        with np.errstate(all="ignore"):
            while stepper.march_many(STEPS_AGAIN) == codes.NEW_MODE:
                stepper.add_mode()
        keep_idle(stepper)
        return ends
