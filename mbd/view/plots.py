"""Plots of a run with matplotlib; nothing here needs a display.

Every function returns the figure; with `path` it is saved, and no window manager is asked for.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.errors import ModelError, TrajectoryError
from mbd.results.archive import named_file, write_whole
from mbd.results.interpolation import Grid
from mbd.results.ledger import SPENT, Ledger, Part
from mbd.results.tables import library
from mbd.results.trajectory import Trajectory
from mbd.results.units import unit
from mbd.view import vector
from mbd.view.curves import curves, extremes
from mbd.view.style import CYCLE, INK, NEUTRAL, as_label, color, rules, tone

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_EVENT_LINES = 60
"""Events beyond this number are left to the contact bars, so that lines do not hide the curves."""


QUANTITIES = {
    "rad": "angle", "m": "length", "rad/s": "angular rate", "m/s": "speed", "rad/s²": "angular acceleration",
    "m/s²": "acceleration", "N": "force", "N m": "torque", "J": "energy", "W": "power",
}  # fmt: skip


def scale(kind: str, degrees: bool) -> tuple[str, float]:
    """The unit of an axis and how many of it a unit of SI is: angles in degrees, if wanted.

    >>> scale("rad/s", True)[0], scale("rad/s", False), scale("m", True)
    ('°/s', ('rad/s', 1.0), ('m', 1.0))
    """
    if degrees and kind in ("rad", "rad/s", "rad/s²"):
        return kind.replace("rad", "°"), 180.0 / math.pi
    return kind, 1.0


@contextmanager
def drawing(path: str | Path | None, width: float, height: float) -> Iterator[Figure]:
    """A figure in the package's style, laid out and saved at the end."""
    matplotlib = library("matplotlib", "plot", "plotting")
    look = rules()
    size = {"figsize": (width, height), "layout": "constrained", "dpi": look["figure.dpi"]}
    if path is None:  # made outside the context, in which a notebook would set up pyplot for its length alone
        from matplotlib import pyplot

        from mbd.view.windows import OnceShown

        figure: Figure = pyplot.figure(FigureClass=OnceShown, facecolor=look["figure.facecolor"], **size)
    else:
        from matplotlib import figure as figures

        figure = figures.Figure(facecolor=look["figure.facecolor"], **size)
    with matplotlib.rc_context(look):
        yield figure
        if path is not None:
            named_file(path)
            kind = Path(path).suffix.removeprefix(".") or str(matplotlib.rcParams["savefig.format"])
            if kind not in (known := figure.canvas.get_supported_filetypes()):
                raise ModelError(f"path={str(path)!r}: pictures end in {', '.join(f'.{each}' for each in known)}")
            _lay_out(figure, look)
            target = Path(path) if Path(path).suffix else Path(path).with_name(f"{Path(path).name}.{kind}")
            if kind == "svg":
                write_whole(target, lambda partial: vector.save(figure, partial))
            else:
                fast: dict[str, Any] = {"pil_kwargs": {"compress_level": 3}} if kind == "png" else {}
                write_whole(target, lambda partial: figure.savefig(partial, format=kind, **fast))


def _lay_out(figure: Figure, look: dict[str, Any]) -> None:
    """Find the places of a figure's panels; `savefig` would draw the whole figure once more for that."""
    figure.set_dpi(look["savefig.dpi"])
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
    figure.set_layout_engine(None)  # not "none", which `savefig` takes for an engine


