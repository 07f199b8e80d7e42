"""Axes of a study of starts → columns: coordinates and rates on the section, parameters."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.bodies.values import shown
from mbd.dataclass import dataclass
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.gait.return_map import ReturnMap
from mbd.simulation.batch.starts import columns_of, places_of
from mbd.simulation.run.user_calls import call_user

Start = Callable[[Mapping[str, Vector]], Mapping[str, Any]]
"""From columns of the axes to columns of coordinates, rates and parameters."""
MAX_STARTS = 100_000_000
"""Starts of one study at most."""


@dataclass(frozen=True, eq=False)
class Grid:
    """names of each dimension, values of each name along it, sizes; the last varies fastest."""

    dimensions: tuple[tuple[str, ...], ...]
    values: Mapping[str, Vector]
    shape: tuple[int, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Of all axes."""
        return tuple(name for names in self.dimensions for name in names)

    def __len__(self) -> int:
        return int(np.prod(self.shape))

    def columns(self, runs: Any) -> dict[str, Vector]:
        """The values of the axes in the runs with these numbers."""
        places = np.unravel_index(runs, self.shape)
        return {
            name: self.values[name][place]
            for names, place in zip(self.dimensions, places, strict=True)
            for name in names
        }


def grid_of(axes: Any) -> Grid:
    """The grid of the argument `axes`.

    Raises
    ------
    ModelError
        for what is no mapping of names to lists of finite numbers.
    """
    if not isinstance(axes, Mapping) or not axes:
        raise ModelError(
            "axes must map names to lists of numbers, such as {'left hip.rate': [-1.2, -1.1]}, or names that change "
            f"together to tuples of numbers, not {shown(axes)}"
        )
    faults, dimensions, values, shape = list[str](), [], dict[str, Vector](), []
    for key, several in axes.items():
        names = key if isinstance(key, tuple) else (key,)
        try:
            table = np.asarray(several, dtype=float)
        except (TypeError, ValueError):
            faults.append(f"axes: {key!r} must be a list of numbers, not {shown(several)}")
            continue
        table = table[:, np.newaxis] if table.ndim == 1 and not isinstance(key, tuple) else table
        if not names or not all(isinstance(name, str) for name in names):
            faults.append(f"axes: {key!r} must be a name, or a tuple of names that change together")
        elif table.ndim != 2 or table.shape[1] != len(names) or not len(table):
            wanted = "at least one number" if len(names) == 1 else f"tuples of {len(names)} numbers, at least one"
            faults.append(f"axes: {key!r} must be a list of {wanted}, not {shown(several)[:80]}")
        elif not np.all(np.isfinite(table)):
            bad = int(np.flatnonzero(~np.isfinite(table).all(axis=1))[0])
            faults.append(f"axes: {key!r} has a value at place {bad} that is not finite")
        else:
            dimensions.append(tuple(names))
            shape.append(len(table))
            values |= {name: table[:, k] for k, name in enumerate(names)}
    counts = Counter(name for names in dimensions for name in names)
    faults += [f"axes: {name!r} is given twice" for name, count in counts.items() if count > 1]
    if not faults and np.prod([float(size) for size in shape]) > MAX_STARTS:
        faults.append(f"axes give more than {MAX_STARTS:g} starts; give fewer values, and study them part by part")
    if faults:
        raise ModelError(faults)
    return Grid(tuple(dimensions), values, tuple(shape))


@dataclass(frozen=True, eq=False)
class Study:
    """What the starts of a grid are made of.

    start : as the argument; None: names of axes are those of coordinates, rates and parameters
    places : of coordinates and rates in (q, v, z); parameters : names that are parameters or functions of them
    """

    grid: Grid
    start: Start | None
    places: Mapping[str, int]
    parameters: frozenset[str]

    def columns(self, runs: Any) -> tuple[dict[int, Vector], dict[str, Vector]]:
        """(place in (q, v, z) → column, parameter → column) of the runs with these numbers."""
        given = self.grid.columns(runs)
        if self.start is not None:
            made = call_user("the function start= of a basin", self.start, dict(given))
            given = _whole(made, len(runs))
        wrong = [nearest(n, [*self.places, *self.parameters], "coordinate, rate or parameter", "There are")
                 for n in given if n not in self.places and n not in self.parameters]  # fmt: skip
        if wrong:
            raise UnknownNameError([f"axes: {each}" if self.start is None else f"start=: {each}" for each in wrong])
        state = {self.places[name]: column for name, column in given.items() if name in self.places}
        return state, {name: column for name, column in given.items() if name not in self.places}


def _whole(made: Any, count: int) -> dict[str, Vector]:
    """What the user's function gave, as columns of `count` numbers."""
    columns, faults = columns_of(made, "what start= gives")
    faults += [
        f"what start= gives: {name!r} has {len(column)} numbers for {count} starts; it is called with arrays"
        for name, column in columns.items()
        if column.ndim and len(column) != count
    ]
    if faults:
        raise ModelError(faults)
    return {name: np.array(np.broadcast_to(column, count)) for name, column in columns.items()}


def study_of(map_: ReturnMap, grid: Grid, start: Any) -> Study:
    """The study, its names tried with the first start."""
    if start is not None and not callable(start):
        raise ModelError(
            "start must be a function from columns of the axes to columns of coordinates, rates and parameters, such "
            f"as lambda axes: {{'theta': axes['theta']}}, or None, not {shown(start)}"
        )
    known = {parameter.name for parameter in map_.mechanism.equations.parameters}
    known |= set(getattr(map_.model, "parameters", {})) | set(map_.functions)
    study = Study(grid, start, places_of(map_.mechanism), frozenset(known))
    study.columns(np.arange(min(len(grid), 1)))
    return study


def kinds_of_parameters(base: Mapping[str, float], columns: Mapping[str, Vector], count: int) -> tuple[
    list[dict[str, float]], Any
]:  # fmt: skip
    """The different sets of values (functions among them), and the number of that of each run."""
    if not columns:
        return [dict(base)], np.zeros(count, dtype=np.intp)
    table: Matrix = np.column_stack(list(columns.values()))
    kinds, which = np.unique(table, axis=0, return_inverse=True)
    names: Sequence[str] = list(columns)
    return [{**base, **dict(zip(names, map(float, row), strict=True))} for row in kinds], which.reshape(-1)
