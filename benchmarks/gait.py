"""A thousand steps of the kneed walker: wall time, memory; and what an event costs."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import mbd
from benchmarks.figures import Figure, interleaved
from benchmarks.processes import output_of
from benchmarks.stopwatch import processor_seconds
from benchmarks.walkers import kneed_walker, knocking_walker
from mbd.compile.mechanisms import mechanism_of

STEP_TIME = 0.56433
"""Time of one walker step [s]."""
WALKER_STEPS = 1000
UNTIL = (WALKER_STEPS + 0.3) * STEP_TIME
GROWTH = """
import mbd
from benchmarks.walkers import kneed_walker
def most(): return int(next(line for line in open("/proc/self/status") if line.startswith("VmHWM")).split()[1])
def run(until): return mbd.simulate(model, start, mbd.HHT(alpha=0.05), dt=1e-3, until=until)
model, start = kneed_walker()
run(5.0)
before = most()
kept = run({until})
print(most() - before)
"""


def measure(repeats: int, c_step: float | None) -> list[Figure]:
    """1000 walker steps at dt = 1 ms, and what an event costs. `c_step` [µs] is a step of the compass in C."""
    return [*_thousand(repeats, c_step), *_events(repeats, c_step)]


def _yardstick(c_step: float | None, scale: float) -> tuple[str, float | None]:
    """The C step in the unit of a figure, `scale` times a microsecond."""
    return ("C step of the compass", c_step * scale) if c_step else ("", None)


def _thousand(repeats: int, c_step: float | None) -> list[Figure]:
    model, start = kneed_walker()

    def run(store: int) -> Any:
        return mbd.simulate(model, start, mbd.HHT(alpha=0.05), dt=1e-3, until=UNTIL, store=store)

    samples = interleaved(
        {"all": partial(processor_seconds, run, 1), "few": partial(processor_seconds, run, 1000)}, repeats
    )
    result = run(1)
    strikes = sum(event.kind == "closed" and event.name.endswith("foot") for event in result.events)
    if strikes != WALKER_STEPS:
        raise AssertionError(f"the kneed walker made {strikes} steps where {WALKER_STEPS} were expected")
    name, stats = f"{WALKER_STEPS} walker steps", result.stats
    step = _yardstick(c_step, 1e-6)
    return [
        Figure(f"{name}, all rows stored", samples["all"].least, "s", 2.0, *step, spread=samples["all"].spread),
        Figure(f"{name}, store=1000", samples["few"].least, "s", None, *step, spread=samples["few"].spread),
        Figure(f"{name}: implicit steps", stats["steps"], ""),
        Figure(f"{name}: evaluations", (stats["tangents"] + stats["residuals"]) / stats["steps"], "a step"),
        Figure(f"{name}: located events", stats["locations"], ""),
        *_memory(model, result),
    ]


def _memory(model: mbd.Model, run: Any) -> list[Figure]:
    """How much a process grows by such a run (where Linux tells), beside what is stored: t, q, v, v̇, λ, closed."""
    if not Path("/proc/self/status").exists():
        return []
    numbers = 1 + len(run.final.q) + 2 * len(run.final.v) + len(mechanism_of(model).equations.rows)
    stored = len(run.time) * (8 * numbers + len(model.constraints)) / 1e6
    grown = float(output_of(GROWTH.format(until=UNTIL))) * 1.024e-3
    return [Figure(f"{WALKER_STEPS} walker steps: memory", grown, "MB", None, "stored rows", stored)]


def _events(repeats: int, c_step: float | None) -> list[Figure]:
    """Cost of an event with impact and restart: a run with a hundred of them against one with none."""
    runs = {}
    for name, stop in ("with", True), ("without", False):
        model, start = knocking_walker(stop)
        runs[name] = partial(mbd.simulate, model, start, mbd.HHT(alpha=0.05), dt=1e-3, until=4.0, store=1000)
    samples = interleaved({name: partial(processor_seconds, run) for name, run in runs.items()}, 5 * repeats)
    each = (samples["with"].least - samples["without"].least) / runs["with"]().stats["locations"]
    spread = max(samples["with"].spread, samples["without"].spread)
    return [Figure("event: location, impact, restart", each * 1e6, "µs", 20.0, *_yardstick(c_step, 1.0), spread=spread)]
