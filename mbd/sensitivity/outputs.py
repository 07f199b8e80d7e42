"""Results at the end of a run, instants of its events, and their derivatives."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.errors import UnknownNameError, nearest
from mbd.sensitivity.motion import Mode, Motion, Rates
from mbd.sensitivity.passed import Passed
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.run_data import RunRows, refused

__all__ = ["Lines", "lines_of", "taken_apart", "usual"]

RESULT_RTOL = 1e-7
"""Difference of a result from that of the run, over its size, that is round-off [-]."""
MAX_CHECKED_ROWS = 64
"""Rows from which the size of a result is known."""


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
    mine = [each for each in found.instants if each.fired.name == stem]
    if not 0 < number <= len(mine):
        return None
    chosen = mine[number - 1]
    return chosen.before.t, chosen.before.tangent.t


def lines_of(rows: RunRows, programs: Programs, found: Passed, of: Sequence[str]) -> Lines:
    """Values and derivatives of names.

    Raises
    ------
    UnknownNameError
        for a name that is neither a result nor the instant of an event that happened.
    """
    rates = with_sliding(programs, found.motion, found.mode, found.rates)
    instants = {name: instant_of(name, found) for name in of}
    instants["time"] = float(rows.run.time[-1]), found.motion.tangent.t
    wanted = _at_rows(rows, found, [name for name in of if instants[name] is None])
    at = found.motion.at(found.mode, rates.rate, rates.lam)
    at.lam, at.anchors = rates.lam, _with_turns(rows, programs, at.anchors)
    tangent = found.motion.tangent.stacked(programs.columns, rates.of_rate, rates.of_lam)
    values, slopes = programs.results(list(wanted), at)
    lines = slopes @ tangent
    for name, value in zip(wanted, values, strict=True):
        if not _is_found_again(float(value), wanted[name]):  # its size may be that of a peak between these rows
            _require_found_again(name, float(value), _at_rows(rows, found, [name], len(rows.record.time))[name])
    results = dict(zip(wanted, zip(values, lines, strict=True), strict=True))
    each = [instants[name] or results[name] for name in of]
    size = len(found.motion.tangent.t)
    return Lines(
        tuple(of), np.array([value for value, _ in each]), np.array([line for _, line in each]).reshape(len(of), size)
    )


def _at_rows(rows: RunRows, found: Passed, names: Sequence[str], most: int = MAX_CHECKED_ROWS) -> dict[str, Vector]:
    """Named results at some rows of the run and the last one, evaluated together."""
    single, columns = list[str](), rows.run.columns
    for name in names:
        try:
            parts = columns.components(name)
        except UnknownNameError:
            times = [f"{each.fired.name}.time" for each in found.instants]
            known = {*rows.run.names, *times, "time"}
            raise UnknownNameError("of: " + nearest(name, known, "result", "The run has")) from None
        if len(parts) > 1:
            raise UnknownNameError(f"of: {name!r} has three components; ask for {name + '.x'!r}, '.y' or '.z'")
        single += parts
    stored, count = rows.stored, len(rows.record.time)
    some = np.unique(np.linspace(0, count - 1, min(count, most)).astype(np.intp))
    nodes = [stored.node(part) for part in single]
    return dict(zip(names, stored.evaluate(nodes, stored.part(some, nodes)), strict=True))


def _is_found_again(value: float, wanted: Vector) -> bool:
    """Whether a result at the end is the last of those at rows."""
    return bool(abs(value - wanted[-1]) <= RESULT_RTOL * max(1.0, float(np.max(np.abs(wanted)))))


def _require_found_again(name: str, value: float, wanted: Vector) -> None:
    """Refuse a named result at the end where it is not the last of those at the rows."""
    if not _is_found_again(value, wanted):
        raise refused(f"{name!r} is {wanted[-1]:.9g} at its end, which the pass does not find again ({value:.9g})")


def _with_turns(rows: RunRows, programs: Programs, anchors: Vector) -> Vector:
    """Anchors with the whole turns that angles of cut joints have made at the end, which only its rows count."""
    counts = [turn.anchor for turn in programs.equations.wrapped]
    if not counts:
        return anchors
    found = anchors.copy()
    found[counts] = rows.anchors[-1, counts]
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
