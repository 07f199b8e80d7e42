"""Forces and impulses, dependent rows, systems of equations, results; and what functions that solve or switch take."""

from __future__ import annotations

from mbd.kernel.records.contacts import ContactRows, Guards, Mechanism
from mbd.kernel.records.declare import Integers, Reals, integers, place, reals
from mbd.kernel.records.settings import SchemeAbilities
from mbd.kernel.records.state import Memory, Motion


class Complementarity(SchemeAbilities):
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
    cone_who: Integers = integers(lambda s: s.n_frictions)  # of each unknown angle, the group whose direction it turns
    disc_matrix: Reals = reals(lambda s: s.n_disc_unknowns * s.n_disc_unknowns)  # of a step within discs
    cone_slope: Reals = reals(lambda s: s.n_frictions * s.n_frictions)  # of misses by turns
    side_pivots: Integers = integers(lambda s: max(s.n_unknowns, s.n_frictions, s.n_disc_unknowns))
    cone_across: Reals = reals(lambda s: 3 * s.n_frictions)  # of each, the vector along which it turns
    cone_miss: Reals = reals(lambda s: s.n_frictions)  # of each, part of γ across the direction
    cone_turn: Reals = reals(lambda s: s.n_frictions)  # by which it turns [rad]
    cone_kept: Reals = reals(lambda s: s.n_frictions)  # cosines before a turn
    cone_residual: float = place("detail")  # the largest of problems over cones, of their largest impulses
    cone_matrix: Reals = reals(lambda s: s.n_unknowns * s.n_unknowns)  # of problems over cones
    cone_shift: Reals = reals(lambda s: s.n_unknowns)
    cone_found: Reals = reals(lambda s: s.n_unknowns)
    cone_limit: Reals = reals(lambda s: s.n_unknowns)
    cone_mu: Reals = reals(lambda s: s.n_unknowns)
    cone_work: Reals = reals(lambda s: s.n_unknowns * (s.n_unknowns + 6) + 3)
    cone_rows: Integers = integers(lambda s: s.n_unknowns)
    cone_owner: Integers = integers(lambda s: s.n_unknowns)
    cone_twin: Integers = integers(lambda s: s.n_unknowns)
    cone_normal: Integers = integers(lambda s: s.n_contacts)  # its number among the unknowns, −1 for none
    cone_flags: Integers = integers(lambda s: 2 * s.n_contacts + s.n_frictions)  # branches before such a problem
    turn: Integers = integers(lambda s: s.n_contacts)  # in which each is tested for Painlevé's paradox, −1 for none
    cone_slips: Reals = reals(lambda s: s.n_frictions)
    lam_at_limit: Reals = reals(
        lambda s: s.n_rows
    )  # multipliers at the largest load that sticks: see `mbd.kernel.contact.cone_loads`
    rise: Reals = reals(lambda s: s.n_frictions)  # what a push of one more adds to each limit
    freedom: Reals = reals(lambda s: s.n_rows * s.n_disc_unknowns)  # multipliers without forces
    null_vectors: Reals = reals(lambda s: s.n_rows * s.n_rows)  # all of them, line by line
    null_way: Reals = reals(lambda s: s.n_rows * s.n_rows)  # combinations of these
    disc_map: Reals = reals(lambda s: 4 * s.n_discs * s.n_disc_unknowns)  # three t_i and ℓ_i of each disc
    disc_at: Reals = reals(lambda s: 4 * s.n_discs)
    disc_weight: Reals = reals(lambda s: s.n_discs)
    disc_y: Reals = reals(lambda s: s.n_disc_unknowns)
    disc_kept: Reals = reals(lambda s: s.n_disc_unknowns)  # before a step
    disc_step: Reals = reals(lambda s: s.n_disc_unknowns)
    disc_slope: Reals = reals(lambda s: s.n_discs * s.n_disc_unknowns)
    disc_left: Reals = reals(lambda s: s.n_discs)  # −g_i
    disc_force: Reals = reals(lambda s: s.n_discs)  # κ_i
    disc_change: Reals = reals(lambda s: s.n_discs)  # of κ_i


