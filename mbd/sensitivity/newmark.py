"""Steps of the Newmark family, each differentiated as the implicit function that it is at its converged solution.

    (1−α_m) a₁ + α_m a₀ = (1−α_f) v̇₁ + α_f v̇₀,   v₁ = v₀ + h ((1−γ) a₀ + γ a₁)
    q₁ = q₀ + h v₀ + h² ((½−β) a₀ + β a₁) + U,   r = 0,   h = 0 (and ḣ = 0 with U, stabilized)

U = W of positions is normal to the rows in the metric of Newton's matrix: ``S W + R ν = 0``, and ``B̃ W = 0`` for rows
on velocities. Its derivative needs that of S, along W alone: a central difference of compiled first derivatives along
it, which is exact where r is linear and errs by a part h² of U, itself of order h³, else.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from mbd.arrays import Vector
from mbd.sensitivity.balance import consistent_rates
from mbd.sensitivity.kernel.newmark_prediction import FOLLOWED
from mbd.sensitivity.motion import Mode, Motion, Rates
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.schemes import Memory

__all__ = ["NewmarkSteps"]

BRIEF, BRIEFEST = 1e-3, 1e-9
"""Parts of a full step below which the kernel takes one of Heun's method, with rows and without them [-]."""


class NewmarkSteps:
    """Derivatives of the steps of a run.

    Parameters
    ----------
    numbers : those of the integrator; full : its step [s]
    """

    def __init__(self, programs: Programs, numbers: Mapping[str, float], stabilized: bool, full: float) -> None:
        self.programs, self.stabilized, self.full = programs, stabilized, full
        self.alpha_m, self.alpha_f = float(numbers["alpha_m"]), float(numbers["alpha_f"])
        self.beta, self.gamma = float(numbers["beta"]), float(numbers["gamma"])
        self.jerk = float(numbers["jerk"]) * (self.alpha_m - self.alpha_f)

    def start(self, motion: Motion, mode: Mode, rates: Rates, full: float | None = None) -> Memory:
        """a₀ = v̇₀ + (α_m − α_f) h j₀ with the jerk j₀ from one difference of consistent accelerations."""
        full = self.full if full is None else full
        if self.jerk == 0.0 and not (self.stabilized and mode.rows):
            return Memory(rates, rates.rate.copy(), rates.of_rate.copy(), full)
        c, charts, ahead = self.programs.columns, self.programs.charts, full / 16.0
        tangent = motion.tangent
        way = ahead * motion.y[: c.n_v]
        of_q = charts.carried(motion.q, way, tangent.q, ahead * tangent.y[: c.n_v])
        later = Motion(
            motion.t + ahead, charts.compose(motion.q, way), motion.y + ahead * rates.rate, motion.anchors,
            replace(tangent, q=of_q, y=tangent.y + ahead * rates.of_rate),
        )  # fmt: skip
        then = consistent_rates(self.programs, later, mode, rates)
        part = self.jerk * full / ahead
        aux = rates.rate + part * (then.rate - rates.rate)
        of_aux = rates.of_rate + part * (then.of_rate - rates.of_rate)
        slope, lam_slope, none = (then.rate - rates.rate) / ahead, (then.lam - rates.lam) / ahead, np.zeros(c.n_v)
        of_lam = (then.of_lam - rates.of_lam) / ahead
        of_slope, still = (then.of_rate - rates.of_rate) / ahead, np.zeros((c.n_v, of_aux.shape[1]))
        return Memory(rates, aux, of_aux, full, slope, lam_slope, none, none, of_slope, still, still, of_lam)

    # a step -------------------------------------------------------------------------------------------------------
    def follows(self, motion: Motion, memory: Memory, h: float, y1: Vector, rate1: Vector) -> bool:
        """Whether a row's velocities are those of a step from here that ends with its rates."""
        a0, a1 = self._averages(memory, h, rate1)
        way = h * ((1.0 - self.gamma) * a0 + self.gamma * a1)
        size = np.max(np.abs(y1), initial=0.0) + h * np.max(np.abs(a0) + np.abs(a1), initial=0.0)
        return bool(np.max(np.abs(motion.y + way - y1), initial=0.0) <= FOLLOWED * h * size / self.full + 1e-14 * size)

    def _averages(self, memory: Memory, h: float, rate1: Vector) -> tuple[Vector, Vector]:
        """a₀ and a₁ of a step."""
        rate0 = memory.rates.rate
        a0 = rate0 + h / memory.step * (memory.aux - rate0)
        return a0, ((1.0 - self.alpha_f) * rate1 + self.alpha_f * rate0 - self.alpha_m * a0) / (1.0 - self.alpha_m)

    # short steps ---------------------------------------------------------------------------------------------------
    def is_brief(self, h: float, mode: Mode) -> bool:
        """Whether the kernel takes a step of Heun's method in the place of one so short."""
        return h < BRIEF * self.full and (bool(mode.held) or h < BRIEFEST * self.full)

    def brief(self, motion: Motion, memory: Memory, mode: Mode, t1: float, dh: Vector) -> tuple[Motion, Memory]:
        """A step of Heun's method with consistent accelerations."""
        n_v, charts, h = self.programs.columns.n_v, self.programs.charts, t1 - motion.t
        first, last = memory.rates, memory.rates
        for _ in range(2):
            mean, of_mean = first.rate / 3.0 + last.rate / 6.0, first.of_rate / 3.0 + last.of_rate / 6.0
            way = h * (motion.y + h * mean)[:n_v]
            of_way = h * (motion.tangent.y + h * of_mean)[:n_v]
            of_way = of_way + (motion.y + 2.0 * h * mean)[:n_v, np.newaxis] * dh
            q, of_q = charts.compose(motion.q, way), charts.carried(motion.q, way, motion.tangent.q, of_way)
            sum_ = first.rate + last.rate
            y = motion.y + 0.5 * h * sum_
            of_y = motion.tangent.y + 0.5 * h * (first.of_rate + last.of_rate) + 0.5 * sum_[:, np.newaxis] * dh
            tangent = replace(motion.tangent, t=motion.tangent.t + dh, q=of_q, y=of_y)
            end = Motion(t1, q, y, motion.anchors, tangent)
            last = consistent_rates(self.programs, end, mode, last)
        return end, Memory(last, last.rate.copy(), last.of_rate.copy(), h)
