"""Words of the rules that the printer knows (`printer`), what follows from them, and where K.starts holds what.

Numbers in K.starts: inputs of the last of Newton's matrices | W | the block of the solution | what is noted of a step
(1), and of the run (5) | the candidate | columns of K₀⁻¹ or stages.
"""

from mbd.equal import ROUND_OFF_RTOL
from mbd.kernel.records import Integers, Kernel, Reals, Sizes

MAX_CONTRACTION = 0.9
"""Part of the last correction of derivatives above which the next one is round-off [-]."""
SAFETY = 0.1
"""Part of `ROUND_OFF_RTOL` that a correction must be expected to stay below if it is not made [-]."""
MAX_CORRECTIONS = 40
"""Corrections of derivatives with matrices that are not quite those of the solution [-]."""


def are_corrected(change: float, before: float, largest: float) -> bool:
    """Whether a correction of derivatives was round-off, or the next one will be if it shrinks like this one.

    before : the last one; largest : of the rates
    """
    if change <= ROUND_OFF_RTOL * largest or change > MAX_CONTRACTION * before:
        return True
    return before < 1e300 and change * change <= SAFETY * ROUND_OFF_RTOL * largest * before


def is_differentiated() -> bool:
    """Whether this code carries derivatives (see `printer`)."""
    return False


def seeded(h: float) -> float:
    """A step size that is differentiated by, in the last direction (see `printer`)."""
    return h


def at_root(h: float, value: float) -> float:
    """The step size h at which a value is zero, with its derivatives ``−g'/ġ`` (see `printer`)."""
    return h


def seed_rate(value: float) -> float:
    """The derivative of a value in the last direction (see `printer`)."""
    return 1.0


def without_tangent(value: float) -> float:
    """The value alone (see `printer`)."""
    return value


def largest_derivative(value: float) -> float:
    """The largest size of the derivatives of a value (see `printer`)."""
    return 0.0


def takes_part(value: float) -> bool:
    """Whether a value or one of its derivatives is not 0: a matrix passes through entries of 0 (see `printer`)."""
    return value != 0.0


def moved(value: float, goal: float) -> float:
    """A value brought to another one, with the derivatives that it has."""
    return value + (without_tangent(goal) - without_tangent(value))


def derivative_of(value: float) -> float:
    """0 with the derivatives of a value, whatever that is (see `printer`)."""
    return value - without_tangent(value)


def solve_plain(plain_A: Reals, n: int, pivots: Integers, b: Reals, first: int) -> None:
    """b ← A⁻¹ b with the factors of `mbd.kernel.algebra.linear.factor`, which have no derivatives here.

    b are the n numbers from `first` on.

    By rows, so that sums of vectors stay in registers, and two at once, which read the same entries of b.
    """
    for k in range(n):
        p = pivots[k]
        if p != k:
            swap = b[first + k]
            b[first + k] = b[first + p]
            b[first + p] = swap
    i = 0
    while i < n:
        o = i * n
        o_next = o + n if i + 1 < n else o
        own = 0.0
        following = 0.0
        for k in range(i):
            own += plain_A[o + k] * b[first + k]
            following += plain_A[o_next + k] * b[first + k]
        b[first + i] -= own
        if i + 1 < n:
            b[first + i + 1] -= following + plain_A[o_next + i] * b[first + i]
        i += 2
    i = n - 1
    while i >= 0:
        o = i * n
        o_next = o - n if i > 0 else o
        own = 0.0
        following = 0.0
        for k in range(i + 1, n):
            own += plain_A[o + k] * b[first + k]
            following += plain_A[o_next + k] * b[first + k]
        b[first + i] = (b[first + i] - own) * plain_A[o + i]
        if i > 0:
            b[first + i - 1] = (b[first + i - 1] - following - plain_A[o_next + i] * b[first + i]) * plain_A[
                o_next + i - 1
            ]
        i -= 2


def n_inputs(K: Sizes) -> int:
    """How many numbers the inputs of Newton's matrix are."""
    return int(K.o_slip + K.n_frictions + K.n_v)


def solution_place(K: Sizes) -> int:
    """Where the block of the solution begins in K.starts."""
    return int(n_inputs(K) + K.n + K.n_rows + K.n_v)


def step_place(K: Sizes) -> int:
    """Where what is noted of a step begins in K.starts."""
    return int(solution_place(K) + n_inputs(K))


def was_near_singular(K: Kernel) -> bool:
    """Whether the candidate was made as one next to a singular configuration, or over it."""
    return bool(K.starts[step_place(K)] > 0.0)


def every_row_place(K: Sizes) -> int:
    """Where K.starts says whether all rows are stored with their derivatives."""
    return int(step_place(K) + 1)


def edge_place(K: Sizes) -> int:
    """Where K.starts says what a change decides in an impact, and when: see `follow_impacts.note`; 0: nothing."""
    return int(every_row_place(K) + 1)


def candidate_place(K: Sizes) -> int:
    """Where the candidate begins in K.starts."""
    return int(edge_place(K) + 4)


def metric_place(K: Kernel) -> int:
    """Where columns of K₀⁻¹, or stages, begin in K.starts."""
    kept = K.n_q + 4 * K.n + 2 * K.n_rows + 1 + 2 * K.n_v + K.n_watched + K.n_frictions
    return int(candidate_place(K) + kept)


def turned_program(K: Kernel) -> int:
    """The number of the program whose derivative is that of Newton's matrix times a given W (see `programs`)."""
    return int(K.residual_program + (3 if K.correction_program > 0 else 1))


def derivative_program(K: Kernel) -> int:
    """The number of the program that has the derivatives of the residual, and no values."""
    return turned_program(K) + 1


def solved_program(K: Kernel) -> int:
    """The number of the program of the system of a step, or of rates (see `systems`)."""
    return int(derivative_program(K) + (3 if K.rates_program > 0 else 1))


def metric_program(K: Kernel) -> int:
    """That of a position correction of a step."""
    return solved_program(K) + 1