class Singular(SchemeAbilities):
    """Rows that depend on others, for good or near a singular configuration."""

    dropped: Integers = integers(lambda s: s.n_rows, kept=True)  # 1: a row that depends on others
    n_dropped: int = place("state")
    basis: Reals = reals(lambda s: (s.n_rows + 1) * s.n)  # dependent rows as combinations of others
    lower: Reals = reals(lambda s: (s.n_rows + 1) * s.n_rows)
    dependence: Reals = reals(lambda s: s.n_rows * s.n_rows, kept=True)
    shares: Reals = reals(lambda s: s.n_rows * s.n_rows)  # of the loads that they bear
    support: Integers = integers(lambda s: s.n_rows * (s.n + 2))  # of each row of the basis: entries that are not zero
    left: Reals = reals(lambda s: s.n_rows + 1, kept=True)  # of each row beside the earlier ones, at the accepted state
    left1: Reals = reals(lambda s: 2 * s.n_rows)  # and at the candidate, √(2 T) behind them; not of the Newmark family
    near_singular: int = place("state")  # 1: within a few steps of a singular configuration, 2: just beyond it
    singular_time: float = place("clock")  # when the constraint Jacobian will lose rank
    inverse_pivot: float = place("detail")  # the largest of rows in the last step
    velocity_noise: float = place("detail")  # what round-off makes of velocities there


class LinearAlgebra(SchemeAbilities):
    """What systems of equations are solved in."""

    kkt: Reals = reals(lambda s: s.n_kkt * s.n_kkt)
    rhs: Reals = reals(lambda s: s.n_kkt)
    work: Reals = reals(lambda s: 3 * s.n_kkt)
    spare: Reals = reals(lambda s: 2 * s.n_kkt * (s.n_kkt + 1) + s.n + 2 * s.n_rows + s.n_rows * s.n)
    pivots: Integers = integers(lambda s: s.n_kkt)
    columns: Integers = integers(lambda s: s.n_kkt)
    island: Integers = integers(
        lambda s: s.n_kkt
    )  # number of the island of each unknown: see `mbd.kernel.algebra.islands`
    members: Integers = integers(lambda s: s.n_kkt)  # unknowns of one
    own_columns: Integers = integers(lambda s: s.n_kkt)  # `columns` of one


class Results(SchemeAbilities):
    """Rows of results and the log of events."""

    store: Reals = reals(lambda s: s.capacity * s.width)
    row_bounds: Reals = reals(lambda s: 1 + s.n_contacts)  # largest change between rows, then λ_N of each contact
    n_stored: int = place("state")
    steps_since_row: int = place("state")
    log: Reals = reals(lambda s: s.event_capacity * s.event_width)
    n_logged: int = place("state")


class Report(SchemeAbilities):
    """Counts, and what a failure tells."""

    detail: Reals = reals(kept=True)
    failure_time: float = place("detail")
    failure_size: float = place("detail")  # its residual, or whatever is too large
    failure_step: float = place("detail")
    failure_index: int = place("state")  # contact, column, row or guard
    unforeseen_change: float = place(
        "detail"
    )  # growth of rates that nothing predicted: see `mbd.kernel.stepping.resolution`
    coarse_start: float = place("detail")  # where the last of the steps `n_coarse` began
    coarsest_end: float = place("detail")  # where the one with the largest change ended
    coarsest_change: float = place("detail")
    stage_pull: float = place("detail")  # largest v̇·M v̇ of the stages of a step, 0 where nobody has looked
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
    n_singular_steps: int = place("counts")
    n_shortened: int = place("counts")  # steps of another size than dt, whatever for
    n_sized: int = place("counts")  # of these, those that would have come too close to a singular configuration
    n_halved: int = place("counts")  # and those at whose end no impulses obeyed all laws
    too_near: int = place("counts")  # whether the step that is tried would have come too close
    n_energetic_impacts: int = place("counts")
    n_endless: int = place("counts")
    n_pivoted: int = place("counts")  # factorizations by the pivoted LU where a fixed order was not sound
    n_rejected: int = place("counts")
    n_lost: int = place("counts")  # rows and lines for which there was no room: none, as `room_to_log` sees to
    n_coarse: int = place("counts")  # steps whose rates changed otherwise than was foreseen by more than a fifth


class ContactForces(Complementarity, ContactRows):
    """Forces or impulses of contacts and frictions, with M and B of the model."""


class Equations(Report, LinearAlgebra, Motion):
    """Systems of equations at a state, and what comes of solving them."""


class Steps(Memory, Equations):
    """What a scheme steps with."""


class DependentRows(Singular, Mechanism, Equations):
    """Equations with rows that depend on others, on some of which frictions slide."""


class SingularSteps(DependentRows, Steps):
    """What a scheme steps with beside and over singular configurations."""


class Balance(ContactForces, DependentRows):
    """Consistent accelerations and multipliers, or velocities and impulses, of the whole mechanism."""


class Switching(Results, Guards, Balance):
    """What happens at events: all but the memory of the scheme."""
