"""Links of the repository's pages as links of the site."""

from __future__ import annotations

import posixpath
import re
from pathlib import Path

__all__ = ["FRONT", "relinked"]

ROOT = Path(__file__).resolve().parents[1]
FRONT = {"README.md": "index.md", "CHANGELOG.md": "changelog.md", "CONTRIBUTING.md": "contributing.md"}
"""Files of the repository that are pages of the site."""

LINK = re.compile(r"\[([^\]]*)\]\(([^)#\s]*)(#[^)\s]*)?\)")


def relinked(markdown: str, folder: str) -> str:
    """Links of a page in a folder of the repository, as links of the site's top level.

    What the site does not have becomes its text alone.

    >>> relinked("[guide](docs/guide.md#a), [text](mbd/model.py), [far](https://a.b)", "")
    '[guide](guide.md#a), text, [far](https://a.b)'
    >>> relinked("[readme](../README.md), [walker](../examples/kneed_walker.py)", "docs")
    '[readme](index.md), [walker](gallery/kneed-walker.md)'
    """

    def found(match: re.Match[str]) -> str:
        text, target, anchor = match[1], match[2], match[3] or ""
        if not target or "://" in target:
            return match[0]
        path = posixpath.normpath(posixpath.join(folder, target))
        if not (ROOT / path).exists():
            return match[0]  # no link, or one that the build will complain of
        place = site_place(path)
        return text if place is None else f"[{text}]({place}{anchor})"

    return LINK.sub(found, markdown)


def site_place(path: str) -> str | None:
    """Where the site has a file of the repository."""
    if path in FRONT:
        return FRONT[path]
    if path == "examples":
        return "gallery/index.md"
    if path.startswith("examples/"):
        return f"gallery/{Path(path).stem.replace('_', '-')}.md"
    if path == "CITATION.cff":
        return path
    return path.removeprefix("docs/") if path.startswith("docs/") else None
