"""Newton's corrections of stages where masses differ by orders of magnitude: each stage has its own mass matrix.

A light body between heavy ones moves easily along one direction e of the coordinates only, ``eᵀ M e`` is its own small
inertia, and e turns with the pose. With M of the middle stage for all three, the heavy bodies resist what is easy at
another one: with masses of 10⁻⁵ of their neighbours' corrections left nine tenths of the error where bodies turned by a
hundredth of a radian in the step. With rates written out, ``W_i = −M_i⁻¹ f_i``, stages differ in accelerations alone:

    W_i + h Σ a_ij M⁻¹(C W_j + …) = −M_i⁻¹ r_i   or   M W_i + h Σ a_ij (C W_j + …) = −M M_i⁻¹ r_i

so that the same matrices serve, for other residuals.
"""

from __future__ import annotations

from mbd.kernel.codes import ACCELERATIONS
from mbd.kernel.hooks import call
from mbd.kernel.linear import solve_definite
from mbd.kernel.mass_ratios import is_uneven
from mbd.kernel.records import Kernel, SingularSteps
from mbd.kernel.restart import evaluate
from mbd.kernel.schemes.stage_layout import BALANCES, MASS_PART, stage_place
from mbd.kernel.schemes.stages import correct_stages, load_stage

__all__ = ["correct_by_own_masses", "note_uneven"]


def note_uneven(K: SingularSteps) -> None:
    """Whether masses differ so much, at the accepted state, of bodies that turn freely and are in no loop."""
    K.uneven_masses = 0
    if K.vector == 0 and K.n_active == 0:
        evaluate(K, K.time, K.q, K.y)
        if is_uneven(K, 0):
            K.uneven_masses = 1


def correct_by_own_masses(K: Kernel, m: int, h: float, t1: float, renew: bool) -> float:
    """`correct_stages`, for residuals over the masses of their own stages where these differ so much."""
    if K.uneven_masses == 1:
        exchange_masses(K, h, t1)
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
