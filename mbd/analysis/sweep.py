"""The same run again and again with other parameters, schemes or steps; what came of each as a table."""

from __future__ import annotations

import inspect
import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import field
from itertools import chain, product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.analysis.column_units import units_of
from mbd.analysis.sweep_runs import SETTINGS, Results, Row, Runs, cell, rows_of
from mbd.bodies.values import flag, shown
from mbd.compile.mechanism import Mechanism
from mbd.compile.mechanisms import mechanism_of
from mbd.dataclass import dataclass
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.integrators import Integrator
from mbd.notebook import table
from mbd.progress import share_bar
from mbd.results.identity import identity, identity_of_model
from mbd.results.names import scalars
from mbd.results.study_file import StudyFile
from mbd.results.titled import Titled
from mbd.simulation.simulate import simulate
from mbd.state import State

if TYPE_CHECKING:
    from xarray import Dataset

OUTCOME = ("success", "message")
"""Columns of every table."""


@dataclass(frozen=True)
class Sweep(Titled):
    """Runs over all combinations of some values.

    Attributes
    ----------
    names : what was varied; cases : its values in each run, in the order of `names`, the last varying fastest
    dimensions : names that change together, and how many values they take; the runs are all combinations of these
    results : by title, one value for each run; NaN where the run failed
    success, messages : of each run
    complete : False where Ctrl-C ended the sweep; runs that it never came to say so in their message
    units : of what was varied and of results, by title, where they are known
    """

    known_as = "sweep"

    names: tuple[str, ...]
    cases: tuple[tuple[Any, ...], ...]
    results: Mapping[str, tuple[float, ...]]
    success: tuple[bool, ...]
    messages: tuple[str, ...]
    complete: bool = True
    dimensions: tuple[tuple[tuple[str, ...], int], ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.cases)

    @property
    def columns(self) -> dict[str, list[Any]]:
        """What was varied, what came, and whether each run succeeded, by title."""
        varied = {name: [case[k] for case in self.cases] for k, name in enumerate(self.names)}
        return {**varied, **{title: list(found) for title, found in self.results.items()},
                "success": list(self.success), "message": list(self.messages)}  # fmt: skip

    def to_xarray(self) -> Dataset:
        """An xarray Dataset with a dimension for everything that was varied by itself.

        Names that changed together share the dimension 'a, b', along which each is a coordinate. What is no number,
        such as a scheme, is its text. `success` and `message` are variables beside the results. What has a unit has it
        as the attribute `units`.
        """
        from mbd.results.tables import library

        xarray = library("xarray", "data", "Sweep.to_xarray()")
        sizes = tuple(size for _, size in self.dimensions)
        axes = tuple(", ".join(names) for names, _ in self.dimensions)
        columns = {title: _plain(column).reshape(sizes) for title, column in self.columns.items()}
        coordinates: dict[str, Any] = {}
        for axis, (names, _) in enumerate(self.dimensions):
            first = tuple(slice(None) if k == axis else 0 for k in range(len(sizes)))
            coordinates |= {name: ((axes[axis],), columns[name][first], self._attributes(name)) for name in names}
        variables = {
            title: (axes, column, self._attributes(title))
            for title, column in columns.items()
            if title not in self.names
        }
        dataset: Dataset = xarray.Dataset(variables, coords=coordinates)
        return dataset

    def _attributes(self, title: str) -> dict[str, str]:
        """What xarray notes of a column."""
        return {"units": self.units[title]} if self.units.get(title) else {}

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


def _plain(column: Sequence[Any]) -> Any:
    """Numbers and flags as they are, all else as text."""
    array = np.array(column)
    return array if array.dtype.kind in "fiub" else np.array([str(value) for value in column])


def sweep(
    model: Any,
    values: Mapping[str | tuple[str, ...], Sequence[Any]],
    start: State | Callable[[Mapping[str, float]], State],
    results: Results = (),
    *,
    executor: Executor | None = None,
    file: str | Path | None = None,
    progress: bool = False,
    **settings: Any,
) -> Sweep:
    """Simulate a model for every combination of some values: of its parameters, of the scheme, of the step.

    Parameters change no code: the model is derived and compiled once.

    Parameters
    ----------
    model : a `Model` or `Lagrangian`
    values : what to vary, ``{"rod.mass": [1.0, 2.0], "dt": [1e-3, 5e-4], "integrator": [mbd.HHT(), mbd.RadauIIA()]}``:
        names of parameters and of the arguments integrator, dt, tol, until, contact, impact, locate, rest_speed. Names
        in a tuple change together: ``{("left leg.mass", "right leg.mass"): [(5.0, 5.0), (5.0, 4.2)]}``, as those of
        the designs `latin_hypercube` and `sobol` do
    start : a state; or a function of the parameters that differ, by name, that assembles one
    results : what to keep: names of quantities, whose value at the end of the run is kept, of a vector its components,
        of a discrete state its number; or functions by title, ``{"top": lambda run: run["hip.angle"].max()}``
    executor : any ``concurrent.futures.Executor``, for runs side by side: a ``ThreadPoolExecutor()`` (machine code runs
        without Python's lock), or a ``ProcessPoolExecutor()`` where model, start and functions can be pickled, whose
        processes derive a model once at most and take its machine code from the cache; with the extra dask also
        ``Client(…).get_executor()``; None: in turn
    file : to which every run is added as it ends, and from which runs are taken that it has already: a sweep
        that was ended or killed continues where it was. A file of another model, law, start, setting or function of
        the run is refused by what differs; functions count with all that they refer to
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
        for names that the model does not have, what cannot be sent to processes, and a file of another sweep, before
        the first run.
    """
    bar_wanted = flag(progress, "progress of a sweep")
    dimensions = _dimensions(values)
    names = tuple(name for together, _ in dimensions for name in together)
    titles = _checked(model, names, start, results, executor, settings)
    cases = tuple(tuple(chain(*parts)) for parts in product(*(rows for _, rows in dimensions)))
    runs = Runs(model, names, start, results if isinstance(results, Mapping) else titles, settings)
    known = None if file is None else SweepFile(file, runs, mechanism_of(model, settings.get("backend", "auto")))
    with share_bar() if bar_wanted else nullcontext() as bar:
        rows, complete = _made(runs, cases, executor, known, bar)
    columns = {title: tuple(row.results[k] for row in rows) for k, title in enumerate(titles)}
    success, messages = tuple(row.success for row in rows), tuple(row.message for row in rows)
    sizes = tuple((together, len(several)) for together, several in dimensions)
    known_titles = names if isinstance(results, Mapping) else (*names, *titles)  # of a function nobody knows the unit
    units = units_of(model, known_titles, settings.get("backend", "auto"))
    return Sweep(names, cases, columns, success, messages, complete, sizes, units)


