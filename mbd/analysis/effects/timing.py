"""Processor time of a step with and without an effect, by turns, and how sure it is."""

from collections.abc import Callable, Sequence
from time import perf_counter, thread_time

from mbd.dataclass import dataclass
from mbd.results.trajectory import Trajectory

MIN_ROUNDS, MAX_ROUNDS = 5, 15
"""Times that each run is made; beyond the least only while there is time left."""
MAX_TIMING_SECONDS = 8.0
"""Wall time for all rounds [s]."""

Pair = tuple[Callable[[], "Trajectory"], Callable[[], "Trajectory"]]


@dataclass(frozen=True)
class Timing:
    """What an effect adds to the processor time of a step [ns], the least of `rounds` runs with it and without.

    whole : a step of the whole scene [ns]
    noise : by how much that may be off: what the two leasts change by without the two fastest runs of each [ns]
    """

    whole: float
    added: float
    noise: float
    rounds: int


def timed(pairs: Sequence[Pair | None], share: Callable[[float], None]) -> list[Timing | None]:
    """Run both scenes of every pair again and again, in turn, so that a busy machine slows all of them alike.

    Parameters
    ----------
    pairs : the whole scene and the one without an effect, over the same stretch; None where there is none
    share : told the part of the work that is done
    """
    taken: list[tuple[list[float], list[float]]] = [([], []) for _ in pairs]
    began, rounds = perf_counter(), 0
    while rounds < MAX_ROUNDS:
        spent = perf_counter() - began
        if rounds >= MIN_ROUNDS and spent * (rounds + 1) / rounds > MAX_TIMING_SECONDS:
            break
        for place, pair in enumerate(pairs):
            for times, run in zip(taken[place], pair or (), strict=False):
                times.append(_nanoseconds(run))
            done = (rounds + (place + 1) / len(pairs)) / MAX_ROUNDS
            share(min(1.0, max(done, (perf_counter() - began) / MAX_TIMING_SECONDS)))
        rounds += 1
    share(1.0)
    return [None if pair is None else _timing(*times) for pair, times in zip(pairs, taken, strict=True)]


def _timing(first: Sequence[float], second: Sequence[float]) -> Timing:
    with_it, without = sorted(first), sorted(second)
    third = min(2, len(with_it) - 1)
    noise = (with_it[third] - with_it[0]) + (without[third] - without[0])
    return Timing(with_it[0], with_it[0] - without[0], noise, len(with_it))


def _nanoseconds(run: Callable[[], Trajectory]) -> float:
    """Of a step, on the processor: what other programs take meanwhile does not count."""
    began = thread_time()
    steps = run().stats["steps"]
    return 1e9 * (thread_time() - began) / max(int(steps), 1)
