"""Reports of gaits as a picture and as one self-contained page."""

from __future__ import annotations

import re
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbd.analysis.gait_report.curves import Curve
from mbd.analysis.gait_report.report import GaitReport, Walk
from mbd.equal import EQUAL_RTOL
from mbd.notebook import table
from mbd.view.plots import drawing
from mbd.view.report import made_with
from mbd.view.style import CYCLE, NEUTRAL, SIDES, as_label, tone
from mbd.view.template import filled, written

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROWS = ("angle", "moment", "power")
"""Quantities of a joint, one below the other."""


SIZE = re.compile(r'width="[\d.]+pt" height="[\d.]+pt"')
"""Of the picture as it is written; on the page it is as wide as there is room."""

DASHES = ("-", "--", ":", "-.")
"""Lines of the runs."""


def picture(report: GaitReport, path: str | Path | None = None) -> Figure:
    """Angles, moments and powers of the joints, forces of the ground, and where energy goes; sides by color, runs by
    dash.

    What is marked below the axes of the ground is when each foot leaves, in the color of its side.
    """
    joints = list(dict.fromkeys(c.subject for walk in report.walks for c in walk.curves if c.subject != "ground"))
    columns = max(len(joints), 3)
    with drawing(path, 3.1 * columns, 9.4) as figure:
        grid = figure.subplots(4, columns, squeeze=False)
        for column in range(columns):
            for row, quantity in enumerate(ROWS):
                known = column < len(joints) and _draw(grid[row, column], report, joints[column], quantity)
                grid[row, column].set_visible(known)
            if column < len(joints):
                grid[0, column].set_title(as_label(joints[column]))
        for column, quantity in enumerate(("normal force", "forward force")):
            _draw(grid[3, column], report, "ground", quantity)
            grid[3, column].set_title(f"ground, {quantity}")
            grid[3, column].set_xlabel("stride [%]")
            _leavings(grid[3, column], report)
        _energies(grid[3, 2], report)
        for extra in grid[3, 3:]:
            extra.set_visible(False)
        _legend(figure, report)
    return figure


def _color(side: str, report: GaitReport) -> str:
    names = [each.name for each in report.walks[0].sides]
    return tone(SIDES.get(side, CYCLE[names.index(side) % len(CYCLE)] if side in names else NEUTRAL))


def _draw(axes: Any, report: GaitReport, subject: str, quantity: str) -> bool:
    """The curves of a quantity; whether there are some."""
    unit = ""
    for number, walk in enumerate(report.walks):
        for curve in walk.curves:
            if (curve.subject, curve.quantity) == (subject, quantity):
                unit = curve.unit
                _band(axes, report, curve)
                _line(axes, curve, _color(curve.side, report), DASHES[number % len(DASHES)])
    axes.set_xlim(0.0, 100.0)
    axes.set_ylabel(f"{quantity} [{unit}]")
    axes.axhline(0.0, color=tone(NEUTRAL), lw=0.6)
    if max((abs(y) for line in axes.lines for y in line.get_ydata()), default=0.0) < EQUAL_RTOL:
        axes.set_ylim(-1.0, 1.0)
    return bool(unit)


def _band(axes: Any, report: GaitReport, curve: Curve) -> None:
    """The band of normal gait, once behind all curves of a quantity."""
    found = report.band.of(curve.subject, curve.quantity, curve.unit) if report.band is not None else None
    if found is not None and not axes.collections:
        axes.fill_between(*found, color=tone(NEUTRAL), alpha=0.25, lw=0.0, zorder=0.5)


def _line(axes: Any, curve: Curve, color: str, dash: str) -> None:
    from mbd.analysis.gait_report.curves import PERCENT

    axes.plot(PERCENT, curve.mean, dash, color=color)
    axes.fill_between(PERCENT, curve.mean - curve.spread, curve.mean + curve.spread, color=color, alpha=0.15, lw=0.0)


