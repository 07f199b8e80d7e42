"""The scheme behind references: an explicit Runge–Kutta method of order 8 on the mechanism's own accelerations.

The accelerations solve ``[M R; B 0] (a, λ) = −(f, bias)``, so that rows hold at acceleration level. Dormand & Prince's
method 8(5,3) (Hairer, Nørsett & Wanner, Solving Ordinary Differential Equations I, II.5), or Radau IIA of order 5 for
stiff scenes, integrates them with error control in strides of its own, which reach over many steps of the run. Each
step reads the dense output of the stride it lies in, so that an event is located on it, and is moved back to the rows
along their normals in the metric of M::

    M U + Bᵀν = 0,  h + B U = 0        M W + Bᵀχ = 0,  ḣ + B W = 0

Events, impacts, friction and restarts are those of every other scheme: they come from outside.
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Any, ClassVar, Literal

import numpy as np
from scipy.integrate import DOP853, Radau

from mbd.arrays import Vector
from mbd.dataclass import dataclass
from mbd.equal import SMALL_SUM_RTOL
from mbd.integrators import Integrator, StepReport, StepResult
from mbd.simulation.run.plain import MechanismSystem
from mbd.state import Mode, State

Method = Literal["DOP853", "Radau"]

METHODS: dict[str, Any] = {"DOP853": DOP853, "Radau": Radau}

MOST_STRIDES = {"DOP853": 400, "Radau": 4000}
"""Strides within one step after which the method gives up: the scene is too stiff for it."""
MAX_CACHED_INTERVALS = 1000
"""Dense outputs of a course that are kept; only the last few are needed."""


class Balance:
    """Accelerations and projection of a mechanism in one contact mode."""

    def __init__(self, system: MechanismSystem, mode: Mode) -> None:
        self.system, self.mode, mechanism = system, mode, system.mechanism
        self.rows, self.penalties = system.active(mode)
        layout = self.layout = mechanism.layout
        self.picked = np.array(self.rows, dtype=np.intp)
        velocity = [mechanism.equations.rows[row].is_velocity for row in self.rows]
        self.held = ~np.array(velocity, dtype=bool) if velocity else np.zeros(0, dtype=bool)
        self.loaded = bool(np.any(system.slip))  # friction follows multipliers: their iteration is the system's
        self.matrix = np.zeros((layout.n + len(self.rows),) * 2)
        self.block = mechanism.block(0.0, np.zeros(layout.n_q), np.zeros(layout.n), system.anchors, self.penalties)
        self.block[layout.slip : layout.shift] = system.slips
        self.out = np.zeros(mechanism.sizes["accelerations"])
        self.configuration = mechanism.equations.configuration

    def _evaluate(self, t: float, q: Vector, y: Vector) -> tuple[Vector, Vector, Vector, Vector]:
        """The matrix of the rows, f, and (h, ḣ, bias) of the active ones."""
        at, n, m = self.layout, self.layout.n, self.layout.n_rows
        self.block[0], self.block[at.q : at.x], self.block[at.v : at.a] = t, q, y
        self.system.mechanism.accelerations(self.block, self.system.parameters, self.out)
        out, picked = self.out, self.picked
        b = n * n + n + n * m
        self.matrix[:n, :n] = out[: n * n].reshape(n, n)
        if len(picked):
            self.matrix[:n, n:] = out[n * n + n : b].reshape(n, m)[:, picked]
            self.matrix[n:, :n] = out[b : b + m * n].reshape(m, n)[picked]
        each = out[b + m * n : b + m * n + 3 * m].reshape(3, m)[:, picked]
        return self.matrix, out[n * n : n * n + n], each, self.matrix[n:, :n]

    def accelerations(self, t: float, q: Vector, y: Vector) -> tuple[Vector, Vector]:
        """(v̇, ż) and λ."""
        if self.loaded:
            return self.system.accelerations(t, q, y, self.mode)
        matrix, f, each, _ = self._evaluate(t, q, y)
        solved = np.linalg.solve(matrix, -np.concatenate([f, each[2]]))
        return solved[: self.layout.n], solved[self.layout.n :]

    def on_rows(self, t: float, q: Vector, y: Vector) -> tuple[Vector, Vector]:
        """The nearest positions and velocities that the rows allow."""
        n, n_v = self.layout.n, self.layout.n_v
        for _ in range(4 if len(self.rows) else 0):  # one does where rows are smooth
            matrix, _, (h, rate, _), H = self._evaluate(t, q, y)
            h = np.where(self.held, h, 0.0)
            size = 1.0 + max(np.max(np.abs(q)), np.max(np.abs(y)))
            if max(np.max(np.abs(h)), np.max(np.abs(rate))) <= SMALL_SUM_RTOL * size:
                break
            right = np.zeros((n + len(h), 2))
            right[n:, 0], right[n:, 1] = -h, -rate
            metric = matrix.copy()
            metric[:n, n:] = H.T
            moves = np.linalg.solve(metric, right)
            q = self.configuration.compose(q, moves[:n_v, 0])
            y = y + np.where(np.arange(n) < n_v, moves[:n, 1], 0.0)
        return q, y


class Course:
    """The motion from a state on in one mode, integrated as far as it has been asked for; what is known is kept.

    Asking twice gives the same answer, so that a step may be tried again with any size.
    """

    def __init__(self, scheme: RungeKuttaReference, balance: Balance, t: float, q: Vector, y: Vector) -> None:
        self.scheme, self.balance = scheme, balance
        self.pieces: list[Any] = []
        self.reached, self.q, self.y = t, q, y
        self.stride: float | None = None
        size = len(q) + len(y)
        self.sizes = np.array(scheme.sizes) if len(scheme.sizes) == size else np.ones(size)

    def at(self, t: float, step: float) -> tuple[Vector, Vector]:
        """(q, y) at a time, from the dense output of the stride that holds it, on the rows."""
        most = MOST_STRIDES[self.scheme.method]
        for _ in range(most):
            if self.reached >= t and self.pieces:
                break
            self._stride(step)
        else:
            raise _TooStiffError(f"{most} strides of {self.scheme.method} did not span a step of {step:.3g} s")
        piece = self.pieces[-1]
        for each in reversed(self.pieces):
            if each.t_max < t:
                break
            piece = each
        found, n_q = piece(t), len(self.q)
        return self.balance.on_rows(t, self.balance.configuration.normalise(found[:n_q]), found[n_q:])

    def _stride(self, step: float) -> None:
        """One more stride, moved back to the rows at its end."""
        n_q, n_v = len(self.q), self.balance.layout.n_v

        def slope(time: float, both: Vector) -> Vector:
            y = both[n_q:]
            rate, _ = self.balance.accelerations(time, both[:n_q], y)
            return np.concatenate([self.balance.configuration.rates(both[:n_q], y[:n_v]), rate])

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a first guess too long
            tolerance = self.scheme.tolerance
            solver = METHODS[self.scheme.method](
                slope, self.reached, np.concatenate([self.q, self.y]), np.inf, first_step=self.stride or 0.01 * step,
                rtol=max(tolerance, 1e-13), atol=tolerance * self.sizes,
            )  # fmt: skip
            problem = solver.step()
        if problem:
            raise _TooStiffError(problem)
        if len(self.pieces) > MAX_CACHED_INTERVALS:
            del self.pieces[: MAX_CACHED_INTERVALS // 2]
        self.pieces.append(solver.dense_output())
        q = self.balance.configuration.normalise(solver.y[:n_q])
        self.q, self.y = self.balance.on_rows(solver.t, q, solver.y[n_q:])
        self.reached, self.stride = float(solver.t), float(solver.h_abs)


@dataclass(frozen=True)
class OnCourse:
    """What the scheme keeps: the course; rates and multipliers at the accepted state."""

    course: Course
    rate: Vector
    lam: Vector


@dataclass(frozen=True)
class RungeKuttaReference(Integrator):
    """Dormand & Prince 8(5,3) or Radau IIA with error control, on accelerations consistent with the rows.

    Parameters
    ----------
    tolerance : of the local error, relative to each component and to its `sizes`
    sizes : of q, v and z [m, rad, …]; () stands for 1
    method : 'DOP853', or 'Radau' for stiff scenes
    """

    any_chart: ClassVar[bool] = True

    tolerance: float = 1e-12
    sizes: tuple[float, ...] = ()
    method: Method = "DOP853"

    def order(self, system: Any = None) -> int:
        """8, and 5 for Radau."""
        return 8 if self.method == "DOP853" else 5

    def start(self, system: Any, state: State, mode: Mode, dt: float) -> OnCourse:
        """A new course."""
        balance = Balance(system, mode)
        y = np.concatenate([state.v, state.z])
        rate, lam = balance.accelerations(state.time, state.q, y)
        return OnCourse(Course(self, balance, state.time, state.q, y), rate, lam)

    def step(self, system: Any, state: State, dt: float, mode: Mode, memory: OnCourse) -> StepResult:
        """The state at t + dt of the course."""
        t, course = state.time + dt, memory.course
        try:
            q, y = course.at(t, dt)
            rate, lam = course.balance.accelerations(t, q, y)
        except (ArithmeticError, np.linalg.LinAlgError, _TooStiffError) as error:
            return StepResult(state, memory, StepReport(False, 0, 1.0, str(error)))
        after = replace(state, time=t, q=q, v=y[: len(state.v)], z=y[len(state.v) :])
        return StepResult(after, OnCourse(course, rate, lam), StepReport(True))


class _TooStiffError(RuntimeError):
    """The method needs too many strides."""
