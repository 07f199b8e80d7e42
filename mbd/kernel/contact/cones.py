"""Dry friction that slides along several directions together, ``λ_T = limit γ/‖γ‖``: contacts in space, ball joints.

Frictions of a group have numbers that follow each other; K.leader is the first of them, which stands for all where
something is decided, and K.group_size says how many there are: 1 for a friction alone, 2 of a contact in space, 3 of a
ball joint. K.slip has the cosines of the direction in which they slide, that of γ at the accepted state; none of them
is 0.0 while they do. K.hold says how much of that direction counts within a step (see `mbd.equations.cones`): 0
nothing, λ_T follows γ.
"""

from mbd.equal import MIN_DIVISOR, MIN_SQUARED_SPEED
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.records import ContactRows, Frictions, Guards, Reals

HOLD_DIRECTION = 1e20
"""Of K.hold: λ_T keeps its direction whatever γ [-]."""
HOLD_AT_ONSET = 1e-7
"""Of K.hold: λ_T keeps its direction while γ is round-off, and follows γ as it grows beyond [-]."""
ONSET_END_SPEED = 1e-3
"""Speed [m/s] from which on the direction of the onset is forgotten."""
ONSET_SPEED = 4e-6
"""Speed [m/s] up to which it stays as it was, ten times what stands for γ then."""
MIN_DIRECTION_SPEED = ONSET_END_SPEED * HOLD_AT_ONSET
"""Speed [m/s, rad/s] below which γ is round-off, and K.slip stays that of the motion before."""


def follows(K: Frictions, f: int) -> bool:
    """Whether friction f does what the first of its group does."""
    return bool(K.leader[f] != f)


def leads_group(K: Frictions, f: int) -> bool:
    """Whether friction f is the first of several that slide together."""
    return bool(K.group_size[f] > 1 and K.leader[f] == f)


def fill_slips(K: ContactRows) -> None:
    """What the programs know of sliding, into the block: signs, of groups how their directions are held.

    Of a direction that is let go (1, 1), with 0 for a third: only ‖s‖² = 2 counts.
    """
    K.block[K.o_slip : K.o_slip + K.n_frictions] = K.slip[: K.n_frictions]
    if K.n_cones > 0:
        for f in range(K.n_frictions):
            if K.group_size[f] > 1 and K.slip[f] != 0.0:
                free = 1.0 if f - K.leader[f] < 2 else 0.0
                K.block[K.o_slip + f] = K.hold[f] * K.slip[f] if K.hold[f] > 0.0 else free


def aim(K: Frictions, f: int) -> None:
    """The group of friction f slides along the numbers in its places of K.slip, which become cosines."""
    first = K.leader[f]
    if K.group_size[f] == 1:
        K.slip[f] = 1.0 if K.slip[f] > 0.0 else -1.0
        K.lean[f] = K.slip[f]
        return
    square = 0.0
    for g in range(first, first + K.group_size[f]):
        square += K.slip[g] * K.slip[g]
    size = sqrt(square)
    for g in range(first, first + K.group_size[f]):
        none = 1.0 if g == first else MIN_DIVISOR
        K.slip[g] = K.slip[g] / size if size > 0.0 else none
        if abs(K.slip[g]) < MIN_DIVISOR:
            K.slip[g] = MIN_DIVISOR
        K.lean[g] = K.slip[g]


def aim_along(K: Frictions, f: int, values: Reals, first: int) -> None:
    """The group of friction f slides along values of frictions that begin at `first`."""
    for g in range(K.leader[f], K.leader[f] + K.group_size[f]):
        K.slip[g] = values[first + g]
    aim(K, f)


def aim_as_pulled(K: Frictions, f: int, lam: Reals) -> None:
    """The group of friction f slides along its multipliers."""
    for g in range(K.leader[f], K.leader[f] + K.group_size[f]):
        K.slip[g] = lam[K.friction_row[g]]
    aim(K, f)


def set_sticking(K: Frictions, f: int, sticks: int) -> None:
    """The group of friction f sticks (1), or slides in a direction that is still to be given (0)."""
    for g in range(K.leader[f], K.leader[f] + K.group_size[f]):
        K.sticks[g] = sticks
        K.slip[g] = 0.0


def set_loose(K: Frictions, f: int, loose: int) -> None:
    """Whether the group of friction f may choose, and what an event has found of it."""
    for g in range(K.leader[f], K.leader[f] + K.group_size[f]):
        K.loose[g] = loose


def set_hold(K: Frictions, f: int, hold: float) -> None:
    """How much of its direction counts in the group of friction f."""
    for g in range(K.leader[f], K.leader[f] + K.group_size[f]):
        K.hold[g] = hold


