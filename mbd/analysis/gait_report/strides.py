"""Sides, their feet, strikes and strides, read from the events of a run."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from mbd.arrays import Matrix
from mbd.dataclass import dataclass
from mbd.equal import NOMINAL_RTOL
from mbd.errors import TrajectoryError
from mbd.results.trajectory import Trajectory

SHORT = {"left": "l", "right": "r"}
"""Letters that stand for the words of sides in names of other programs."""

Interval = tuple[float, float]

SINGLE_SIDE = "all"
"""The side of a machine whose names have no words of sides: every foot and every joint is of it."""


@dataclass(frozen=True)
class Stride:
    """From a strike of a side to its next.

    begin, end : times of both [s]; off : the foot's leaving between them, NaN where it stays
    step : time and length of the step that the first strike ends, from the other side's strike before it; NaN: unknown
    length : between the places of both strikes [m]
    """

    begin: float
    end: float
    off: float
    step: tuple[float, float]
    length: float

    @property
    def duration(self) -> float:
        """end − begin [s]."""
        return self.end - self.begin


@dataclass(frozen=True)
class Side:
    """A side of a walker: its word, the contacts of its foot, when they stand, its strides."""

    name: str
    contacts: tuple[str, ...]
    stances: tuple[Interval, ...]
    strides: tuple[Stride, ...]


def of_side(name: str, side: str) -> bool:
    """Whether a name has the word of a side, or its letter before or after an underscore, as names in files have it.

    >>> of_side("left knee.angle", "left"), of_side("lefty", "left"), of_side("knee_angle_l.angle", "left")
    (True, False, True)
    """
    words = name.replace(".", " ").split()
    return side == SINGLE_SIDE or side in words or any(_is_of(part, side) for word in words for part in _parts(word))


def base_name(name: str, side: str) -> str:
    """A name without the word of its side.

    >>> base_name("left knee", "left"), base_name("knee_angle_l", "left")
    ('knee', 'knee')
    """
    words = [word for word in name.split() if word != side]
    if any(_is_of(part, side) for word in words for part in _parts(word)):
        words = [part for word in words for part in word.split("_") if part and not _is_of(part, side)]
        words = words[:-1] if len(words) > 1 and words[-1] == "angle" else words
    return " ".join(words)


def _parts(word: str) -> list[str]:
    """What underscores part."""
    return word.split("_") if "_" in word else []


def _is_of(part: str, side: str) -> bool:
    return part.lower() in (side, SHORT.get(side))


def words_of(run: Trajectory) -> tuple[str, ...]:
    """'left' and 'right' where a foot has one of these words or there is none, else `SINGLE_SIDE` (hoppers, wheels)."""
    usual, feet = ("left", "right"), _feet(run)
    return usual if not feet or any(of_side(name, side) for name in feet for side in usual) else (SINGLE_SIDE,)


def _feet(run: Trajectory) -> list[str]:
    """Names of the contacts that have a place on the ground."""
    return [contact.name for contact in run.facts.contacts if contact.place and contact.unit == "m"]


def sides_of(run: Trajectory, names: Sequence[str], most: int | None = None) -> list[Side]:
    """The sides of a run with their strides, or the last ones of them.

    Of a single side each strike ends a stride: that of a contact after all others of the side have left, as of a wheel
    whose spokes strike one after the other.

    A strike is a foot's first touch after one of the other side; where a foot touches more than once between two
    strikes, it leaves where its longest time in the air begins. A foot that stands alone at the start has just struck,
    unless it is one of a force law that pushes already.

    Raises
    ------
    TrajectoryError
        where a side has no foot, or makes no whole stride.
    """
    feet = _feet(run)
    contacts = {side: tuple(name for name in feet if of_side(name, side)) for side in names}
    for side, own in contacts.items():
        if not own:
            known = ", ".join(map(repr, feet)) or "none"
            wanted = (
                "give sides=(…, …), the words of both sides, or of one alone"
                if feet
                else ("a report needs a foot, a contact of a point of a body with the ground")
            )
            raise TrajectoryError(
                f"no foot of the side '{side}': its contacts with the ground have the word in their names, and the run "
                f"has {known}; {wanted}"
            )
    stances = {side: _stances(run, own) for side, own in contacts.items()}
    strikes = _strikes(run, contacts, stances) if len(names) > 1 else _strikes_alone(run, names[0], contacts[names[0]])
    found = [
        Side(side, own, stances[side], strides_between(side, stances[side], strikes)[-most if most else None :])
        for side, own in contacts.items()
    ]
    for each in found:
        if not each.strides:
            times = ", ".join(f"{name} {time:.3f} s" for time, name, _ in strikes) or "none"
            raise TrajectoryError(
                f"no whole stride of the side '{each.name}' in '{run.name}': a stride is from a strike to the next of "
                f"the same side; strikes were {times}; simulate longer, or see run.events"
            )
    return found


def _stances(run: Trajectory, contacts: Sequence[str]) -> tuple[Interval, ...]:
    """When at least one of some contacts is closed."""
    columns = [contact.name for contact in run.facts.contacts]
    closed = {name for name in contacts if len(run) and run.record.closed[0, columns.index(name)]}
    begin = float(run.time[0]) if closed else None
    found: list[Interval] = []
    for event in run.events:
        if event.name not in contacts or event.kind not in ("closed", "opened"):
            continue
        (closed.add if event.kind == "closed" else closed.discard)(event.name)
        if closed and begin is None:
            begin = event.time
        elif not closed and begin is not None:
            found.append((begin, event.time))
            begin = None
    return (*found, (begin, float("inf"))) if begin is not None else tuple(found)


def _strikes(
    run: Trajectory, contacts: dict[str, tuple[str, ...]], stances: dict[str, tuple[Interval, ...]]
) -> list[tuple[float, str, Matrix]]:
    """(time, side, place) of the strikes in turn."""
    start = float(run.time[0])
    places = {contact.name: contact.place for contact in run.facts.contacts}
    standing = [side for side, found in stances.items() if found and found[0][0] == start]
    touches = sorted((begin, side) for side, found in stances.items() for begin, _ in found)
    strikes: list[tuple[float, str, Matrix]] = []
    for time, side in touches:
        late = time == start and (len(standing) > 1 or _pushes_at_start(run, contacts[side]))
        if late or (strikes and strikes[-1][1] == side):
            continue
        rows = [event for event in run.events if event.kind == "closed" and event.time == time]
        own = next((event.name for event in rows if event.name in contacts[side]), contacts[side][0])
        strikes.append((time, side, np.asarray(run.at([time])[places[own]][0])))
    return strikes


def _strikes_alone(run: Trajectory, side: str, contacts: Sequence[str]) -> list[tuple[float, str, Matrix]]:
    """(time, side, place) of the strikes of a single side: of contacts that closed as all others had left."""
    columns = [contact.name for contact in run.facts.contacts]
    places = {contact.name: contact.place for contact in run.facts.contacts}
    closed = {name for name in contacts if len(run) and run.record.closed[0, columns.index(name)]}
    begins = [(float(run.time[0]), min(closed))] if len(closed) == 1 and not _pushes_at_start(run, contacts) else []
    events = [event for event in run.events if event.name in contacts and event.kind in ("closed", "opened")]
    for time in dict.fromkeys(event.time for event in events):
        before, now = set(closed), [event for event in events if event.time == time]
        for event in now:
            (closed.add if event.kind == "closed" else closed.discard)(event.name)
        new = [event.name for event in now if event.kind == "closed" and event.name in closed]
        if new and not before & (closed - set(new)):
            begins.append((time, new[0]))
    return [(time, side, np.asarray(run.at([time])[places[name]][0])) for time, name in begins]


def _pushes_at_start(run: Trajectory, contacts: Sequence[str]) -> bool:
    """Whether a foot of a force law pushes in the first row, so that it has struck before."""
    own = [each.name for each in run.facts.contacts if each.name in contacts and each.kind == "penalty"]
    forces = [run[f"{name}.force"] for name in own]
    return any(force[0] > NOMINAL_RTOL * np.max(force) for force in forces)


def strides_between(
    side: str, stances: Sequence[Interval], strikes: Sequence[tuple[float, str, Matrix]]
) -> tuple[Stride, ...]:
    """From strike to strike of a side."""
    own = [k for k, (_, name, _) in enumerate(strikes) if name == side]
    found = []
    for first, second in pairwise(own):
        (begin, _, place), (end, _, there) = strikes[first], strikes[second]
        step = (float("nan"), float("nan"))
        if first > 0:
            before, _, other = strikes[first - 1]
            step = (begin - before, _ahead(place - other, there - place))
        found.append(Stride(begin, end, _leaving(stances, begin, end), step, float(np.linalg.norm(there - place))))
    return tuple(found)


def _ahead(step: Matrix, stride: Matrix) -> float:
    """Length of a step [m]: in the plane its own, in space its part along the stride, without the width of the step."""
    way = float(np.linalg.norm(stride))
    if (step[2] == 0.0 and stride[2] == 0.0) or way == 0.0:
        return float(np.linalg.norm(step))
    return abs(float(step @ stride)) / way


def _leaving(stances: Sequence[Interval], begin: float, end: float) -> float:
    """When the longest time in the air between two strikes begins [s]."""
    inside = [(a, b) for a, b in stances if begin <= a < end and b < end]
    starts = [*(a for a, _ in stances if begin < a < end), end]
    gaps = [(min(start for start in starts if start > b) - b, b) for _, b in inside if any(s > b for s in starts)]
    return max(gaps)[1] if gaps else float("nan")
