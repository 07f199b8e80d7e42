"""The command line: ``mbd run kneed-walker``, ``mbd check my_model.py``, ``mbd hardcases g1``, ``mbd info``, …"""

from __future__ import annotations

import argparse
import ast
import gc
import os
import shlex
import sys
import textwrap
import time
import traceback
import warnings
import webbrowser
from collections.abc import Callable, Sequence
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbd import commands
from mbd.bodies.values import printable
from mbd.errors import MbdError, MbdWarning, ModelError, SimulationError
from mbd.progress import progress_bar
from mbd.scripts import (
    OPTIONS,
    Script,
    examples,
    find,
    folder,
    import_plotting,
    is_recording,
    is_run_file,
    name_of_run,
    name_of_script,
)
from mbd.view.parser import Parser, writable

if TYPE_CHECKING:
    from mbd.results.trajectory import Trajectory

__all__ = ["Script", "examples", "find", "main"]

_wrapped = partial(textwrap.fill, width=100, break_long_words=False, break_on_hyphens=False)
"""Text in lines of 100 columns at most."""

TOLD = (
    MbdError, OSError, ArithmeticError, AssertionError, AttributeError, ImportError, LookupError, NameError,
    RuntimeError, SyntaxError, TypeError, ValueError,
)  # fmt: skip
"""Errors of users' scripts that are reported in a sentence; ``--debug`` shows where they came from."""


def _out(arguments: argparse.Namespace) -> Path:
    """The folder for results of a script, into which can be written."""
    usual = Path("mbd-runs") / name_of_script(arguments.script)
    arguments.out = writable(usual if arguments.out is None else arguments.out)
    return Path(arguments.out)


def _changes(arguments: argparse.Namespace) -> dict[str, Any]:
    """Settings of the command line that replace those of the script."""
    changes = {name: value for name in ("dt", "tol", "until") if (value := getattr(arguments, name)) is not None}
    return changes | ({"parameters": dict(arguments.set)} if arguments.set else {})


def _assignment(text: str) -> tuple[str, float]:
    """The parameter and the value of 'knee loss.coefficient=1'."""
    name, sign, value = text.rpartition("=")
    try:
        if sign and name.strip():
            return name.strip(), float(value)
    except ValueError:
        pass
    raise argparse.ArgumentTypeError(f"expected NAME=VALUE, such as 'knee loss.coefficient=1', got {text!r}")


def run_command(arguments: argparse.Namespace) -> int:
    """``mbd run``: simulate, print a summary, write plots, page, run and record."""
    if is_run_file(arguments.script):
        raise ModelError(
            f"{arguments.script!r} is a stored run; show it with: mbd show {shlex.quote(arguments.script)}"
        )
    began = time.perf_counter()
    out = _out(arguments)
    plots = _can_plot(arguments.plots)
    if plots:
        import_plotting()
    script = Script.load(arguments.script, _changes(arguments))
    for wrong, name in script.misspelt().items():
        print(
            f"note: {script.path.name} defines {wrong!r}, which is no setting; did you mean {name!r}?", file=sys.stderr
        )
    loaded = time.perf_counter()
    failure: SimulationError | None = None
    with progress_bar() as progress:
        try:
            run = script.run(progress, _changes(arguments))
        except SimulationError as error:
            if error.run is None:
                raise
            run, failure = error.run, error
    ended = time.perf_counter()
    wall = {"load": loaded - began, "simulate": ended - loaded}
    _print(run)
    from mbd.view.report import write

    _print_paths(write(run, out, wall, plots, script.path), out, arguments.open)
    wall = {stage: round(seconds, 3) for stage, seconds in (wall | {"write": time.perf_counter() - ended}).items()}
    stages = ", ".join(f"{stage} {seconds:.3f} s" for stage, seconds in wall.items())
    print(f"wall time    {stages}; total {sum(wall.values()):.3f} s")
    if failure is not None:
        raise failure
    return 0 if run.success else 1


def show_command(arguments: argparse.Namespace) -> int:
    """``mbd show``: print and draw a stored run, without simulating again."""
    from mbd.results.trajectory import load
    from mbd.view.report import draw

    path = Path(arguments.run)
    out = writable(Path("mbd-runs") / name_of_run(path) if arguments.out is None else arguments.out)
    run = load(path)
    _print(run)
    _print_paths(draw(run, out, _can_plot(arguments.plots)), out, arguments.open)
    return 0


