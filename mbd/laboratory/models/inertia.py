"""Moments of inertia that a body can have."""

from __future__ import annotations

import numpy as np

from mbd.arrays import Matrix
from mbd.equal import EQUAL_RTOL

__all__ = ["possible_inertia"]


def possible_inertia(tensor: Matrix) -> Matrix:
    """The nearest inertia that a body can have: second moments ``½ tr I − I_k`` that are negative become 0.

    The tensor itself, the same object, where a body can have it.
    """
    moments, axes = np.linalg.eigh(tensor)
    second = 0.5 * moments.sum() - moments
    if second.min() >= -EQUAL_RTOL * max(np.abs(moments).max(), 1e-300):
        return tensor
    second = np.maximum(second, 0.0)
    return np.asarray(axes @ np.diag(second.sum() - second) @ axes.T)
