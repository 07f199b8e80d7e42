"""Candidates of steps once more, with derivatives: those that are accepted, and those at events."""

from __future__ import annotations

from mbd.kernel.codes import CLOSE, CROSS, CROSS_BACK, STICK
from mbd.kernel.contact.cone_steps import across, keeps_direction
from mbd.kernel.contact.cones import along
from mbd.kernel.events.guards import guard_value, watch
from mbd.kernel.events.transitions import is_due
from mbd.kernel.records import Kernel
from mbd.kernel.stepping.accept_restart import event_at_start, event_candidate
from mbd.kernel.stepping.candidate import carry
from mbd.kernel.stepping.restart import compose, consistent, fill_block
from mbd.kernel.stepping.trial_step import try_step
from mbd.sensitivity.tangent.words import (
    at_root,
    derivative_of,
    every_row_place,
    seed_rate,
    seeded,
    step_place,
    without_tangent,
)

__all__ = ["follow_candidate", "follow_event", "follows_rows", "note_step"]


def follows_rows(K: Kernel) -> bool:
    """Whether rows between events are stored with their derivatives; those at events are in any case."""
    return bool(K.starts[every_row_place(K)] == 1.0)


def note_step(K: Kernel) -> None:
    """Whether a singular configuration is near as the step begins."""
    K.starts[step_place(K)] = float(K.near_singular)


def keep_candidate(K: Kernel) -> None:
    """The values of the candidate into K.starts."""
    K.starts[step_place(K) + 1] = float(K.near_singular)
    carry_candidate(K, True)


def restore_candidate(K: Kernel) -> None:
    """The values that the candidate had, which those of `follow_candidate` differ from by round-off."""
    K.near_singular = int(K.starts[step_place(K) + 1])
    carry_candidate(K, False)


def carry_candidate(K: Kernel, out: bool) -> None:
    """The values of the candidate there or back."""
    o = carry(K.q1, K.starts, every_row_place(K) + 1, K.n_q, out)
    o = carry(K.y1, K.starts, o, K.n, out)
    o = carry(K.rate1, K.starts, o, K.n, out)
    o = carry(K.aux1, K.starts, o, K.n, out)
    o = carry(K.lam1, K.starts, o, K.n_rows, out)
    o = carry(K.shift1, K.starts, o, K.n_v, out)
    o = carry(K.guards1, K.starts, o, K.n_watched, out)
    carry(K.limit, K.starts, o, K.n_frictions, out)


def follow_candidate(K: Kernel, h: float, t1: float) -> int:
    """The candidate once more, with its derivatives; the end of a step of the grid that a timer ends moves with it."""
    if K.n_machines > 0 and is_due(K, t1):
        t1 = without_tangent(t1) + derivative_of(K.due_time)
        h = without_tangent(h) + derivative_of(K.due_time - K.time)
    keep_candidate(K)
    K.near_singular = int(without_tangent(K.starts[step_place(K)]))
    status = try_step(K, h, t1)
    restore_candidate(K)
    return status


def take_again(K: Kernel, h: float) -> int:
    """The candidate of an event by values: the solution of its step is known then."""
    return event_candidate(K, h, K.time + h)


def follow_event(K: Kernel) -> int:
    """The candidate at the event once more: ``δh = −(g_y δy + g_p δp)/ġ``, and with it all that the step leaves.

    The derivative ġ is that of the guard by the size of the step, as the scheme takes it.
    """
    h = without_tangent(K.event_after)
    kind = K.event_kind
    if h <= 0.0 and kind != CLOSE and kind != CROSS and kind != CROSS_BACK:
        K.event_after = h
        return 0
    keep_candidate(K)
    if h > 0.0:
        status = take_again(K, h)
        if status != 0:
            return status
    if h > 0.0 and kind == STICK and keeps_direction(K, K.event_index):
        status = follow_rest(K, h)
        restore_candidate(K)
        return status
    status = candidate_after(K, seeded(h))
    if status != 0:
        return status
    K.event_after = at_root(h, guard_value(K, kind, K.event_index, K.time + seeded(h)))
    status = candidate_after(K, K.event_after)
    restore_candidate(K)
    return status


def follow_rest(K: Kernel, h: float) -> int:
    """The candidate at which a friction in a plane, with its direction e held, comes to rest: δh and the turn δθ of e.

    Both velocities are zero there, that along e and that across it, ``a = 0`` and ``c = 0``:

        a_h δh + a_θ δθ = −δa   c_h δh + c_θ δθ = −δc

    Where several come to rest at one instant, the run has no derivative (`margins`).
    """
    f = K.event_index
    status = candidate_after(K, seeded(h))
    if status != 0:
        return status
    a = along(K, f, K.guards1[K.at_slip + f], K.guards1[K.at_slip + K.partner[f]])
    c = across(K, f)
    turn(K, f, seeded(0.0))
    status = candidate_after(K, h)
    if status != 0:
        return status
    turned_a = along(K, f, K.guards1[K.at_slip + f], K.guards1[K.at_slip + K.partner[f]])
    turned_c = across(K, f)
    turn(K, f, -seeded(0.0))
    K.event_after = at_root(h, seed_rate(turned_c) * a - seed_rate(turned_a) * c)
    turn(K, f, at_root(0.0, seed_rate(a) * turned_c - seed_rate(c) * turned_a))
    return candidate_after(K, K.event_after)


def turn(K: Kernel, f: int, angle: float) -> None:
    """Turn the direction in which friction f and its partner slide."""
    p = K.partner[f]
    x = K.slip[f] - angle * K.slip[p]
    K.slip[p] += angle * K.slip[f]
    K.slip[f] = x


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
