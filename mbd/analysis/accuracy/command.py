"""``mbd accuracy``: measure, print the table and what follows from it, write table, plot and page."""

from __future__ import annotations

from argparse import Namespace

from mbd.analysis.accuracy.lab import OPTIONS, accuracy
from mbd.analysis.command import Script, passed_on, write

__all__ = ["run"]


def run(script: Script, arguments: Namespace) -> int:
    """Measure the model of a script; 0, 1 where the target was not reached, 130 where it was interrupted.

    The script's own integrator joins the default ones where it is none of them. A script may also define `integrators`,
    `dts`, `tols`, `quantities` and `known` values; the command line's take their place.

    Parameters
    ----------
    arguments : target, out, until, dt, tol, quantity, open; see `mbd.view.lab_arguments`
    """
    script.require("model", "start", *(["until"] if arguments.until is None else []))
    names = script.names
    own = passed_on(names, ("integrators", "known", "store"))
    if arguments.dt is None and arguments.tol is None:
        own |= passed_on(names, ("dts", "tols"))
    else:
        own |= {"dts": arguments.dt, "tols": arguments.tol}
    if arguments.quantity is not None:  # judged by a reference of the lab's own
        own.pop("known", None)
        own["quantities"] = arguments.quantity
    elif "known" not in own:
        own |= passed_on(names, ("quantities",))
    if "known" not in own:
        own.pop("store", None)
    found = accuracy(
        names["model"], names["start"], names["until"] if arguments.until is None else arguments.until,
        target=arguments.target, also=names.get("integrator") if "integrators" not in own else None, progress=True,
        **own, **passed_on(names, OPTIONS),
    )  # fmt: skip
    write(found, script, arguments, "accuracy")
    if not found.complete:
        return 130
    return 0 if found.target is None or any(point.reaches(found.target) for point in found.points) else 1
