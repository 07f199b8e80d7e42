"""Decisions of a run that a small change may turn: its events, its start and its end, told from their neighbours."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mbd.arrays import Vector
from mbd.equal import HALF_PRECISION_RTOL
from mbd.sensitivity.guards import GRAZING_RTOL, Trigger, acts, firing, refused_graze, trigger
from mbd.sensitivity.motion import Motion, Rates
from mbd.sensitivity.one_sided import refuse_sided_end, refuse_sided_grip, refuse_sided_start
from mbd.sensitivity.passed import Instant
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.run_data import RunRows, sided
from mbd.sensitivity.strikes import refuse_sided_impact

__all__ = ["refuse_turning_points"]

AtRow = Callable[[int], tuple[Motion, Rates]]


def refuse_turning_points(rows: RunRows, programs: Programs, at_row: AtRow, end: tuple[Motion, Rates]) -> list[Instant]:
    """The events, each with the derivatives of its instant.

    Parameters
    ----------
    at_row : gives the motion and rates of a row with their derivatives; asked for the first one, and those before and
        after events
    end : the same at the end

    Raises
    ------
    OneSidedError, CapabilityError
        where a run has derivatives on one side only, or none.
    """
    found, lead = list[Instant](), 0
    refuse_sided_start(rows, programs, at_row)
    time = rows.record.time
    for row in (0, *(row for row in sorted(rows.events) if row < len(time) - 1)):
        refuse_sided_grip(rows, programs, row, at_row)
    for row in sorted(rows.events):
        before = row - 1
        prior = before - 1
        again = before in rows.events or (
            prior >= 0 and time[prior] == time[before] and (prior in rows.events or prior == 0)
        )
        if again:
            found.append(_beside(rows, programs, at_row, lead, row))
            continue
        lead, motion = row, at_row(before)[0]
        fired = _fired(rows, programs, row, *at_row(before))
        found.append(Instant(fired.name, motion.t, motion.tangent.t))
    last = len(time) - 1
    refuse_sided_end(rows, programs, end[0], rows.mode(last), end[1], found)
    return found


def _beside(rows: RunRows, programs: Programs, at_row: AtRow, lead: int, row: int) -> Instant:
    """The event of a row right after that of row `lead`, at one instant with it.

    It moves with it where its guard is the gap of a contact that has just closed, or has jumped over zero there. One
    that changes nothing may come by chance: its own instant is not known then, unless both move alike.
    """
    equations, event, time = programs.equations, rows.events[row][0], float(rows.record.time[row])
    numbers = [e for e, guard in enumerate(equations.guards) if guard.name == event.name]
    if lead and event.kind == "event" and numbers and len(firing(equations, rows.events[row])) == 1:
        before, place = at_row(lead - 1), 2 * len(equations.contacts) + numbers[0]
        closed = [each.name for each in rows.run.events if each.kind == "closed" and each.time == time]
        gaps = [contact.gap for contact in equations.contacts if contact.name in closed]
        of_time = before[0].tangent.t
        if any(equations.guards[numbers[0]].value is gap for gap in gaps):
            return Instant(event.name, time, of_time)
        values = [_guard(rows, programs, each, at_row(each), place) for each in (lead - 1, row - 1)]
        if all(abs(value) > noise for value, noise, _, _ in values):
            return Instant(event.name, time, of_time)
        if not rows.controllers and not acts(equations, numbers[0], rows.record.settings["until"]):
            _, _, change, growth = values[0]
            size = np.max(np.maximum(np.abs(change - growth * of_time), np.abs(growth * of_time)))
            moves_alike = np.all(np.abs(change) <= HALF_PRECISION_RTOL * size)
            return Instant(event.name, time, of_time if moves_alike else np.full(len(of_time), np.nan))
    raise sided(
        f"{event.name!r} happens at t = {time:.9g} s right after another event or the start, with no time between"
    )


def _guard(
    rows: RunRows, programs: Programs, row: int, at: tuple[Motion, Rates], place: int
) -> tuple[float, float, Vector, float]:
    """The value that is watched at a place, up to which one is zero, its derivatives (D,) and its rate."""
    (motion, rates), c = at, programs.columns
    values, slopes = programs.watched(motion.at(rows.mode(row), rates.rate, rates.lam))
    flow = np.zeros(c.count)
    flow[c.x], flow[c.y], flow[c.t] = motion.y[: c.n_v], rates.rate, 1.0
    size = float(np.abs(slopes[place, c.y]) @ np.abs(motion.y) + np.abs(slopes[place]) @ np.abs(flow) * rows.full)
    change = slopes[place] @ motion.tangent.stacked(c, rates.of_rate, rates.of_lam)
    return values[place], HALF_PRECISION_RTOL * size, change, float(slopes[place] @ flow)


def _fired(rows: RunRows, programs: Programs, row: int, motion: Motion, rates: Rates) -> Trigger:
    """What ended the step to the event of a row; no graze, and no contact that touches by chance."""
    equations, c, mode = programs.equations, programs.columns, rows.mode(row - 1)
    contacts, guards = len(equations.contacts), len(equations.guards)
    values, slopes = programs.watched(motion.at(mode, rates.rate, rates.lam))
    flow = np.zeros(c.count)
    flow[c.x], flow[c.y], flow[c.t] = motion.y[: c.n_v], rates.rate, 1.0
    growth, terms = slopes @ flow, np.abs(slopes) @ np.abs(flow)
    fired = trigger(equations, rows.events[row], values[:contacts], growth[:contacts], mode.slip, motion.t)
    first = 2 * contacts + guards
    k = fired.number
    places = {"closed": k, "gap": k, "force": contacts + k, "press": contacts + k, "event": 2 * contacts + k,
              "stuck": first + k}  # fmt: skip
    place = places.get(fired.kind)
    slowest = float(rows.record.settings.get("rest_speed", 1e-6)) if fired.kind == "closed" else 0.0
    if place is not None and not abs(growth[place]) > max(GRAZING_RTOL * terms[place], slowest):
        raise refused_graze(fired, motion.t, float(growth[place]), float(terms[place]))
    if fired.kind == "closed" and equations.contacts[k].kind != "penalty":
        refuse_sided_impact(rows, programs, motion, mode, rows.events[row], k)
    return fired
