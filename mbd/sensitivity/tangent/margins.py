"""Decisions of a run that a small change may turn: its events, its start and its end, told from their neighbours."""

from collections.abc import Callable, Collection, Sequence
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.equal import HALF_PRECISION_RTOL
from mbd.errors import OneSidedError
from mbd.sensitivity.guards import GRAZING_RTOL, Numbers, Trigger, acts, refused_graze, trigger
from mbd.sensitivity.motion import Mode, Motion, Rates
from mbd.sensitivity.one_sided import is_any, refuse_sided_end, refuse_sided_grip, refuse_sided_start
from mbd.sensitivity.passed import Instant
from mbd.sensitivity.programs import Programs, State
from mbd.sensitivity.run_data import RunRows, refused, sided
from mbd.sensitivity.tangent.follow_impacts import EDGE, NO_REBOUND, TIE
from mbd.tape.derivatives import live

AtRow = Callable[[int], tuple[Motion, Rates]]
MIN_IMPULSE_RATIO = 1e-3
"""Impulse of a contact that comes to rest over that of the bounce before, at least: e/(1 + e) in free flight [-]."""


def refuse_turning_points(
    rows: RunRows, programs: Programs, at_row: AtRow, time_at: Callable[[int], Vector], end: tuple[Motion, Rates]
) -> list[Instant]:
    """The events, each with the derivatives of its instant.

    Parameters
    ----------
    at_row : gives the motion and rates of a row with their derivatives; asked for the first one, and those before and
        after events
    time_at : gives the derivatives of the time of a row
    end : the same at the end

    Raises
    ------
    OneSidedError, CapabilityError
        where a run has derivatives on one side only, or none.
    """
    time, order = rows.record.time, sorted(rows.events)
    for row in (0, *(row for row in order if row < len(time) - 1)) if programs.equations.frictions else ():
        refuse_sided_grip(rows, programs, row, at_row)
    leads = [row for row in order if not _is_again(rows, row)]
    looked = _watched(rows, programs, [0, *(row - 1 for row in leads)]) if is_any(programs) else [()]
    refuse_sided_start(rows, programs, at_row, looked[0])
    fired = dict(zip(leads, _fired(rows, programs, leads, looked[1:], at_row), strict=True))
    found, lead = list[Instant](), 0
    for row in order:
        if row not in fired:
            still = not any(np.any(each.of_time) for each in found)
            found.append(_beside(rows, programs, at_row, lead, row, still))
            continue
        lead = row
        found.append(Instant(fired[row].name, float(rows.ends[row - 1]), time_at(row - 1)))
    last = len(time) - 1
    refuse_sided_end(rows, programs, end[0], rows.mode(last), end[1], found)
    return found


def _is_again(rows: RunRows, row: int) -> bool:
    """Whether the event of a row comes right after another one, or the start."""
    time, before, prior = rows.record.time, row - 1, row - 2
    return before in rows.events or (
        prior >= 0 and time[prior] == time[before] and (prior in rows.events or prior == 0)
    )