def histories(run: Trajectory, *names: str, path: str | Path | None = None, degrees: bool = True) -> Figure:
    """Quantities over time, one panel per unit, events as thin lines, contacts as bars below and as shades.

    A vector's name draws its three components. Without names: the coordinates of the model. Angles are drawn in
    degrees, or in radians; results stay in radians.
    """
    wanted = names or tuple(name for name, _ in run.facts.coordinates)
    files = [name for name in wanted if str(name).endswith((".png", ".svg", ".pdf")) and name not in run]
    if files:
        raise TrajectoryError(f"plot draws results by name; give a file as path, plot(path={files[0]!r})")
    scalars = list(dict.fromkeys(part for name in wanted for part in run.columns.components(name)))
    time, values = curves(run, scalars)
    panels: dict[str, list[str]] = {}
    for name in scalars:
        panels.setdefault(unit(name, run.facts), []).append(name)
    bars = len(run.facts.contacts) + len(run.facts.modes)
    heights = [2.1 + 0.17 * ((len(group) - 1) // 4) for group in panels.values()]
    heights += [0.25 + 0.2 * bars] if bars else []
    with drawing(path, 7.4, 0.7 + sum(heights)) as figure:
        grid = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
        for axes, (kind, group) in zip(grid, panels.items(), strict=False):
            text, factor = scale(kind, degrees)
            for number, name in enumerate(group):
                style = ("-", "--")[number // len(CYCLE) % 2]
                shown = extremes(time, values[name])
                shade = tone(CYCLE[number % len(CYCLE)])
                axes.plot(time[shown], factor * values[name][shown], style, color=shade, label=as_label(name))
            axes.set_ylabel(f"{QUANTITIES.get(kind, 'value')} [{as_label(text)}]" if kind else "value")
            _shade(axes, run, wanted)
            _mark(axes, run)
            _legend(axes, len(group))
        if bars:
            _bars(grid[-1], run)
        grid[-1].set_xlabel("time [s]")
        if len(run) and run.time[-1] > run.time[0]:
            grid[-1].set_xlim(run.time[0], run.time[-1])
        figure.suptitle(as_label(run.name), x=0.01, ha="left", fontweight="bold")
    return figure


def _legend(axes: Any, count: int) -> None:
    """Names above the panel, where they cover nothing."""
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=min(count, 4), borderaxespad=0.2)


def _mark(axes: Any, run: Trajectory) -> None:
    """A thin line where a contact closed, friction stuck or slipped, or a user's event happened."""
    _lines(
        axes, [(event.time, "" if event.kind == "event" else event.name) for event in run.events
               if event.kind != "opened"]
    )  # fmt: skip


def _lines(axes: Any, marks: Sequence[tuple[float, str]], above: bool = False) -> None:
    """A thin line at each (time, name), in the color of its side; black without a name; above areas or below curves."""
    if 0 < len(marks) <= MAX_EVENT_LINES:
        shades = [color(name) if name else tone(INK) for _, name in marks]
        look: dict[str, Any] = {"linewidth": 0.7, "alpha": 0.35, "linestyle": ":", "zorder": 2.5 if above else 0.5}
        _upright(axes, [time for time, _ in marks], 0.0, 1.0, colors=shades, **look)


def _upright(axes: Any, times: Sequence[float], low: float, high: float, **look: Any) -> None:
    """Lines at these times between two parts of the height of a panel, whose limits do not follow them."""
    from matplotlib.collections import LineCollection

    lines = LineCollection([[(time, low), (time, high)] for time in times], **look)
    lines.set_transform(axes.get_xaxis_transform())
    axes.add_collection(lines, autolim=False)


def _shade(axes: Any, run: Trajectory, wanted: Sequence[str]) -> None:
    """The times at which contacts are closed: of those asked for by name, else of feet, else of all; a shade a side."""
    contacts = [
        contact for contact in run.facts.contacts if any(name.startswith(f"{contact.name}.") for name in wanted)
    ]
    contacts = contacts or [contact for contact in run.facts.contacts if contact.place] or list(run.facts.contacts)
    from matplotlib.collections import PolyCollection

    closed: dict[str, Any] = {}
    for contact in contacts:
        column = run.record.closed[:, run.facts.contacts.index(contact)].astype(bool)
        closed[color(contact.name)] = closed.get(color(contact.name), False) | column
    for side, rows in closed.items():
        spans = stretches(run.time, rows)
        if len(spans) <= MAX_EVENT_LINES:
            corners = [[(begin, 0.0), (begin, 1.0), (end, 1.0), (end, 0.0)] for begin, end in spans]
            bands = PolyCollection(corners, color=side, alpha=0.09, linewidth=0, zorder=0.2)
            bands.set_transform(axes.get_xaxis_transform())
            axes.add_collection(bands, autolim=False)


def _bars(axes: Any, run: Trajectory) -> None:
    """One bar per stretch of time in which a contact is closed, or a mode in a state, whose name it bears."""
    names = [contact.name for contact in run.facts.contacts]
    for row, name in enumerate(names):
        spans = stretches(run.time, run.record.closed[:, row])
        axes.broken_barh([(a, b - a) for a, b in spans], (row - 0.32, 0.64), color=color(name), alpha=0.85, linewidth=0)
    whole = float(run.time[-1] - run.time[0]) if len(run) else 0.0
    for row, (mode, states) in enumerate(run.facts.modes, len(names)):
        names.append(mode)
        for number, state in enumerate(states):
            spans, shade = stretches(run.time, run[mode] == state), tone(CYCLE[number % len(CYCLE)])
            axes.broken_barh([(a, b - a) for a, b in spans], (row - 0.32, 0.64), color=shade, alpha=0.45, linewidth=0)
            for a, b in spans:
                # share of the time of a run that a letter of the name of a state takes in its bar
                if b - a > 0.012 * len(state) * whole:
                    axes.text(0.5 * (a + b), row, as_label(state), ha="center", va="center", fontsize="x-small")
    axes.set_yticks(range(len(names)), [as_label(name) for name in names])
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0)
    axes.grid(False, axis="y")
    axes.spines["left"].set_visible(False)


def stretches(time: Any, closed: Any) -> list[tuple[float, float]]:
    """(begin, end) of each stretch of rows in which a contact is closed [s]."""
    padded = np.concatenate([[0], np.asarray(closed, dtype=np.int8), [0]])
    change = np.flatnonzero(np.diff(padded))
    return [(float(time[a]), float(time[b - 1])) for a, b in zip(change[::2], change[1::2], strict=True)]


def contacts(run: Trajectory, path: str | Path | None = None) -> Figure:
    """Which contacts are closed when."""
    with drawing(path, 7.4, 0.9 + 0.28 * max(len(run.facts.contacts), 1)) as figure:
        axes = figure.subplots()
        _bars(axes, run)
        axes.set_xlabel("time [s]")
        axes.set_title(f"{as_label(run.name)}: closed contacts")
    return figure


def energy(ledger: Ledger, path: str | Path | None = None) -> Figure:
    """Kinetic and potential energy stacked with what was lost, below the ceiling of what was put in; and the remainder.

    ``T + (V − V_min) + Σ lost = E(0) − V_min + Σ put in + numerical``: where the stack leaves the line, the integrator
    made or lost energy. The lower panel shows that difference alone. Events are thin lines, many of them ticks.
    """
    time, floor = ledger.time, float(np.min(ledger.potential, initial=np.inf))
    spent, given = _spent(ledger), [part for part in ledger.parts if part.kind not in SPENT]
    layers = [ledger.kinetic, ledger.potential - floor, *(-part.energy for part in spent)]
    labels = ["kinetic", "potential (above its least)", *(f"lost: {as_label(part.name)}" for part in spent)]
    ceiling = ledger.total[:1] - floor + sum((part.energy for part in given), np.zeros(len(time)))
    shown = extremes(time, *layers, ledger.numerical)
    time, layers, ceiling = time[shown], [layer[shown] for layer in layers], ceiling[shown]
    with drawing(path, 7.4, 4.4 + 0.17 * (len(layers) // 3)) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[3.0, 1.0])
        shades = [tone(CYCLE[k]) for k in (0, 5, 1, 4, 3, 2, 6, 7)]
        colors = [*shades, *(f"{shade}80" for shade in shades[2:])]
        upper.stackplot(
            time, *layers, labels=labels, colors=[colors[k % len(colors)] for k in range(len(layers))], alpha=0.8,
            linewidth=0,
        )  # fmt: skip
        upper.plot(time, ceiling, color=tone(INK), linewidth=1.0, label="start + put in" if given else "start")
        upper.set_ylabel("energy [J]")
        _legend(upper, 3)
        lower.plot(time, ledger.numerical[shown], color=tone(NEUTRAL))
        lower.set_ylabel("numerical [J]")
        lower.set_xlabel("time [s]")
        _mark_events(ledger, upper, lower)
        if len(time) and time[-1] > time[0]:
            lower.set_xlim(time[0], time[-1])
    return figure


def _mark_events(ledger: Ledger, upper: Any, lower: Any) -> None:
    """Lines at events, ticks where there are many."""
    for panel in (upper, lower):
        _lines(panel, ledger.marks, above=True)
    if len(ledger.marks) > MAX_EVENT_LINES:
        _upright(lower, [time for time, _ in ledger.marks], 0.93, 1.0, colors=tone(INK), linewidth=0.7, alpha=0.6)


def _spent(ledger: Ledger) -> list[Part]:
    """What took energy, as layers: each element, or each kind where there are many; little ones on top."""
    parts = [part for part in ledger.parts if part.kind in SPENT and np.any(part.energy)]
    if len(parts) > 8:  # beyond, those of a kind are one layer
        sums = ledger.by_kind()
        parts = [Part(kind, kind, sums[kind]) for kind in dict.fromkeys(part.kind for part in parts)]
    return sorted(parts, key=lambda part: -float(np.max(np.abs(part.energy))))


def portrayed(run: Trajectory) -> tuple[str, ...]:
    """Every coordinate in radians that has a rate, or every one if there is none; () where orientations alone move."""
    moving = run.facts.coordinates[: run.facts.coordinate_count]
    known = {name: kind for name, kind in moving if not run.facts.velocities or f"{name}.rate" in run}
    return tuple(name for name, kind in known.items() if kind == "rad") or tuple(known)


def phase_portrait(run: Trajectory, *coordinates: str, path: str | Path | None = None, degrees: bool = True) -> Figure:
    """Rate against coordinate, angles in degrees or in radians; jumps at switches are dotted, the start is a dot.

    Without names: those of `portrayed`.
    """
    wanted: Sequence[str] = coordinates or portrayed(run)
    time, values = curves(run, [part for name in wanted for part in (name, f"{name}.rate")])
    inner = np.asarray(Grid(time).cuts[1:-1], dtype=int)
    lifted = np.full(len(inner), np.nan)  # the pen is lifted at each switch
    with drawing(path, 5.6, 4.6) as figure:
        axes = figure.subplots()
        for number, name in enumerate(wanted):
            factor = scale(unit(name, run.facts), degrees)[1]
            place, rate = factor * values[name], factor * values[f"{name}.rate"]
            shade = tone(CYCLE[number % len(CYCLE)])
            width = 3.0 if "left" in name.split() else 1.1  # the two sides of a repeating walk lie on each other
            axes.plot([], [], color=shade, linewidth=width, label=as_label(name))
            axes.plot(place[:1], rate[:1], "o", color=shade, markersize=5)
            axes.plot(np.insert(place, inner, np.nan), np.insert(rate, inner, np.nan), color=shade, linewidth=width)
            jumps = [np.stack([curve[inner - 1], curve[inner], lifted], axis=1).ravel() for curve in (place, rate)]
            axes.plot(*jumps, ":", color=shade, linewidth=width)
        kinds = {unit(name, run.facts) for name in wanted}
        kind = kinds.pop() if len(kinds) == 1 else ""
        text = as_label(scale(kind, degrees)[0])
        axes.set_xlabel(f"{QUANTITIES.get(kind, 'coordinate')} [{text}]" if kind else "coordinate")
        axes.set_ylabel(f"rate [{text}/s]" if kind else "rate")
        _legend(axes, min(len(wanted), 2))
    return figure
