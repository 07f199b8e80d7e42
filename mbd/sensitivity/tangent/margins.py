"""Decisions of a run that a small change may turn: its events, its start and its end, told from their neighbours."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mbd.sensitivity.guards import GRAZING_RTOL, Trigger, refused_graze, trigger
from mbd.sensitivity.motion import Motion, Rates
from mbd.sensitivity.one_sided import refuse_sided_end, refuse_sided_grip, refuse_sided_start
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.run_data import RunRows, sided
from mbd.sensitivity.strikes import refuse_sided_impact

__all__ = ["refuse_turning_points"]


def refuse_turning_points(
    rows: RunRows, programs: Programs, at_row: Callable[[int], tuple[Motion, Rates]], end: tuple[Motion, Rates]
) -> list[Trigger]:
    """What ended the step before each event.

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
    found = list[Trigger]()
    instants = list[tuple[str, Motion]]()
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
        if again and (own := _of_own_gap(rows, programs, row)) is not None:
            found.append(own)
            instants.append((own.name, at_row(before)[0]))
            continue
        if again:
            raise sided(
                f"{rows.events[row][0].name!r} happens at t = {time[before]:.9g} s right after another event or the "
                "start, with no time between"
            )
        fired = _fired(rows, programs, row, *at_row(before))
        found.append(fired)
        instants.append((fired.name, at_row(before)[0]))
    last = len(time) - 1
    refuse_sided_end(rows, programs, end[0], rows.mode(last), end[1], instants)
    return found


def _of_own_gap(rows: RunRows, programs: Programs, row: int) -> Trigger | None:
    """The event of a row whose guard is the gap of a contact that has just closed: it always happens with that."""
    equations, now = programs.equations, rows.record.time[row]
    gaps = [
        contact.gap for contact in equations.contacts
        if any(e.name == contact.name and e.kind == "closed" and e.time == now for e in rows.run.events)
    ]  # fmt: skip
    for number, guard in enumerate(equations.guards):
        if guard.name == rows.events[row][0].name and any(guard.value is gap for gap in gaps):
            return Trigger("event", number, guard.name)
    return None


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
