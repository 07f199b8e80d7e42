"""Pictures of fits: what was measured beside what was computed, and what is left."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.analysis.fitting.fit import Fit
from mbd.results.units import unit
from mbd.view.curves import curves
from mbd.view.plots import drawing, scale
from mbd.view.style import CYCLE, NEUTRAL, as_label, tone

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def fitted(fit: Fit, path: str | Path | None = None) -> Figure:
    """A row for each column of the data: measured dots on the computed curve, and the residuals below 0 and above.

    Residuals are shown in the unit of the column, with the band of twice their size over all data. Instants of events
    share the last row.
    """
    columns = [name for name in fit.residuals if name in fit.run]
    instants = [name for name in fit.residuals if name not in columns]
    rows = len(columns) + bool(instants)
    with drawing(path, 7.4, 0.6 + 2.1 * rows) as figure:
        cells = figure.subplots(rows, 2, squeeze=False)
        for (left, right), name in zip(cells, columns, strict=False):
            _column(left, right, fit, name)
        if instants:
            _instants(cells[-1], fit, instants)
        for axes in cells[-1][: 1 if instants else 2]:
            axes.set_xlabel("time [s]")
    return figure


def _column(left: Any, right: Any, fit: Fit, name: str) -> None:
    kind, factor = scale(unit(name, fit.run.facts), True)
    times, off = fit.times[name], factor * fit.scales[name] * fit.residuals[name]
    time, values = curves(fit.run, [name])
    left.plot(times, factor * np.asarray(fit.run.at(times)[name]) + off, ".", color=tone(NEUTRAL), label="measured")
    shown = time <= times[-1]
    left.plot(time[shown], factor * values[name][shown], color=tone(CYCLE[0]), label="computed")
    left.set_ylabel(f"{as_label(name)} [{kind or '-'}]")
    left.legend(loc="best")
    right.axhline(0.0, color=tone(NEUTRAL), linewidth=0.8)
    band = 2.0 * factor * fit.scales[name] * fit.noise
    if fit.degrees:
        right.axhspan(-band, band, color=tone(NEUTRAL), alpha=0.15)
    right.plot(times, off, ".", color=tone(CYCLE[1]))
    right.set_ylabel(f"residual [{kind or '-'}]")


def _instants(cells: Any, fit: Fit, names: list[str]) -> None:
    left, right = cells
    off = [1e3 * fit.scales[name] * float(fit.residuals[name][0]) for name in names]
    times = [float(fit.times[name][0]) for name in names]
    left.plot(times, range(len(names)), "o", color=tone(NEUTRAL))
    left.set_yticks(range(len(names)), [as_label(name) for name in names])
    right.barh(range(len(names)), off, color=tone(CYCLE[1]))
    right.set_yticks([])
    right.axvline(0.0, color=tone(NEUTRAL), linewidth=0.8)
    right.set_xlabel("residual [ms]")
