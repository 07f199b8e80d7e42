"""Work that a process does beside a run, one short step at a time, in one thread.

The newest job goes first, for what was asked for last is what is running now. Between two steps the thread can be
stopped: a process that ends waits for the step at hand and leaves the rest, and one that forks does so between two
steps, so that no lock is held in the child, which goes on with the same jobs as soon as it looks at one (`wake`).
"""

import atexit
import contextlib
import os
import sys
import threading
import time
from collections import deque
from typing import Protocol

from mbd.compile import forking  # noqa: F401  (a fork stops the thread first, then waits for locks)


class Job(Protocol):
    """Something to be done in steps."""

    def step(self) -> bool:
        """Do the next step; whether there are more."""
        ...

    def failed(self, error: Exception) -> None:
        """A step raised; no further one will be called."""
        ...


class _Worker:
    """The thread and its jobs; there is one of these in a process.

    stepping : held while a step is done; state : held while jobs or thread are looked at and changed
    """

    def __init__(self) -> None:
        self.jobs: deque[Job] = deque()
        self.stepping, self.state = threading.Lock(), threading.Lock()
        self.thread: threading.Thread | None = None
        self.over = False

    def wake(self) -> None:
        """See to it that somebody works if there is work."""
        with self.state:
            if self.jobs and self.thread is None and not self.over:
                self.thread = threading.Thread(target=self.work, name="mbd background", daemon=True)
                try:
                    self.thread.start()
                except RuntimeError:  # no further threads, or the interpreter is about to end
                    self.thread = None

    def work(self) -> None:
        _give_way()
        while True:
            with self.state:
                if self.over or not self.jobs:
                    self.thread = None
                    return
                job = self.jobs[-1]
            with self.stepping:
                if not self.over and not self.step(job):
                    self.jobs.remove(job)
            time.sleep(0.001)  # seconds between two steps, in which others get at the locks that a step holds

    @staticmethod
    def step(job: Job) -> bool:
        """Do a step; whether the job has more. Nothing that a job raises reaches anybody but the job itself."""
        try:
            return job.step()
        except Exception as error:  # whatever a job raises: the thread goes on, and the job decides what follows
            job.failed(error)
            return False

    def hold(self) -> None:
        """Let nobody do anything until `release`."""
        self.stepping.acquire()
        self.state.acquire()

    def release(self) -> None:
        self.state.release()
        self.stepping.release()

    def release_in_child(self) -> None:
        self.thread = None  # threads are not inherited
        self.release()

    def end(self) -> None:
        """Begin no further step, and wait for the one at hand: machine code is not made while libraries go away."""
        self.over = True
        thread = self.thread
        if thread is not None:
            thread.join()


def _give_way() -> None:
    """Let the scheduler prefer everybody else to this thread, where threads have priorities of their own."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError):
            # on a busy machine it must not take half of the share of the run
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), 10)


_WORKER = _Worker()
atexit.register(_WORKER.end)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(before=_WORKER.hold, after_in_parent=_WORKER.release, after_in_child=_WORKER.release_in_child)


def submit(job: Job) -> None:
    """Have a job done beside everything else."""
    with _WORKER.state:
        _WORKER.jobs.append(job)
    _WORKER.wake()


def wake() -> None:
    """Go on with the jobs if nobody does, as in a process just forked."""
    _WORKER.wake()


def finish() -> None:
    """Wait until no job is left."""
    _WORKER.wake()
    while (thread := _WORKER.thread) is not None:
        thread.join()
