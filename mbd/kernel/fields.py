"""The one tuple of numbers that stepping and switching work on, and the codes they speak.

`Kernel` holds integers, reals and flat arrays; the compiled form receives the same fields as addresses.
"""

from __future__ import annotations

from collections import namedtuple

__all__ = ["FIELDS", "INTEGERS", "INTEGER_ARRAYS", "KEPT_INTEGERS", "KEPT_REALS", "REALS", "REAL_ARRAYS", "Kernel"]

INTEGERS = (
    "n_q", "n_v", "n", "n_rows", "n_anchors", "n_contacts", "n_guards", "n_frictions",  # sizes; n = n_v + n_z rates
    "o_q", "o_x", "o_v", "o_a", "o_lam", "o_anchor", "o_switch", "o_slip",  # offsets into the block
    "vector",  # 1: q ⊕ x is q + x
    "stabilized",  # 1: velocity level with position correction, 0: index 3
    "jerk",  # 1: a₀ starts from the jerk, 0: a₀ = v̇₀
    "exact",  # 1: iterate until round-off
    "max_iterations", "max_switches", "linear",  # linear: event instants by one linear interpolation
    "width", "capacity", "stride", "event_width", "event_capacity",  # storage
    "chunk",  # steps before control returns
    "strategy",  # 0 located events, 1 non-smooth steps
    "auto",  # 1: non-smooth steps follow where located blows crowd
    "impact_law",  # 0 Newton, 1 Poisson, 2 sequential
    "n_watched",  # guard values in all
    "loaded",  # a friction follows multipliers other than linearly: 1 as that of a pin, 2 not at all where one pulls
    "scheme",  # 0 Newmark family, 1 explicit Runge–Kutta, 2 Radau IIA
    "adaptive",  # 1: steps follow the estimated error, 0: they are all dt
    "error_order",  # power of the step with which the estimated error per second falls
    "looks",  # parts of a step at whose ends guards are looked at; 1: at those of the step only
)  # fmt: skip
REALS = (
    "alpha_m", "alpha_f", "beta", "gamma", "tolerance", "rest_speed", "until", "end",
    "dt",  # of all steps, or where they follow the error a time that is short beside the motion
    "allowed",  # local error in positions [m, rad] per second
    "longest",  # step
)  # fmt: skip
REAL_ARRAYS = (
    "params", "block",
    "out",  # of the function called last
    "acc",  # of the accelerations program
    "clock",  # see the places below
    "q", "y", "rate", "aux", "slope", "lam", "lam_slope", "shift", "shift_change", "anchors",  # accepted state
    "q1", "y1", "rate1", "aux1", "lam1", "shift1",  # candidate of the step under judgement
    "kkt", "rhs", "work", "spare",  # linear algebra
    "stages",  # what a scheme of several stages works on
    "past_stages",  # those of the last step, which predict the next
    "tableau",  # coefficients of its formula
    "error",  # local error of the candidate as its scheme estimates it: of positions x, then of (v, z)
    "inside",  # guards and multipliers at the ends of a step while places inside it are looked at
    "turning",  # ∂ḣ/∂x of the active rows, stabilized only
    "left", "left1",  # of each row beside the earlier ones, at the accepted state and the candidate; not of the family
    "basis", "lower", "mix", "shares",  # dependent rows as combinations of others, and what they bear of their loads
    "force", "bias", "jump", "impulse",  # complementarity: right-hand sides, velocity or acceleration, multipliers
    "slip", "limit", "base_limit",  # frictions: sign of sliding, largest, at zero multipliers
    "lean",  # frictions: the direction in which each slid last
    "typical",  # of velocities or accelerations without rows
    "given", "total", "total_jump", "loads", "trial", "trial_given", "trial_jump",  # phases of an impact
    "kept",  # what a non-smooth step began from
    "before", "past", "past_limit",  # non-smooth steps: gap rates before, impulses and limits of the smooth part
    "lcp_matrix", "lcp_shift", "lcp_found", "lcp_work", "lcp_limit", "lcp_slope",  # Lemke's method
    "guards0", "guards1",  # guard values at the accepted state and at the candidate
    "scale",  # magnitudes of r, h, ḣ term by term
    "known",  # the same before they were raised at an iterate
    "weight",  # the inverse of those of r
    "deepest", "sinking",  # lowest gap of each contact while ignored; time of its first release into its surface
    "side",  # sign of each user guard since it last crossed
    "crossed",  # time from the start of the step to an event that it passes without a restart, < 0 for none
    "doubt",  # guard values, then round-off of positions and velocities, where a guard's own round-off is asked for
    "restitution",
    "pace",  # of each contact, as a penalty contact closes: see the places in `pace`
    "seen",  # at which switch of an instant these were noted, 0 for none: who is closed, sticks, …, and the state
    "pick",  # the fired guard: estimate, bracket, sizes
    "store", "log", "detail",
)  # fmt: skip
INTEGER_ARRAYS = (
    "row_contact", "row_normal",  # contact of each row; 1 for its normal row
    "row_trivial",  # 1: a row that holds whatever the motion, and never acts
    "row_level",  # of each row: 0 holds positions, 1 velocities only
    "row_friction",  # friction of each row that holds only while it sticks, −1 otherwise
    "friction_row", "friction_contact",
    "row_unit",  # 0 [m], 1 [rad], 2 other, of each row
    "unit",  # unit block of each balance component
    "kind", "opens", "normal",  # contact: 0 unilateral, 1 penalty; 0 on pull, 1 on gap, 2 by When; its normal row
    "when_start", "when_target", "when_after",  # who opens it
    "while_kind", "while_target",  # 0 always, 1 while a contact is closed, 2 while a measure is positive
    "anchor_start", "direction", "notify",
    "closed", "armed", "touched", "active", "free", "closing", "parting",  # contacts
    "sticks", "loose", "was",  # frictions; was: 0 off, 2 sticking, ±1 sliding since the last restart
    "let_go",  # 1: a friction that has let go for the step being tried
    "lifting",  # 1: a row that is left out of the correction of positions
    "kept_flags",  # what a non-smooth step began from
    "lcp_rows", "lcp_who", "lcp_basis",  # Lemke's method
    "dropped",  # rows that depend on others
    "support",  # of each row of the basis: how many of its entries are not zero, and which; then rows still to come
    "mode_key", "mode_code", "mode_count",  # known modes
    "mode_order", "orders",  # where the order of elimination of each mode begins, 0 for none, and all of them
    "rows", "pivots", "columns", "fired", "state", "counts",
)  # fmt: skip
FIELDS = (*INTEGERS, *REALS, *REAL_ARRAYS, *INTEGER_ARRAYS, "code", "hooks")

