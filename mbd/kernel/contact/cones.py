"""Dry friction of contacts in space: two frictions that slide together, ``λ_T = limit γ/‖γ‖``.

Each of the two knows the other by K.partner; the first of them stands for both where something is decided. K.slip has
the cosines of the direction in which they slide, that of γ at the accepted state; none of them is 0.0 while they do.
K.hold says how much of that direction counts within a step (see `mbd.equations.cones`): 0 nothing, λ_T follows γ.
"""

from __future__ import annotations

from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.records import ContactRows, Frictions, Guards, Reals

__all__ = [
    "HELD", "ONSET", "aim", "along", "cosine", "fill_slips", "follow_motion", "follows", "hold_directions", "leads",
    "let_directions_go", "phase_of", "pull_of_both", "sliding_force", "speed_of_both",
]  # fmt: skip

HELD = 1e20
"""Of K.hold: λ_T keeps its direction whatever γ [-]."""
ONSET = 1e-7
"""Of K.hold: λ_T keeps its direction while γ is round-off, and follows γ as it grows beyond [-]."""
MOVING = 1e-3
"""Speed [m/s] from which on the direction of the onset is forgotten."""
BEGUN = 4e-6
"""Speed [m/s] up to which it stays as it was, ten times what stands for γ then."""
LEAST = 1e-200
"""What stands for a cosine that is zero: 0.0 would say that nothing slides [-]."""
LEAST_SQUARE = 1e-60
"""Square of a speed that is none, as in `mbd.equations.cones` [m²/s²]."""


def leads(K: Frictions, f: int) -> bool:
    """Whether something is decided for friction f: it is alone, or the first of two."""
    return bool(K.partner[f] < 0 or K.partner[f] > f)


def follows(K: Frictions, f: int) -> bool:
    """Whether friction f does what another one does."""
    return bool(0 <= K.partner[f] < f)


def fill_slips(K: ContactRows) -> None:
    """What the programs know of sliding, into the block: signs, of two directions how they are held."""
    K.block[K.o_slip : K.o_slip + K.n_frictions] = K.slip[: K.n_frictions]
    if K.n_cones > 0:
        for f in range(K.n_frictions):
            if K.partner[f] >= 0 and K.slip[f] != 0.0:
                K.block[K.o_slip + f] = K.hold[f] * K.slip[f] if K.hold[f] > 0.0 else 1.0


def aim(K: Frictions, f: int, x: float, y: float) -> None:
    """Friction f and its partner slide along (x, y)."""
    size = sqrt(x * x + y * y)
    p = K.partner[f]
    K.slip[f] = x / size if size > 0.0 else 1.0
    K.slip[p] = y / size if size > 0.0 else LEAST
    if abs(K.slip[f]) < LEAST:
        K.slip[f] = LEAST
    if abs(K.slip[p]) < LEAST:
        K.slip[p] = LEAST
    K.lean[f] = K.slip[f]
    K.lean[p] = K.slip[p]


def cosine(K: Frictions, f: int, own: float, other: float) -> float:
    """Of λ_T along friction f at the velocities of f and of its partner, as the programs have it."""
    hold = K.hold[f]
    part = hold * (2.0 - hold * hold) * (2.0 - hold * hold) if hold > 0.0 else 0.0
    x = own + part * K.slip[f]
    y = other + part * K.slip[K.partner[f]]
    return float(x / sqrt(x * x + y * y + LEAST_SQUARE))


def sliding_force(K: Frictions, f: int, limit: float, rates: Reals, own: int, other: int) -> float:
    """λ_T of a friction that slides; its velocity is at `own` of the rates, that of its partner at `other`."""
    if K.partner[f] < 0:
        return float(K.slip[f] * limit)
    return float(cosine(K, f, rates[own], rates[other]) * limit)


def along(K: Frictions, f: int, x: float, y: float) -> float:
    """Part of (x, y) along the direction in which friction f and its partner slide."""
    return float(K.slip[f] * x + K.slip[K.partner[f]] * y)


def speed_of_both(K: Frictions, f: int, values: Reals, first: int) -> float:
    """‖γ‖ of friction f and its partner among values that begin at `first`."""
    x = values[first + f]
    y = values[first + K.partner[f]]
    return sqrt(x * x + y * y)


def pull_of_both(K: Frictions, f: int, lam: Reals) -> float:
    """|λ_T| of friction f, with its partner where it has one."""
    x = lam[K.friction_row[f]]
    if K.partner[f] < 0:
        return float(abs(x))
    y = lam[K.friction_row[K.partner[f]]]
    return sqrt(x * x + y * y)


def phase_of(K: Frictions, f: int) -> float:
    """What a friction does, as results tell it: 2 sticks, ±1 slides that way (1 in space), 0 off."""
    if K.sticks[f] == 1:
        return 2.0
    return float(K.slip[f] if K.partner[f] < 0 or K.slip[f] == 0.0 else 1.0)


def hold_directions(K: Frictions) -> None:
    """λ_T as K.slip has it, whatever γ: at instants."""
    for f in range(K.n_frictions):
        K.hold[f] = HELD


def let_directions_go(K: Guards) -> None:
    """After a restart: λ_T follows γ; where that is round-off it begins along K.slip."""
    for f in range(K.n_frictions):
        K.hold[f] = 0.0
        if K.partner[f] >= 0 and K.slip[f] != 0.0 and speed_of_both(K, f, K.guards0, K.at_slip) < MOVING:
            K.hold[f] = ONSET


def follow_motion(K: Guards) -> None:
    """After a step: K.slip is the direction of γ, which K.hold leaves to it.

    That of the onset stays while γ is less than what stands for it: the step after this one would follow an error of γ,
    not γ, and make it larger.
    """
    for f in range(K.n_frictions):
        if K.partner[f] > f and K.slip[f] != 0.0:
            least = BEGUN if K.hold[f] == ONSET else MOVING * ONSET
            if speed_of_both(K, f, K.guards0, K.at_slip) >= least:
                aim(K, f, K.guards0[K.at_slip + f], K.guards0[K.at_slip + K.partner[f]])
    for f in range(K.n_frictions):
        if K.partner[f] >= 0 and K.slip[f] != 0.0:
            if K.hold[f] == HELD or speed_of_both(K, f, K.guards0, K.at_slip) >= MOVING:
                K.hold[f] = 0.0
