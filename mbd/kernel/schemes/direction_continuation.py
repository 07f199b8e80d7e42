"""Numerical continuation for steps just after the onset of sliding in a plane, where Newton's method fails.

There γ is far smaller than what friction changes of it in a step, so that Newton's method must begin nearly along the
direction at the end of the step. With w = γ + σ e in place of γ, e the direction at the accepted state, the equations
are easy to solve where σ is large (`mbd.equations.cones` has w and what K.hold makes of σ). Each solution begins the
next one, whose σ is smaller, down to that of the step itself (Allgower & Georg 2003, Introduction to Numerical
Continuation Methods, ch. 2).
"""

from mbd.kernel.codes import NOT_CONVERGED, STAGNATED
from mbd.kernel.contact.cones import HOLD_AT_ONSET, HOLD_DIRECTION, fill_slips
from mbd.kernel.records import ContactRows, Frictions

NO_HOLD = -1.0
"""In place of a hold: the step is not continued, its directions do what K.hold says."""
LAST_HOLD = 0.0
"""In place of a hold: the last of a continuation, directions do what K.hold says again."""
FIRST_HOLD = 1.8
"""Of K.hold, after directions that are held: σ is some 3 m/s [-]."""
HOLD_FACTOR = 0.25
"""Each K.hold over the one before [-]."""


def wants_continuation(K: Frictions, status: int) -> bool:
    """Whether Newton's method has failed in a step in which friction follows γ in a plane."""
    if K.n_cones == 0 or K.strategy == 1 or not (status == NOT_CONVERGED or status == STAGNATED):
        return False
    found = False
    for f in range(K.n_frictions):
        found = found or (K.group_size[f] > 1 and K.slip[f] != 0.0 and K.hold[f] != HOLD_DIRECTION)
    return found


def begin_continuation(K: Frictions) -> float:
    """Hold all directions; what they did is kept. The hold."""
    for f in range(K.n_frictions):
        K.own_hold[f] = K.hold[f]
        K.hold[f] = HOLD_DIRECTION
    return HOLD_DIRECTION


def continue_directions(K: ContactRows, hold: float, status: int) -> float:
    """The hold after a solution with this one, in the block; `LAST_HOLD` where it is the last or none is solved."""
    smaller = FIRST_HOLD if hold == HOLD_DIRECTION else HOLD_FACTOR * hold
    if status != 0 or smaller < HOLD_AT_ONSET:
        smaller = LAST_HOLD
    for f in range(K.n_frictions):
        K.hold[f] = K.own_hold[f]
        if smaller > 0.0 and K.own_hold[f] != HOLD_DIRECTION:
            K.hold[f] = smaller
    fill_slips(K)
    return smaller
