"""Self-contained HTML pages: a folder's page.html with its style, its data and its script put in."""

import json
import re
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from mbd.errors import TrajectoryError
from mbd.results.archive import named_file, write_whole

PICTURE = "; pictures are those of run.plot(path=…) and run.final.plot('start.png')"
OTHERS = {
    **dict.fromkeys((".png", ".svg", ".pdf", ".jpg", ".jpeg"), PICTURE),
    **dict.fromkeys((".gif", ".mp4", ".webm", ".mov", ".avi"), "; it moves, and a recording of the screen is a video"),
    **dict.fromkeys((".csv", ".xlsx"), "; run.to_csv(…) writes a table"),
    ".npz": "; run.save(…) writes the run",
}
"""What is meant by names of files that are no pages, by their suffix."""


def filled(
    folder: str, content: Any, parts: Mapping[str, str], scripts: Sequence[str] = ("page.js",),
    styles: Sequence[str] = ("page.css",),
) -> str:  # fmt: skip
    """The page of a folder of `mbd.view`.

    content : what its script draws, as plain lists; parts : texts by the mark they replace; scripts, styles : joined in
    order
    """

    def text(name: str) -> str:
        return part(folder, name)

    known = {
        **parts,
        "/*style*/": "".join(text(name) for name in styles),
        "/*data*/": json.dumps(content, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c"),
        "/*script*/": "".join(text(name) for name in scripts),
    }
    return re.sub("|".join(map(re.escape, known)), lambda mark: known[mark.group()], text("page.html"))


def part(folder: str, name: str) -> str:
    """A file of a folder of `mbd.view` as text."""
    return (resources.files("mbd.view") / folder).joinpath(name).read_text(encoding="utf-8")


def written(page: str, path: str | Path) -> Path:
    """Where the page was written; folders are made.

    Raises
    ------
    TrajectoryError
        for the name of a picture, a video or a table.
    """
    target = named_file(path)
    if target.suffix.lower() in OTHERS:
        raise TrajectoryError(
            f"a page is an HTML file, which a browser shows; got {target.name!r}; name it '{target.stem}.html'"
            f"{OTHERS[target.suffix.lower()]}"
        )
    write_whole(target, lambda partial: partial.write_text(page, encoding="utf-8"))
    return target
