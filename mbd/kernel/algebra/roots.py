"""The square root of the kernel's language: one rounding, whether interpreted or at any level of optimization."""

import math


def sqrt(x: float) -> float:
    """√x; NaN of a negative number. Machine code has an instruction for it, where a power may be a call or not."""
    return math.sqrt(x) if x >= 0.0 else math.nan
