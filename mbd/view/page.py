"""One self-contained HTML file that plays a run: no network, no libraries, our own small script."""

from collections import Counter
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix
from mbd.constraints.machine import SEPARATOR
from mbd.equal import ROUND_OFF_RTOL
from mbd.results.ledger import SPENT
from mbd.results.names import AXES
from mbd.results.summary import facts
from mbd.results.trajectory import Trajectory
from mbd.results.units import unit
from mbd.view.geometry import finite, geometry, packed, side, step_of
from mbd.view.instants import Instants
from mbd.view.plots import QUANTITIES, scale, stretches
from mbd.view.scene import Scene, scene
from mbd.view.style import CYCLE
from mbd.view.template import filled, part, written

MAX_FRAME_RATE = 60.0
"""Most pictures per second of run [1/s]."""

LEAST, MOST = 240, 6000
"""Fewest and most pictures of a page, for very short and very long runs."""


PLANAR = ("data.js", "stage.js", "flat.js", "charts.js", "controls.js")
SPATIAL = (
    "data.js", "stage.js", "facets.js", "depth.js", "space.js", "floor.js", "camera.js", "charts.js", "controls.js",
)  # fmt: skip
"""Parts of the page's script, joined into one function."""

MAX_CHARACTERS = 950_000
"""Characters of a spatial page, beyond which it leaves out pictures that others show by interpolation."""


def write(run: Trajectory, path: str | Path) -> Path:
    """Write the page of a run; see `Trajectory.page`."""
    return written(html(run), path)


def html(run: Trajectory) -> str:
    """The page as text; only that of a spatial mechanism has a camera."""
    picture = scene(run, pictures(run))
    text = _html(run, picture)
    if not picture.spatial or len(text) <= MAX_CHARACTERS:
        return text
    whole, tolerance = picture.instants, 1e-4  # over the size of the mechanism
    # places may be missed by that much of what curves may
    moving = np.hstack([_motion(picture), 0.1 * _curves(run, whole)])
    while len(text) > MAX_CHARACTERS and len(picture.instants.time) > LEAST:
        chosen = kept(whole.time, moving, tolerance)
        if len(chosen) < len(picture.instants.time):
            picture = scene(run, whole.part(chosen))
            text = _html(run, picture, ("pictures", _thinned(len(chosen), len(whole.time), tolerance)))
        tolerance *= 1.5
    return text


def _thinned(count: int, whole: int, tolerance: float) -> str:
    """What a page says of pictures that it leaves out."""
    missed = f"{100.0 * tolerance:.2g} % of the size of the mechanism"
    return f"{count} of {whole}; between them places are interpolated within {missed}"


def _curves(run: Trajectory, instants: Instants) -> Matrix:
    """Coordinates and their rates over the range of each, (F, k)."""
    names = [name for name, _ in run.facts.coordinates] + [name for name in run.facts.rates if name in run]
    values = instants.read(run, names)
    ranges = np.ptp(values, axis=0)
    return np.asarray(values / np.where(ranges > 0.0, ranges, 1.0))


def _html(run: Trajectory, picture: Scene, *more: tuple[str, str]) -> str:
    """The page of a scene, and what it says besides of the run."""
    data, title = content(run, picture), {"<!--title-->": escape(run.name)}
    data["facts"] = [*data["facts"], *more]
    if not data["spatial"]:
        return filled("player", data, {**title, "<!--camera-->": ""}, PLANAR)
    buttons = {"<!--camera-->": part("player", "camera.html")}
    return filled("player", data, {**title, **buttons}, SPATIAL, ("page.css", "camera.css"))


def pictures(run: Trajectory) -> int:
    """How many pictures a page has, besides those at events."""
    return int(np.clip(round(MAX_FRAME_RATE * float(run.time[-1] - run.time[0])), LEAST, MOST))


