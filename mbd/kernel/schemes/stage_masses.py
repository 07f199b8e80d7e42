"""Newton's corrections of stages of which each has a mass matrix of its own, as it has in space.

Where bodies turn within a step, M of the middle stage is that of no other one; the direction e in which a light link
between heavy bodies moves easily, ``eᵀ M e`` being its own small inertia, turns with them, and the heavy bodies resist
at one stage what is easy at another: corrections left nine tenths of the error where bodies turned by a hundredth of a
radian in the step. With rates written out, ``W_i = −M_i⁻¹ f_i``, stages differ in accelerations alone:

    W_i + h Σ a_ij M⁻¹(C W_j + …) = −M_i⁻¹ r_i   or   M W_i + h Σ a_ij (C W_j + …) = −M M_i⁻¹ r_i

so that the same matrices serve, for other residuals. Where rows act, as those of a joint that is cut, the same is done
with ``K_i = [M_i R_i; B_i 0]`` and the rows' residuals as accelerations, ``(hA)⁻¹ ḣ``. That costs three factorizations
of its own, and is done where corrections with matrices of the middle stage alone leave much of the error.
"""

from mbd.equal import HALF_PRECISION_RTOL
from mbd.kernel.algebra.linear import solve_definite
from mbd.kernel.algebra.ordered import solve_kkt
from mbd.kernel.algebra.redundancy import sharing
from mbd.kernel.algebra.saddle import factor_saddle
from mbd.kernel.codes import ACCELERATIONS
from mbd.kernel.hooks import call
from mbd.kernel.records import Kernel
from mbd.kernel.schemes.stage_layout import (
    A_,
    BALANCES,
    CHANGES,
    INVERSE_,
    MASS_PART,
    MU_REAL,
    stage_place,
)
from mbd.kernel.schemes.stage_matrices import factor_stages, matrices
from mbd.kernel.schemes.stages import (
    correct_positions_where_off,
    correct_rates,
    correct_stages,
    keep_shared_loads,
    load_stage,
)


def correct_by_own_masses(K: Kernel, m: int, h: float, t1: float, renew: bool, slow: bool) -> float:
    """`correct_stages`; of bodies that turn freely for residuals over the masses of their own stages.

    Where rows act only if the iteration is `slow`.
    """
    if sharing(K):
        keep_shared_loads(K, h, t1)
    if K.vector == 0 and m == 0:
        exchange_masses(K, h, t1)
    elif K.vector == 0 and slow and not sharing(K):
        correct_positions_where_off(K, m, h, renew)
        if not exchange_masses_and_rows(K, m, h, t1):
            return 1e300
        return float(correct_rates(K, m, h))
    return float(correct_stages(K, m, h, renew))


def exchange_masses(K: Kernel, h: float, t1: float) -> None:
    """r_i ← M M_i⁻¹ r_i, M that of the middle stage in K.stages; as they are where a matrix is singular."""
    n = K.n
    o_M = stage_place(K, MASS_PART)
    for i in range(3):
        o_r = stage_place(K, BALANCES) + i * n
        load_stage(K, i, h, t1)
        call(K, ACCELERATIONS, K.acc)
        K.rhs[:n] = K.stages[o_r : o_r + n]
        if solve_definite(K.acc, n, K.rhs, K.spare) > 0.0:
            for j in range(n):
                total = 0.0
                for k in range(n):
                    total += K.stages[o_M + j * n + k] * K.rhs[k]
                K.stages[o_r + j] = total


def exchange_masses_and_rows(K: Kernel, m: int, h: float, t1: float) -> bool:
    """The same of r_i and ḣ_i with ``[M R; B 0]``, all of them as they are if one is singular; false without factors.

    The matrices of the step are made again, those of the middle stage.
    """
    n = K.n
    size = n + m
    S = K.stages
    o_r = stage_place(K, BALANCES)
    o_w = stage_place(K, CHANGES)
    inverse = 1.0 / h
    sound = True
    for i in range(3):
        load_stage(K, i, h, t1)
        call(K, ACCELERATIONS, K.acc)
        if not factor_saddle(K, m, False, HALF_PRECISION_RTOL):
            sound = False
            break
        K.rhs[:n] = S[o_r + i * size : o_r + i * size + n]
        for k in range(m):
            total = 0.0
            for j in range(3):
                total += inverse * S[INVERSE_ + 3 * i + j] * S[o_r + j * size + n + k]
            K.rhs[n + k] = total
        solve_kkt(K, size, K.rhs)
        S[o_w + i * size : o_w + i * size + size] = K.rhs[:size]
    load_stage(K, 1, h, t1)
    matrices(K, m, h)
    c = S[MU_REAL] * h
    o_M = stage_place(K, MASS_PART)
    if sound:
        for i in range(3):
            for j in range(n):
                total = 0.0
                for k in range(n):
                    total += S[o_M + j * n + k] * S[o_w + i * size + k]
                for k in range(m):
                    total += K.kkt[j * size + n + k] * S[o_w + i * size + n + k]
                S[o_r + i * size + j] = total
            for k in range(m):
                total = 0.0
                for j in range(n):
                    entry = K.kkt[(n + k) * size + j]
                    if j < K.n_v:
                        entry -= c * K.turning[k * K.n_v + j]
                    for other in range(3):
                        total += h * S[A_ + 3 * i + other] * entry * S[o_w + other * size + j]
                S[o_r + i * size + n + k] = total
    return bool(factor_stages(K, size))
