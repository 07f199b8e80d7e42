"""States between long steps of `RadauIIA`: explicit steps from the row before, led to the row after.

Polynomials through rows take the local errors δ of single steps for motion, whose rates they then miss by δ/h. The
explicit formulas of order 8 know of one row only: a step of ϑ h follows the motion from there, and a whole step tells
by how much the row after lies off it, ``d = y₁ − Φ_h(y₀)``: ``y(ϑ) = Φ_ϑh(y₀) + ϑ d`` errs as the rows do.

Forces too stiff for explicit steps leave a large d: where it is not smaller than what a cubic and a quintic differ by
in the middle of the interval, which the error of a step of order 5 is far below, polynomials stand. So they do in
short steps, in which δ is no matter.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.equal import EQUAL_RTOL
from mbd.results.dense import SINGULAR_DISTANCE_RATIO, Restepping
from mbd.results.polynomials import CHUNK, Places, hermite, quintic
from mbd.results.record import Rows
from mbd.results.stored_states import StoredStates

Index = NDArray[np.intp]

NAMES = ("q", "v", "z", "a", "s", "lam")


class LedSteps:
    """States between the rows of a run of `RadauIIA` that stored every step."""

    def __init__(self, steps: Restepping) -> None:
        self.steps = steps

    @staticmethod
    def serves(states: StoredStates) -> bool:
        """Whether its steps can be followed: all stored, of q + x, with no dry friction."""
        record, equations = states.record, states.equations
        stepped = record.extension.leads_steps and record.settings.get("store") == 1
        return stepped and equations.compose is None and not equations.frictions and equations.n_v > 0

    def at(self, rows: Rows, places: Places, found: Rows) -> Rows:
        """Interpolated states, with others where those are the better ones: in an interval everywhere or nowhere."""
        inside = np.flatnonzero(places.step > 0.0)
        which = np.unique(places.lower[inside])
        rough, way = self._rough(rows, which)
        which, rough = which[rough > EQUAL_RTOL * way], rough[rough > EQUAL_RTOL * way]
        inside = inside[np.isin(places.lower[inside], which)]
        changed = {name: np.array(getattr(found, name)) for name in NAMES}
        for part in np.array_split(inside, -(-len(inside) // CHUNK)) if len(inside) else ():
            mine, back = np.unique(places.lower[part], return_inverse=True)
            off, good = self._missed(rows, mine, rough[np.searchsorted(which, mine)])
            part, back = part[good[back]], back[good[back]]
            if len(part):
                for name, values in self._led(rows, places.part(part), mine, back, off).items():
                    changed[name][part] = values
        return replace(found, **changed)

    def _led(self, rows: Rows, places: Places, which: Index, back: Index, off: Matrix) -> dict[str, Matrix]:
        """States, accelerations and multipliers at places in the intervals `which`, numbered by `back`."""
        theta, begin = places.theta[:, None], rows.part(places.lower)
        with np.errstate(all="ignore"):
            state, _ = self.steps.stepped(rows, places)
        q, v, z = self.steps._parts(begin, state + theta * off[back])
        here = self.steps._rates(replace(begin, time=places.time, q=q, v=v, z=z))
        first, last = (self._unbalanced(rows.part(number)) for number in (which, which + 1))
        both = np.hstack([here.rate, here.lam]) + (1.0 - theta) * first[back] + theta * last[back]
        a, s, lam = np.split(both, [v.shape[1], here.rate.shape[1]], axis=1)
        return {"q": q, "v": v, "z": z, "a": a, "s": s, "lam": lam}

    def _unbalanced(self, rows: Rows) -> Matrix:
        """What accelerations, ż and multipliers of rows have beside the balance of forces."""
        solved = self.steps._rates(rows)
        return np.hstack([rows.a, rows.s, rows.lam]) - np.hstack([solved.rate, solved.lam])

    def _rough(self, rows: Rows, which: Index) -> tuple[Vector, Vector]:
        """What the cubic and the quintic of q differ by in the middles of intervals, and the ways there (k,)."""
        step = rows.time[which + 1] - rows.time[which]
        middle = Places(rows.time[which] + step / 2, which, which + 1, np.full(len(which), 0.5), step)
        ends = (rows.q[which], rows.v[which], rows.q[which + 1], rows.v[which + 1])
        apart = np.abs(hermite(middle, *ends) - quintic(middle, rows.q, rows.v, rows.a))
        fast = np.maximum(np.abs(rows.v[which]), np.abs(rows.v[which + 1]))
        return np.max(apart, axis=1, initial=0.0), step * np.max(fast, axis=1, initial=0.0)

    def _missed(self, rows: Rows, which: Index, rough: Vector) -> tuple[Matrix, Vector]:
        """By how much whole steps miss the rows after (k, n_q + n_v + n_z), and which are to be followed (k,)."""
        begin, end = rows.part(which), rows.part(which + 1)
        step = (end.time - begin.time)[:, None]
        with np.errstate(all="ignore"):
            whole, least = self.steps.stepped(rows, Places(end.time, which, which + 1, np.ones(len(which)), step[:, 0]))
            off = np.hstack([end.q, end.v, end.z]) - whole
            n_v = begin.v.shape[1]
            sizes = np.maximum(
                np.max(np.abs(off[:, :n_v]), axis=1, initial=0.0),
                np.max(step * np.abs(off[:, n_v : 2 * n_v]), axis=1, initial=0.0),
            )
        return off, np.isfinite(off).all(axis=1) & (sizes < rough) & (least > 2.0 * np.log(SINGULAR_DISTANCE_RATIO))