def content(run: Trajectory, picture: Scene) -> dict[str, Any]:
    """Everything the page draws, as plain lists; series are packed by `packed`."""
    return {
        "name": run.name,
        "time": [round(float(t), 9) for t in picture.instants.time],
        **geometry(picture),
        "contacts": [
            {
                "name": contact.name,
                "side": side(contact.name),
                "foot": bool(contact.place),
                "closed": stretches(run.time, run.record.closed[:, k]),
            }
            for k, contact in enumerate(run.facts.contacts)
        ]
        + [
            {
                "name": f"{mode}: {state}",
                "side": side(state) or side(mode),
                "foot": False,
                "closed": stretches(run.time, run[mode] == state),
            }
            for mode, states in run.facts.modes
            for state in states
        ],
        "events": _listed(run),
        "charts": _charts(run, picture.instants),
        "spin": _fastest(run),
        "facts": facts(run),
    }


SAMPLED = ("sample", "output")
"""What `mbd.SampledLaw` does without end, by the names of its events."""


def _listed(run: Trajectory) -> list[dict[str, Any]]:
    """The events, of which those of a sampled law are one line each, at the first, with how many there are."""
    modes = {name for name, _ in run.facts.modes}
    counts, found = Counter[Any](), dict[Any, dict[str, Any]]()
    for number, (event, loss) in enumerate(zip(run.events, losses(run), strict=True)):
        law, mark, what = event.name.partition(SEPARATOR)
        sampled = event.kind == "event" and mark and what in SAMPLED and law not in modes
        key = event.name if sampled and f"{law}.period" in run.parameters else number
        counts[key] += 1
        found.setdefault(key, {
            "time": event.time, "kind": event.kind, "name": event.name, "side": side(event.name), "loss": loss,
        })  # fmt: skip
    return [
        {**line, "name": f"{line['name']} × {counts[key]}"} if counts[key] > 1 else line for key, line in found.items()
    ]


def losses(run: Trajectory) -> list[float | None]:
    """The energy loss of each event [J]."""
    return [finite(event.energy_loss) for event in run.events]


def _charts(run: Trajectory, instants: Instants) -> list[dict[str, Any]]:
    """The energies, then the coordinates and their rates by unit."""
    ledger = run.energy
    floor = float(np.min(ledger.potential))
    acting = [part for part in ledger.parts if np.any(part.energy)]
    spent = [part for part in acting if part.kind in SPENT]
    given = [part for part in acting if part.kind not in SPENT]
    none = np.zeros(len(ledger.time))
    gone, gained = -sum((part.energy for part in spent), none), sum((part.energy for part in given), none)
    series = [
        ("total", "ink", ledger.total - floor),
        ("kinetic", CYCLE[2], ledger.kinetic),
        ("potential", CYCLE[3], ledger.potential - floor),
        *([("lost", CYCLE[4], gone)] if spent else []),
        *([("put in", CYCLE[5], gained)] if given else []),
    ]
    columns = [(name, shade, instants.blend(run, column)) for name, shade, column in series]
    charts = [_chart("energy", "J", columns)]
    coordinates = [name for name, _ in run.facts.coordinates]
    rates = [name for name in run.facts.rates if name in run]
    values = dict(zip([*coordinates, *rates], instants.read(run, [*coordinates, *rates]).T, strict=True))
    groups: dict[str, list[str]] = {}
    for name in values:
        groups.setdefault(unit(name, run.facts), []).append(name)
    acting_names = [name for name in run.names if _is_force(name, run)]
    forces = dict(zip(acting_names, instants.read(run, acting_names).T, strict=True))
    still = {"W": ROUND_OFF_RTOL * float(np.max(ledger.kinetic, initial=0.0)) / max(run.time[-1] - run.time[0], 1e-300)}
    for name, force in forces.items():
        if not np.max(np.abs(force), initial=0.0) <= still.get(unit(name, run.facts), 0.0):  # what sticks has no power
            groups.setdefault(unit(name, run.facts), []).append(name)
    values |= forces
    for kind, names in groups.items():
        text, factor = scale(kind, degrees=True)
        lines = [(name, CYCLE[k % len(CYCLE)], factor * values[name]) for k, name in enumerate(names)]
        charts.append(_chart(QUANTITIES.get(kind, "value"), text, lines))
    return charts


