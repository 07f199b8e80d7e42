"""Array aliases; the alias says the shape."""

import ctypes
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Vector: TypeAlias = NDArray[np.float64]
"""(n,) array of float64."""

Matrix: TypeAlias = NDArray[np.float64]
"""(m, n) array of float64, row-major."""

ComplexArray: TypeAlias = NDArray[np.complex128]
"""Array of complex128, of the shape that its place states."""


def address_of(array: Any) -> int:
    """The address of the first number of a contiguous array; ``array.ctypes.data`` takes five times as long."""
    if array.size and array.flags.writeable:
        return ctypes.addressof(ctypes.c_char.from_buffer(array))
    address: int = array.ctypes.data
    return address


def read_only(array: Any) -> Any:
    """The same numbers as an array that cannot be written to; where they came from they still can be."""
    view = np.asarray(array)
    if view.flags.writeable:
        view = view.view()
        view.flags.writeable = False
    return view
