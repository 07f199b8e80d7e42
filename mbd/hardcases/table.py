"""Verdicts as a table, for a terminal and for a page of the docs."""

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path

from mbd.errors import ModelError
from mbd.hardcases.case import Figure
from mbd.hardcases.judging import Judged, Verdict, ratio, short
from mbd.results.archive import write_whole

BEGIN, END = "<!-- table of mbd hardcases -->", "<!-- end of table -->"
"""Between these marks `mbd hardcases --markdown` writes."""

MIN_COLUMNS = 100
"""Columns below which a terminal has no room for a table."""

HEADS = ("case", "what must hold", "nearest to its limit", "verdict", "s")


def figure_text(figure: Figure) -> str:
    """'penetration [m]: 2e-16 of 1e-10'; without the limit where there is none."""
    limit = f" of {number(figure.limit)}" if figure.is_judged else ""
    return f"{figure.what}: {number(figure.value)}{limit}"


def number(value: float) -> str:
    """Two digits, four from 1 on, '0' for zero.

    >>> number(2.345e-15), number(132.0), number(-0.0)
    ('2.3e-15', '132', '0')
    """
    return f"{value + 0.0:.4g}" if abs(value) >= 1.0 else f"{value + 0.0:.2g}"


def worst_text(verdict: Verdict) -> str:
    """The worst figure of all schemes, with its scheme, and what is shown without being judged."""
    part = verdict.worst
    text = part.error
    if not text:
        text = figure_text(part.worst) if part.worst is not None else "no figures"
    return "; ".join([f"{text} ({part.scheme})", *_shown(verdict)])


def worst_by_scheme(verdict: Verdict) -> list[str]:
    """The worst figure of each scheme, those of one kind together: 'gap [m]: 2e-16 (HHT), 3e-16 (Newmark) of 1e-10'."""
    kinds: dict[tuple[str, str], list[Judged]] = {}
    for part in sorted(verdict.parts, key=lambda part: -ratio(part.worst)):
        if part.error:
            kinds.setdefault((part.error, ""), []).append(part)
        elif part.worst is not None:
            kinds.setdefault((part.worst.what, number(part.worst.limit)), []).append(part)
    texts = []
    for (what, limit), parts in kinds.items():
        values = {part.scheme: number(part.worst.value) if limit and part.worst else "" for part in parts}
        texts.append(f"{what}: {_values(values, verdict)} of {limit}" if limit else f"{what} ({', '.join(values)})")
    return [*texts, *_shown(verdict)]


def _shown(verdict: Verdict) -> list[str]:
    """Figures without a limit, of all schemes."""
    found: dict[str, dict[str, str]] = {}
    for part in verdict.parts:
        for figure in part.outcome.figures:
            if not figure.is_judged:
                found.setdefault(figure.what, {})[part.scheme] = number(figure.value)
    return [f"not judged: {what}: {_values(values, verdict)}" for what, values in found.items()]


def _values(values: Mapping[str, str], verdict: Verdict) -> str:
    """'2e-16 (HHT), 3e-16 (Newmark)'; '0 (all)' where every scheme has the same."""
    if len(values) == len(verdict.parts) > 1 and len(set(values.values())) == 1:
        return f"{next(iter(values.values()))} (all)"
    same: dict[str, list[str]] = {}
    for scheme, value in values.items():
        same.setdefault(value, []).append(scheme)
    return ", ".join(f"{value} ({', '.join(schemes)})" for value, schemes in same.items())


def summary(verdicts: Sequence[Verdict]) -> str:
    """How many hold, and which do not."""
    failing = [short(verdict.case) for verdict in verdicts if not verdict.passed]
    seconds = sum(verdict.seconds for verdict in verdicts)
    held = f"{len(verdicts) - len(failing)} of {len(verdicts)} cases hold"
    return f"{held}{'; not ' + ', '.join(failing) if failing else ''} ({seconds:.1f} s)"


def as_text(verdicts: Sequence[Verdict], width: int = 120) -> str:
    """The table for a terminal of that many columns; below `MIN_COLUMNS` each case is a paragraph."""
    if width < MIN_COLUMNS:
        return "\n".join(
            [*(_paragraph(verdict, width) for verdict in verdicts), "", *_wrapped(summary(verdicts), width)]
        )
    ids = max((len(verdict.case.id) for verdict in verdicts), default=4)
    verdict_width = 20
    free = max(width - ids - verdict_width - 6 - 8, 40)
    columns = (ids, free // 2, free - free // 2, verdict_width, 6)
    lines = [_line(HEADS, columns), "  ".join("─" * size for size in columns)]
    for verdict in verdicts:
        cells = (verdict.case.id, verdict.case.must, worst_text(verdict), verdict.word, f"{verdict.seconds:.2f}")
        wrapped = [_wrapped(cell, size) for cell, size in zip(cells, columns, strict=True)]
        for k in range(max(map(len, wrapped))):
            lines.append(_line([cell[k] if k < len(cell) else "" for cell in wrapped], columns))
    return "\n".join([*lines, "", *_why(verdicts, width), *_wrapped(summary(verdicts), width)])


def _why(verdicts: Sequence[Verdict], width: int) -> list[str]:
    """Reasons that are known, below a table, each with its cases."""
    found: dict[str, list[str]] = {}
    for verdict in verdicts:
        for reason in verdict.reasons:
            found.setdefault(reason, []).append(short(verdict.case))
    lines = [line for why, cases in found.items() for line in _wrapped(f"{', '.join(cases)}: {why}", width)]
    return [*lines, ""] if lines else []


def _paragraph(verdict: Verdict, width: int) -> str:
    """A case on a narrow terminal."""
    lines = [*_wrapped(verdict.case.id, width), *_wrapped(f"{verdict.word} ({verdict.seconds:.2f} s)", width - 2, "  ")]
    lines += _wrapped(verdict.case.must, width - 2, "  ")
    lines += _wrapped(worst_text(verdict), width - 2, "  ")
    return "\n".join(lines)


def _wrapped(text: str, width: int, indent: str = "") -> list[str]:
    return [indent + line for line in textwrap.wrap(text, max(width, 20), break_on_hyphens=False)] or [""]


def _line(cells: Sequence[str], columns: Sequence[int]) -> str:
    *texts, last = cells
    left = [f"{text:<{size}}" for text, size in zip(texts, columns[:-1], strict=True)]
    return "  ".join([*left, f"{last:>{columns[-1]}}"]).rstrip()


def as_markdown(verdicts: Sequence[Verdict]) -> str:
    """The table for a page of the docs."""
    lines = ["| " + " | ".join(HEADS) + " |", "|---|---|---|---|---|"]
    for verdict in verdicts:
        worst = worst_text(verdict)
        verdict_cell = ": ".join([verdict.word, *verdict.reasons])
        cells = (short(verdict.case), verdict.case.must, worst, verdict_cell, f"{verdict.seconds:.1f}")
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
    page = f"{head}{BEGIN}\n{as_markdown(verdicts)}\n{END}{tail}"
    write_whole(place, lambda partial: partial.write_text(page, encoding="utf-8"))
    return place
