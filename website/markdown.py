"""Docstrings as Markdown: sections as lists, doctests as code, public names as links to their own entry."""

from __future__ import annotations

import re
from collections.abc import Iterator

import mbd

__all__ = ["to_markdown"]

NAMED = re.compile(r"(?<!\[)`{1,2}(?:mbd\.)?(" + "|".join(map(re.escape, mbd.__all__)) + r")`{1,2}(?!\])")
"""A public name between backticks."""

ITEM = re.compile(r"(\*{0,2}\w+(?:, \*{0,2}\w+)*) : ")
"""'name : ' or 'one, other : ' at the start of an item."""


def to_markdown(text: str, own: str = "") -> str:
    """A docstring of numpy's form as Markdown; `own` name is not linked to itself.

    >>> print(to_markdown("Long.\\n\\nParameters\\n----------\\na, b : two\\n    things [m]\\n"))
    Long.
    <BLANKLINE>
    **Parameters**
    <BLANKLINE>
    - `a`, `b`: two things [m]
    """
    found: list[str] = []
    lines = text.splitlines()
    while lines:
        if len(lines) > 1 and lines[0] and re.fullmatch(r"-{4,}", lines[1]):
            title, lines = lines[0], lines[2:]
            body: list[str] = []
            while lines and (lines[0] or (len(lines) > 1 and lines[1].startswith(" "))):
                body.append(lines.pop(0))
            found += [f"**{title}**", "", *_items(body), ""]
        elif lines[0].startswith(">>>"):
            code = []
            while lines and lines[0]:
                code.append(lines.pop(0))
            found += ["```pycon", *code, "```"]
        else:
            found.append(lines.pop(0))
    return NAMED.sub(lambda match: match[0] if match[1] == own else f"[`{match[1]}`][mbd.{match[1]}]", "\n".join(found))


def _items(lines: list[str]) -> Iterator[str]:
    """A section as a list, an entry for each line that is not indented."""
    entries: list[list[str]] = []
    for line in lines:
        if line.startswith(" ") and entries:
            entries[-1].append(line.strip())
        elif line:
            entries.append([line])
    for entry in entries:
        words = " ".join(entry)
        if ITEM.match(words):
            yield from (f"- {_code(name)}: {said.strip(' ;')}" for name, said in _pairs(words))
        elif len(entry) > 1:
            yield f"- {_code(entry[0])}: {' '.join(entry[1:])}"
        else:
            yield f"- {words}"


def _pairs(words: str) -> list[tuple[str, str]]:
    """'a : one; b : two' as its pairs."""
    parts = re.split(r"(?:^|; )" + ITEM.pattern, words)[1:]
    return list(zip(parts[::2], parts[1::2], strict=True))


def _code(names: str) -> str:
    return ", ".join(f"`{name.strip()}`" for name in names.split(","))
