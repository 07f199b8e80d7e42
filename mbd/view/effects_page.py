"""The study of effects as one self-contained HTML page."""

from html import escape
from pathlib import Path
from typing import Any

from mbd.analysis.effects import Contribution, Effects
from mbd.view.lab_page import finite, lab_page
from mbd.view.style import CYCLE
from mbd.view.template import written

CONTROLS = """\
<label>output <select id="output"><option value="">the largest of all</option></select></label>
<label>order <select id="order"><option value="model">as in the model</option><option value="change">change</option>
<option value="share">energy</option><option value="operations">operations</option>
<option value="time">time of a step</option></select></label>"""

WORDS = frozenset(("effect", "kind", "of"))
"""Columns of words."""


def write(found: Effects, path: str | Path) -> Path:
    """Write the page; see `Effects.page`."""
    return written(html(found), path)


def html(found: Effects) -> str:
    """The page as text."""
    from mbd.analysis.effects.result import HEADS

    return lab_page(
        title=f"{found.model}: what each effect carries, changes and costs",
        advice=found.recommendation,
        notes=[f"without {each.name!r}: {each.change}" for each in found.contributions if str(each.change)],
        controls=CONTROLS,
        shows="share of the energy, change without it, and operations of each effect",
        about=f"{escape(found.span)}<br>" + "<br>".join(map(escape, found.legend)),
        heads=[_cell("th", head, head) for head in HEADS],
        rows=[_row(each) for each in found.contributions],
        content=content(found),
        script="effects.js",
    )


def _row(each: Contribution) -> str:
    """An effect as a row of the table."""
    from mbd.analysis.effects.result import HEADS, cells

    kind = ' class="failed"' if each.change.failure else ""
    note = f' title="{escape(str(each.change))}"' if str(each.change) else ""
    entries = (_cell("td", head, text) for head, text in zip(HEADS, cells(each), strict=True))
    return f"<tr{kind}{note}>{''.join(entries)}</tr>"


def _cell(tag: str, head: str, text: str) -> str:
    """A cell of a column; words stand at its left."""
    kind = ' class="word"' if head in WORDS else ""
    return f"<{tag}{kind}>{escape(text)}</{tag}>"


def content(found: Effects) -> dict[str, Any]:
    """What the script draws, as plain lists."""
    return {
        "outputs": list(found.outputs),
        "tolerance": found.tolerance,
        "colors": {"droppable": CYCLE[2], "other": CYCLE[0]},
        "effects": [_effect(each, each.name in found.droppable) for each in found.contributions],
    }


def _effect(each: Contribution, droppable: bool) -> dict[str, Any]:
    """An effect as JSON has it."""
    from mbd.analysis.effects.result import WHEN

    change, timing = each.change, each.timing
    return {
        "name": each.name, "kind": each.kind, "operations": each.operations, "acts": each.acts,
        "mark": WHEN[each.acts], "time": each.time, "added": None if timing is None else finite(timing.added),
        "whole": None if timing is None else finite(timing.whole), "energy": finite(each.energy),
        "share": finite(each.share), "change": finite(change.largest), "differs_at": change.differs_at,
        "outputs": {name: finite(value) for name, value in change.outputs.items()}, "ends": bool(change.ends),
        "failure": change.failure, "identical": change.identical, "comparable": change.comparable,
        "note": str(change), "droppable": droppable,
    }  # fmt: skip
