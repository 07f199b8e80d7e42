"""BDF2 with steps of any size as a scheme of the kernel: implicit, of two steps, with rows, events and a tolerance.

    y₁ = y₀ + β (y₀ − y₋₁) + c rate₁,  x₁ = β x₀ + c v₁ + U,   β = ω²/(1 + 2ω),  c = h (1 + ω)/(1 + 2ω),  ω = h/h₀

with x₀ the last increment of positions and h₀ its step. The first step after a start, and one that grows more than
`LONGEST` times, is one of the trapezoidal rule. Hairer, Nørsett & Wanner 1993, Solving Ordinary Differential
Equations I, III.5.
"""

from dataclasses import dataclass
from typing import ClassVar

from mbd.integrators import CompiledIntegrator
from mbd.kernel.codes import PASSING
from mbd.kernel.records import Kernel
from mbd.kernel.schemes.contract import Abilities, Scheme
from mbd.kernel.schemes.iteration import predict
from mbd.kernel.schemes.newmark import newmark_accept, newmark_error, newmark_resume, newmark_start
from mbd.kernel.schemes.newton import BAD_FACTORS, PIVOTS_SEARCHED, solve_step
from mbd.kernel.singular.newmark_step import singular_newmark_step

LONGEST = 2.0
"""Growth of the step up to which two steps are used; BDF2 is stable below 1 + √2 [-]."""
CONSTANT = 2.0 / 9.0
"""Of the local error, over h³ times the third derivative, in steps of one size [-]."""


@dataclass(frozen=True)
class BDF2(CompiledIntegrator):
    """The backward differentiation formula of order 2."""

    scheme: ClassVar[str | None] = "bdf2"

    def order(self, system=None):
        return 2

    def check_tolerance(self, rows):
        return None


def start(K: Kernel) -> int:
    """Rates of change by a difference, as those of the family; there is no step before."""
    K.past_stages[K.n_v + K.n] = 0.0
    return newmark_start(K)


def resume(K: Kernel, h: float) -> int:
    """The same from the rates and multipliers beyond a singular configuration."""
    K.past_stages[K.n_v + K.n] = 0.0
    return newmark_resume(K, h)


def step(K: Kernel, h: float, t1: float) -> int:
    """The candidate."""
    if K.near_singular == PASSING:
        return singular_newmark_step(K, h, t1)
    w = h / K.aux_step
    two = K.past_stages[K.n_v + K.n] == 1.0 and w <= LONGEST
    c_C = h * (1.0 + w) / (1.0 + 2.0 * w) if two else 0.5 * h
    tangents = 0
    while True:
        predict(K, h, t1, c_C, c_C * c_C)
        if two:
            formula(K, w * w / (1.0 + 2.0 * w), c_C)
        status = solve_step(K, h, t1, c_C, c_C * c_C, tangents)
        if status != BAD_FACTORS:
            return status
        tangents = PIVOTS_SEARCHED


def formula(K: Kernel, b: float, c: float) -> None:
    """Velocities and increments in the block by two steps, from the rates and the shift predicted there."""
    for i in range(K.n):
        K.block[K.o_v + i] = K.y[i] + b * K.past_stages[K.n_v + i] + c * K.block[K.o_a + i]
        if i < K.n_v:
            K.block[K.o_x + i] = b * K.past_stages[i] + c * K.block[K.o_v + i] + K.shift1[i]


def accept(K: Kernel, h: float) -> None:
    """The candidate becomes the accepted state, the step to it the last one."""
    for i in range(K.n_v):
        K.past_stages[i] = K.q1[i] - K.q[i]
    for i in range(K.n):
        K.past_stages[K.n_v + i] = K.y1[i] - K.y[i]
    K.past_stages[K.n_v + K.n] = 1.0
    newmark_accept(K, h)


def error(K: Kernel, h: float) -> None:
    """That of the trapezoidal rule by its larger constant; of positions K.error_constant is it already."""
    newmark_error(K, h)
    for i in range(K.n):
        K.error[K.n_v + i] *= 12.0 * CONSTANT


SCHEME = Scheme(
    "bdf2", start, step, accept, resume, error,
    abilities=Abilities(error_constant=CONSTANT),
    programs="stepping",
    memory=lambda K: {"past_stages": K.n_v + K.n + 1},
)  # fmt: skip
