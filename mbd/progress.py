"""Bars on a terminal or in a notebook."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from time import perf_counter
from typing import Any, TypeVar

BAR_DELAY = 3.0
"""Seconds after which a slow run that nobody wanted to watch shows a bar all the same."""

Progress = Callable[[float, float], None]
Item = TypeVar("Item")


@contextmanager
def progress_bar() -> Iterator[Progress | None]:
    """Simulated time and time left on a terminal or in a notebook, at most five times a second; nothing elsewhere."""
    if not _is_wanted():
        yield None
        return
    bars: list[Any] = []
    shape = "{percentage:3.0f}% |{bar:30}| {n:.2f} of {total:.2f} s  [{elapsed} < {remaining}]"

    def show(t: float, until: float) -> None:
        if not bars:
            bars.append(_bar(shape, until))
        bars[0].update(t - bars[0].n)

    try:
        yield show
    finally:
        for bar in bars:
            bar.close()


@contextmanager
def run_bar(wanted: Any, slow: bool, begin: float, end: float) -> Iterator[Progress | None]:
    """Who is informed how far a run is.

    wanted : a function, which is given the time and the end; True for a bar on a terminal or in a notebook; 'late' for
        one after `BAR_DELAY` seconds where the run is `slow`; else nobody
    begin, end : of the run [s]
    """
    if callable(wanted):
        yield wanted
        return
    late = wanted == "late" and slow
    if not (wanted is True or late) or not _is_seen():
        yield None
        return
    bar, began = (_Bar() if find_spec("tqdm") else _Line()), perf_counter()

    def show(t: float, until: float) -> None:
        if bar.shown or not late or perf_counter() - began > BAR_DELAY:
            bar.show(t - begin, end - begin, perf_counter() - began)

    try:
        yield show
    finally:
        bar.close()


class _Bar:
    """A bar of tqdm, made when it is shown first."""

    bar: Any = None

    @property
    def shown(self) -> bool:
        return self.bar is not None

    def show(self, done: float, total: float, seconds: float) -> None:
        if self.bar is None:
            self.bar = _bar("{l_bar}{bar}| {n:.2f}/{total:.2f} s [{elapsed}<{remaining}]", total, leave=True)
            self.bar.start_t -= seconds
        self.bar.update(done - self.bar.n)

    def close(self) -> None:
        if self.bar is not None:
            self.bar.close()


class _Line:
    """A line of text that is written again and again, where tqdm is not installed."""

    shown = False

    def show(self, done: float, total: float, seconds: float) -> None:
        self.shown = True
        left = f", {seconds * (total / done - 1.0):.0f} s left" if done > 0.0 else ""
        sys.stderr.write(f"\r{100.0 * done / total if total else 100.0:3.0f} % of {total:g} s{left:<20}")
        sys.stderr.flush()

    def close(self) -> None:
        if self.shown:
            sys.stderr.write("\n")


@contextmanager
def share_bar(wanted: bool = True) -> Iterator[Progress | None]:
    """Runs done of all runs on a terminal or in a notebook, as a percentage and the time left; nothing elsewhere."""
    if not wanted or not _is_wanted():
        yield None
        return
    with _bar("{percentage:3.0f}% |{bar:30}|  [{elapsed} < {remaining}]", 1.0) as bar:
        yield lambda done, total: (bar.update(max(done / total - bar.n, 0.0)), None)[1]


@contextmanager
def trial_bar(wanted: bool, title: str) -> Iterator[Callable[[int, float], None]]:
    """Trials so far and the best value of a search on a terminal or in a notebook, if `wanted`; nothing elsewhere."""
    if not wanted or not _is_wanted():
        yield lambda count, best: None
        return
    with _bar("{n} trials [{elapsed}] {desc}", 0.0) as bar:

        def show(count: int, best: float) -> None:
            bar.set_description_str(f"{title}: {best:.6g}", refresh=False)
            bar.update(count - bar.n)

        yield show


def counted(items: Sequence[Item], name: Callable[[Item], str]) -> Iterator[Item]:
    """The items one by one, with a bar that names the present one; elsewhere, such as in a log, a line for each."""
    if not _is_wanted():
        for number, item in enumerate(items, 1):
            print(f"{number}/{len(items)} {name(item)}", file=sys.stderr, flush=True)
            yield item
        return
    with _bar("{n}/{total} |{bar:30}| {desc}", len(items)) as bar:
        for item in items:
            bar.set_description_str(name(item))
            yield item
            bar.update()


def _bar(shape: str, total: float, leave: bool = False) -> Any:
    """A bar of tqdm: in a notebook a widget where ipywidgets is installed, else a line of text."""
    as_widget = in_notebook() and find_spec("ipywidgets") is not None
    tqdm = import_module("tqdm.auto" if as_widget else "tqdm").tqdm
    text = shape.replace("{bar:30}", "{bar}") if as_widget else shape
    return tqdm(total=total, bar_format=text, mininterval=0.2, leave=leave, file=None if as_widget else sys.stderr)


def in_notebook() -> bool:
    """Whether this runs in a kernel of Jupyter, whose cells show bars."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return shell is not None and "IPKernelApp" in shell.config


def _is_seen() -> bool:
    """Whether somebody sees what is written to the terminal or the cell."""
    return sys.stderr.isatty() or in_notebook()


def _is_wanted() -> bool:
    return _is_seen() and find_spec("tqdm") is not None
