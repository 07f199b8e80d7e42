"""What the site has beside the files of docs/: front page, gallery, reference, and links that lead out of docs/."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File

from website import gallery, reference
from website.links import FRONT, relinked

ROOT = Path(__file__).resolve().parents[1]


def on_files(files: Any, config: Any) -> Any:
    """The pages that are made rather than written."""
    known = gallery.read()
    made = {place: (ROOT / source).read_text(encoding="utf-8") for source, place in FRONT.items()}
    made |= {place: relinked(text, "") for place, text in made.items()}
    made |= {"CITATION.cff": (ROOT / "CITATION.cff").read_text(encoding="utf-8")}
    made |= {"gallery/index.md": gallery.index(known), **reference.pages()}
    for one in known:
        made |= {f"gallery/{one.name}.md": one.page, f"gallery/{one.name}-run.html": one.player}
    pictures = {f"gallery/{one.name}.png": one.solids for one in known if one.solids is not None}
    for place, text in (made | pictures).items():
        files.append(File.generated(config, place, content=text))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Links of docs/ that lead to other files of the repository."""
    return markdown if page.file.generated_by else relinked(markdown, "docs")


def on_page_content(html: str, **_: Any) -> str:
    """A corner of a table that says nothing is no heading."""
    return re.sub(r"<th([^>]*)></th>", r"<td\1></td>", html)


def on_post_page(output: str, page: Any, **_: Any) -> str:
    """What the theme leaves without a name, and the one script that it would load from a network."""
    output = output.replace(
        'data-md-component="search" role="dialog"', 'data-md-component="search" role="dialog" aria-label="Search"'
    )
    up = "../" * page.file.dest_uri.count("/")
    return output.replace("https://unpkg.com/iframe-worker/shim", f"{up}offline.js")


def on_post_build(config: Any, **_: Any) -> None:
    """The page of a server for what it has not found leads nowhere in a folder of files."""
    (Path(config.site_dir) / "404.html").unlink()
