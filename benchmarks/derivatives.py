"""What exact derivatives of a run cost, beside the run and beside differences of runs: a step of the kneed walker."""

from __future__ import annotations

from functools import partial
from typing import Any

import mbd
from benchmarks.figures import Figure, interleaved
from benchmarks.stopwatch import processor_seconds
from benchmarks.walkers import kneed_walker
from mbd.sensitivity.derivative import final_state_derivative

__all__ = ["measure"]

SCHEMES: dict[str, tuple[mbd.HHT | mbd.RungeKutta853, dict[str, float]]] = {
    "HHT, dt = 2 ms": (mbd.HHT(alpha=0.05), {"dt": 2e-3}),
    "RungeKutta853, dt = 10 ms": (mbd.RungeKutta853(), {"dt": 1e-2}),
}
DIRECTIONS = 20


def directions() -> list[str]:
    """Coordinates and rates of the start, and sizes of the legs."""
    sides = [(side, part) for side in ("left", "right") for part in ("thigh", "shank")]
    sizes = [f"{side} {part}.{size}" for side, part in sides for size in ("mass", "length", "center")]
    start = [f"{side} hip.angle{rate}" for rate in ("", ".rate") for side in ("left", "right")]
    return [*start, *sizes, "hip.mass", "gravity.x", "gravity.y", "trunk.x"][:DIRECTIONS]


def measure(repeats: int) -> list[Figure]:
    """20 directions by the pass, run included, over the run alone; aim 3. Central differences take 40 runs."""
    model, start = kneed_walker()
    names, figures = directions(), list[Figure]()
    for title, (scheme, step) in SCHEMES.items():

        def run(scheme: Any = scheme, step: dict[str, float] = step) -> mbd.Trajectory:
            return mbd.simulate(model, start, scheme, until="right foot", **step)  # type: ignore[arg-type]

        def differentiated(names: list[str], run: Any = run) -> None:
            final_state_derivative(run(), names)

        samples = interleaved(
            {
                "run": partial(processor_seconds, run),
                "one": partial(processor_seconds, differentiated, names[:1]),
                "all": partial(processor_seconds, differentiated, names),
            },
            repeats,
        )
        alone = samples["run"].least
        for count, key, aim in ((1, "one", None), (DIRECTIONS, "all", 3.0)):
            figures.append(
                Figure(
                    f"a walker step with derivatives by {count}, {title}", samples[key].least * 1e3, "ms", None,
                    "the run alone", alone * 1e3, aim, samples[key].spread,
                )
            )  # fmt: skip
    return figures
