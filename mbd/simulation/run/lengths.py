"""Numbers that schemes of the kernel keep from stage to stage."""

from __future__ import annotations

from mbd.integrators.dormand_prince import STAGES
from mbd.kernel.records import Kernel
from mbd.kernel.schemes.stages import STAGES_END, stage_place

__all__ = ["NEWMARK", "RADAU_IIA", "RUNGE_KUTTA", "scheme_memory"]

NEWMARK, RUNGE_KUTTA, RADAU_IIA = range(3)
"""Numbers of the kernel's own schemes."""


def scheme_memory(K: Kernel) -> dict[str, int]:
    """Lengths of the arrays that a scheme of several stages works on, and predicts from."""
    if K.scheme == RADAU_IIA:
        return {"stages": stage_place(K, STAGES_END), "past_stages": 3 * (K.n + K.n_rows + K.n_v)}
    return {"stages": (STAGES + 1) * (K.n_v + K.n) if K.scheme == RUNGE_KUTTA else 0, "past_stages": 0}
