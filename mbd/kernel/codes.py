"""Numbers that the kernel tells things by: modes of steps, functions, statuses, guards, the log; and its round-off."""

PASSING, LEFT = 1, 2
"""Values of `near_singular`: within a few steps of a singular configuration, and just beyond it."""
ACCELERATIONS, GUARDS, SCALES, COMPOSE, TERMS, INCREMENT_RATES, CHART_END, CHART_MOTION, FREE_RATES = range(9)
"""Functions in `code`; modes follow: tangent, residual and, where straight-line code pays, correction and solution."""
DONE, FULL, NEW_MODE, EVENT, PAUSE, LAST = range(6)
"""What `advance` returns; or one of the failures below."""
(
    NOT_FINITE, NOT_CONVERGED, SINGULAR, STAGNATED, CHATTER, NO_IMPACT, DEPENDENT, CONFLICT, NO_LOCATION, ENERGY_GAIN,
    NO_FORCE, TOO_TIGHT, TOO_NEAR, TOO_SMALL, SINGULAR_ROWS_MOVE, OUTGROWN, GAINED, TOO_BRIEF,
    AT_POSE, LEAPT, ILL_CONDITIONED, JUMPED, ENDLESS_TRANSITIONS, UNSTABLE, NO_DERIVATIVE,
) = range(10, 35)  # fmt: skip
DOUBTFUL_START, NEEDS_PYTHON = 40, 41
"""How one of many runs ends that Python has to make: its start may be none, or it goes on in another way."""
(
    CLOSE, OPEN_PULL, OPEN_GAP, OPEN_FORCE, CROSS, WATCH, GRAZE, PRESS, STICK, SLIP, STICK_BRIEF,
    CROSS_BRIEF, CROSS_BACK,
) = range(13)  # fmt: skip
"""Kinds of fired guards."""
ALWAYS, BY_MEASURE = -1, -2
"""When a contact is watched, in place of the number of another one while which is closed."""
LOG_CLOSED, LOG_OPENED, LOG_EVENT, LOG_STUCK, LOG_SLIPPED, LOG_PUSHED = range(6)
"""Kinds in the log."""
NOT_KNOWN_YET = -9
"""State of a friction before the first restart, in `was`: what it begins with is no event [-]."""
PULL = 1e-9
"""Pull of a contact, relative to the forces, that is more than round-off [-]."""
EPS = 2.220446049250313e-16
"""Distance from 1 to the next double [-]."""
