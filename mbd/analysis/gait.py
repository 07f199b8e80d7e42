"""Steps of a walker, read from the events of a run.

A step goes from one touchdown to the next of another foot. A foot is a body with contacts of points with the ground, so
that heel and toe are one; where there is one such body only, as a wheel of spokes, each contact is, once the one before
has left the ground.
"""

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from mbd.arrays import Matrix
from mbd.dataclass import dataclass
from mbd.notebook import table as html_table
from mbd.results.record import EventRecord
from mbd.results.trajectory import Trajectory

SPATIAL = ("solid", "limb", "hinge")
"""Kinds of shapes that runs in space have alone."""


@dataclass(frozen=True)
class Step:
    """From one touchdown to the next.

    time : of the touchdown that ends it [s]; foot : that touches down; period [s]; length : between the two places on
    the ground, in space along the stride [m]; loss : energy taken by all impacts of the step, its
    own touchdown included [J]
    deviation : largest difference of the state just after this touchdown from the one before, sides exchanged and in
    space reflected too [rad, rad/s, m/s]: zero for a walk that repeats itself; NaN where there is nothing to compare
    with. Where a walker is, and how what turns freely is turned, do not count
    """

    time: float
    foot: str
    period: float
    length: float
    loss: float
    deviation: float

    @property
    def speed(self) -> float:
        """length/period [m/s]."""
        return self.length / self.period


