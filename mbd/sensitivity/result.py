"""Derivatives of a run as a table: what was asked for, line by line, by what it was differentiated by."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.bodies.values import named_number_faults
from mbd.dataclass import dataclass
from mbd.errors import ModelError, TrajectoryError, UnknownNameError, nearest
from mbd.notebook import table
from mbd.results.trajectory import Trajectory

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass(frozen=True, eq=False)
class Sensitivities:
    """Total first derivatives of results of a run.

    ``found["foot.time", "hip.mass"]`` is one of them, ``found["foot.time"]`` a line (D,).

    Attributes
    ----------
    of, wrt : names of the lines and columns; of_units, wrt_units : '' where nothing tells
    matrix : (len(of), len(wrt)) derivatives
    values : (len(of),) what is differentiated
    run : the run, of whose numbers these are the derivatives
    written : parameters that controllers wrote, whose values are held as they were
    event_changes : which changes of `check_events` make another sequence of events, and the first that is another
    """

    of: tuple[str, ...]
    wrt: tuple[str, ...]
    matrix: Matrix
    values: Vector
    run: Trajectory = field(repr=False)
    of_units: tuple[str, ...] = ()
    wrt_units: tuple[str, ...] = ()
    event_changes: tuple[str, ...] = ()
    written: tuple[str, ...] = ()

    @classmethod
    def read(cls, words: Mapping[str, Any], run: Trajectory) -> Sensitivities:
        """What `words_of` gave, of this run; a `TrajectoryError` for anything else."""
        try:
            of, wrt, *units = (tuple(map(str, words[name])) for name in ("of", "wrt", "of_units", "wrt_units"))
            matrix = np.array(words["matrix"], dtype=float).reshape(len(of), len(wrt))
            values = np.array(words["values"], dtype=float).reshape(len(of))
        except (KeyError, TypeError, ValueError) as error:
            raise TrajectoryError(f"the derivatives of this run are not as they were written: {error}") from error
        return cls(of, wrt, matrix, values, run, units[0], units[1], written=tuple(map(str, words.get("written", ()))))

    def __getitem__(self, names: str | tuple[str, str]) -> Any:
        """A derivative by the names of its line and column, or a line by its name alone.

        Several where a name has parts: ``found["hip.angular_velocity", "hip.orientation"]`` is a matrix (3, 3).
        """
        both = (names, None) if isinstance(names, str) else names
        line, column = both if isinstance(both, tuple) and len(both) == 2 else (both, None)
        rows, columns = _place(line, self.of, "line"), slice(None) if column is None else _turn(column, self.wrt)
        found = self.matrix[rows][..., columns]
        return float(found) if np.ndim(found) == 0 else found

    def __len__(self) -> int:
        return len(self.of)

    def __iter__(self) -> Iterator[str]:
        return iter(self.of)

    def along(self, change: dict[str, float]) -> dict[str, float]:
        """First change of each line as several quantities change together, {name: change} [their units]."""
        if faults := named_number_faults(change, "change"):
            raise ModelError(faults)
        by = np.zeros(len(self.wrt))
        for name, amount in (change or {}).items():
            by[_place(name, self.wrt, "column")] = amount
        return {name: float(value) for name, value in zip(self.of, self.matrix @ by, strict=True)}

    def to_dataframe(self) -> DataFrame:
        """A pandas table with a line for each result and a column for each quantity that it is differentiated by."""
        from mbd.results.tables import library

        return library("pandas", "data", "Sensitivities.to_dataframe()").DataFrame(
            self.matrix, index=list(self.of), columns=list(self.wrt)
        )

    def __repr__(self) -> str:
        texts = [[f"{value:.6g}" for value in line] for line in self.matrix]
        first = max(map(len, ("d", *self.of)), default=1)
        widths = [max(len(name) + 2, *(len(line[k]) for line in texts), 0) for k, name in enumerate(self.wrt)]
        lines = [
            " ".join(["d".ljust(first), *(f"/d {name}".rjust(w + 1) for name, w in zip(self.wrt, widths, strict=True))])
        ]
        for name, line in zip(self.of, texts, strict=True):
            lines.append(" ".join([name.ljust(first), *(f"{x:>{w + 1}}" for x, w in zip(line, widths, strict=True))]))
        lines += [self._held] if self.written else []
        return "\n".join([*lines, *(f"another sequence of events: {each}" for each in self.event_changes)])

    def _repr_html_(self) -> str:
        named = self._with_units(self.wrt, self.wrt_units)
        rows: list[Sequence[str | float]] = [
            (name, float(value), *map(float, line))
            for name, value, line in zip(
                self._with_units(self.of, self.of_units), self.values, self.matrix, strict=True
            )
        ]
        return table(
            f"derivatives; {self._held}" if self.written else "derivatives",
            ("result", "value", *(f"by {name}" for name in named)),
            rows,
        )

    @property
    def _held(self) -> str:
        return f"held as controllers wrote them: {', '.join(self.written)}"

    @staticmethod
    def _with_units(names: tuple[str, ...], units: tuple[str, ...]) -> list[str]:
        known = units or ("",) * len(names)
        return [f"{name} [{unit}]" if unit else name for name, unit in zip(names, known, strict=True)]


def _turn(name: str, names: tuple[str, ...]) -> int | list[int]:
    """The column of a name, those of the three turns of an orientation."""
    stem = str(name).removesuffix(".orientation")
    return _place(f"{stem}.turn" if stem != str(name) and name not in names else name, names, "column")


def _place(name: str, names: tuple[str, ...], kind: str) -> int | list[int]:
    """The place of a name, those of its parts where it has some."""
    if not isinstance(name, str):
        raise UnknownNameError(
            f"derivatives are asked for by names, such as found['hip.angle', 'hip.mass'], not {name!r}"
        )
    if name not in names:
        parts = [k for k, each in enumerate(names) if each.rpartition(".")[0] == name]
        if len(parts) > 1:
            return parts
        raise UnknownNameError(nearest(name, names, kind, "There are"))
    return names.index(name)


def words_of(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Fields of `Sensitivities` but for the run, as numbers and words in lists."""
    return {name: each.tolist() if isinstance(each, np.ndarray) else list(each) for name, each in fields.items()}


def read(words: Mapping[str, Any], run: Trajectory) -> Sensitivities:
    """`Sensitivities.read`."""
    return Sensitivities.read(words, run)
