"""What the derivatives of a run ask of the kernel, which does nothing of it by itself.

The tangent pass (`mbd.sensitivity.tangent`) translates the kernel with other functions of these names, its `rules`.
"""

from __future__ import annotations

from mbd.kernel.records import Kernel, Steps

__all__ = ["follow_event", "follow_matrix", "further_corrections", "note_matrix", "takes_part"]


def follow_event(K: Kernel) -> int:
    """Take the candidate at a located event once more, with the derivatives of its instant; 0, or a status."""
    return 0


def note_matrix(K: Steps) -> None:
    """Newton's matrix has been made from what is in the block."""


def follow_matrix(K: Steps, m: int, whole: bool) -> None:
    """The position correction in K.work follows its matrix; `whole`: it is all of it, not a change."""


def takes_part(value: float) -> bool:
    """Whether a factor changes what it multiplies: it is not 0, and in the tangent pass nor are its derivatives."""
    return value != 0.0


def further_corrections() -> int:
    """How many corrections follow in Newton's method when its values have converged."""
    return 0