def _made(
    runs: Runs, cases: Sequence[tuple[Any, ...]], executor: Executor | None, known: SweepFile | None, bar: Any
) -> tuple[list[Row], bool]:
    """The rows of all cases: those that the file has, and the others, which are added to it."""
    rows = [None if known is None else known.row(case) for case in cases]
    left = [place for place, row in enumerate(rows) if row is None]
    done = len(cases) - len(left)

    def report(place: int, row: Row) -> None:
        nonlocal done
        done += 1
        if known is not None and not row.stopped:
            known.keep(cases[left[place]], row)
        if bar is not None:
            bar(done, len(cases))

    made, complete = rows_of(runs, [cases[place] for place in left], executor, report)
    found = iter(made)
    return [next(found) if row is None else row for row in rows], complete


def _dimensions(values: Any) -> list[tuple[tuple[str, ...], list[tuple[Any, ...]]]]:
    """Names that change together, with their values in turn; every fault of the values at once."""
    if not isinstance(values, Mapping) or not values:
        got = "a State; they come before the start" if isinstance(values, State) else shown(values)
        raise ModelError(f"values of a sweep must map names to lists, such as {{'rod.mass': [1.0, 2.0]}}, not {got}")
    faults: list[str] = []
    found: list[tuple[tuple[str, ...], list[tuple[Any, ...]]]] = []
    for name, several in values.items():
        if isinstance(several, str) or not hasattr(several, "__len__") or not len(several):
            faults.append(f"values of {name!r} must be a list of at least one, not {shown(several)}")
        elif not isinstance(name, tuple):
            found.append(((name,), [(value,) for value in several]))
        elif not all(isinstance(each, list | tuple) and len(each) == len(name) for each in several):
            faults.append(f"values of {name!r}, which change together, must be tuples of {len(name)}")
        else:
            found.append((name, [tuple(each) for each in several]))
    names = [name for together, _ in found for name in together]
    faults += [f"{name!r} is given twice among the values" for name, count in Counter(names).items() if count > 1]
    if faults:
        raise ModelError(faults)
    return found


def _checked(
    model: Any, values: Sequence[str], start: Any, results: Any, executor: Any, settings: Mapping[str, Any]
) -> list[str]:
    """Titles of the results; every fault of the arguments at once."""
    faults = []
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
        scheme = "; give a scheme as integrator=…" if isinstance(results, Integrator) else ""
        faults.append(
            f"results must be a list of names of quantities, or functions by title, not {shown(results)}{scheme}"
        )
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
    return list(results) if isinstance(results, Mapping) else [*scalars(equations, results)]


class SweepFile:
    """The rows that a file holds, and the file, to which more are added.

    Raises
    ------
    ModelError
        for a file that is none of a sweep, and one of another sweep, by what differs.
    """

    def __init__(self, path: Any, runs: Runs, mechanism: Mechanism) -> None:
        self.file = StudyFile(path, "sweep", _head(runs, mechanism))
        self.rows = {
            line["case"]: Row(list(line["results"]), line["success"], line["message"]) for line in self.file.parts
        }

    def row(self, case: Sequence[Any]) -> Row | None:
        """What came of a case, if the file has it."""
        return self.rows.get(_key(case))

    def keep(self, case: Sequence[Any], row: Row) -> None:
        """Add a run that is over."""
        self.rows[_key(case)] = row
        self.file.add({"case": _key(case), "results": row.results, "success": row.success, "message": row.message})


def _key(case: Sequence[Any]) -> str:
    return json.dumps([_word(value) for value in case])


def _word(value: Any) -> Any:
    """A setting as it is read in the file: a number, or the text of it with the digest of what it is."""
    if isinstance(value, float | int | str) or value is None:
        return value if isinstance(value, float | int) else repr(value)
    return f"{type(value).__name__} {identity(value)}"


def _head(runs: Runs, mechanism: Mechanism) -> dict[str, Any]:
    """What makes a sweep another one."""
    settings = {name: _word(value) for name, value in runs.settings.items() if name != "parameters"}
    given = {**getattr(runs.model, "parameters", {}), **(runs.settings.get("parameters") or {})}
    functions = runs.results.values() if isinstance(runs.results, Mapping) else ()
    of_model = identity_of_model(runs.model, mechanism)
    return {
        "name": str(getattr(runs.model, "name", "")), "names": list(runs.names), "results": list(runs.results),
        "settings": settings, "parameters": {k: float(v) for k, v in given.items()}, "start": identity(runs.start),
        "functions of the run": identity(*functions), **of_model,
    }  # fmt: skip
