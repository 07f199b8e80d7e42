"""What a run hands over: its rows as a record, its counts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from time import perf_counter
from typing import Any

from mbd.dataclass import found_late
from mbd.kernel.records import TABLE
from mbd.results.trajectory import Trajectory
from mbd.simulation.diagnostics.notes import Note, notes_of
from mbd.simulation.run.data import RunData
from mbd.simulation.run.stored import ended_record
from mbd.state import State

__all__ = ["trajectory_of"]

COUNTS = {
    name: TABLE.places[f"n_{name}"][1]
    for name in (
        "steps", "iterations", "tangents", "residuals", "factorizations", "events", "restarts", "impacts",
        "locations", "stagnations", "singular_steps", "shortened", "energetic_impacts",
        "endless", "pivoted",
    )
}  # fmt: skip
"""Counts of the kernel that results tell, and their places."""


def trajectory_of(run: RunData, problem: str, message: str, final: State) -> Trajectory:
    """The run by name; `problem` is '' if it went as far as it was asked to. Its message tells what is in doubt."""
    record = ended_record(run)
    notes, run.doubts = notes_of(run, record)
    text = problem or "; but ".join([message, *run.doubts])
    ended = record.concluded(success=not problem, message=text, failure=run.failure, final=final)
    return Trajectory(found_late(ended, "stats", _statistics(run, notes)))


def _statistics(run: RunData, notes: Sequence[Note]) -> Callable[[], dict[str, Any]]:
    """What gives counts and notes."""
    counts = run.kernel.counts.tolist()
    numbers: dict[str, Any] = {name: counts[place] for name, place in COUNTS.items()}
    if run.kernel.adaptive:
        numbers["rejected"] = int(run.kernel.n_rejected)
    if run.kernel.adaptive or run.kernel.estimates:
        numbers["local_errors"] = float(run.kernel.error_sum)
    if run.kernel.n_cones > 0 and run.kernel.strategy == 1:
        numbers["cone_residual"] = float(run.kernel.cone_residual)
    numbers["modes"] = len(run.stepper.modes)
    numbers["compiled"] = run.stepper.compiled
    numbers["optimized"] = run.stepper.compiled and not run.stepper.provisional
    numbers["derive_and_compile_seconds"] = run.mechanism.seconds
    numbers["notes"] = []
    numbers["wall_seconds"] = perf_counter() - run.began

    def statistics() -> dict[str, Any]:
        numbers["notes"] = [one for note in notes for one in ([note] if isinstance(note, str) else note())]
        return numbers

    return statistics
