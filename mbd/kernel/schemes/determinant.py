"""The determinant of [M R; B 0] at stages of steps that are taken again: it falls next to a singular configuration."""

from mbd.compile.orders import HEADER_SIZE
from mbd.equal import DIRECT_PIVOT_RTOL
from mbd.kernel.algebra.saddle import factor_saddle
from mbd.kernel.records import Kernel

__all__ = ["FAR", "STEPS_AGAIN", "note_determinant"]

STEPS_AGAIN = 3
"""What `K.many` is while steps are taken again."""
FAR = 2.0**300
"""A power that parts of determinants keep their distance from zero and infinity by [-]."""


def note_determinant(K: Kernel, stage: int) -> None:
    """The determinant with K.acc at a stage into the present line of ends, which has 1; 0 where a pivot is missing."""
    if K.n_active == 0:
        return
    stages = K.n_nodes + 1
    place = K.run * (2 + 2 * stages + K.n_q + 2 * K.n + K.n_rows) + 2 + stage
    size = K.n + K.n_active
    K.ends[place] = 0.0
    if not factor_saddle(K, K.n_active, False, DIRECT_PIVOT_RTOL):
        return
    part = 1.0
    power = 0
    ordered = K.order_start > 0
    o_own = K.order_start + HEADER_SIZE + K.orders[K.order_start + 1] + 3 * size + 1 if ordered else 0
    for k in range(size):
        part *= K.kkt[K.orders[o_own + k] if ordered else k * (size + 1)]  # which is an inverse
        if abs(part) > FAR:
            part /= FAR
            power += 1
        elif abs(part) * FAR < 1.0:
            part *= FAR
            power -= 1
    K.ends[place] = 1.0 / part
    K.ends[place + stages] = -float(power)
