"""Gaits: the limit cycle of a walker with its multipliers, beside a run of one step; a branch with its doubling."""

from __future__ import annotations

from functools import partial
from typing import Any

import mbd
from benchmarks.figures import Figure, interleaved
from benchmarks.stopwatch import processor_seconds
from mbd.cli import Script

SIDES = ("left", "right")
WALKERS: dict[str, tuple[str, dict[str, Any], float]] = {
    "simplest walker": ("simplest-walker-lagrangian", {"section": "heel strike"}, 5.0),
    "compass": ("compass-gait", {"section": "right foot", "mirror": SIDES}, 10.0),
    "kneed walker": ("kneed-walker", {"section": "right foot", "mirror": SIDES}, 50.0),
}
"""Example, arguments of `mbd.limit_cycle`, aim [ms]."""
POINTS, BRANCH_AIM = 200, 2.0


def measure(repeats: int) -> list[Figure]:
    """Fixed point and multipliers, and 200 points of a branch, after compilation."""
    figures = []
    for name, (example, arguments, aim) in WALKERS.items():
        names = Script.load(example).names
        model, start = names["model"], names["start"]
        found = mbd.limit_cycle(model, start, **arguments)

        def run(found: mbd.LimitCycle = found) -> None:
            found.walk(1)

        whole = partial(mbd.limit_cycle, model, start, **arguments)
        samples = interleaved(
            {"cycle": partial(processor_seconds, whole), "run": partial(processor_seconds, run)}, repeats
        )
        figures.append(
            Figure(
                f"limit cycle of the {name}", samples["cycle"].least * 1e3, "ms", aim, "a run of one step",
                samples["run"].least * 1e3, spread=samples["cycle"].spread,
            )
        )  # fmt: skip
    return [*figures, *_branch(repeats)]


def _branch(repeats: int) -> list[Figure]:
    """The branch of the compass along the slope, in steps so short that there are 200."""
    gait: mbd.LimitCycle = Script.load("steeper-slope").names["gait"]

    def follow() -> int:
        slopes = mbd.branch(gait, "slope", to=0.5, steps=POINTS, step=1e-3)
        assert len(slopes.points("doubling")) == 1
        return len(slopes)

    points = follow()
    sample = interleaved({"branch": partial(processor_seconds, follow)}, repeats)["branch"]
    return [Figure(f"branch of {points} gaits with its doubling", sample.least, "s", BRANCH_AIM, spread=sample.spread)]
