"""What machines hold at a start, with its derivatives."""

from dataclasses import replace

import numpy as np

from mbd.equal import ROUND_OFF_RTOL
from mbd.sensitivity.motion import Mode, Motion
from mbd.sensitivity.programs import Programs


def stored_at_start(programs: Programs, motion: Motion, mode: Mode) -> Motion:
    """The motion at a start with derivatives of what machines have stored there; what they hold of before stays."""
    machines = programs.equations.machines
    if not machines:
        return motion
    zero = np.zeros(programs.columns.n), np.zeros(programs.columns.rows)
    before, of_before = motion.anchors.copy(), motion.tangent.anchors.copy()
    columns = {place: k for k, place in enumerate(programs.places)}
    for machine in machines:
        before[list(machine.anchors[1:])] = machine.initial_at(programs.values)[1:]
        before[list(machine.times)] = motion.t
        for turn, number in machine.own:
            if number in columns:
                of_before[machine.anchors[turn]] = motion.tangent.p[columns[number]]
    of_anchors = motion.tangent.anchors.copy()
    for machine in machines:  # each knows what those before it have stored
        first, all_, own = list(machine.first), list(machine.anchors[1:]), [machine.anchors[k] for k, _ in machine.own]
        values, slopes = programs.stored(replace(motion, anchors=before).at(mode, *zero))
        found = slopes @ motion.with_tangent(anchors=of_before).tangent.stacked(programs.columns)
        before[first], of_before[first] = values[first], found[first]
        fresh = np.abs(before - motion.anchors) <= ROUND_OFF_RTOL * np.maximum(1.0, np.abs(before))
        if np.all(fresh[all_]):  # it begins here
            of_anchors[own] = of_before[own]
        stored = [anchor for anchor in first if fresh[anchor]]
        of_anchors[stored] = found[stored]
    return motion.with_tangent(anchors=of_anchors)
