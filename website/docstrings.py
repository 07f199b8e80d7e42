"""What mkdocstrings loads: every docstring as Markdown."""

from __future__ import annotations

from typing import Any

import griffe

from website.markdown import to_markdown

__all__ = ["Markdown"]


class Markdown(griffe.Extension):
    """Every docstring that griffe reads is turned into Markdown."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        if obj.docstring:
            obj.docstring.value = to_markdown(obj.docstring.value, obj.name)
