"""What became of a walk, as a name: arrives, falls, scuffs, misses the event, ends otherwise, fails."""

from typing import Any

import numpy as np

from mbd.analysis.ending import FALLEN_HEIGHT_RATIO
from mbd.arrays import Vector
from mbd.dataclass import dataclass
from mbd.results.trajectory import Trajectory


@dataclass(frozen=True)
class Outcome:
    """How a walk went, in a word and in a sentence.

    kind : 'walks', 'arrives' (at the section), 'falls', 'scuffs', 'other event', 'misses' (the section is not reached),
        'wrong contacts', 'other states' (of modes), 'rests', 'not on the section', 'does not converge',
        'numerical error'
    text : 'falls backward at 0.41 s'; of a fall after the first return 'falls backward at 0.41 s after 'right foot''
    time : when [s], since the start, or since the return began that the text names
    """

    kind: str
    text: str
    time: float = float("nan")

    def __str__(self) -> str:
        return self.text

    @property
    def good(self) -> bool:
        """Whether the walk went on."""
        return self.kind in ("walks", "arrives")


def fall_of(run: Trajectory, stance: str) -> Outcome | None:
    """Whether a run is a fall, and to which side: of the highest point at first, beside the place of a stance foot.

    It fell where a terminal event with 'fall' in its name ended it, or where it is less than half as high over that
    foot as at first.
    Forward is where its highest point went first.
    """
    points = [name for body, frames in run.facts.segments for frame in frames for name in (f"{body}.{frame}", frame)]
    points = [name for name in dict.fromkeys(points) if f"{name}.x" in run]
    ending = (event for event in run.events if run.status == 1 and event.time == run.time[-1])
    named = next((event for event in ending if event.kind == "event" and "fall" in event.name.lower()), None)
    up = -np.array([run.parameters.get(f"gravity.{axis}", 0.0) for axis in "xyz"])
    size = float(np.linalg.norm(up))
    if len(points) < 2 or size == 0.0 or len(run) < 3:
        return None if named is None else Outcome("falls", f"falls at {named.time:.3g} s", named.time)
    whole = np.stack([run[name] for name in points])
    height = whole @ (up / size)
    top = int(np.argmax(height[:, 0]))
    place = next((contact.place for contact in run.facts.contacts if contact.name == stance), "")
    over = height[top] - run[place] @ (up / size) if place else np.ptp(height, axis=0)
    low = np.flatnonzero(over < FALLEN_HEIGHT_RATIO * float(over[0]))
    if named is None and not len(low):
        return None
    row = named.row if named is not None else int(low[0])
    when = float(run.time[row])
    side = _side(run, whole[top], up / size, row, place)
    return Outcome("falls", f"falls {side} at {when:.3g} s".replace("  ", " "), when)


def _side(run: Trajectory, top: Any, up: Vector, row: int, place: str) -> str:
    """'forward' or 'backward'; '' where the place of the stance foot is not known."""
    if not place:
        return ""
    ahead = _level(top[min(2, len(top) - 1)] - top[0], up)
    lean = _level(top[row] - run[place][row], up)
    return "forward" if float(ahead @ lean) > 0.0 else "backward"


def _level(vector: Vector, up: Vector) -> Vector:
    """The part across the vertical."""
    return np.asarray(vector - (vector @ up) * up)
