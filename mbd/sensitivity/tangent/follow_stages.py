"""A step of several implicit stages, which are known, with its derivatives."""

from mbd.equal import EQUAL_RTOL, NOMINAL_RTOL
from mbd.kernel.algebra.linear import factor
from mbd.kernel.algebra.redundancy import sharing
from mbd.kernel.codes import NO_DERIVATIVE
from mbd.kernel.records import Kernel
from mbd.kernel.schemes.coupled_stages import correct_coupled_rates, couple_stages
from mbd.kernel.schemes.radau import singular_stages_step
from mbd.kernel.schemes.radau_end import complete
from mbd.kernel.schemes.stage_layout import CHANGES, HELD, MU_REAL, STAGE_BEND, STAGE_RATES, STAGE_SHIFT, stage_place
from mbd.kernel.schemes.stage_masses import exchange_masses
from mbd.kernel.schemes.stage_matrices import factor_stages, matrices
from mbd.kernel.schemes.stages import (
    correct_positions_of_stages,
    correct_rates,
    evaluate_stages,
    hold_block,
    load_stage,
    predict_stages,
)
from mbd.kernel.tangent_rules import NOT_FOLLOWED
from mbd.sensitivity.tangent.follow_coupled_stages import (
    MAX_COUPLED,
    follow_coupled_stages,
    prepare_coupled_stages,
)
from mbd.sensitivity.tangent.words import (
    MAX_CONTRACTION,
    MAX_CORRECTIONS,
    are_corrected,
    derivative_of,
    largest_derivative,
    metric_place,
    moved,
    was_near_singular,
    without_tangent,
)

MAX_SHARE_LEFT = 0.5
"""Part of the last correction of derivatives above which stages take matrices of their own [-]."""


def n_stage_numbers(K: Kernel) -> int:
    """How many numbers the unknowns of all stages are."""
    return int(3 * (K.n + K.n_rows + K.n_v))


def keep_stages(K: Kernel) -> None:
    """The values of the stages behind the candidate in K.starts."""
    carry_stages(K, True)


def restore_stages(K: Kernel) -> None:
    """The values that stages had."""
    carry_stages(K, False)


def carry_stages(K: Kernel, out: bool) -> None:
    """The values of the stages there or back, and where coordinates do not add what bends them."""
    place = metric_place(K)
    for part in range(2 if K.vector == 0 else 1):
        o = stage_place(K, STAGE_RATES if part == 0 else STAGE_BEND)
        count = n_stage_numbers(K) if part == 0 else 3 * K.n_v
        for i in range(count):
            if out:
                K.starts[place + i] = K.stages[o + i]
            else:
                K.stages[o + i] = K.starts[place + i]
        place += count


def prepare_stages(K: Kernel, m: int, h: float, t1: float) -> int:
    """Newton's matrices at the middle stage, factored, their rows behind the stages; 0, or that one is singular."""
    load_stage(K, 1, h, t1)
    matrices(K, m, h)
    o = metric_place(K) + n_stage_numbers(K) + 3 * K.n_v
    for k in range(m):
        for j in range(K.n_v):
            K.starts[o + k * K.n_v + j] = K.kkt[(K.n + k) * (K.n + m) + j]
    return 0 if factor_stages(K, K.n + m) else 1


def follow_held(K: Kernel, m: int) -> None:
    """The derivatives of H U_i, with H held, for the first correction of positions (see `stage_matrices.keep_held`)."""
    o_U = stage_place(K, STAGE_SHIFT)
    o_H = stage_place(K, HELD)
    o_Z = metric_place(K) + n_stage_numbers(K) + 3 * K.n_v
    for i in range(3):
        for k in range(m):
            total = 0.0
            for j in range(K.n_v):
                total += without_tangent(K.starts[o_Z + k * K.n_v + j]) * derivative_of(K.stages[o_U + i * K.n_v + j])
            K.stages[o_H + i * m + k] = without_tangent(K.stages[o_H + i * m + k]) + total


