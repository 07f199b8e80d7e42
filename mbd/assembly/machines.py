"""What machines hold at a start."""

from __future__ import annotations

import numpy as np

from mbd.arrays import Vector
from mbd.compile.mechanism import Mechanism

__all__ = ["first_anchors", "store_first"]


def first_anchors(mechanism: Mechanism) -> Vector:
    """Anchors of which machines hold what they do before a start, and zeros elsewhere."""
    anchors = np.zeros(mechanism.layout.n_anchors)
    for machine in mechanism.equations.machines:
        anchors[list(machine.anchors)] = machine.initial
    return anchors


def store_first(mechanism: Mechanism, time: float, q: Vector, y: Vector, parameters: Vector, anchors: Vector) -> None:
    """Store into anchors what machines store at a start; the states that they are in stay."""
    machines = mechanism.equations.machines
    if not machines:
        return
    captured = mechanism.acceleration_terms(time, q, y, parameters, anchors).captured
    for machine in machines:
        anchors[list(machine.first)] = captured[list(machine.first)]
