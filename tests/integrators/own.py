"""Integrators as a user would write them: `order`, `start` and `step`, nothing else."""

from dataclasses import dataclass

import numpy as np

from mbd.integrators import Integrator, Point, StepReport, StepResult
from mbd.integrators.base import consistent_rates
from mbd.state import State


def rows_of(system, state, mode) -> int:
    """How many rows are active: as many as there are multipliers."""
    _, lam = consistent_rates(system, state.time, state.q, np.concatenate([state.v, state.z]), mode)
    return len(lam)


def saddle(system, t, q, y, m, mode):
    """``[M R; H 0]`` and the terms, with zero accelerations and multipliers."""
    point = Point(t, q, np.zeros(len(q)), y, np.zeros(len(y)), np.zeros(m))
    terms = system.evaluate(point, mode, (0.0, 0.0))
    if not m:
        return terms, np.asarray(terms.S)
    return terms, np.block([[terms.S, terms.R], [terms.H, np.zeros((m, m))]])


def moved(t, q, y, n_v) -> State:
    return State(t, q, y[:n_v], y[n_v:])


@dataclass(frozen=True)
class SemiImplicitEuler(Integrator):
    """v₁ from M (v₁ − v₀) + dt (f + Bᵀλ) = 0 with ḣ = 0 and a pull of h towards 0; then q₁ = q₀ + dt v₁."""

    pull: float = 0.2

    def order(self, system=None):
        return 1

    def start(self, system, state, mode, dt):
        return rows_of(system, state, mode)

    def step(self, system, state, dt, mode, memory):
        y, n_v, t1 = np.concatenate([state.v, state.z]), len(state.v), state.time + dt
        terms, matrix = saddle(system, t1, state.q + dt * state.v, y, memory, mode)
        right = -np.concatenate([dt * terms.r, terms.rate + self.pull * terms.h / dt])
        y1 = y + np.linalg.solve(matrix, right)[: len(y)]
        return StepResult(moved(t1, state.q + dt * y1[:n_v], y1, n_v), memory, StepReport(True, 1))


@dataclass(frozen=True)
class ProjectedMidpoint(Integrator):
    """The explicit midpoint rule on consistent accelerations; what rows drift is projected away."""

    def order(self, system=None):
        return 2

    def start(self, system, state, mode, dt):
        return rows_of(system, state, mode)

    def step(self, system, state, dt, mode, memory):
        y, n_v, t1 = np.concatenate([state.v, state.z]), len(state.v), state.time + dt
        rate, _ = consistent_rates(system, state.time, state.q, y, mode)
        middle = y + 0.5 * dt * rate
        rate, _ = consistent_rates(system, state.time + 0.5 * dt, state.q + 0.5 * dt * state.v, middle, mode)
        q, y1 = state.q + dt * middle[:n_v], y + dt * rate
        for _ in range(3 if memory else 0):
            terms, matrix = saddle(system, t1, q, y1, memory, mode)
            right = np.zeros((len(matrix), 2))
            right[len(y) :] = -np.column_stack([terms.h, terms.rate])
            change = np.linalg.solve(matrix, right)
            q, y1 = q + change[:n_v, 0], y1 + change[: len(y), 1]
        return StepResult(moved(t1, q, y1, n_v), memory, StepReport(True, 3))
