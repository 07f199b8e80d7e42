"""Many runs in one call: where each begins and ends, and what is noted of the present one."""

from __future__ import annotations

from mbd.kernel.records.declare import Integers, Reals, formula, integers, place, reals
from mbd.kernel.records.settings import SchemeAbilities


class Runs(SchemeAbilities):
    """Starts and ends, one line of numbers each; arrays of no length in a run alone."""

    calls: Reals = reals()  # what a call of the kernel may change about where it ends
    until: float = place("calls")
    end: float = place("calls")
    next_jump: float = place("calls")  # when the equations jump next; NaN: they do not
    last_time: float = place("calls")  # of the run, or the runs
    near_end: float = place("calls")  # two instants nearer than this are one there [s]
    before_time: float = place("calls")  # that `closed_before` belongs to
    limits: Integers = integers()
    chunk: int = place("limits")  # steps before control returns
    chunk_of_runs: int = place("limits")  # the same, for runs that are not at their last step
    steps_left: int = place("limits")  # before Python looks whether somebody wants to interrupt
    many: int = place("limits")  # 1: a call takes runs, one after the other; 2: it judges a start
    run: int = place("limits")  # the present one
    n_runs: int = place("limits")
    begun: int = place("limits")  # 1: it has begun
    n_parameters: int = place("limits")  # that each run has of its own
    n_whole_reals: int = place("limits")
    n_whole_integers: int = place("limits")
    n_counts: int = place("limits")
    max_lines: int = place("limits")  # of the log that are kept of each run
    n_lines: int = place("limits")  # that were
    n_seen: int = place("limits")  # events of the present run
    stopped_by: int = place("limits")  # flag of the event that ended it, −1: none
    sequence: int = place("limits")  # a number that follows from which events came in which order
    whole_reals: Reals = reals(lambda s: 0)  # all that the next step depends on, side by side
    whole_integers: Integers = integers(lambda s: 0)
    fresh_reals: Reals = reals(lambda s: 0)  # the same before any run
    fresh_integers: Integers = integers(lambda s: 0)
    noted_reals: Reals = reals(lambda s: 0)  # and before a step that may be the last
    noted_integers: Integers = integers(lambda s: 0)
    noted_counts: Integers = integers(lambda s: 0)
    starts: Reals = reals(lambda s: 0)  # t, q, (v, z), anchors, closed, armed of each run
    ends: Reals = reals(lambda s: 0)  # see `mbd.kernel.stepping.many_runs.note_end`
    given_parameters: Reals = reals(lambda s: 0)  # of each run
    lines: Reals = reals(lambda s: 0)  # of the log, the first ones of each run
    resets: Integers = integers(lambda s: s.n_guards)  # 1: what resets the state after this event comes after the run
    closed_now: Integers = integers(lambda s: s.n_contacts)  # after the events seen so far
    closed_before: Integers = integers(lambda s: s.n_contacts)  # before those of the last instant among them

    start_width: int = formula(lambda s: 1 + s.n_q + s.n + s.n_anchors + 2 * s.n_contacts)  # of a line of `starts`
    end_row: int = formula(lambda s: 7)  # where the row of results begins in one of `ends`
    end_width: int = formula(lambda s: s.end_row + s.width + 2 * s.n_contacts + s.n_anchors)
