"""What ``mbd accuracy`` and ``mbd effects`` share: the script they measure, and the files they write."""

from __future__ import annotations

import webbrowser
from argparse import Namespace
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Found", "Script", "passed_on", "write"]


class Script(Protocol):
    """A script that has been executed: where it is, and what it defines."""

    @property
    def path(self) -> Path: ...

    @property
    def names(self) -> dict[str, Any]: ...

    def require(self, *wanted: str) -> None: ...


class Found(Protocol):
    """What was measured, in all its forms."""

    def to_csv(self, path: str | Path) -> Path: ...

    def plot(self, path: str | Path | None = None) -> Figure: ...

    def page(self, path: str | Path) -> Path: ...


def write(found: Found, script: Script, arguments: Namespace, name: str) -> None:
    """Print it; write table, plot and page as ``name.csv``, ``name.png`` and ``name.html``, and say where.

    Parameters
    ----------
    arguments : out, the folder or None for mbd-runs/SCRIPT; open, whether to show the page
    """
    out = Path(arguments.out or Path("mbd-runs") / script.path.stem.replace("_", "-"))
    print(found)
    written = [found.to_csv(out / f"{name}.csv")]
    if find_spec("matplotlib") is None:
        print("no plot: matplotlib is not installed; try pip install 'mbd[plot]'")
    else:
        found.plot(out / f"{name}.png")
        written.append(out / f"{name}.png")
    written.append(found.page(out / f"{name}.html"))
    print("\nwrote        " + "\n             ".join(str(path) for path in written))
    if arguments.open:
        webbrowser.open(written[-1].resolve().as_uri())


def passed_on(names: Mapping[str, Any], wanted: tuple[str, ...]) -> dict[str, Any]:
    """Those of a script's names that go on as they are."""
    return {name: names[name] for name in wanted if name in names}
