"""Natural modes as bars."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mbd.analysis.linearization import Linearization, NaturalMode
from mbd.errors import ModelError
from mbd.view.plots import drawing
from mbd.view.style import CYCLE, NEUTRAL, as_label, tone

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def modes(linear: Linearization, path: str | Path | None = None, most: int = 6) -> Figure:
    """One panel a motion: how far each coordinate moves with the largest, at that instant and a quarter later."""
    if not isinstance(most, int | np.integer) or most < 1:
        raise ModelError(f"most must be a whole number ≥ 1, got {most!r}")
    chosen = [mode for mode in linear.modes if any(mode.shape.values())][:most]
    if not chosen:
        raise ModelError(f"{linear.model!r} has no motion that moves a coordinate; there is nothing to draw")
    names, count = linear.coordinates, len(chosen)
    with drawing(path, min(1.6 + 1.7 * count, 11.0), 1.4 + 0.24 * len(names)) as figure:
        panels = figure.subplots(1, count, sharey=True, squeeze=False)[0]
        height, turned = np.arange(len(names)), False
        for number, (axes, mode) in enumerate(zip(panels, chosen, strict=True)):
            shape = np.array([mode.shape[name] for name in names])
            # below, all coordinates are drawn as moving in phase
            shade, late = tone(CYCLE[number % len(CYCLE)]), bool(np.max(np.abs(shape.imag)) > 0.02)
            turned = turned or late
            axes.barh(height - 0.18 * late, shape.real, 0.66 - 0.32 * late, color=shade)
            if late:
                axes.barh(height + 0.18, -shape.imag, 0.34, color=shade, alpha=0.4)
            axes.axvline(0.0, color=tone(NEUTRAL), linewidth=0.7)
            axes.set_xlim(-1.12, 1.12)
            axes.set_title(_title(mode), fontsize=8.5, fontweight="normal")
            axes.grid(False, axis="y")
        panels[0].set_yticks(height, [as_label(name) for name in names])
        panels[0].set_ylim(len(names) - 0.4, -0.6)
        figure.supxlabel("part of the largest" + (", pale: a quarter period later" if turned else ""), fontsize=8.5)
        figure.suptitle(f"{as_label(linear.model)}: natural modes", x=0.01, ha="left", fontweight="bold")
    return figure


def _title(mode: NaturalMode) -> str:
    if mode.eigenvalue.imag == 0.0:
        return f"exp({mode.eigenvalue.real:.4g} t)"
    return f"{mode.hertz:.4g} Hz\nζ = {round(mode.damping_ratio, 4) + 0.0:.4g}"
