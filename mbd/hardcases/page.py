"""Verdicts as one self-contained HTML page: the table, then each case with its figures and plots."""

from __future__ import annotations

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
from mbd.hardcases.judging import Judged, Verdict, ratio, short
from mbd.hardcases.table import number, summary, worst_by_scheme
from mbd.results.archive import write_whole
from mbd.view.report import made_with
from mbd.view.style import CYCLE, rules

__all__ = ["write_page"]

POINTS = 4000
"""Curves are thinned to about this many points."""

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
{parts}
</section>"""


def _part(part: Judged) -> str:
    """The figures with one scheme, folded unless one fails."""
    if part.error:
        return (
            f"<details open><summary>{escape(part.scheme)} {_badge(False, 'stopped')}</summary>"
            f"<p class='error'>{escape(part.error)}</p></details>"
        )
    figures = "\n".join(_figure(figure) for figure in part.outcome.figures)
    worst = part.worst
    headline = (
        f"{len(part.outcome.figures)} figures, nearest to its limit: {worst.what}"
        if worst is not None
        else "no figures"
    )
    word = "holds" if part.passed else "does not hold"
    why = f"<p class='error'>{escape(part.reason)}</p>" if part.reason and not part.passed else ""
    return f"""<details{"" if part.passed else " open"}>
<summary>{escape(part.scheme)} {_badge(part.passed, word)} <span>{escape(headline)}</span></summary>
{why}
<table class="figures"><thead><tr><th>figure</th><th>value</th><th>limit</th><th></th></tr></thead>
<tbody>
{figures}
</tbody></table>
</details>"""


def _figure(figure: Figure) -> str:
    share = max(ratio(figure), 0.0)
    bar = f'<span class="bar"><i style="width:{min(share, 1.0) * 100.0:.1f}%"></i></span>'
    cells = "".join(f'<td class="number">{number(value)}</td>' for value in (figure.value, figure.limit))
    if not figure.is_judged:
        cells = f'<td class="number">{number(figure.value)}</td><td class="number">not judged</td>'
    word = "holds" if figure.passed else "fails"
    return f'<tr class="{word}"><td>{escape(figure.what)}</td>{cells}<td>{bar}</td></tr>'


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
        written = io.BytesIO()
        figure.savefig(written, format="png", dpi=150)
    return base64.b64encode(written.getvalue()).decode("ascii")


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
    """The points of a curve, every n-th of very many."""
    x, y = np.asarray(curve.x, dtype=float), np.asarray(curve.y, dtype=float)
    every = max(len(x) // POINTS, 1)
    return x[::every], np.abs(y[::every]) if curve.logarithmic else y[::every]
