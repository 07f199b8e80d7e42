"""What the lab found: as text, table, CSV, plot and page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbd.analysis.accuracy.advice import advice
from mbd.analysis.accuracy.points import Point
from mbd.analysis.accuracy.published import Published
from mbd.analysis.accuracy.truth import Truth
from mbd.dataclass import dataclass
from mbd.later import later
from mbd.notebook import paragraphs, table
from mbd.results.titled import Tabular, by_title

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEADS = (
    "scheme", "dt [s] or tol", "error", "order", "time [ms]", "steps", "Newton", "tangents", "residuals", "factored",
    "drift", "energy [J]", "event time [s]", "events",
)  # fmt: skip
"""Columns of the table."""

LEFT_OUT = ("tangents", "residuals", "factored", "drift")
"""Columns for which a notebook has no room."""

MAPPINGS = ("errors", "end_errors")
"""Fields of a point that have a value for each quantity."""


@dataclass(frozen=True, eq=False)
class Accuracy(Tabular):
    """Errors and costs of schemes with steps and tolerances.

    Attributes
    ----------
    model : name of the model
    quantities : whose errors were measured
    points : a `Point` for each scheme and step or tolerance, the coarsest of a scheme first
    reference : what they were judged by, with its own bound: a run, with the growth of errors, or published values;
        None where there is none
    target : error that was wanted [-]
    complete : False where it was interrupted
    notes : what to know before reading the errors
    """

    model: str
    quantities: tuple[str, ...]
    points: tuple[Point, ...]
    reference: Truth | Published | None
    target: float | None = None
    complete: bool = True
    notes: tuple[str, ...] = ()

    @property
    def schemes(self) -> tuple[str, ...]:
        """Labels of the schemes."""
        return tuple(dict.fromkeys(point.scheme for point in self.points))

    def of(self, scheme: str) -> tuple[Point, ...]:
        """The points of one scheme."""
        return tuple(point for point in self.points if point.scheme == scheme)

    @cached_property
    def recommendation(self) -> tuple[str, ...]:
        """The cheapest scheme and step for the target, what comes with it, what ten times more accuracy costs."""
        return tuple(advice(self.points, self.target, self.reference.error if self.reference else float("inf")))

    @property
    def is_published(self) -> bool:
        """Whether errors are those against published values."""
        return isinstance(self.reference, Published)

    @property
    def origin(self) -> str:
        """What the errors are relative to, in a sentence or two."""
        return "no reference" if self.reference is None else self.reference.origin

    def __repr__(self) -> str:
        rows = [cells(point) for point in self.points]
        widths = [
            max(map(len, column)) for column in zip(HEADS, *(row for row in rows if row[2] != "failed"), strict=True)
        ]
        widths[0] = max([len(HEADS[0]), *(len(row[0]) for row in rows)])
        what = "quantity" if len(self.quantities) == 1 else "quantities"
        over = "over their published values" if self.is_published else "over their range"
        lines = [f"accuracy of {self.model!r}: largest error of {len(self.quantities)} {what} {over}"]
        lines += [f"reference    {self.origin}", "", _line(HEADS, widths), "  ".join("─" * w for w in widths)]
        above = ""
        for point, row in zip(self.points, rows, strict=True):
            above, row[0] = row[0], row[0] if row[0] != above else ""
            if point.failure:
                lines.append(f"{row[0]:<{widths[0]}}  {row[1]:>{widths[1]}}  failed: {point.failure}")
            else:
                lines.append(_line(row, widths) + (f"  {remark(point)}" if remark(point) else ""))
        lines += ["", *(f"note: {note}" for note in self.notes), *self.recommendation]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        kept = [k for k, head in enumerate(HEADS) if head not in LEFT_OUT]
        rows = [[cells(point)[k] for k in kept] for point in self.points if not point.failure]
        failed = [f"{each.scheme} with {each.setting} failed: {each.failure}" for each in self.points if each.failure]
        over = "their published values" if self.is_published else "their ranges"
        title = f"accuracy of {self.model!r}: largest errors over {over}"
        shown = table(title, [HEADS[k] for k in kept], rows, f"reference: {self.origin}")
        return shown + paragraphs([*failed, *(f"note: {note}" for note in self.notes), *self.recommendation])

    # tables ---------------------------------------------------------------------------------------------------------
    def rows(self) -> list[dict[str, Any]]:
        """One flat dictionary a point; errors by quantity as 'error of …' and 'error at the end of …'."""
        plain = [item.name for item in fields(Point) if item.name not in MAPPINGS]
        found = []
        for point in self.points:
            row = {name: getattr(point, name) for name in plain}
            for name in self.quantities:
                row[f"error of {name}"] = point.errors.get(name)
                row[f"error at the end of {name}"] = point.end_errors.get(name)
            found.append(row)
        return found

    @property
    def columns(self) -> dict[str, list[Any]]:
        """The same by title."""
        return by_title(self.rows())

    # pictures -------------------------------------------------------------------------------------------------------
    def plot(self, path: str | Path | None = None) -> Figure:
        """Work and precision: error over processor time, a line for each scheme, dashed through its tolerances.

        Returns the matplotlib figure, also saved when a path is given.
        """
        figure: Figure = later("Accuracy.plot")(self, path)
        return figure

    def page(self, path: str | Path) -> Path:
        """One self-contained HTML file: the plot for any quantity, with every point's figures, and the table."""
        written: Path = later("Accuracy.page")(self, path)
        return written


def cells(point: Point) -> list[str]:
    """A point as the texts of a row of `HEADS`."""
    start = [point.scheme, f"{point.dt:.4g}" if point.tol is None else f"tol {point.tol:.3g}"]
    if point.failure:
        return [*start, "failed", *[""] * (len(HEADS) - 3)]
    error = f"{point.error:.2e}" if point.error is not None else "–"
    if point.error is None and point.at_most is not None and point.at_most < 1e300:
        error = f"< {point.at_most:.0e}"
    counts = (point.steps, point.iterations, point.tangents, point.residuals, point.factorizations)
    return [
        *start, error, "–" if point.order is None else f"{point.order:.2f}", _whole(1e3 * point.seconds),
        *map(str, counts), f"{point.drift:.1e}" if point.drift else "0", f"{point.energy:.1e}",
        f"{point.event_time:.1e}" if point.events and point.event_time is not None else "–",
        str(point.events) + ("" if point.same_events else " ≠"),
    ]  # fmt: skip


def _whole(number: float) -> str:
    """Three digits, or all before the point."""
    return f"{number:.3g}" if number < 999.5 else f"{number:.0f}"


def remark(point: Point) -> str:
    """What stands behind a row: what became of a tolerance, and the point's note."""
    if point.tol is None:
        return point.note
    achieved = "–" if point.achieved is None else f"{point.achieved:.1e}"
    estimated = "–" if point.estimated is None else f"{point.estimated:.1e}"
    text = f"achieved {achieved}, estimated {estimated}; {point.runs} runs, trials {point.trials:.0%} of the time"
    return f"{text}; {point.note}" if point.note else text


def _line(texts: Sequence[str], widths: Sequence[int]) -> str:
    first, *rest = texts
    return "  ".join([f"{first:<{widths[0]}}", *(f"{text:>{w}}" for text, w in zip(rest, widths[1:], strict=True))])
