"""The work–precision plot of the accuracy lab."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbd.analysis.accuracy import Accuracy, Point
from mbd.view.plots import drawing
from mbd.view.style import CYCLE, FAINT, INK, NEUTRAL, PALE, PAPER, as_label, tone

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SCHEME_MARKERS = "osD^vP*X"
"""Of the schemes in turn."""
WIDE, HIGH = 36.0, 8.0
"""Room for the label of a step [points]."""


def clear(point: Point) -> bool:
    """Whether a point has an error, or what it is certainly below, and a time to be drawn at."""
    return not point.failure and 0.0 < height(point) < math.inf and point.seconds > 0.0


def height(point: Point) -> float:
    """The error, or what it is certainly below where it is not clear beside the reference's own; inf: not known."""
    if point.error is not None:
        return point.error
    return math.inf if point.at_most is None else point.at_most


def work_precision(found: Accuracy, path: str | Path | None = None) -> Figure:
    """Error over processor time, both logarithmic: a line for each scheme, dashed through tolerances.

    Grey lines go through equal steps. The broad pale line is the least time for each error, whichever the scheme.
    """
    shown = [point for point in found.points if clear(point)]
    with drawing(path, 7.4, 5.2) as figure:
        axes = figure.subplots()
        for number, scheme in enumerate(found.schemes):
            _scheme(axes, number, scheme, [point for point in shown if point.scheme == scheme])
        if shown:
            axes.set_xscale("log")
            axes.set_yscale("log")
            labels = _steps(axes, shown)
            _least(axes, shown)
            _limits(axes, found, shown)
        else:
            axes.text(0.5, 0.5, "no error is known", ha="center", transform=axes.transAxes)
        dashed = any(point.tol is not None for point in shown)
        hollow = any(point.error is None for point in shown)
        marks = [("dashed: tolerances, with their trial runs", dashed), ("hollow: below", hollow)]
        axes.set_xlabel("; ".join(["processor time [ms]; broad: the least", *(text for text, there in marks if there)]))
        axes.set_ylabel(f"largest error over {'the published value' if found.is_published else 'range'}")
        if shown:
            axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.3)
            figure.draw_without_rendering()  # the legend takes its room first
            _labelled(axes, labels)
        figure.suptitle(f"{as_label(found.model)}: what accuracy costs", x=0.01, ha="left", fontweight="bold")
    return figure


def _scheme(axes: Any, number: int, scheme: str, points: list[Point]) -> None:
    """Two lines of one color: through its steps, and dashed through its tolerances."""
    style = {
        "marker": SCHEME_MARKERS[number % len(SCHEME_MARKERS)],
        "color": tone(CYCLE[number % len(CYCLE)]),
        "alpha": 0.9,
    }
    fixed = [point for point in points if point.tol is None]
    to_tolerance = [point for point in points if point.tol is not None]
    for line, dashes, size in ((fixed, "-", 4.5), (to_tolerance, "--", 3.0)):
        named = {"label": as_label(scheme)} if line is (fixed or to_tolerance) and line else {}
        axes.plot(
            [1e3 * point.seconds for point in line], [height(point) for point in line], dashes, markersize=size,
            linewidth=1.5 if dashes == "-" else 1.0, **named, **style,
        )  # fmt: skip
    for point in points:
        at = 1e3 * point.seconds, height(point)
        if point.error is None:
            axes.plot(*at, linestyle="", **style | {"markersize": 6, "mfc": tone(PAPER), "alpha": 1.0})
        if not point.same_events:
            axes.plot(*at, "o", markersize=10, mfc="none", color=tone(CYCLE[1]))


def _steps(axes: Any, shown: list[Point]) -> list[tuple[float, float, str]]:
    """A thin grey line through the points of each step, and where its label goes, at its slow end."""
    labels = []
    for dt in sorted({point.dt for point in shown if point.dt is not None}):
        group = sorted((point for point in shown if point.dt == dt), key=lambda point: point.seconds)
        if len(group) > 2:
            axes.plot(
                [1e3 * point.seconds for point in group], [height(point) for point in group], ":", color=FAINT,
                linewidth=0.8, zorder=0.9,
            )  # fmt: skip
        labels.append((1e3 * group[-1].seconds, height(group[-1]), f"{1e3 * dt:.3g} ms"))
    return labels


def frontier(points: list[Point]) -> list[Point]:
    """The points that no other beats in both time and error, by growing time: less and less error."""
    found: list[Point] = []
    for point in sorted(points, key=lambda point: (point.seconds, height(point))):
        if not found or height(point) < height(found[-1]):
            found.append(point)
    return found


def _least(axes: Any, shown: list[Point]) -> None:
    """What each error costs at least, as stairs."""
    best = frontier(shown)
    times, errors = [1e3 * point.seconds for point in best], [height(point) for point in best]
    axes.step(times, errors, where="post", color=tone(NEUTRAL), alpha=0.16, linewidth=6.0, zorder=0.7)


def _labelled(axes: Any, labels: list[tuple[float, float, str]]) -> None:
    """Steps beside their points, pushed down until none covers another; the limits of the axes are known."""
    placed: list[tuple[float, float]] = []
    points = 72.0 / axes.figure.dpi
    for time, error, text in sorted(labels, key=lambda label: -label[1]):
        x, y = (points * float(each) for each in axes.transData.transform((time, error)))
        low = y
        while meets := [other for at, other in placed if abs(at - x) < WIDE and abs(other - low) < HIGH]:
            low = min(meets) - HIGH
        placed.append((x, low))
        axes.annotate(
            text, (time, error), xytext=(8, low - y), textcoords="offset points", va="center", fontsize=7.5,
            color=tone(NEUTRAL), bbox={"boxstyle": "square,pad=0.1", "fc": tone(PAPER), "ec": "none", "alpha": 0.7},
        )  # fmt: skip


def _limits(axes: Any, found: Accuracy, shown: list[Point]) -> None:
    """The wanted error as a line, the bound of the reference as a band, and room for the labels."""
    errors = [height(point) for point in shown]
    low, high = min(errors) / 2.5, max(errors) * 2.5
    if found.target is not None:
        low, high = min(low, found.target / 1.6), max(high, found.target * 1.6)
        axes.axhline(found.target, color=tone(INK), linewidth=0.9, linestyle="--", zorder=0.8)
        axes.annotate(
            f"wanted {found.target:g}", (0.995, found.target), xycoords=("axes fraction", "data"), ha="right",
            xytext=(0, 3), textcoords="offset points", fontsize=7.5,
        )  # fmt: skip
    bound = found.reference.error if found.reference is not None else 0.0
    if math.isfinite(bound) and bound > low:
        axes.axhspan(low, bound, color=tone(PALE), zorder=0.3)
    times = [1e3 * point.seconds for point in shown]
    spread = max(times) / min(times)
    axes.set_ylim(low, high)
    axes.set_xlim(min(times) / spread**0.06 / 1.05, max(times) * spread**0.16 * 1.1)
    _plain(axes.xaxis, spread)


def _plain(axis: Any, spread: float) -> None:
    """Times written as numbers, between powers of ten too where there are few of these."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    digits = (1.0, 2.0, 5.0) if spread < 300.0 else (1.0,)
    axis.set_major_locator(LogLocator(subs=digits))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
