"""Impulses of a run as a table: of the contacts that closed, and of all that took part in the same impacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

from mbd.dataclass import dataclass
from mbd.notebook import table
from mbd.results.facts import Facts
from mbd.results.record import MAX_SHOWN_EVENTS, EventRecord

if TYPE_CHECKING:
    from pandas import DataFrame

WAYS = ("forward", "sideways")
"""Directions in which a disk or a ball rolls."""


@dataclass(frozen=True)
class Impulse:
    """One component of the impulse that a contact, or dry friction in a joint, took in an impact.

    Parameters
    ----------
    time : instant of the impact [s]
    event : contact that closed (or opened) then, whose record has it
    name : what took it: that contact, or one that was closed already, a wheel that rolls while one is, a joint with
        dry friction
    part : 'normal', 'friction', or the direction of friction where there are several ('forward', 'sideways'), 'spin'
    impulse : [unit]; a normal one that pushes is ≥ 0
    unit : 'N s' or 'N m s'
    """

    time: float
    event: str
    name: str
    part: str
    impulse: float
    unit: str


class Impulses(list[Impulse]):
    """Impulses in order of time; each impulse of a run once."""

    def to_dataframe(self) -> DataFrame:
        """A pandas table, a line for each impulse."""
        from mbd.results.tables import library

        pandas = library("pandas", "data", "run.impulses.to_dataframe()")
        return pandas.DataFrame([asdict(one) for one in self], columns=list(Impulse.__dataclass_fields__))

    def __repr__(self) -> str:
        if not self:
            return "no impulses"
        hidden, half = max(len(self) - MAX_SHOWN_EVENTS, 0), MAX_SHOWN_EVENTS // 2
        shown = [*map(_line, self[:half]), f"  … {hidden} more", *map(_line, self[-half:])]
        return "\n".join(["  time [s]    impulse", *(shown if hidden else map(_line, self))])

    def _repr_html_(self) -> str:
        hidden, half = max(len(self) - MAX_SHOWN_EVENTS, 0), MAX_SHOWN_EVENTS // 2
        shown = [*self[:half], *self[-half:]] if hidden else self
        rows = [(f"{one.time:.6f}", one.event, one.name, one.part, f"{one.impulse:.4g}", one.unit) for one in shown]
        titles = ("time [s]", "event", "taken by", "part", "impulse", "unit")
        return table("impulses", titles, rows, f"{hidden} more between the first {half} and the last" if hidden else "")


def impulses_of(events: Sequence[EventRecord], facts: Facts, names: Sequence[str]) -> Impulses:
    """The impulses of some events; zeros of contacts that closed without one are left out.

    names : results of the run, which tell how directions of friction are called
    """
    units = {contact.name: contact.unit for contact in facts.contacts}
    directions: dict[str, list[str]] = {}
    rolling: dict[str, list[str]] = {}
    for name in names:
        stem, _, part = name.rpartition(".")
        if part == "force" and stem.rpartition(".")[2] in WAYS:
            rolling.setdefault(stem.rpartition(".")[0], []).append(stem.rpartition(".")[2])
        if stem.endswith(".friction"):
            directions.setdefault(stem.removesuffix(".friction"), []).append(part)
    spinning = {name.removesuffix(".spin.torque") for name in names if name.endswith(".spin.torque")}
    torques = {name for name, unit in facts.frictions if unit == "N m"}
    found = Impulses()
    for event in events:
        for name, values in (event.impulses or {event.name: event.impulse}).items():
            if not values.any():
                continue
            sides, spin = directions.get(name, []), ["spin"] * (name in spinning)
            along = len(values) - 1 - len(spin)
            sides = sides if len(sides) > 1 and len(sides) == along else ["friction"] * along
            own = rolling.get(name, [])
            own = own if len(own) == len(values) else ["friction"] * len(values)
            parts = ["normal", *sides, *spin] if name in units else own
            unit = "N m s" if name in torques or units.get(name) == "rad" else "N s"
            found += [
                Impulse(event.time, event.name, name, part, float(value), "N m s" if part == "spin" else unit)
                for part, value in zip(parts, values, strict=True)
            ]
    return found


def _line(one: Impulse) -> str:
    beside = "" if one.name == one.event else f", in the impact of {one.event!r}"
    return f"  {one.time:<10.6f}  {one.impulse:.4g} {one.unit} of {one.name!r}, {one.part}{beside}"
