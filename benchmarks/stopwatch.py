"""Seconds of this thread's processor time: on a quiet machine those of the clock, on a busy one without the waiting."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import thread_time

from mbd.kernel import entry


def processor_seconds(task: Callable[..., object], *arguments: object) -> float:
    """What a call takes."""
    began = thread_time()
    task(*arguments)
    return thread_time() - began


class Stopwatch:
    """Sums the time of the calls that it is wrapped around."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def around(self, function: Callable[[int], int]) -> Callable[[int], int]:
        """The function, timed."""

        def timed(table: int) -> int:
            began = thread_time()
            status = function(table)
            self.seconds += thread_time() - began
            return status

        return timed


@contextmanager
def kernel_watched() -> Iterator[Stopwatch]:
    """While this lasts, every call of the compiled kernel is timed."""
    watch, original = Stopwatch(), entry.entry
    timed = watch.around(original())
    entry.entry = lambda: timed  # type: ignore[assignment]
    try:
        yield watch
    finally:
        entry.entry = original
