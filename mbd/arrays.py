"""Array aliases; the alias says the shape."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["Matrix", "Vector"]

Vector: TypeAlias = NDArray[np.float64]
"""(n,) array of float64."""

Matrix: TypeAlias = NDArray[np.float64]
"""(m, n) array of float64, row-major."""
