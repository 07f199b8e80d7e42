"""The look that plots and pages share."""

from typing import Any

CYCLE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7F6A00", "#4D4D4D")
"""Colors that stay apart for color-blind readers (Okabe & Ito 2008), the yellow darkened for white paper."""

SIDES = {"left": "#0072B2", "right": "#D55E00"}
"""Colors of what belongs to a side."""

NEUTRAL, INK, PAPER = "#4D4D4D", "#1D2129", "#FFFFFF"
PALE, FAINT = "#E4E4E4", "#8A8A8A"
"""Of grids and bands, and of axes."""

DARK = {
    "#0072B2": "#4AA8E0", "#D55E00": "#F0873C", "#009E73": "#2BC49A", "#56B4E9": "#A5DBF7", "#7F6A00": "#C9B037",
    NEUTRAL: "#B8BEC6", INK: "#E8EBEF", PALE: "#363B44", PAPER: "#16191E",
}  # fmt: skip
"""What colors are on dark paper; others stay."""


def tone(light: str) -> str:
    """A color on the paper of the present settings of matplotlib: dark where their text is light."""
    from matplotlib import rcParams
    from matplotlib.colors import to_rgb

    red, green, blue = to_rgb(rcParams["text.color"])
    return DARK.get(light, light) if 0.3 * red + 0.59 * green + 0.11 * blue > 0.5 else light


def color(name: str) -> str:
    """The color of a body or contact: its side's, or neutral."""
    words = name.replace(".", " ").split()
    return tone(next((value for side, value in SIDES.items() if side in words), NEUTRAL))


def as_label(name: str) -> str:
    """A name as matplotlib draws it: without formulas between dollar signs; one that begins with _ is not left out."""
    text = name.replace("$", r"\$")
    return f" {text}" if text.startswith("_") else text


def rules() -> dict[str, Any]:
    """Settings of matplotlib for every plot of the package, on dark paper if the present ones have that."""
    ink, neutral, paper = tone(INK), tone(NEUTRAL), tone(PAPER)
    return {
        "text.color": ink,
        "axes.labelcolor": ink,
        "axes.titlecolor": ink,
        "axes.facecolor": paper,
        "font.size": 9.0,
        "axes.titlesize": 10.0,
        "axes.titleweight": "bold",
        "axes.titlelocation": "left",
        "axes.labelsize": 9.0,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.edgecolor": FAINT,
        "axes.linewidth": 0.7,
        "axes.grid": True,
        "axes.axisbelow": True,
        "grid.color": tone(PALE),
        "grid.linewidth": 0.7,
        "xtick.color": neutral,
        "ytick.color": neutral,
        "xtick.labelcolor": ink,
        "ytick.labelcolor": ink,
        "xtick.major.size": 3.0,
        "ytick.major.size": 3.0,
        "lines.linewidth": 1.4,
        "lines.solid_capstyle": "round",
        "legend.frameon": False,
        "legend.fontsize": 8.5,
        "legend.handlelength": 1.4,
        "legend.columnspacing": 1.4,
        "svg.hashsalt": "mbd",
        "figure.dpi": 110,
        "savefig.dpi": 160,
        "savefig.facecolor": paper,
        "figure.facecolor": paper,
    }
