"""How one setting of one system is run, timed and compared; what is kept of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from time import process_time
from typing import TypeVar

from benchmarks.peers.scenes import Scene
from mbd.arrays import Matrix, Vector

T = TypeVar("T")

MOST_REPEATS = 5
BUDGET = 0.1
"""Seconds after which a setting is not repeated any more."""
CAP = 0.4
"""Seconds of a run after which the finer settings of its sweep are left out."""


@dataclass(frozen=True)
class Outcome:
    """One run.

    Parameters
    ----------
    values : (times, compared)
    seconds : processor time of the simulation loop
    steps : of the loop, or calls of the right-hand side where a system counts these
    whole : processor time of the call that a user makes, where it does more than the loop
    times : of the values, where a system did not stop at the scene's times
    """

    values: Matrix
    seconds: float
    steps: int
    whole: float | None = None
    times: Vector | None = None


@dataclass(frozen=True)
class Attempt:
    """A setting in words, and a run with it; each call builds what it needs, untimed.

    from_words : makes the model anew, runs it and reads the values, where `run` does not
    """

    label: str
    run: Callable[[], Outcome]
    from_words: Callable[[], object] | None = None


Sweep = list[Attempt]
"""Settings of one method, coarse to fine."""


@dataclass(frozen=True)
class Result:
    """What a setting gave; `fault` says why there is no error.

    words : processor time from the words of the model to the values, in a process that has done so before
    """

    scene: str
    system: str
    label: str
    error: float | None = None
    seconds: float | None = None
    whole: float | None = None
    steps: int | None = None
    repeats: int = 0
    fault: str = ""
    words: float | None = None


def seconds(task: Callable[[], object]) -> float:
    """Processor time of this process that a call takes, threads of libraries included."""
    began = process_time()
    task()
    return process_time() - began


def _error(scene: Scene, outcome: Outcome) -> float:
    """At the scene's times, or, of a system that chose its own, against the exact motion at those."""
    if outcome.times is None:
        return scene.error(outcome.values)
    from benchmarks.peers.references import exact  # with scipy, which the start of a system need not wait for

    return scene.error(outcome.values, exact(scene, outcome.times))


def _repeated(attempt: Attempt) -> tuple[list[Outcome], float, float]:
    """Runs, the least time of a loop, and the least time from words to values."""
    outcomes, least = _calls(attempt.run)
    if attempt.from_words is not None:
        _, least = _calls(attempt.from_words)
    return outcomes, min(outcome.seconds for outcome in outcomes), least


def _calls(task: Callable[[], T]) -> tuple[list[T], float]:
    """What calls gave, as many as their budget allows, and the least processor time of one."""
    began, found, taken = process_time(), list[T](), list[float]()
    while not found or (len(found) < MOST_REPEATS and process_time() - began < BUDGET):
        taken.append(seconds(lambda: found.append(task())))
    return found, min(taken)


def measured(scene: Scene, system: str, sweeps: Iterable[Sweep]) -> Iterator[Result]:
    """Every setting of every sweep, minima over repeats; a sweep ends after a run beyond `CAP`."""
    for sweep in sweeps:
        for attempt in sweep:
            busy = process_time()
            try:
                outcomes, least, words = _repeated(attempt)
                error = _error(scene, outcomes[-1])
            except Exception as problem:  # whatever a system raises is a result of it
                said = f"{type(problem).__name__}: {problem}".splitlines()[0][:160]
                yield Result(scene.name, system, attempt.label, fault=said)
                if process_time() - busy > CAP:
                    break
                continue
            wholes = [outcome.whole for outcome in outcomes if outcome.whole is not None]
            fault = "" if math.isfinite(error) else "not finite, or not all of it"
            yield Result(
                scene.name, system, attempt.label, error if not fault else None, least, min(wholes, default=None),
                outcomes[-1].steps, len(outcomes), fault, words,
            )  # fmt: skip
            if least > CAP:
                break
