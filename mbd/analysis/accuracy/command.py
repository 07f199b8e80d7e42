"""``mbd accuracy``: measure, print the table and what follows from it, write table, plot and page."""

from __future__ import annotations

import webbrowser
from argparse import Namespace
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Protocol

from mbd.analysis.accuracy.lab import accuracy

__all__ = ["run"]

OPTIONS = ("contact", "impact", "locate", "parameters", "rest_speed", "backend")
"""Names that a script may define to pass them on."""


class Script(Protocol):
    """A script that has been executed: where it is, and what it defines."""

    @property
    def path(self) -> Path: ...

    @property
    def names(self) -> dict[str, Any]: ...

    def require(self, *wanted: str) -> None: ...


def run(script: Script, arguments: Namespace) -> int:
    """Measure the model of a script; 0, 1 where the target was not reached, 130 where it was interrupted.

    The script's own integrator joins the default ones where it is none of them.

    Parameters
    ----------
    arguments : target, out, until, dt, tol, quantity, open; see `mbd.view.lab_arguments`
    """
    script.require("model", "start", *(["until"] if arguments.until is None else []))
    names, out = script.names, Path(arguments.out or Path("mbd-runs") / script.path.stem.replace("_", "-"))
    found = accuracy(
        names["model"], names["start"], names["until"] if arguments.until is None else arguments.until,
        quantities=arguments.quantity, dts=arguments.dt, target=arguments.target, also=names.get("integrator"),
        tols=arguments.tol, progress=True, **{name: names[name] for name in OPTIONS if name in names},
    )  # fmt: skip
    print(found)
    written = [found.to_csv(out / "accuracy.csv")]
    if find_spec("matplotlib") is None:
        print("no plot: matplotlib is not installed; try pip install 'mbd[plot]'")
    else:
        found.plot(out / "accuracy.png")
        written.append(out / "accuracy.png")
    written.append(found.page(out / "accuracy.html"))
    print("\nwrote        " + "\n             ".join(str(path) for path in written))
    if arguments.open:
        webbrowser.open(written[-1].resolve().as_uri())
    if not found.complete:
        return 130
    return 0 if found.target is None or any(point.reaches(found.target) for point in found.points) else 1
