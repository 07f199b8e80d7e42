"""A failing step once more, with Newton's iterations in sight."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.compile.mechanism import Mechanism, ModeCode
from mbd.dataclass import dataclass
from mbd.equations.programs import ActiveSet
from mbd.errors import ModelError
from mbd.integrators import Integrator
from mbd.kernel.translation.interpreted import InterpretedScheme
from mbd.results.capsule import load
from mbd.results.failure import Failure
from mbd.results.trajectory import Trajectory
from mbd.simulation.diagnostics.residuals import residual_names
from mbd.simulation.marching import Run
from mbd.simulation.simulate import prepared
from mbd.state import State

MAX_SHOWN = 10
"""Iterations of a try that a printed replay shows; `Replay.tries` has them all."""


@dataclass(frozen=True)
class Iteration:
    """What is left of the balance and of the rows at an iterate, by name; empty where it was not evaluated.

    halvings : how often the correction that led here was halved, as the residual had grown
    """

    balance: Mapping[str, float]
    rows: Mapping[str, float]
    rates: Mapping[str, float]
    halvings: int = 0


@dataclass(frozen=True)
class Try:
    """Newton's iteration for a step to `time`; a failing step is tried several times, shortened.

    From each iterate but one that converged a correction was made: those of all tries are `Failure.iterations`.
    """

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
            lines += (
                shown if len(shown) <= MAX_SHOWN else [*shown[: MAX_SHOWN // 2], "      …", *shown[-MAX_SHOWN // 2 :]]
            )
        if not self.tries and self.failure.attempted <= self.failure.time:
            lines.append("  no step failed: the run was judged as a whole, so make it again with another dt or scheme")
        elif not self.tries:
            lines.append("  no Newton iteration took place: steps are explicit, or solved by an integrator of your own")
        return "\n".join(lines)


def _line(iteration: Iteration) -> str:
    """The largest entry of each block."""
    parts = []
    for title in ("balance", "rows", "rates"):
        block: Mapping[str, float] = getattr(iteration, title)
        if block:
            name, value = max(block.items(), key=lambda item: abs(item[1]) if math.isfinite(item[1]) else math.inf)
            parts.append(f"{title} {value:10.3g} ({name})")
    halved = f"   after {iteration.halvings} halvings" if iteration.halvings else ""
    return "   ".join(parts) + halved


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
    if again.stepper.compiled:  # interpreted, with the programs and so the decisions of machine code
        again.stepper.compiled, again.stepper.scheme = False, InterpretedScheme(again.stepper.own)
    if isinstance(again.stepper.scheme, InterpretedScheme):
        seen.counts = again.kernel
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
        self.counts: Any = None  # the kernel that counts corrections as they are made
        self._seen: list[_Noted] = []
        self._last: Vector | None = None  # the inputs evaluated last
        self._codes: dict[Any, ModeCode] = {}

    def __getattr__(self, name: str) -> Any:
        return getattr(self._mechanism, name)

    def mode(self, active: ActiveSet) -> ModeCode:
        """Code of a mode that can be watched, as `Mechanism.mode` takes it; compiled programs keep their addresses."""
        return self._watched(self._mechanism.mode, active)

    def stepping(self, active: ActiveSet) -> ModeCode:
        """The same as the compiled kernel has it."""
        return self._watched(self._mechanism.stepping, active)

    def explicit(self, active: ActiveSet) -> ModeCode:
        """The same as explicit steps have it."""
        return self._watched(self._mechanism.explicit, active)

    def _watched(self, make: Callable[[ActiveSet], ModeCode], active: ActiveSet) -> ModeCode:
        key = (make.__name__, active)
        if key not in self._codes:
            code, n = make(active), self._mechanism.layout.n
            matrix, kept = (n + len(active.rows)) ** 2, active.tail(n)
            tangent = _Seen(code.tangent, self.note, active.rows, matrix, kept)
            residual = _Seen(code.residual, self.note, active.rows, 0, kept)
            first = None if code.correction is None else _Seen(code.correction, self.note, active.rows, 0, kept)
            self._codes[key] = replace(code, tangent=tangent, residual=residual, correction=first)
        return self._codes[key]

    def note(self, block: Vector, rows: Sequence[int], residual: Vector) -> None:
        """An evaluation at an iterate, once; where corrections are counted, the last one before the next of them."""
        before, self._last = self._last, block.copy()
        if before is not None and np.array_equal(before, block, equal_nan=True):
            return
        made = -1 if self.counts is None else int(self.counts.n_iterations)
        noted = _Noted(float(block[0]), float(block[2]), rows, made, residual)
        known = self._seen[-1] if self._seen else None
        if known is not None and made >= 0 and known.step == noted.step and known.corrections == made:
            noted.halvings = known.halvings + 1
            self._seen.pop()
        self._seen.append(noted)

    def tries(self, run: Run) -> tuple[Try, ...]:
        """What was seen, step by step."""
        found: list[tuple[tuple[float, float], list[Iteration]]] = []
        n = self._mechanism.layout.n
        for one in self._seen:
            names, m = residual_names(run.stepper, one.rows), len(one.rows)
            parts = (slice(0, n), slice(n, n + m), slice(n + m, n + 2 * m))
            balance, held, rates = (dict(zip(names[part], one.residual[part].tolist(), strict=False)) for part in parts)
            if not found or found[-1][0] != (one.time, one.factor):
                found.append(((one.time, one.factor), []))
            found[-1][1].append(Iteration(balance, held, rates, one.halvings))
        return tuple(Try(key[0], tuple(iterations)) for key, iterations in found)


@dataclass
class _Noted:
    """An evaluation within a step: to which time, with which ∂q/∂v̇, after how many corrections in all (−1: unknown)."""

    time: float
    factor: float
    rows: Sequence[int]
    corrections: int
    residual: Vector
    halvings: int = 0

    @property
    def step(self) -> tuple[float, float, Sequence[int]]:
        """What tells one try from another."""
        return self.time, self.factor, self.rows


class _Seen:
    """A program whose residuals are noted; `factor` (∂q/∂v̇) is positive in the iterations of a step only."""

    def __init__(self, program: Any, note: Any, rows: Sequence[int], place: int, kept: int) -> None:
        self.program = program
        self._note, self._rows, self._place, self._kept = note, rows, place, kept

    @property
    def address(self) -> int:
        """Of the program, which may be made later."""
        return int(getattr(self.program, "address", 0))

    def __call__(self, block: Any, parameters: Any, out: Any) -> None:
        self.program(block, parameters, out)
        if block[2] > 0.0:
            self._note(block, self._rows, np.array(out[self._place : self._place + self._kept]))
