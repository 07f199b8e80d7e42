"""Candidates of steps once more, with derivatives: those that are accepted, and those at events."""

from mbd.kernel.codes import CLOSE, CROSS, CROSS_BACK, PASSING, STICK
from mbd.kernel.contact.cone_directions import MAX_GROUP_SIZE, fill_tangents
from mbd.kernel.contact.cone_steps import keeps_direction
from mbd.kernel.events.guard_round_off import guard_round_off
from mbd.kernel.events.guard_sides import RESET_ROUND_OFFS
from mbd.kernel.events.guards import guard_value, watch
from mbd.kernel.events.transitions import is_due
from mbd.kernel.records import Kernel
from mbd.kernel.stepping.accept_restart import event_at_start, event_candidate
from mbd.kernel.stepping.candidate import carry
from mbd.kernel.stepping.restart import compose, consistent, fill_block
from mbd.kernel.stepping.trial_step import try_step
from mbd.sensitivity.tangent.words import (
    at_root,
    candidate_place,
    derivative_of,
    every_row_place,
    seed_rate,
    seeded,
    step_place,
    was_near_singular,
    without_tangent,
)


def follows_rows(K: Kernel) -> bool:
    """Whether rows between events are stored with their derivatives; those at events are in any case."""
    return bool(K.starts[every_row_place(K)] == 1.0)


def held_at_end(K: Kernel, t1: float) -> float:
    """The end of a step: a given time to which the run goes does not move with the instant of an event before it."""
    return without_tangent(t1) if abs(t1 - K.last_time) <= K.near_end else t1


def keep_candidate(K: Kernel) -> None:
    """The values of the candidate into K.starts."""
    K.starts[step_place(K)] = float(K.near_singular)
    carry_candidate(K, True)


def restore_candidate(K: Kernel) -> None:
    """The values that the candidate had, which those of `follow_candidate` differ from by round-off."""
    K.near_singular = int(K.starts[step_place(K)])
    carry_candidate(K, False)


def carry_candidate(K: Kernel, out: bool) -> None:
    """The values of the candidate there or back."""
    o = carry(K.q1, K.starts, candidate_place(K), K.n_q, out)
    o = carry(K.y1, K.starts, o, K.n, out)
    o = carry(K.rate1, K.starts, o, K.n, out)
    o = carry(K.aux1, K.starts, o, K.n, out)
    o = carry(K.lam1, K.starts, o, K.n_rows, out)
    o = carry(K.shift1, K.starts, o, K.n_v, out)
    o = carry(K.guards1, K.starts, o, K.n_watched, out)
    o = carry(K.error, K.starts, o, K.n_v + K.n, out)
    o = carry(K.left1, K.starts, o, K.n_rows + 1, out)
    carry(K.limit, K.starts, o, K.n_frictions, out)


def follow_candidate(K: Kernel, h: float, t1: float) -> int:
    """The candidate once more, with its derivatives; the end of a step of the grid that a timer ends moves with it."""
    if K.n_machines > 0 and is_due(K, t1):
        t1 = without_tangent(t1) + derivative_of(K.due_time)
        h = without_tangent(h) + derivative_of(K.due_time - K.time)
    keep_candidate(K)
    K.near_singular = PASSING if was_near_singular(K) else 0
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
    moves = kind == CLOSE or kind == CROSS or kind == CROSS_BACK or kind == STICK
    if h <= 0.0 and (not moves or (kind != CLOSE and kind != STICK and has_jumped(K, K.event_index))):
        event_at_start(K)
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
    value = guard_value(K, kind, K.event_index, K.time + seeded(h))
    if (kind == CROSS or kind == CROSS_BACK) and K.guard_kink[K.event_index] == 1 and seed_rate(value) == 0.0:
        K.event_after = h  # two sides of a kink that have met and run together: nothing depends on the instant
    else:
        K.event_after = at_root(h, value)
    status = candidate_after(K, K.event_after)
    restore_candidate(K)
    return status


def has_jumped(K: Kernel, e: int) -> bool:
    """Whether user guard e is beyond zero since the last event, with whose instant its own moves."""
    value = without_tangent(K.guards0[K.at_user + e])
    return abs(value) > RESET_ROUND_OFFS * without_tangent(guard_round_off(K, e, K.time, K.q, K.y))


def follow_rest(K: Kernel, h: float) -> int:
    """The candidate at which friction in a plane or in space, with e held, comes to rest: δh and the turns δθ of e.

    All velocities γ of the group are zero there, with the slopes γ_h by the step and γ_1, γ_2 by the turns:

        γ_h δh + γ_1 δθ₁ + γ_2 δθ₂ = −δγ,   δh = −(γ_1 × γ_2)·δγ/(γ_1 × γ_2)·γ_h, and so on in turn

    In a plane there is no δθ₂, and γ_2 is the normal. Where several come to rest at one instant, the run has no
    derivative (`margins`).
    """
    f = K.event_index
    turns = fill_tangents(K, f, 0)
    status = candidate_after(K, seeded(h))
    if status != 0:
        return status
    x = slip_velocity(K, f, 0)
    y = slip_velocity(K, f, 1)
    z = slip_velocity(K, f, 2)
    turn(K, f, 0, seeded(0.0))
    status = candidate_after(K, h)
    if status != 0:
        return status
    x1 = slip_velocity(K, f, 0)
    y1 = slip_velocity(K, f, 1)
    z1 = slip_velocity(K, f, 2)
    turn(K, f, 0, -seeded(0.0))
    x2 = 0.0
    y2 = 0.0
    z2 = seeded(0.0)
    if turns == 2:
        turn(K, f, 1, seeded(0.0))
        status = candidate_after(K, h)
        if status != 0:
            return status
        x2 = slip_velocity(K, f, 0)
        y2 = slip_velocity(K, f, 1)
        z2 = slip_velocity(K, f, 2)
        turn(K, f, 1, -seeded(0.0))
    K.event_after = at_root(h, triple_product(x, y, z, x1, y1, z1, x2, y2, z2))
    turn(K, f, 0, at_root(0.0, triple_product(x1, y1, z1, x2, y2, z2, x, y, z)))
    if turns == 2:
        turn(K, f, 1, at_root(0.0, triple_product(x2, y2, z2, x, y, z, x1, y1, z1)))
    return candidate_after(K, K.event_after)


def slip_velocity(K: Kernel, f: int, k: int) -> float:
    """γ of the candidate along number k of the group of friction f; 0 where it has no such one."""
    return float(K.guards1[K.at_slip + f + k]) if k < K.group_size[f] else 0.0


def triple_product(
    x: float, y: float, z: float, x1: float, y1: float, z1: float, x2: float, y2: float, z2: float
) -> float:
    """γ · (γ_1 × γ_2), with the slopes of the last two by what they were turned by."""
    value = x * (seed_rate(y1) * seed_rate(z2) - seed_rate(z1) * seed_rate(y2))
    value += y * (seed_rate(z1) * seed_rate(x2) - seed_rate(x1) * seed_rate(z2))
    value += z * (seed_rate(x1) * seed_rate(y2) - seed_rate(y1) * seed_rate(x2))
    return value


def turn(K: Kernel, f: int, i: int, angle: float) -> None:
    """Turn the direction in which the group of friction f slides, across itself along tangent i."""
    for k in range(K.group_size[f]):
        K.slip[f + k] += angle * without_tangent(K.cone_across[MAX_GROUP_SIZE * i + k])


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
