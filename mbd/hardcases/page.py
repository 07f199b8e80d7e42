"""Verdicts as one self-contained HTML page: the table, then each case with its figures and plots."""

import base64
import io
from collections.abc import Sequence
from html import escape
from importlib import import_module, resources
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from mbd.hardcases.case import Curve, Figure, definition
from mbd.hardcases.judging import Judged, Verdict, short
from mbd.hardcases.table import number, summary, worst_by_scheme
from mbd.results.archive import write_whole
from mbd.view.curves import extremes
from mbd.view.report import made_with
from mbd.view.style import CYCLE, rules

DPI, COLORS = 96, 16
"""Of plots: all of them together are less than a megabyte."""

POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


def write_page(verdicts: Sequence[Verdict], path: str | Path, note: str = "") -> Path:
    """Write the page, with a note on top; it opens without a network."""
    place = Path(path)
    place.parent.mkdir(parents=True, exist_ok=True)
    style = (resources.files("mbd.hardcases") / "data" / "page.css").read_text("utf-8")
    rows = "\n".join(_row(verdict) for verdict in verdicts)
    sections = "\n".join(_section(verdict) for verdict in verdicts)
    text = f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{POLICY}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Hard cases</title>
<style>
{style}</style>
</head>
<body>
<header>
<h1>Hard cases</h1>
<p class="lead">Scenes on which multibody systems fail, often silently: {escape(summary(verdicts))}.{escape(note)}</p>
<p class="made">{escape(made_with())}</p>
</header>
<main>
<div class="wide">
<table class="verdicts">
<thead><tr><th>case</th><th>what must hold</th><th>nearest to its limit</th><th>verdict</th><th>s</th></tr></thead>
<tbody>
{rows}
</tbody>
</table>
</div>
{sections}
</main>
</body>
</html>
"""
    write_whole(place, lambda partial: partial.write_text(text, encoding="utf-8"))
    return place


def _row(verdict: Verdict) -> str:
    case = verdict.case
    why = "".join(f'<p class="why">{escape(each)}</p>' for each in verdict.reasons)
    worst = "<br>".join(map(_whole, worst_by_scheme(verdict)))
    return (
        f'<tr><td><a href="#{case.id}">{short(case)}</a></td><td>{escape(case.must)}</td>'
        f'<td class="figure">{worst}</td><td>{_badge(verdict.passed, verdict.word)}{why}</td>'
        f'<td class="number">{verdict.seconds:.2f}</td></tr>'
    )


def _whole(text: str) -> str:
    """Escaped, with hyphens at which no line breaks: 2e-15 stays together."""
    return escape(text.replace("-", "\N{NON-BREAKING HYPHEN}"))


def _badge(passed: bool, word: str) -> str:
    return f'<span class="badge {"holds" if passed else "fails"}">{escape(word)}</span>'


def _section(verdict: Verdict) -> str:
    """A case: what it is, its plots, its figures with every scheme."""
    case = verdict.case
    data = definition(case.id)
    plots = "".join(
        f'<img alt="{escape(group[0][1].name)}" src="data:image/png;base64,{image}">'
        for group in _grouped(verdict)
        if (image := drawn(group))
    )
    parts = "\n".join(_part(part) for part in verdict.parts)
    notes = "".join(f"<dt>{escape(name)}</dt><dd>{escape(text)}</dd>" for name, text in case.notes.items())
    return f"""<section id="{case.id}">
<h2><span class="id">{short(case)}</span> {escape(case.title)} {_badge(verdict.passed, verdict.word)}</h2>
<p class="must">{escape(case.must)}</p>
<p class="about">Tests: {escape(str(data.get("tests", "")))}. References: {escape(str(data.get("provenance", "")))}.</p>
{f"<dl>{notes}</dl>" if notes else ""}
<div class="plots">{plots}</div>
<div class="schemes">{parts}</div>
{_figures(verdict)}
</section>"""


def _part(part: Judged) -> str:
    """How a case came out with one scheme, in a line; why, where it fails."""
    if part.error:
        return f"<p>{escape(part.scheme)} {_badge(False, 'stopped')}</p><p class='error'>{escape(part.error)}</p>"
    worst = f"nearest to its limit: {part.worst.what}" if part.worst is not None else "no figures"
    why = f"<p class='error'>{escape(part.reason)}</p>" if part.reason and not part.passed else ""
    word = "holds" if part.passed else "does not hold"
    return f"<p>{escape(part.scheme)} {_badge(part.passed, word)} <span>{escape(worst)}</span></p>{why}"


def _figures(verdict: Verdict) -> str:
    """Every figure of a case, a row each, with a column for each scheme; folded unless one fails."""
    parts = [part for part in verdict.parts if not part.error]
    by_scheme = [{figure.what: figure for figure in part.outcome.figures} for part in parts]
    names = list(dict.fromkeys(name for figures in by_scheme for name in figures))
    if not names:
        return ""
    head = "".join(f"<th>{escape(part.scheme)}" for part in parts)
    rows = "\n".join(_line(name, [figures.get(name) for figures in by_scheme]) for name in names)
    return f"""<details{"" if verdict.passed else " open"}>
