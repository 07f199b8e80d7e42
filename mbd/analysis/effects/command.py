"""``mbd effects``: leave out each effect in turn, print the table and what follows from it, write table and plot."""

from __future__ import annotations

from argparse import Namespace
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Protocol

from mbd.analysis.effects.lab import OPTIONS, effects
from mbd.errors import ModelError

__all__ = ["run"]


class Script(Protocol):
    """A script that has been executed: where it is, and what it defines."""

    @property
    def path(self) -> Path: ...

    @property
    def names(self) -> dict[str, Any]: ...

    def require(self, *wanted: str) -> None: ...


def run(script: Script, arguments: Namespace) -> int:
    """Study the scene of a script; 0, or 130 where it was interrupted.

    Parameters
    ----------
    arguments : tolerance, out, until, dt, output; see `mbd.view.effects_arguments`
    """
    given: dict[str, Any] = {name: value for name in ("until", "dt") if (value := getattr(arguments, name)) is not None}
    if "dt" not in given and "dt" not in script.names and "tol" in script.names:
        raise ModelError(
            f"{script.path.name} asks for a tolerance, but effects are compared at the same steps; give --dt SECONDS"
        )
    script.require("model", "start", *(name for name in ("until", "dt") if name not in given))
    given = {name: given.get(name, script.names.get(name)) for name in ("until", "dt")}
    names, out = script.names, Path(arguments.out or Path("mbd-runs") / script.path.stem.replace("_", "-"))
    found = effects(
        names["model"], names["start"], given["until"], names.get("integrator"),
        given["dt"], outputs=arguments.output, tolerance=arguments.tolerance, progress=True,
        **{name: names[name] for name in OPTIONS if name in names},
    )  # fmt: skip
    print(found)
    written = [found.to_csv(out / "effects.csv")]
    if find_spec("matplotlib") is None:
        print("no plot: matplotlib is not installed; try pip install 'mbd[plot]'")
    else:
        found.plot(out / "effects.png")
        written.append(out / "effects.png")
    print("\nwrote        " + "\n             ".join(str(path) for path in written))
    return 0 if found.complete else 130
