"""A failing step once more, with Newton's iterations in sight."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.compile.mechanism import Mechanism, ModeCode
from mbd.errors import ModelError
from mbd.integrators import Integrator
from mbd.results.capsule import load
from mbd.results.failure import Failure
from mbd.simulation.diagnostics.failures import residual_names
from mbd.simulation.run.plain import KernelScheme
from mbd.simulation.run.run import Run
from mbd.simulation.simulate import prepared
from mbd.state import State
from mbd.trajectory import Trajectory

__all__ = ["Iteration", "Replay", "Try", "replay"]


SHOWN = 10
"""Iterations of a try that a printed replay shows; `Replay.tries` has them all."""


@dataclass(frozen=True)
class Iteration:
    """What is left of the balance and of the rows at an iterate, by name; empty where it was not evaluated."""

    balance: Mapping[str, float]
    rows: Mapping[str, float]
    rates: Mapping[str, float]


@dataclass(frozen=True)
class Try:
    """Newton's iteration for a step to `time`; a failing step is tried several times, shortened."""

    time: float
    iterations: tuple[Iteration, ...]


@dataclass(frozen=True, eq=False)
class Replay:
    """A failing step, repeated.

    Attributes
    ----------
    failure : what was repeated
    passed : whether the step, or as many as were asked for, went through this time
    reproduced : whether it failed with the same sentence
    message : how it ended
    tries : Newton's iterations of the step that failed, or of the first step
    run : the rows and events of the repetition; its `final` is a state to go on from
    """

    failure: Failure
    passed: bool
    reproduced: bool
    message: str
    tries: Sequence[Try]
    run: Trajectory

    def __repr__(self) -> str:
        verdict = (
            "goes through" if self.passed else "fails as before" if self.reproduced else "fails, with another sentence"
        )
        settings = self.run.settings
        steps = f"dt = {settings['dt']:g} s" if settings.get("dt") is not None else f"tol = {settings['tol']:g}"
        how = f"{settings['integrator']}, {steps}"
        lines = [f"replay from t = {self.failure.time:.9g} s with {how}: {verdict}", f"  {self.message}"]
        for number, one in enumerate(self.tries, 1):
            lines.append(f"  try {number}, step to t = {one.time:.9g} s; largest residuals:")
            shown = [f"    {place:3}  {_line(iteration)}" for place, iteration in enumerate(one.iterations)]
            lines += shown if len(shown) <= SHOWN else [*shown[: SHOWN // 2], "      …", *shown[-SHOWN // 2 :]]
        if not self.tries:
            lines.append("  no Newton iteration of mbd took place; what an integrator of your own solves is its own")
        return "\n".join(lines)


def _line(iteration: Iteration) -> str:
    """The largest entry of each block."""
    parts = []
    for title in ("balance", "rows", "rates"):
        block: Mapping[str, float] = getattr(iteration, title)
        if block:
            name, value = max(block.items(), key=lambda item: abs(item[1]) if math.isfinite(item[1]) else math.inf)
            parts.append(f"{title} {value:10.3g} ({name})")
    return "   ".join(parts)


def replay(
    failure: Failure | str | Path,
    dt: float | None = None,
    integrator: Integrator | None = None,
    steps: int | None = None,
    model: Any = None,
    trusted: bool = False,
) -> Replay:
    """Repeat the step at which a run failed, from the last accepted state.

    With nothing changed it fails again with the same sentence, since the state holds all that the step depends on; the
    answer shows Newton's iterations. With another step, scheme or model it tells whether that goes through.

    Parameters
    ----------
    failure : `Trajectory.failure`, or a file that `Failure.save` wrote
    dt, integrator : in place of those of the run
    steps : how many steps to take; by default as many as reach the instant that could not be reached
    model : in place of that of the failure, such as a repaired one; needed with a file, unless that is trusted
    trusted : read the model that a file holds as a pickle, which may run any code: only for files of your own

    Returns
    -------
    Replay
    """
    capsule = load(failure, model, trusted) if isinstance(failure, str | Path) else failure
    if not isinstance(capsule, Failure):
        came = type(failure).__name__
        raise ModelError(f"replay needs run.failure or the path of a file it was saved to, not {came}")
    model = capsule.model if model is None else model
    scheme = capsule.integrator if integrator is None else integrator
    faults = []
    if model is None:
        faults.append("the failure holds no model; give it: replay(…, model=model)")
    if not isinstance(scheme, Integrator):
        faults.append(f"the integrator {scheme!r} is known by its printed form only; give it: replay(…, integrator=…)")
    step = capsule.dt if dt is None else dt
    if not step > 0.0:
        faults.append(f"dt must be a positive number of seconds, not {dt!r}")
    if faults:
        raise ModelError(faults)
    count = max(1, math.ceil((capsule.attempted - capsule.time) / step - 1e-6)) if steps is None else int(steps)
    run, _ = _prepared(capsule, capsule.state, model, scheme, step, count)
    trajectory, problem = run.complete()
    again, seen = _prepared(capsule, trajectory.final if problem else capsule.state, model, scheme, step, 1)
    if again.stepper.compiled:
        again.stepper.compiled, again.stepper.scheme = False, KernelScheme(again.stepper.own)
    again.march()
    same = bool(problem) and problem == capsule.message
    return Replay(capsule, not problem, same, trajectory.message, seen.tries(again), trajectory)


def _prepared(
    capsule: Failure, start: State, model: Any, scheme: Integrator, dt: float, steps: int
) -> tuple[Run, _Watched]:
    """A run of so many steps with the settings of the one that failed."""
    known = capsule.settings
    until = tuple(known["until"]) if isinstance(known["until"], list) else known["until"]
    options = {name: known[name] for name in ("contact", "impact", "locate", "store", "rest_speed", "backend")}
    options |= {name: known[name] for name in ("tol", "allowed", "longest") if known.get(name) is not None}
    watched: list[_Watched] = []

    def watch(mechanism: Mechanism) -> Any:
        watched.append(_Watched(mechanism))
        return watched[0]

    run = prepared(model, replace(start), scheme, dt, until, dict(start.parameters), options, watch)
    run.limit, run.earlier = steps, capsule.events
    return run, watched[0]


class _Watched:
    """A mechanism that notes every evaluation of the balance within a step."""

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism = mechanism
        self._seen: list[tuple[float, float, tuple[int, ...], Vector]] = []
        self._codes: dict[Any, ModeCode] = {}

    def __getattr__(self, name: str) -> Any:
        return getattr(self._mechanism, name)

    def mode(self, *chosen: Any) -> ModeCode:
        """Code of a mode that can be watched, as `Mechanism.mode` takes it; compiled programs keep their addresses."""
        return self._watched(self._mechanism.mode, *chosen)

    def stepping(self, *chosen: Any) -> ModeCode:
        """The same as the compiled kernel has it."""
        return self._watched(self._mechanism.stepping, *chosen)

    def explicit(self, *chosen: Any) -> ModeCode:
        """The same as explicit steps have it."""
        return self._watched(self._mechanism.explicit, *chosen)

    def _watched(self, make: Callable[..., ModeCode], *chosen: Any) -> ModeCode:
        mode = tuple(one if isinstance(one, bool) else tuple(one) for one in chosen)
        key = (make.__name__, *mode)
        if key not in self._codes:
            code, stabilized = make(*mode), mode[2]
            n, m = self._mechanism.layout.n, len(code.rows)
            kept = n + (2 if stabilized else 1) * m
            tangent = _Seen(code.tangent, self._seen, code.rows, (n + m) ** 2, kept)
            residual = _Seen(code.residual, self._seen, code.rows, 0, kept)
            first = None if code.correction is None else _Seen(code.correction, self._seen, code.rows, 0, kept)
            self._codes[key] = replace(code, tangent=tangent, residual=residual, correction=first)
        return self._codes[key]

    def tries(self, run: Run) -> tuple[Try, ...]:
        """What was seen, step by step."""
        found: list[tuple[tuple[float, float], list[Iteration]]] = []
        n = self._mechanism.layout.n
        for time, factor, rows, residual in self._seen:
            names, m = residual_names(run.stepper, rows), len(rows)
            parts = (slice(0, n), slice(n, n + m), slice(n + m, n + 2 * m))
            iteration = Iteration(*(dict(zip(names[part], residual[part].tolist(), strict=False)) for part in parts))
            if not found or found[-1][0] != (time, factor):
                found.append(((time, factor), []))
            found[-1][1].append(iteration)
        return tuple(Try(key[0], tuple(iterations)) for key, iterations in found)


class _Seen:
    """A program whose residuals are noted; `factor` (∂q/∂v̇) is positive in the iterations of a step only."""

    def __init__(self, program: Any, seen: list[Any], rows: tuple[int, ...], place: int, kept: int) -> None:
        self.program = program
        self._seen, self._rows, self._place, self._kept = seen, rows, place, kept

    @property
    def address(self) -> int:
        """Of the program, which may be made later."""
        return int(getattr(self.program, "address", 0))

    def __call__(self, block: Any, parameters: Any, out: Any) -> None:
        self.program(block, parameters, out)
        if block[2] > 0.0:
            residual = np.array(out[self._place : self._place + self._kept])
            noted = (float(block[0]), float(block[2]), self._rows, residual)
            known = self._seen[-1] if self._seen else None
            if known is None or known[:3] != noted[:3] or not np.array_equal(known[3], residual, equal_nan=True):
                self._seen.append(noted)  # one iterate may be evaluated twice
