"""States between the rows of a run by explicit Runge–Kutta steps, as accurate as the steps themselves.

A step from the row before ends at the time that is asked for, all times side by side. Accelerations and multipliers are
the consistent ones there and at its stages (`results.balance`). A step that has a stage next to a pose in which the
constraint Jacobian loses rank would err by 1/x, x how far it is from there: polynomials through the rows around, which
lie far enough from such poses, take its place.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.compile.many import at_inputs
from mbd.kernel.schemes.dormand_prince import EIGHTH_ORDER
from mbd.results.balance import Balance, Flags, Solved, put
from mbd.results.charts import Charts
from mbd.results.polynomials import Places
from mbd.results.projection import Projection
from mbd.results.record import Rows
from mbd.results.stored_states import StoredStates

SINGULAR_DISTANCE_RATIO = 0.2
"""Distance of a stage from a singular configuration, over that of the farther row, below which it is not used [-]."""
CHANGED = ("time", "q", "v", "z", "a", "s", "lam")
"""What differs between a place and the row before."""


class Restepping:
    """States between the rows of a run of explicit steps that stored every one."""

    def __init__(self, states: StoredStates, balance: Balance) -> None:
        self.states, self.equations, self.balance = states, states.equations, balance
        self.charts, self.onto = Charts.of(states.equations), Projection.of(balance)

    @staticmethod
    def serves(states: StoredStates) -> bool:
        """Whether the steps of this run can be taken again: all stored, in one mode each, with no dry friction.

        Frictions that follow loads would need a search at every stage.
        """
        record, equations = states.record, states.equations
        stepped = record.extension.formula is not None and record.settings.get("store") == 1
        known = equations.compose is None or Charts.of(equations) is not None
        return stepped and known and not equations.frictions

    def at(self, rows: Rows, places: Places) -> Rows:
        """The states at places; those that meet a row are that row."""
        inside = places.step > 0.0
        found = rows.part(places.lower)
        if not inside.any():
            return found
        mine = places.part(np.flatnonzero(inside))
        there, near = self._by_machine(rows, mine) or self._by_equations(rows, mine)
        new: dict[str, Any] = {name: put(getattr(found, name), inside, getattr(there, name)) for name in CHANGED}
        found = replace(found, **new)
        inside[inside] = near
        return self._smoothed(rows, places, found, inside) if near.any() else found

    def _by_machine(self, rows: Rows, places: Places) -> tuple[Rows, Flags] | None:
        """The same at places between rows, and which lie next to singular configurations; None without code.

        Steps that end too far from the rows, which the run did not take itself, are led back to them by the equations.
        """
        taken = None if self.balance.between is None else self.balance.between.stepped(rows, places)
        if taken is None:
            return None
        there, sizes = taken
        least, far = np.min(sizes[:, :-1], axis=1), np.maximum(sizes[:, 0], sizes[:, -1])
        near, lost = ~(least - far >= 2.0 * np.log(SINGULAR_DISTANCE_RATIO)), np.isnan(sizes[:, 1])
        if lost.any():
            others, near[lost] = self._by_equations(rows, places.part(np.flatnonzero(lost)))
            there = replace(there, **{name: put(getattr(there, name), lost, getattr(others, name)) for name in CHANGED})
        return there, near

    def _by_equations(self, rows: Rows, places: Places) -> tuple[Rows, Flags]:
        """The same by the equations in numpy, which a run that was read from a file has."""
        begin, time = rows.part(places.lower), places.time
        state, least = self._stepped(begin, (time - begin.time)[:, None])
        q, v, z = self._parts(begin, state)
        there = replace(begin, time=time, q=q, v=v, z=z)
        if self.onto is not None:
            there = self.onto.at(rows, places, there)
        end = self._rates(there)
        a, s = np.split(end.rate, [self.equations.n_v], axis=1)
        there = replace(there, a=a, s=s, lam=end.lam)
        before, after = self._rates(begin).size, self._rates(rows.part(places.upper)).size
        far = np.maximum(before, after)  # the row of an event may lie at the pose itself
        least = np.minimum(np.minimum(least, 0.0) + before, end.size)
        return there, (least - far < 2.0 * np.log(SINGULAR_DISTANCE_RATIO)) | ~end.sound

    def _smoothed(self, rows: Rows, places: Places, found: Rows, near: Any) -> Rows:
        """The states with those told by `near` interpolated."""
        between = self.states.grid.between(rows, places, self.states.q_rate, True, self.charts)
        new: dict[str, Any] = {name: put(getattr(found, name), near, getattr(between, name)[near]) for name in CHANGED}
        return replace(found, **new)

    def stepped(self, rows: Rows, places: Places) -> tuple[Matrix, Vector]:
        """(q, v, z) after steps from the rows before places, and the least change of log |det| at their stages."""
        begin = rows.part(places.lower)
        step = (places.time - begin.time)[:, None]
        taken = None if self.balance.between is None else self.balance.between.stepped(rows, places)
        if taken is None:
            return self._stepped(begin, step)
        there, sizes = taken
        state, least = np.hstack([there.q, there.v, there.z]), np.min(sizes[:, :-2], axis=1) - sizes[:, 0]
        lost = np.flatnonzero(np.isnan(least))
        if len(lost):
            state[lost], least[lost] = self._stepped(begin.part(lost), step[lost])
        return state, least

    def _stepped(self, begin: Rows, h: Matrix) -> tuple[Matrix, Vector]:
        """(q, v, z) after a step of h (k, 1) from each of the rows, and the least change of log |det| at its stages.

        Where coordinates do not add, the increment x stands in the place of q.
        """
        formula = self.states.record.extension.formula or EIGHTH_ORDER
        still = begin.q if self.charts is None else np.zeros_like(begin.v)  # the increment of a chart
        base = np.hstack([still, begin.v, begin.z])
        slopes = np.zeros((formula.stages, *base.shape))
        slopes[0] = np.hstack([begin.v, begin.a, begin.s])
        before = self._rates(begin).size
        least = np.zeros(len(begin))
        for stage in range(1, formula.stages):
            moved = base + h * np.tensordot(formula.weights[stage, :stage], slopes[:stage], 1)
            q, v, z = self._parts(begin, moved)
            there = self._rates(replace(begin, time=begin.time + formula.nodes[stage] * h[:, 0], q=q, v=v, z=z))
            flow = v
            if self.charts is not None:
                flow = self._charted(self.charts, "increment_rates", x=moved[:, : v.shape[1]], v=v)
            slopes[stage] = np.hstack([flow, there.rate])
            least = np.minimum(least, there.size - before)
        return np.asarray(base + h * np.tensordot(formula.end, slopes, 1)), least

    def _parts(self, begin: Rows, state: Matrix) -> tuple[Matrix, Matrix, Matrix]:
        n_q, n_v = self.equations.n_q, self.equations.n_v
        if self.charts is not None:
            x, v, z = np.split(state, [n_v, 2 * n_v], axis=1)
            return self._charted(self.charts, "compose", q=begin.q, x=x), v, z
        return state[:, :n_q], state[:, n_q : n_q + n_v], state[:, n_q + n_v :]

    def _charted(self, charts: Charts, name: str, **inputs: Matrix) -> Matrix:
        """q ⊕ x by 'compose', or ẋ by 'increment_rates'."""
        if self.states.machine is None:
            return charts.composed(**inputs) if name == "compose" else charts.increment_rates(**inputs)
        layout, programs, _ = self.states.machine
        values = {"t": np.zeros(len(inputs["x"])), **inputs}
        return at_inputs(programs[name], layout, values, self.states.record.parameters)

    def _rates(self, rows: Rows) -> Solved:
        return self.balance.solve(rows)
