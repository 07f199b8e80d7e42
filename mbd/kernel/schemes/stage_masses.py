"""Newton's corrections of stages of which each has a mass matrix of its own, as it has in space.

Where bodies turn within a step, M of the middle stage is that of no other one; the direction e in which a light link
between heavy bodies moves easily, ``eᵀ M e`` being its own small inertia, turns with them, and the heavy bodies resist
at one stage what is easy at another: corrections left nine tenths of the error where bodies turned by a hundredth of a
radian in the step. With rates written out, ``W_i = −M_i⁻¹ f_i``, stages differ in accelerations alone:

    W_i + h Σ a_ij M⁻¹(C W_j + …) = −M_i⁻¹ r_i   or   M W_i + h Σ a_ij (C W_j + …) = −M M_i⁻¹ r_i

so that the same matrices serve, for other residuals. Where that leaves much of the error all stages are corrected at
once, each with the matrices of its own (`coupled_stages`).
"""

from __future__ import annotations

from mbd.kernel.algebra.linear import solve_definite
from mbd.kernel.codes import ACCELERATIONS
from mbd.kernel.hooks import call
from mbd.kernel.records import Kernel
from mbd.kernel.schemes.stage_layout import BALANCES, MASS_PART, stage_place
from mbd.kernel.schemes.stages import correct_stages, load_stage

__all__ = ["correct_by_own_masses"]


def correct_by_own_masses(K: Kernel, m: int, h: float, t1: float, renew: bool) -> float:
    """`correct_stages`; of bodies that turn freely for residuals over the masses of their own stages."""
    if K.vector == 0 and m == 0:
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
