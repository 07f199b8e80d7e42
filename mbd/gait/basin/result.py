"""Which starts walk: the table and picture of a study."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Vector
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.gait.basin.axes import Grid
from mbd.gait.basin.balls import Ball
from mbd.gait.basin.kinds import KINDS
from mbd.gait.basin.made import Made
from mbd.gait.basin.walks import Decided
from mbd.later import later
from mbd.notebook import table
from mbd.results.titled import Titled
from mbd.state import State

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from xarray import Dataset


@dataclass(frozen=True, eq=False)
class Basin(Titled):
    """What became of every start of a grid.

    Attributes
    ----------
    name : of the model; axes : {name: values (n,)}, in the order of the dimensions, the last varying fastest
    attractors : names of the gaits
    kind : kinds by number, in the shape of the grid; `outcome` has their words
    attractor : which of the attractors a walk comes to, −1 where it comes to none
    steps : returns that were made before it was decided; time : that they took [s]
    balls : the verified ball round each attractor, with the radius and what verified it; None for parameters at which
        there is no stable gait
    step_limit : returns after which a start counts as not decided
    complete : False where Ctrl-C ended the study; starts that it never came to are 'not decided' after 0 steps
    """

    known_as = "basin"

    name: str
    grid: Grid
    attractors: tuple[str, ...]
    decided: Decided
    balls: Sequence[Sequence[Ball | None]]
    step_limit: int
    complete: bool
    units: Mapping[str, str]
    made: Made = field(repr=False)

    # what users ask -----------------------------------------------------------------------------------------------
    def __len__(self) -> int:
        return len(self.grid)

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the grid."""
        return self.grid.shape

    @property
    def axes(self) -> dict[str, Vector]:
        """Values by name."""
        return {name: self.grid.values[name] for name in self.grid.names}

    @property
    def kind(self) -> NDArray[np.int64]:
        """Kinds by number, places in `mbd.gait.basin.kinds.KINDS`."""
        return self.decided.kind.reshape(self.shape)

    @property
    def outcome(self) -> NDArray[Any]:
        """'walks', 'falls forward', 'falls backward', 'scuffs', … in the shape of the grid."""
        return np.array(KINDS)[self.kind]

    @property
    def attractor(self) -> NDArray[np.int64]:
        """Number of the attractor that each walk comes to, −1: none."""
        return self.decided.attractor.reshape(self.shape)

    @property
    def steps(self) -> NDArray[np.int64]:
        """Returns made before each was decided."""
        return self.decided.steps.reshape(self.shape)

    @property
    def time(self) -> Vector:
        """Of the walk until it was decided [s]."""
        return self.decided.time.reshape(self.shape)

    @property
    def counts(self) -> dict[str, int]:
        """Starts by outcome, walks by the attractor that they come to, most first."""
        found = Counter(self._words().tolist())
        return dict(found.most_common())

    @property
    def share(self) -> float:
        """Part of the starts that walk [-]."""
        return float(np.mean(self.decided.kind == 0))

    def start(self, index: int | Sequence[int]) -> State:
        """The start at a place of the grid: ``basin.start((3, 5))``, or the 17th of all, ``basin.start(17)``.

        Raises
        ------
        ModelError
            for a place outside, and for a start that is not on the section.
        """
        number = self._number(index)
        return self.made.start(number)

    def _number(self, index: Any) -> int:
        try:
            flat = int(np.ravel_multi_index(tuple(index), self.shape)) if np.ndim(index) else int(index)
        except (ValueError, TypeError):
            flat = -1
        if not 0 <= flat < len(self) or isinstance(index, bool):
            raise ModelError(f"the grid has places (0, …) to {tuple(n - 1 for n in self.shape)}, not {index!r}")
        return flat

    def _words(self) -> NDArray[Any]:
        """Outcomes with names of attractors where there are several."""
        words = np.array(KINDS, dtype=object)[self.decided.kind]
        if len(self.attractors) > 1:
            walks = self.decided.kind == 0
            names = np.array([f"walks: {name}" for name in self.attractors], dtype=object)
            words[walks] = names[self.decided.attractor[walks]]
        return words

    @property
    def columns(self) -> dict[str, Any]:
        """A line for each start, by title."""
        values = self.grid.columns(np.arange(len(self)))
        decided = self.decided
        return {**values, "outcome": self._words(), "attractor": decided.attractor, "steps": decided.steps,
                "time": decided.time}  # fmt: skip

    def to_xarray(self) -> Dataset:
        """An xarray Dataset over the axes: outcome, attractor, steps, time [s]; axes have their units."""
        from mbd.results.tables import library

        xarray = library("xarray", "data", "Basin.to_xarray()")
        axes = tuple(", ".join(names) for names in self.grid.dimensions)
        coordinates = {
            name: ((axis,), self.grid.values[name], {"units": self.units.get(name, "")})
            for axis, names in zip(axes, self.grid.dimensions, strict=True)
            for name in names
        }
        variables = {
            "outcome": (axes, self._words().astype(str).reshape(self.shape)),
            "attractor": (axes, self.attractor), "steps": (axes, self.steps, {"units": "1"}),
            "time": (axes, self.time, {"units": "s"}),
        }  # fmt: skip
        dataset: Dataset = xarray.Dataset(variables, coords=coordinates, attrs={"model": self.name})
        return dataset

    def plot(self, path: str | Path | None = None) -> Figure:
        """The plane of the axes (two), or the line (one), colored by outcome; the figure.

        Raises
        ------
        ModelError
            for a grid of more dimensions.
        """
        if len(self.shape) > 2:
            raise ModelError(
                f"a picture shows one or two axes, this grid has {len(self.shape)}; make a study of two of them"
            )
        figure: Figure = later("Basin.plot")(self, path)
        return figure

    def __repr__(self) -> str:
        parts = ", ".join(f"{count} × {what}" for what, count in self.counts.items())
        sizes = " × ".join(map(str, self.shape))
        ended = "" if self.complete else " (interrupted)"
        return f"{self.name}: {sizes} starts over {', '.join(self.grid.names)}{ended}: {parts}"

    def _repr_html_(self) -> str:
        total = len(self)
        rows = [(what, count, f"{100.0 * count / total:.2f} %") for what, count in self.counts.items()]
        return table(f"{self.name}: {total} starts", ("outcome", "starts", "share"), rows)
