"""Contacts, frictions, and the guards and events by which they change."""

from __future__ import annotations

from mbd.kernel.records.declare import Integers, Reals, formula, integers, place, reals
from mbd.kernel.records.settings import SchemeAbilities
from mbd.kernel.records.state import Model, Motion


class Contacts(SchemeAbilities):
    """Contacts: their rules and what is known of each."""

    kind: Integers = integers()  # 0 unilateral, 1 penalty
    opens: Integers = integers()  # 0 on pull, 1 on gap, 2 by When
    normal: Integers = integers()  # normal row
    when: Integers = integers()  # twice the contacts that open each, + 1 where they do after the impact
    watched_by: Integers = integers()  # the contact while which is closed each is watched, `ALWAYS` or `BY_MEASURE`
    anchor_start: Integers = integers()
    restitution: Reals = reals()
    impulse_contact: Integers = integers()  # whose closing an impulse of the user waits for
    impulse_order: Integers = integers()  # 0 before its impact, 1 with it, 2 after it
    pushes: Reals = reals(lambda s: s.n_impulses * s.n_v)  # w P of each
    pushed_from: Reals = reals(lambda s: s.n)  # velocities before them
    pushed_closing: Integers = integers(lambda s: s.n_contacts)  # who closes in the impact beside them
    closed: Integers = integers(lambda s: s.n_contacts, kept=True)
    armed: Integers = integers(lambda s: s.n_contacts, kept=True)
    touched: Integers = integers(lambda s: s.n_contacts, kept=True)
    active: Integers = integers(lambda s: s.n_contacts + s.n_guards + s.n_frictions)
    free: Integers = integers(lambda s: s.n_contacts)
    closing: Integers = integers(lambda s: s.n_contacts)
    parting: Integers = integers(lambda s: s.n_contacts)
    closing_gap: Reals = reals(lambda s: s.n_contacts)  # the lowest at which each has closed, −1e300 for one not known
    lifting: Integers = integers(lambda s: s.n_rows)  # 1: a row that is left out of the correction of positions
    deepest: Reals = reals(lambda s: s.n_contacts, kept=True)  # lowest gap while ignored
    sinking: Reals = reals(lambda s: s.n_contacts, kept=True)  # time of the first release into the surface
    contact_step: Reals = reals(lambda s: s.n_contacts, kept=True)  # while a penalty contact acts, 0: not found yet
    closing_rate: Reals = reals(lambda s: s.n_contacts, kept=True)  # |γ| as it closed
    largest_rate: Reals = reals(lambda s: s.n_contacts, kept=True)  # in the present window of steps
    contact_steps: Reals = reals(lambda s: s.n_contacts, kept=True)
    least_contact_step: Reals = reals(lambda s: s.n_contacts, kept=True)  # ever
    plastic_impact: int = place("state")  # 1: without restitution


class Frictions(Contacts):
    """Frictions: their rows and what each does."""

    friction_row: Integers = integers()
    friction_contact: Integers = integers()
    leader: Integers = integers()  # the first of those that slide together, itself where it is alone
    group_size: Integers = integers()  # how many they are: 2 of a contact in space, 3 of a ball joint
    sticks: Integers = integers(lambda s: s.n_frictions, kept=True)
    loose: Integers = integers(lambda s: s.n_frictions, kept=True)
    was: Integers = integers(lambda s: s.n_frictions, kept=True)  # at the last restart: 0 off, 2 sticking, ±1 sliding
    let_go: Integers = integers(lambda s: s.n_frictions)  # 1: a friction that has let go for the step being tried
    slip: Reals = reals(lambda s: s.n_frictions, kept=True)  # sign of sliding; of a group the cosines of its direction
    hold: Reals = reals(lambda s: s.n_frictions, kept=True)  # how much of these counts: see `mbd.kernel.contact.cones`
    own_hold: Reals = reals(lambda s: s.n_frictions)  # the same of a step whose directions are found by continuation
    lean: Reals = reals(lambda s: s.n_frictions, kept=True)  # the direction in which each slid last
    across: Reals = reals(lambda s: s.n_frictions)  # γ left across directions that are held, over ‖γ‖ before the step
    limit: Reals = reals(lambda s: s.n_frictions)  # largest friction
    base_limit: Reals = reals(lambda s: s.n_frictions)  # the same at zero multipliers


