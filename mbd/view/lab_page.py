"""The page that ``mbd accuracy`` and ``mbd effects`` fill: self-contained, no network, no libraries, our own script."""

import math
from collections.abc import Sequence
from html import escape
from typing import Any

from mbd.view.report import made_with
from mbd.view.template import filled


def lab_page(
    title: str, advice: Sequence[str], notes: Sequence[str], controls: str, shows: str, about: str,
    heads: Sequence[str], rows: Sequence[str], content: Any, script: str,
) -> str:  # fmt: skip
    """The page as text.

    Parameters
    ----------
    title, advice, notes : texts, escaped here
    shows : what the picture shows, for readers who do not see it
    controls, about, heads, rows : HTML
    content : what the script draws, as plain lists
    script : its file
    """
    parts = {
        "<!--title-->": escape(title),
        "<!--advice-->": "".join(f"<p>{escape(line)}</p>" for line in advice),
        "<!--notes-->": "".join(f"<li>{escape(note)}</li>" for note in notes),
        "<!--controls-->": controls,
        "<!--shows-->": escape(shows),
        "<!--about-->": about,
        "<!--heads-->": "".join(heads),
        "<!--rows-->": "\n".join(rows),
        "<!--made-->": escape(made_with()),
    }
    return filled("lab", content, parts, ("shared.js", script))


def finite(value: float) -> float | None:
    """A number as JSON has it: what is not finite is not known."""
    return value if math.isfinite(value) else None
