"""Locks that must be free in a process just forked.

A process that forks while another of its threads holds a lock leaves it held in the child for ever, where that thread
does not exist. So the thread that forks takes these locks first, which waits until nobody compiles, and gives them back
on both sides.
"""

import os
import sys
import threading
from contextlib import AbstractContextManager
from typing import Any

COMPILING = threading.RLock()
"""Held while LLVM is at work."""

_LOCKS: list[AbstractContextManager[Any]] = [COMPILING]
_HELD: list[AbstractContextManager[Any]] = []


def free_in_child(lock: AbstractContextManager[Any]) -> None:
    """Take this lock, too, before a fork; whoever holds it must not wait for those that were named before it."""
    _LOCKS.append(lock)


def _hold() -> None:
    binding = sys.modules.get("llvmlite.binding.ffi")
    own = getattr(getattr(binding, "lib", None), "_lock", None)  # llvmlite frees things whenever Python does
    for lock in [*_LOCKS, *([own] if isinstance(own, AbstractContextManager) else [])]:
        lock.__enter__()
        _HELD.append(lock)


def _release() -> None:
    while _HELD:
        _HELD.pop().__exit__(None, None, None)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(before=_hold, after_in_parent=_release, after_in_child=_release)
