"""What tests read of a page: its elements, and what it does in a browser."""

from collections.abc import Iterator
from contextlib import contextmanager
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

CHROMIUM = Path("/usr/bin/chromium")


class Elements(HTMLParser):
    """Tags of a page or table with their attributes, the text behind each, and scripts."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.texts.append("")

    def handle_data(self, data):
        self.texts[-1:] = [self.texts[-1] + data] if self.texts else []

    @property
    def names(self) -> list[str]:
        return [tag for tag, _ in self.tags]

    @property
    def scripts(self) -> list[str]:
        return [text for tag, text in zip(self.names, self.texts, strict=True) if tag == "script"]


@contextmanager
def opened(page: Path, fragment: str = "", **context: Any) -> Iterator[Any]:
    """A tab of a browser with a page; nothing is logged as an error, and nothing else is asked for."""
    api = pytest.importorskip("playwright.sync_api")
    if not CHROMIUM.exists():
        pytest.skip("needs Chromium")
    with api.sync_playwright() as play:
        browser = play.chromium.launch(executable_path=str(CHROMIUM), args=["--no-sandbox", "--disable-gpu"])
        tab = browser.new_context(offline=True, **context).new_page()
        complaints, requests = [], []
        tab.on("console", lambda message: complaints.append(message.text))
        tab.on("pageerror", lambda error: complaints.append(str(error)))
        tab.on("request", lambda request: requests.append(request.url))
        tab.goto(page.as_uri() + fragment)
        yield tab
        browser.close()
    assert complaints == [] and len(requests) == 1
