"""A function whose machine code is made the first time it is called."""

import ctypes
import threading
from collections.abc import Callable
from typing import Any

from mbd.arrays import Vector

_ENTRY = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)


class Postponed:
    """What `make` compiles, when it is needed; until then its address is that of a call back into Python.

    Machine code calls by that address as it calls any other function. Python must not raise through it: what was raised
    is kept in `raised`, the output is filled with NaN, and whoever called the machine code looks here afterwards.

    size : number of outputs
    """

    name = "postponed"

    def __init__(self, make: Callable[[], Any], size: int) -> None:
        self._make, self.size = make, size
        self._made: Any = None
        self._lock = threading.Lock()
        self._entry = _ENTRY(self._called)
        self._entry_address = ctypes.cast(self._entry, ctypes.c_void_p).value or 0
        self.raised: BaseException | None = None

    @property
    def made(self) -> bool:
        """Whether there is code."""
        return self._made is not None

    @property
    def provisional(self) -> bool:
        """Whether there is code, and better one is being made."""
        return bool(getattr(self._made, "provisional", False))

    @property
    def address(self) -> int:
        """Where a call goes: to the code, or to what makes it."""
        if self._made is not None:
            return int(self._made.address)
        return self._entry_address

    def __call__(self, block: Vector, parameters: Vector, out: Vector) -> None:
        self._function()(block, parameters, out)

    def _function(self) -> Any:
        with self._lock:  # runs in other threads may ask for it at once
            if self._made is None:
                self._made = self._make()
            return self._made

    def _called(self, block: int, parameters: int, out: int) -> None:
        try:
            _ENTRY(self._function().address)(block, parameters, out)
        except BaseException as exc:  # an interrupt as well: it is raised again as soon as that can be done
            self.raised = exc
            ctypes.memset(out, 0xFF, 8 * self.size)  # NaN
