"""Strides, numbers and curves of a gait that was measured, for the report in which simulations stand beside it."""

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from mbd.analysis.gait_report.curves import PERCENT, Curve, angles_of
from mbd.analysis.gait_report.measures import Measure
from mbd.analysis.gait_report.report import Walk
from mbd.analysis.gait_report.strides import Interval, Side, Stride, of_side, strides_between
from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.errors import TrajectoryError

WORDS = {"left": "left", "l": "left", "right": "right", "r": "right"}
"""Sides as files call them."""
STRIKES, OFFS = ("strike", "contact", "down", "hs", "fs", "ic"), ("off", "to", "fo")
"""Words of events at which a foot comes down and leaves."""
NAMED = (
    re.compile(r"^(?P<side>[LR])(?P<joint>Hip|Knee|Ankle)Angles?(\.x|\.X)?$"),
    re.compile(r"^(?P<joint>hip|knee|ankle)_(angle|flexion)_(?P<side>[lr])$"),
    re.compile(r"^(?P<side>left|right)[ _](?P<joint>hip|knee|ankle)(\.angle|[ _]angle|[ _]flexion)?$"),
)
"""Angles in the sagittal plane, as other programs and this one call them."""
STRIDE_SAMPLES = 1000
"""Samples of a stride from which its impulse is taken."""


@dataclass(frozen=True, eq=False)
class MeasuredGait:
    """What a report needs of a measured gait.

    Attributes
    ----------
    name : of the trial
    span : first and last time [s]
    stances : by word of a side, when its foot stands
    place : where a foot stands (3,) at a time [m]
    columns : by word of a side, (subject, quantity, unit, values at times): 'knee', 'angle', '°'
    force : normal and forward force of a side at times [N]; None where no plate measured
    without_strikes : what to try where strikes are missing
    """

    name: str
    span: Interval
    stances: Callable[[str], tuple[Interval, ...]]
    place: Callable[[str, float], Vector]
    columns: Callable[[str], list[tuple[str, str, str, Callable[[Vector], Vector]]]]
    force: Callable[[str, Vector], tuple[Vector, Vector] | None]
    without_strikes: str = ""

    def walk(self, title: str, words: Sequence[str], mass: float | None, strides: int | None) -> Walk:
        """Its strides, numbers and curves; energies are not known."""
        sides = self._sides(words, strides)
        measures = self._measures(sides, mass)
        return Walk(title, tuple(sides), tuple(measures), tuple(self._curves(sides, mass)), ())

    def _sides(self, words: Sequence[str], most: int | None) -> list[Side]:
        stances = {word: self.stances(word) for word in words}
        touches = sorted((begin, word) for word, own in stances.items() for begin, _ in own if begin > self.span[0])
        strikes: list[tuple[float, str, Matrix]] = []
        for begin, word in touches:
            if not strikes or strikes[-1][1] != word:
                strikes.append((begin, word, self.place(word, begin)))
        found = []
        for word, own in stances.items():
            strides = strides_between(word, own, strikes)[-most if most else None :]
            if not strides:
                times = ", ".join(f"{name} {time:.3f} s" for time, name, _ in strikes) or "none"
                raise TrajectoryError(
                    f"no whole stride of the side '{word}' in '{self.name}': a stride is from a strike to the next of "
                    f"the same side; strikes were {times}; they come from plates under each foot, or from events "
                    f"such as 'Left Foot Strike' and 'Left Foot Off'{self.without_strikes}"
                )
            found.append(Side(word, (), own, strides))
        return found

    def _measures(self, sides: Sequence[Side], mass: float | None) -> list[Measure]:
        rows = {side.name: [self._numbers(sides, side, stride, mass) for stride in side.strides] for side in sides}
        found = []
        for quantity, unit in next(iter(rows.values()))[0]:
            mean, spread = {}, {}
            for word, values in rows.items():
                column = np.array([each[quantity, unit] for each in values])
                known = column[np.isfinite(column)]
                mean[word] = float(np.mean(known)) if len(known) else float("nan")
                spread[word] = float(np.std(known)) if len(known) else float("nan")
            found.append(Measure(quantity, unit, mean, spread))
        return found

    def _numbers(
        self, sides: Sequence[Side], side: Side, stride: Stride, mass: float | None
    ) -> dict[tuple[str, str], float]:
        period, (step_time, step_length) = stride.duration, stride.step
        stance = (stride.off - stride.begin) / period * 100.0
        both = [
            max(0.0, min(b, d, stride.end) - max(a, c, stride.begin))
            for a, b in side.stances
            for other in sides
            if other is not side
            for c, d in other.stances
        ]
        times = np.linspace(stride.begin, stride.end, STRIDE_SAMPLES)
        forces = self.force(side.name, times)
        normal, forward = (np.full(STRIDE_SAMPLES, np.nan),) * 2 if forces is None else forces
        per, scale = ("", 1.0) if mass is None else ("/kg", 1.0 / mass)
        return {
            ("step length", "m"): step_length, ("step time", "s"): step_time, ("stride length", "m"): stride.length,
            ("stride time", "s"): period, ("speed", "m/s"): stride.length / period,
            ("cadence", "1/min"): 120.0 / period, ("stance", "%"): stance, ("swing", "%"): 100.0 - stance,
            ("double support", "%"): sum(both) / period * 100.0,
            ("clearance", "mm"): float("nan"),
            ("normal impulse", f"N s{per}"): scale * float(np.trapezoid(normal, times)),
            ("forward impulse", f"N s{per}"): scale * float(np.trapezoid(forward, times)),
            ("strike impulse", f"N s{per}"): float("nan"),
            ("peak normal force", f"N{per}"): scale * float(np.max(normal)),
        }  # fmt: skip

    def _curves(self, sides: Sequence[Side], mass: float | None) -> list[Curve]:
        per, scale = ("", 1.0) if mass is None else ("/kg", 1.0 / mass)
        found = []
        for side in sides:
            times = [stride.begin + PERCENT / 100.0 * stride.duration for stride in side.strides]
            for subject, quantity, unit, values in self.columns(side.name):
                own, factor = (unit, 1.0) if quantity == "angle" else (f"{unit}{per}", scale)
                found.append(_curve(side.name, subject, quantity, own, [factor * values(each) for each in times]))
            forces = [self.force(side.name, each) for each in times]
            if all(each is not None for each in forces):
                for k, quantity in enumerate(("normal force", "forward force")):
                    values_of = [scale * each[k] for each in forces if each is not None]
                    found.append(_curve(side.name, "ground", quantity, f"N{per}", values_of))
        return found


