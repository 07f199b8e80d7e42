"""Whole turns: which of the angles that give one pose is meant, chosen at a start and kept from then on."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from mbd.arrays import Vector
from mbd.assembly.pose import Posture
from mbd.compile.mechanism import Mechanism
from mbd.compile.python import ScalarFunction, scalar_function
from mbd.equal import EQUAL_RTOL
from mbd.state import State
from mbd.tape.derivatives import live


def whole_turns(angle: float) -> int:
    """How many turns an angle lies away from (−π, π]."""
    return math.ceil((angle - math.pi - EQUAL_RTOL) / (2.0 * math.pi))


def _function(mechanism: Mechanism) -> ScalarFunction:
    angles = [turn.angle for turn in mechanism.equations.turns]
    return mechanism.kept(_function, lambda: scalar_function(angles, mechanism.layout, "turns"))


def _angles(mechanism: Mechanism, time: float, q: Vector, parameters: Vector, anchors: Vector) -> Vector:
    """The angle of every `Turn`."""
    function = _function(mechanism)
    out = np.zeros(function.size)
    function(mechanism.block(time, q, np.zeros(mechanism.layout.n), anchors), parameters, out)
    return out


def hold_directions(mechanism: Mechanism, time: float, q: Vector, parameters: Vector, anchors: Vector) -> None:
    """Let the row of every joint that holds a direction ask for that pose, however many turns its bodies have made."""
    if not mechanism.equations.turns:
        return
    angles = _angles(mechanism, time, q, parameters, anchors)
    for turn, angle in zip(mechanism.equations.turns, angles, strict=True):
        if not turn.name:
            anchors[turn.anchor] -= turn.sign * whole_turns(float(angle))


def directed(mechanism: Mechanism, start: State) -> State:
    """The state in which the rows of joints that hold a direction ask for its pose, whoever turned its bodies."""
    if not mechanism.equations.turns:
        return start
    fits = len(start.anchors) == mechanism.layout.n_anchors
    given = start.anchors if fits else np.zeros(mechanism.layout.n_anchors)
    anchors = given.copy()
    hold_directions(mechanism, start.time, start.q, mechanism.parameters(), anchors)
    return start if np.array_equal(anchors, start.anchors) else replace(start, anchors=anchors)


def choose_turns(work: Posture, rows: Sequence[int]) -> None:
    """Whole turns from which a start is closed: named angles next to their values, others where `rows` ask for them.

    An angle that is neither named nor part of a row other than those of its joint is taken between −π and π.
    """
    turns = work.equations.turns
    if not turns:
        return
    targets = {condition.name: condition.target for condition in work.places}
    angles = _angles(work.mechanism, work.time, work.q, work.parameters, work.anchors)
    for turn, angle in zip(turns, angles, strict=True):
        off = float(angle) - targets.get(turn.name, 0.0)
        work.anchors[turn.anchor] -= turn.sign * whole_turns(off)
    free = [turn for turn in turns if turn.name and turn.name not in targets]
    asked = _in_rows(work, rows) if free else set()
    for turn in free:
        if turn.anchor in asked:
            h = _residuals(work, rows)
            work.anchors[turn.anchor] += 1.0
            slope = _residuals(work, rows) - h
            work.anchors[turn.anchor] -= 1.0
            weight = float(slope @ slope)
            if weight > 0.0 and np.isfinite(weight):
                work.anchors[turn.anchor] -= round(float(h @ slope) / weight)


def _in_rows(work: Posture, rows: Sequence[int]) -> set[int]:
    """Anchors that rows depend on."""
    inputs = live([work.equations.rows[k].value for k in rows])
    return {node.data[1] for node in inputs if node.op == "input" and node.data[0] == "anchor"}


def _residuals(work: Posture, rows: Sequence[int]) -> Vector:
    """Rows and named results."""
    terms = work.terms()
    picked = list(rows)
    return work.with_conditions(terms.h[picked], terms.B[picked][:, : work.equations.n_v], work.places)[0]


def keep_wrapped(work: Posture, q: Vector, anchors: Vector) -> None:
    """Let angles that only a rotation shows be next to what they are at `q`: they may have passed the end of a turn."""
    if work.equations.wrapped:
        before = _angles(work.mechanism, work.time, q, work.parameters, anchors)
        now = _angles(work.mechanism, work.time, work.q, work.parameters, work.anchors)
        for turn, old, new in zip(work.equations.turns, before, now, strict=True):
            if turn.rate is not None:
                work.anchors[turn.anchor] -= round(float(new - old) / (2.0 * math.pi))


def name_wrapped(work: Posture) -> None:
    """Turns of angles that only a rotation shows: next to their named values, else between −π and π."""
    if work.equations.wrapped:
        targets = {condition.name: condition.target for condition in work.places}
        angles = _angles(work.mechanism, work.time, work.q, work.parameters, work.anchors)
        for turn, angle in zip(work.equations.turns, angles, strict=True):
            if turn.rate is not None:
                work.anchors[turn.anchor] -= whole_turns(float(angle) - targets.get(turn.name, 0.0))


def nearest_turns(work: Posture, rows: Sequence[int], named: Mapping[int, float], tolerance: float) -> None:
    """Bring angles next to their named values, others next to their defaults, where the rows allow it in the same pose.

    Parameters
    ----------
    work : a posture that closes; its q and its whole turns are changed, not its pose
    named : coordinates that were named, by number
    tolerance : largest residual that the rows may have afterwards, and by which named results may be further off
    """
    if not work.mechanism.vector:
        return
    for k, coordinate in enumerate(work.equations.coordinates):
        wanted = named.get(k, coordinate.default)
        turns = whole_turns(float(work.q[k]) - wanted) if coordinate.unit == "rad" else 0
        if turns:
            q, anchors = work.q.copy(), work.anchors.copy()
            work.q[k] -= 2.0 * math.pi * turns
            _keep_angles(work, q, anchors)
            _keep_if_closed(work, rows, q, anchors, tolerance)
    targets = {condition.name: condition.target for condition in work.places}
    for number, turn in enumerate(work.equations.turns):
        angles = _angles(work.mechanism, work.time, work.q, work.parameters, work.anchors)
        turns = whole_turns(float(angles[number]) - targets.get(turn.name, 0.0))
        if turn.name and turns:
            anchors = work.anchors.copy()
            work.anchors[turn.anchor] -= turn.sign * turns
            _keep_if_closed(work, rows, work.q, anchors, tolerance)


def _keep_angles(work: Posture, q: Vector, anchors: Vector) -> None:
    """Let the angles of cut joints be what they are at `q`."""
    if not work.equations.turns:
        return
    before = _angles(work.mechanism, work.time, q, work.parameters, anchors)
    now = _angles(work.mechanism, work.time, work.q, work.parameters, work.anchors)
    for turn, old, new in zip(work.equations.turns, before, now, strict=True):
        work.anchors[turn.anchor] -= turn.sign * round(float(new - old) / (2.0 * math.pi))


def _keep_if_closed(work: Posture, rows: Sequence[int], q: Vector, anchors: Vector, tolerance: float) -> None:
    """Go back where a change of whole turns opens the mechanism, or moves a named result away from its value."""
    now = np.abs(_residuals(work, rows))
    changed = work.q, work.anchors.copy()
    work.q, work.anchors[:] = q, anchors
    bound = np.maximum(np.abs(_residuals(work, rows)) + tolerance, tolerance)
    bound[: len(rows)] = tolerance
    if np.all(now <= bound):
        work.q, work.anchors[:] = changed
