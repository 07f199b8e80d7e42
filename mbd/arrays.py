"""Array aliases; the alias says the shape."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Vector: TypeAlias = NDArray[np.float64]
"""(n,) array of float64."""

Matrix: TypeAlias = NDArray[np.float64]
"""(m, n) array of float64, row-major."""

ComplexArray: TypeAlias = NDArray[np.complex128]
"""Array of complex128, of the shape that its place states."""


def read_only(array: Any) -> Any:
    """The same numbers as an array that cannot be written to; where they came from they still can be."""
    view = np.asarray(array).view()
    view.flags.writeable = False
    return view
