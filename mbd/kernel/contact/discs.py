"""The smallest y, or the least last number of one, over discs, by an interior-point method: how frictions share a load.

``min ½ ‖y‖²`` or ``min y_n``  with  ``‖t_i‖ ≤ ℓ_i``,  t_i (three numbers, in a plane the last 0) and ℓ_i affine in y

in the smooth form ``g_i = ‖t_i‖²/ℓ_i − ℓ_i ≤ 0``, which is convex; multipliers κ_i ≥ 0. Newton's method on the
conditions of optimality with κ_i (−g_i) = τ, τ → 0 (Boyd & Vandenberghe 2004, Convex Optimization,
ch. 11.7). All numbers are of the size of one: whoever asks scales them.
"""

from mbd.kernel.algebra.linear import factor, solve
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.records import Complementarity

DISC_SIZE = 4
"""Numbers of a disc: three t_i and ℓ_i [-]."""
GAP_REDUCTION = 0.1
"""Part of the present gap that the next step aims at [-]."""
GAP_ATOL = 1e-15
"""κ_i (−g_i) that is none [-]."""
BOUNDARY_SHARE = 0.99
"""Part of the way to the border that a step goes at most [-]."""


def disc_value(K: Complementarity, row: int, unknowns: int) -> float:
    """Number `row` of K.disc_map y + K.disc_at: three t_i and ℓ_i of each disc."""
    value = K.disc_at[row]
    for j in range(unknowns):
        value += K.disc_map[row * K.n_disc_unknowns + j] * K.disc_y[j]
    return float(value)


def disc_length(K: Complementarity, i: int, unknowns: int) -> float:
    """‖t_i‖."""
    x = disc_value(K, DISC_SIZE * i, unknowns)
    y = disc_value(K, DISC_SIZE * i + 1, unknowns)
    z = disc_value(K, DISC_SIZE * i + 2, unknowns)
    return sqrt(x * x + y * y + z * z)


def disc_slack(K: Complementarity, i: int, unknowns: int) -> float:
    """−g_i; negative as well where ℓ_i is."""
    length = disc_length(K, i, unknowns)
    limit = disc_value(K, DISC_SIZE * i + 3, unknowns)
    if not limit > 0.0:
        return -1.0
    return float((limit - length) * (limit + length) / limit)


def find_slopes(K: Complementarity, i: int, unknowns: int) -> None:
    """g_i′ into K.disc_slope, and what κ_i g_i″ and κ_i/s_i g_i′ g_i′ᵀ bring into K.disc_matrix."""
    width = K.n_disc_unknowns
    limit = disc_value(K, DISC_SIZE * i + 3, unknowns)
    x = disc_value(K, DISC_SIZE * i, unknowns) / limit
    y = disc_value(K, DISC_SIZE * i + 1, unknowns) / limit
    z = disc_value(K, DISC_SIZE * i + 2, unknowns) / limit
    o = DISC_SIZE * i * width
    o_l = o + 3 * width
    for j in range(unknowns):
        K.disc_slope[i * width + j] = (
            2.0 * (x * K.disc_map[o + j] + y * K.disc_map[o + width + j] + z * K.disc_map[o + 2 * width + j])
            - (x * x + y * y + z * z + 1.0) * K.disc_map[o_l + j]
        )
    steep = K.disc_force[i] / K.disc_left[i]
    bend = 2.0 * K.disc_force[i] / limit
    for j in range(unknowns):
        first = K.disc_map[o + j] - x * K.disc_map[o_l + j]
        second = K.disc_map[o + width + j] - y * K.disc_map[o_l + j]
        third = K.disc_map[o + 2 * width + j] - z * K.disc_map[o_l + j]
        slope = K.disc_slope[i * width + j]
        if first == 0.0 and second == 0.0 and third == 0.0 and slope == 0.0:
            continue
        for k in range(unknowns):
            K.disc_matrix[j * unknowns + k] += (
                steep * slope * K.disc_slope[i * width + k]
                + bend * first * (K.disc_map[o + k] - x * K.disc_map[o_l + k])
                + bend * second * (K.disc_map[o + width + k] - y * K.disc_map[o_l + k])
                + bend * third * (K.disc_map[o + 2 * width + k] - z * K.disc_map[o_l + k])
            )


