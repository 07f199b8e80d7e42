"""What notebooks show in place of text: tables that can be read aloud too, and texts that keep their lines."""

import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

PLAIN = "tex2jax_ignore mathjax_ignore"
"""Classes of what notebooks do not search for formulas: a name may hold dollar signs."""

NUMBER = re.compile(r"[-−+<]? ?\d[\d.,e+−-]*( ?[%*†≠])?|[-−–]?|-?inf|nan")
"""A cell that stands at the right of its column, if the others do too."""

Cell = str | float | int | None


def table(caption: str, heads: Sequence[str], rows: Iterable[Sequence[Cell]], note: str = "") -> str:
    """A table as HTML: a caption, titles of columns, and the first cell of a row as its title.

    It has no colors of its own, so that it is as dark or light as the page. Texts are escaped; columns of numbers stand
    at the right.

    Parameters
    ----------
    caption : what it shows; it may be empty
    heads : titles of the columns, with units; none for a list of names and values
    rows : texts, numbers, or None for what is not known
    note : a sentence below
    """
    cells = [[_text(cell) for cell in row] for row in rows]
    columns = max(map(len, [heads, *cells]), default=0)
    numeric = [all(NUMBER.fullmatch(row[k]) for row in cells if k < len(row)) for k in range(columns)]
    sides = [f' style="text-align:{"right;white-space:nowrap" if number else "left"}"' for number in numeric]
    title = '<caption style="caption-side:top;text-align:left;color:inherit;font-weight:bold">'
    lines = [f'<table class="{PLAIN}">', f"{title}{escape(caption)}</caption>" if caption else ""]
    if heads:
        titles = (f'<th scope="col"{side}>{escape(head)}</th>' for head, side in zip(heads, sides, strict=False))
        lines.append(f"<thead><tr>{''.join(titles)}</tr></thead>")
    lines.append("<tbody>")
    for row in cells:
        values = [f"<td{side}>{escape(text)}</td>" for text, side in zip(row, sides, strict=False)]
        if len(row) > 1:
            values[0] = f'<th scope="row" style="text-align:left">{escape(row[0])}</th>'
        lines.append(f"<tr>{''.join(values)}</tr>")
    return "\n".join([*filter(None, lines), "</tbody></table>", *([paragraphs([note])] if note else [])])


def paragraphs(texts: Iterable[str]) -> str:
    """Sentences, one a paragraph."""
    return "\n".join(f'<p class="{PLAIN}">{escape(text)}</p>' for text in texts)


def folded(title: str, content: str, is_open: bool = False) -> str:
    """HTML that opens and closes when its title is clicked."""
    state = " open" if is_open else ""
    return f'<details{state}><summary class="{PLAIN}">{escape(title)}</summary>\n{content}\n</details>'


def block(text: str) -> str:
    """A text with its lines and columns; a long one scrolls."""
    return f'<pre class="{PLAIN}" tabindex="0" style="max-height:36em;overflow:auto">{escape(text)}</pre>'


def _text(cell: Cell) -> str:
    if cell is None:
        return "–"
    return f"{cell:.6g}" if isinstance(cell, float) else str(cell)


class Text(str):
    """A text of several lines: a notebook shows them as lines, not between quotes."""

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, str]:
        return {"text/plain": str(self), "text/html": block(self)}

    def __reduce__(self) -> tuple[Any, ...]:
        return str, (str(self),)


class Faults(list[str]):
    """What a check found, a sentence each."""

    def _repr_html_(self) -> str:
        if not self:
            return paragraphs(["no faults"])
        return table("faults", ("number", "what is wrong"), [(str(k), fault) for k, fault in enumerate(self, start=1)])


class Values(dict[str, Any]):
    """Values by name; a notebook shows them as a table under their title."""

    def __init__(self, title: str, values: Mapping[str, Any]) -> None:
        super().__init__(values)
        self.title = title

    def _repr_html_(self) -> str:
        return table(self.title, ("name", "value"), [(name, _shown(value)) for name, value in self.items()])

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.title, dict(self))


def _shown(value: Any) -> Cell:
    """A value of a cell: parts of a list or dictionary one after the other."""
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_text(_shown(part))}" for name, part in value.items())
    if isinstance(value, list | tuple | set | frozenset):
        return "; ".join(_text(_shown(part)) for part in value)
    return value if isinstance(value, str | float | int) and not isinstance(value, bool) else str(value)
