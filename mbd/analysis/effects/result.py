"""What the study of effects found: as text, table, CSV and plot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbd.analysis.effects.contribution import Contribution, Together
from mbd.dataclass import dataclass
from mbd.errors import UnknownNameError, nearest
from mbd.later import later
from mbd.notebook import folded, paragraphs, table
from mbd.results.titled import Tabular, by_title
from mbd.results.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEADS = ("effect", "kind", "operations", "ns/step", "energy [J]", "share", "change", "of", "until [s]")
"""Columns of the table."""

WHEN = {"always": "", "while closed": "*", "while sliding": "†"}
"""Marks of operations that are not always taken."""


@dataclass(frozen=True, eq=False)
class Effects(Tabular):
    """What each effect of a scene costs, carries and changes.

    Attributes
    ----------
    model : name of the model
    outputs : by which changes were judged
    tolerance : change that was allowed, relative to the range of an output [-]
    contributions : a `Contribution` for each effect, in the order of the model
    operations : of a Newton iteration of the whole scene, no contact closed
    shared : operations that only effects need, but more than one of them: counted for none
    together : what may be left out at once, shown by a run; None where nothing may
    run : of the whole scene
    complete : False where it was interrupted
    """

    model: str
    outputs: tuple[str, ...]
    tolerance: float
    contributions: tuple[Contribution, ...]
    operations: int
    shared: int
    together: Together | None
    run: Trajectory = field(repr=False)
    complete: bool = True

    def __getitem__(self, name: str) -> Contribution:
        """An effect by name."""
        for each in self.contributions:
            if each.name == name:
                return each
        raise UnknownNameError(nearest(name, [each.name for each in self.contributions], "effect", "There are"))

    @cached_property
    def recommendation(self) -> tuple[str, ...]:
        """Which effects may be left out, alone and together."""
        if not self.complete:
            return ("The study was interrupted, so nothing is recommended.",)
        return tuple(_advice(self.contributions, self.together, self.tolerance, self.operations))

    @property
    def droppable(self) -> tuple[str, ...]:
        """The effects that may be left out together within the tolerance, as a run has shown."""
        return self.together.names if self.together is not None else ()

    def __repr__(self) -> str:
        rows = [HEADS, *(cells(each) for each in self.contributions)]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = [self.span]
        lines += [_line(rows[0], widths), "  ".join("─" * width for width in widths)]
        for row in rows[1:]:
            lines.append(_line(row, widths).rstrip())
        changes = [f"without {each.name!r}: {each.change}" for each in self.contributions if str(each.change)]
        lines += ["", *changes] if changes else []
        lines += ["", *self.legend, "", *self.recommendation]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        changes = [f"without {each.name!r}: {each.change}" for each in self.contributions if str(each.change)]
        shown = table(self.span, HEADS, map(cells, self.contributions))
        legend = folded("what the columns mean", paragraphs([*changes, *self.legend]))
        return shown + legend + paragraphs(self.recommendation)

    @property
    def span(self) -> str:
        """Which scene it is, and how it ends."""
        span = f"{float(self.run.time[-1]) - float(self.run.time[0]):g} s" if len(self.run) else "0 s"
        return f"effects of {self.model!r} over {span}: {self.run.message}"

    @property
    def legend(self) -> tuple[str, ...]:
        """What the columns mean, and how sure the times are."""
        marks = {each.acts for each in self.contributions}
        acts = [f"{WHEN[kind]} {kind}" for kind in WHEN if WHEN[kind] and kind in marks]
        shared = f", {self.shared} more are shared by several effects" if self.shared > 0 else ""
        found = [
            f"operations: of a Newton iteration, {self.operations} in all{shared}" + "".join(f"; {a}" for a in acts),
            "energy: Σ |ΔE| that went through it; share: of all elements, impacts included",
            "change: largest difference of an output over its range without the effect; which output; compared until",
        ]
        times = [each.timing for each in self.contributions if each.timing is not None]
        if times:
            whole = sorted({round(time.whole) for time in times})
            span = f"{whole[0]}" if len(whole) == 1 else f"{whole[0]} to {whole[-1]}"
            text = f"processor time, of {span} ns in all; least of {times[0].rounds} runs with and without, by turns"
            found.insert(1, f"ns/step: {text}")
        return (*found, *(() if self.complete else ("interrupted: the rest was not measured",)))

    # tables ---------------------------------------------------------------------------------------------------------
    def rows(self) -> list[dict[str, Any]]:
        """One flat dictionary an effect; changes by output as 'change of …'."""
        found = []
        for each in self.contributions:
            change = each.change
            row: dict[str, Any] = {
                "effect": each.name, "kind": each.kind, "operations": each.operations, "acts": each.acts,
                "nanoseconds per step": None if each.timing is None else each.timing.added,
                "noise": None if each.timing is None else each.timing.noise,
                "energy": each.energy, "share": each.share, "change": change.largest, "until": change.until,
                "event time": change.event_time, "differs at": change.differs_at, "left out": change.left_out,
                "identical": change.identical, "droppable": each.name in self.droppable, "note": str(change),
            }  # fmt: skip
            found.append(row | {f"change of {name}": change.outputs.get(name) for name in self.outputs})
        return found

    @property
    def columns(self) -> dict[str, list[Any]]:
        """The same by title."""
        return by_title(self.rows())

    def plot(self, path: str | Path | None = None) -> Figure:
        """Bars: share of the energy, change without it, operations and time.

        Returns the matplotlib figure, also saved when a path is given.
        """
        figure: Figure = later("Effects.plot")(self, path)
        return figure

    def page(self, path: str | Path) -> Path:
        """One self-contained HTML file: bars for any output, sorted as one likes, with all figures, and the table."""
        written: Path = later("Effects.page")(self, path)
        return written


def cells(each: Contribution) -> tuple[str, ...]:
    """An effect as the texts of a row of `HEADS`."""
    change = each.change
    largest, of = "–", ""
    if change.outputs and not change.failure:
        of = max(change.outputs, key=lambda name: change.outputs[name])
        largest = f"{change.largest:.1e}" if change.largest else "0"
        of = of if change.largest else ""
    return (
        each.name, each.kind, f"{each.operations}{WHEN[each.acts]}", each.time, f"{each.energy:.4g}",
        f"{100.0 * each.share:.2g} %", largest, of, "" if change.failure else f"{change.until:.4g}",
    )  # fmt: skip


def _line(texts: Sequence[str], widths: Sequence[int]) -> str:
    left = (0, 1, 7)
    return "  ".join(
        f"{text:<{width}}" if k in left else f"{text:>{width}}"
        for k, (text, width) in enumerate(zip(texts, widths, strict=True))
    )


def _advice(
    contributions: Sequence[Contribution], together: Together | None, tolerance: float, operations: int
) -> list[str]:
    """Sentences: what may go alone, what together, what came nearest; what ends the run otherwise.

    operations : of a Newton iteration of the whole scene
    """
    alone = [each for each in contributions if each.change.within(tolerance)]
    if alone:
        sentences = [_alone(alone, tolerance), *(_together(together, operations) if together is not None else ())]
    else:
        sentences = [_none(contributions, tolerance)]
    idle = [each.name for each in alone if each.change.identical]
    if idle:
        sentences.append(f"{_listed(idle)} {'does' if len(idle) == 1 else 'do'} nothing in this run, to the bit.")
    vital = [each for each in contributions if each.change.ends or each.change.failure]
    if vital:
        sentences.append(f"Without {_listed([each.name for each in vital], 'or')} the run ends otherwise.")
    return sentences


def _none(contributions: Sequence[Contribution], tolerance: float) -> str:
    """Why nothing may go."""
    limit = f"{tolerance:g} of its range"
    text = f"No effect may be left out: each changes an output by more than {limit}, or the events and their times"
    able = [each for each in contributions if each.change.telling and each.change.outputs]
    if able:
        best = min(able, key=lambda each: each.change.largest)
        return f"{text}; least, by {best.change.largest:.2g}, {best.name!r}."
    longest = max(contributions, key=lambda each: each.change.until)
    return f"{text}. Removing {longest.name!r} changes the events last, at {longest.change.until:.4g} s."


def _alone(alone: Sequence[Contribution], tolerance: float) -> str:
    names = _listed([f"{each.name!r} ({each.change.largest:.1g})" for each in alone], quote=False)
    return f"Alone, within {tolerance:g} of the range of every output, may be left out: {names}."


def _together(whole: Together, operations: int) -> list[str]:
    """The set that a run has shown to hold."""
    if len(whole.names) == 1:
        sentences = [f"Leave out {whole.names[0]!r}"]
    else:
        sentences = [f"Leave out {_listed(whole.names)} together: a run without them changes outputs by "
                f"{whole.change.largest:.1g}"]  # fmt: skip
    less = operations - whole.operations
    sentences[0] += f"; {less} of {operations} operations of a Newton iteration go"
    sentences[0] += " (contacts that are open take none anyway)." if less == 0 else "."
    if whole.back:
        sentences.append(f"{_listed(whole.back)} had to stay: beside the others the change was more than allowed.")
    return sentences


def _listed(names: Sequence[str], word: str = "and", quote: bool = True) -> str:
    """'a', 'b' and 'c'."""
    shown = [repr(name) if quote else name for name in names]
    return shown[0] if len(shown) == 1 else f"{', '.join(shown[:-1])} {word} {shown[-1]}"
