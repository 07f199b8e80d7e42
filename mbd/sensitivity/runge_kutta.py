"""Steps of explicit Runge–Kutta formulas, differentiated stage by stage.

    x_i = h Σ a_ij v_j,   y_i = y₀ + h Σ a_ij rate_j,   rate_i consistent at (t₀ + c_i h, q₀ + x_i, y_i)

At the end positions and velocities are put on the rows: ``M(q̃) W + R ν = 0``, ``h(q̃ + W) = 0``, then
``M (v − ṽ) + R κ = 0``, ``ḣ(v) = 0``. Stages are evaluated again, as runs do not store them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mbd.arrays import Vector
from mbd.kernel.schemes.tableau import Tableau
from mbd.sensitivity.entries import stacked, system
from mbd.sensitivity.kernel.build import entry
from mbd.sensitivity.kernel.runge_kutta import runge_kutta_steps
from mbd.sensitivity.motion import Mode, Motion, Rates
from mbd.sensitivity.one_step import OneStepMethod
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.run_data import Rows, RunRows

__all__ = ["RungeKuttaSteps"]


class RungeKuttaSteps(OneStepMethod):
    """Derivatives of explicit steps of a formula."""

    def __init__(self, rows: RunRows, programs: Programs, formula: Tableau) -> None:
        super().__init__(rows, programs)
        self.formula = formula

    def taken(
        self, motion: Motion, rates: Rates, mode: Mode, rows: Rows, dh: Vector, checked: bool = True
    ) -> tuple[int, Motion, Rates]:
        """By the kernel."""
        return taken(self.programs, motion, rates, mode, rows, dh, self.formula, checked)


def taken(
    programs: Programs, motion: Motion, rates: Rates, mode: Mode, rows: Rows, dh: Vector,
    formula: Tableau, checked: bool = True,
) -> tuple[int, Motion, Rates]:  # fmt: skip
    """As many of the steps between these rows as the kernel takes from here; the state and rates after them.

    checked : false for one step whose end q, y is not known; rows then get it
    """
    known, level = system(programs, "consistent", mode, False), system(programs, "steps", mode, False)
    time, q, y, rate, lam = (np.ascontiguousarray(each) for each in rows)
    active = lam * known.held
    n, n_v, m, width = programs.columns.n, programs.columns.n_v, len(mode.rows), len(dh)
    Z = stacked(motion, known)
    w, size = Z.shape[1], n + m
    X, by_size, block = np.zeros((size, w)), np.zeros(w), np.zeros((2, programs.layout.size))
    X[:n, :width], by_size[:width] = rates.of_rate, dh
    programs.fill(block, motion.at(mode, rate[0], lam[0]))
    tableau, stages = np.concatenate([formula.end, formula.nodes, np.ravel(formula.weights)]), formula.stages
    slopes, of_slopes = np.empty((2, stages * n)), np.empty((2, stages * n * w))
    done = entry(runge_kutta_steps)(
        [known.function, level.function, *programs.charts.programs()], programs.values,
        known.of_width(width), level.of_width(width), tableau, stages,
        len(time) - 1, int(checked), time, q, y, rate, active, known.rows, known.fast, known.entries,
        level.entries, block[0], block[1], np.empty(max(known.outputs, level.outputs)), np.empty(level.outputs),
        slopes[0], slopes[1], of_slopes[0], of_slopes[1], X, Z, Z.copy(), by_size, np.empty(size * size),
        np.empty(size * size), np.empty(size * w), np.empty(size), np.empty(size), np.empty(size, dtype=np.int64),
        *programs.charts.room(w),
    )  # fmt: skip
    if done == 0:
        return 0, motion, rates
    tangent = replace(motion.tangent, t=Z[n_v + n + size, :width], q=Z[:n_v, :width], y=Z[n_v : n_v + n, :width])
    of_lam = np.zeros((programs.columns.rows, width))
    of_lam[known.rows] = X[n:, :width]
    end = Motion(float(time[done]), q[done].copy(), y[done].copy(), motion.anchors, tangent)
    return done, end, Rates(rate[done].copy(), lam[done] if checked else active[done], X[:n, :width], of_lam)
