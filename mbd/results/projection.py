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
from functools import cached_property
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.equal import DIRECT_PIVOT_RTOL, EQUAL_RTOL, ROUND_OFF_RTOL
from mbd.results.balance import Balance, Flags, Held, modes_of, put, saddle
from mbd.results.charts import Charts
from mbd.results.polynomials import Index, Places
from mbd.results.record import Rows

MIN_SINGULAR_VALUE = 0.005
"""Least singular value from which rows are followed: of B over sizes of its columns, then lengths of rows, in the run.

From `DIRECT_PIVOT_RTOL` on where the rows before and after hold ḣ = 0: nothing but the interpolation is off there.
Inertia is no part of it: in its metric the rows at the two ends of a light link depend on each other.
"""


@dataclass(frozen=True, eq=False)
class _Mode:
    """States of one mode: their places among all, the rows that they are led onto, and sizes of these (kept, n)."""

    mine: Index
    kept: list[int]
    sizes: Matrix


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
        asked = np.flatnonzero(places.step > 0.0)
        if not len(asked):
            return found
        each = np.hstack([found.closed.astype(np.int8), found.phase])[asked]
        patterns, group = modes_of(each)
        modes = [
            _Mode(np.flatnonzero(group == number), *self._basis(held))
            for number, held in enumerate(map(self.balance.rows_in, patterns)) if held.kept
        ]  # fmt: skip
        if not modes:
            return found
        led = self._led(modes, rows, places.part(asked), found.part(asked))
        return replace(found, q=put(found.q, asked, led.q), v=put(found.v, asked, led.v))

    def _led(self, modes: list[_Mode], rows: Rows, places: Places, found: Rows) -> Rows:
        """The states on the rows of their modes, where these are far from vanishing and from being dependent."""
        theta = places.theta[:, None]
        first, last = (self._missed(rows, places.lower, ends) for ends in (places.lower, places.upper))
        aim, aim_rate = ((1.0 - theta) * a + theta * b for a, b in zip(first, last, strict=True))
        terms = self.balance.terms_at(found)
        B, good = np.nan_to_num(terms[3]), np.zeros(len(found), dtype=bool)
        for mode in modes:
            mine, own = mode.mine, B[mode.mine][:, mode.kept]
            least = np.linalg.svd(own / mode.sizes, compute_uv=False)[:, -1]
            parts = np.abs(own[:, :, : found.v.shape[1]]) @ np.abs(found.v[mine])[:, :, None]
            hold = np.all(np.abs(aim_rate[mine][:, mode.kept]) <= EQUAL_RTOL * parts[:, :, 0], axis=1)
            good[mine] = least > np.where(hold, DIRECT_PIVOT_RTOL, MIN_SINGULAR_VALUE)
        moved = self._by_machine(found, aim, aim_rate)
        if moved is not None:
            q, v, sound = moved
            good &= sound
            return replace(found, q=np.where(good[:, None], q, found.q), v=np.where(good[:, None], v, found.v))
        led, before, moving = found, np.full(len(found), np.inf), good.copy()
        for _ in range(40):  # halved as often, 1 is round-off
            asked = [mode for mode in modes if np.any(moving[mode.mine])]
            if not asked:
                break
            x, sound = self._corrections(asked, terms, aim)
            size = np.max(np.abs(x), axis=1, initial=0.0)
            good &= ~moving | sound & ((size < 0.5 * before) | (size <= ROUND_OFF_RTOL))
            moving &= good
            led = replace(led, q=np.where(moving[:, None], self._moved(led.q, x), led.q))
            following = np.where(np.isfinite(before), size * (size / before) ** 2, size)  # of Newton's method
            moving &= following > ROUND_OFF_RTOL
            before, terms = size, self.balance.terms_at(led)
        change, sound = self._corrections(modes, terms, aim_rate, rates=True)
        good &= sound & np.isfinite(led.q).all(axis=1) & np.isfinite(change).all(axis=1)
        q = np.where(good[:, None], led.q, found.q)
        return replace(found, q=q, v=np.where(good[:, None], found.v + change, found.v))

    def _by_machine(self, found: Rows, aim: Matrix, aim_rate: Matrix) -> tuple[Matrix, Matrix, Flags] | None:
        """Positions, velocities and where they are sound, by machine code; None where there is none."""
        if self.balance.between is None:
            return None
        samples = self.balance.samples(list(modes_of(found.closed)[0]))
        led = None if samples is None else self.balance.between.led(found, samples, aim, aim_rate)
        if led is None:
            return None
        q, v, sound = led
        return q, v, sound & np.isfinite(q).all(axis=1) & np.isfinite(v).all(axis=1)

    def _basis(self, held: Held) -> tuple[list[int], Matrix]:
        """Rows that are independent, and their lengths times the sizes of columns, the largest in the run (kept, n).

        Where rows depend on others, those that are longest beside the ones before (QR with pivoting) at states all
        over the run: the first ones that are independent at all may be far worse conditioned than the mechanism.
        """
        key = tuple(held.every)
        if key not in self._bases:
            chosen, count = held.every if held.depend else held.kept, len(held.kept)
            B = self._sampled[:, chosen]
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

    @cached_property
    def _sampled(self) -> Matrix:
        """B (k, m, n) at 64 rows all over the run, or all of them."""
        rows = self.balance.states.rows
        chosen = np.unique(np.linspace(0, len(rows) - 1, 64).astype(np.intp))
        return np.asarray(np.nan_to_num(self.balance.terms_at(rows.part(chosen))[3]))

    def _missed(self, rows: Rows, lower: Index, ends: Index) -> tuple[Matrix, Matrix]:
        """h and ḣ at the ends of intervals, in the mode of the interval."""
        at = rows.part(ends)
        at = replace(at, **{name: getattr(rows, name)[lower] for name in ("closed", "phase", "anchors", "source")})
        _, _, _, _, h, rates, *_ = self.balance.terms_at(at)
        return h, rates

    def _corrections(
        self, modes: list[_Mode], terms: tuple[Any, ...], aim: Matrix, rates: bool = False
    ) -> tuple[Matrix, Flags]:
        """x (k, n_v) with B x = −(h − h*), or −(ḣ − ḣ*), of the rows of each mode, and where it is determined."""
        n_v = self.equations.n_v
        M, _, _, B, h, speeds, *_ = terms
        off = (speeds if rates else h) - aim
        x, sound = np.zeros((len(off), n_v)), np.zeros(len(off), dtype=bool)
        for mode in modes:
            mine = mode.mine
            own, free = B[mine][:, mode.kept, :n_v], np.zeros((len(mine), n_v))
            solved = saddle(M[mine, :n_v, :n_v], free, np.swapaxes(own, 1, 2), own, off[mine][:, mode.kept])
            x[mine], _, _, sound[mine] = solved
        return x, sound

    def _moved(self, q: Matrix, x: Matrix) -> Matrix:
        return q + x if self.charts is None else self.charts.composed(q, x)


def _positive(sizes: Vector) -> Vector:
    """The same, but 1 where they vanish."""
    return np.where(sizes > 0.0, sizes, 1.0)