@dataclass(frozen=True)
class Gait:
    """The steps of a run."""

    steps: tuple[Step, ...]

    def __len__(self) -> int:
        return len(self.steps)

    def __getitem__(self, number: int) -> Step:
        return self.steps[number]

    def __repr__(self) -> str:
        return self.table()

    def _repr_html_(self) -> str:
        heads = ("step", "time [s]", "period [s]", "length [m]", "speed [m/s]", "loss [J]", "deviation", "foot")
        rows = [
            (
                str(number), step.time, step.period, step.length, step.speed, step.loss,
                f"{step.deviation:.2e}" if np.isfinite(step.deviation) else None, step.foot,
            )
            for number, step in enumerate(self.steps, start=1)
        ]  # fmt: skip
        return html_table("steps", heads, rows)

    def table(self, most: int = 24) -> str:
        """The steps as lines of text; of a long walk the first and the last."""
        titles = ("step", "time [s]", "period [s]", "length [m]", "speed [m/s]", "loss [J]", "deviation")
        lines = ["".join(f"{title:>12}" for title in titles) + "  foot"]
        shown = list(enumerate(self.steps, start=1))
        hidden = len(shown) - most
        for number, step in shown if hidden <= 0 else shown[: most // 2]:
            lines.append(_line(number, step))
        if hidden > 0:
            lines.append(f"{'…':>12} {hidden} more")
            lines += [_line(number, step) for number, step in shown[-(most - most // 2) :]]
        return "\n".join(lines)

    def as_json(self) -> list[dict[str, Any]]:
        """One dictionary a step; None for what is not defined."""
        return [
            {
                "time": step.time, "foot": step.foot, "period": step.period, "length": step.length,
                "speed": step.speed, "loss": step.loss,
                "deviation": step.deviation if np.isfinite(step.deviation) else None,
            }
            for step in self.steps
        ]  # fmt: skip


def _line(number: int, step: Step) -> str:
    deviation = f"{step.deviation:.2e}" if np.isfinite(step.deviation) else "–"
    values = f"{step.time:>12.5f}{step.period:>12.6f}{step.length:>12.6f}{step.speed:>12.5f}{step.loss:>12.5f}"
    return f"{number:>12}{values}{deviation:>12}  {step.foot}"


def gait(run: Trajectory) -> Gait:
    """The steps of a walker; none for a mechanism without feet that alternate.

    A foot that stands alone at the start counts as having just touched down.
    """
    feet = {contact.name: contact for contact in run.facts.contacts if contact.place}
    strikes = _strikes(run, list(feet))
    if len(strikes) < 2:
        return Gait(())
    places = np.array([run[feet[event.name].place][event.row] for event in strikes])
    states = _states(run, [event.row for event in strikes])
    pairs = _compared(run, states.keys())
    impacts = run.energy.by_kind().get("impact", np.zeros(len(run)))
    steps = []
    for number, (before, after) in enumerate(pairwise(strikes)):
        lost = float(impacts[before.row] - impacts[after.row])
        change = [float(abs(states[mine][number + 1] - sign * states[other][number])) for mine, other, sign in pairs]
        length = _length(places, number)
        deviation = max(change, default=float("nan"))
        steps.append(Step(after.time, after.name, after.time - before.time, length, lost, deviation))
    return Gait(tuple(steps))


def _length(places: Matrix, number: int) -> float:
    """Length of a step [m]: in the plane its own, in space its part along the stride, which has no width."""
    step = places[number + 1] - places[number]
    first = number - 1 if number > 0 else number
    stride = places[min(first + 2, len(places) - 1)] - places[first]
    way = float(np.linalg.norm(stride))
    if (step[2] == 0.0 and stride[2] == 0.0) or way == 0.0:
        return float(np.linalg.norm(step))
    return abs(float(step @ stride)) / way


def _compared(run: Trajectory, names: Iterable[str]) -> list[tuple[str, str, float]]:
    """(name, its mirror image, sign of that); none of a walker in space with sides, of which no mirror is known."""
    pairs, signs = mirrored(names), dict(run.facts.mirror)
    if (
        not signs
        and any(mine != other for mine, other in pairs)
        and any(shape.kind in SPATIAL for shape in run.facts.shapes)
    ):
        return []
    return [(mine, other, signs.get(mine, 1.0)) for mine, other in pairs]


def _strikes(run: Trajectory, feet: Sequence[str]) -> list[EventRecord]:
    """The touchdowns of feet in turn."""
    names = [contact.name for contact in run.facts.contacts]
    bodies = _bodies(run)
    alone = len({bodies[foot] for foot in feet}) == 1
    standing = [foot for foot in feet if len(run) and run.record.closed[0, names.index(foot)]]
    starts = len(standing) == 1 if alone else len({bodies[foot] for foot in standing}) == 1
    found = [EventRecord(float(run.time[0]), "closed", standing[0])] if starts else []
    for event in run.events:
        if event.kind != "closed" or event.name not in feet:
            continue
        last = found[-1].name if found else ""
        same = event.name == last if alone else bool(last) and bodies[event.name] == bodies[last]
        if same or (alone and last and run.record.closed[event.row, names.index(last)]):
            continue
        found.append(event)
    return found


def _bodies(run: Trajectory) -> dict[str, str]:
    """The body of each contact's point; the point itself where no figure tells."""
    owners = {f"{body}.{frame}": body for body, frames in run.facts.segments for frame in frames}
    return {contact.name: owners.get(contact.place, contact.place) for contact in run.facts.contacts}


def _states(run: Trajectory, rows: Sequence[int]) -> dict[str, Any]:
    """Angles and rates just after the touchdowns, by name; unsided lengths are left out, for a walker moves on."""
    facts = run.facts
    sided = {name for pair in mirrored(name for name, _ in facts.coordinates) for name in pair if _swap(name) != name}
    found: dict[str, Any] = {}
    for name, unit in facts.coordinates[: facts.coordinate_count]:
        if name in sided or (unit == "rad" and sided):
            found[name] = run[name][list(rows)]
        if f"{name}.rate" in run:
            found[f"{name}.rate"] = run[f"{name}.rate"][list(rows)]
    found |= {name: run[name][list(rows)] for name, _ in facts.velocities}
    return found


def _swap(name: str) -> str:
    """The name with left and right exchanged."""
    exchange = {"left": "right", "right": "left"}
    return " ".join(exchange.get(word, word) for word in name.split(" "))


def mirrored(names: Any) -> list[tuple[str, str]]:
    """(name, its mirror image) for every name whose mirror image is also one.

    >>> mirrored(["left hip.angle", "right hip.angle", "trunk.x"])
    [('left hip.angle', 'right hip.angle'), ('right hip.angle', 'left hip.angle'), ('trunk.x', 'trunk.x')]
    """
    known = list(names)
    return [(name, _swap(name)) for name in known if _swap(name) in known]
