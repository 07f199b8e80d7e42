"""Starts and ends at which a run has derivatives on one side only: the refusal, with the values of both sides.

What begins at rest and slides at once slides the other way first where its velocity is changed against it; what sticks
by all the friction that it can have slides where it needs more; an event whose guard is zero at the start, or at the
end, happens within the run on one side of it and not on the other.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.assembly.projection import project
from mbd.bodies.values import is_number
from mbd.equal import EQUAL_RTOL, INSTANT_RTOL, NOMINAL_RTOL
from mbd.equations.equations import Guard
from mbd.errors import MbdError, OneSidedError
from mbd.results.trajectory import Trajectory
from mbd.sensitivity.motion import Mode, Motion, Rates
from mbd.sensitivity.passed import Instant
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.run_data import RunRows, sided
from mbd.sensitivity.starts import directions, programs_of, start_tangent
from mbd.simulation.run.memory import without_memory
from mbd.state import State
from mbd.tape.node import Node

ROUND_OFF, GRAZE = 1e-12, 1e-7
"""Velocity over the sum of its terms that is rest, and rate of a guard over its terms below which it grazes [-]."""
STEP, LEVELS = 1e-4, 4
"""Change of what a run is differentiated by, over it or 1, to the runs on each side, and how many, each half as far."""
MAX_SHOWN = 4
"""Values in the sentence of a refusal at most [-]."""


class _Watched:
    """Guards of a row: values, their changes in every direction and in time, and the sums of the terms of these."""

    def __init__(self, programs: Programs, motion: Motion, mode: Mode, rates: Rates) -> None:
        self.columns, self.equations, self.mode = programs.columns, programs.equations, mode
        self.values, self.slopes = programs.watched(motion.at(mode, rates.rate, rates.lam))
        self.at, self.flow = (motion, rates), np.zeros(self.columns.count)
        c = self.columns
        self.flow[c.x], self.flow[c.y], self.flow[c.t] = motion.y[: c.n_v], rates.rate, 1.0
        self.growth = self.slopes @ self.flow

    @cached_property
    def terms(self) -> Vector:
        """Sums of the terms of their changes in time."""
        return np.asarray(np.abs(self.slopes) @ np.abs(self.flow))

    @cached_property
    def speeds(self) -> Vector:
        """Sums of the terms of what is a velocity."""
        still = np.zeros(self.columns.count)
        still[self.columns.y], still[self.columns.t] = self.at[0].y, 1.0
        return np.asarray(np.abs(self.slopes) @ np.abs(still))

    @cached_property
    def moves(self) -> NDArray[np.bool_]:
        """Whether any direction changes them."""
        motion, rates = self.at
        Z = motion.tangent.stacked(self.columns, rates.of_rate, rates.of_lam)
        changes = np.max(np.abs(self.slopes @ Z), axis=1, initial=0.0)
        return np.asarray(changes > EQUAL_RTOL * np.max(np.abs(self.slopes) @ np.abs(Z), axis=1, initial=0.0))

    def firing(self, within: float) -> Iterator[str]:
        """Names of the contacts and events that fire within so short a time, or would do if nothing were changed."""
        n_c = len(self.equations.contacts)
        for k, contact in enumerate(self.equations.contacts):
            if not self.mode.closed[k] and self._is_watched(k) and self._crosses(k, -1, within):
                yield contact.name
        for e, guard in enumerate(self.equations.guards):
            if _ends(guard) and self._crosses(2 * n_c + e, guard.direction, within):
                yield guard.name

    def _is_watched(self, k: int) -> bool:
        condition = self.equations.contacts[k].only_while
        if isinstance(condition, str):
            names = [contact.name for contact in self.equations.contacts]
            return bool(self.mode.closed[names.index(condition)])
        last = len(self.values) - len(self.equations.contacts)
        return not isinstance(condition, Node) or bool(self.values[last + k] > 0.0)

    def _crosses(self, k: int, direction: int, within: float) -> bool:
        growth = float(self.growth[k])
        due = abs(self.values[k]) <= abs(growth) * within and (direction == 0 or direction * growth > 0.0)
        return bool(due and abs(growth) > GRAZE * self.terms[k] and self.moves[k])

    def starting(self) -> Iterator[str]:
        """Names of the frictions that slide although they are at rest, in directions that change their velocity."""
        first = 2 * len(self.equations.contacts) + len(self.equations.guards)
        for f, friction in enumerate(self.equations.frictions):
            group = friction.group or (f,)
            places = [first + each for each in group]
            rest = all(abs(self.values[k]) <= ROUND_OFF * self.speeds[k] for k in places)
            if rest and any(self.mode.slip[each] != 0.0 for each in group) and any(self.moves[k] for k in places):
                yield friction.name

    def stopping(self, within: float) -> Iterator[str]:
        """Names of the frictions whose sliding ends within so short a time."""
        first = 2 * len(self.equations.contacts) + len(self.equations.guards)
        for f, friction in enumerate(self.equations.frictions):
            if not friction.group and self.mode.slip[f] and self._crosses(first + f, -int(self.mode.slip[f]), within):
                yield friction.name


def _ends(guard: Guard) -> bool:
    """Whether the event of a guard changes the run."""
    return guard.reset is not None or guard.terminal


def refuse_sided_start(
    rows: RunRows, programs: Programs, at_row: Callable[[int], tuple[Motion, Rates]], looked: tuple[Vector, ...]
) -> None:  # fmt: skip
    """Raise a `OneSidedError` where a change of the start decides what happens first.

    at_row : gives the motion and rates of a row with their derivatives
    looked : what is watched in the first row, and its change in time
    """
    if not is_any(programs):
        return
    within = INSTANT_RTOL * _duration(rows)
    mode, equations = rows.mode(0), programs.equations
    chosen = [(k, -1) for k in range(len(equations.contacts)) if not mode.closed[k]]
    first = 2 * len(equations.contacts)
    chosen += [(first + e, guard.direction) for e, guard in enumerate(equations.guards) if _ends(guard)]
    pace = [(k, sense * looked[1][k] if sense else abs(looked[1][k])) for k, sense in chosen]
    if not (equations.frictions or any(speed > 0.0 and abs(looked[0][k]) <= 2.0 * within * speed for k, speed in pace)):
        return
    motion, rates = at_row(0)
    watched = _Watched(programs, motion, mode, rates)
    if names := dict.fromkeys(watched.starting()):
        raise sided(
            f"{_listed(names)} starts at rest and slides at once, and a change of its velocity decides which way"
        )
    if names := dict.fromkeys(watched.firing(within)):
        raise sided(f"the run starts where {_listed(names)} happens, and a change decides whether it does")


def refuse_sided_grip(
    rows: RunRows, programs: Programs, row: int, at_row: Callable[[int], tuple[Motion, Rates]]
) -> None:  # fmt: skip
    """Raise a `OneSidedError` where dry friction holds with its limit, and a change decides whether it is enough.

    row : that of the start, or just after an event; at_row : see `refuse_sided_start`
    """
    if not programs.equations.frictions:
        return
    (motion, rates), mode = at_row(row), rows.mode(row)
    values, slopes = programs.limits(motion.at(mode, rates.rate, rates.lam))
    Z = motion.tangent.stacked(programs.columns, rates.of_rate, rates.of_lam)
    names = []
    for f, friction in enumerate(programs.equations.frictions):
        group = list(friction.group or (f,))
        own = [programs.equations.frictions[each].row for each in group]
        size = float(np.linalg.norm(rates.lam[own]))
        if f != group[0] or not set(own) <= set(mode.held) or size == 0.0:
            continue
        along = rates.lam[own] / size
        change = slopes[f] @ Z - along @ rates.of_lam[own]
        terms = np.abs(slopes[f]) @ np.abs(Z) + np.abs(along) @ np.abs(rates.of_lam[own])
        if abs(values[f] - size) <= ROUND_OFF * size and np.any(np.abs(change) > EQUAL_RTOL * terms):
            names.append(friction.name)
    if names:
        raise sided(
            f"{_listed(names)} sticks at t = {motion.t:.9g} s with all the friction that it can have, and a change "
            "decides whether it slides"
        )


def refuse_sided_end(
    rows: RunRows, programs: Programs, motion: Motion, mode: Mode, rates: Rates, instants: Sequence[Instant]
) -> None:  # fmt: skip
    """Raise a `OneSidedError` where an event happens at the given or latest time of a run, or would just after it.

    motion, mode, rates : at the last row; instants : the events of the run
    """
    until, end = rows.record.settings.get("until"), float(rows.record.time[-1])
    latest: Any = until[-1] if isinstance(until, tuple | list) else until
    within = INSTANT_RTOL * _duration(rows)
    if not is_number(latest) or end < float(latest) - within or not is_any(programs):
        return
    names = [each.name for each in instants if end - each.time <= within and np.any(each.of_time != 0.0)]
    if not names:
        watched = _Watched(programs, motion, mode, rates)
        names = [*watched.firing(within), *watched.stopping(within)]
    if names:
        raise sided_end(names, end)


def sided_end(names: Sequence[str], end: float) -> OneSidedError:
    """The error for events that happen as a run ends at this time."""
    return sided(
        f"{_listed(names)} happens as the run ends, at t = {end:.9g} s, and a change decides whether before it",
        "end the run earlier or later, or with the event",
    )


def is_any(programs: Programs) -> bool:
    """Whether anything is watched that may happen."""
    equations = programs.equations
    return bool(equations.contacts or equations.guards or equations.frictions)


def _duration(rows: RunRows) -> float:
    return float(rows.record.time[-1] - rows.record.time[0])


def _listed(names: Any) -> str:
    return " and ".join(repr(name) for name in dict.fromkeys(names))


# both sides -------------------------------------------------------------------------------------------------------
def with_both_sides(
    error: OneSidedError, model: Any, run: Trajectory, ways: Sequence[Any], held: Sequence[str], of: Sequence[str],
    again: Callable[[State, Mapping[str, float]], Trajectory], backend: str,
) -> OneSidedError:  # fmt: skip
    """The refusal with both one-sided values of each result, where runs on that side have it.

    ways, held : directions and what they leave as it is; of : names of results at the end; again : makes the run from
    another start, with other parameters
    """
    rows = RunRows(run)
    wanted = directions(rows.mechanism, ways)
    tangent = start_tangent(rows.first, programs_of(rows.mechanism, wanted, rows.record.parameters), wanted, held)
    found: dict[tuple[str, str], tuple[float, float]] = {}
    shown: list[str] = []
    for k, way in enumerate(wanted):
        if way.restitutions:
            continue
        size = STEP
        if way.parameters:
            known = dict(zip(rows.record.parameter_names, rows.record.parameters, strict=False))
            size *= max(abs(known[name]) for name in way.parameters) or 1.0
        parts = (tangent.q[:, k], tangent.y[:, k], way.parameters or {})
        sides = [_side(model, rows, parts, sign * size, of, again, backend) for sign in (-1.0, 1.0)]
        for j, name in enumerate(of):
            (below, low), (above, high) = (side[:, j] for side in sides)
            found[name, way.name] = float(below), float(above)
            jumps = abs(low - high) > NOMINAL_RTOL * max(1.0, abs(low))
            if jumps or not np.isclose(below, above, rtol=1e-6, atol=1e-9):
                shown.append(f"d({name})/d({way.name}) is {below:.6g} below and {above:.6g} above"
                             + (f", where it jumps from {low:.6g} to {high:.6g}" if jumps else ""))  # fmt: skip
    more = "" if len(shown) <= MAX_SHOWN else f" and {len(shown) - MAX_SHOWN} more in the error's sides"
    text = f"{error}; by runs on each side {', '.join(shown[:MAX_SHOWN])}{more}" if shown else str(error)
    full = OneSidedError(text)
    full.run, full.sides = run, found
    return full


def _side(
    model: Any, rows: RunRows, way: tuple[Vector, Vector, Mapping[str, float]], size: float, of: Sequence[str],
    again: Callable[[State, Mapping[str, float]], Trajectory], backend: str,
) -> Matrix:  # fmt: skip
    """(2, results) derivatives on one side, and limits there, of a cubic through runs; NaN where none can be made."""
    of_q, of_y, parameters = way
    state, compose = rows.record.start, rows.mechanism.equations.configuration.compose
    n_v, values = len(of_q), dict(zip(rows.record.parameter_names, rows.record.parameters, strict=False))
    parts, results = 0.5 ** np.arange(LEVELS), []
    for part in size * parts:
        changed = {name: float(values[name] + part * rate) for name, rate in parameters.items()}
        moved = replace(without_memory(state), q=compose(state.q, part * of_q), v=state.v + part * of_y[:n_v],
                        z=state.z + part * of_y[n_v:])  # fmt: skip
        try:
            run = again(project(model, moved, {**state.parameters, **changed}, backend), changed)
        except MbdError:
            return np.full((2, len(of)), np.nan)
        results.append(_results(run, of))
    limit, slope = np.linalg.solve(np.vander(parts, increasing=True), np.array(results))[:2]
    return np.array([slope / size, limit])


def _results(run: Trajectory, of: Sequence[str]) -> Vector:
    """Results at the end of a run; instants of events."""
    found: Vector = np.full(len(of), np.nan)
    for k, name in enumerate(of):
        event = [each.time for each in run.events if name == f"{each.name}.time"]
        if name == "time" or event or name in run:
            found[k] = run.time[-1] if name == "time" else event[0] if event else run[name][-1]
    return found
