"""Which guard an event fired, and how its value changes: ``δh = −(g_y δy + g_p δp)/ġ`` of the step that it ends.

Several guards at one instant have derivatives on one side only, and a graze (ġ → 0) has none: both are refused by
name.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

from mbd.arrays import Vector
from mbd.compile.mechanism import Mechanism
from mbd.dataclass import dataclass
from mbd.equal import REST_SPEED
from mbd.equations.equations import Equations
from mbd.errors import CapabilityError
from mbd.results.record import EventRecord
from mbd.sensitivity.run_data import refused, sided

Kind = Literal["closed", "pull", "gap", "force", "press", "event", "stuck", "slipped", "watched"]

GRAZING_RTOL = 1e-7
"""Rate of a guard over the sum of its terms below which it has no derivative [-]."""


@dataclass(frozen=True)
class Trigger:
    """A fired guard: of a contact, friction or users' event with this number."""

    kind: Kind
    number: int
    name: str


@dataclass(frozen=True)
class Numbers:
    """Numbers of contacts and frictions by name, and of guards that happen by themselves, with their names."""

    contacts: Mapping[str, int]
    frictions: Mapping[str, int]
    guards: Sequence[tuple[int, str]]

    @classmethod
    def of(cls, mechanism: Mechanism) -> Numbers:
        """Those of a mechanism, found once."""
        return mechanism.kept(Numbers, lambda: cls._of(mechanism.equations))

    @classmethod
    def _of(cls, equations: Equations) -> Numbers:
        contacts = {each.name: k for k, each in enumerate(equations.contacts)}
        frictions = {each.name: k for k, each in enumerate(equations.frictions)}
        own = [
            (e, guard.name) for e, guard in enumerate(equations.guards)
            if guard.transition is None or ("event", e) in guard.transition.causes
        ]  # fmt: skip
        return cls(contacts, frictions, own)

    def firing(self, events: Sequence[EventRecord]) -> list[tuple[int, str]]:
        """The guards by which some of these events happen: transitions that others cause follow from them."""
        happened = {event.name for event in events if event.kind == "event"}
        return [each for each in self.guards if each[1] in happened] if happened else []


def trigger(
    mechanism: Mechanism, events: Sequence[EventRecord], gaps: Vector, gap_rates: Vector, slip: Vector, time: float
) -> Trigger:
    """What ended the step, in which frictions slid with these signs.

    Raises
    ------
    CapabilityError
        where several did at one instant, with their names.
    """
    equations, numbers = mechanism.equations, Numbers.of(mechanism)
    closed = {event.name for event in events if event.kind == "closed"}
    found = [Trigger("event", e, name) for e, name in numbers.firing(events)]
    for name in sorted(closed):
        c = numbers.contacts[name]
        if equations.contacts[c].kind == "penalty" or gap_rates[c] < -REST_SPEED:
            pressed = equations.contacts[c].kind == "penalty" and abs(gaps[c]) > 1e-8
            found.append(Trigger("press" if pressed else "closed", c, name))
    others: list[Trigger] = []
    for event in events:
        if event.kind == "opened":
            contact = equations.contacts[numbers.contacts[event.name]]
            ruled = any(name in closed for name, _ in contact.when)
            kinds: dict[str, Kind] = {"gap": "gap", "pull": "pull" if contact.kind != "penalty" else "force"}
            if not ruled and contact.opens_on in kinds:
                others.append(Trigger(kinds[contact.opens_on], numbers.contacts[event.name], event.name))
        elif event.kind in ("stuck", "slipped"):
            f = numbers.frictions[event.name]
            others.append(Trigger("stuck" if slip[f] != 0.0 else "slipped", f, event.name))
    found = found or others
    if len(found) > 1:
        names = " and ".join(dict.fromkeys(repr(each.name) for each in found))
        raise sided(f"{names} happen at one instant, t = {time:.9g} s, and come in another order on each side of it")
    if not found:
        raise refused(f"what ended the step at t = {time:.9g} s is not known")
    return found[0]


def acts(equations: Equations, e: int, until: Any) -> bool:
    """Whether the motion depends on the event of a guard: it resets or ends something, or a machine knows it.

    until : what ends the run
    """
    guard, stop = equations.guards[e], until[0] if isinstance(until, tuple | list) else until
    taken = [other.transition.causes for other in equations.guards if other.transition is not None]
    named = any(("event", e) in causes or ("taken", e) in causes for causes in taken)
    return guard.reset is not None or guard.terminal or guard.transition is not None or named or guard.name == stop


def refused_graze(fired: Trigger, time: float, rate: float, terms: float) -> CapabilityError:
    """The error for a guard that hardly changes as it fires: its rate, and the terms that this is made of."""
    return refused(
        f"{fired.name!r} only grazes at t = {time:.9g} s: its guard changes at {rate:.3g} per second there, by "
        f"terms of {terms:.3g}, and its instant has no derivative"
    )
