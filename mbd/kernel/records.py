"""The numbers that stepping and switching work on: each with its name, its length, and what it is.

`Kernel` is all of them; a function that needs less takes the record that it needs. Lengths follow from `Sizes`: n_q
coordinates, n = n_v + n_z rates, rows, contacts, guards of the user, frictions, anchors. An index that is itself read
from an array stays within these because of who writes it:

row_contact, row_friction, friction_row, friction_contact, normal, while_target, when_target, anchor_start
    by the active set, from the equations; no run writes them.
rows, columns, pivots, support, lcp_who, lcp_rows, event_kind, event_index
    by the kernel, in the loop that counts them, before they are read.
mode_code, mode_order, orders
    by `Stepper.add_mode`, for the mode whose number is below n_modes.
n_stored, n_logged
    compared with `capacity` and `event_capacity` before every step and once more where a row or a line is written.

Every array has room for one number at least. `tests/kernel/test_guard_pages.py` runs scenes with a page beside each
array that can be neither read nor written.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mbd.kernel.record import Integers, Reals, Record, Table, integers, place, reals

__all__ = ["MODE_CAPACITY", "PROGRAMS", "TABLE", "Integers", "Kernel", "Reals", "Sizes"]

PROGRAMS = 4
"""Programs of a mode: tangent, residual, correction and solution; 0 stands for the last two where there are none."""
MODE_CAPACITY = 16
"""Modes for which a table is laid out at the start; it doubles as it fills."""


class Sizes(Record):
    """How many of everything, and where inputs begin in the block."""

    n_q: int
    n_v: int
    n: int  # n_v + n_z rates
    n_rows: int
    n_anchors: int
    n_contacts: int
    n_guards: int  # of the user
    n_frictions: int
    o_q: int  # offsets into the block
    o_x: int
    o_v: int
    o_a: int
    o_lam: int
    o_anchor: int
    o_switch: int
    o_slip: int
    n_watched: int  # guard values in all
    width: int  # of a stored row
    capacity: int  # stored rows
    event_width: int
    event_capacity: int

    @property
    def n_kkt(self) -> int:
        """Unknowns of balance and rows together."""
        return self.n + self.n_rows

    @property
    def n_lcp(self) -> int:
        """Unknowns of the linear complementarity problem."""
        return self.n_contacts + 3 * self.n_frictions

    @property
    def n_tangent(self) -> int:
        """Numbers that the programs of a mode write at most."""
        beside = self.n + 2 * self.n_rows + self.n_rows * self.n
        return self.n_kkt * self.n_kkt + 3 * beside + 2 * self.n_kkt + 2

    @property
    def acc_f(self) -> int:
        """Where f begins in acc, behind M (n, n); R (n, n_rows), B (n_rows, n), h and what is below follow."""
        return self.n * self.n

    @property
    def acc_R(self) -> int:
        """Where R = ∂r/∂λ begins."""
        return self.n * self.n + self.n

    @property
    def acc_B(self) -> int:
        """Where B = ∂ḣ/∂v begins."""
        return self.n * self.n + self.n + self.n * self.n_rows

    @property
    def acc_h(self) -> int:
        """Where h begins."""
        return self.n * self.n + self.n + 2 * self.n * self.n_rows

    @property
    def acc_rate(self) -> int:
        """Where ḣ begins."""
        return self.n * self.n + self.n + 2 * self.n * self.n_rows + self.n_rows

    @property
    def acc_bias(self) -> int:
        """Where γ begins, the part of ḧ without accelerations."""
        return self.n * self.n + self.n + 2 * self.n * self.n_rows + 2 * self.n_rows

    @property
    def acc_captured(self) -> int:
        """Where the anchors begin that contacts would hold."""
        return self.n * self.n + self.n + 2 * self.n * self.n_rows + 3 * self.n_rows

    @property
    def acc_limit(self) -> int:
        """Where the largest frictions begin, behind the kinetic energy."""
        return self.n * self.n + self.n + 2 * self.n * self.n_rows + 3 * self.n_rows + self.n_anchors + 1


class Settings(Sizes):
    """What does not change while the kernel runs."""

    vector: int  # 1: q ⊕ x is q + x
    stabilized: int  # 1: velocity level with position correction, 0: index 3
    jerk: int  # 1: a₀ starts from the jerk, 0: a₀ = v̇₀
    exact: int  # 1: iterate until round-off
    max_iterations: int
    max_switches: int
    linear: int  # 1: event instants by one linear interpolation
    stride: int  # steps from one stored row to the next
    chunk: int  # steps before control returns
    strategy: int  # 0 located events, 1 non-smooth steps
    auto: int  # 1: non-smooth steps follow where located impacts crowd
    impact_law: int  # 0 Newton, 1 Poisson, 2 sequential
    n_judged: int  # unilateral contacts that open where they pull, and frictions
    loaded: int  # a friction follows multipliers other than linearly: 1 as that of a pin, 2 not at all where one pulls
    adaptive: int  # 1: steps follow the estimated error, 0: they are all dt
    error_order: int  # power of the step with which the estimated error per second falls
    looks: int  # substeps of a step at whose ends guards are evaluated; 1: at those of the step only
    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float
    tolerance: float
    rest_speed: float
    until: float
    end: float
    dt: float  # of all steps, or where they follow the error a time that is short beside the motion
    allowed: float  # local error in positions [m, rad] per second
    longest: float  # step


class SchemeAbilities(Settings):
    """The number of the scheme, and what it is able to do: see `mbd.kernel.schemes.contract`."""

    scheme: int
    explicit: int
    estimates: int
    singular_size: int
    stretches: int
    n_nodes: int
    look_twice: float
    error_constant: float
    most_growth: float
    middle: float
    far_look: float
    longest_over: float
    nodes: Reals = reals(lambda s: s.n_nodes)  # parts of a step at which it has stages, its end not counted


class Model(SchemeAbilities):
    """What model code reads and writes."""

    code: Sequence[Any]  # functions: see the numbers in `mbd.kernel.codes`; those of modes follow
    params: Reals = reals()
    block: Reals = reals()
    block_time: float = place("block")
    block_c_C: float = place("block")
    block_c_K: float = place("block")
    out: Reals = reals()  # of the function called last
    acc: Reals = reals()  # of the accelerations program
    scale: Reals = reals(lambda s: s.n + 2 * s.n_rows, kept=True)  # magnitudes of r, h, ḣ term by term
    known: Reals = reals(lambda s: s.n + 2 * s.n_rows)  # the same before they were raised at an iterate
    weight: Reals = reals(lambda s: s.n, kept=True)  # the inverse of those of r
    typical: Reals = reals(lambda s: s.n)  # of velocities or accelerations without rows
    row_contact: Integers = integers()  # contact of each row
    row_normal: Integers = integers()  # 1 for the normal row of a contact
    row_trivial: Integers = integers()  # 1: a row that holds whatever the motion, and never acts
    row_level: Integers = integers()  # of each row: 0 holds positions, 1 velocities only
    row_friction: Integers = integers()  # friction of each row that holds only while it sticks, −1 otherwise
    row_unit: Integers = integers()  # 0 [m], 1 [rad], 2 other, of each row
    unit: Integers = integers()  # unit block of each balance component
    n_modes: int = place("mode_count")
    mode_key: Integers = integers(lambda s: MODE_CAPACITY * (s.n_contacts + s.n_rows + s.n_frictions))  # known modes
    mode_code: Integers = integers(lambda s: PROGRAMS * MODE_CAPACITY)
    mode_count: Integers = integers()
    mode_order: Integers = integers(lambda s: MODE_CAPACITY)  # where the order of elimination begins, 0 for none
    orders: Integers = integers(lambda s: 1)  # all of them
    mode_id: int = place("state")  # the present mode, −1: not known yet
    order_start: int = place("state")  # where the order of the factors in kkt begins, 0 if pivots were searched for
    scales_raised: int = place("state")  # 1: magnitudes were raised far above those of the accepted state
    uneven_masses: int = place("state")  # 1: they differ so much that the balance corrects accelerations of stages


class State(Model):
    """The accepted state, the candidate of the step under judgement, and the grid of steps."""

    time: float = place("clock")
    clock: Reals = reals(kept=True)
    q: Reals = reals(lambda s: s.n_q, kept=True)
    y: Reals = reals(lambda s: s.n, kept=True)  # (v, z)
    rate: Reals = reals(lambda s: s.n, kept=True)
    lam: Reals = reals(lambda s: s.n_rows, kept=True)
    anchors: Reals = reals(lambda s: s.n_anchors, kept=True)
    q1: Reals = reals(lambda s: s.n_q)  # candidate
    y1: Reals = reals(lambda s: s.n)
    rate1: Reals = reals(lambda s: s.n)
    aux1: Reals = reals(lambda s: s.n)
    lam1: Reals = reals(lambda s: s.n_rows)
    shift1: Reals = reals()  # lies in the block
    rows: Integers = integers(lambda s: s.n_rows, kept=True)  # active rows that do not depend on others
    state: Integers = integers(kept=True)
    n_active: int = place("state")  # how many
    grid_start: float = place("clock")
    grid_steps: int = place("state")  # of the grid since then
    step: float = place("clock")  # the present full step
    next_step: float = place("clock")  # the one that will follow the candidate
    step_taken: float = place("clock")  # by the candidate
    restart_due: int = place("state")  # 1: and the restart is stored as a row, 2: it is not
    halvings: int = place("state")  # how often the step is halved
    halves_left: int = place("state")  # of it
    paired_step: int = place("state")  # see `mbd.kernel.singular.step_pairs`
    short_steps: int = place("state")  # twice the shortened steps, less the full ones since


class Memory(State):
    """What schemes remember from step to step, and what they work on."""

    aux: Reals = reals(lambda s: s.n, kept=True)
    slope: Reals = reals(lambda s: s.n, kept=True)
    lam_slope: Reals = reals(lambda s: s.n_rows, kept=True)
    shift: Reals = reals(lambda s: s.n, kept=True)
    shift_change: Reals = reals(lambda s: s.n, kept=True)
    aux_step: float = place("clock")  # step size of aux
    turning: Reals = reals(lambda s: s.n_rows * s.n)  # ∂ḣ/∂x of the active rows, stabilized only
    stages: Reals = reals(lambda s: 0)  # what a scheme of several stages works on
    past_stages: Reals = reals(lambda s: 0, kept=True)  # those of the last step, which predict the next
    tableau: Reals = reals(lambda s: 0)  # coefficients of its formula
    error: Reals = reals(lambda s: s.n_v + s.n)  # local error of the candidate: of positions x, then of (v, z)
    local_error: float = place("clock")  # of the step that the candidate took
    error_sum: float = place("clock")


class Contacts(Memory):
    """Contacts: their rules and what is known of each."""

    kind: Integers = integers()  # 0 unilateral, 1 penalty
    opens: Integers = integers()  # 0 on pull, 1 on gap, 2 by When
    normal: Integers = integers()  # normal row
    when_start: Integers = integers()  # who opens it
    when_target: Integers = integers()
    when_after: Integers = integers()
    while_kind: Integers = integers()  # 0 always, 1 while a contact is closed, 2 while a measure is positive
    while_target: Integers = integers()
    anchor_start: Integers = integers()
    restitution: Reals = reals()
    closed: Integers = integers(lambda s: s.n_contacts, kept=True)
    armed: Integers = integers(lambda s: s.n_contacts, kept=True)
    touched: Integers = integers(lambda s: s.n_contacts, kept=True)
    active: Integers = integers(lambda s: s.n_contacts + s.n_guards + s.n_frictions)
    free: Integers = integers(lambda s: s.n_contacts)
    closing: Integers = integers(lambda s: s.n_contacts)
    parting: Integers = integers(lambda s: s.n_contacts)
    lifting: Integers = integers(lambda s: s.n_rows)  # 1: a row that is left out of the correction of positions
    deepest: Reals = reals(lambda s: s.n_contacts, kept=True)  # lowest gap while ignored
    sinking: Reals = reals(lambda s: s.n_contacts, kept=True)  # time of the first release into the surface
    contact_step: Reals = reals(lambda s: s.n_contacts, kept=True)  # while a penalty contact acts, 0: not found yet
    closing_rate: Reals = reals(lambda s: s.n_contacts, kept=True)  # |γ| as it closed
    largest_rate: Reals = reals(lambda s: s.n_contacts, kept=True)  # in the present window of steps
    contact_steps: Reals = reals(lambda s: s.n_contacts, kept=True)
    least_contact_step: Reals = reals(lambda s: s.n_contacts, kept=True)  # ever
    correction_size: float = place("detail")  # of the last correction of positions by contacts
    plastic_impact: int = place("state")  # 1: without restitution


class Frictions(Contacts):
    """Frictions: their rows and what each does."""

    friction_row: Integers = integers()
    friction_contact: Integers = integers()
    sticks: Integers = integers(lambda s: s.n_frictions, kept=True)
    loose: Integers = integers(lambda s: s.n_frictions, kept=True)
    was: Integers = integers(lambda s: s.n_frictions, kept=True)  # at the last restart: 0 off, 2 sticking, ±1 sliding
    let_go: Integers = integers(lambda s: s.n_frictions)  # 1: a friction that has let go for the step being tried
    slip: Reals = reals(lambda s: s.n_frictions, kept=True)  # sign of sliding
    lean: Reals = reals(lambda s: s.n_frictions, kept=True)  # the direction in which each slid last
    limit: Reals = reals(lambda s: s.n_frictions)  # largest friction
    base_limit: Reals = reals(lambda s: s.n_frictions)  # the same at zero multipliers


class Events(Frictions):
    """Guards and the instants at which they fire."""

    guards0: Reals = reals(lambda s: s.n_watched, kept=True)  # at the accepted state
    guards1: Reals = reals(lambda s: s.n_watched)  # at the candidate
    side: Reals = reals(lambda s: s.n_guards, kept=True)  # sign of each user guard since it last crossed
    direction: Integers = integers()
    notify: Integers = integers(lambda s: s.n_contacts + s.n_guards + s.n_frictions)
    crossed: Reals = reals(lambda s: s.n_guards)  # from the start of the step to an event without a restart, or < 0
    doubt: Reals = reals(lambda s: 2 * s.n_watched + 2 * s.n)  # guards, then round-off of positions and velocities
    inside: Reals = reals(lambda s: 2 * s.n_watched + 2 * s.n_rows + s.n_q + 2 * s.n)  # what substeps began from
    pick: Reals = reals()  # the event that fired first
    event_place: float = place("pick")  # its estimated distance, part of the step
    event_low: float = place("pick")  # the lower end of its bracket
    changes_little: float = place("pick")  # 1: rates of the candidate change so little that it needs no other look
    event_after: float = place("pick")  # its distance from the start of the step [s]
    fired: Integers = integers()
    event_kind: int = place("fired")  # −1: none
    event_index: int = place("fired")
    seen: Reals = reals(  # who was closed, stuck, … at an earlier switch of this instant, and the state
        lambda s: 1 + 2 * s.n_contacts + 2 * s.n_frictions + s.n_guards + s.n_q + s.n, kept=True
    )
    seen_at: float = place("seen")  # at which one, 0 for none
    n_switches: int = place("state")  # at this instant
    last_switch: float = place("clock")
    in_substeps: int = place("state")  # 1: within a step that is taken in substeps
    substep: float = place("clock")  # the size of such a step
    crowding: float = place("clock")  # how much located impacts crowd
    crowding_time: float = place("clock")  # when that was counted last
    fallback: int = place("state")  # 1: non-smooth steps followed as impacts crowded, 2: as locating could not go on
    fallback_time: float = place("clock")  # since when
    restarted_here: int = place("state")  # 1: at the accepted state, as a contact seemed to pull in the step


class Complementarity(Events):
    """Impacts and contact forces: velocities or accelerations, impulses or multipliers that go together."""

    force: Reals = reals(lambda s: s.n)  # right-hand sides
    bias: Reals = reals(lambda s: s.n_rows)
    jump: Reals = reals(lambda s: s.n)  # velocities or accelerations
    impulse: Reals = reals(lambda s: s.n_rows)  # multipliers
    given: Reals = reals(lambda s: s.n_rows)  # phases of an impact
    total: Reals = reals(lambda s: s.n_rows)
    total_jump: Reals = reals(lambda s: s.n)
    loads: Reals = reals(lambda s: s.n_rows)
    trial: Reals = reals(lambda s: s.n_rows)
    trial_given: Reals = reals(lambda s: s.n_rows)
    trial_jump: Reals = reals(lambda s: s.n)
    kept: Reals = reals(  # what a non-smooth step began from
        lambda s: s.n_q + 2 * s.n + s.n_rows + s.n_watched + s.n_anchors + s.n_frictions
    )
    kept_flags: Integers = integers(
        lambda s: 3 * s.n_contacts + 3 * s.n_frictions
    )  # and who was closed before an event
    before: Reals = reals(lambda s: s.n_contacts)  # gap rates before a non-smooth step
    past: Reals = reals(lambda s: s.n_rows)  # impulses of its smooth part
    past_limit: Reals = reals(lambda s: s.n_frictions)  # and largest frictions
    past_time: float = place("detail")  # that they cover
    n_repeats: int = place("state")  # of a non-smooth step
    lcp_matrix: Reals = reals(lambda s: s.n_lcp * s.n_lcp)  # Lemke's method
    lcp_shift: Reals = reals(lambda s: s.n_lcp)
    lcp_found: Reals = reals(lambda s: s.n_lcp)
    lcp_work: Reals = reals(lambda s: s.n_lcp * (2 * s.n_lcp + 4))
    lcp_limit: Reals = reals(lambda s: s.n_frictions)
    lcp_slope: Reals = reals(lambda s: s.n_frictions)
    lcp_rows: Integers = integers(lambda s: s.n_contacts + s.n_frictions)
    lcp_who: Integers = integers(lambda s: s.n_contacts + s.n_frictions)
    lcp_basis: Integers = integers(lambda s: s.n_lcp)


class Singular(Complementarity):
    """Rows that depend on others, for good or near a singular configuration."""

    dropped: Integers = integers(lambda s: s.n_rows, kept=True)  # 1: a row that depends on others
    n_dropped: int = place("state")
    basis: Reals = reals(lambda s: (s.n_rows + 1) * s.n)  # dependent rows as combinations of others
    lower: Reals = reals(lambda s: (s.n_rows + 1) * s.n_rows)
    mix: Reals = reals(lambda s: s.n_rows * s.n_rows, kept=True)
    shares: Reals = reals(lambda s: s.n_rows * s.n_rows)  # of the loads that they bear
    support: Integers = integers(lambda s: s.n_rows * (s.n + 2))  # of each row of the basis: entries that are not zero
    left: Reals = reals(lambda s: s.n_rows + 1, kept=True)  # of each row beside the earlier ones, at the accepted state
    left1: Reals = reals(lambda s: s.n_rows + 1)  # and at the candidate; not of the Newmark family
    near_singular: int = place("state")  # 1: within a few steps of a singular configuration, 2: just beyond it
    singular_time: float = place("clock")  # when the constraint Jacobian will lose rank
    inverse_pivot: float = place("detail")  # the largest of rows in the last step
    velocity_noise: float = place("detail")  # what round-off makes of velocities there


class LinearAlgebra(Singular):
    """What systems of equations are solved in."""

    kkt: Reals = reals(lambda s: s.n_kkt * s.n_kkt)
    rhs: Reals = reals(lambda s: s.n_kkt)
    work: Reals = reals(lambda s: 3 * s.n_kkt)
    spare: Reals = reals(lambda s: 2 * s.n_kkt * (s.n_kkt + 1) + s.n + 2 * s.n_rows + s.n_rows * s.n)
    pivots: Integers = integers(lambda s: s.n_kkt)
    columns: Integers = integers(lambda s: s.n_kkt)


class Kernel(LinearAlgebra):
    """All of the above, results, counts, and what a failure tells."""

    hooks: Any  # the scheme of the interpreted kernel
    store: Reals = reals(lambda s: s.capacity * s.width)
    row_bounds: Reals = reals(lambda s: 1 + s.n_contacts)  # largest change between rows, then λ_N of each contact
    n_stored: int = place("state")
    steps_since_row: int = place("state")
    log: Reals = reals(lambda s: s.event_capacity * s.event_width)
    n_logged: int = place("state")
    detail: Reals = reals(kept=True)
    failure_time: float = place("detail")
    failure_size: float = place("detail")  # its residual, or whatever is too large
    failure_step: float = place("detail")
    failure_index: int = place("state")  # contact, column or row
    unforeseen_change: float = place("detail")  # growth of rates that nothing foretold: see `mbd.kernel.resolution`
    coarse_start: float = place("detail")  # where the last of the steps `n_coarse` began
    coarsest_end: float = place("detail")  # where the one with the largest change ended
    coarsest_change: float = place("detail")
    least_pivot: float = place("detail")  # of the equations of accelerations since the last start, scaled
    lost_digits: float = place("detail")  # relative error of accelerations that were known there
    counts: Integers = integers()
    n_steps: int = place("counts")
    n_iterations: int = place("counts")
    n_tangents: int = place("counts")
    n_residuals: int = place("counts")
    n_factorizations: int = place("counts")
    n_events: int = place("counts")
    n_restarts: int = place("counts")
    n_impacts: int = place("counts")
    n_locations: int = place("counts")
    n_stagnations: int = place("counts")
    n_careful: int = place("counts")
    n_shortened: int = place("counts")
    n_energetic_impacts: int = place("counts")
    n_endless: int = place("counts")
    n_pivoted: int = place("counts")  # factorizations by the pivoted LU where a fixed order was not sound
    n_rejected: int = place("counts")
    n_lost: int = place("counts")  # rows and lines for which there was no room: none, as `room_to_log` sees to
    n_coarse: int = place("counts")  # steps whose rates changed otherwise than was foreseen by more than a fifth


TABLE = Table(Kernel)
