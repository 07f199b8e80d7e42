"""Scripts that the command line executes: files of a user, and the packaged examples by name."""

from __future__ import annotations

import ast
import difflib
import inspect
import runpy
import sys
import threading
from collections.abc import Iterator, Mapping
from dataclasses import field
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from mbd.dataclass import dataclass
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.progress import Progress
from mbd.results.storage import SUFFIX

if TYPE_CHECKING:
    from mbd.results.trajectory import Trajectory

DESCRIBES = {"model", "start", "until"}
"""Names of a script that ``mbd run`` simulates itself, with any settings."""

REPEATED = (ast.For, ast.While, ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)
LATER = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda, ast.ClassDef)

BY_PLACE = ("model", "start", "integrator", "dt", "tol")
"""Arguments of `simulate` that may be given by place."""

OPTIONS = ("dt", "tol", "contact", "impact", "locate", "parameters", "store", "observers", "rest_speed", "backend")
"""Names that a script may define to pass them on to `simulate`."""

SETTINGS = ("model", "start", "integrator", "until", *OPTIONS)
"""All names of a script that mean something to ``mbd run``."""


def folder() -> Path:
    """Where the examples are: inside an installed package, or beside it in a source checkout."""
    package = Path(__file__).resolve().parent
    inside = package / "examples"
    return inside if inside.is_dir() else package.parent / "examples"


def examples() -> dict[str, Path]:
    """The packaged examples by name: 'kneed-walker' for kneed_walker.py."""
    files = sorted(folder().glob("*.py")) if folder().is_dir() else []
    return {file.stem.replace("_", "-"): file for file in files if not file.stem.startswith("_")}


def find(name: str) -> Path:
    """The file of a script, given as a path, or of an example, given by name."""
    path = Path(name)
    if path.is_file():
        return path
    if path.suffix == ".py" or len(path.parts) > 1:
        raise FileNotFoundError(f"no script at '{name}'")
    known = examples()
    wanted = name.replace("_", "-")
    if wanted not in known:
        raise UnknownNameError(nearest(name, known, "example", "There are") + "; or give a file")
    return known[wanted]


@dataclass(frozen=True)
class Script:
    """A script that has been executed: its `main`, the names of a run, or a run that it has made by itself."""

    path: Path
    names: dict[str, Any] = field(repr=False)
    is_changed: bool = False

    @classmethod
    def load(cls, name: str, changes: Mapping[str, Any] | None = None) -> Script:
        """Execute a script or example, but not what it keeps under ``if __name__ == "__main__"``.

        Changes of settings are put into a script that simulates by itself, or refused, before it runs, see
        `script_changes`; `is_changed` tells that they have been.
        """
        path = find(name)
        tree = _changed(path.read_text(encoding="utf-8"), path.name, changes) if changes else None
        sys.path.insert(0, str(path.resolve().parent))
        try:
            if tree is None:
                return cls(path, runpy.run_path(str(path), run_name="mbd_script"))
            return cls(path, _executed(tree, path), is_changed=True)
        finally:
            sys.path.pop(0)

    def require(self, *wanted: str) -> None:
        """All of these names, or an error that lists the missing ones."""
        missing = [name for name in wanted if name not in self.names]
        if missing:
            has = "model, start, dt or tol, and until, or a run of mbd.simulate, or a function main() that returns one"
            meant = "".join(f"; did you mean {name!r} by {wrong!r}?" for wrong, name in self.misspelt().items())
            raise ModelError(f"{self.path.name} does not define {', '.join(missing)}{meant}; a script defines {has}")

    def misspelt(self) -> dict[str, str]:
        """Names that look like settings the script does not define: 'untill' for 'until'."""
        free = [name for name in SETTINGS if name not in self.names]
        close = {name: difflib.get_close_matches(name, free, n=1, cutoff=0.8) for name in self.names}
        return {name: found[0] for name, found in close.items() if found and not callable(self.names[name])}

    def run(self, progress: Progress | None, changes: Mapping[str, Any]) -> Trajectory:
        """The run of the script: what its `main` returns, what it has simulated by itself, or what it describes.

        Parameters
        ----------
        progress : called with the simulated time and the end time [s]
        changes : values that replace the script's own: dt or tol, until, parameters by name
        """
        if "main" in self.names:
            return self._run_of_main(progress, changes)
        made = self._made()
        described = {"model", "start", "until"} <= set(self.names)
        if made is not None and not (changes and described):
            self._refuse({} if self.is_changed else changes, "simulates by itself")
            return made
        return self._simulated(progress, changes)

    def _simulated(self, progress: Progress | None, changes: Mapping[str, Any]) -> Trajectory:
        """The run of model, start and settings, with the changes."""
        names = self.names
        steps = ("tol",) if "tol" in names and "dt" not in names else ("dt",)
        given = {"dt", "tol"} | set(changes) if {"dt", "tol"} & set(changes) else set(changes)
        self.require("model", "start", *(name for name in (*steps, "until") if name not in given))
        options = {name: names[name] for name in (*OPTIONS, "until") if name in names} | dict(changes)
        if "parameters" in changes:
            options["parameters"] = {**(names.get("parameters") or {}), **changes["parameters"]}
        for one, other in (("dt", "tol"), ("tol", "dt")):
            if one in changes and other not in changes:
                options.pop(other, None)
        if "integrator" in names:
            options["integrator"] = names["integrator"]
        from mbd import simulate

        found: Trajectory = simulate(names["model"], names["start"], progress=progress, **options)
        return found

    def _made(self) -> Trajectory | None:
        """The run that the script has made: that named `run`, else the last one."""
        if "mbd.results.trajectory" not in sys.modules:
            return None
        from mbd.results.trajectory import Trajectory

        made = [value for value in self.names.values() if isinstance(value, Trajectory)]
        own = self.names.get("run")
        return own if isinstance(own, Trajectory) else made[-1] if made else None

    def _refuse(self, changes: Mapping[str, Any], why: str) -> None:
        if changes:
            raise ModelError(f"{self.path.name} {why}, so {', '.join(changes)} must be changed in the script")

    def _run_of_main(self, progress: Progress | None, changes: Mapping[str, Any]) -> Trajectory:
        from mbd.results.trajectory import Trajectory

        function = self.names["main"]
        takes = inspect.signature(function).parameters
        self._refuse({name: value for name, value in changes.items() if name not in takes}, "runs its own main()")
        run = function(**changes, **({"progress": progress} if "progress" in takes else {}))
        if not isinstance(run, Trajectory):
            raise ModelError(
                f"main() of {self.path.name} must return the run of mbd.simulate, got {type(run).__name__}"
            )
        return run