class Events(SchemeAbilities):
    """Guards and the instants at which they fire."""

    guards0: Reals = reals(lambda s: s.n_watched, kept=True)  # at the accepted state
    guards1: Reals = reals(lambda s: s.n_watched)  # at the candidate
    side: Reals = reals(lambda s: s.n_guards, kept=True)  # sign of each user guard since it last crossed
    passing: Integers = integers(lambda s: s.n_guards, kept=True)  # 1: crosses at this instant; 2: has its event next
    met: Reals = reals(lambda s: 2 * s.n_guards, kept=True)  # values and rates of these before the event did anything
    direction: Integers = integers()
    machine_start: Integers = integers()  # anchor that holds the number of the state of each machine
    guard_machine: Integers = integers()  # of the transition that a guard is, −1 for an event alone
    guard_source: Integers = integers()  # the state that it leaves
    guard_target: Integers = integers()  # and enters
    guard_fires: Integers = integers()  # 1: it happens as its guard crosses zero, 0: as something else happens
    guard_timed: Integers = integers()  # 1: by after=, + 2: without condition, + 4: a step ends at its instant
    guard_kink: Integers = integers()  # 1: a step ends at it, and nothing tells of it
    guard_contact: Integers = integers()  # that must be closed for it, −1 for none
    causes: Integers = integers()  # of each transition, a list of marks that make it happen
    releases: Integers = integers()  # of each contact, a list of transitions that open it
    stores: Integers = integers()  # of each transition, a list of anchors that are stored with it
    happened: Integers = integers(lambda s: s.n_marks, kept=True)  # contacts closed, opened, guards crossed, taken
    fresh: Integers = integers(lambda s: s.n_guards, kept=True)  # 1: its side follows from where it is after a restart
    taken: Integers = integers(lambda s: s.n_machines)  # the transition that each machine takes
    n_rounds: int = place("state")  # of transitions at this instant
    chain_time: float = place("clock")  # which it is
    due_time: float = place("clock")  # the next instant of a timer
    due_guard: int = place("state")  # whose it is, −1 for none
    notify: Integers = integers(lambda s: s.n_contacts + s.n_guards + s.n_frictions)
    crossed: Reals = reals(lambda s: s.n_guards)  # from the start of the step to an event without a restart, or < 0
    doubt: Reals = reals(lambda s: 2 * s.n_watched + 2 * s.n)  # guards, then round-off of positions and velocities
    inside: Reals = reals(lambda s: 2 * s.n_watched + 2 * s.n_rows + s.n_q + 2 * s.n)  # what substeps began from
    event_place: float = place("detail")  # estimated distance of the event that fired first, part of the step
    event_low: float = place("detail")  # the lower end of its bracket
    changes_little: float = place(
        "detail"
    )  # 1: rates of the candidate change so little or evenly that no closer look is needed
    event_after: float = place("detail")  # its distance from the start of the step [s]
    event_kind: int = place("state")  # −1: none
    event_index: int = place("state")
    looks_ahead: int = place("state")  # 1: forces now do not tell which contacts push and stick
    time_ahead: float = place("clock")  # instant of forces that do [s]
    q_ahead: Reals = reals(lambda s: s.n_q, kept=True)  # coordinates then
    y_ahead: Reals = reals(lambda s: s.n, kept=True)
    seen: Reals = reals(  # who was closed, stuck, … at an earlier switch of this instant, and the state
        lambda s: 1 + 2 * s.n_contacts + 2 * s.n_frictions + s.n_guards + s.n_q + s.n, kept=True
    )
    seen_at: float = place("seen")  # at which one, 0 for none
    n_switches: int = place("state")  # at this instant
    last_switch: float = place("clock")
    in_substeps: int = place("state")  # 1: within a step that is taken in substeps
    substep: float = place("clock")  # the size of such a step
    turning_step: float = place("clock")  # in which friction turns a motion that has begun to slide; 0: not looked at
    begun_step: float = place("clock")  # the last of short steps from where sliding began; 0: none
    crowding: float = place("clock")  # how much located impacts crowd
    crowding_time: float = place("clock")  # when that was counted last
    fallback: int = place("state")  # 1: non-smooth steps followed as impacts crowded, 2: as locating could not go on
    fallback_time: float = place("clock")  # since when
    restarted_here: int = place("state")  # 1: at the accepted state, as a contact seemed to pull in the step

    inside_q: int = formula(lambda s: 2 * s.n_watched + 2 * s.n_rows)  # where q, (v, z), rates of the candidate begin
    inside_y: int = formula(lambda s: s.inside_q + s.n_q)
    inside_rate: int = formula(lambda s: s.inside_y + s.n)
    doubt_x: int = formula(lambda s: 2 * s.n_watched)  # where round-off of positions begins in `doubt`, of velocities
    doubt_v: int = formula(lambda s: s.doubt_x + s.n_v)


class ContactRows(Frictions, Model):
    """Contacts and frictions, with what the model says of their rows."""


class Mechanism(ContactRows, Motion):
    """All that model code is evaluated at: the motion, and which contacts and frictions act."""


class Guards(Events, Mechanism):
    """What is watched, at the state at which it is watched."""
