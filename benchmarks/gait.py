"""A thousand steps of the kneed walker: wall time, events, memory."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from functools import partial
from time import perf_counter
from typing import Any

import mbd
from benchmarks.figures import Figure, interleaved
from benchmarks.walkers import kneed_walker, knocking_walker
from mbd.compile.mechanisms import mechanism_of

__all__ = ["measure"]

STEP_TIME = 0.56433
"""Time of one walker step [s]."""
WALKER_STEPS = 1000


def measure(repeats: int, c_step: float | None) -> list[Figure]:
    """1000 walker steps at dt = 1 ms, and what an event costs. `c_step` [µs] is a step of the compass in C."""
    return [*_thousand(repeats, c_step), *_events(repeats, c_step)]


def _yardstick(c_step: float | None, scale: float) -> tuple[str, float | None]:
    """The C step in the unit of a figure, `scale` times a microsecond."""
    return ("C step of the compass", c_step * scale) if c_step else ("", None)


def _thousand(repeats: int, c_step: float | None) -> list[Figure]:
    model, start = kneed_walker()
    until = (WALKER_STEPS + 0.3) * STEP_TIME

    def run(store: int) -> Any:
        return mbd.simulate(model, start, mbd.HHT(alpha=0.05), dt=1e-3, until=until, store=store)

    def timed(store: int) -> float:
        began = perf_counter()
        run(store)
        return perf_counter() - began

    samples = interleaved({"all": lambda: timed(1), "few": lambda: timed(1000)}, repeats)
    tracemalloc.start()
    result = run(1)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    strikes = sum(event.kind == "closed" and event.name.endswith("foot") for event in result.events)
    if strikes != WALKER_STEPS:
        raise AssertionError(f"the kneed walker made {strikes} steps where {WALKER_STEPS} were expected")
    name, stats = f"{WALKER_STEPS} walker steps", result.stats
    final, rows = result.final, len(mechanism_of(model).equations.rows)
    numbers = 1 + len(final.q) + 2 * len(final.v) + rows
    stored = len(result.time) * (8 * numbers + len(model.constraints)) / 1e6  # t, q, v, v̇, λ, and who is closed
    step = _yardstick(c_step, 1e-6)
    return [
        Figure(f"{name}, all rows stored", samples["all"].least, "s", 2.0, *step, spread=samples["all"].spread),
        Figure(f"{name}, store=1000", samples["few"].least, "s", None, *step, spread=samples["few"].spread),
        Figure(f"{name}: implicit steps", stats["steps"], ""),
        Figure(f"{name}: evaluations", (stats["tangents"] + stats["residuals"]) / stats["steps"], "a step"),
        Figure(f"{name}: located events", stats["locations"], ""),
        Figure(f"{name}: peak memory", peak / 1e6, "MB", None, "stored rows", stored),
    ]


def _events(repeats: int, c_step: float | None) -> list[Figure]:
    """Cost of an event with impact and restart: a run with a hundred of them against one with none."""
    runs = {}
    for name, stop in ("with", True), ("without", False):
        model, start = knocking_walker(stop)
        runs[name] = partial(mbd.simulate, model, start, mbd.HHT(alpha=0.05), dt=1e-3, until=4.0, store=1000)
    samples = interleaved({name: partial(_wall, run) for name, run in runs.items()}, 5 * repeats)
    each = (samples["with"].least - samples["without"].least) / runs["with"]().stats["locations"]
    spread = max(samples["with"].spread, samples["without"].spread)
    return [Figure("event: location, impact, restart", each * 1e6, "µs", 20.0, *_yardstick(c_step, 1.0), spread=spread)]


def _wall(run: Callable[[], Any]) -> float:
    return float(run().stats["wall_seconds"])