def _beside(rows: RunRows, programs: Programs, at_row: AtRow, lead: int, row: int, still: bool) -> Instant:
    """The event of a row right after that of row `lead`, at one instant with it.

    It moves with it where its guard is the gap of a contact that has just closed, or has jumped over zero there; timers
    and samples do where no event moves (`still`) nor what their times are made of. One that changes nothing may come by
    chance: its own instant is not known then, unless both move alike.
    """
    equations, event, time = programs.equations, rows.events[row][0], float(rows.record.time[row])
    numbers = [e for e, guard in enumerate(equations.guards) if guard.name == event.name]
    if lead and event.kind == "event" and numbers and len(Numbers.of(rows.mechanism).firing(rows.events[row])) == 1:
        before, place = at_row(lead - 1), 2 * len(equations.contacts) + numbers[0]
        closed = [each.name for each in rows.run.events if each.kind == "closed" and each.time == time]
        gaps = [contact.gap for contact in equations.contacts if contact.name in closed]
        of_time = before[0].tangent.t
        if any(equations.guards[numbers[0]].value is gap for gap in gaps):
            return Instant(event.name, time, of_time)
        values = [_guard(rows, programs, each, at_row(each), place) for each in (lead - 1, row - 1)]
        if all(abs(value) > noise for value, noise, _, _ in values):
            return Instant(event.name, time, of_time)
        if still and equations.guards[numbers[0]].is_timer and not _moves(programs, numbers[0]):
            return Instant(event.name, time, of_time)
        if not rows.controllers and not acts(equations, numbers[0], rows.record.settings["until"]):
            _, _, change, growth = values[0]
            size = np.max(np.maximum(np.abs(change - growth * of_time), np.abs(growth * of_time)))
            moves_alike = np.all(np.abs(change) <= HALF_PRECISION_RTOL * size)
            return Instant(event.name, time, of_time if moves_alike else np.full(len(of_time), np.nan))
    raise sided(
        f"{event.name!r} happens at t = {time:.9g} s right after another event or the start, with no time between"
    )


def _moves(programs: Programs, e: int) -> bool:
    """Whether a timer or instants that machines hold are made of the motion or of parameters that are asked for."""
    machines, waiting, seen = programs.equations.machines, [programs.equations.guards[e].value], set[tuple[Any, ...]]()
    captured = {anchor: node for m in machines for anchor, node in zip(m.anchors, m.captured, strict=True)}
    own = {m.anchors[turn]: number for m in machines for turn, number in m.own}
    waiting += [captured[anchor] for m in machines for anchor in m.times]
    while waiting:
        inputs = {node.data for node in live(waiting) if node.op == "input"} - seen
        anchors = [number for kind, number in inputs if kind == "anchor"]
        numbers = [number for kind, number in inputs if kind == "p"] + [own[each] for each in anchors if each in own]
        if {kind for kind, _ in inputs} - {"anchor", "p", "t"} or set(numbers) & set(programs.places):
            return True
        seen |= inputs
        waiting = [captured[each] for each in anchors if each in captured]
    return False


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


def _watched(rows: RunRows, programs: Programs, chosen: list[int]) -> list[tuple[Vector, ...]]:
    """What is watched at rows, as steps end there: values, their changes in time, and sums of sizes of their terms."""
    record, c = rows.record, programs.columns
    modes = [rows.mode(row) for row in chosen]
    active = np.zeros((len(chosen), c.rows))
    for line, mode in zip(active, modes, strict=True):
        line[list(mode.held)] = 1.0
    y, rate = np.hstack([record.v[chosen], record.z[chosen]]), np.hstack([record.a[chosen], record.s[chosen]])
    switches, slips = np.array([mode.switch for mode in modes]), np.array([mode.slip for mode in modes])
    held = rows.watched_anchors[chosen]
    times: Any = rows.ends[chosen]
    at = State(times, record.q[chosen], y, rate, record.lam[chosen] * active, held, switches, slips)
    flow = np.zeros((len(chosen), c.count))
    flow[:, c.x], flow[:, c.y], flow[:, c.t] = record.v[chosen], rate, 1.0
    return list(zip(*programs.watched_flow(at, flow), strict=True))