<summary>{len(names)} figures, values and limits</summary>
<table class="figures"><thead><tr><th>figure{head}<th>limit</thead>
<tbody>
{rows}
</table>
</details>"""


def _line(name: str, figures: Sequence[Figure | None]) -> str:
    """One figure with every scheme; limits that differ as their range. End tags that HTML leaves out are left out."""
    cells = "".join(
        "<td>" if each is None else f"<td{'' if each.passed else ' class=fails'}>{number(each.value)}"
        for each in figures
    )
    limits = sorted({each.limit for each in figures if each is not None and each.is_judged})
    limit = " … ".join(number(each) for each in dict.fromkeys((limits[0], limits[-1]))) if limits else "not judged"
    return f"<tr><td>{escape(name)}{cells}<td>{limit}"


# plots -------------------------------------------------------------------------------------------------------------
def _grouped(verdict: Verdict) -> list[list[tuple[str, Curve]]]:
    """Curves of one name with their schemes: all of them where errors are compared, else the first."""
    found: dict[str, list[tuple[str, Curve]]] = {}
    for part in verdict.parts:
        for curve in part.outcome.curves:
            found.setdefault(curve.name, []).append((part.scheme, curve))
    return [group if group[0][1].logarithmic else group[:1] for group in found.values()]


def drawn(group: Sequence[tuple[str, Curve]]) -> str:
    """A plot of curves as a PNG in base64; '' without matplotlib."""
    if find_spec("matplotlib") is None:
        return ""
    from matplotlib.figure import Figure as Canvas

    matplotlib: Any = import_module("matplotlib")
    first = group[0][1]
    with matplotlib.rc_context(rules()):
        figure = Canvas(figsize=(5.2, 2.9), layout="constrained")
        axes: Any = figure.subplots()
        for k, (scheme, curve) in enumerate(group):
            x, y = _thinned(curve)
            style = "o-" if len(x) <= 30 else "-"
            axes.plot(x, y, style, markersize=3.5, color=CYCLE[k % len(CYCLE)], label=scheme, alpha=0.9)
        if first.logarithmic:
            _logarithmic(axes, group)
        elif len(first.x):
            axes.margins(x=0.02)
            axes.locator_params(axis="x", nbins=7)
            axes.ticklabel_format(scilimits=(-3, 4), useMathText=True)
        axes.set_xlabel(first.x_label)
        axes.set_ylabel(first.y_label)
        axes.set_title(first.name)
        drawing = io.BytesIO()
        figure.savefig(drawing, format="png", dpi=DPI)
    return base64.b64encode(_with_few_colors(drawing)).decode("ascii")


def _with_few_colors(drawing: io.BytesIO) -> bytes:
    """A PNG with a palette, of a third of the size."""
    from PIL import Image  # matplotlib's own

    written = io.BytesIO()
    with Image.open(drawing) as picture:
        picture.convert("RGB").quantize(COLORS, dither=Image.Dither.NONE).save(written, format="png", optimize=True)
    return written.getvalue()


def _logarithmic(axes: Any, group: Sequence[tuple[str, Curve]]) -> None:
    """Both axes logarithmic, with the slope of order 2 through the largest error."""
    x = np.asarray(group[0][1].x, dtype=float)
    errors = [np.abs(np.asarray(curve.y, dtype=float)) for _, curve in group]
    top = max((float(np.nanmax(each)) for each in errors if np.isfinite(each).any()), default=0.0)
    if not top > 0.0:
        return
    if group[0][1].x_label.endswith("[s]"):  # steps
        axes.plot(x, 2.0 * top * (x / x.max()) ** 2, ":", color="#8A8A8A", linewidth=1.0, label="order 2")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.minorticks_off()
    axes.set_xticks(x, [f"{value:.2g}" for value in x], rotation=25 if len(x) > 5 else 0)
    axes.legend(loc="best", fontsize=7.5)


def _thinned(curve: Curve) -> tuple[Any, Any]:
    """The points of a curve that a plot can tell apart; absolute values where the axis is logarithmic."""
    x, y = np.asarray(curve.x, dtype=float), np.asarray(curve.y, dtype=float)
    shown = extremes(x, y) if np.all(np.diff(x) >= 0.0) else slice(None)
    return x[shown], np.abs(y[shown]) if curve.logarithmic else y[shown]
