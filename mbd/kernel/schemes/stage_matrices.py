"""Newton's matrices of all stages at once, a real and a complex one: made, factored, and solved with.

They come from one transformation of A = (a_ij) (Hairer & Wanner 1996, IV.8): for each eigenvalue μ of A the matrix of a
one-stage step with ∂v/∂v̇ = hμ and ∂x/∂v̇ = (hμ)². The real one is the compiled tangent itself; that of the pair is put
together from three of them.
"""

from mbd.equal import HALF_PRECISION_RTOL
from mbd.kernel.algebra.complex_linear import factor_complex, solve_complex
from mbd.kernel.algebra.linear import factor
from mbd.kernel.algebra.ordered import OF_TANGENT, clear_tangent, factor_ordered, order_at, solve_held
from mbd.kernel.algebra.ordered_complex import factor_pair_ordered, solve_pair_ordered
from mbd.kernel.algebra.redundancy import sharing
from mbd.kernel.codes import PASSING
from mbd.kernel.hooks import call
from mbd.kernel.records import DependentRows, SingularSteps, Steps
from mbd.kernel.schemes.stage_layout import (
    BALANCES,
    HELD,
    MASS_PART,
    MU_IM,
    MU_RE,
    MU_REAL,
    PAIR,
    PAIR_PIVOTS,
    PAIR_RHS,
    S_IM,
    S_RE,
    S_REAL,
    STAGE_SHIFT,
    STIFF_PART,
    stage_place,
)
from mbd.kernel.stepping.restart import add_shares


def matrices(K: SingularSteps, m: int, h: float) -> None:
    """The real and the complex matrix at the block, whose r, h and ḣ stay in K.out.

    ``P(c) = M + c C + c² K`` and the rows ``B + c ∂ḣ/∂x``: at c = μh, (c, 0) and (−c, 0) the compiled tangent gives
    ``M + c C + c² K``, ``M + c C`` and ``M − c C``. Next to a singular configuration they are B alone.
    """
    n = K.n
    size = n + m
    S = K.stages
    c = S[MU_REAL] * h
    o_M = stage_place(K, MASS_PART)
    o_K = stage_place(K, STIFF_PART)
    o_P = stage_place(K, PAIR)
    K.block_c_C = c
    K.block_c_K = c * c
    tangent_of_stage(K, m)
    K.kkt[: size * size] = K.out[: size * size]
    K.turning[: m * K.n_v] = K.out[size * size + n + 2 * m : size * size + n + 2 * m + m * K.n_v]
    K.block_c_K = 0.0
    tangent_of_stage(K, m)
    S[o_P : o_P + size * size] = K.out[: size * size]
    K.block_c_C = -c
    tangent_of_stage(K, m)
    K.n_tangents += 3
    inverse = 1.0 / S[MU_REAL]
    re = S[MU_RE] * inverse
    im = S[MU_IM] * inverse
    for i in range(size):
        for j in range(size):
            k = i * size + j
            full = K.kkt[k]
            part = S[o_P + k]
            if i >= n:
                if K.near_singular == PASSING:
                    K.kkt[k] = part
                    full = part
                S[o_P + k] = part + re * (full - part)
                S[o_P + size * size + k] = im * (full - part)
                continue
            mass = 0.5 * (part + K.out[k])
            damping = 0.5 * (part - K.out[k])
            stiffness = full - part
            S[o_P + k] = mass + re * damping + (re * re - im * im) * stiffness
            S[o_P + size * size + k] = im * damping + 2.0 * re * im * stiffness
            if j < n:
                S[o_M + i * n + j] = mass
                S[o_K + i * n + j] = stiffness
    keep_held(K, m)


def tangent_of_stage(K: DependentRows, m: int) -> None:
    """The tangent at the block in K.out, with what dependent rows bear where a friction slides."""
    clear_tangent(K, m, K.out)
    call(K, K.tangent_program, K.out)
    if sharing(K):
        add_shares(K, K.out, m)


def keep_held(K: Steps, m: int) -> None:
    """H U_i with the new H, from which U_i are found again: they stay in the range of the rows in one metric."""
    size = K.n + m
    o_U = stage_place(K, STAGE_SHIFT)
    o_H = stage_place(K, HELD)
    for i in range(3):
        for k in range(m):
            total = 0.0
            for j in range(K.n_v):
                total += K.kkt[(K.n + k) * size + j] * K.stages[o_U + i * K.n_v + j]
            K.stages[o_H + i * m + k] = total


def factor_stages(K: SingularSteps, size: int) -> bool:
    """LU factors of both matrices; false where a pivot is missing."""
    o = 0 if sharing(K) else order_at(K, size - K.n)
    column = 0
    if o == 0 or not factor_ordered(K, K.kkt, o, OF_TANGENT, HALF_PRECISION_RTOL):
        K.order_start = 0
        K.n_pivoted += 1 if o > 0 else 0
        column = factor(K.kkt, size, K.pivots)
    o_P = stage_place(K, PAIR_PIVOTS)
    if column == 0 and o > 0 and factor_pair_ordered(K, stage_place(K, PAIR), o, HALF_PRECISION_RTOL):
        K.stages[o_P] = -float(o)  # in the place of a row, which is not negative
    elif column == 0:
        column = factor_complex(K.stages, stage_place(K, PAIR), size, o_P)
    K.n_factorizations += 1
    K.failure_index = column - 1
    return bool(column == 0)


def solve_real(K: Steps, m: int, h: float) -> None:
    """The component along the real eigenvector, into K.rhs."""
    size = K.n + m
    S = K.stages
    o_r = stage_place(K, BALANCES)
    inverse = 1.0 / (S[MU_REAL] * h)
    for j in range(size):
        total = 0.0
        for i in range(3):
            total -= S[S_REAL + i] * S[o_r + i * size + j]
        K.rhs[j] = total if j < K.n else total * inverse
    solve_held(K, size, K.rhs)


def solve_pair(K: Steps, m: int, h: float) -> None:
    """The component along one vector of the pair, into K.stages."""
    size = K.n + m
    S = K.stages
    o_r = stage_place(K, BALANCES)
    o_b = stage_place(K, PAIR_RHS)
    length = h * (S[MU_RE] * S[MU_RE] + S[MU_IM] * S[MU_IM])
    for j in range(size):
        re = 0.0
        im = 0.0
        for i in range(3):
            re -= S[S_RE + i] * S[o_r + i * size + j]
            im -= S[S_IM + i] * S[o_r + i * size + j]
        if j >= K.n:  # over h μ
            turned = (re * S[MU_RE] + im * S[MU_IM]) / length
            im = (im * S[MU_RE] - re * S[MU_IM]) / length
            re = turned
        S[o_b + j] = re
        S[o_b + size + j] = im
    o_P = stage_place(K, PAIR_PIVOTS)
    if S[o_P] < 0.0:
        solve_pair_ordered(K, stage_place(K, PAIR), int(-S[o_P]), o_b)
    else:
        solve_complex(S, stage_place(K, PAIR), size, o_P, S, o_b)
