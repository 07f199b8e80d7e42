"""What a run came to: at rest, fallen, walking. Each is said by a rule on the rows, never guessed from names."""

from collections import Counter
from itertools import pairwise
from typing import Any

import numpy as np

from mbd.analysis.gait import gait
from mbd.arrays import Vector
from mbd.equal import EQUAL_RTOL, NOMINAL_RTOL
from mbd.notebook import Text
from mbd.results.summary import cost, entries, of_the_swing, strategy
from mbd.results.trajectory import Trajectory

FALLEN_HEIGHT_RATIO = 0.5
"""Height over that of the start below which a mechanism has fallen [-]."""


STEPS, PROGRESS = 3, 0.5
"""Steps that make a walk at least; distance of the last touchdown from the first over the way from each to the next."""


class Summary(Text):
    """Lines of text that show as such where a value is shown, in consoles too."""

    def __repr__(self) -> str:
        return str(self)


def summary(run: Trajectory) -> Summary:
    """The lines of `Trajectory.summary`."""
    lines = [f"{run.name}: {'' if run.success else 'failed: '}{run.message or 'no message'}"]
    pairs = [("run", _made(run)), ("ending", "; ".join(ending(run)))]
    counts = Counter(f"{event.name} {event.kind}" for event in run.events)
    listed = ", ".join(f"{count} × {what}" for what, count in counts.most_common(6))
    more = f", … ({len(counts)} sorts)" if len(counts) > 6 else ""
    pairs.append(("events", f"{len(run.record.events)}: {listed}{more}" if counts else "none"))
    if len(run):
        energy = run.energy
        swing = of_the_swing(energy)
        text = f"changed by {energy.change:.4g} J, of which numerical {energy.numerical[-1]:.2g} J"
        pairs.append(("energy", f"{text}, {swing}" if swing else text))
        pairs.append(("constraints", str(run.violation)))
    pairs.append(("cost", cost(run) or "not stored"))
    notes = run.stats.get("notes", ())
    if notes:
        pairs.append(("notes", f"{len(notes)}, in run.stats['notes']; the first: {notes[0]}"))
    return Summary("\n".join([*lines, *entries(pairs)]))


def ending(run: Trajectory) -> list[str]:
    """What the motion came to, a sentence for each rule that holds; see `Trajectory.summary`."""
    if len(run) < 2:
        return ["no step was taken"]
    found = [text for text in (_rest(run), _fall(run)) if text]
    walks = _walk(run)
    if walks and not any(text.startswith("fell") for text in found):
        found.append(walks)
    found = found or ["in motion"]
    closed = [contact.name for k, contact in enumerate(run.facts.contacts) if run.record.closed[-1, k]]
    return [*found, f"closed at the end: {', '.join(closed)}"] if closed else found


def _made(run: Trajectory) -> str:
    """Scheme, step or tolerance, rows, strategy of contacts."""
    settings = run.settings
    words = [str(settings.get("integrator", "scheme not stored"))]
    words += [f"{key} = {settings[key]:g}" for key in ("dt", "tol") if settings.get(key) is not None]
    if len(run):
        words.append(f"{run.time[0]:g} s to {run.time[-1]:g} s in {len(run)} rows")
    usual = settings.get("contact") == "events"
    return ", ".join([*words, *([] if usual or not strategy(run) else [strategy(run)])])


def _rest(run: Trajectory) -> str:
    kinetic = run.energy.kinetic
    span = 0.05 * (run.time[-1] - run.time[0])  # part of the run at its end over which it is to rest
    most, last = float(np.max(kinetic)), float(np.max(kinetic[run.time >= run.time[-1] - span]))
    if most == 0.0:
        return "at rest throughout"
    if not last <= NOMINAL_RTOL * most:
        return ""
    return (
        f"came to rest: kinetic energy below {last:.2g} J, {last / most:.1g} of its largest, for the last {span:.3g} s"
    )


def _sunk(run: Trajectory, height: float) -> str:
    """Of a contact that is ignored (`only_while`, a release): that its place is far below its surface."""
    for contact in run.facts.contacts:
        name = f"{contact.name}.gap"
        if contact.place and contact.unit == "m" and name in run:
            below = np.flatnonzero(run[name] < -0.25 * height)  # fallen by a quarter of the height
            if len(below):
                depth = -float(np.min(run[name]))
                return f"fell at {run.time[below[0]]:.3g} s: '{contact.name}' gets {depth:.3g} m below its surface"
    return ""


def _fall(run: Trajectory) -> str:
    """Of what stands on contacts with places and hangs on nothing: that it is less than half as high as at first."""
    places = {contact.place for contact in run.facts.contacts if contact.place}
    gravity = np.array([run.parameters.get(f"gravity.{axis}", 0.0) for axis in "xyz"])
    size = float(np.linalg.norm(gravity))
    points = _points(run)
    if not places or size == 0.0 or len(points) < 2:
        return ""
    whole = np.stack([run[name] for name in points])
    extent = float(np.max(np.ptp(whole, axis=1), initial=0.0))
    fixed = [
        name for name, place in zip(points, whole, strict=True) if np.max(np.ptp(place, axis=0)) <= EQUAL_RTOL * extent
    ]
    if any(name not in places for name in fixed):
        return ""
    height = whole @ (-gravity / size)
    reach = np.ptp(height, axis=0)
    if not reach[0] > EQUAL_RTOL * max(extent, float(np.max(reach))):  # flat from the start, but for round-off
        return ""
    if sunk := _sunk(run, float(reach[0])):
        return sunk
    if reach[-1] >= FALLEN_HEIGHT_RATIO * reach[0]:
        return ""
    top = points[int(np.argmax(height[:, 0]))]
    when = float(run.time[np.argmax(reach < FALLEN_HEIGHT_RATIO * reach[0])])
    return (
        f"fell: it is {reach[-1]:.3g} m high, {reach[0]:.3g} m at the start with {top!r} on top; below half of that "
        f"from t = {when:.4g} s"
    )


def _points(run: Trajectory) -> list[str]:
    """The points of the figure that results know."""
    names = [name for body, frames in run.facts.segments for frame in frames for name in (f"{body}.{frame}", frame)]
    return list(dict.fromkeys(name for name in names if f"{name}.x" in run))


def _walk(run: Trajectory) -> str:
    steps = gait(run).steps
    if len(steps) < STEPS:
        return ""
    places = {contact.name: contact.place for contact in run.facts.contacts}
    touched: list[Vector] = [run.at(step.time)[places[step.foot]] for step in steps]
    way = sum(float(np.linalg.norm(b - a)) for a, b in pairwise(touched))
    if not way > 0.0 or float(np.linalg.norm(touched[-1] - touched[0])) < PROGRESS * way:
        return ""
    last: Any = steps[-1]
    mean = sum(step.length for step in steps) / sum(step.period for step in steps)
    text = (
        f"walks: {len(steps)} steps at {mean:.4g} m/s; the last {last.length:.4g} m in {last.period:.4g} s, "
        f"{last.speed:.4g} m/s"
    )
    off = f", {last.deviation:.2g} off the one before with sides exchanged"
    return text + off if np.isfinite(last.deviation) else text
