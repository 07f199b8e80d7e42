"""Numerical criteria of integrators over ω dt."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.analysis.numerical import Criteria
from mbd.equal import EQUAL_RTOL
from mbd.view.plots import drawing
from mbd.view.style import CYCLE, NEUTRAL, tone

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HALF = float(np.pi)
"""ω dt of two steps a period, beyond which there is no period to speak of [rad]."""
LONG = re.compile(r"\d+\.\d{5,}")
"""Numbers that are shortened in labels."""


def spectra(found: Sequence[Criteria], path: str | Path | None = None) -> Figure:
    """Over ω dt on a logarithmic axis: spectral radius, algorithmic damping ratio and period elongation.

    The last two up to π, on logarithmic axes too, where the slope is the order; negative ones, growth and shorter
    periods, dotted.
    """
    with drawing(path, 7.4, 6.2 + 0.17 * ((len(found) - 1) // 2)) as figure:
        grid = figure.add_gridspec(2, 2, height_ratios=[1.1, 1.0])
        upper = figure.add_subplot(grid[0, :])
        middle, lower = figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1])
        for number, each in enumerate(found):
            shade, style = tone(CYCLE[number % len(CYCLE)]), ("-", "--", "-.")[number // len(CYCLE) % 3]
            width = 1.4 + 1.6 * (len(found) - 1 - number) / max(len(found) - 1, 1)  # equal curves stay visible
            upper.plot(each.turns, each.radius, style, color=shade, linewidth=width, label=_label(each))
            for axes, values in (middle, each.damping), (lower, each.elongation):
                axes.plot(each.turns, _above(values), style, color=shade, linewidth=width)
                axes.plot(each.turns, _above(-values), ":", color=shade, linewidth=width)
        upper.axhline(1.0, color=tone(NEUTRAL), linewidth=0.7)
        upper.set_ylim(0.0, 1.35)
        upper.set_ylabel("spectral radius ρ")
        upper.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.2)
        middle.set_ylabel("damping ratio of the scheme")
        lower.set_ylabel("relative period elongation")
        _scale(found, upper, middle, lower)
    return figure


def _scale(found: Sequence[Criteria], upper: Any, middle: Any, lower: Any) -> None:
    """Logarithmic axes over ω dt."""
    first = min(each.turns[0] for each in found)
    for axes, last in (upper, max(each.turns[-1] for each in found)), (middle, HALF), (lower, HALF):
        axes.set_xscale("log")
        axes.set_xlabel("ω dt [rad]")
        if first < last:
            axes.set_xlim(first, last)
    for axes in middle, lower:
        axes.set_yscale("log")


def _above(values: Any) -> Any:
    """The values that a logarithmic axis can show."""
    return np.where(values > EQUAL_RTOL, values, np.nan)


def _label(each: Criteria) -> str:
    """The scheme, long numbers shortened, and the damping of the oscillator."""
    name = LONG.sub(lambda number: f"{float(number[0]):.4g}", repr(each.integrator))
    return f"{name}, ξ = {each.damping_ratio:g}" if each.damping_ratio else name
