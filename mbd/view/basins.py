"""Pictures of basins: the plane of the starts, a color for each outcome."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.gait.basin.result import Basin
from mbd.view.plots import drawing
from mbd.view.style import CYCLE, FAINT, INK, NEUTRAL, PALE, as_label, tone

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHADES = {
    "falls forward": CYCLE[4], "falls backward": CYCLE[5], "falls": CYCLE[6], "scuffs": CYCLE[3], "stands": FAINT,
    "chatters": "#F0E442", "numerical error": INK, "other event": "#8C6BB1", "wrong contacts": "#B2182B",
    "misses": NEUTRAL, "not on the section": PALE, "not decided": "#FFFFFF",
}  # fmt: skip
"""A color for each outcome but walks, apart for color-blind readers and in lightness (after Okabe & Ito 2008)."""
WALKS = (CYCLE[0], CYCLE[2], CYCLE[1], CYCLE[7])
"""Colors of walks, one for each attractor."""


def basin(found: Basin, path: str | Path | None = None) -> Figure:
    """Outcomes over one or two axes; the legend says how many starts came to each."""
    words, counts = found._words().reshape(found.shape), found.counts
    shades = {what: _shade(what, found.attractors) for what in counts}
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    number = {what: k for k, what in enumerate(counts)}
    plane = np.vectorize(number.__getitem__, otypes=[float])(words)
    colors = ListedColormap([shades[what] for what in counts])
    names = [group[0] for group in found.grid.dimensions]
    values = [found.grid.values[name] for name in names]
    with drawing(path, 6.6, 4.2 if len(names) == 2 else 2.2) as figure:
        axes = figure.subplots()
        if len(names) == 1:
            plane, values = plane[:, np.newaxis], [values[0], np.array([0.0])]
        axes.pcolormesh(
            _edges(values[0]), _edges(values[1]), plane.T, cmap=colors, vmin=-0.5, vmax=len(counts) - 0.5,
            rasterized=True, shading="flat",
        )  # fmt: skip
        axes.set_xlabel(_title(found, 0))
        axes.set_ylabel(_title(found, 1) if len(names) == 2 else "")
        if len(names) == 1:
            axes.set_yticks([])
        total = len(found)
        patches = [
            Patch(facecolor=shades[what], edgecolor=tone(FAINT), linewidth=0.5,
                  label=as_label(f"{what}: {100.0 * count / total:.3g} %"))
            for what, count in counts.items()
        ]  # fmt: skip
        axes.legend(handles=patches, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, borderaxespad=0.3)
    return figure


def _shade(what: str, attractors: tuple[str, ...]) -> str:
    """The color of an outcome."""
    if what.startswith("walks"):
        name = what.removeprefix("walks: ")
        return WALKS[attractors.index(name) % len(WALKS) if name in attractors else 0]
    return SHADES[what]


def _title(found: Basin, dimension: int) -> str:
    names = found.grid.dimensions[dimension]
    unit = found.units.get(names[0], "")
    return as_label(f"{', '.join(names)} [{unit}]" if unit else ", ".join(names))


def _edges(values: Any) -> Any:
    """Borders of cells around values, which need not be equally far apart; in their order."""
    if len(values) < 2:
        return np.array([values[0] - 0.5, values[0] + 0.5])
    middle = 0.5 * (values[1:] + values[:-1])
    return np.concatenate([[2.0 * values[0] - middle[0]], middle, [2.0 * values[-1] - middle[-1]]])
