"""Integrators as a user would write them: `order`, `start` and `step`, nothing else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mbd.integrators import Integrator, Point, StepReport, StepResult
from mbd.integrators.base import consistent_rates
from mbd.state import State

__all__ = ["HalfExplicitMidpoint", "SemiImplicitEuler"]


def moved(state: State, t, q, y) -> State:
    n_v = len(state.v)
    return State(t, q, y[:n_v], y[n_v:], state.mode, state.armed, state.anchors, state.names, state.velocity_names)


@dataclass(frozen=True)
class SemiImplicitEuler(Integrator):
    """v₁ from M (v₁ − v₀) + dt (f + Bᵀλ) = 0 with ḣ(q₁, v₁) = 0 and a pull of h towards 0; then q₁ = q₀ + dt v₁."""

    pull: float = 0.2

    def order(self, system=None):
        return 1

    def start(self, system, state, mode, dt):
        return None

    def step(self, system, state, dt, mode, memory):
        y = np.concatenate([state.v, state.z])
        n_v, t1 = len(state.v), state.time + dt
        nothing = np.zeros(len(y))
        rows = len(system.evaluate(Point(t1, state.q, np.zeros(n_v), y, nothing, np.zeros(m_of(system, mode))), mode,
                                   None).h)  # fmt: skip
        point = Point(t1, state.q, dt * state.v, y, nothing, np.zeros(rows))
        terms = system.evaluate(point, mode, (0.0, 0.0))
        M, R, H = np.asarray(terms.S), np.asarray(terms.R), np.asarray(terms.H)
        matrix = np.block([[M, R], [H, np.zeros((rows, rows))]])
        right = np.concatenate([-dt * terms.r, -terms.rate - self.pull * terms.h / dt])
        y1 = y + np.linalg.solve(matrix, right)[: len(y)]
        return StepResult(moved(state, t1, state.q + dt * y1[:n_v], y1), None, StepReport(True, 1))


@dataclass(frozen=True)
class HalfExplicitMidpoint(Integrator):
    """ẏ at the middle of the step from consistent accelerations; drift of rows is removed by projection."""

    def order(self, system=None):
        return 2

    def start(self, system, state, mode, dt):
        return None

    def step(self, system, state, dt, mode, memory):
        y, n_v = np.concatenate([state.v, state.z]), len(state.v)
        rate, _ = consistent_rates(system, state.time, state.q, y, mode)
        half = state.q + 0.5 * dt * state.v, y + 0.5 * dt * rate
        rate, _ = consistent_rates(system, state.time + 0.5 * dt, *half, mode)
        q, y1 = state.q + dt * half[1][:n_v], y + dt * rate
        t1 = state.time + dt
        for _ in range(3):
            q, y1 = projected(system, t1, q, y1, mode)
        return StepResult(moved(state, t1, q, y1), None, StepReport(True, 1))


def projected(system, t, q, y, mode):
    """One Newton step onto h = 0 and ḣ = 0 in the metric of M."""
    n, n_v, m = len(y), system.n_v, m_of(system, mode)
    if not m:
        return q, y
    terms = system.evaluate(Point(t, q, np.zeros(n_v), y, np.zeros(n), np.zeros(m)), mode, (0.0, 0.0))
    M, R, H = np.asarray(terms.S), np.asarray(terms.R), np.asarray(terms.H)
    right = np.zeros((n + m, 2))
    right[n:, 0], right[n:, 1] = -terms.h, -terms.rate
    change = np.linalg.solve(np.block([[M, R], [H, np.zeros((m, m))]]), right)
    return q + change[:n_v, 0], y + change[:n, 1]


def m_of(system, mode) -> int:
    """Number of active rows."""
    rows = getattr(system, "rows", None)
    return rows(mode) if rows is not None else 0