def _fired(
    rows: RunRows, programs: Programs, leads: Sequence[int], looked: Sequence[tuple[Vector, ...]],
    at_row: AtRow,
) -> list[Trigger]:  # fmt: skip
    """What ended the steps to the events of rows; no graze, and no contact that touches by chance.

    looked : what is watched just before each (`_watched`)
    """
    equations, record = programs.equations, rows.record
    contacts, guards = len(equations.contacts), len(equations.guards)
    found = list[Trigger]()
    rest_speed = float(record.settings.get("rest_speed", 1e-6))
    for row, (values, growth, terms) in zip(leads, looked, strict=True):
        mode, now = rows.mode(row - 1), float(rows.ends[row - 1])
        fired = trigger(rows.mechanism, rows.events[row], values[:contacts], growth[:contacts], mode.slip, now)
        k = fired.number
        places = {"closed": k, "gap": k, "force": contacts + k, "press": contacts + k, "event": 2 * contacts + k,
                  "stuck": 2 * contacts + guards + k}  # fmt: skip
        place = places.get(fired.kind)
        if place is not None and (
            not abs(growth[place]) > GRAZING_RTOL * terms[place]
            or (fired.kind == "closed" and not abs(growth[place]) > rest_speed
                and not _comes_to_rest(rows, fired.name, now))
        ):  # fmt: skip
            raise refused_graze(fired, now, float(growth[place]), float(terms[place]))
        if fired.kind == "closed" and equations.contacts[k].kind != "penalty":
            _refuse_chance(rows, programs, row, mode, k, at_row)
        found.append(fired)
    return found


def _comes_to_rest(rows: RunRows, name: str, now: float) -> bool:
    """Whether a contact closes after a rebound that was small already, as a ball does that comes to rest by bouncing.

    Each bounce of such a sequence follows smoothly from the one before; a graze comes from a larger motion.
    """
    sizes = [
        abs(float(event.impulse[0])) for event in rows.run.events
        if event.name == name and event.kind == "closed" and event.time <= now and event.impulse.size
    ]  # fmt: skip
    return len(sizes) > 1 and sizes[-1] > MIN_IMPULSE_RATIO * sizes[-2] > 0.0


def _refuse_chance(rows: RunRows, programs: Programs, row: int, mode: Mode, fired: int, at_row: AtRow) -> None:
    """Raise a `OneSidedError` where contacts close with the one that fired, and a direction moves them apart."""
    contacts, zero = programs.equations.contacts, (np.zeros(programs.columns.n), np.zeros(programs.columns.rows))
    closing = {event.name for event in rows.events[row] if event.kind == "closed"}
    beside = [
        c for c, each in enumerate(contacts)
        if each.name in closing and each.kind != "penalty" and c != fired and not mode.closed[c]
    ]  # fmt: skip
    if not beside:
        return
    before = at_row(row - 1)[0]
    slopes = programs.watched(before.at(mode, *zero))[1]
    Z, found = before.tangent.stacked(programs.columns), []
    for c in beside:
        terms = np.abs(slopes[c]) @ np.abs(Z)
        if np.any(np.abs(slopes[c] @ Z) > HALF_PRECISION_RTOL * terms + 1e-12 * np.max(terms)):
            found.append(repr(contacts[c].name))
    if found:
        why = f"{' and '.join(found)} may touch in it or not, which a change decides"
        raise _sided(rows, closing, before.t, why)


def refuse_edge(rows: RunRows, kind: float, first: int, second: int, time: float) -> None:
    """Raise a `OneSidedError` where a change decides how an impact continues (see `follow_impacts.note`)."""
    if not kind:
        return
    equations = rows.mechanism.equations
    names = [*(each.name for each in equations.contacts), *(each.name for each in equations.frictions)]
    listed = " and ".join(repr(names[each]) for each in (first, second) if each >= 0)
    why = {
        EDGE: f"{listed} may go on in either of two ways in it, which a change decides",
        TIE: f"{listed} approach equally fast in its sequence, and a change decides which strikes first",
        NO_REBOUND: f"the restitution of {listed} is 0",
    }[kind]
    closing = {each.name for each in rows.run.events if each.kind == "closed" and each.time == time}
    raise _sided(rows, closing, time, why)


def _sided(rows: RunRows, closing: Collection[str], time: float, why: str) -> OneSidedError:
    names = " and ".join(repr(name) for name in sorted(closing))
    law = str(rows.record.settings.get("impact", "newton"))
    which = f"the impact of {names} at t = {time:.9g} s (law {law!r})"
    return OneSidedError(str(refused(f"{which}: {why}: it has derivatives on one side only")))