def _print(run: Trajectory) -> None:
    """Summary, steps of a walk and energy by cause."""
    from mbd.analysis.gait import gait

    print(run)
    steps = gait(run)
    if len(steps):
        print(f"\n{steps}")
    print(f"\n{run.energy}\n")


def _can_plot(wanted: bool) -> bool:
    """Whether plots are wanted and matplotlib is there; says so where only the latter fails."""
    there = find_spec("matplotlib") is not None
    if wanted and not there:
        print("no plots: matplotlib is not installed; try pip install 'mbd[plot]'", file=sys.stderr)
    return wanted and there


def _print_paths(paths: Sequence[Path], out: Path, show: bool) -> None:
    print("wrote        " + "\n             ".join(str(path) for path in paths))
    if show:
        webbrowser.open((out / "page.html").resolve().as_uri())


def check_command(arguments: argparse.Namespace) -> int:
    """``mbd check``: every fault of a script's model, what its integrator does not go with, its mobility."""
    script = Script.load(arguments.script)
    script.require("model")
    model = script.names["model"]
    if not hasattr(model, "check"):
        raise ModelError(f"model of {script.path.name} must be an mbd.Model or mbd.Lagrangian, not {model!r}")
    faults = model.check()
    for fault in faults:
        print(f"- {fault}")
    print(f"{model!r}: " + (f"{len(faults)} fault{'s' * (len(faults) > 1)}" if faults else "no faults found"))
    if faults:
        return 1
    from mbd import State, mobility

    refused = _refused(script.names)
    for refusal in refused:
        print(f"- {refusal}")
    start = script.names.get("start")
    found = mobility(model, start if isinstance(start, State) else None)
    print(found)
    return 0 if found.consistent and not refused else 1


def _refused(names: dict[str, Any]) -> list[str]:
    """What a script's integrator and options do not go with in its model."""
    from mbd.compile.mechanisms import mechanism_of
    from mbd.integrators import HHT, Integrator
    from mbd.simulation.capabilities import refusals

    scheme = names.get("integrator", HHT(alpha=0.05))
    if not isinstance(scheme, Integrator):
        return []
    options = {name: names[name] for name in OPTIONS if name in names}
    return refusals(mechanism_of(names["model"]).equations, scheme, options)


def new_command(arguments: argparse.Namespace) -> int:
    """``mbd new``: a commented script to begin with."""
    from mbd.view.starter import STARTER

    if not Path(arguments.name).name:
        raise ModelError(f"a name for the script is expected, such as my-leg, not {arguments.name!r}")
    path = Path(arguments.name).with_suffix(".py")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"there is no folder '{path.parent}' for '{path.name}'; make it first")
    if path.exists():
        raise FileExistsError(f"'{path}' exists; give another name")
    title = printable(path.stem.replace("_", " ").replace("-", " ").strip() or path.stem, "script")
    shown = {"title": _Quoted(title), "file": _Quoted(shlex.quote(str(path))), "page": _Quoted(f"{path.stem}.html")}
    path.write_text(STARTER.format(**shown), encoding="utf-8")
    print(f"wrote {path}; run it with: mbd run {shlex.quote(str(path))}")
    return 0


class _Quoted(str):
    """A text that stands between double quotes where it can, and within a docstring with nothing that would end it."""

    def __repr__(self) -> str:
        return super().__repr__() if '"' in self or "\\" in self else f'"{self}"'

    def __format__(self, spec: str) -> str:
        return self.replace("\\", "\\\\").replace('"', '\\"')


def examples_command(arguments: argparse.Namespace) -> int:
    """``mbd examples``: names and first lines."""
    known = examples()
    width = max(map(len, known), default=0)
    for name, path in known.items():
        text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
        first = text.partition("\n")[0]
        print(_wrapped(first, initial_indent=f"{name:<{width}}  ", subsequent_indent=" " * (width + 2)))
    print("run one with: mbd run NAME" if known else f"no examples in {folder()}")
    return 0


