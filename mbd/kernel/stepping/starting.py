"""The start of a scheme from a consistent state, in the mode of the contacts that are closed then."""

from mbd.kernel.algebra.redundancy import find_dependent, sharing
from mbd.kernel.codes import LOG_OPENED, NEW_MODE, PULL
from mbd.kernel.contact.cones import let_directions_go
from mbd.kernel.contact.contact_log import NO_IMPULSE, log_event
from mbd.kernel.contact.contact_modes import resolve_contact_modes
from mbd.kernel.events.guards import update_armed, watch
from mbd.kernel.hooks import scheme_start
from mbd.kernel.records import PROGRAMS, Balance, DependentRows, Integers, Kernel, Switching
from mbd.kernel.stepping.conditioning import is_ill_conditioned, refine_accelerations
from mbd.kernel.stepping.contact_step import find_pace
from mbd.kernel.stepping.control import first_step
from mbd.kernel.stepping.restart import (
    active_rows,
    evaluate,
    fill_block,
    minimum_norm_multipliers,
    refresh_scales,
    stepping_rows,
    take_consistent,
)


def find_mode(K: DependentRows) -> int:
    """Number of the mode of the closed contacts and dependent rows, −1 if its code is not made yet.

    The run meets modes in an order of its own, whatever others there are from earlier runs.
    """
    width = K.n_contacts + K.n_rows + K.n_frictions
    for mode in range(K.n_known):
        same = True
        for c in range(K.n_contacts):
            same = same and K.mode_key[mode * width + c] == K.closed[c]
        for k in range(K.n_rows):
            same = same and K.mode_key[mode * width + K.n_contacts + k] == K.dropped[k]
        for f in range(K.n_frictions):
            phase = 2 if K.sticks[f] == 1 else (1 if K.slip[f] != 0.0 else 0)
            same = same and K.mode_key[mode * width + K.n_contacts + K.n_rows + f] == phase
        if same and mode >= K.n_modes:
            exchange(K.mode_key, mode, K.n_modes, width)
            exchange(K.mode_code, mode, K.n_modes, PROGRAMS)
            exchange(K.mode_order, mode, K.n_modes, 1)
            K.n_modes += 1
            return int(K.n_modes - 1)
        if same:
            return mode
    return -1


def exchange(A: Integers, one: int, other: int, count: int) -> None:
    """Let two parts of so many numbers change places."""
    for i in range(count):
        number = A[one * count + i]
        A[one * count + i] = A[other * count + i]
        A[other * count + i] = number


def restart(K: Kernel) -> int:
    """Make the state consistent in its mode and start the scheme from it."""
    K.least_pivot = 1.0
    open_pulling_penalties(K)
    status = resolve_contact_modes(K)
    if status != 0:
        return status
    K.n_restarts += 1
    find_dependent(K, active_rows(K, K.closed))
    if K.n_dropped > 0 and not sharing(K):
        # limits follow the pushes, which are others than those that the modes were found with
        fill_block(K, K.time, K.q, K.y)
        minimum_norm_multipliers(K, K.lam)
    K.n_active = stepping_rows(K)
    if is_ill_conditioned(K):
        status = correct_start(K)
        if status != 0:
            return status
    if K.adaptive == 0 and K.n_contacts > 0:
        status = find_pace(K)
        if status != 0:
            return status
    status = scheme_start(K)
    if status != 0:
        return status
    K.n_active = stepping_rows(K)
    K.mode_id = find_mode(K)
    K.paired_step = 0
    K.grid_start = K.time
    K.grid_steps = 0
    K.in_substeps = 0
    if K.adaptive == 1:
        first_step(K)
    if K.n_watched > 0:
        watch(K, K.time, K.q, K.y, K.rate, K.lam, K.guards0)
        update_armed(K)
    if K.n_cones > 0:
        let_directions_go(K)
    K.looks_ahead = 0
    return 0


def open_pulling_penalties(K: Switching) -> None:
    """Open penalty contacts that open on pull and clearly pull, as where an impact has turned them around."""
    known = False
    force = 0.0
    for c in range(K.n_contacts):
        if K.kind[c] == 1 and K.closed[c] == 1 and K.opens[c] == 0:
            if not known:
                watch(K, K.time, K.q, K.y, K.rate, K.lam, K.guards0)
                refresh_scales(K)
                for i in range(K.n_v):
                    force = max(force, K.scale[i])
                known = True
            if K.guards0[K.at_force + c] < -PULL * force and K.guards0[K.at_gap_rate + c] >= 0.0:
                K.closed[c] = 0
                K.armed[c] = 2
                log_event(K, LOG_OPENED, c, 0.0, NO_IMPULSE)


def restart_after_event(K: Kernel) -> int:
    """`restart`; where the mode has no code yet to correct rates with, it is made again before the next step."""
    status = restart(K)
    if status == NEW_MODE:
        K.restart_due = 2
        return 0
    return status


def correct_start(K: Balance) -> int:
    """Rates and multipliers of an ill-conditioned start corrected by the balance, for which the mode needs its code."""
    K.mode_id = find_mode(K)
    if K.mode_id < 0:
        return NEW_MODE
    evaluate(K, K.time, K.q, K.y)
    refresh_scales(K)
    K.jump[: K.n] = K.rate[: K.n]
    K.impulse[: K.n_rows] = K.lam[: K.n_rows]
    status = refine_accelerations(K)
    if status == 0:
        take_consistent(K)
    return status


def still_dependent(K: DependentRows) -> bool:
    """Whether the rows that were left out hold at the candidate, at which K.acc is."""
    o_h = K.acc_h
    for k in range(K.n_rows):
        if K.dropped[k] == 1:
            size = max(K.scale[K.n + k], 1e-3)
            slip = 1e-6 * (size + 1.0)
            if K.stabilized == 0:  # index 3 leaves rates of the size of its error, of which this row has its share
                for i in range(K.n_rows):
                    slip += (
                        2.0 * abs(K.dependence[k * K.n_rows + i] * K.acc[o_h + K.n_rows + i])
                        if K.dropped[i] == 0
                        else 0.0
                    )
            if abs(K.acc[o_h + k]) > 1e-9 * size or abs(K.acc[o_h + K.n_rows + k]) > slip:
                return False
    return True
