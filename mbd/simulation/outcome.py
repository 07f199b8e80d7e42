"""What a run hands over: its rows as a record, its counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.arrays import Matrix
from mbd.kernel import fields as F
from mbd.results.record import EventRecord, Record
from mbd.simulation.notes import notes_of
from mbd.simulation.stepper import RUNGE_KUTTA
from mbd.state import State
from mbd.trajectory import Trajectory

if TYPE_CHECKING:
    from mbd.simulation.run import Run

__all__ = ["record_of", "trajectory_of", "whole_record"]

COUNTS = (
    "steps", "iterations", "tangents", "residuals", "factorizations", "events", "restarts", "impacts",
    "locations", "stagnations", "careful", "shortened", "energetic_impacts",
    "endless", "pivoted",
)  # fmt: skip
"""Names of the kernel's counts, in the order of their places."""


def record_of(run: Run, table: Matrix, events: Sequence[EventRecord] = ()) -> Record:
    """Rows that the kernel has stored, (R, width), as a record without a verdict."""
    v, equations = run.values, run.mechanism.equations
    n_q, n_v, n, rows = v["n_q"], v["n_v"], v["n"], v["n_rows"]
    cuts = np.cumsum([1, n_q, n_v, n - n_v, n_v, n - n_v, rows])
    time, q, velocity, z, a, s, lam, closed = np.split(table, cuts, axis=1)
    return Record(
        equations=equations, parameters=run.first_parameters,
        parameter_names=[parameter.name for parameter in equations.parameters], time=time[:, 0], q=q, v=velocity,
        z=z, a=a, s=s, lam=lam, closed=closed.astype(np.uint8), events=events, settings=run.settings,
        parameter_changes=run.parameter_changes, start=run.start,
    )  # fmt: skip


def whole_record(run: Run) -> Record:
    """All rows and events until now, without a verdict."""
    last = run.stored - 1  # a run that failed right at an event has no row after it
    events = [event if event.row <= last else replace(event, row=last) for event in run.events]
    return record_of(run, run.table[: run.stored], events)


def trajectory_of(run: Run, problem: str, message: str, final: State) -> Trajectory:
    """The run by name; `problem` is '' if it went as far as it was asked to. Its message tells what is in doubt."""
    record = whole_record(run)
    notes, doubts = notes_of(run, record)
    told = problem or "; but ".join([message, *doubts])
    record = replace(record, success=not problem, message=told, failure=run.failure, final=final)
    return Trajectory(replace(record, stats=_statistics(run, notes)))


def _statistics(run: Run, notes: list[str]) -> dict[str, Any]:
    counts = run.values["counts"]
    numbers: dict[str, Any] = {name: int(counts[place]) for place, name in enumerate(COUNTS)}
    if run.values["adaptive"]:
        numbers["rejected"] = int(counts[F.REJECTED])
    if run.values["adaptive"] or run.values["scheme"] == RUNGE_KUTTA:
        numbers["local_errors"] = float(run.values["clock"][F.SPENT])
    numbers["modes"] = len(run.stepper.modes)
    numbers["compiled"] = run.stepper.compiled
    numbers["optimized"] = run.stepper.compiled and not run.stepper.provisional
    numbers["derive_and_compile_seconds"] = run.mechanism.seconds
    numbers["notes"] = notes
    numbers["wall_seconds"] = perf_counter() - run.began
    return numbers