def _leavings(axes: Any, report: GaitReport) -> None:
    """When each foot leaves the ground."""
    for walk in report.walks:
        for side, share in walk["stance"].items():
            axes.plot([share], [0.0], marker=7, ms=8, color=_color(side, report), clip_on=False, zorder=5)


def _energies(axes: Any, report: GaitReport) -> None:
    """Energy of a stride by side and kind, a bar for each run."""
    keys = [key for key in dict.fromkeys(k for walk in report.walks for k in walk.spent()) if _matters(report, key)]
    count = len(report.walks)
    for number, walk in enumerate(report.walks):
        for place, (side, kind) in enumerate(keys):
            axes.barh(
                place + (number + 0.5) / count * 0.8 - 0.4, walk.spent().get((side, kind), 0.0), 0.8 / count,
                color=_color(side, report), alpha=1.0 - 0.35 * number / max(1, count - 1) if count > 1 else 1.0,
            )  # fmt: skip
    if not keys:  # of measured gaits, whose energies are not known
        axes.set_visible(False)
        return
    axes.set_yticks(range(len(keys)), [kind for _, kind in keys])
    axes.invert_yaxis()
    axes.axvline(0.0, color=tone(NEUTRAL), lw=0.6)
    axes.set_title("energy of a stride")
    axes.set_xlabel("[J]")


def _matters(report: GaitReport, key: tuple[str, str]) -> bool:
    largest = max(abs(value) for walk in report.walks for value in walk.spent().values())
    return any(abs(walk.spent().get(key, 0.0)) > 1e-3 * largest for walk in report.walks)


def _legend(figure: Any, report: GaitReport) -> None:
    from matplotlib.lines import Line2D

    sides = report.walks[0].sides
    handles: list[Any] = [Line2D([], [], color=_color(side.name, report), label=side.name) for side in sides]
    if len(report.walks) > 1:
        handles += [
            Line2D([], [], color=tone(NEUTRAL), ls=DASHES[k % len(DASHES)], label=as_label(walk.name))
            for k, walk in enumerate(report.walks)
        ]
    if report.band is not None:
        from matplotlib.patches import Patch

        handles.append(Patch(color=tone(NEUTRAL), alpha=0.25, lw=0.0, label=f"normal: {report.band.source}"))
    figure.legend(handles=handles, loc="outside upper center", ncols=len(handles))


def write(report: GaitReport, path: str | Path) -> Path:
    """Write the page; see `GaitReport.page`."""
    return written(html(report), path)


def html(report: GaitReport) -> str:
    """The page as text."""
    energy = ("energy of a stride [J]", *(walk.name for walk in report.walks))
    title = "How it walks: " + ", ".join(walk.name for walk in report.walks)
    parts = {
        "<!--title-->": escape(title),
        "<!--strides-->": "".join(f"<p>{escape(_sentence(walk))}</p>" for walk in report.walks),
        "<!--numbers-->": table("", report.heads, report.rows()),
        "<!--energy-->": table("", energy, report.energy_rows()),
        "<!--picture-->": _svg(report),
        "<!--made-->": escape(made_with()),
    }
    return filled("gait_page", {}, parts, ())


def _sentence(walk: Walk) -> str:
    counts = " and ".join(f"{len(side.strides)} of the {side.name}" for side in walk.sides)
    speed = next(iter(walk["speed"].values()))
    return f"{walk.name}: strides {counts} foot, {speed:.3g} m/s."


def _svg(report: GaitReport) -> str:
    """The picture inside the page, or why there is none."""
    try:
        from matplotlib.figure import Figure  # noqa: F401
    except ModuleNotFoundError:
        return "<p>No picture: matplotlib is not installed; try pip install 'mbd[plot]'.</p>"
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "gait.svg"
        picture(report, place)
        text = place.read_text(encoding="utf-8")
    text = text[text.index("<svg") :]
    return SIZE.sub('width="100%" role="img" aria-label="curves over the stride"', text, count=1)
