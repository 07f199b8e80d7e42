"""Results at the end of a run, instants of its events, and their derivatives."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.errors import UnknownNameError, nearest
from mbd.sensitivity.motion import Mode, Motion, Rates
from mbd.sensitivity.passed import Passed
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.run_data import RunRows, refused, sided
from mbd.tape.node import Node

RESULT_RTOL = 1e-7
"""Difference of a result from that of the run, over its size, that is round-off [-]."""


@dataclass(frozen=True)
class Lines:
    """Names, values and derivatives of what was asked for."""

    names: tuple[str, ...]
    values: Vector
    matrix: Matrix


def usual(rows: RunRows) -> list[str]:
    """The state at the end and its instant."""
    equations = rows.mechanism.equations
    names = [each.name for each in equations.coordinates] + list(equations.velocity_names)
    return [*names, *(state.name for state in equations.states), "time"]


def taken_apart(rows: RunRows, names: Sequence[str]) -> list[str]:
    """Names of single results: of 'hip.orientation' and 'hip.euler.zxy' those of their parts."""
    found = list[str]()
    for name in names:
        try:
            found += rows.run.columns.components(name)
        except UnknownNameError:  # the instant of an event, or no name at all
            found.append(name)
    return found


def instant_of(name: str, found: Passed) -> tuple[float, Vector] | None:
    """Time of 'foot.time', the first event of that name, or 'foot.time.2', the second; None if it is no such name."""
    stem, _, last = name.rpartition(".")
    number = 1
    if last.isdigit() and stem.endswith(".time"):
        number, stem, last = int(last), *stem.rpartition(".")[::2]
    if last != "time" or not stem:
        return None
    mine = [each for each in found.instants if each.name == stem]
    if not 0 < number <= len(mine):
        return None
    chosen = mine[number - 1]
    if np.any(np.isnan(chosen.of_time)):
        raise sided(f"of: {name!r} is the instant of an event that happens together with another by chance")
    return chosen.time, chosen.of_time


def lines_of(rows: RunRows, programs: Programs, found: Passed, of: Sequence[str]) -> Lines:
    """Values and derivatives of names.

    Raises
    ------
    UnknownNameError
        for a name that is neither a result nor the instant of an event that happened.
    """
    rates = with_sliding(programs, found.motion, found.mode, found.rates)
    instants = {"time": (float(rows.run.time[-1]), found.motion.tangent.t)}
    for name in of if found.instants else ():
        if name not in instants and (instant := instant_of(name, found)) is not None:
            instants[name] = instant
    names = tuple(dict.fromkeys(name for name in of if name not in instants))
    places = rows.mechanism.kept((lines_of, names), lambda: _places(rows, found, names))
    at = found.motion.at(found.mode, rates.rate, rates.lam)
    at.lam, at.anchors = rates.lam, _with_turns(rows, programs, at.anchors)
    tangent = found.motion.tangent.stacked(programs.columns, rates.of_rate, rates.of_lam)
    results, slopes = programs.results(names, at)
    _require_found_again(rows, names, places, results)
    numbers = {name: k for k, name in enumerate((*names, *instants))}
    chosen = [numbers[name] for name in of]
    values = np.concatenate([results, [value for value, _ in instants.values()]])
    matrix = np.vstack([slopes @ tangent, *(line for _, line in instants.values())])
    return Lines(tuple(of), values[chosen], matrix[chosen])


def _places(rows: RunRows, found: Passed, names: Sequence[str]) -> tuple[NDArray[np.intp], list[tuple[int, Node]]]:
    """Where in (q, v, z) each named result is, −1 for what is not the state; numbers and expressions of the latter."""
    at, others, columns = np.full(len(names), -1), list[tuple[int, Node]](), rows.stored
    starts = {"q": 0, "v": rows.mechanism.layout.n_q, "z": rows.mechanism.layout.n_q + rows.mechanism.layout.n_v}
    for k, name in enumerate(names):
        try:
            parts = columns.components(name)
        except UnknownNameError:
            times = [f"{each.name}.time" for each in found.instants]
            known = {*columns.names, *times, "time"}
            raise UnknownNameError("of: " + nearest(name, known, "result", "The run has")) from None
        if len(parts) > 1:
            raise UnknownNameError(f"of: {name!r} has three components; ask for {name + '.x'!r}, '.y' or '.z'")
        place = columns.identity(parts[0])[0]
        if place is not None and place[0] in starts:
            at[k] = starts[place[0]] + place[1]
        else:
            others.append((k, columns.node(parts[0])))
    return at, others


def _require_found_again(rows: RunRows, names: Sequence[str], places: Any, values: Vector) -> None:
    """Refuse named results at the end that are not the last of those at the rows.

    places : of `_places`
    """
    at, others = places
    record, stored = rows.record, rows.stored
    last = np.array([len(record.time) - 1])
    wanted = np.concatenate([record.q[-1], record.v[-1], record.z[-1], [np.nan]])[at]
    if others:
        numbers, nodes = zip(*others, strict=True)
        wanted[list(numbers)] = np.ravel(stored.evaluate(nodes, stored.part(last, nodes)))
    off = np.abs(values - wanted)
    for k in map(int, np.flatnonzero(~(off <= RESULT_RTOL * np.maximum(1.0, np.abs(wanted))))):
        size = float(np.abs(stored.at_rows(names[k : k + 1])[0]).max())  # that of a peak before the end
        if not off[k] <= RESULT_RTOL * size:
            raise refused(
                f"{names[k]!r} is {wanted[k]:.9g} at its end, which the pass does not find again ({values[k]:.9g})"
            )


def _with_turns(rows: RunRows, programs: Programs, anchors: Vector) -> Vector:
    """Anchors with the whole turns that angles of cut joints have made at the end, which only its rows count."""
    counts = [turn.anchor for turn in programs.equations.wrapped]
    if not counts:
        return anchors
    found = anchors.copy()
    found[counts] = rows.stored.anchors[-1, counts]
    return found


def with_sliding(programs: Programs, motion: Motion, mode: Mode, rates: Rates) -> Rates:
    """The rates with the multipliers of frictions that slide, which follow those of the contacts."""
    equations = programs.equations
    lam, of_lam = rates.lam.copy(), rates.of_lam.copy()
    active = np.zeros_like(lam)
    active[list(mode.held)] = lam[list(mode.held)]
    lam = active
    if not np.any(mode.slip):
        return Rates(rates.rate, lam, rates.of_rate, of_lam)
    values, slopes = programs.watched(motion.at(mode, rates.rate, rates.lam))
    Z = motion.tangent.stacked(programs.columns, rates.of_rate, rates.of_lam)
    first = 2 * len(equations.contacts) + len(equations.guards) + len(equations.frictions)
    for f, friction in enumerate(equations.frictions):
        if mode.slip[f] != 0.0 and friction.group:
            lam[friction.row], of_lam[friction.row] = force_in_plane(programs, f, values, slopes @ Z)
        elif mode.slip[f] != 0.0:
            lam[friction.row] = mode.slip[f] * values[first + f]
            of_lam[friction.row] = mode.slip[f] * (slopes[first + f] @ Z)
    return Rates(rates.rate, lam, rates.of_rate, of_lam)


def force_in_plane(programs: Programs, f: int, values: Vector, slopes: Matrix) -> tuple[float, Vector]:
    """λ_T of friction f while it slides, and its derivatives (D,), from what is watched."""
    equations = programs.equations
    n_c, n_g, n_f = len(equations.contacts), len(equations.guards), len(equations.frictions)
    speeds, limit = 2 * n_c + n_g, 2 * n_c + n_g + n_f + f
    own, every = speeds + f, [speeds + each for each in equations.frictions[f].group]
    size = float(np.linalg.norm(values[every])) or 1.0
    cosine = float(values[own]) / size
    turned = (slopes[own] - cosine * (values[every] @ slopes[every]) / size) / size
    return float(values[limit]) * cosine, np.asarray(cosine * slopes[limit] + values[limit] * turned)