def _executed(tree: ast.Module, path: Path) -> dict[str, Any]:
    """What a changed script defines, executed as `runpy.run_path` does."""
    name = "mbd_script"
    module, before = ModuleType(name), sys.modules.get(name)
    module.__file__ = str(path)
    sys.modules[name] = module
    try:
        exec(compile(tree, str(path), "exec"), module.__dict__)
    finally:
        del sys.modules[name]
        if before is not None:
            sys.modules[name] = before
    return dict(vars(module))


def name_of_script(name: str) -> str:
    """What results of a script or example are called: 'my-leg' of my_leg.py."""
    return find(name).stem.replace("_", "-")


def name_of_run(path: Path) -> str:
    """What results of a stored run are called: its file's name, or that of its folder where all are called run."""
    name = path.name.removesuffix(SUFFIX)
    return path.absolute().parent.name if name == "run" else name


def import_plotting() -> None:
    """Begin to import matplotlib beside the simulation, so that the plots after it do not wait for it."""
    if find_spec("matplotlib") is not None:
        threading.Thread(target=import_module, args=("matplotlib.figure",), daemon=True).start()


def is_recording(name: str) -> bool:
    """Whether a name is that of a laboratory's file."""
    return name.lower().endswith((".c3d", ".trc", ".mot", ".sto"))


def is_run_file(name: str) -> bool:
    """Whether a name is that of a stored run."""
    return name.endswith(SUFFIX)


# Settings of the command line put into a script that simulates by itself, before it runs.
#
# Only the text is looked at: a script with one call of `simulate` that runs once gets the settings in that call; one of
# which the text already tells that they cannot be applied is refused before anything is computed.


def _changed(text: str, name: str, changes: Mapping[str, Any]) -> ast.Module | None:
    """The script with the changes in its call of `simulate`; None where they are for ``mbd run`` to apply.

    Parameters
    ----------
    text, name : the script, and its name in errors
    changes : dt or tol, until, parameters by name

    Raises
    ------
    ModelError
        where the text tells that the changes cannot be applied: a `main` without such an argument, several calls.
    """
    tree = ast.parse(text, name)
    asked = ", ".join(changes)
    main = next((each for each in tree.body if isinstance(each, ast.FunctionDef) and each.name == "main"), None)
    if main is not None:
        takes = {each.arg for each in (*main.args.posonlyargs, *main.args.args, *main.args.kwonlyargs)}
        missing = [change for change in changes if change not in takes]
        if missing and main.args.kwarg is None:
            listed = ", ".join(missing)
            raise ModelError(
                f"{name} runs its own main(), so {listed} must be changed in the script; nothing was run; "
                f"or give main the argument{'s' * (len(missing) > 1)} {listed}"
            )
        return None
    defined = {each.id for each in ast.walk(tree) if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store)}
    calls = list(_calls(tree, False))
    if not calls or defined >= DESCRIBES:
        return None
    call, repeated = calls[0]
    if len(calls) > 1 or repeated:
        several = "in a loop" if repeated else f"{len(calls)} times"
        raise ModelError(
            f"{name} simulates by itself, {several}, so {asked} must be changed in the script; nothing was run"
        )
    _put(call, changes)
    return ast.fix_missing_locations(tree)


def _calls(node: ast.AST, repeated: bool) -> Iterator[tuple[ast.Call, bool]]:
    """Calls of `simulate` that run as the script does, and whether they run again and again."""
    if isinstance(node, LATER) or (isinstance(node, ast.If) and "__main__" in ast.unparse(node.test)):
        return
    if isinstance(node, ast.Call) and "simulate" in (getattr(node.func, "attr", ""), getattr(node.func, "id", "")):
        yield node, repeated
    for part in ast.iter_child_nodes(node):
        yield from _calls(part, repeated or isinstance(node, REPEATED))


def _put(call: ast.Call, changes: Mapping[str, Any]) -> None:
    """Give a call other arguments; dt and tol replace each other, parameters are added to those that it has."""
    for place, value in list(enumerate(call.args))[3:]:
        call.keywords.append(ast.keyword(BY_PLACE[place], value))
    del call.args[3:]
    given = {each.arg: each for each in call.keywords}
    for change, value in changes.items():
        new = ast.parse(repr(value), mode="eval").body
        if change == "parameters" and "parameters" in given:
            own = ast.BoolOp(ast.Or(), [given["parameters"].value, ast.Dict([], [])])
            new = ast.Dict([None, None], [own, new])
        given[change] = ast.keyword(change, new)
    for one, other in (("dt", "tol"), ("tol", "dt")):
        if one in changes and other not in changes:
            given.pop(other, None)
    call.keywords = list(given.values())
