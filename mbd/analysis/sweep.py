"""The same run again and again with other parameters, schemes or steps; what came of each as a table."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future, as_completed
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from mbd.compile.mechanisms import mechanism_of
from mbd.errors import MbdError, ModelError, SimulationError, UnknownNameError, nearest
from mbd.progress import share_bar
from mbd.results.archive import named_file, write_whole
from mbd.simulation.simulate import simulate
from mbd.simulation.user_calls import asked
from mbd.state import State
from mbd.trajectory import Trajectory

__all__ = ["Sweep", "sweep"]

SETTINGS = ("integrator", "dt", "tol", "until", "contact", "impact", "locate", "rest_speed")
"""Arguments of `simulate` that may take several values, beside the model's parameters."""

OUTCOME = ("success", "message")
"""Columns of every table."""

Results: TypeAlias = Sequence[str] | Mapping[str, Callable[[Trajectory], float]]
"""What is kept of each run: names of quantities, at its end, or functions of the run by title."""


@dataclass(frozen=True)
class Sweep:
    """Runs over all combinations of some values.

    Attributes
    ----------
    names : what was varied; cases : its values in each run, in the order of `names`, the last varying fastest
    results : by title, one value for each run; NaN where the run failed
    success, messages : of each run
    """

    names: tuple[str, ...]
    cases: tuple[tuple[Any, ...], ...]
    results: Mapping[str, tuple[float, ...]]
    success: tuple[bool, ...]
    messages: tuple[str, ...]

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

    def _lines(self) -> Iterator[str]:
        """A line for each run; messages of those that failed."""
        columns = {title: column for title, column in self.columns.items() if title not in OUTCOME}
        texts = {title: [_cell(value) for value in column] for title, column in columns.items()}
        widths = {title: max(map(len, (title, *column))) for title, column in texts.items()}
        yield "  ".join(f"{title:>{widths[title]}}" for title in texts)
        for k in range(len(self)):
            line = "  ".join(f"{column[k]:>{widths[title]}}" for title, column in texts.items())
            yield line if self.success[k] else f"{line}  failed: {self.messages[k]}"


def _cell(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


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
    executor : runs side by side, such as a ``concurrent.futures.ThreadPoolExecutor()`` (machine code runs without
        Python's lock), or a ``ProcessPoolExecutor()`` where model, start and functions can be pickled; None: in turn
    progress : True for a bar on a terminal
    settings : further arguments of `simulate`, the same in all runs

    Returns
    -------
    Sweep
        A run that fails is a line of the table with its message, and so is one of which a function finds no result.

    Raises
    ------
    ModelError, UnknownNameError
        for names that the model does not have, before the first run.
    """
    titles = _checked(model, values, start, results, executor, settings)
    cases = tuple(product(*values.values()))
    one = partial(_one, model, tuple(values), start, results, settings)
    with share_bar() if progress else nullcontext() as bar:
        found = _all(one, cases, executor, bar)
    columns = {title: tuple(row[0][k] for row in found) for k, title in enumerate(titles)}
    return Sweep(tuple(values), cases, columns, tuple(row[1] for row in found), tuple(row[2] for row in found))


def _all(one: Callable[[tuple[Any, ...]], Any], cases: Sequence[tuple[Any, ...]], executor: Any, bar: Any) -> list[Any]:
    """What came of every case, in their order."""
    found: list[Any] = []
    if executor is None:
        for case in cases:
            found.append(one(case))
            if bar is not None:
                bar(len(found), len(cases))
        return found
    futures: list[Future[Any]] = [executor.submit(one, case) for case in cases]
    try:
        for done, _ in enumerate(as_completed(futures), start=1):
            if bar is not None:
                bar(done, len(cases))
        return [future.result() for future in futures]
    finally:
        for future in futures:
            future.cancel()


def _one(
    model: Any, names: tuple[str, ...], start: Any, results: Results, settings: Mapping[str, Any], case: tuple[Any, ...]
) -> tuple[list[float], bool, str]:
    """(results, success, message) of one run."""
    given = dict(zip(names, case, strict=True))
    own = {name: value for name, value in given.items() if name in SETTINGS}
    parameters = {**(settings.get("parameters") or {}), **{n: v for n, v in given.items() if n not in SETTINGS}}
    count = len(results)
    try:
        begin = asked(_calling(start, given), start, parameters) if callable(start) else start
        run = simulate(model, begin, **{**settings, **own, "parameters": parameters, "on_failure": "return"})
    except MbdError as error:
        return [float("nan")] * count, False, str(error)
    if not run.success:
        return [float("nan")] * count, False, run.message
    if not isinstance(results, Mapping):
        return [float(run[name][-1]) for name in results], True, run.message
    found, missing = [], []
    for title, function in results.items():
        try:
            found.append(asked(f"the function for {title!r}", _number, function, run))
        except SimulationError as error:  # the event that it looks for did not come, say: other runs still count
            found.append(float("nan"))
            missing.append(str(error))
    return found, not missing, "; ".join(missing) or run.message


def _calling(start: Any, given: Mapping[str, Any]) -> str:
    """Which function makes the start, and with which values of the sweep."""
    values = ", ".join(f"{name} = {_cell(value)}" for name, value in given.items())
    return f"start={getattr(start, '__qualname__', None) or repr(start)} at {values}"


def _number(function: Callable[[Trajectory], float], run: Trajectory) -> float:
    return float(function(run))


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
    if isinstance(results, str) or not isinstance(results, Mapping | Sequence):
        faults.append(f"results must be a list of quantities or functions by title, not {results!r}")
        results = ()
    titles = [*values, *results, *OUTCOME]
    faults += [
        f"{title!r} would be the title of two columns; choose another name for what is kept"
        for title in dict.fromkeys(results)
        if titles.count(title) > 1
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
