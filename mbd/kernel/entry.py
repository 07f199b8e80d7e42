"""The compiled kernel as a function: from a wheel, from the cache, or built now."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from mbd.kernel import shipped
from mbd.kernel.build import ENTRY, LISTED, kernel_object, kernel_text, object_of, source_digest, tag
from mbd.kernel.schemes import contract


@lru_cache(maxsize=1)
def entry() -> Callable[[int], int]:
    """The compiled kernel: ``entry(address of table) → status``; at first perhaps one without optimization."""
    from mbd.compile.backend import LEVEL
    from mbd.compile.cache import default_cache
    from mbd.compile.llvm import cached_object, load_object, tag_key
    from mbd.kernel.first_build import is_allowed

    if contract.SCHEMES == LISTED and LEVEL not in os.environ:
        code = shipped.load()
        if code is not None:
            return _called(load_object(code, ENTRY))
        code = default_cache().load(tag_key(tag()), lasting=True)
        if code is not None:
            return _called(load_object(code, ENTRY))
        if is_allowed():
            return _quick_entry()
    return _called(load_object(cached_object(tag(), kernel_object, lasting=True), ENTRY))


def _quick_entry() -> Callable[[int], int]:
    """A kernel without optimization, until a process beside this one has made the other."""
    from mbd.compile.llvm import Machine, cached_object
    from mbd.kernel.first_build import start_build

    def quick() -> bytes:
        print(
            "mbd: building the stepping kernel, once for this machine; a faster one follows in the background …",
            file=sys.stderr, flush=True,
        )  # fmt: skip
        return object_of(kernel_text(), 0)

    _machines.append(Machine())
    code = cached_object(f"level 0 {source_digest()}", quick)
    start_build(then=entry.cache_clear)
    return _called(_machines[-1].load(code, [ENTRY])[0])


_machines: list[Any] = []
"""What holds quick kernels, which may still be running."""


def _called(address: int) -> Callable[[int], int]:
    return ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p)(address)