def _is_force(name: str, run: Trajectory) -> bool:
    """Whether a result is a force, moment or power of a contact, drive, spring or loss."""
    return name.endswith((".force", ".torque", ".power", ".friction.forward")) and bool(unit(name, run.facts))


def _fastest(run: Trajectory) -> dict[str, Any] | None:
    """What turns fastest, an angle or a body in space: name and greatest rate [rad/s]."""
    free = [name.removesuffix(".x") for name, _ in run.facts.velocities if name.endswith(".angular_velocity.x")]
    rates = {
        name: float(np.max(np.linalg.norm([run[name + axis] for axis in AXES], axis=0), initial=0.0))
        for name in free
        if f"{name}.x" in run
    } | {
        name: float(np.max(np.abs(run[f"{name}.rate"]), initial=0.0))
        for name, kind in run.facts.coordinates
        if kind == "rad" and f"{name}.rate" in run
    }
    name = max(rates, key=lambda each: rates[each], default="")
    return {"name": name, "rate": finite(rates[name])} if name else None


def _chart(title: str, kind: str, lines: list[tuple[str, str, Any]]) -> dict[str, Any]:
    step = step_of(*(values for _, _, values in lines))
    packs = [{"name": name, "color": shade, "values": packed(values, step)} for name, shade, values in lines]
    return {"title": title, "unit": kind, "series": packs}


def _motion(picture: Scene) -> Matrix:
    """All that a page interpolates, (F, k), over the size of the mechanism: places, and quaternions by half of it.

    A page divides interpolated quaternions by their length, which stays on the rotations; what is missed there is at
    most what the straight line misses here.
    """
    count, around = len(picture.instants.time), picture.around
    places = [picture.positions.reshape(count, -1), *(solid.center for solid in picture.solids)]
    places += [hinge.place for hinge in picture.hinges] + [each.center for each in around.rounds]
    places += [deck.place for deck in around.decks] + [push.place for push in picture.pushes]
    largest = max((float(np.max(np.abs(push.force))) for push in picture.pushes), default=0.0) or 1.0
    turns = [solid.turn for solid in picture.solids] + [hinge.axis for hinge in picture.hinges]
    turns += [wheel.spoke for wheel in around.wheels] + [deck.normal for deck in around.decks]
    size = max(float(np.max(np.ptp(picture.positions, axis=1), initial=0.0)), 1e-9)
    pushes = [push.force / (3.0 * largest) for push in picture.pushes]
    return np.hstack([*(place / size for place in places), *(0.5 * turn for turn in turns), *pushes])


def kept(time: NDArray[np.float64], moving: Matrix, tolerance: float) -> NDArray[np.int64]:
    """Numbers of the pictures to keep, as few as go one after the other: ends, both sides of events, and others so that
    straight lines between them miss no column by more than `tolerance`."""
    last = len(time) - 1
    held = np.zeros(last + 1, dtype=bool)
    held[[0, last]] = True
    twice = np.flatnonzero(np.diff(time) <= 0.0)
    held[twice] = held[twice + 1] = True
    ends = np.flatnonzero(held)
    found = [0]
    for stop in ends[1:]:
        while found[-1] < stop:
            found.append(_farthest(time, moving, found[-1], int(stop), tolerance))
    return np.array(found)


def _farthest(time: NDArray[np.float64], moving: Matrix, first: int, stop: int, tolerance: float) -> int:
    """The last picture to which one straight line leads from the first."""
    good = first + 1
    for end in range(first + 2, min(stop, first + 60) + 1):  # most pictures that one interval stands for
        share = (time[first + 1 : end] - time[first]) / (time[end] - time[first])
        line = moving[first] + share[:, None] * (moving[end] - moving[first])
        if float(np.max(np.abs(moving[first + 1 : end] - line))) > tolerance:
            break
        good = end
    return good