def find_step(K: Complementarity, unknowns: int, discs: int, smallest: bool, target: float) -> int:
    """The step of Newton's method, of y into K.disc_step and of κ into K.disc_change; 1 if there is none."""
    width = K.n_disc_unknowns
    K.disc_matrix[: unknowns * unknowns] = 0.0
    if smallest:
        for j in range(unknowns):
            K.disc_matrix[j * unknowns + j] = 1.0
    for i in range(discs):
        find_slopes(K, i, unknowns)
    for j in range(unknowns):
        value = 1.0 if j == unknowns - 1 else 0.0
        if smallest:
            value = K.disc_y[j]
        for i in range(discs):
            value += target / K.disc_left[i] * K.disc_slope[i * width + j]
        K.disc_step[j] = -value
    if factor(K.disc_matrix, unknowns, K.side_pivots) != 0:
        return 1
    solve(K.disc_matrix, unknowns, K.side_pivots, K.disc_step)
    for i in range(discs):
        along = 0.0
        for j in range(unknowns):
            along += K.disc_slope[i * width + j] * K.disc_step[j]
        K.disc_change[i] = (target + K.disc_force[i] * along) / K.disc_left[i] - K.disc_force[i]
    return 0


def take_part(K: Complementarity, unknowns: int, discs: int) -> float:
    """Go along the step as far as all discs allow; how far, 0 if not at all."""
    part = 1.0
    for i in range(discs):
        if K.disc_change[i] < 0.0:
            part = min(part, -BOUNDARY_SHARE * K.disc_force[i] / K.disc_change[i])
    for j in range(unknowns):
        K.disc_kept[j] = K.disc_y[j]
    for _ in range(60):
        inside = True
        for j in range(unknowns):
            K.disc_y[j] = K.disc_kept[j] + part * K.disc_step[j]
        for i in range(discs):
            left = disc_slack(K, i, unknowns)
            inside = inside and left > (1.0 - BOUNDARY_SHARE) * K.disc_left[i] * (1.0 - part)
            inside = inside and left > 0.0
        if inside:
            for i in range(discs):
                K.disc_force[i] += part * K.disc_change[i]
                K.disc_left[i] = disc_slack(K, i, unknowns)
            return part
        part *= 0.7
    for j in range(unknowns):
        K.disc_y[j] = K.disc_kept[j]
    return 0.0


def minimize_within_discs(K: Complementarity, unknowns: int, discs: int, smallest: bool) -> int:
    """The `smallest` y, or the one whose last number is least, in K.disc_y, from one inside all discs there.

    κ in K.disc_force; 1 if the first y is outside.
    """
    for i in range(discs):
        K.disc_left[i] = disc_slack(K, i, unknowns)
        if not K.disc_left[i] > 0.0:
            return 1
        K.disc_force[i] = 1.0 / K.disc_left[i] if K.disc_left[i] > 1e-3 else 1e3
    small = 0
    for _ in range(80):  # steps of Newton's method
        gap = 0.0
        for i in range(discs):
            gap += K.disc_force[i] * K.disc_left[i] / discs
        if find_step(K, unknowns, discs, smallest, GAP_REDUCTION * gap) != 0:
            return 0
        part = take_part(K, unknowns, discs)
        size = 0.0
        for j in range(unknowns):
            size = max(size, abs(part * K.disc_step[j]))
        if part == 0.0 or (gap < GAP_ATOL and size < 1e-13):
            return 0
        small = small + 1 if gap < GAP_ATOL else 0
        if small > 5:
            return 0
    return 0
