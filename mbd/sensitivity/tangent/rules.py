"""Rules of the tangent pass that are more than arithmetic, in place of `mbd.kernel.tangent_rules`."""

from __future__ import annotations

from mbd.kernel.algebra.ordered import solve_kkt
from mbd.kernel.codes import CLOSE, CROSS, CROSS_BACK
from mbd.kernel.events.guards import guard_value, watch
from mbd.kernel.hooks import call_on
from mbd.kernel.records import Kernel
from mbd.kernel.stepping.accept_restart import event_at_start, event_candidate
from mbd.kernel.stepping.restart import compose, consistent, fill_block

__all__ = [
    "at_root",
    "follow_event",
    "follow_matrix",
    "further_corrections",
    "note_matrix",
    "seeded",
    "takes_part",
    "without_tangent",
]


def seeded(h: float) -> float:
    """A step size that is differentiated by, in the last direction (see `printer`)."""
    return h


def at_root(h: float, value: float) -> float:
    """The step size h at which a value is zero, with its derivatives ``−g'/ġ`` (see `printer`)."""
    return h


def without_tangent(value: float) -> float:
    """The value alone (see `printer`)."""
    return value


def takes_part(value: float) -> bool:
    """Whether a value or one of its derivatives is not 0: a matrix passes through entries of 0 (see `printer`)."""
    return value != 0.0


def follow_event(K: Kernel) -> int:
    """The candidate at the event once more: ``δh = −(g_y δy + g_p δp)/ġ``, and with it all that the step leaves.

    The derivative ġ is that of the guard by the size of the step, as the scheme takes it.
    """
    h = without_tangent(K.event_after)
    kind = K.event_kind
    if h <= 0.0 and kind != CLOSE and kind != CROSS and kind != CROSS_BACK:
        K.event_after = h
        return 0
    status = candidate_after(K, seeded(h))
    if status != 0:
        return status
    K.event_after = at_root(h, guard_value(K, kind, K.event_index, K.time + seeded(h)))
    return candidate_after(K, K.event_after)


def candidate_after(K: Kernel, h: float) -> int:
    """The candidate of an event after a step of this size; one without length moves it along the motion."""
    if h > 0.0:
        return event_candidate(K, h, K.time + h)
    event_at_start(K)
    fill_block(K, K.time, K.q, K.y)
    for i in range(K.n_v):
        K.block[K.o_x + i] = h * K.y[i]
    compose(K, K.q1)
    for i in range(K.n):
        K.y1[i] += h * K.rate[i]
    if consistent(K, K.time + h, K.q1, K.y1) == 0:
        for i in range(K.n):
            K.rate1[i] = without_tangent(K.rate1[i]) + (K.jump[i] - without_tangent(K.jump[i]))
        for k in range(K.n_rows):
            K.lam1[k] = without_tangent(K.lam1[k]) + (K.impulse[k] - without_tangent(K.impulse[k]))
    watch(K, K.time + h, K.q1, K.y1, K.rate1, K.lam1, K.guards1)
    return 0


def note_matrix(K: Kernel) -> None:
    """The inputs that Newton's matrix is made from, for `follow_matrix`, into K.starts."""
    size = K.o_slip + K.n_frictions + K.n_v
    K.starts[:size] = K.block[:size]


def follow_matrix(K: Kernel, m: int, whole: bool) -> None:
    """``K W = b → K δW = δb − δK W`` of the position correction W, whose b is all but δK W.

    ``δK W`` is the derivative of a program of the mode (see `programs`) that reads W behind the inputs of the matrix.
    """
    size = K.n + m
    o = K.o_slip + K.n_frictions + K.n_v
    for i in range(size):
        K.starts[o + i] = without_tangent(K.work[i])
    for i in range(K.n_v):
        K.starts[o + size + i] = without_tangent(K.work[i])
        if whole:
            K.starts[o + size + i] -= without_tangent(K.shift1[i])
    call_on(K, K.solution_program, K.starts, K.spare)
    for i in range(size):
        K.spare[i] -= without_tangent(K.spare[i])
    solve_kkt(K, size, K.spare)
    for i in range(size):
        K.work[i] -= K.spare[i]


def further_corrections() -> int:
    """Those that derivatives need to follow the solution, as they lag behind it by one."""
    return 3
