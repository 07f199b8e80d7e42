"""Bars on a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any, TypeVar

__all__ = ["Progress", "counted", "progress_bar", "share_bar"]

Progress = Callable[[float, float], None]
Item = TypeVar("Item")


@contextmanager
def progress_bar() -> Iterator[Progress | None]:
    """Simulated time and time left on a terminal, at most five times a second; nothing elsewhere."""
    if not _is_wanted():
        yield None
        return
    from tqdm import tqdm

    bars: list[tqdm[Any]] = []
    shape = "{percentage:3.0f}% |{bar:30}| {n:.2f} of {total:.2f} s  [{elapsed} < {remaining}]"

    def show(t: float, until: float) -> None:
        if not bars:
            bars.append(tqdm(total=until, bar_format=shape, mininterval=0.2, leave=False, file=sys.stderr))
        bars[0].update(t - bars[0].n)

    try:
        yield show
    finally:
        for bar in bars:
            bar.close()


@contextmanager
def share_bar() -> Iterator[Progress | None]:
    """Runs done of all runs on a terminal, as a percentage and the time left; nothing elsewhere."""
    if not _is_wanted():
        yield None
        return
    from tqdm import tqdm

    shape = "{percentage:3.0f}% |{bar:30}|  [{elapsed} < {remaining}]"
    with tqdm(total=1.0, bar_format=shape, mininterval=0.2, leave=False, file=sys.stderr) as bar:
        yield lambda done, total: (bar.update(max(done / total - bar.n, 0.0)), None)[1]


def counted(items: Sequence[Item], name: Callable[[Item], str]) -> Iterator[Item]:
    """The items one by one, with a bar that names the present one on a terminal; nothing elsewhere."""
    if not _is_wanted():
        yield from items
        return
    from tqdm import tqdm

    with tqdm(total=len(items), leave=False, file=sys.stderr, bar_format="{n}/{total} |{bar:30}| {desc}") as bar:
        for item in items:
            bar.set_description_str(name(item))
            yield item
            bar.update()


def _is_wanted() -> bool:
    return sys.stderr.isatty() and find_spec("tqdm") is not None
