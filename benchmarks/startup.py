"""Seconds from starting a fresh Python process until something has happened in it."""

from __future__ import annotations

import time
from functools import partial

from benchmarks.figures import Figure, interleaved
from benchmarks.processes import output_of

FIRST_STEP = """
import mbd
from benchmarks.walkers import kneed_walker
model, start = kneed_walker()
mbd.simulate(model, start, mbd.HHT(alpha=0.05), dt=1e-3, until=1e-3)
"""
PROCESSES = {
    "fresh process: nothing": ("pass", None),
    "fresh process: import numpy": ("import numpy", None),
    "fresh process: import mbd": ("import mbd", None),
    "fresh process: describe the kneed walker": ("from benchmarks.walkers import kneed_model\nkneed_model()", None),
    "fresh process: assemble the kneed walker": ("from benchmarks.walkers import kneed_walker\nkneed_walker()", None),
    "fresh process: first step of the kneed walker": (FIRST_STEP, 0.35),
}
"""Scripts and aims [s]; kernel and models are in the cache, as the first round puts them there."""
YARDSTICK = "fresh process: import numpy"


def measure(repeats: int) -> list[Figure]:
    """Each script in processes of its own."""
    samples = interleaved({name: partial(until_done, script) for name, (script, _) in PROCESSES.items()}, repeats)
    reference = samples[YARDSTICK].least
    return [
        Figure(name, taken.least, "s", PROCESSES[name][1], "import numpy", reference, spread=taken.spread)
        for name, taken in samples.items()
    ]


def until_done(script: str) -> float:
    """Seconds from the start of the process to the end of the script, which says what time it is then."""
    began = time.time()
    said = output_of(f"{script}\nimport time\nprint(time.time())")
    return float(said.split()[-1]) - began
