"""The bars of the study of effects."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbd.analysis.effects import Contribution, Effects
from mbd.view.plots import drawing
from mbd.view.style import CYCLE, INK, PAPER, as_label, tone

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NOTE: dict[str, Any] = {"va": "center", "fontsize": 7.5}


def bars(found: Effects, path: str | Path | None = None) -> Figure:
    """Three panels with a row for each effect: its share of the energy, the change without it, its operations.

    Changes are logarithmic, the tolerance a dashed line; bars of effects that may be left out together are green. A
    change is hatched where events differ or the run ends otherwise: then it is that until there.
    """
    each = found.contributions
    with drawing(path, 9.4, 1.5 + 0.32 * len(each)) as figure:  # inches a row
        share, change, cost = figure.subplots(1, 3, sharey=True, width_ratios=[1.0, 1.5, 1.0])
        places = range(len(each))
        shades = [tone(CYCLE[2]) if one.name in found.droppable else tone(CYCLE[0]) for one in each]
        share.barh(places, [100.0 * one.share for one in each], color=shades, height=0.62)
        _label(share, [100.0 * one.share for one in each], [f"{100.0 * one.share:.2g} %" for one in each])
        share.set_xlabel("share of the energy [%]")
        _changes(change, found, shades)
        cost.barh(places, [one.operations for one in each], color=shades, height=0.62)
        _label(cost, [one.operations for one in each], [_cost(one) for one in each])
        cost.set_xlabel("operations (ns a step)")
        share.set_yticks(places, [as_label(one.name) for one in each])
        share.set_ylim(len(each) - 0.4, -0.6)
        for axes in (share, change, cost):
            axes.grid(False, axis="y")
            axes.tick_params(axis="y", length=0)
        title = f"{as_label(found.model)}: what each effect carries, changes and costs"
        figure.suptitle(title, x=0.01, ha="left", fontweight="bold")
    return figure


def _cost(one: Contribution) -> str:
    return f"{one.operations}" + ("" if one.timing is None else f" ({one.time} ns)")


def _changes(axes: Any, found: Effects, shades: Sequence[str]) -> None:
    """Changes from a tenth of the least, or of the tolerance, on; what is zero has no bar."""
    sizes = [_size(one) for one in found.contributions]
    known = [size for size in sizes if size > 0.0]
    low = 10.0 ** math.floor(math.log10(min([*known, found.tolerance]) * 0.5))
    high = 10.0 ** math.ceil(math.log10(max([*known, found.tolerance]) * 8.0))
    for place, (one, size) in enumerate(zip(found.contributions, sizes, strict=True)):
        text = "nothing, to the bit" if one.change.identical else f"{size:.2g}" if size else "0"
        if one.change.failure or not one.change.outputs:
            text = "cannot be left out" if one.change.failure else "not compared"
        if size > 0.0:
            hatch = None if one.change.comparable else "////"
            axes.barh(place, size - low, left=low, color=shades[place], height=0.62, hatch=hatch,
                      edgecolor=tone(PAPER), linewidth=0.0)  # fmt: skip
        axes.annotate(
            text + _why(one),
            (size if size > 0.0 else found.tolerance, place),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            fontsize=7.5,
        )
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    axes.axvline(found.tolerance, color=tone(INK), linewidth=0.9, linestyle="--", zorder=3)
    axes.annotate(
        f"allowed {found.tolerance:g}", (found.tolerance, 1.0), xycoords=("data", "axes fraction"), xytext=(0, 2),
        textcoords="offset points", ha="center", fontsize=7.5,
    )  # fmt: skip
    axes.set_xlabel("largest change of an output over its range")


def _size(one: Contribution) -> float:
    size = one.change.largest
    return size if math.isfinite(size) else 0.0


def _why(one: Contribution) -> str:
    """Why a change is not that of the whole run."""
    if one.change.differs_at is not None and one.change.outputs:
        return f" until {one.change.differs_at:.3g} s"
    return ", ends otherwise" if one.change.ends else ""


def _label(axes: Any, sizes: Sequence[float], texts: Sequence[str]) -> None:
    """Figures beside the bars, with room for them."""
    for place, (size, text) in enumerate(zip(sizes, texts, strict=True)):
        axes.annotate(text, (max(size, 0.0), place), xytext=(4, 0), textcoords="offset points", **NOTE)
    axes.set_xlim(min(0.0, *sizes) if len(sizes) > 1 else 0.0, 1.75 * max([*sizes, 1e-9]))
