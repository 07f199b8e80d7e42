"""One step of HHT in the classical averaged form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mbd.arrays import Vector
from mbd.dataclass import dataclass
from mbd.integrators.base import Point, StepReport, StepResult, System, Terms, composed
from mbd.integrators.stepping import SchemeMemory
from mbd.kernel.codes import EPS
from mbd.kernel.schemes.iteration import MAX_ITERATIONS
from mbd.state import Mode, State


class AveragedStep:
    """``M(q₁) a₁ + (1−α)(f + Bᵀλ)₁ + α (f + Bᵀλ)₀ = 0``, ``h(q₁) = 0`` with Newmark's formulas for q₁, v₁.

    Forces are averaged over the step, the mass matrix is not, which costs one order unless M is constant.
    """

    def __init__(
        self, coefficients: Coefficients, tolerance: float, system: System, state: State, dt: float, mode: Mode,
        memory: SchemeMemory,
    ) -> None:  # fmt: skip
        self.coefficients, self.tolerance, self.system = coefficients, tolerance, system
        self.state, self.dt, self.mode, self.memory = state, dt, mode, memory

    def _evaluate(self, t: float, x: Vector, y: Vector, rate: Vector, lam: Vector, c: tuple[float, float]) -> Terms:
        return self.system.evaluate(Point(t, self.state.q, x, y, rate, lam), self.mode, c)

    def run(self) -> StepResult:
        """Newton on (a₁, λ₁); the part α M a₁ enters with the mass matrix of the iterate."""
        k, dt, memory = self.coefficients, self.dt, self.memory
        alpha, n_v = k.alpha_f, len(self.state.v)
        c_C, c_K = k.gamma * dt, k.beta * dt * dt
        y0 = np.concatenate([self.state.v, self.state.z])
        a0 = memory.aux
        none = np.zeros(n_v)
        old = self._evaluate(self.state.time, none, y0, a0, memory.lam, (0.0, 0.0))
        force0 = old.r - np.asarray(old.S) @ a0
        a1, lam = a0.copy(), memory.lam.copy()
        far = np.abs(y0) / (k.beta * dt) + np.abs(a0)  # accelerations of which x is made, as large as they come
        t1, error, before = self.state.time + dt, np.inf, np.inf
        for iteration in range(MAX_ITERATIONS):
            y1 = y0 + dt * ((1.0 - k.gamma) * a0 + k.gamma * a1)
            x = dt * self.state.v + dt * dt * ((0.5 - k.beta) * a0[:n_v] + k.beta * a1[:n_v])
            terms = self._evaluate(t1, x, y1, a1, lam, (c_C, c_K))
            mass = np.asarray(self._evaluate(t1, x, y1, a1, lam, (0.0, 0.0)).S)
            r = (1.0 - alpha) * terms.r + alpha * (mass @ a1 + force0)
            scale = np.max(np.abs(mass) @ np.abs(a1)) + np.max(np.abs(force0), initial=0.0) + 1e-300
            terms_of_r = 0.0 if terms.scale_r is None else float(np.max(terms.scale_r))  # at rest they cancel
            stiff = float(np.max(np.abs(np.asarray(terms.S) - mass) @ far))  # what x loses in forces
            least = 16.0 * EPS * max(terms_of_r, stiff)
            error = float(np.max(np.abs(r)) / max(1e-3 * self.tolerance * scale, least))
            fast = np.zeros(len(terms.h), bool) if terms.velocity is None else np.asarray(terms.velocity, dtype=bool)
            held = np.where(fast, terms.rate, terms.h)
            error = max(error, float(np.max(np.abs(held), initial=0.0)) / (64.0 * EPS))
            if not np.isfinite(error):
                return self._failed(iteration, error, "a force or a row is not finite")
            if error <= 1.0 or (iteration >= 2 and error > 0.5 * before and error < 1e3):
                return self._done(t1, x, y1, a1, lam, StepReport(True, iteration, error))
            before = error
            m = len(terms.h)
            S = (1.0 - alpha) * np.asarray(terms.S) + alpha * mass
            matrix, right = S, -r
            if m:
                R = (1.0 - alpha) * np.asarray(terms.R)
                matrix = np.block([[S, R], [np.asarray(terms.H), np.zeros((m, m))]])
                right = np.concatenate([-r, -held / np.where(fast, c_C, c_K)])
            try:
                change = np.linalg.solve(matrix, right)
            except np.linalg.LinAlgError:
                return self._failed(iteration, error, "the Newton matrix is singular")
            a1, lam = a1 + change[: len(r)], lam + change[len(r) :]
        return self._failed(MAX_ITERATIONS, error, "Newton did not converge")

    def _failed(self, iterations: int, error: float, why: str) -> StepResult:
        return StepResult(self.state, self.memory, StepReport(False, iterations, error, why))

    def _done(self, t1: float, x: Vector, y1: Vector, a1: Vector, lam: Vector, report: StepReport) -> StepResult:
        old, memory, dt, n_v = self.state, self.memory, self.dt, len(self.state.v)
        slope, lam_slope = (a1 - memory.rate) / dt, (lam - memory.lam) / dt
        after = replace(memory, rate=a1, aux=a1, lam=lam, slope=slope, lam_slope=lam_slope, step=dt)
        q1 = composed(self.system, old.q, x)
        state = State(
            t1, q1, y1[:n_v], y1[n_v:], old.mode, old.armed, old.anchors, old.names, old.velocity_names, {},
            old.parameters,
        )  # fmt: skip
        return StepResult(state, after, report)


@dataclass(frozen=True)
class Coefficients:
    """α_m, α_f, β, γ."""

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float

    @property
    def second_order(self) -> bool:
        """γ = ½ + α_f − α_m."""
        return abs(self.gamma - 0.5 - self.alpha_f + self.alpha_m) < 1e-12

    @property
    def undamped(self) -> bool:
        """Spectral radius 1 at infinite frequency (ρ∞ = 1): nothing damps the round-off of the multipliers."""
        return abs(self.rho_inf - 1.0) < 1e-9

    @property
    def rho_inf(self) -> float:
        """Spectral radius of the amplification matrix as ω dt → ∞."""
        beta, gamma = self.beta, self.gamma
        half, product = 0.5 * (0.5 + gamma - 2.0 * beta) / beta, (0.5 - gamma + beta) / beta
        split = half * half - product  # of the roots of z² + 2 half z + product; complex or double where it is not > 0
        pair = float(np.sqrt(product)) if split <= 1e-14 * half * half else abs(half) + float(np.sqrt(split))
        return max(abs(self.alpha_f / (1.0 - self.alpha_f)), pair)
