"""Friction in a plane in space: opposite to the velocity γ while a contact slides, until γ is 0 (`mbd.kernel.cones`).

While it slides ``λ_T = limit γ/‖γ‖`` with its exact tangent. In the step that ends with γ = 0 the run holds one
direction e, which is such that γ is zero at its end: e and the size of the step follow from ``γ(h, e) = 0``, two
equations whose derivatives are those of both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.equations.equations import Equations
from mbd.kernel.cones import HELD, MOVING
from mbd.results.record import EventRecord
from mbd.results.stored_states import StoredStates
from mbd.sensitivity.held_directions import Way, along_ways, first_of_pair
from mbd.sensitivity.motion import Mode, Motion, Rates
from mbd.sensitivity.programs import Programs, paired
from mbd.sensitivity.run_data import RunRows, unknown
from mbd.sensitivity.schemes import Memory, SchemeSteps, is_at

__all__ = [
    "ended_in_rest", "force_in_plane", "held_rows", "rests",
]  # fmt: skip

MOST = 8
"""Newton iterations for a direction that is held [-]."""
ALONG = 1e-7
"""Sine of the angle between a force and a velocity that is none [-]."""
AT_REST = 1e-14
"""Speed across that direction, over the speed with which the step begins, that is none [-]."""


def force_in_plane(programs: Programs, f: int, values: Vector, slopes: Matrix) -> tuple[float, Vector]:
    """λ_T of friction f while it slides, and its derivatives (D,), from what is watched."""
    equations = programs.equations
    n_c, n_g, n_f = len(equations.contacts), len(equations.guards), len(equations.frictions)
    speeds, limit = 2 * n_c + n_g, 2 * n_c + n_g + n_f + f
    own, other = speeds + f, speeds + equations.frictions[f].partner
    size = float(np.hypot(values[own], values[other])) or 1.0
    cosine = float(values[own]) / size
    turned = (slopes[own] - cosine * (values[own] * slopes[own] + values[other] * slopes[other]) / size) / size
    return float(values[limit]) * cosine, np.asarray(cosine * slopes[limit] + values[limit] * turned)


def rests(equations: Equations, events: Sequence[EventRecord], mode: Mode) -> int:
    """The first direction of the friction in a plane that comes to rest in these events; −1 if none does."""
    if any(event.kind not in ("stuck", "slipped") for event in events):
        return -1
    stuck = {event.name for event in events if event.kind == "stuck"}
    found = [f for f in paired(equations) if equations.frictions[f].name in stuck and mode.slip[f] != 0.0]
    return first_of_pair(equations, found[0]) if found else -1


def ended_in_rest(
    steps: SchemeSteps, motion: Motion, memory: Memory, mode: Mode, row: int, f: int
) -> tuple[Motion, Rates]:
    """The step to a row at which friction f comes to rest, with its derivatives at its own end.

    Raises
    ------
    CapabilityError
        for a row that is not the end of such a step, and where γ does not pass zero.
    """
    programs, time = steps.programs, float(steps.rows.ends[row])
    equations = programs.equations
    places = [2 * len(equations.contacts) + len(equations.guards) + k for k in (f, equations.frictions[f].partner)]
    begun, _ = programs.watched(motion.at(mode, memory.rates.rate, memory.rates.lam))
    speed = float(np.hypot(*begun[places]))
    e = begun[places] / (speed or 1.0)
    wide = replace(motion, tangent=motion.tangent.widened().widened())
    dh = np.zeros(len(wide.tangent.t))
    dh[-2] = 1.0
    for _ in range(MOST):
        end, rates, held = _held(steps, wide, memory.widened().widened(), mode, (f, e), time, dh, row)
        values, slopes = programs.watched(end.at(held, rates.rate, rates.lam))
        change = slopes[places] @ end.tangent.stacked(programs.columns)
        left, by_angle = (e[0] * each[1] - e[1] * each[0] for each in (values[places], change[:, -1]))
        if abs(left) <= AT_REST * speed or by_angle == 0.0:
            break
        angle = -float(left / by_angle)
        e = np.array([e[0] - angle * e[1], e[1] + angle * e[0]])
        e /= np.hypot(*e)
    matrix = change[:, -2:]
    name = equations.frictions[f].name
    if not is_at(steps.rows, end, row) or not abs(np.linalg.det(matrix)) > 0.0:
        raise unknown(f"how {name!r} comes to rest at t = {time:.9g} s is not known to the pass")
    along = -np.linalg.solve(matrix, change[:, :-2])
    turned = end.tangent.combined(np.append(along[1], 0.0)).combined(along[0])
    of_rate, of_lam = (
        each[:, :-2] + each[:, -1:] * along[1] + each[:, -2:-1] * along[0] for each in (rates.of_rate, rates.of_lam)
    )
    return replace(end, tangent=replace(turned, slips=None)), replace(rates, of_rate=of_rate, of_lam=of_lam)


def _held(
    steps: SchemeSteps, wide: Motion, memory: Memory, mode: Mode, way: tuple[int, Vector], time: float, dh: Vector,
    row: int,
) -> tuple[Motion, Rates, Mode]:  # fmt: skip
    """The end of a step in which friction f slides along e, whose turn is the last direction."""
    f, e = way
    turn = np.zeros((2, len(dh)))
    turn[:, -1] = -e[1], e[0]
    held, begun = along_ways(steps.programs, wide, mode, {f: Way(e, turn)}, HELD)
    end, rates = next(steps.reached(begun, memory, held, time, dh, row))
    return end, rates, held


def held_rows(rows: RunRows) -> NDArray[np.intp]:
    """Rows at whose end a step held the direction in which it began, without coming to rest.

    Their force is not that of their velocity.

    Raises
    ------
    CapabilityError
        where it is not that of the row before either.
    """
    record, equations = rows.record, rows.mechanism.equations
    pairs = [f for f in paired(equations) if first_of_pair(equations, f) == f]
    found = np.zeros(len(record.time), dtype=bool)
    if not pairs:
        return np.flatnonzero(found)
    states, ends = StoredStates(record, equations), found.copy()
    ends[[row - 1 for row in rows.events if row > 0]] = True
    for f in pairs:
        both = f, equations.frictions[f].partner
        x, y = states.evaluate([equations.frictions[k].rate for k in both], states.rows)
        a, b = record.lam[:, [equations.frictions[k].row for k in both]].T
        speed, pull = np.hypot(x, y), np.hypot(a, b)
        off = np.abs(x * b - y * a) > ALONG * speed * pull
        off[0] = False
        off[1:] &= speed[:-1] >= MOVING  # slower at the start of a step, it does not follow γ yet
        own = off & (np.abs(record.phase[:, f]) == 1) & ~ends
        before = np.zeros(len(x), dtype=bool)
        before[1:] = np.abs(x[:-1] * b[1:] - y[:-1] * a[1:]) <= ALONG * speed[:-1] * pull[1:]
        if np.any(own & ~before):
            time = record.time[np.flatnonzero(own & ~before)[0]]
            raise unknown(
                f"which way {equations.frictions[f].name!r} slides at t = {time:.9g} s is not known to the pass"
            )
        found |= own
    return np.flatnonzero(found)