def sliding_force(K: Frictions, f: int, limit: float, rates: Reals, first: int, by_rows: bool) -> float:
    """λ_T of a friction that slides; rates of frictions, or of rows, begin at `first`."""
    if K.group_size[f] == 1:
        return float(K.slip[f] * limit)
    hold = K.hold[f]
    part = hold * (2.0 - hold * hold) * (2.0 - hold * hold) if hold > 0.0 else 0.0
    own = 0.0
    square = 0.0
    for g in range(K.leader[f], K.leader[f] + K.group_size[f]):
        value = rates[first + (K.friction_row[g] if by_rows else g)] + part * K.slip[g]
        square += value * value
        if g == f:
            own = value
    return float(own / sqrt(square + MIN_SQUARED_SPEED) * limit)


def along(K: Frictions, f: int, values: Reals, first: int) -> float:
    """Part of values of frictions that begin at `first`, along the direction in which the group of f slides."""
    value = 0.0
    for g in range(K.leader[f], K.leader[f] + K.group_size[f]):
        value += K.slip[g] * values[first + g]
    return value


def away(K: Frictions, f: int, values: Reals, first: int) -> float:
    """Size of the part of such values across that direction e, ``‖e × γ‖ = √Σ (e_g γ_h − e_h γ_g)²`` over g < h."""
    square = 0.0
    for g in range(K.leader[f], K.leader[f] + K.group_size[f]):
        for h in range(g + 1, K.leader[f] + K.group_size[f]):
            turned = K.slip[g] * values[first + h] - K.slip[h] * values[first + g]
            square += turned * turned
    return sqrt(square)


def across(K: Frictions, g: int, values: Reals, first: int) -> float:
    """That part along friction g, ``γ − e (e·γ)``."""
    value = 0.0
    for h in range(K.leader[g], K.leader[g] + K.group_size[g]):
        value += K.slip[h] * (K.slip[h] * values[first + g] - K.slip[g] * values[first + h])
    return value


def product_of(K: Frictions, f: int, values: Reals, first: int, second: int) -> float:
    """γ · w of the group of friction f, among values that begin at `first` and at `second`."""
    value = 0.0
    for g in range(K.leader[f], K.leader[f] + K.group_size[f]):
        value += values[first + g] * values[second + g]
    return value


def speed_of(K: Frictions, f: int, values: Reals, first: int) -> float:
    """‖γ‖ of the group of friction f among values that begin at `first`."""
    return sqrt(product_of(K, f, values, first, first))


def friction_size(K: Frictions, f: int, lam: Reals) -> float:
    """‖λ_T‖ of the group of friction f."""
    if K.group_size[f] == 1:
        return float(abs(lam[K.friction_row[f]]))
    square = 0.0
    for g in range(K.leader[f], K.leader[f] + K.group_size[f]):
        square += lam[K.friction_row[g]] * lam[K.friction_row[g]]
    return sqrt(square)


def phase_of(K: Frictions, f: int) -> float:
    """What a friction does, as results tell it: 2 sticks, ±1 slides that way (1 in a group), 0 off."""
    if K.sticks[f] == 1:
        return 2.0
    return float(K.slip[f] if K.group_size[f] == 1 or K.slip[f] == 0.0 else 1.0)


def hold_directions(K: Frictions) -> None:
    """λ_T as K.slip has it, whatever γ: at instants."""
    for f in range(K.n_frictions):
        K.hold[f] = HOLD_DIRECTION


def let_directions_go(K: Guards) -> None:
    """After a restart: λ_T follows γ; where that is round-off it begins along K.slip."""
    for f in range(K.n_frictions):
        K.hold[f] = 0.0
        if K.group_size[f] > 1 and K.slip[f] != 0.0 and speed_of(K, f, K.guards0, K.at_slip) < ONSET_END_SPEED:
            K.hold[f] = HOLD_AT_ONSET


def follow_motion(K: Guards) -> None:
    """After a step: K.slip is the direction of γ, which K.hold leaves to it.

    That of the onset stays while γ is less than what stands for it: the step after this one would follow an error of γ,
    not γ, and make it larger.
    """
    for f in range(K.n_frictions):
        if leads_group(K, f) and K.slip[f] != 0.0:
            least = ONSET_SPEED if K.hold[f] == HOLD_AT_ONSET else MIN_DIRECTION_SPEED
            if speed_of(K, f, K.guards0, K.at_slip) >= least:
                aim_along(K, f, K.guards0, K.at_slip)
    for f in range(K.n_frictions):
        if K.group_size[f] > 1 and K.slip[f] != 0.0:
            if K.hold[f] == HOLD_DIRECTION or speed_of(K, f, K.guards0, K.at_slip) >= ONSET_END_SPEED:
                K.hold[f] = 0.0
