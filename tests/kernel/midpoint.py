"""The explicit midpoint rule as a scheme of the kernel: all that a scheme needs, in one module.

    x_m = h/2 v,  y_m = y + h/2 rate;   q₁ = q + h v_m,  y₁ = y + h rate(t + h/2, q + x_m, y_m)

With rows, positions and velocities at the end are projected onto them and rates are the consistent ones.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

from mbd.integrators import CompiledIntegrator
from mbd.kernel.records import Kernel
from mbd.kernel.schemes.contract import Abilities, Scheme
from mbd.kernel.schemes.explicit_rates import explicit_rates
from mbd.kernel.schemes.memory import forget_steps
from mbd.kernel.schemes.return_to_rows import return_to_rows
from mbd.kernel.singular.step_size import accept_row_norms, forget_row_norms, note_row_norms
from mbd.kernel.stepping.restart import consistent, fill_block, refresh_scales


@dataclass(frozen=True)
class Midpoint(CompiledIntegrator):
    """The explicit midpoint rule, of order 2."""

    scheme: ClassVar[str | None] = "midpoint"

    def order(self, system=None):
        return 2


def start(K: Kernel) -> int:
    """Sizes of forces at the consistent state; nothing is remembered but rates."""
    forget_steps(K)
    forget_row_norms(K)
    fill_block(K, K.time, K.q, K.y)
    refresh_scales(K)
    return 0


def step(K: Kernel, h: float, t1: float) -> int:
    """The candidate."""
    K.failure_time = t1
    K.failure_size = 0.0
    K.failure_step = h
    move(K, 0.5 * h, K.y, K.rate)
    status = explicit_rates(K, K.time + 0.5 * h)
    if status != 0:
        return status
    for i in range(K.n):
        K.stages[i] = K.y1[i]
    move(K, h, K.stages, K.jump)
    if K.n_active > 0:
        status = return_to_rows(K, t1)
        if status != 0:
            return status
    status = consistent(K, t1, K.q1, K.y1)
    if status != 0:
        return status
    for i in range(K.n):
        K.rate1[i] = K.jump[i]
        K.aux1[i] = K.jump[i]
        K.block[K.o_a + i] = K.jump[i]
    for k in range(K.n_rows):
        K.lam1[k] = K.impulse[k]
        K.block[K.o_lam + k] = K.impulse[k]
    if K.n_active > 0:
        note_row_norms(K)
    return 0


def move(K: Kernel, h: float, speed: Any, rate: Any) -> None:
    """(q1, y1) from the accepted state along velocities and rates."""
    for i in range(K.n_v):
        K.q1[i] = K.q[i] + h * speed[i]
    for i in range(K.n):
        K.y1[i] = K.y[i] + h * rate[i]


def accept(K: Kernel, h: float) -> None:
    """The candidate becomes the accepted state."""
    for i in range(K.n_q):
        K.q[i] = K.q1[i]
    for i in range(K.n):
        K.y[i] = K.y1[i]
        K.slope[i] = (K.rate1[i] - K.rate[i]) / h
        K.rate[i] = K.rate1[i]
        K.aux[i] = K.rate1[i]
    for k in range(K.n_rows):
        K.lam_slope[k] = (K.lam1[k] - K.lam[k]) / h
        K.lam[k] = K.lam1[k]
    if K.n_active > 0:
        accept_row_norms(K, h)
    K.aux_step = h


SCHEME = Scheme(
    "midpoint", start, step, accept,
    abilities=Abilities(explicit=1, singular_size=1, middle=0.75),
    nodes=(0.0, 0.5),
    programs="explicit",
    memory=lambda K: {"stages": K.n},
)  # fmt: skip
