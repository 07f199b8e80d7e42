"""What machines hold at a start, with its derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mbd.equal import ROUND_OFF_RTOL
from mbd.sensitivity.motion import Mode, Motion
from mbd.sensitivity.programs import Programs

__all__ = ["stored_at_start"]


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