def prepare_coupled(K: Kernel, m: int, h: float, t1: float) -> bool:
    """Factors of the matrix of all stages at once; false where a pivot is missing."""
    couple_stages(K, m, h, t1)
    return bool(factor(K.coupled, 3 * (K.n + m), K.coupled_pivots) == 0)


def is_coupled(K: Kernel, m: int) -> bool:
    """Whether one system has the derivatives of all stages: its matrix is the derivative itself, and not too large."""
    return bool(K.vector == 1 and K.n_cones == 0 and 3 * (K.n + 2 * m) <= MAX_COUPLED)


def follow_stages(K: Kernel, h: float, t1: float, m: int) -> int:
    """The derivatives of the stages that are there, from those of their prediction.

    Stages on both sides of a singular configuration are found once more, as they were found.

    One system has them all where its matrix is the derivative itself. Else the matrices are those of the middle stage,
    as in the step itself: corrections are taken until they are round-off. Where they do not shrink, each stage takes
    matrices of its own.
    """
    if sharing(K):
        return NOT_FOLLOWED
    status = 0
    n = K.n
    c = without_tangent(K.stages[MU_REAL] * h)
    keep_stages(K)
    if was_near_singular(K):
        status = singular_stages_step(K, h, t1)
        restore_stages(K)
        return status
    K.near_singular = 0
    hold_block(K)
    predict_stages(K, h, m)
    # values of the solution, derivatives of the prediction
    place = metric_place(K)
    o = stage_place(K, STAGE_RATES)
    for i in range(n_stage_numbers(K)):
        K.stages[o + i] = moved(K.stages[o + i], K.starts[place + i])
    if is_coupled(K, m) and prepare_coupled_stages(K, m, h, t1):
        o_U = stage_place(K, STAGE_SHIFT)
        for i in range(3 * K.n_v):
            K.stages[o_U + i] = without_tangent(K.stages[o_U + i])
        evaluate_stages(K, h, t1, m, 1.0, c, c * c, False)
        follow_coupled_stages(K, m, h)
        status = complete(K, h, t1, m, False, False)
        restore_stages(K)
        return status
    if K.vector == 0:
        o_E = stage_place(K, STAGE_BEND)
        for i in range(3 * K.n_v):
            K.stages[o_E + i] = without_tangent(K.starts[place + n_stage_numbers(K) + i])
    if prepare_stages(K, m, h, t1) != 0:
        return NOT_FOLLOWED
    size = n + m
    for i in range(size * size):
        K.kkt[i] = without_tangent(K.kkt[i])
    o_D = stage_place(K, CHANGES)
    before = 1e300
    left = 0.0
    largest = 0.0
    coupled = False
    for iteration in range(MAX_CORRECTIONS):
        evaluate_stages(K, h, t1, m, 1.0, c, c * c, False)
        if K.vector == 0 and m == 0 and not coupled:
            exchange_masses(K, h, t1)
        if m > 0:
            if iteration == 0:
                follow_held(K, m)
            correct_positions_of_stages(K, m, h, iteration == 0)
        if coupled:
            correct_coupled_rates(K, m, h)
        else:
            correct_rates(K, m, h)
        change = 0.0
        largest = 0.0
        for i in range(3):
            for j in range(n):
                change = max(change, largest_derivative(K.stages[o_D + i * size + j]))
                largest = max(largest, largest_derivative(K.stages[o + i * n + j]))
        if not coupled and change > MAX_SHARE_LEFT * before and change > EQUAL_RTOL * largest:
            if not prepare_coupled(K, m, h, t1):
                return NOT_FOLLOWED
            coupled = True
            before = 1e300
            continue
        if are_corrected(change, before, largest):
            left = change if change > MAX_CONTRACTION * before else 0.0
            break
        before = change
        left = change
    status = complete(K, h, t1, m, False, False)
    restore_stages(K)
    # where rates die away their derivatives are round-off beside those of velocities
    for j in range(n):
        largest = max(largest, largest_derivative(K.y[j]) / h)
    if left > NOMINAL_RTOL * largest:
        K.failure_time = t1
        return NO_DERIVATIVE
    return status