def hardcases_command(arguments: argparse.Namespace) -> int:
    """``mbd hardcases``: judge every hard case."""
    arguments.out = str(writable(arguments.out))
    from mbd.hardcases.command import run

    return run(arguments.names, arguments.scheme, arguments.slow, arguments.out, arguments.markdown)


def accuracy_command(arguments: argparse.Namespace) -> int:
    """``mbd accuracy``: errors and processor times of schemes and steps."""
    _out(arguments)
    return commands.accuracy(Script.load(arguments.script), arguments)


def effects_command(arguments: argparse.Namespace) -> int:
    """``mbd effects``: what each effect of a scene costs and changes."""
    _out(arguments)
    return commands.effects(Script.load(arguments.script), arguments)


def gait_command(arguments: argparse.Namespace) -> int:
    """``mbd gait``: report how the walkers of scripts, stored runs or recordings walk, one beside the other."""
    names = [_name_of_gait(name) for name in arguments.scripts]
    arguments.out = writable(Path("mbd-runs") / names[0] if arguments.out is None else arguments.out)
    changes = {} if arguments.until is None else {"until": arguments.until}
    with progress_bar() as progress:
        runs = [_walked(name, arguments, progress, changes) for name in arguments.scripts]
    return commands.gait(runs, names, arguments)


def _walked(name: str, arguments: argparse.Namespace, progress: Any, changes: dict[str, Any]) -> Any:
    """A stored run, a recording with its model, or the run of a script."""
    from mbd.laboratory.command import is_model_file, measured, model_of_file
    from mbd.results.trajectory import load

    if is_run_file(name):
        return load(name)
    if not is_recording(name):
        return Script.load(name, changes).run(progress, changes)
    if arguments.model is None:
        return measured(name, None)
    if is_model_file(arguments.model):
        return measured(name, *model_of_file(arguments.model, arguments.feet))
    script = Script.load(arguments.model)
    script.require("model", "feet")
    return measured(name, script.names["model"], script.names["feet"])


def _name_of_gait(name: str) -> str:
    """What a gait is called in a report."""
    if is_recording(name):
        return Path(name).stem
    return name_of_run(Path(name)) if is_run_file(name) else name_of_script(name)


def info_command(arguments: argparse.Namespace) -> int:
    """``mbd info``: versions, machine, backend and cache; what goes with what."""
    from mbd.compile.backend import backend
    from mbd.compile.cache import default_cache
    from mbd.simulation.capabilities import as_text
    from mbd.view.report import machine, versions

    chosen = backend()
    rows = {name: version or "not installed" for name, version in versions().items()}
    rows |= {name: str(value) for name, value in machine().items()}
    rows["backend"] = chosen.name + (f" ({chosen.note})" if chosen.note else "")
    rows["code cache"] = str(default_cache().directory or "off") if chosen.name == "llvm" else "off"
    rows["examples"] = f"{len(examples())} in {folder()}"
    for name, value in rows.items():
        print(_wrapped(value, initial_indent=f"{name:<14}", subsequent_indent=" " * 14))
    print("\n" + "\n".join(_wrapped(line, subsequent_indent="    ") for line in as_text().splitlines()))
    return 0


