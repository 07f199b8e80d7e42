"""Verdicts as a table, for a terminal and for a page of the docs."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path

from mbd.errors import ModelError
from mbd.hardcases.case import Figure
from mbd.hardcases.judging import Verdict, short

__all__ = ["BEGIN", "END", "as_markdown", "as_text", "figure_text", "summary", "worst_text", "write_markdown"]

BEGIN, END = "<!-- table of mbd hardcases -->", "<!-- end of table -->"
"""Between these marks `mbd hardcases --markdown` writes."""

HEADS = ("case", "what must hold", "nearest to its limit", "verdict", "s")


def figure_text(figure: Figure) -> str:
    """'penetration [m]: 2e-16 of 1e-10'."""
    return f"{figure.what}: {number(figure.value)} of {number(figure.limit)}"


def number(value: float) -> str:
    """Two digits, four from 1 on, '0' for zero.

    >>> number(2.345e-15), number(132.0), number(-0.0)
    ('2.3e-15', '132', '0')
    """
    return f"{value + 0.0:.4g}" if abs(value) >= 1.0 else f"{value + 0.0:.2g}"


def worst_text(verdict: Verdict) -> str:
    """What a row says about the worst figure, with its scheme."""
    part = verdict.worst
    if part.error:
        return f"{part.error} ({part.scheme})"
    return f"{figure_text(part.worst)} ({part.scheme})" if part.worst is not None else "no figures"


def summary(verdicts: Sequence[Verdict]) -> str:
    """How many hold, and which do not."""
    failing = [short(verdict.case) for verdict in verdicts if not verdict.passed]
    seconds = sum(verdict.seconds for verdict in verdicts)
    held = f"{len(verdicts) - len(failing)} of {len(verdicts)} cases hold"
    return f"{held}{'; not ' + ', '.join(failing) if failing else ''} ({seconds:.1f} s)"


def as_text(verdicts: Sequence[Verdict], width: int = 120) -> str:
    """The table for a terminal of that many columns."""
    ids = max((len(verdict.case.id) for verdict in verdicts), default=4)
    told = 14
    free = max(width - ids - told - 6 - 8, 40)
    columns = (ids, free // 2, free - free // 2, told, 6)
    lines = [_line(HEADS, columns), "  ".join("─" * size for size in columns)]
    for verdict in verdicts:
        cells = (verdict.case.id, verdict.case.must, worst_text(verdict), verdict.word, f"{verdict.seconds:.2f}")
        wrapped = [
            textwrap.wrap(cell, size, break_on_hyphens=False) or [""] for cell, size in zip(cells, columns, strict=True)
        ]
        for k in range(max(map(len, wrapped))):
            lines.append(_line([cell[k] if k < len(cell) else "" for cell in wrapped], columns))
    return "\n".join([*lines, "", summary(verdicts)])


def _line(cells: Sequence[str], columns: Sequence[int]) -> str:
    *texts, last = cells
    left = [f"{text:<{size}}" for text, size in zip(texts, columns[:-1], strict=True)]
    return "  ".join([*left, f"{last:>{columns[-1]}}"]).rstrip()


def as_markdown(verdicts: Sequence[Verdict]) -> str:
    """The table for a page of the docs."""
    lines = ["| " + " | ".join(HEADS) + " |", "|---|---|---|---|---|"]
    for verdict in verdicts:
        cells = (short(verdict.case), verdict.case.must, worst_text(verdict), verdict.word, f"{verdict.seconds:.1f}")
        lines.append("| " + " | ".join(" ".join(cell.replace("|", "\\|").split()) for cell in cells) + " |")
    return "\n".join([*lines, "", summary(verdicts) + "."])


def write_markdown(verdicts: Sequence[Verdict], path: str | Path) -> Path:
    """Put the table between the marks of a page; a page that is not there yet is made."""
    place = Path(path)
    text = place.read_text(encoding="utf-8") if place.is_file() else f"# Hard cases\n\n{BEGIN}\n{END}\n"
    if text.count(BEGIN) != 1 or text.count(END) != 1 or text.index(BEGIN) > text.index(END):
        raise ModelError(f"{place} needs the line {BEGIN} once and below it {END} once; the table goes between them")
    head, _, rest = text.partition(BEGIN)
    tail = rest.partition(END)[2]
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_text(f"{head}{BEGIN}\n{as_markdown(verdicts)}\n{END}{tail}", encoding="utf-8")
    return place
