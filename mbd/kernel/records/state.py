"""The model, the state, and what schemes remember of the steps before."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mbd.kernel.records.declare import Integers, Reals, formula, integers, place, reals
from mbd.kernel.records.settings import SchemeAbilities

PROGRAMS = 6
"""Programs of a mode: tangent, residual, correction and solution; 0 stands for the last two where there are none."""
MODE_CAPACITY = 16
"""Modes for which a table is laid out at the start; it doubles as it fills."""


class Model(SchemeAbilities):
    """What model code reads and writes."""

    code: Sequence[Any]  # functions: see the numbers in `mbd.kernel.codes`; those of modes follow
    params: Reals = reals()
    block: Reals = reals(lambda s: s.n_block)
    block_time: float = place("block")
    block_c_C: float = place("block")
    block_c_K: float = place("block")
    out: Reals = reals()  # of the function called last
    acc: Reals = reals()  # of the accelerations program
    scale: Reals = reals(lambda s: s.n + 2 * s.n_rows, kept=True)  # magnitudes of r, h, ḣ term by term
    known: Reals = reals(lambda s: s.n + 2 * s.n_rows)  # the same before they were raised at an iterate
    weight: Reals = reals(lambda s: s.n, kept=True)  # the inverse of those of r
    blurs: Reals = reals()
    blur: float = place("blurs")  # part of the forces up to which friction in a plane is known in a step
    typical: Reals = reals(lambda s: s.n)  # of velocities or accelerations without rows, or of each cluster
    row_contact: Integers = integers()  # contact of each row
    row_trivial: Integers = integers()  # 1: a row that holds whatever the motion, and never acts
    row_level: Integers = integers()  # of each row: 0 holds positions, 1 velocities only
    row_friction: Integers = integers()  # friction of each row that holds only while it sticks, −1 otherwise
    row_unit: Integers = integers()  # 0 [m], 1 [rad], 2 other, of each row
    unit: Integers = integers()  # unit block of each balance component
    cluster: Integers = integers(lambda s: s.n + s.n_rows)  # number of the cluster of each balance component, row
    turned_by: Integers = integers(lambda s: s.n_v)  # from 1: the joint in charts that each velocity turns, 0: none
    chart: Reals = reals()  # what programs of charts are called with
    chart_end: Reals = reals(lambda s: 3 * s.n_v)  # x, ẋ and ẍ of the candidate in the chart of the step
    chart_motion: Reals = reals(lambda s: 2 * s.n_v)  # v and v̇ of the interpolant
    n_known: int = place("limits")  # modes with code, of which those that the run has met come first
    n_modes: int = place("limits")  # how many these are
    mode_key: Integers = integers(lambda s: MODE_CAPACITY * (s.n_contacts + s.n_rows + s.n_frictions))  # of each
    mode_code: Integers = integers(lambda s: PROGRAMS * MODE_CAPACITY)
    mode_order: Integers = integers(lambda s: MODE_CAPACITY)  # where the order of elimination begins, 0 for none
    orders: Integers = integers(lambda s: 1)  # all of them
    mode_id: int = place("state")  # the present mode, −1: not known yet
    order_start: int = place("state")  # where the order of the factors in kkt begins, 0 if pivots were searched for
    scales_raised: int = place("state")  # 1: magnitudes were raised far above those of the accepted state
    scales_of_start: int = place("state")  # 1: magnitudes are those of a start, which no step has confirmed
    uneven_masses: int = place("state")  # 1: they differ so much that small residuals do not tell small errors

    tangent_program: int = formula(lambda s: s.mode_code[6 * s.mode_id])  # its number in `code`, of the present mode
    residual_program: int = formula(lambda s: s.mode_code[6 * s.mode_id + 1])
    correction_program: int = formula(lambda s: s.mode_code[6 * s.mode_id + 2])  # the first one, in straight-line code
    solution_program: int = formula(lambda s: s.mode_code[6 * s.mode_id + 3])  # with the factors of that
    rates_program: int = formula(lambda s: s.mode_code[6 * s.mode_id + 4])  # accelerations and multipliers from K.acc
    returns_program: int = formula(lambda s: s.mode_code[6 * s.mode_id + 5])  # corrections onto the rows from K.acc


class State(SchemeAbilities):
    """The accepted state, the candidate of the step under judgement, and the grid of steps."""

    time: float = place("clock")
    clock: Reals = reals(kept=True)
    q: Reals = reals(lambda s: s.n_q, kept=True)
    y: Reals = reals(lambda s: s.n, kept=True)  # (v, z)
    rate: Reals = reals(lambda s: s.n, kept=True)
    lam: Reals = reals(lambda s: s.n_rows, kept=True)
    anchors: Reals = reals(lambda s: s.n_anchors, kept=True)
    peak: Reals = reals(lambda s: s.n, kept=True)  # largest of each rate in the steps just before
    fastest: Reals = reals(lambda s: s.n)  # the largest of the candidate in each cluster
    damping: Reals = reals(lambda s: s.n)  # of what a step has not predicted, in each cluster
    largest: Reals = reals(lambda s: s.n - s.n_v, kept=True)  # size of each first-order state so far, adaptive only
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
    misfit: float = place("clock")  # largest value of rows that depend on others at the last candidate [m, rad]
    extent: float = place(
        "clock"
    )  # length of the mechanism, as far as it is known: see `mbd.kernel.stepping.scales` [m]
    turned: float = place("clock")  # way of joints whose coordinates do not add since the last row [rad]
    part_turn: float = place("clock")  # largest way of these in a step, where more has failed, 0: a quarter turn [rad]
    estimates_twice: int = place("state")  # 1: no step was taken since a start or an error that was too large
    halvings: int = place("state")  # how often the step is halved
    halves_left: int = place("state")  # of it
    paired_step: int = place("state")  # see `mbd.kernel.singular.step_pairs`
    short_steps: int = place("state")  # twice the shortened steps, less the full ones since


class Memory(SchemeAbilities):
    """What schemes remember from step to step, and what they work on."""

    aux: Reals = reals(lambda s: s.n, kept=True)
    slope: Reals = reals(lambda s: s.n, kept=True)
    lam_slope: Reals = reals(lambda s: s.n_rows, kept=True)
    shift: Reals = reals(lambda s: s.n, kept=True)  # position correction of the last step
    shift_change: Reals = reals(lambda s: s.n, kept=True)
    aux_step: float = place("clock")  # step size of aux
    turning: Reals = reals(lambda s: s.n_rows * s.n)  # ∂ḣ/∂x of the active rows, stabilized only
    stages: Reals = reals(lambda s: 0)  # what a scheme of several stages works on
    coupled: Reals = reals(lambda s: 0)  # matrix of all stages at once, its right-hand side, and pivots
    coupled_rhs: Reals = reals(lambda s: 0)
    coupled_pivots: Integers = integers(lambda s: 0)
    past_stages: Reals = reals(lambda s: 0, kept=True)  # those of the last step, which predict the next
    tableau: Reals = reals(lambda s: 0)  # coefficients of its formula
    error: Reals = reals(lambda s: s.n_v + s.n)  # local error of the candidate: of positions x, then of (v, z)
    local_error: float = place("clock")  # of the step that the candidate took
    error_sum: float = place("clock")


class Motion(State, Model):
    """The model at the accepted state and at the candidate."""