def _parser() -> argparse.ArgumentParser:
    import mbd

    parser = Parser(prog="mbd", description="Simulate multibody mechanisms described in Python.")
    parser.add_argument("--version", action="version", version=f"mbd {mbd.__version__}")
    known = parser.add_subparsers(title="commands", metavar="COMMAND")

    def command(name: str, function: Callable[[argparse.Namespace], int], text: str) -> argparse.ArgumentParser:
        made = known.add_parser(name, help=text, description=text)
        made.add_argument("--debug", action="store_true", help="show the whole traceback of an error")
        made.set_defaults(function=function)
        return made

    run = command("run", run_command, "simulate a script or an example; write plots, page, run file and record")
    run.add_argument("script", metavar="SCRIPT-or-EXAMPLE", help="a Python file, or a name that 'mbd examples' lists")
    run.add_argument("--out", metavar="DIR", help="folder for the results (default: mbd-runs/NAME)")
    run.add_argument("--open", action="store_true", help="open the page in a browser")
    run.add_argument("--dt", type=float, metavar="SECONDS", help="another step size than the script's")
    run.add_argument("--tol", type=float, metavar="ERROR", help="steps that follow this error, in place of dt")
    run.add_argument("--until", type=float, metavar="SECONDS", help="another end time than the script's")
    run.add_argument(
        "--set", type=_assignment, action="append", metavar="NAME=VALUE",
        help="another value of a parameter, such as 'knee loss.coefficient=1'; may be given again",
    )  # fmt: skip
    run.add_argument("--no-plots", dest="plots", action="store_false", help="leave the plots (PNG) out")
    show = command("show", show_command, "print a stored run, write its plots and page; nothing is simulated")
    show.add_argument("run", metavar="RUN.mbd.npz", help="a file that 'mbd run' or run.save() has written")
    show.add_argument("--out", metavar="DIR", help="folder for plots and page (default: mbd-runs/NAME)")
    show.add_argument("--open", action="store_true", help="open the page in a browser")
    show.add_argument("--no-plots", dest="plots", action="store_false", help="leave the plots (PNG) out")
    new = command("new", new_command, "write a commented script to begin with")
    new.add_argument("name", metavar="NAME", help="of the script, such as my-leg")
    check = command("check", check_command, "report faults, degrees of freedom and redundant rows of a script's model")
    check.add_argument("script", metavar="SCRIPT-or-EXAMPLE", help="a Python file that defines model, or an example")
    commands.accuracy_arguments(
        command("accuracy", accuracy_command, "measure what accuracy costs: errors, times of schemes and steps")
    )
    commands.effects_arguments(
        command("effects", effects_command, "leave out each effect in turn: its cost, energy and change")
    )
    commands.gait_arguments(command("gait", gait_command, "report how walkers walk: numbers by side, curves, energy"))
    hard = command(
        "hardcases", hardcases_command, "judge scenes on which multibody systems fail; write a table and a page"
    )
    hard.add_argument(
        "names", nargs="*", metavar="NAME", help="cases, such as g1 j7, a group, such as g, or a part of ids"
    )
    hard.add_argument("--out", metavar="DIR", default="mbd-runs", help="folder for hardcases.html (default: mbd-runs)")
    hard.add_argument("--slow", action="store_true", help="also judge the cases that take long")
    hard.add_argument("--scheme", action="append", metavar="NAME", help="with this integrator only; may be given again")
    hard.add_argument("--markdown", metavar="FILE", help="also write the table into this page, between its marks")
    command("examples", examples_command, "list the examples")
    command("info", info_command, "print versions, machine, backend and cache, and what goes with what")
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; returns the exit code: 0, or 1 after an error that was reported."""
    if argv is None:
        gc.set_threshold(20_000)  # Python's 700 cost a process of two seconds a tenth of it
        warnings.formatwarning = partial(_warning, warnings.formatwarning)
    parser = _parser()
    arguments = parser.parse_args(argv)
    if not hasattr(arguments, "function"):
        parser.print_help()
        return 0
    try:
        code: int = arguments.function(arguments)
        sys.stdout.flush()
    except BrokenPipeError:  # who read the output has seen enough, as with `| head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141  # 128 + SIGPIPE, as other programs
    except TOLD as error:
        if arguments.debug:
            raise
        print(
            f"error: {_where(error, getattr(arguments, 'script', ''))}{error or type(error).__name__}", file=sys.stderr
        )
        return 1
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        return 130
    return code


def _warning(usual: Callable[..., str], message: Warning | str, category: type[Warning], file: str, *at: Any) -> str:
    """A doubt in one sentence, with the line of a script where that is what it came from."""
    if issubclass(category, MbdWarning) and (not file.endswith(".py") or not Path(file).is_file()):
        return f"warning: {message}\n"
    return usual(message, category, file, *at)


def _where(error: BaseException, script: str) -> str:
    """'line 12 of walker.py: KeyError: ' where an error of Python itself came from; '' for an error of mbd."""
    if isinstance(error, MbdError | OSError) or not script:
        return ""
    if isinstance(error, SyntaxError):
        return "SyntaxError: "
    name = find(script).name
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if Path(frame.filename).name == name]
    place = f"line {frames[-1].lineno} of {name}: " if frames else ""
    return f"{place}{type(error).__name__}: "


if __name__ == "__main__":
    sys.exit(main())
