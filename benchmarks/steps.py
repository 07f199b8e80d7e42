"""Microseconds per implicit step on the kernel path, beside hand-written C of the same scheme."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

import mbd
from benchmarks import walkers
from benchmarks.figures import BURST, Figure, Samples, interleaved
from benchmarks.handwritten import Program, compiler
from benchmarks.stopwatch import kernel_watched
from mbd.integrators.family import NewmarkFamily

DT = 1e-3
AIM_RATIO = 1.0
PAUSE = 1.0
"""Between bursts of rounds [s]."""
SOLVERS = ("C", "C, rows eliminated")
"""What solves in C: LU of the whole matrix with a search for pivots; the elimination that mbd does, by hand."""
SAME = 1e-9
"""Largest difference of positions and velocities, relative to the largest of them (or to 1), between mbd and C."""
COMPARED = 1000
"""Steps over which they are compared: an unstable motion amplifies the tolerance of Newton's iteration."""


@dataclass(frozen=True)
class Case:
    """A walker to be stepped.

    Parameters
    ----------
    name : of the walker
    make : model and start
    source, numbers, names : its C code, that code's parameters, its coordinates in the order of the C code
    rows : constraint rows
    steps : how many are run; the motion is that of a walker for so long
    aim : µs per index-3 step
    """

    name: str
    make: Callable[[], tuple[mbd.Model, mbd.State]]
    source: str
    numbers: Any
    names: tuple[str, ...]
    rows: int
    steps: int
    aim: float


_LEGS = [f"{side} {joint}.angle" for side in ("left", "right") for joint in ("hip", "knee", "ankle")]
CASES = (
    Case(
        "compass, 4 dof + 2 rows", walkers.compass, "compass.h", walkers.COMPASS,
        ("trunk.x", "trunk.y", "left hip.angle", "right hip.angle"), rows=2, steps=3000, aim=0.2,
    ),
    Case(
        "7 links, 9 dof + 3 rows", walkers.seven, "seven.h", walkers.SEVEN,
        ("root.x", "root.y", "root.angle", *_LEGS), rows=3, steps=450, aim=0.8,
    ),
)  # fmt: skip


def measure(repeats: int) -> list[Figure]:
    """Both walkers, index 3 and stabilized: all of them in every round, rounds spread over seconds."""
    cases = [_Timed(case, form) for case in CASES for form in ("index3", "ggl")]
    tasks = {f"{timed.name}: {task}": run for timed in cases for task, run in timed.tasks.items()}
    samples = interleaved(tasks, BURST * repeats, PAUSE)
    return [figure for timed in cases for figure in timed.figures(samples)]


class _Timed:
    """One walker in one formulation: time in the kernel, a long run minus a short one, so that starting is excluded."""

    def __init__(self, case: Case, form: Any) -> None:
        self.case, self.name = case, f"step, {case.name}, {'index 3' if form == 'index3' else 'stabilized'}"
        self.aim = case.aim if form == "index3" else None
        self.model, self.start = case.make()
        self.scheme = mbd.GeneralizedAlpha(rho_inf=0.9, formulation=form)
        self.short, self.programs = case.steps // 10, {}
        self.tasks: dict[str, Callable[[], float]] = {
            "long": partial(self._kernel_seconds, case.steps),
            "short": partial(self._kernel_seconds, self.short),
        }
        for solver in SOLVERS if compiler() is not None else ():
            sizes, reduced = (len(case.names), case.rows), solver == SOLVERS[1]
            program = Program(case.source, sizes, case.numbers, case.names, form == "ggl", reduced)
            _assert_same(case, self.model, self.start, self.scheme, program)
            self.programs[solver] = program
            self.tasks[f"{solver} long"] = partial(_seconds, program, self.start, self.scheme, case.steps)
            self.tasks[f"{solver} short"] = partial(_seconds, program, self.start, self.scheme, self.short)

    def _run(self, steps: int) -> dict[str, Any]:
        none = 10 * self.case.steps
        return dict(mbd.simulate(self.model, self.start, self.scheme, dt=DT, until=steps * DT, store=none).stats)

    def _kernel_seconds(self, steps: int) -> float:
        with kernel_watched() as watch:
            self._run(steps)
        return watch.seconds

    def figures(self, samples: Mapping[str, Samples]) -> list[Figure]:
        """What the samples of its tasks tell."""
        steps, name = self.case.steps, self.name
        measured = {task: samples[f"{name}: {task}"] for task in self.tasks}
        own, spread = _per_step(measured["long"], measured["short"], steps - self.short)
        counts = self._run(steps)
        evaluations = (counts["tangents"] + counts["residuals"]) / counts["steps"]
        figures = [] if self.programs else [Figure(name, own, "µs", self.aim, spread=spread)]
        work = None
        for solver, program in self.programs.items():
            reference, _ = _per_step(measured[f"{solver} long"], measured[f"{solver} short"], steps - self.short)
            work = work or sum(program.run(self.start, self.scheme, DT, steps, 10 * steps).counts[:2]) / steps
            title = name if solver == SOLVERS[0] else f"{name}: beside {solver}"
            figures.append(Figure(title, own, "µs", self.aim, solver, reference, AIM_RATIO, spread))
        work_figure = Figure(
            f"{name}: evaluations", evaluations, "a step", yardstick="C" if work else "", reference=work
        )
        return [*figures, work_figure]


def _seconds(program: Program, start: mbd.State, scheme: NewmarkFamily, steps: int) -> float:
    return program.run(start, scheme, DT, steps, 10 * steps).seconds


def _per_step(long: Samples, short: Samples, steps: int) -> tuple[float, float]:
    """Microseconds per step, and the spread of the long runs."""
    return (long.least - short.least) / steps * 1e6, long.spread


def _assert_same(case: Case, model: mbd.Model, start: mbd.State, scheme: NewmarkFamily, program: Program) -> None:
    """The C loop computes the same motion; otherwise the comparison would mean nothing."""
    steps = min(case.steps, COMPARED)
    run = mbd.simulate(model, start, scheme, dt=DT, until=steps * DT)
    mine = [run[name] for name in case.names] + [run[f"{name}.rate"] for name in case.names]
    theirs = program.run(start, scheme, DT, steps, 1).rows
    groups: Sequence[slice] = (slice(0, len(case.names)), slice(len(case.names), 2 * len(case.names)))
    for group in groups:
        own, other = np.stack(mine[group], axis=1), theirs[:, group]
        difference = float(np.max(np.abs(own - other))) / max(1.0, float(np.max(np.abs(other))))
        if not difference < SAME:
            raise AssertionError(f"{case.name}: the C loop and mbd differ by {difference:.1e} within {steps} steps")