def _curve(side: str, subject: str, quantity: str, unit: str, samples: Sequence[Vector]) -> Curve:
    return Curve(side, subject, quantity, unit, np.mean(samples, axis=0), np.std(samples, axis=0))


def _through(time: Vector, values: Vector) -> Callable[[Vector], Vector]:
    return lambda times: np.asarray(np.interp(times, time, values))


# from inverse dynamics ------------------------------------------------------------------------------------------------
def gait_of_dynamics(found: Any) -> MeasuredGait:
    """Stances of the plates; angles, net moments and powers of the model.

    found : an `InverseDynamics`
    """
    run = found.run

    def own(word: str) -> list[Any]:
        plates = [p for p in found.plates if of_side(p.foot.full_name, word) or of_side(p.name, word)]
        if not plates:
            known = ", ".join(repr(plate.foot.full_name) for plate in found.plates) or "none"
            raise TrajectoryError(
                f"no plate under a foot of the side '{word}': names of feet have the word, and the plates are under "
                f"{known}"
            )
        return plates

    def stances(word: str) -> tuple[Interval, ...]:
        spans = [_spans(plate.record.time, plate.wrench[:, 1] > 0.0) for plate in own(word)]
        return tuple(sorted(span for each in spans for span in each))

    def place(word: str, time: float) -> Vector:
        plate = own(word)[0]
        name = plate.foot.full_name
        return np.array([np.interp(time, run.time, run[name][:, k]) for k in range(3)]) * [1.0, 0.0, 1.0]

    def columns(word: str) -> list[tuple[str, str, str, Callable[[Vector], Vector]]]:
        listed: list[tuple[str, str, str, Callable[[Vector], Vector]]] = []
        for angle in angles_of(run, word):
            listed.append((angle.subject, "angle", "°", _through(run.time, np.rad2deg(angle.shown * run[angle.name]))))
            moment = f"{angle.coordinate.removesuffix('.angle')}.net_moment"
            if angle.coordinate and moment in found:
                values, rate = found[moment], run[f"{angle.coordinate}.rate"]
                turned = angle.shown * angle.sign * values
                listed.append((angle.subject, "moment", "N m", _through(run.time, turned)))
                listed.append((angle.subject, "power", "W", _through(run.time, values * rate)))
        return listed

    def force(word: str, times: Vector) -> tuple[Vector, Vector]:
        wrenches = np.sum([plate.at(np.clip(times, *_ends(plate.record.time))) for plate in own(word)], axis=0)
        return wrenches[:, 1], wrenches[:, 0]

    return MeasuredGait(run.name, _ends(run.time), stances, place, columns, force)


