"""Which guard an event fired, and how its value changes: ``δh = −(g_y δy + g_p δp)/ġ`` of the step that it ends.

Several guards at one instant have derivatives on one side only, and a graze (ġ → 0) has none: both are refused by
name.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mbd.arrays import Vector
from mbd.equal import REST_SPEED
from mbd.equations.equations import Equations
from mbd.errors import CapabilityError
from mbd.results.record import EventRecord
from mbd.sensitivity.balance import consistent_rates
from mbd.sensitivity.motion import Mode, Motion, Rates
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.run_data import refused, sided

__all__ = ["GRAZE", "Trigger", "refused_graze", "shift_of_end", "trigger"]

Kind = Literal["closed", "pull", "gap", "force", "press", "event", "stuck", "slipped", "watched"]

GRAZE = 1e-7
"""Rate of a guard over the sum of its terms below which it has no derivative [-]."""


@dataclass(frozen=True)
class Trigger:
    """A fired guard: of a contact, friction or users' event with this number."""

    kind: Kind
    number: int
    name: str


def trigger(
    equations: Equations, events: Sequence[EventRecord], gaps: Vector, gap_rates: Vector, slip: Vector, time: float
) -> Trigger:
    """What ended the step, in which frictions slid with these signs.

    Raises
    ------
    CapabilityError
        where several did at one instant, with their names.
    """
    numbers = {contact.name: c for c, contact in enumerate(equations.contacts)}
    guards = {guard.name: e for e, guard in enumerate(equations.guards)}
    frictions = {friction.name: f for f, friction in enumerate(equations.frictions)}
    closed = {event.name for event in events if event.kind == "closed"}
    crossed = [guards[event.name] for event in events if event.kind == "event"]
    found = [Trigger("event", e, equations.guards[e].name) for e in crossed if _fires(equations, e)]
    for name in sorted(closed):
        c = numbers[name]
        if equations.contacts[c].kind == "penalty" or gap_rates[c] < -REST_SPEED:
            pressed = equations.contacts[c].kind == "penalty" and abs(gaps[c]) > 1e-8
            found.append(Trigger("press" if pressed else "closed", c, name))
    others: list[Trigger] = []
    for event in events:
        if event.kind == "opened":
            contact = equations.contacts[numbers[event.name]]
            ruled = any(name in closed for name, _ in contact.when)
            kinds: dict[str, Kind] = {"gap": "gap", "pull": "pull" if contact.kind != "penalty" else "force"}
            if not ruled and contact.opens_on in kinds:
                others.append(Trigger(kinds[contact.opens_on], numbers[event.name], event.name))
        elif event.kind in ("stuck", "slipped"):
            f = frictions[event.name]
            others.append(Trigger("stuck" if slip[f] != 0.0 else "slipped", f, event.name))
    found = found or others
    names = " and ".join(dict.fromkeys(repr(each.name) for each in found))
    if len(found) > 1:
        raise sided(f"{names} happen at one instant, t = {time:.9g} s, and come in another order on each side of it")
    if not found:
        raise refused(f"what ended the step at t = {time:.9g} s is not known")
    return found[0]


def _fires(equations: Equations, e: int) -> bool:
    """Whether an event happens by its own guard: transitions that others cause follow from these."""
    taken = equations.guards[e].transition
    return taken is None or ("event", e) in taken.causes


def shift_of_end(
    programs: Programs, motion: Motion, mode: Mode, rates: Rates, fired: Trigger, slowest: float
) -> Vector:
    """∂h/∂(directions) (D,) of the step, whose size is the last direction of the motion.

    slowest : approach speed up to which a contact closes without impact [m/s, rad/s]

    Raises
    ------
    CapabilityError
        for a graze, with the size of ġ.
    """
    c, equations = programs.columns, programs.equations
    n_c, n_g, n_f = len(equations.contacts), len(equations.guards), len(equations.frictions)
    k = fired.number
    if fired.kind in ("pull", "slipped"):
        there = consistent_rates(programs, motion, mode, rates)
        if fired.kind == "pull":
            change = there.of_lam[equations.contacts[k].rows[0]]
        else:
            row = equations.frictions[k].row
            slopes = programs.watched(motion.at(mode, there.rate, there.lam))[1][2 * n_c + n_g + n_f + k]
            change = slopes @ motion.tangent.stacked(c, there.of_rate, there.of_lam)
            if equations.frictions[k].partner >= 0:
                own = [row, equations.frictions[equations.frictions[k].partner].row]
                change = change - there.lam[own] @ there.of_lam[own] / np.hypot(*there.lam[own])
            else:
                change = change - np.sign(there.lam[row]) * there.of_lam[row]
        sizes = np.abs(change[:-1]).max(initial=0.0)
        terms = max(abs(float(change[-1])), 1e-12 * float(sizes))
    else:
        place = {
            "closed": k, "gap": k, "force": n_c + k, "press": n_c + k, "event": 2 * n_c + k,
            "stuck": 2 * n_c + n_g + k, "watched": 2 * n_c + n_g + 2 * n_f + k,
        }[fired.kind]  # fmt: skip
        slopes = programs.watched(motion.at(mode, rates.rate, rates.lam))[1][place]
        Z = motion.tangent.stacked(c, rates.of_rate, rates.of_lam)
        change = slopes @ Z
        terms = float(np.abs(slopes) @ np.abs(Z[:, -1]))
    rate = float(change[-1])
    if not abs(rate) > max(GRAZE * terms, slowest if fired.kind == "closed" else 0.0):
        raise refused_graze(fired, motion.t, rate, terms)
    return np.asarray(-change[:-1] / rate)


def refused_graze(fired: Trigger, time: float, rate: float, terms: float) -> CapabilityError:
    """The error for a guard that hardly changes as it fires: its rate, and the terms that this is made of."""
    return refused(
        f"{fired.name!r} only grazes at t = {time:.9g} s: its guard changes at {rate:.3g} per second there, by "
        f"terms of {terms:.3g}, and its instant has no derivative"
    )
