"""``mbd effects``: leave out each effect in turn, print table and recommendation, write table, plot and page."""

from __future__ import annotations

from argparse import Namespace
from typing import Any

from mbd.analysis.command import Script, passed_on, write
from mbd.analysis.effects.lab import OPTIONS, effects
from mbd.errors import ModelError

__all__ = ["run"]


def run(script: Script, arguments: Namespace) -> int:
    """Study the scene of a script; 0, or 130 where it was interrupted.

    Parameters
    ----------
    arguments : tolerance, out, until, dt, output, open; see `mbd.view.lab_arguments`
    """
    given: dict[str, Any] = {name: value for name in ("until", "dt") if (value := getattr(arguments, name)) is not None}
    if "dt" not in given and "dt" not in script.names and "tol" in script.names:
        raise ModelError(
            f"{script.path.name} asks for a tolerance, but effects are compared at the same steps; give --dt SECONDS"
        )
    script.require("model", "start", *(name for name in ("until", "dt") if name not in given))
    given = {name: given.get(name, script.names.get(name)) for name in ("until", "dt")}
    names = script.names
    found = effects(
        names["model"], names["start"], given["until"], names.get("integrator"),
        given["dt"], outputs=arguments.output, tolerance=arguments.tolerance, progress=True,
        **passed_on(names, OPTIONS),
    )  # fmt: skip
    write(found, script, arguments, "effects")
    return 0 if found.complete else 130