Kernel = namedtuple("Kernel", FIELDS)  # type: ignore[misc]

KEPT_REALS = (
    "clock", "q", "y", "rate", "aux", "slope", "lam", "lam_slope", "shift", "shift_change", "anchors", "guards0",
    "scale", "weight", "mix", "deepest", "sinking", "side", "detail", "slip", "lean", "past_stages", "left", "pace",
    "seen",
)  # fmt: skip
"""What of the real arrays the next step depends on: restored before a step, they make it the same to the bit."""
KEPT_INTEGERS = ("closed", "armed", "touched", "dropped", "rows", "state", "sticks", "loose", "was")
"""What of the integer arrays the next step depends on."""

# places in `state`
(
    MODE, ROWS, GRID, RESTART, STORED, LOGGED, SWITCHES, SINCE_STORE, BLOCKED, N_DROPPED, NEAR, INCHING, REDONE,
    PLASTIC, HALVED, HALVES, PAIRED, STRAIGHT,
    ORDERED,  # where the order of the factors in K.kkt begins in K.orders, 0 if pivots were searched for
    CALMED,  # 1: the scheme has been started again at the accepted state because a contact seemed to pull in the step
    RAISED,  # 1: magnitudes were raised far above those of the accepted state
    UNEVEN,  # 1: masses differ so much that accelerations of stages are corrected by the balance
    UNLOCATED,  # 1: non-smooth steps have followed as located blows crowded, 2: as locating could not go on
) = range(23)  # fmt: skip
# places in `counts`
(
    STEPS, ITERATIONS, TANGENTS, RESIDUALS, FACTORIZATIONS, EVENTS, RESTARTS, IMPACTS, LOCATIONS, STAGNATIONS, CAREFUL,
    SHORTENED, STRONGE, ENDLESS,
    PIVOTED,  # factorizations by the pivoted LU where an order chosen beforehand was not sound
    REJECTED,
    LOST,  # rows and lines for which there was no room: none, as `room_to_log` and the rows kept free see to
    COARSENED,  # steps whose rates changed otherwise than was foreseen by more than a fifth
) = range(18)  # fmt: skip
# values of state[NEAR]: within a few steps of a pose in which rows lose rank, and just beyond it
PASSING, LEFT = 1, 2
# place in `detail` of the growth of a change that nothing foretold (see `mbd.kernel.unresolved`)
GROWN = 3
# places in `detail` of the largest inverse pivot of rows in the last step, of what round-off makes of velocities there
PIVOT, KICK = 4, 5
# and of the time that K.past covers, of the last correction of positions by contacts
PAST_TIME, LIFTED = 6, 7
# and where the last such step of `COARSENED` began, where the one with the largest change ended, and that change
COARSE_FROM, COARSEST_AT, COARSEST = 8, 9, 10
# places in `clock`: time, base time of the grid, step size of aux, time of the last switch, the present full step,
# the step that will follow the candidate, the width of a step that is looked at as a whole (state[STRAIGHT] = 1), and
# the step that the candidate took with its local error, the sum of local errors, when rows will lose rank, how much
# located blows crowd, when that was counted last, and since when non-smooth steps are taken in their place
(
    NOW, BASE, AUX_STEP, LAST_SWITCH, STEP, NEXT, WIDTH, TRIED, LOCAL, SPENT, POSE, CROWD, CROWD_TIME, UNLOCATED_SINCE,
) = range(14)  # fmt: skip
# functions in `code`; modes follow: tangent, residual and, where straight-line code pays, correction and solution
ACCELERATIONS, GUARDS, SCALES, COMPOSE, TERMS = range(5)
# what advance returns
DONE, FULL, NEW_MODE, EVENT, PAUSE, LAST = range(6)
(
    NOT_FINITE, NOT_CONVERGED, SINGULAR, STAGNATED, CHATTER, NO_IMPACT, DEPENDENT, CONFLICT, NO_LOCATION, ENERGY_GAIN,
    NO_FORCE, TOO_TIGHT, TOO_NEAR, TOO_SMALL, STIRRED, OUTGROWN, GAINED, TOO_BRIEF,
    AT_POSE, LEAPT,
) = range(10, 30)  # fmt: skip
# kinds of fired guards
CLOSE, OPEN_PULL, OPEN_GAP, OPEN_FORCE, CROSS, WATCH, GRAZE, PRESS, STICK, SLIP, STICK_BRIEF = range(11)
# kinds in the log
LOG_CLOSED, LOG_OPENED, LOG_EVENT, LOG_STUCK, LOG_SLIPPED = range(5)
UNKNOWN = -9
"""State of a friction before the first restart, in `was`: what it begins with is no event [-]."""
PULL = 1e-9
"""Pull of a contact, relative to the forces, that is more than round-off [-]."""
EPS = 2.220446049250313e-16
"""Distance from 1 to the next double [-]."""
