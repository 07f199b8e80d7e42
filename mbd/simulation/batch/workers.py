"""Threads that take runs side by side, each with arrays of the kernel of its own: machine code needs no lock."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import fields
from threading import Event, Lock

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix
from mbd.simulation.many_runs import Ends, ManyRuns
from mbd.simulation.marching import Run


def processors() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Interrupted(KeyboardInterrupt):
    """Somebody has interrupted runs: the `ends` of all; those that are not `done` are zeros."""

    def __init__(self, ends: Ends, done: NDArray[np.bool_]) -> None:
        super().__init__()
        self.ends, self.done = ends, done


class Workers:
    """Some laid-out runs, as many as threads.

    Parameters
    ----------
    lay_out : makes one run, not begun
    count : how many threads there are at most
    """

    def __init__(self, lay_out: Callable[[], Run], count: int) -> None:
        self._lay_out, self.count = lay_out, count
        self._many = [ManyRuns(lay_out())]
        self._lock = Lock()

    @property
    def run(self) -> Run:
        """The first of the runs, for names and sizes."""
        return self._many[0].run

    def __call__(
        self, starts: Matrix, parameters: Callable[[int, int], Matrix] | None = None,
        report: Callable[[int], None] | None = None,
    ) -> Ends:  # fmt: skip
        """The ends of runs from lines of starts, in their order, whichever thread took each.

        Parameters
        ----------
        starts : as `ManyRuns` takes them
        parameters : gives the vectors of the runs from one number to before another; None: those of the run
        report : called with the number of runs that are over

        Raises
        ------
        Interrupted
            by Ctrl-C, with the runs that were over.
        """
        # runs that a thread takes together at most; four parts each, so that one with short runs takes over
        size = max(min(4096, -(-len(starts) // (4 * self.count))), 1)
        parts = [(first, min(first + size, len(starts))) for first in range(0, len(starts), size)] or [(0, 0)]
        count = min(self.count, len(parts))
        while len(self._many) < count:
            self._many.append(ManyRuns(self._lay_out()))
        found: list[Ends | None] = [None] * len(parts)
        waiting, halt, over = iter(range(len(parts))), Event(), [0]

        def work(many: ManyRuns) -> None:
            while not halt.is_set():
                with self._lock:
                    place = next(waiting, None)
                if place is None:
                    return
                first, last = parts[place]
                own = None if parameters is None else parameters(first, last)
                found[place] = many.until_stopped(starts[first:last], own, stopped=halt.is_set)
                if many.interrupted:
                    halt.set()
                with self._lock:
                    over[0] += last - first
                if report is not None:
                    report(over[0])

        try:
            if count == 1:
                work(self._many[0])
            else:
                with ThreadPoolExecutor(count) as pool:
                    try:
                        waiting_for = {pool.submit(work, many) for many in self._many[:count]}
                        while waiting_for:  # in short waits, since a long one would not hear Ctrl-C everywhere
                            over_now, waiting_for = wait(waiting_for, 0.1, FIRST_COMPLETED)
                            for task in over_now:
                                task.result()
                    except BaseException:
                        halt.set()
                        raise
        except KeyboardInterrupt:
            halt.set()
        none = self._many[0].none()
        ends = [none if each is None else each for each in found]
        if not halt.is_set():
            return _joined(ends)
        sizes = [last - first for first, last in parts]
        done = [np.arange(size) < len(each.status) for size, each in zip(sizes, ends, strict=True)]
        raise Interrupted(
            _joined([_filled(each, size) for each, size in zip(ends, sizes, strict=True)]), np.concatenate(done)
        )


def _joined(parts: Sequence[Ends]) -> Ends:
    """Ends one behind the other."""
    return Ends(*(np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(Ends)))


def _filled(part: Ends, size: int) -> Ends:
    """Ends with zeros behind them, as many as there were to be."""
    columns = [getattr(part, each.name) for each in fields(Ends)]
    return Ends(*(np.concatenate([one, np.zeros((size - len(one), *one.shape[1:]), one.dtype)]) for one in columns))
