"""The floor: equations derived by hand for one scene and compiled by numba, in RK4 and DOP853 loops of their own.

No framework; it tells what the equations cost when nothing is general.
"""

from __future__ import annotations

from functools import cache, partial
from typing import Any

import numba
import numpy as np
from numba import njit
from scipy.integrate._ivp import dop853_coefficients as tableau

from benchmarks.peers.equations import Problem, problem
from benchmarks.peers.race import Attempt, Outcome, Sweep, seconds
from benchmarks.peers.scenes import Scene

A, B, LATE, EARLY = tableau.A[:12, :12].copy(), tableau.B.copy(), tableau.E5.copy(), tableau.E3.copy()
SUBSTEPS = {"S3b": (10, 30, 100, 300), "S5": (200, 500, 1000), "S5b": (100, 1000, 10000)}
OF_CHAINS = {"S1": (10, 20, 50, 100, 200, 500), "S1d": (10, 20, 50, 100, 200)}
TOLS = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13)


def version() -> str:
    """Of numba."""
    return str(numba.__version__)


@cache
def compiled(f: Any) -> Any:
    """A right-hand side as machine code."""
    return njit(cache=False)(f)


@njit
def rk4(f: Any, start: Any, times: Any, substeps: int, P: Any) -> Any:  # pragma: no cover - compiled
    """Classical Runge–Kutta, `substeps` equal steps between output times."""
    n = start.size
    rows, y = np.empty((times.size, n)), start.copy()
    k1, k2, k3, k4 = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    rows[0] = y
    for row in range(1, times.size):
        h = (times[row] - times[row - 1]) / substeps
        for _ in range(substeps):
            f(y, k1, P)
            f(y + 0.5 * h * k1, k2, P)
            f(y + 0.5 * h * k2, k3, P)
            f(y + h * k3, k4, P)
            y += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        rows[row] = y
    return rows


@njit
def dop853(f: Any, start: Any, times: Any, rtol: float, atol: float, P: Any) -> Any:  # pragma: no cover - compiled
    """Dormand–Prince 8(5,3) with steps cut at the output times; (rows, accepted steps)."""
    n = start.size
    rows, y, K = np.empty((times.size, n)), start.copy(), np.zeros((13, n))
    rows[0] = y
    f(y, K[0], P)
    accepted, step = 0, 1e-3 * (times[-1] - times[0])
    for row in range(1, times.size):
        t = times[row - 1]
        while t < times[row]:
            left = times[row] - t
            last = step >= left * (1.0 - 1e-12)
            h = left if last else step
            for s in range(1, 12):
                f(y + h * _sum(A[s], K, s, n), K[s], P)
            after = y + h * _sum(B, K, 12, n)
            f(after, K[12], P)
            size = atol + rtol * np.maximum(np.abs(y), np.abs(after))
            late = np.sum((_sum(LATE, K, 13, n) / size) ** 2)
            early = np.sum((_sum(EARLY, K, 13, n) / size) ** 2)
            error = h * late / np.sqrt((late + 0.01 * early) * n) if late + early > 0.0 else 0.0
            factor = 10.0 if error == 0.0 else min(10.0, max(0.2, 0.9 * error**-0.125))
            if error < 1.0:
                t, y, accepted = (times[row] if last else t + h), after, accepted + 1
                K[0] = K[12]
                step = max(step, h * factor) if last and factor > 1.0 else h * factor
            else:
                step = h * min(1.0, factor)
        rows[row] = y
    return rows, accepted


@njit
def _sum(weights: Any, K: Any, count: int, n: int) -> Any:  # pragma: no cover - compiled
    total = np.zeros(n)
    for q in range(count):
        if weights[q] != 0.0:
            total += weights[q] * K[q]
    return total


def _by_rk4(scene: Scene, posed: Problem, substeps: int) -> Outcome:
    found: list[Any] = []
    spent = seconds(lambda: found.append(rk4(compiled(posed.f), posed.start, scene.times, substeps, posed.P)))
    return Outcome(posed.compared(found[0]), spent, substeps * (len(scene.times) - 1))


def _by_dop853(scene: Scene, posed: Problem, tol: float) -> Outcome:
    found: list[Any] = []
    f, rtol = compiled(posed.f), max(tol, 1e-14)
    spent = seconds(lambda: found.append(dop853(f, posed.start, scene.times, rtol, 1e-2 * tol, posed.P)))
    return Outcome(posed.compared(found[0][0]), spent, found[0][1])


def _substeps(scene: Scene, posed: Problem) -> tuple[int, ...]:
    if scene.family == "S2":
        return tuple(max(4, posed.shown.shape[1] // 4) * k for k in (1, 2, 4, 16))
    return {**SUBSTEPS, **OF_CHAINS}.get(scene.name, ())


def attempts(scene: Scene) -> list[Sweep]:
    """RK4 and DOP853 on scenes that are an ordinary differential equation; not S3a, which would be a pendulum."""
    posed = problem(scene.name)
    if posed is None or scene.family == "S3a":
        return []
    f, two = compiled(posed.f), scene.times[:2]
    rk4(f, posed.start, two, 1, posed.P), dop853(f, posed.start, two, 1e-3, 1e-3, posed.P)
    fixed = [
        Attempt(f"RK4 h={scene.every / k:.3g}", partial(_by_rk4, scene, posed, k)) for k in _substeps(scene, posed)
    ]
    return [fixed, [Attempt(f"DOP853 rtol={tol:g}", partial(_by_dop853, scene, posed, tol)) for tol in TOLS]]
