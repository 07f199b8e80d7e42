"""States between the rows of a run by machine code: see `mbd.kernel.stepping.steps_again`."""

from dataclasses import replace
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
from mbd.results.balance import modes_of
from mbd.results.polynomials import Places
from mbd.results.record import Rows
from mbd.results.stored_states import StoredStates
from mbd.simulation.run.idle import keep_idle, stepper_of
from mbd.simulation.run.stepper import Stepper, is_compiled

OPTIONS = {
    "contact": "events", "impact": "newton", "locate": "root", "store": 1, "rest_speed": 1e-6, "capacity": 8,
}  # fmt: skip


def between(states: StoredStates) -> "StatesBetween | None":
    """What finds states between the rows of a run; None where there is no machine code for it, or dry friction."""
    known = getattr(states.equations, "memory", {}).get("mechanism")
    mechanism = None if known is None or states.equations.frictions else known()
    scheme = RungeKutta4() if states.record.extension.formula is FOURTH_ORDER else RungeKutta853()
    return StatesBetween(mechanism, states, scheme) if mechanism and is_compiled(mechanism, scheme) else None


class StatesBetween:
    """Steps of an explicit scheme from the stored rows of a run, and balances of forces."""

    def __init__(self, mechanism: Mechanism, states: StoredStates, scheme: RungeKutta4 | RungeKutta853) -> None:
        self.mechanism, self.states, self.scheme = mechanism, states, scheme

    def stepped(self, rows: Rows, places: Places) -> tuple[Rows, Matrix] | None:
        """States at the ends of steps from the rows before places, NaN where one could not be taken.

        And log |det [M R; B 0]| at the row before, at the stages, at the end and at the row after (k, stages + 2);
        None if no step can be taken.
        """
        begin = rows.part(places.lower)
        known, ends = np.unique(np.concatenate([places.lower, places.upper])), self._time(begin, places.time)
        source, at_rows = np.concatenate([known, places.lower]), rows.part(known)
        time = np.concatenate([self._time(at_rows), self._time(begin)])
        lines = _lines(source, time, np.concatenate([time[: len(known)], ends]), rows.part(source))
        order = np.lexsort((np.arange(len(source)) >= len(known), source))
        taken = self._taken(lines[order], rows.source[source[order]])
        if taken is None:
            return None
        found = np.empty_like(taken[0])
        found[order] = taken[0]
        good, _, sizes, states = self._read(found)
        own, row_sizes = sizes[len(known) :].copy(), sizes[: len(known), 0]
        own[:, 0] = row_sizes[np.searchsorted(known, places.lower)]
        sizes = np.column_stack([own, row_sizes[np.searchsorted(known, places.upper)]])
        states[~good] = sizes[~good[len(known) :]] = np.nan
        q, v, z, a, s, lam = _parts(rows, states[len(known) :])
        there = Rows(places.time, q, v, z, a, s, lam, begin.closed, begin.anchors, begin.source, begin.phase)
        return there, sizes

    def balanced(self, rows: Rows, samples: Rows) -> tuple[Any, ...] | None:
        """Consistent values at states, which are of as many modes as the sampled ones, a row of the run for each.

        (v̇, ż), λ, log |det|, where these were found, where no row depends on others, M and f; or None.
        """
        taken = self._in_modes(rows, samples, self._time(rows), forces=True)
        if taken is None:
            return None
        good, dropped, sizes, states = self._read(taken[0])
        n = self.mechanism.layout.n
        *_, lam = _parts(rows, states)
        rate = states[:, states.shape[1] - lam.shape[1] - n : states.shape[1] - lam.shape[1]]
        inertia, load = np.split(taken[1], [n * n], axis=1)
        return rate, lam, sizes[:, 0], good, dropped == 0, inertia.reshape(-1, n, n), load

    def led(self, rows: Rows, samples: Rows, aim: Matrix, aim_rate: Matrix) -> tuple[Matrix, Matrix, Any] | None:
        """Positions and velocities with h = `aim` and ḣ = `aim_rate`, and where they were found; or None."""
        taken = self._in_modes(replace(rows, lam=aim), samples, np.full(len(rows), -np.inf), aim_rate)
        if taken is None:
            return None
        good, _, _, states = self._read(taken[0])
        q, v, *_ = _parts(rows, states)
        return q, v, good

    def _in_modes(
        self, rows: Rows, samples: Rows, end: Vector, aims: Matrix | None = None, forces: bool = False
    ) -> tuple[Matrix, Matrix] | None:
        """What the kernel answers for states, mode by mode, each behind its sampled row; None where one has no code."""
        _, mode = modes_of(np.vstack([samples.closed, rows.closed]))
        number, first = np.arange(len(samples) + len(rows)), len(samples)
        begin = self._time(samples)
        lines = np.vstack([
            _lines(number[:first], begin, begin, samples), _lines(number[first:], self._time(rows), end, rows, aims),
        ])  # fmt: skip
        order = np.lexsort((number, mode))
        taken = self._taken(lines[order], np.concatenate([samples.source, rows.source])[order], forces)
        if taken is None:
            return None
        ends, loads = (np.empty_like(each) for each in taken)
        ends[order] = taken[0]
        loads[order if forces else slice(None)] = taken[1]
        return ends[first:], loads[first:]

    def _time(self, rows: Rows, time: Vector | None = None) -> Vector:
        """As steps begin and end there, beside jumps."""
        if self.states.times_beside_jumps is None:
            return rows.time if time is None else time
        at = rows if time is None else replace(rows, time=time)
        return np.asarray(self.states.all_inputs(at)["t"])

    def _read(self, ends: Matrix) -> tuple[Any, Vector, Matrix, Matrix]:
        """Where they were found, how many rows depend on others, log |det| at all stages, and states."""
        count = self.scheme.tableau.stages + 1
        status, dropped, parts, powers, states = np.split(ends, [1, 2, 2 + count, 2 + 2 * count], axis=1)
        with np.errstate(all="ignore"):
            sizes = np.log(np.abs(parts)) + powers * np.log(FAR)
        return status[:, 0] == 0.0, dropped[:, 0], sizes, states

    def _taken(self, lines: Matrix, source: Any, forces: bool = False) -> tuple[Matrix, Matrix] | None:
        """The lines of ends of the kernel, and M and f of each; None where a mode has no code."""
        record = self.states.record
        vector, parameters = np.array(record.parameters, dtype=float), record.parameters_at(source)
        manager = manager_of(self.mechanism, vector)
        stepper = stepper_of(Stepper, self.mechanism, manager, self.scheme, vector, 1.0, dict(OPTIONS))
        v, count = stepper.kernel, self.scheme.tableau.stages + 1
        v.dt = v.step = max(float(np.ptp(record.time)) / len(record.time), 1e-300)
        ends = np.zeros((len(lines), 2 + 2 * count + v.n_q + 2 * v.n + v.n_rows))
        ends[:, 2 : 2 + count] = 1.0
        loads = np.zeros((len(lines) if forces else 1, v.n * (v.n + 1)))
        v.starts, v.ends, v.lines = np.ascontiguousarray(lines).ravel(), ends.ravel(), loads.ravel()
        v.max_lines = int(forces)
        if parameters.ndim == 2:
            v.given_parameters, v.n_parameters = np.ascontiguousarray(parameters).ravel(), parameters.shape[1]
        v.closed[: v.n_contacts] = lines[0, 3 + v.n_q + 2 * v.n + v.n_rows + v.n_anchors :][: v.n_contacts]
        v.run, v.n_runs, v.begun = 0, len(lines), 0
        try:
            while stepper.march_many(STEPS_AGAIN) == codes.NEW_MODE:
                stepper.add_mode()
        except MbdError:
            return None
        keep_idle(stepper)
        return ends, loads


def _lines(number: Any, begin: Vector, end: Vector, rows: Rows, aims: Matrix | None = None) -> Matrix:
    """Lines of starts of the kernel."""
    return np.column_stack([
        number, begin, end, rows.q, rows.v, rows.z, rows.a, rows.s, rows.lam, rows.anchors, rows.closed,
        np.zeros_like(rows.lam) if aims is None else aims,
    ])  # fmt: skip


def _parts(rows: Rows, states: Matrix) -> list[Matrix]:
    """q, v, z, a, s and λ of states side by side."""
    widths = [each.shape[1] for each in (rows.q, rows.v, rows.z, rows.a, rows.s, rows.lam)]
    return np.split(states, np.cumsum(widths)[:-1], axis=1)
