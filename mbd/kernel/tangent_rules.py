"""What the derivatives of a run ask of the kernel, which does nothing of it by itself.

The tangent pass (`mbd.sensitivity.tangent`) translates the kernel with other functions of these names, its `rules`.
"""

from mbd.kernel.records import Balance, Equations, Integers, Kernel, Reals, Steps

NOT_FOLLOWED = -3
"""Result of `follow_newton` and `follow_stages` where they leave the step to Newton's method."""


def is_differentiated() -> bool:
    """Whether this code carries derivatives."""
    return False


def held_at_end(K: Kernel, t1: float) -> float:
    """The end of a step, which does not move where the run ends there by a given time."""
    return t1


def follow_candidate(K: Kernel, h: float, t1: float) -> int:
    """Take the candidate that is about to be accepted once more, for its derivatives; 0, or a status."""
    return 0


def follow_event(K: Kernel) -> int:
    """Take the candidate at a located event once more, with the derivatives of its instant; 0, or a status."""
    return 0


def follows_rows(K: Kernel) -> bool:
    """Whether derivatives of rows between events are stored; True where there are none."""
    return True


def note_matrix(K: Steps) -> None:
    """Newton's matrix has been made from what is in the block."""


def note_solution(K: Steps) -> None:
    """The block holds the solution of a step."""


def follow_newton(K: Kernel, h: float, t1: float, c_C: float, c_K: float) -> int:
    """The solution of a step with its derivatives, from the prediction in the block; 0, or `NOT_FOLLOWED`."""
    return NOT_FOLLOWED


def follow_rates(K: Kernel, t: float, again: bool) -> int:
    """The consistent rates in K.jump and K.impulse of (q1, y1) with their derivatives; 0, or a status."""
    return 0


def follow_factors(K: Equations, m: int) -> bool:
    """Factors of [M Bᵀ; B 0] from K.acc, which have no derivatives; false where a pivot is missing."""
    return False


def follow_solution(K: Equations, m: int) -> None:
    """K.rhs ← A⁻¹ K.rhs with these factors, and the derivatives of both."""


def follow_stage(K: Kernel, h: float, t: float, stage: int) -> bool:
    """The rates of a stage of an explicit step with their derivatives, where straight-line code has them."""
    return False


def follow_move(K: Steps, h: float, weights: int, count: int) -> None:
    """h times the weighted slopes of the first stages into K.spare."""


def follow_stages(K: Kernel, h: float, t1: float, m: int) -> int:
    """The same for a step of several stages."""
    return NOT_FOLLOWED


def follow_matrix(K: Steps, m: int, x: Reals, whole: bool) -> None:
    """A correction x follows its matrix; `whole`: x is all that positions are corrected by, not a change of it."""


def note_edges(K: Balance) -> None:
    """A phase of an impact has been found, who takes part in it and how."""


def note_order(K: Balance, fastest: float, ends: bool) -> None:
    """The contacts of the next impact of the sequential law have been chosen, or that it `ends`."""


def note_zero(K: Balance, c: int, value: float) -> None:
    """Contact c gets such an impulse in restitution."""


def solve_plain(plain_A: Reals, n: int, pivots: Integers, b: Reals, first: int) -> None:
    """b ← A⁻¹ b with factors that have no derivatives; b are the numbers from `first` on."""


def takes_part(value: float) -> bool:
    """Whether a factor changes what it multiplies: it is not 0, and in the tangent pass nor are its derivatives."""
    return value != 0.0


def further_corrections() -> int:
    """How many corrections follow in Newton's method when its values have converged."""
    return 0
