"""The accuracy lab as one self-contained HTML page."""

from dataclasses import asdict
from html import escape
from pathlib import Path
from typing import Any

from mbd.analysis.accuracy import Accuracy, Point
from mbd.view.lab_page import finite, lab_page
from mbd.view.style import CYCLE
from mbd.view.template import written

CONTROLS = """\
<label>quantity <select id="quantity"><option value="">the largest of all</option></select></label>
<label>error <select id="which"><option value="errors">largest over time</option>
<option value="end_errors">at the end</option></select></label>
<label>over <select id="cost"><option value="seconds">processor time</option><option value="dt">step dt</option>
<option value="steps">steps</option><option value="iterations">Newton iterations</option>
<option value="residuals">evaluations</option></select></label>"""

ABOUT = """\
Reference: {origin}. {kind}<br>
“–”: not known or not observable; “≠”: other events than the reference. Dashed: tolerances, timed with their trial runs.
Hollow: no clear error beside the reference's own; drawn at what it is certainly below."""

KINDS = {
    True: "Errors are relative to the range of each quantity, away from the instants between an event and its match in "
    "the reference.",
    False: "Errors are relative to the published values.",
}
"""What errors are relative to, by whether they are those against a run."""


def write(found: Accuracy, path: str | Path) -> Path:
    """Write the page; see `Accuracy.page`."""
    return written(html(found), path)


def html(found: Accuracy) -> str:
    """The page as text."""
    from mbd.analysis.accuracy.result import HEADS

    return lab_page(
        title=f"{found.model}: what accuracy costs",
        advice=found.recommendation,
        notes=found.notes,
        controls=CONTROLS,
        shows="error over cost, one line for each scheme",
        about=ABOUT.format(origin=escape(found.origin), kind=KINDS[not found.is_published]),
        heads=[f"<th>{escape(head)}</th>" for head in HEADS],
        rows=[_row(p, not k) for scheme in found.schemes for k, p in enumerate(found.of(scheme))],
        content=content(found),
        script="accuracy.js",
    )


def _row(point: Point, leads: bool) -> str:
    """A point as a row of the table; the first of a scheme has its name."""
    from mbd.analysis.accuracy.result import HEADS, cells, remark

    first, dt, *rest = cells(point)
    head = f"<td>{escape(first) if leads else ''}</td><td>{escape(dt)}</td>"
    if point.failure:
        kind, text = " first" if leads else "", f"failed: {escape(point.failure)}"
        return f'<tr class="failed{kind}">{head}<td colspan="{len(HEADS) - 2}">{text}</td></tr>'
    note = f' title="{escape(remark(point))}"' if remark(point) else ""
    kind = ' class="first"' if leads else ""
    return f"<tr{kind}{note}>{head}{''.join(f'<td>{escape(text)}</td>' for text in rest)}</tr>"


def content(found: Accuracy) -> dict[str, Any]:
    """What the script draws, as plain lists."""
    bound = {} if found.reference is None else found.reference.bound
    return {
        "quantities": list(found.quantities),
        "target": found.target,
        "over": "the published value" if found.is_published else "range",
        "bound": {name: finite(value) for name, value in bound.items()},
        "schemes": [
            {"name": scheme, "color": CYCLE[number % len(CYCLE)], "points": [_point(p) for p in found.of(scheme)]}
            for number, scheme in enumerate(found.schemes)
        ],
    }


def _point(point: Point) -> dict[str, Any]:
    """A point as JSON has it."""
    return {
        key: {name: finite(each) for name, each in value.items()} if isinstance(value, dict)
        else finite(value) if isinstance(value, float) else value
        for key, value in asdict(point).items()
    }  # fmt: skip
