"""How columns of rows are weighed where rows are compared: by 1/√S_jj, S_jj the inertia of each motion.

A thin rod in space has no inertia about its own axis, or what round-off leaves of none. Divided by its root, that
column would be all that there is of a row, and which rows depend on others be decided by round-off. So no inertia
counts as less than a share of the largest of its unit. Planar coordinates, which add up, keep theirs.
"""

from mbd.kernel.records import Model, Reals

MIN_INERTIA_SHARE = 1e-8
"""Share of the largest inertia of its unit that a motion counts with at least, where rows are compared [-]."""


def least_inertia(K: Model, S: Reals, first: int, stride: int, unit: int) -> float:
    """The inertia that motions of a unit count with at least, S_jj at ``first + stride j``; 0 where positions add."""
    if K.vector == 1:
        return 0.0
    largest = 0.0
    for j in range(K.n_v):
        if K.unit[j] == unit:
            largest = max(largest, abs(S[first + stride * j]))
    return MIN_INERTIA_SHARE * largest


def counted_inertia(K: Model, j: int, inertia: float, least_mass: float, least_turning: float) -> float:
    """The inertia of motion j, or the least of its unit."""
    if j >= K.n_v:
        return inertia
    return max(inertia, least_turning if K.unit[j] == 1 else least_mass)
