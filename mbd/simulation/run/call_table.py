"""What the compiled kernel is called with: bits of numbers and addresses of arrays, in the order of its fields."""

import struct
from collections.abc import Sequence
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import address_of
from mbd.kernel.records import TABLE, Kernel

PLACES = {name: place for place, name in enumerate(TABLE.addresses)}
ARRAYS = (*TABLE.real_arrays, *TABLE.integer_arrays)
"""Names of arrays, which stand side by side, as integers and reals do."""
WHOLE = slice(0, len(TABLE.integers))
INTEGERS, REALS = struct.Struct(f"={len(TABLE.integers)}q"), struct.Struct(f"={len(TABLE.reals)}d")
BOUND = slice(WHOLE.stop + len(TABLE.reals), WHOLE.stop + len(TABLE.reals) + len(ARRAYS))
UNKNOWN: tuple[Sequence[Any], NDArray[np.int64]] = (None,) * len(ARRAYS), np.zeros(len(ARRAYS), dtype=np.int64)
"""Of arrays that are not known."""
_whole, _real = itemgetter(*TABLE.integers), itemgetter(*TABLE.reals)


class CallTable:
    """Numbers are written before every call, an address only where an array has taken the place of another.

    Parameters
    ----------
    functions : compiled functions, in the order of the kernel's `code`; more may follow later
    kernel : everything that the kernel reads and writes
    known : arrays in the order of `ARRAYS`, and their addresses, so that numpy, which takes microseconds for each,
        need not be asked; None in the place of those that are not known

    Attributes
    ----------
    renewed : names of arrays that took the place of others; who puts these back says so in `kernel.renewed`
    """

    def __init__(
        self, functions: Sequence[Any], kernel: Kernel, known: tuple[Sequence[Any], NDArray[np.int64]] = UNKNOWN
    ) -> None:
        self._words = np.zeros(len(PLACES), dtype=np.int64)
        self._bytes = self._words.data.cast("B")  # into which `struct` writes in a third of numpy's time
        self._code = np.zeros(0, dtype=np.int64)
        self._numbers: tuple[Any, Any] | None = None
        arrays, self._words[BOUND] = known
        values = vars(kernel)
        self.renewed = {name for name, array in zip(ARRAYS, arrays, strict=True) if values[name] is not array}
        kernel.renewed.update(self.renewed)
        self.address = self._words.ctypes.data
        self.fill(functions, kernel)

    def forget_code(self) -> None:
        """Ask for the addresses of all functions once more, which may be others."""
        self._code = np.zeros(0, dtype=np.int64)

    def fill(self, functions: Sequence[Any], kernel: Kernel) -> None:
        """Bring the table up to what the next call needs."""
        values = vars(kernel)
        numbers = _whole(values), _real(values)
        if numbers != self._numbers:
            self._numbers, (whole, real) = numbers, numbers
            try:
                INTEGERS.pack_into(self._bytes, 0, *whole)
            except struct.error:  # a real in the place of an integer
                self._words[WHOLE] = whole
            REALS.pack_into(self._bytes, INTEGERS.size, *real)
        for name in kernel.renewed:
            self._words[PLACES[name]] = address_of(values[name])
        self.renewed |= kernel.renewed
        kernel.renewed.clear()
        if len(functions) != len(self._code):
            self._code = np.array(
                [0 if function is None else function.address for function in functions], dtype=np.int64
            )
            self._words[PLACES["code"]] = address_of(self._code)
