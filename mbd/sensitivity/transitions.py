"""Machines that change at an event: what they hold from then on, with its derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mbd.equal import ROUND_OFF_RTOL
from mbd.results.record import EventRecord
from mbd.sensitivity.motion import Mode, Motion
from mbd.sensitivity.programs import Programs

__all__ = ["stored_at_start", "with_transitions"]


def with_transitions(programs: Programs, motion: Motion, mode: Mode, events: Sequence[EventRecord]) -> Motion:
    """The motion with what machines store by the transitions among some events, in their order.

    What is stored, the instant among it, changes with the motion; the number of a state does not.
    """
    equations = programs.equations
    guards = {guard.name: guard.transition for guard in equations.guards if guard.transition is not None}
    order = [anchor for machine in equations.machines for anchor in machine.anchors]
    zero = np.zeros(programs.columns.n), np.zeros(programs.columns.rows)
    for event in events:
        taken = guards.get(event.name) if event.kind == "event" else None
        if taken is None:
            continue
        values, slopes = programs.stored(motion.at(mode, *zero))
        places, lines = list(taken.stored), [order.index(anchor) for anchor in taken.stored]
        anchors, of_anchors = motion.anchors.copy(), motion.tangent.anchors.copy()
        anchors[places] = values[lines]
        of_anchors[places] = slopes[lines] @ motion.tangent.stacked(programs.columns)
        state = equations.machines[taken.machine].anchors[0]
        anchors[state], of_anchors[state] = float(taken.target), 0.0
        motion = replace(motion, anchors=anchors).with_tangent(anchors=of_anchors)
    return motion


def stored_at_start(programs: Programs, motion: Motion, mode: Mode) -> Motion:
    """The motion at a start with derivatives of what machines have stored there; what they hold of before stays."""
    machines = programs.equations.machines
    if not machines:
        return motion
    zero = np.zeros(programs.columns.n), np.zeros(programs.columns.rows)
    before, first = motion.anchors.copy(), [anchor for machine in machines for anchor in machine.first]
    for machine in machines:
        before[list(machine.anchors)] = machine.initial
        before[list(machine.times)] = motion.t
    values, slopes = programs.stored(replace(motion, anchors=before).at(mode, *zero))
    of_anchors = motion.tangent.anchors.copy()
    apart = np.abs(values[first] - motion.anchors[first])
    fresh = np.array(first, dtype=int)[apart <= ROUND_OFF_RTOL * np.maximum(1.0, np.abs(values[first]))]
    of_anchors[fresh] = slopes[fresh] @ motion.tangent.stacked(programs.columns)
    return motion.with_tangent(anchors=of_anchors)
