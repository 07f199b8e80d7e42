"""A step that is tried: its candidate with multipliers of all rows and with its guards."""

from mbd.equal import EQUAL_RTOL, HALF_PRECISION_RTOL, NOMINAL_RTOL
from mbd.kernel.codes import (
    EPS,
    GUARDS,
    NOT_CONVERGED,
    NOT_FINITE,
)
from mbd.kernel.contact.carried import is_carried
from mbd.kernel.contact.cones import HOLD_DIRECTION, leads_group, sliding_force, speed_of
from mbd.kernel.hooks import call, scheme_step
from mbd.kernel.records import (
    Balance,
    DependentRows,
    Frictions,
    Guards,
    Kernel,
    Motion,
)
from mbd.kernel.stepping.charts import turns_too_far
from mbd.kernel.stepping.restart import (
    compose,
    consistent,
    fill_block,
    holds_rows,
    minimum_norm_multipliers,
)

SLIP_RTOL = 256.0 * EPS
"""Part of the terms of γ below which it is round-off [-]."""
MAX_ROW_RATE = 1e-2
"""Rate of a row at the end of a brief step, over the sum of its terms, above which it is another row [-]."""


def try_step(K: Kernel, h: float, t1: float) -> int:
    """A candidate at t1 = t + h with its guards; a step far below dt with rows is one of Heun's method.

    There an implicit step would divide the round-off of positions by h²; an explicit scheme takes it as any other.
    A scheme leaves velocities, rates and multipliers of the candidate in the block; only its positions are centered.
    """
    full = K.step
    if K.n_cones > 0:
        K.blur = blur_of(K)
    if h >= 1e-3 * full or (K.n_active == 0 and h >= 1e-9 * full) or K.explicit == 1:
        status = scheme_step(K, h, t1)
        if status != 0:
            return status
        if K.n_dropped > 0:
            status = share_multipliers(K, t1)
            if status != 0:
                return status
    else:
        status = brief_step(K, h, t1)
        if status != 0:
            return status
    if K.vector == 0 and turns_too_far(K, h):
        K.failure_time = t1
        K.failure_size = 0.0
        return NOT_CONVERGED
    if K.n_watched > 0:
        K.block[K.o_q : K.o_q + K.n_q] = K.q1[: K.n_q]
        K.block[K.o_x : K.o_x + K.n_v] = 0.0
        call(K, GUARDS, K.guards1)
        finite = 0.0
        for i in range(K.n_watched):
            finite += abs(K.guards1[i])
        if not finite < 1e300:
            K.failure_time = t1
            return NOT_FINITE
        for f in range(K.n_frictions):
            K.limit[f] = K.guards1[K.at_limit + f]
            if K.slip[f] != 0.0:
                K.lam1[K.friction_row[f]] = sliding_force(K, f, K.limit[f], K.guards1, K.at_slip, False)
    return 0


def blur_of(K: Guards) -> float:
    """Part of a friction in a plane that is not known: that of γ over γ, or over what stands for it at the onset.

    γ may fall in a step to a part of what it is before it.
    """
    largest = 0.0
    for f in range(K.n_frictions):
        if leads_group(K, f) and K.slip[f] != 0.0 and K.hold[f] != HOLD_DIRECTION:
            size = 0.0
            for g in range(f, f + K.group_size[f]):
                size = max(size, K.scale[K.n + K.n_rows + K.friction_row[g]])
            least = 4.0 * K.hold[f] if K.hold[f] > 0.0 else 0.0
            speed = speed_of(K, f, K.guards0, K.at_slip) + least
            largest = max(largest, SLIP_RTOL * size / (speed + EPS * size))
    return min(largest, NOMINAL_RTOL)


def share_multipliers(K: Balance, t1: float) -> int:
    """Multipliers of least norm with the forces of those that a scheme leaves."""
    if K.explicit == 0:  # an explicit one has shared them out already, and feet kept in their cones have no shares
        minimum_norm_multipliers(K, K.lam1)
    K.block[K.o_lam : K.o_lam + K.n_rows] = K.lam1[: K.n_rows]
    if departs(K):
        K.failure_time = t1
        K.failure_size = 0.0
        return NOT_CONVERGED
    return 0


def brief_step(K: Balance, h: float, t1: float) -> int:
    """A step of Heun's method; where friction turns with γ, of the trapezoidal rule, by means of two passes."""
    K.rate1[: K.n] = K.rate[: K.n]
    turning = turns(K)
    unsettled = turning
    # times that the end of a brief step is asked for the rates that lead there, where these change its forces much
    for passed in range(60 if turning else 2):
        fill_block(K, K.time, K.q, K.y)
        for i in range(K.n_v):
            K.block[K.o_x + i] = h * (K.y[i] + h * (K.rate[i] / 3.0 + K.rate1[i] / 6.0))
        compose(K, K.q1)
        for i in range(K.n):
            K.y1[i] = K.y[i] + 0.5 * h * (K.rate[i] + K.rate1[i])
        status = consistent(K, t1, K.q1, K.y1)
        if status != 0:
            return status
        if turning and passed > 1:
            if settled(K):
                unsettled = False
                break
            for i in range(K.n):
                K.rate1[i] = 0.5 * (K.rate1[i] + K.jump[i])
        else:
            K.rate1[: K.n] = K.jump[: K.n]
    if unsettled or not holds_rows(K, K.n_active) or (K.vector == 0 and rows_turn_around(K)):
        K.failure_time = t1
        K.failure_size = 0.0
        return NOT_CONVERGED
    for i in range(K.n):
        K.rate1[i] = K.jump[i]
        K.aux1[i] = K.jump[i]
        K.block[K.o_a + i] = K.jump[i]
    for k in range(K.n_rows):
        K.lam1[k] = K.impulse[k]
        K.block[K.o_lam + k] = K.impulse[k]
    return 0


def turns(K: Frictions) -> bool:
    """Whether something slides in a plane whose friction follows γ within the step."""
    found = False
    if K.n_cones > 0:
        for f in range(K.n_frictions):
            found = found or (leads_group(K, f) and K.slip[f] != 0.0 and K.hold[f] != HOLD_DIRECTION)
    return found


def settled(K: Balance) -> bool:
    """Whether the rates in K.jump are those that led to them."""
    change = 0.0
    largest = 0.0
    for i in range(K.n):
        change = max(change, abs(K.jump[i] - K.rate1[i]))
        largest = max(largest, abs(K.jump[i]))
    return change <= EQUAL_RTOL * largest


def rows_turn_around(K: Motion) -> bool:
    """Whether velocities miss the rows by as much as they are: these have another direction at the candidate.

    That of a thin disk's lowest point turns around as the disk comes to lie flat.
    """
    found = False
    for k in range(K.n_active):
        row = K.rows[k]
        size = 0.0
        for j in range(K.n):
            size += abs(K.acc[K.acc_B + row * K.n + j] * K.y1[j])
        found = found or abs(K.acc[K.acc_rate + row]) > MAX_ROW_RATE * size + K.rest_speed
    return found


def departs(K: DependentRows) -> bool:
    """Whether a row that was left out is far from holding at the candidate, at which K.acc is: another branch."""
    o_h = K.acc_h
    for k in range(K.n_rows):
        if (
            K.dropped[k] == 1
            and K.row_level[k] == 0
            and abs(K.acc[o_h + k]) > HALF_PRECISION_RTOL * max(K.scale[K.n + k], 1e-3)
        ):
            f = K.row_friction[k]
            if f < 0 or not is_carried(K, K.leader[f]):
                return True
    return False
