"""Steps of the three-stage Radau IIA method, differentiated as the implicit function of all stages together.

    Y_i = y₀ + h Σ a_ij W_j,   X_i = h c_i v₀ + h² Σ (A²)_ij W_j + U_i,   r_i = 0,   h_i = 0,   ḣ_i = 0

U_i is normal to the rows in the metric of Newton's matrix of the middle stage, ``S W + R ν = 0`` with ∂v/∂v̇ = μh,
∂x/∂v̇ = (μh)² (see `mbd.kernel.schemes.stages`). Stages are solved for again, as runs do not store them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mbd.arrays import Vector
from mbd.kernel.schemes.collocation import RADAU
from mbd.sensitivity.entries import stacked, system
from mbd.sensitivity.kernel.build import entry
from mbd.sensitivity.kernel.radau import radau_steps
from mbd.sensitivity.motion import Mode, Motion, Rates
from mbd.sensitivity.one_step import OneStepMethod
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.run_data import Rows

__all__ = ["RadauSteps"]

SQUARE = RADAU.A @ RADAU.A


class RadauSteps(OneStepMethod):
    """Derivatives of implicit steps of order 5."""

    def taken(
        self, motion: Motion, rates: Rates, mode: Mode, rows: Rows, dh: Vector, checked: bool = True
    ) -> tuple[int, Motion, Rates]:
        """By the kernel."""
        return taken(self.programs, motion, rates, mode, rows, dh, checked)


def taken(
    programs: Programs, motion: Motion, rates: Rates, mode: Mode, rows: Rows, dh: Vector, checked: bool = True
) -> tuple[int, Motion, Rates]:
    """As many of the steps between these rows as the kernel takes from here; the state and rates after them.

    checked : false for one step whose end q, y is not known; rows then get it
    """
    known, level = system(programs, "consistent", mode, False), system(programs, "steps", mode, False)
    time, q, y, rate, lam = (np.ascontiguousarray(each) for each in rows)
    active = lam * known.held
    n, n_v, m, width = programs.columns.n, programs.columns.n_v, len(mode.rows), len(dh)
    Z = stacked(motion, known)
    w, size, unknowns = Z.shape[1], n + m, 3 * (n + m) * (2 if m else 1)
    X, by_size, block = np.zeros((size, w)), np.zeros(w), np.zeros(programs.layout.size)
    by_size[:width] = dh
    programs.fill(block, motion.at(mode, rate[0], lam[0]))
    numbers = np.concatenate([RADAU.c, np.ravel(RADAU.A), np.ravel(SQUARE), [RADAU.real, 1.0]])
    outputs = level.outputs
    done = entry(radau_steps)(
        [known.function, level.function, *programs.charts.programs()], programs.values,
        level.of_width(width), known.of_width(width), numbers,
        len(time) - 1, int(checked), outputs, time, q, y, rate, active, known.rows, known.fast, level.entries,
        known.entries, block, np.empty(max(known.outputs, outputs)), np.empty(3 * outputs), np.empty(outputs),
        np.empty(6 * size), X, Z, np.empty(3 * Z.size), by_size, np.empty(unknowns**2), np.empty(unknowns * w),
        np.empty(unknowns), np.empty(size**2), np.empty(unknowns, dtype=np.int64), *programs.charts.stage_room(w),
    )  # fmt: skip
    if done == 0:
        return 0, motion, rates
    tangent = replace(motion.tangent, t=Z[n_v + n + size, :width], q=Z[:n_v, :width], y=Z[n_v : n_v + n, :width])
    of_lam = np.zeros((programs.columns.rows, width))
    of_lam[known.rows] = X[n:, :width]
    end = Motion(float(time[done]), q[done].copy(), y[done].copy(), motion.anchors, tangent)
    return done, end, Rates(rate[done].copy(), lam[done] if checked else active[done], X[:n, :width], of_lam)
