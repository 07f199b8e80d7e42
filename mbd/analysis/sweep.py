"""The same run again and again with other parameters, schemes or steps; what came of each as a table."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from mbd.analysis.sweep_runs import SETTINGS, Results, Runs, cell, rows_of
from mbd.bodies.values import flag, shown
from mbd.compile.mechanisms import mechanism_of
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.notebook import table
from mbd.progress import share_bar
from mbd.results.archive import named_file, write_whole
from mbd.simulation.simulate import simulate
from mbd.state import State

__all__ = ["Sweep", "sweep"]

OUTCOME = ("success", "message")
"""Columns of every table."""


@dataclass(frozen=True)
class Sweep:
    """Runs over all combinations of some values.

    Attributes
    ----------
    names : what was varied; cases : its values in each run, in the order of `names`, the last varying fastest
    results : by title, one value for each run; NaN where the run failed
    success, messages : of each run
    complete : False where Ctrl-C ended the sweep; runs that it never came to say so in their message
    """

    names: tuple[str, ...]
    cases: tuple[tuple[Any, ...], ...]
    results: Mapping[str, tuple[float, ...]]
    success: tuple[bool, ...]
    messages: tuple[str, ...]
    complete: bool = True

    def __len__(self) -> int:
        return len(self.cases)

    @property
    def columns(self) -> dict[str, list[Any]]:
        """What was varied, what came, and whether each run succeeded, by title."""
        varied = {name: [case[k] for case in self.cases] for k, name in enumerate(self.names)}
        return {**varied, **{title: list(found) for title, found in self.results.items()},
                "success": list(self.success), "message": list(self.messages)}  # fmt: skip

    def __getitem__(self, title: str) -> Any:
        """A column as an array."""
        columns = self.columns
        if title not in columns:
            raise UnknownNameError(nearest(title, columns, "column", "The sweep has"))
        return np.array(columns[title])

    def to_dataframe(self) -> Any:
        """A pandas table with a line for each run."""
        from mbd.results.tables import library

        return library("pandas", "data", "Sweep.to_dataframe()").DataFrame(self.columns)

    def to_csv(self, path: str | Path) -> Path:
        """Write the table with a line for each run."""
        import csv

        path = named_file(path)

        def fill(partial: Path) -> None:
            with partial.open("w", newline="", encoding="utf-8") as file:
                writer = csv.writer(file)
                writer.writerow(self.columns)
                writer.writerows(zip(*self.columns.values(), strict=True))

        write_whole(path, fill)
        return path

    def __repr__(self) -> str:
        return "\n".join(self._lines())

    def _repr_html_(self) -> str:
        shown = {title: column for title, column in self.columns.items() if title not in OUTCOME}
        rows = [
            [str(k + 1), *map(cell, values), "" if self.success[k] else f"failed: {self.messages[k]}"]
            for k, values in enumerate(zip(*shown.values(), strict=True))
        ]
        return table(f"{len(self)} runs", ("run", *shown, "outcome"), rows)

    def _lines(self) -> Iterator[str]:
        """A line for each run; messages of those that failed."""
        columns = {title: column for title, column in self.columns.items() if title not in OUTCOME}
        texts = {title: [cell(value) for value in column] for title, column in columns.items()}
        widths = {title: max(map(len, (title, *column))) for title, column in texts.items()}
        yield "  ".join(f"{title:>{widths[title]}}" for title in texts)
        for k in range(len(self)):
            line = "  ".join(f"{column[k]:>{widths[title]}}" for title, column in texts.items())
            yield line if self.success[k] else f"{line}  failed: {self.messages[k]}"


def sweep(
    model: Any,
    values: Mapping[str, Sequence[Any]],
    start: State | Callable[[Mapping[str, float]], State],
    results: Results = (),
    *,
    executor: Executor | None = None,
    progress: bool = False,
    **settings: Any,
) -> Sweep:
    """Simulate a model for every combination of some values: of its parameters, of the scheme, of the step.

    Parameters change no code: the model is derived and compiled once.

    Parameters
    ----------
    model : a `Model` or `Lagrangian`
    values : what to vary, ``{"rod.mass": [1.0, 2.0], "dt": [1e-3, 5e-4], "integrator": [mbd.HHT(), mbd.RadauIIA()]}``:
        names of parameters and of the arguments integrator, dt, tol, until, contact, impact, locate, rest_speed
    start : a state; or a function of the parameters that differ, by name, that assembles one
    results : what to keep: names of quantities, whose value at the end of the run is kept, or functions by title,
        ``{"top": lambda run: run["hip.angle"].max()}``
    executor : any ``concurrent.futures.Executor``, for runs side by side: a ``ThreadPoolExecutor()`` (machine code runs
        without Python's lock), or a ``ProcessPoolExecutor()`` where model, start and functions can be pickled, whose
        processes derive a model once at most and take its machine code from the cache; None: in turn
    progress : True for a bar on a terminal
    settings : further arguments of `simulate`, the same in all runs

    Returns
    -------
    Sweep
        A run that fails is a line of the table with its message, and so is one of which a function finds no result, or
        whose process died. Ctrl-C ends the sweep and keeps the lines of runs that were over, see ``complete``.

    Raises
    ------
    ModelError, UnknownNameError
        for names that the model does not have, and what cannot be sent to processes, before the first run.
    """
    bar_wanted = flag(progress, "progress of a sweep")
    titles = _checked(model, values, start, results, executor, settings)
    cases = tuple(product(*values.values()))
    runs = Runs(model, tuple(values), start, results, settings)
    with share_bar() if bar_wanted else nullcontext() as bar:
        rows, complete = rows_of(runs, cases, executor, bar)
    columns = {title: tuple(row.results[k] for row in rows) for k, title in enumerate(titles)}
    success, messages = tuple(row.success for row in rows), tuple(row.message for row in rows)
    return Sweep(tuple(values), cases, columns, success, messages, complete)


def _checked(model: Any, values: Any, start: Any, results: Any, executor: Any, settings: Any) -> list[str]:
    """Titles of the results; every fault of the arguments at once."""
    faults = []
    if not isinstance(values, Mapping) or not values:
        faults.append(f"values of a sweep must map names to lists, such as {{'rod.mass': [1.0, 2.0]}}, not {values!r}")
        values = {}
    faults += [
        f"values of {name!r} must be a list of at least one, not {several!r}"
        for name, several in values.items()
        if isinstance(several, str) or not hasattr(several, "__len__") or not len(several)
    ]
    faults += [
        f"{name!r} is given among the values and as an argument; give it once" for name in values if name in settings
    ]
    changed = settings.get("parameters")
    faults += [
        f"{name!r} is given among the values and in parameters=; give it once"
        for name in values
        if isinstance(changed, Mapping) and name in changed
    ]
    if not isinstance(start, State) and not callable(start):
        faults.append(f"start must be a State from mbd.assemble, or a function of the parameters, not {start!r}")
    if executor is not None and not hasattr(executor, "submit"):
        faults.append(f"executor must be one of concurrent.futures, such as ThreadPoolExecutor(), not {executor!r}")
    names = isinstance(results, Mapping | Sequence) and not isinstance(results, str | bytes)
    if not names or not all(isinstance(name, str) for name in results):
        faults.append(f"results must be a list of names of quantities, or functions by title, not {shown(results)}")
        results = ()
    if isinstance(results, Mapping) and not all(map(callable, results.values())):
        faults.append(f"results by title must be functions, such as lambda run: run.time[-1], not {shown(results)}")
    titles = [*values, *results, *OUTCOME]
    faults += [
        f"{title!r} would be the title of two columns; choose another name for what is kept"
        for title in dict.fromkeys(results)
        if titles.count(title) > 1
    ]
    takes = inspect.signature(simulate).parameters
    faults += [
        nearest(name, [*takes][2:], "argument of simulate", "There are") for name in settings if name not in takes
    ]
    if "on_failure" in settings:
        faults.append("a sweep keeps runs that fail as lines of its table; leave out on_failure=")
    if faults:
        raise ModelError(faults)
    equations = mechanism_of(model, settings.get("backend", "auto")).equations
    known = {parameter.name for parameter in equations.parameters} | set(getattr(model, "parameters", {}))
    wrong = [nearest(n, [*known, *SETTINGS], "parameter", "There are") for n in values if n not in {*known, *SETTINGS}]
    if wrong:
        raise UnknownNameError(wrong)
    if not isinstance(results, Mapping):
        for name in results:
            equations.output(name)
    return list(results)
