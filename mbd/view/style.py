"""The look that plots and pages share."""

from __future__ import annotations

from typing import Any

__all__ = ["CYCLE", "NEUTRAL", "SIDES", "as_label", "color", "rules"]

CYCLE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7F6A00", "#4D4D4D")
"""Colors that stay apart for color-blind readers (Okabe & Ito 2008), the yellow darkened for white paper."""

SIDES = {"left": "#0072B2", "right": "#D55E00"}
"""Colors of what belongs to a side."""

NEUTRAL = "#4D4D4D"


def color(name: str) -> str:
    """The color of a body or contact: its side's, or neutral."""
    words = name.replace(".", " ").split()
    return next((value for side, value in SIDES.items() if side in words), NEUTRAL)


def as_label(name: str) -> str:
    """A name as matplotlib draws it: without formulas between dollar signs; one that begins with _ is not left out."""
    text = name.replace("$", r"\$")
    return f" {text}" if text.startswith("_") else text


def rules() -> dict[str, Any]:
    """Settings of matplotlib for every plot of the package."""
    return {
        "font.size": 9.0,
        "axes.titlesize": 10.0,
        "axes.titleweight": "bold",
        "axes.titlelocation": "left",
        "axes.labelsize": 9.0,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.edgecolor": "#8A8A8A",
        "axes.linewidth": 0.7,
        "axes.grid": True,
        "axes.axisbelow": True,
        "grid.color": "#E4E4E4",
        "grid.linewidth": 0.7,
        "xtick.color": "#444444",
        "ytick.color": "#444444",
        "xtick.major.size": 3.0,
        "ytick.major.size": 3.0,
        "lines.linewidth": 1.4,
        "lines.solid_capstyle": "round",
        "legend.frameon": False,
        "legend.fontsize": 8.5,
        "legend.handlelength": 1.4,
        "legend.columnspacing": 1.4,
        "figure.dpi": 110,
        "savefig.dpi": 160,
        "savefig.facecolor": "white",
        "figure.facecolor": "white",
    }
