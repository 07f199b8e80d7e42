"""scipy's solve_ivp on the same compiled right-hand sides; scenes with impacts by hand, with its events."""

from __future__ import annotations

from functools import partial
from typing import Any

import scipy
from scipy.integrate import solve_ivp

from benchmarks.peers.equations import Problem, problem
from benchmarks.peers.race import Attempt, Outcome, Sweep, seconds
from benchmarks.peers.references import FINEST, IMPACTS, rhs_of
from benchmarks.peers.scenes import Scene
from benchmarks.peers.systems.compiled import compiled

TOLS = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13)
BY_EVENTS = (1e-4, 1e-7, 1e-10, 1e-12)


def version() -> str:
    """Of scipy."""
    return str(scipy.__version__)


def _smooth(scene: Scene, posed: Problem, method: Any, tol: float) -> Outcome:
    """Steps are calls of the right-hand side."""
    rhs, found = rhs_of(posed, compiled(posed.f)), []
    span, rtol = (0.0, scene.times[-1]), max(tol, FINEST)

    def run() -> None:
        found.append(solve_ivp(rhs, span, posed.start, method, scene.times, rtol=rtol, atol=1e-2 * tol))

    spent = seconds(run)
    return Outcome(posed.compared(found[0].y.T), spent, found[0].nfev)


def _impacts(scene: Scene, tol: float) -> Outcome:
    found: list[Any] = []
    spent = seconds(lambda: found.append(IMPACTS[scene.name](scene.times, tol)))
    return Outcome(found[0], spent, 0)


def attempts(scene: Scene) -> list[Sweep]:
    """DOP853 and Radau; DOP853 with events where there are impacts."""
    posed = problem(scene.name)
    sweeps: list[Sweep] = []
    if posed is not None and scene.family != "S3a":
        rhs_of(posed, compiled(posed.f))(0.0, posed.start)
        methods = ("DOP853",) if scene.name == "S3b" else ("DOP853", "Radau")
        for method in methods:
            tols = [tol for tol in TOLS if method == "DOP853" or tol >= 1e-9]
            sweeps.append(
                [Attempt(f"{method} rtol={tol:g}", partial(_smooth, scene, posed, method, tol)) for tol in tols]
            )
    if scene.name in IMPACTS and scene.name != "S5b":
        sweeps.append([Attempt(f"DOP853 and events, rtol={tol:g}", partial(_impacts, scene, tol)) for tol in BY_EVENTS])
    return sweeps