# from a recording alone -----------------------------------------------------------------------------------------------
def gait_of_recording(recording: Any) -> MeasuredGait:
    """Stances of foot strikes among the events; angles that the file has; plates by the stance they fit best.

    recording : a `Recording`
    """
    events = [(time, *_event(label)) for time, label in recording.events]
    ends = _ends(recording.time)

    def stances(word: str) -> tuple[Interval, ...]:
        downs = sorted(time for time, side, kind in events if side == word and kind == "strike")
        offs = sorted(time for time, side, kind in events if side == word and kind == "off")
        spans = [(ends[0], offs[0])] if offs and (not downs or offs[0] < downs[0]) else []
        for k, down in enumerate(downs):
            later = [off for off in offs if off > down]
            until = later[0] if later else ends[1]
            spans.append((down, min(until, downs[k + 1]) if k + 1 < len(downs) else until))
        return tuple(spans)

    def place(word: str, time: float) -> Vector:
        name = _heel(recording.markers, word)
        if name is None:
            return np.full(3, np.nan)
        values = recording.markers[name]
        seen = np.isfinite(values).all(axis=1)
        return np.array([np.interp(time, recording.time[seen], values[seen, k]) for k in range(3)]) * [1.0, 0.0, 1.0]

    def columns(word: str) -> list[tuple[str, str, str, Callable[[Vector], Vector]]]:
        found: list[tuple[str, str, str, Callable[[Vector], Vector]]] = []
        for name, values in recording.channels.items():
            match = next((m for pattern in NAMED if (m := pattern.match(name))), None)
            if match is not None and WORDS[match["side"].lower()] == word:
                degrees = _through(recording.time, np.rad2deg(values))
                found.append((match["joint"].lower(), "angle", "°", degrees))
        return found

    def force(word: str, times: Vector) -> tuple[Vector, Vector] | None:
        if not recording.plates:
            return None
        total = np.zeros((2, len(times)))
        for plate in recording.plates:
            for first, last in _spans(plate.time, plate.force[:, 1] > 20.0):  # [N]
                best = max(("left", "right"), key=lambda side: _overlap((first, last), stances(side)))
                if best == word:
                    inside = (plate.time >= first) & (plate.time <= last)
                    for k, axis in enumerate((1, 0)):
                        values = np.where(inside, plate.force[:, axis], 0.0)
                        total[k] += np.interp(times, plate.time, values, left=0.0, right=0.0)
        return total[0], total[1]

    hint = "; a model tells whose foot is on its plates: mbd gait FILE --model leg.osim" if recording.plates else ""
    return MeasuredGait(recording.name, ends, stances, place, columns, force, hint)


def _event(label: str) -> tuple[str, str]:
    """Side and kind of an event.

    >>> _event("Left Foot Strike"), _event("RTO"), _event("start")
    (('left', 'strike'), ('right', 'off'), ('', ''))
    """
    words = re.findall(r"[a-z]+", label.lower())
    if len(words) == 1 and len(words[0]) == 3 and words[0][0] in "lr":
        words = [words[0][0], words[0][1:]]
    side = next((WORDS[word] for word in words if word in WORDS), "")
    kind = "strike" if any(w in STRIKES for w in words) else "off" if any(w in OFFS for w in words) else ""
    return (side, kind) if side and kind else ("", "")


def _heel(markers: Mapping[str, Any], word: str) -> str | None:
    letter = word[0]
    known = (f"{letter}hee", f"{letter}heel", f"{letter}cal", f"{letter}_heel", f"{letter}.heel", f"{word}_heel")
    found = {name.lower(): name for name in markers}
    return next((found[each] for each in known if each in found), None)


def _overlap(span: Interval, stances: Sequence[Interval]) -> float:
    """The largest part of a span and a stance that both have, over what either has."""
    a, b = span
    return max((max(0.0, min(b, d) - max(a, c)) / (max(b, d) - min(a, c)) for c, d in stances), default=0.0)


def _spans(time: Vector, acts: Any) -> list[Interval]:
    """First and last times of where something acts, for long enough."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], np.asarray(acts, dtype=int), [0]])))
    spans = [(float(time[a]), float(time[b - 1])) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return [(a, b) for a, b in spans if b - a >= 0.1]  # shorter loads [s] are no stance


def _ends(time: Vector) -> Interval:
    return float(time[0]), float(time[-1])
