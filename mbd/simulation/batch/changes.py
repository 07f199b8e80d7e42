"""Parameters of many runs: numbers that all share, and columns."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.compile.mechanism import Mechanism
from mbd.errors import ModelError


def telling_values(columns: Mapping[str, Vector], own: Mapping[str, float]) -> dict[str, float]:
    """A value of each column by which a mechanism is made: one that differs from the model's, where there is one.

    Values that are 0 or ±1 in the model are part of its equations, unless other values are wanted.
    """
    found = {}
    for name, column in columns.items():
        values = np.atleast_1d(np.asarray(column, dtype=float))
        other = np.flatnonzero(values != own.get(name))
        found[name] = float(values[other[0] if len(other) else 0])
    return found


class Changes:
    """Values that differ from the model's, as vectors of the kernel.

    Raises
    ------
    ModelError, UnknownNameError
        for names that are no parameters, and values that the model's words do not allow, of whichever run.
    """

    def __init__(self, model: Any, mechanism: Mechanism, columns: Mapping[str, Vector]) -> None:
        self.columns = {name: np.asarray(column, dtype=float) for name, column in columns.items()}
        self.names = tuple(self.columns)
        folded = getattr(model, "parameters", {})
        first = telling_values(columns, folded)
        self.constant_vector = mechanism.parameters(first, folded)
        known = [parameter.name for parameter in mechanism.equations.parameters]
        self._varied = {
            known.index(name): column for name, column in self.columns.items() if column.ndim and name in known
        }
        self.varies = bool(self._varied)
        self._check(model, mechanism, first, folded)

    def _check(self, model: Any, mechanism: Mechanism, first: dict[str, float], folded: Mapping[str, float]) -> None:
        lists = {name: column for name, column in self.columns.items() if column.ndim}
        if not lists:
            return
        table = np.column_stack(list(lists.values()))
        kinds, firsts = np.unique(table, axis=0, return_index=True)
        if len(kinds) > 2000:
            firsts = np.unique([pick(column) for column in lists.values() for pick in (np.argmin, np.argmax)])
        check, faults = model.parameter_check(), list[str]()
        for k in firsts:
            values = {**first, **{name: float(column[k]) for name, column in lists.items()}}
            faults += [f"run {k}: {fault}" for fault in check.faults(values)]
            mechanism.parameters(values, folded)
            if len(faults) > 5:
                break
        if faults:
            raise ModelError(faults)

    def part(self, runs: Any) -> Changes:
        """Those of the runs with these numbers alone, which are judged already."""
        found = copy(self)
        found.columns = {name: column[runs] if column.ndim else column for name, column in self.columns.items()}
        found._varied = {place: column[runs] for place, column in self._varied.items()}
        return found

    def at(self, k: int) -> dict[str, float]:
        """The values of the k-th run by name."""
        return {name: float(column[k] if column.ndim else column) for name, column in self.columns.items()}

    def vectors(self, first: int, last: int) -> Matrix:
        """The parameter vectors of some runs, one behind the other."""
        return self.rows(np.arange(first, last))

    def rows(self, runs: Any) -> Matrix:
        """The parameter vectors of the runs with these numbers; one for all where none varies."""
        if not self.varies:
            return self.constant_vector[np.newaxis]
        found = np.tile(self.constant_vector, (len(runs), 1))
        for place, column in self._varied.items():
            found[:, place] = column[runs]
        return found

    def constant(self, first: int, last: int) -> Matrix:
        """The same where none varies."""
        return np.tile(self.constant_vector, (last - first, 1))

    def all_vectors(self, count: int) -> Vector | Matrix:
        """For expressions: one vector, or one for each run."""
        return self.rows(np.arange(count)) if self.varies else self.constant_vector
