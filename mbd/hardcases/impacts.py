"""Momentum, complementarity and energy at every impact of a run, recomputed from its stored rows."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from mbd.compile.mechanisms import mechanism_of
from mbd.dataclass import dataclass
from mbd.equal import ROUND_OFF_RTOL
from mbd.hardcases.case import Figure
from mbd.hardcases.references import size
from mbd.results.record import EventRecord


@dataclass(frozen=True)
class Defects:
    """Of one impact, each over the size of its terms.

    momentum : ``M (v⁺ − v⁻) + B_bᵀ Λ_b − B_cᵀ Λ`` with the reported Λ
    complementarity : the worst of ``−Λ``, ``−(γ⁺ + e γ⁻)`` and of their product, over rows that closed
    gain : kinetic energy after less before; held : rates of rows that hold after it
    """

    momentum: float
    complementarity: float
    gain: float
    held: float


def impact_figures(model: Any, run: Any) -> list[Figure]:
    """What holds at every impact of a run: at least one is expected."""
    found = list(_defects(model, run))
    if not found:
        return [Figure("impacts that did not happen [-]", 1.0, 0.0)]
    return [
        Figure("momentum balance at impacts, relative [-]", size([each.momentum for each in found]), ROUND_OFF_RTOL),
        Figure(
            "complementarity at impacts, relative [-]", size([each.complementarity for each in found]), ROUND_OFF_RTOL
        ),
        Figure(
            "kinetic energy gained at an impact, relative [-]",
            float(np.max([each.gain for each in found])),
            ROUND_OFF_RTOL,
        ),
        Figure("rates of held rows after impacts, relative [-]", size([each.held for each in found]), ROUND_OFF_RTOL),
    ]


def _defects(model: Any, run: Any) -> Iterator[Defects]:
    struck: dict[int, list[EventRecord]] = {}
    for event in run.events:
        if event.kind == "closed" and event.impulse.any():
            struck.setdefault(event.row, []).append(event)
    for row, events in struck.items():
        yield _defect(mechanism_of(model), run, row, events)


def _defect(mechanism: Any, run: Any, row: int, events: list[EventRecord]) -> Defects:
    """The impact between two stored rows; contacts closed before take part with impulses that are not told."""
    record, equations = run.record, mechanism.equations
    before, after = record.v[row - 1], record.v[row]
    place = (record.time[row], record.q[row], before, mechanism.parameters())
    anchors = np.array(run.columns.anchors[row])
    struck = {event.name for event in events}
    for contact in equations.contacts:  # those that rebound hold no place, but had one as they struck
        if contact.name in struck:
            here = list(contact.anchors)
            anchors[here] = mechanism.acceleration_terms(*place, anchors).captured[here]
    terms = mechanism.acceleration_terms(*place, anchors)
    rates = terms.B @ after + (terms.rate - terms.B @ before)
    speeds = np.abs(terms.B) @ np.maximum(np.abs(before), np.abs(after)) + np.abs(terms.rate - terms.B @ before)
    change = terms.M @ (after - before)
    impulses = np.zeros(len(equations.rows))
    contacts = {contact.name: contact for contact in equations.contacts}
    closing = {event.name for event in events}
    approach = max(-terms.rate[contacts[event.name].rows[0]] for event in events)
    slow = approach < run.settings["rest_speed"]
    worst = 0.0
    for event in events:
        contact = contacts[event.name]
        impulses[list(contact.rows)] = event.impulse
        normal = contact.rows[0]
        e = 0.0 if slow else contact.restitution
        share = (rates[normal] + e * terms.rate[normal]) / speeds[normal]
        push = impulses[normal] / size(impulses[normal]) if impulses[normal] else 0.0
        worst = max(worst, -push, -share, abs(share) if impulses[normal] else 0.0)
    through = {c.name for k, c in enumerate(equations.contacts) if record.closed[row - 1, k]} - closing
    rest = [k for k, each in enumerate(equations.rows) if each.contact < 0 or each.owner in through]
    missing = change - terms.B.T @ impulses
    if rest:
        unknown = np.linalg.lstsq(terms.B[rest].T, missing, rcond=None)[0]
        missing = missing - terms.B[rest].T @ unknown
    scale = max(size(change), size(np.abs(terms.B.T) @ np.abs(impulses)), size(terms.M @ before))
    kinetic = [0.5 * v @ terms.M @ v for v in (before, after)]
    closed = {c.name for k, c in enumerate(equations.contacts) if record.closed[row, k]}
    holding = [k for k, each in enumerate(equations.rows) if each.contact < 0 or each.owner in closed]
    return Defects(
        size(missing) / scale,
        worst,
        (kinetic[1] - kinetic[0]) / max(kinetic[0], 1e-300),
        size(rates[holding]) / max(size(speeds), 1e-300),
    )


def deepest(run: Any) -> float:
    """How deep any contact of a run lies below its surface at any stored row [m, rad]."""
    gaps = [run[f"{contact.name}.gap"] for contact in run.facts.contacts]
    return float(np.max(-np.array(gaps))) + 0.0 if gaps else 0.0


def difference(run: Any, other: Any) -> float:
    """How far the last velocities and the impulses of two runs lie apart, relative; their contacts are in any order."""
    if [(e.name, e.kind) for e in sorted_events(run)] != [(e.name, e.kind) for e in sorted_events(other)]:
        return float("nan")
    pairs = zip(sorted_events(run), sorted_events(other), strict=True)
    impulses = [(a.impulse, b.impulse) for a, b in pairs]
    values = [*impulses, (run.record.v[-1], other.record.v[-1])]
    return max((size(a - b) / max(size(a), size(b), 1e-300) for a, b in values if size(a) > 0.0), default=0.0)


def sorted_events(run: Any) -> list[EventRecord]:
    """Events by the row they lead to, those of one row by name."""
    return sorted(run.events, key=lambda event: (event.row, event.name, event.kind))
