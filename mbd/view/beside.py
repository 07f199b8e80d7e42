"""Files that a copy of this process writes while this one continues."""

import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def beside(write: Callable[[], object]) -> Iterator[None]:
    """Call `write`, which leaves nothing but files, while the body of the ``with`` runs.

    On Linux, where two processors are free to be used, a forked process does it. Elsewhere, and where that process
    fails, this one does it after the body, so that errors reach the caller.
    """
    copy = _start(write)
    try:
        yield
    except BaseException:
        if copy is not None:
            copy.terminate()
        raise
    if copy is not None:
        # seconds that a copy may take longer than its original, before the original does its work again
        copy.join(60.0)
        if copy.exitcode is None:
            copy.terminate()
            copy.join()
    if copy is None or copy.exitcode != 0:
        write()


def _start(write: Callable[[], object]) -> Any:
    """The forked process, or None where there is none."""
    if sys.platform != "linux" or len(os.sched_getaffinity(0)) < 2:
        return None
    from multiprocessing import get_context

    copy = get_context("fork").Process(target=_in_copy, args=(write,), daemon=True)
    try:
        with warnings.catch_warnings():  # of threads, which wait for a fork between two steps (mbd.compile.forking)
            warnings.simplefilter("ignore", DeprecationWarning)
            copy.start()
    except OSError:  # no memory or no process left
        return None
    return copy


def _in_copy(write: Callable[[], object]) -> None:
    """Call it in the forked process, which leaves errors to its original and runs none of its exits."""
    try:
        write()
    except BaseException:
        os._exit(1)
    os._exit(0)
