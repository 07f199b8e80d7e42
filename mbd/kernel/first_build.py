"""The first run on a machine: a kernel without optimization at once, the optimized one from a process beside it.

All levels of optimization give the same bits, so a run may begin with one kernel and end with the other.
"""

from __future__ import annotations

import contextlib
import os
import sys
import threading
import time
from collections.abc import Callable

from mbd.compile.cache import default_cache
from mbd.compile.llvm import tag_key

POLL_SECONDS = 0.5
"""Seconds between two looks at whether another process has built the kernel."""


def is_allowed() -> bool:
    """Whether the optimized kernel may come later: it is kept for the next process, and no level was asked for."""
    from mbd.compile.backend import LEVEL

    directory = default_cache().directory
    return directory is not None and LEVEL not in os.environ


def start_build(then: Callable[[], None], module: str = __name__, function: str = "build") -> None:
    """Call a function that builds, in a process that outlives this one; call `then`, from a thread, when it is done."""
    import subprocess  # takes 5 ms of every process otherwise

    environment = os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    command = f"from {module} import {function}; {function}()"
    try:
        process = subprocess.Popen(
            [sys.executable, "-c", command], env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL, start_new_session=True,
        )  # fmt: skip
    except OSError:  # no further processes: the next run tries again
        return

    def wait() -> None:
        if process.wait() == 0:
            then()

    threading.Thread(target=wait, name="mbd kernel build", daemon=True).start()


def build() -> None:
    """Build the optimized kernel for the cache, or wait for the process that does."""
    from mbd.kernel.build import kernel_text, object_of, tag

    keep(tag, lambda: object_of(kernel_text()))


def keep(tag: Callable[[], str], make: Callable[[], bytes]) -> None:
    """Put what `make` compiles into the cache, or wait for the process that does.

    Under no name where the sources have changed meanwhile, as `tag` tells: it is made of some of either.
    """
    name = tag()
    store, key = default_cache(), tag_key(name)
    assert store.directory is not None
    store.directory.mkdir(mode=0o700, parents=True, exist_ok=True)
    mark = store.directory / f"{key}.building"
    while store.load(key, lasting=True) is None:
        with contextlib.suppress(OSError):
            # seconds after which a build that has not ended is taken for dead, and another may begin
            if time.time() - mark.stat().st_mtime > 600.0:
                mark.unlink()
        try:
            mark.touch(mode=0o600, exist_ok=False)
        except FileExistsError:
            time.sleep(POLL_SECONDS)
            continue
        try:
            if store.load(key, lasting=True) is None:  # nobody has built it since the last look
                if hasattr(os, "nice"):
                    os.nice(10)  # beside the run that waits for nothing
                code = make()
                if tag() == name:
                    store.store(key, code, lasting=True)
        finally:
            mark.unlink(missing_ok=True)
        break
