"""Smooth problems in a few numbers, on which integrators show their order."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.dataclass import dataclass
from mbd.integrators.base import Point, System, Terms
from mbd.state import Mode, State


@dataclass(frozen=True)
class Problem:
    """A system, its start, and (q, v, z) at the end by an explicit method of order 8.

    duration : from t = 0 [s]; rows : how many rows it has
    """

    system: System
    start: State
    end: Vector
    duration: float
    rows: int = 0


class VaryingMass(System):
    """``(1 + q²) v̇ + q v² + sin q = 0``: T = ½ (1 + q²) v², V = −cos q."""

    def evaluate(self, point: Point, mode: Mode, tangent: tuple[float, float] | None) -> Terms:
        q, v, a = point.q + point.x, point.y, point.rate
        parts = np.abs([(1.0 + q * q) * a, q * v * v, np.sin(q)]).sum(axis=0)
        r = (1.0 + q * q) * a + q * v * v + np.sin(q)
        if tangent is None:
            return Terms(r, scale_r=parts)
        S = 1.0 + q * q + tangent[0] * 2.0 * q * v + tangent[1] * (2.0 * q * a + v * v + np.cos(q))
        return Terms(r, S.reshape(1, 1), scale_r=parts)


class Driven(System):
    """``v̇ + 0.3 v + sin q = cos 2t``, a damped pendulum that is driven."""

    constant_mass = True

    def evaluate(self, point: Point, mode: Mode, tangent: tuple[float, float] | None) -> Terms:
        q, v, a = point.q + point.x, point.y, point.rate
        drive = np.cos(2.0 * point.t)
        scale = np.abs(a) + 0.3 * np.abs(v) + np.abs(np.sin(q)) + abs(drive)
        r = a + 0.3 * v + np.sin(q) - drive
        if tangent is None:
            return Terms(r, scale_r=scale)
        return Terms(r, (1.0 + 0.3 * tangent[0] + tangent[1] * np.cos(q)).reshape(1, 1), scale_r=scale)


class Actuated(System):
    """``v̇ + q = z``, ``ż = cos t − z``: an oscillator and a first-order state that pulls it."""

    constant_mass = True
    n_z = 1

    def evaluate(self, point: Point, mode: Mode, tangent: tuple[float, float] | None) -> Terms:
        q, z, rate = float(point.q[0] + point.x[0]), float(point.y[1]), point.rate
        r = rate + np.array([q - z, z - np.cos(point.t)])
        scale = np.abs(rate) + np.array([abs(q) + abs(z), abs(z) + 1.0])
        if tangent is None:
            return Terms(r, scale_r=scale)
        C = np.array([[0.0, -1.0], [0.0, 1.0]])
        return Terms(r, np.eye(2) + tangent[0] * C + tangent[1] * np.diag([1.0, 0.0]), scale_r=scale)


@dataclass(frozen=True)
class Rod(System):
    """A pendulum in x and y: ``v̇ + (0, g) + λ (x, y) = 0``, ``h = ½ (x² + y² − 1) = 0``, in g = 1 units."""

    stabilized: bool = True
    constant_mass = True

    def evaluate(self, point: Point, mode: Mode, tangent: tuple[float, float] | None) -> Terms:
        p, v, lam = point.q + point.x, point.y, float(point.lam[0])
        h, rate = np.array([0.5 * (p @ p - 1.0)]), np.array([p @ v])
        r = point.rate + np.array([0.0, 1.0]) + lam * p
        scale = np.abs(point.rate) + np.array([0.0, 1.0]) + np.abs(lam * p)
        rates = rate if self.stabilized else np.zeros(1)
        sizes: dict[str, Any] = {"scale_r": scale, "scale_h": np.ones(1), "scale_rate": np.ones(1)}
        if tangent is None:
            return Terms(r, None, h, rates, **sizes)
        c_C, c_K = tangent
        H = p.reshape(1, 2).copy()
        if self.stabilized and c_C != 0.0:
            H = H + (c_K / c_C) * v
        return Terms(r, (1.0 + c_K * lam) * np.eye(2), h, rates, p.reshape(2, 1).copy(), H, **sizes)

    def accelerations(self, t: float, q: Vector, y: Vector, mode: Mode) -> tuple[Vector, Vector]:
        """v̇ and λ from ḧ = p · v̇ + v · v = 0."""
        lam = (y @ y - q[1]) / (q @ q)
        return -np.array([0.0, 1.0]) - lam * q, np.array([lam])


class _Broken(System):
    def __init__(self, system: System) -> None:
        self.whole, self.n_z = system, system.n_z

    def evaluate(self, point: Point, mode: Mode, tangent: tuple[float, float] | None) -> Terms:
        terms = self.whole.evaluate(point, mode, tangent)
        return replace(terms, r=np.full_like(terms.r, np.nan))

    def accelerations(self, t: float, q: Vector, y: Vector, mode: Mode) -> tuple[Vector, Vector]:
        rate, lam = self.whole.accelerations(t, q, y, mode)
        return np.nan * rate, np.nan * lam

    def compose(self, q: Vector, x: Vector) -> Vector:
        return self.whole.compose(q, x)


def broken(system: System) -> System:
    """The system, whose balance is not a number."""
    return _Broken(system)


def _solved(slope: Callable[[float, Vector], Any], start: list[float], duration: float) -> Vector:
    from scipy.integrate import solve_ivp

    found = solve_ivp(slope, (0.0, duration), start, "DOP853", rtol=1e-13, atol=1e-14)
    return np.asarray(found.y[:, -1], dtype=float)


def _varying(stabilized: bool) -> Problem:
    end = _solved(lambda t, y: [y[1], -(y[0] * y[1] ** 2 + np.sin(y[0])) / (1.0 + y[0] ** 2)], [1.0, 0.5], 2.0)
    return Problem(VaryingMass(), State(0.0, np.array([1.0]), np.array([0.5])), end, 2.0)


def _driven(stabilized: bool) -> Problem:
    end = _solved(lambda t, y: [y[1], np.cos(2.0 * t) - 0.3 * y[1] - np.sin(y[0])], [0.7, -0.2], 2.0)
    return Problem(Driven(), State(0.0, np.array([0.7]), np.array([-0.2])), end, 2.0)


def _actuated(stabilized: bool) -> Problem:
    end = _solved(lambda t, y: [y[1], y[2] - y[0], np.cos(t) - y[2]], [0.5, 0.3, -0.4], 2.0)
    return Problem(Actuated(), State(0.0, np.array([0.5]), np.array([0.3]), np.array([-0.4])), end, 2.0)


def _rod(stabilized: bool) -> Problem:
    angle, rate = _solved(lambda t, y: [y[1], -np.sin(y[0])], [1.0, 0.4], 2.0)
    place, way = (np.array([np.sin(a), -np.cos(a)]) for a in (1.0, angle))
    start = State(0.0, place, 0.4 * np.array([np.cos(1.0), np.sin(1.0)]))
    end = np.concatenate([way, rate * np.array([np.cos(angle), np.sin(angle)])])
    return Problem(Rod(stabilized), start, end, 2.0, rows=1)


PROBLEMS: dict[str, Callable[[bool], Problem]] = {
    "varying mass": _varying,
    "driven pendulum": _driven,
    "first-order state": _actuated,
    "row": _rod,
}
"""By name: one with M(q), one with time and damping, one with a first-order state, one with a constraint row."""


def problem(name: str, stabilized: bool = True) -> Problem:
    """A problem by name; `stabilized`: whether its row tells its rate, as GGL needs."""
    return PROBLEMS[name](stabilized)
