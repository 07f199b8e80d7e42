"""Two steps of other sizes that last half a step less than two whole ones, and err like those that last as long.

A step of size h errs by c h³, with c of the motion. Steps a dt and b dt with ``a + b = 3/2``, ``a³ + b³ = a + b`` thus
err together like whole steps for that time, c dt² · 3/2 dt, and move the instants by half a step: away from a
singularity near which none may lie. One step of dt/2 would err by 3/8 c dt³ less, at some passages and not at others,
by where the grid happens to lie: enough to hide that the sum of all errors falls as dt².
"""

from mbd.equal import NOMINAL_RTOL
from mbd.kernel.records import State

LONG_PART = 0.75 + 0.38188130791298669
"""3/4 + √(7/48), part of dt, of the second: what is predicted from it is stretched little [-]."""
SHORT_PART = 0.75 - 0.38188130791298669
"""3/4 − √(7/48), part of dt, of the first [-]."""
SECOND, FIRST, ALONE = 1, 2, 3
"""Values of paired_step: the longer of a pair is next, the shorter is tried; one sized for a singularity is."""


def is_of_pair(size: float) -> bool:
    """Whether a step of this size, part of dt, is one of a pair."""
    return abs(size - SHORT_PART) <= NOMINAL_RTOL or abs(size - LONG_PART) <= NOMINAL_RTOL


def is_whole(K: State, h: float) -> bool:
    """Whether a step of size h is one of the grid."""
    return bool(abs(h - K.step) <= NOMINAL_RTOL * K.step)


def may_pair(K: State, h: float) -> bool:
    """Whether a step of size h that would lead too near to a singularity may be replaced by a pair: one of the grid."""
    return bool(K.paired_step == 0 and K.halvings == 0 and is_whole(K, h))
