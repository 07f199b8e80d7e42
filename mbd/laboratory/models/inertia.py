"""Moments of inertia that a body can have."""

from collections.abc import Sequence

import numpy as np

from mbd.arrays import Matrix
from mbd.equal import EQUAL_RTOL
from mbd.errors import ModelError, quoted
from mbd.laboratory.models.report import ImportReport


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


def note_repairs(file: str, broken: Sequence[str], repair: bool, report: ImportReport) -> None:
    """Note bodies whose inertia was made possible; an error where that was not asked for."""
    if broken and not repair:
        raise ModelError(
            f"{file}: no body can have the moments of inertia of {quoted(broken)}: one is negative, or larger than the "
            "two others together; repair=True takes the nearest that a body can have"
        )
    if broken:
        report.approximated.append(f"moments of inertia made possible: {quoted(broken)}")
