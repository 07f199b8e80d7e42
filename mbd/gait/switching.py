"""From a period doubling onto the branch of gaits of twice the period.

A gait of two periods beside the doubling passes the states ``s ± ε d`` in turn:

    ½ (F(s + ε d, p) + F(s − ε d, p)) = s,   (F(s + ε d, p) − F(s − ε d, p))/(2 ε) = −d,   φᵀ d = 1

with φ the mode of the multiplier −1 at the doubling. At ε = 0 these are the equations of the doubling itself, whose
Jacobian is regular, so that Newton's method leads from it to every small ε, while that of ``F(F(c, p), p) = c`` is
singular there.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.errors import GaitError, SimulationError
from mbd.gait.continuation import BranchPoint, Continuation
from mbd.gait.cycle import LimitCycle
from mbd.gait.map_derivative import Measured, measured
from mbd.gait.search import Search, search

AMPLITUDE, FALL, TIMES = 0.02, 0.4, 9
"""Distance from the doubling along its mode at which the other branch is looked for first [-], its factor where that
leads too far, and how often. In a cascade of doublings each leads less far than the one before by about this factor."""
NEAR = (0.0, 2.0)
"""Bounds of the multiplier that is 1 at the doubling, within which a gait of two periods is taken as near to it [-]."""
CORRECTIONS, FINE = 12, 1e-10
"""Newton corrections of a gait of two periods, and the residual at which they end [m, rad]."""


def doubled(given: Continuation, special: Any, base: Any) -> LimitCycle:
    """The gait of two periods beside a doubling.

    The amplitude falls until the gait is near the doubling: so far from it that its multiplier, 1 there, is still above
    0. Where that is never so the first gait that was found is taken.

    Raises
    ------
    GaitError
        where none is found.
    """
    point: BranchPoint = special.point
    critical = int(np.argmin(np.abs(point.multipliers.values + 1.0)))
    mode = np.real(point.multipliers.modes[:, critical])
    mode = mode / np.linalg.norm(mode)
    twice = replace(given.map, strides=2 * given.map.strides)
    first: LimitCycle | None = None
    level = np.log2(given.map.strides)
    for amplitude in AMPLITUDE * FALL ** (level + np.arange(TIMES)):
        pair = _pair(given, point, mode, amplitude)
        if pair is None:
            continue
        start, value = pair
        values = given.with_value(value)
        state = point.chart.at(start, given.map.vector(values))
        found = search(Search(twice, given.section, given.tol, given.member_at(value)), state, values)
        if not found.success or not _is_doubled(given, found, amplitude):
            continue
        along = np.abs(mode @ (point.chart.basis.T @ (found.chart.basis @ found.stability_of.modes)))
        nearest = found.multipliers[int(np.argmax(along))] if len(along) else np.nan
        if NEAR[0] < nearest.real < NEAR[1]:
            return found
        first = first or found
    if first is None:
        raise GaitError(f"no gait of two periods was found beside {special!r}", base)
    return first


def _pair(given: Continuation, point: BranchPoint, mode: Vector, amplitude: float) -> tuple[Vector, float] | None:
    """(s + ε d, p) of the gait of two periods; None where Newton's method does not lead to one."""
    size, s, d, value = len(mode), np.zeros(len(mode)), mode.copy(), point.value
    before = np.inf
    for _ in range(CORRECTIONS):
        values = given.with_value(value)
        try:
            ends = [measured(given.map, point.chart, s + sign * amplitude * d, values) for sign in (1.0, -1.0)]
        except SimulationError:
            return None
        one, other = ends
        if given.map.faults(values) or not isinstance(one, Measured) or not isinstance(other, Measured):
            return None
        here = given.member_gap(point.chart, s, one, value)
        rest: list[Any] = [
            0.5 * (one.c + other.c) - s + here,
            (one.c - other.c) / (2.0 * amplitude) + d,
            [mode @ d - 1.0],
        ]
        gap = np.concatenate(rest)
        left = float(max(np.max(np.abs(rest[0])), amplitude * np.max(np.abs(rest[1]))))
        if left <= FINE:
            return s + amplitude * d, value
        if left > 4.0 * before:
            return None
        before = min(before, left)
        found = [_slope(given, point, s + sign * amplitude * d, value, end)
                 for sign, end in ((1.0, one), (-1.0, other))]  # fmt: skip
        if found[0] is None or found[1] is None:
            return None
        slopes, member = (found[0][0], found[1][0]), found[0][1]
        mean, change = 0.5 * (slopes[0] + slopes[1]), 0.5 * (slopes[0] - slopes[1])
        P, bend = mean[:, :size], change[:, :size]
        matrix = np.block([
            [P - np.eye(size) + member[:, :size], amplitude * bend, mean[:, size:] + member[:, size:]],
            [bend / amplitude, P + np.eye(size), change[:, size:] / amplitude],
            [np.zeros((1, size)), mode[np.newaxis], np.zeros((1, 1))],
        ])  # fmt: skip
        step = np.linalg.lstsq(matrix, gap, rcond=None)[0]
        s, d, value = s - step[:size], d - step[size : 2 * size], value - given.width * float(step[-1])
    return None


def _slope(
    given: Continuation, point: BranchPoint, c: Vector, value: float, base: Measured
) -> tuple[Matrix, Matrix] | None:  # fmt: skip
    """[P, σ F_p] at a state beside the doubling, and what picks the member; None where derivatives are missing."""
    try:
        found = given.derived(point.chart, c, given.with_value(value), 2, base)
    except SimulationError:
        return None
    size = point.chart.size
    matrix = found.matrix[:size].copy()
    matrix[:, size] *= given.width
    return None if found.missing else (matrix, given.member_part(point.chart, base, found, value))


def _is_doubled(given: Continuation, found: LimitCycle, amplitude: float) -> bool:
    """Whether the two halves of a gait of two periods differ."""
    once = measured(given.map, found.chart, np.zeros(found.chart.size), found.parameters)
    return isinstance(once, Measured) and float(np.linalg.norm(once.c)) > 0.4 * amplitude
