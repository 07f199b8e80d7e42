"""What the compiled kernel is called with: bits of numbers and addresses of arrays, in the order of its fields."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mbd.kernel import fields as F

__all__ = ["CallTable"]

PLACES = {name: place for place, name in enumerate(F.FIELDS)}
WHOLE = [(PLACES[name], name) for name in (*F.INTEGERS, "hooks")]
REAL = [(PLACES[name], name) for name in F.REALS]
ARRAYS = [(PLACES[name], name) for name in (*F.REAL_ARRAYS, *F.INTEGER_ARRAYS)]


class CallTable:
    """Numbers are written before every call, an address only where an array has taken the place of another.

    Parameters
    ----------
    functions : compiled functions, in the order of the kernel's `code`; more may follow later
    values : everything that the kernel reads and writes, by name
    known : arrays and their addresses, so that numpy, which takes microseconds for each, need not be asked
    """

    def __init__(
        self, functions: Sequence[Any], values: Mapping[str, Any], known: Mapping[str, tuple[Any, int]]
    ) -> None:
        self._words = np.zeros(len(F.FIELDS), dtype=np.int64)
        self._reals = self._words.view(np.float64)
        self._code = np.zeros(0, dtype=np.int64)
        self._bound: dict[int, Any] = {}
        self.address = self._words.ctypes.data
        for name, (array, address) in known.items():
            self._bound[PLACES[name]] = array
            self._words[PLACES[name]] = address
        self.fill(functions, values)

    def fill(self, functions: Sequence[Any], values: Mapping[str, Any]) -> None:
        """Bring the table up to what the next call needs."""
        for place, name in WHOLE:
            self._words[place] = values[name]
        for place, name in REAL:
            self._reals[place] = values[name]
        for place, name in ARRAYS:
            array = values[name]
            if self._bound.get(place) is not array:
                self._bound[place] = array
                self._words[place] = array.ctypes.data
        if len(functions) != len(self._code):
            self._code = np.array(
                [0 if function is None else function.address for function in functions], dtype=np.int64
            )
            self._words[PLACES["code"]] = self._code.ctypes.data
