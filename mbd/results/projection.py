"""States between the rows of a run led onto the constraints, which rows of the run satisfy and polynomials do not.

A prescribed motion bends at every sample of a table, and rows of joints bend with the mechanism, so that what passes
smoothly from row to row comes off them by its own error. Positions follow Newton's method in the metric of inertia,

``M x + Bᵀ μ = 0,  B x = −(h − h*)``,  ``q ← q ⊕ x``,

and velocities take one such step with ḣ; ``h* = (1 − ϑ) h₀ + ϑ h₁`` of the rows before and after, which in index 3
miss ḣ = 0. Next to a pose in which B loses rank a correction is an error over the distance from it, of what the rows at
the ends miss or of round-off: there, and where the second correction is not less than half the first (Deuflhard 2004,
Newton Methods for Nonlinear Problems, 2.1), the state stays as it was.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.equal import DIRECT_PIVOT_RTOL, EQUAL_RTOL, ROUND_OFF_RTOL
from mbd.results.balance import Balance, Flags, Held, saddle
from mbd.results.charts import Charts
from mbd.results.polynomials import Index, Places
from mbd.results.record import Rows

MIN_SINGULAR_VALUE = 0.005
"""Least singular value from which rows are followed: of B over sizes of its columns, then lengths of rows, in the run.

From `DIRECT_PIVOT_RTOL` on where the rows before and after hold ḣ = 0: nothing but the interpolation is off there.
Inertia is no part of it: in its metric the rows at the two ends of a light link depend on each other.
"""


class Projection:
    """Leads positions and velocities onto the rows that hold in the interval."""

    def __init__(self, balance: Balance) -> None:
        self.balance, self.equations = balance, balance.equations
        self.charts = Charts.of(balance.equations)
        self._bases: dict[tuple[int, ...], tuple[list[int], Matrix]] = {}

    @classmethod
    def of(cls, balance: Balance) -> Projection | None:
        """That of equations with rows whose positions can be moved, else None."""
        equations = balance.equations
        known = equations.compose is None or Charts.of(equations) is not None
        return cls(balance) if known and equations.rows and Balance.serves(equations) else None

    @np.errstate(all="ignore")
    def at(self, rows: Rows, places: Places, found: Rows) -> Rows:
        """The states `found` at places between `rows`, on the constraints as far as the rows are."""
        modes = np.hstack([found.closed.astype(np.int8), found.phase])
        q, v = found.q.copy(), found.v.copy()
        inside = places.step > 0.0
        patterns, group = np.unique(modes, axis=0, return_inverse=True)
        for number, mode in enumerate(patterns):
            held = self.balance.rows_in(mode)
            mine = np.flatnonzero(inside & (group.ravel() == number))
            if held.kept and len(mine):
                q[mine], v[mine] = self._led(*self._basis(held), rows, places.part(mine), found.part(mine))
        return replace(found, q=q, v=v)

    def _led(self, kept: list[int], sizes: Matrix, rows: Rows, places: Places, found: Rows) -> tuple[Matrix, Matrix]:
        """q and v on the rows `kept` of one mode, where these are far from vanishing and from being dependent."""
        theta = places.theta[:, None]
        first, last = (self._missed(kept, rows, places.lower, ends) for ends in (places.lower, places.upper))
        aim, aim_rate = ((1.0 - theta) * a + theta * b for a, b in zip(first, last, strict=True))
        B = self._rows_at(kept, found)
        least = np.linalg.svd(B / sizes, compute_uv=False)[:, -1]
        terms = np.abs(B[:, :, : found.v.shape[1]]) @ np.abs(found.v)[:, :, None]
        hold = np.all(np.abs(aim_rate) <= EQUAL_RTOL * terms[:, :, 0], axis=1)
        good = least > np.where(hold, DIRECT_PIVOT_RTOL, MIN_SINGULAR_VALUE)
        led, before = found, np.full(len(found), np.inf)
        for _ in range(3):  # an error of 0.01 is round-off after the third
            x, sound = self._correction(kept, led, aim)
            size = np.max(np.abs(x), axis=1, initial=0.0)
            good &= sound & ((size < 0.5 * before) | (size <= ROUND_OFF_RTOL))
            led, before = replace(led, q=self._moved(led.q, x)), size
            if np.all((size <= ROUND_OFF_RTOL) | ~good):
                break
        change, sound = self._correction(kept, led, aim_rate, rates=True)
        good &= sound & np.isfinite(led.q).all(axis=1) & np.isfinite(change).all(axis=1)
        return np.where(good[:, None], led.q, found.q), np.where(good[:, None], found.v + change, found.v)

    def _basis(self, held: Held) -> tuple[list[int], Matrix]:
        """Rows that are independent, and their lengths times the sizes of columns, the largest in the run (kept, n).

        Where rows depend on others, those that are longest beside the ones before (QR with pivoting) at states all
        over the run: the first ones that are independent at all may be far worse conditioned than the mechanism.
        """
        key = tuple(held.every)
        if key not in self._bases:
            rows, count = self.balance.states.rows, len(held.kept)
            chosen = held.every if held.depend else held.kept
            B = self._rows_at(chosen, rows.part(np.unique(np.linspace(0, len(rows) - 1, 64).astype(np.intp))))
            columns = _positive(np.max(np.abs(B / _positive(np.max(np.abs(B), axis=(0, 2)))[:, None]), axis=(0, 1)))
            lengths = _positive(np.max(np.linalg.norm(B / columns, axis=2), axis=0))
            left, picked = B / columns / lengths[:, None], list(range(count))
            for k in range(count if held.depend else 0):
                picked[k] = int(np.argmax(np.sum(left**2, axis=(0, 2))))
                along = left[:, picked[k]]
                along = along / _positive(np.linalg.norm(along, axis=1))[:, None]
                left = left - np.einsum("kmn,kn->km", left, along)[:, :, None] * along[:, None, :]
            picked.sort()
            self._bases[key] = [chosen[k] for k in picked], lengths[picked, None] * columns
        return self._bases[key]

    def _rows_at(self, kept: list[int], rows: Rows) -> Matrix:
        """B (k, kept, n)."""
        return np.asarray(np.nan_to_num(self.balance.terms_at(rows)[3][:, kept]))

    def _missed(self, kept: list[int], rows: Rows, lower: Index, ends: Index) -> tuple[Matrix, Matrix]:
        """h and ḣ at the ends of intervals, in the mode of the interval."""
        at = rows.part(ends)
        at = replace(at, **{name: getattr(rows, name)[lower] for name in ("closed", "phase", "anchors", "source")})
        _, _, _, _, h, rates, *_ = self.balance.terms_at(at)
        return h[:, kept], rates[:, kept]

    def _correction(self, kept: list[int], rows: Rows, aim: Matrix, rates: bool = False) -> tuple[Matrix, Flags]:
        """x with B x = −(h − h*), or −(ḣ − ḣ*), and where it is determined."""
        n_v = self.equations.n_v
        M, _, _, B, h, speeds, *_ = self.balance.terms_at(rows)
        B = B[:, kept, :n_v]
        off = (speeds if rates else h)[:, kept] - aim
        x, _, _, sound = saddle(M[:, :n_v, :n_v], np.zeros((len(rows), n_v)), np.swapaxes(B, 1, 2), B, off)
        return x, sound

    def _moved(self, q: Matrix, x: Matrix) -> Matrix:
        return q + x if self.charts is None else self.charts.composed(q, x)


def _positive(sizes: Vector) -> Vector:
    """The same, but 1 where they vanish."""
    return np.where(sizes > 0.0, sizes, 1.0)
