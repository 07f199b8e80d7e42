"""Derivation and compilation of the kneed walker, with an empty cache and from a full one."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from tempfile import TemporaryDirectory

from benchmarks.figures import Figure, interleaved
from benchmarks.stopwatch import processor_seconds
from benchmarks.walkers import kneed_model
from mbd.compile.mechanism import Mechanism
from mbd.equations.derivation import derive
from mbd.equations.programs import ActiveSet
from mbd.kernel.contact.active_set import ActiveSetManager

LEFT, RIGHT = ("left foot", "left knee lock"), ("right foot", "right knee lock")
MODES = (LEFT, (*LEFT, RIGHT[1]), RIGHT, (*RIGHT, LEFT[1]))
"""Closed contacts in the order in which a gait meets them."""


def measure(repeats: int) -> list[Figure]:
    """Equations, and machine code until the first step and for the whole gait. The stepping kernel is not touched:
    it is compiled once a machine, not once a model."""
    with TemporaryDirectory(ignore_cleanup_errors=True) as full:
        tasks: dict[str, Callable[[], float]] = {
            "Python loop": partial(processor_seconds, python_loop),
            "derive": partial(processor_seconds, _derive),
            "derive + compile, first mode, cold": partial(_cold, 1),
            "derive + compile, 4 modes of a gait, cold": partial(_cold, len(MODES)),
            "derive + compile, first mode, from cache": partial(processor_seconds, _make, full, 1),
            "derive + compile, 4 modes of a gait, from cache": partial(processor_seconds, _make, full, len(MODES)),
        }
        samples = interleaved(tasks, repeats)
    yardstick = samples.pop("Python loop").least
    aims = {"cold": 0.15, "from cache": 0.02}
    return [
        Figure(
            f"kneed walker: {name}", taken.least, "s", aims.get(name.rpartition(", ")[2]), "Python loop", yardstick,
            spread=taken.spread,
        )
        for name, taken in samples.items()
    ]  # fmt: skip


def python_loop() -> None:
    """A fixed piece of plain Python, some 10 ms: the yardstick of what is done in Python."""
    known: dict[tuple[str, int, int], int] = {}
    for k in range(40_000):
        key = ("add", k % 977, k % 1009)
        known[key] = known.get(key, 0) + len(key)


def _derive() -> object:
    return derive(kneed_model())


def _make(folder: str, modes: int) -> None:
    """Everything from the words to callable code, with the cache in a folder."""
    before = os.environ.get("MBD_CACHE")
    os.environ["MBD_CACHE"] = folder
    try:
        mechanism = Mechanism(derive(kneed_model()))
        manager = ActiveSetManager(mechanism.equations)
        for closed in MODES[:modes]:
            flags = manager.flags(closed)
            mechanism.stepping(ActiveSet(manager.active_rows(flags), manager.penalties(flags)))
    finally:
        del os.environ["MBD_CACHE"]
        if before is not None:
            os.environ["MBD_CACHE"] = before


def _cold(modes: int) -> float:
    with TemporaryDirectory(ignore_cleanup_errors=True) as empty:
        return processor_seconds(_make, empty, modes)
