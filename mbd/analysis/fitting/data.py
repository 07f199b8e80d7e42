"""Measured values that a run is compared with: columns over time, and instants of events."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.bodies.values import is_number, shown
from mbd.dataclass import dataclass
from mbd.equal import EQUAL_RTOL, ROUND_OFF_RTOL
from mbd.errors import ModelError
from mbd.results.units import unit_of


@dataclass(frozen=True)
class Data:
    """Measured values, each with the scale that its residual is divided by.

    columns : by result, (times, values) without those that are missing; events : instants by name, 'foot.time.2'
    scales : of columns and events, in their units
    """

    columns: Mapping[str, tuple[Vector, Vector]]
    events: Mapping[str, float]
    scales: Mapping[str, float]

    @property
    def count(self) -> int:
        """Number of values."""
        return len(self.events) + sum(len(values) for _, values in self.columns.values())

    @property
    def last(self) -> float:
        """Time of the last value [s]."""
        return max([*(float(times[-1]) for times, _ in self.columns.values()), *self.events.values()])

    def until(self, time: float) -> Data:
        """What was measured up to a time [s], over the same scales."""
        columns = {
            name: (times[times <= time], values[times <= time]) for name, (times, values) in self.columns.items()
        }
        columns = {name: seen for name, seen in columns.items() if len(seen[0])}
        return replace(self, columns=columns, events={n: each for n, each in self.events.items() if each <= time})

    @classmethod
    def read(cls, table: Any, events: Any, sigma: Any, begin: float = 0.0) -> Data:
        """Checked data of runs that begin at a time [s], from which alone instants have their scale.

        Raises
        ------
        ModelError
            for what is no table, no finite times in order, no instants, scales that are not positive: all at once.
        """
        faults: list[str] = []
        columns = _columns(table, faults)
        instants = _numbers(events, "events", "instants [s], such as {'foot.time': 0.73}", faults)
        given = _numbers(sigma, "sigma", "standard deviations, such as {'hip.angle': 0.01}", faults)
        known = {*columns, *instants}
        faults += [f"sigma names {name!r}, which is not among the data" for name in given if name not in known]
        faults += [f"sigma of {name!r} must be positive, not {each!r}" for name, each in given.items() if each <= 0.0]
        if not known and not faults:
            faults.append("there is nothing to fit to: data and events have no value")
        if faults:
            raise ModelError(faults)
        scales = {name: given.get(name, _spread(name, columns)) for name in columns}
        lengths = max([float(np.ptp(times)) for times, _ in columns.values()], default=0.0)
        scales |= {
            name: given.get(name, 1e-2 * (lengths or abs(each - begin) or 1.0)) for name, each in instants.items()
        }
        return cls(columns, instants, scales)


def _columns(table: Any, faults: list[str]) -> dict[str, tuple[Vector, Vector]]:
    if table is None:
        return {}
    try:
        names = [str(name) for name in table]
        found = {name: np.asarray(table[name]) for name in names}
        if any(np.iscomplexobj(values) for values in found.values()):
            raise TypeError
        parts = {name: values.astype(float) for name, values in found.items()}
    except (TypeError, ValueError, KeyError, IndexError, OverflowError):
        faults.append(
            "data must be a table of real numbers by name with a column 'time', a dictionary or a pandas DataFrame, "
            f"not {shown(table)}"
        )
        return {}
    time = parts.pop("time", None)
    if time is None or time.ndim != 1 or not len(time) or not np.all(np.isfinite(time)) or np.any(np.diff(time) <= 0.0):
        faults.append("data must have a column 'time' of finite, increasing times [s]")
        return {}
    wrong = [name for name, values in parts.items() if values.shape != time.shape or np.any(np.isinf(values))]
    faults += [f"data: {name!r} must have a number, or NaN where there is none, for every time" for name in wrong]
    there = {name: ~np.isnan(values) for name, values in parts.items() if name not in wrong}
    return {name: (time[known], parts[name][known]) for name, known in there.items() if known.any()}


def _numbers(given: Any, what: str, example: str, faults: list[str]) -> dict[str, float]:
    if given is None:
        return {}
    if not isinstance(given, Mapping) or not all(
        isinstance(name, str) and is_number(each) and math.isfinite(each) for name, each in given.items()
    ):
        faults.append(f"{what} must map names to {example}, not {shown(given)}")
        return {}
    return {name: float(each) for name, each in given.items()}


def _spread(name: str, columns: Mapping[str, tuple[Vector, Vector]]) -> float:
    """A hundredth of the range of a column; of its size where it is constant, and of the largest that may have its
    unit where it is nothing, up to round-off.
    """
    values, known = columns[name][1], unit_of(name)
    swing, size = float(np.ptp(values)), float(np.max(np.abs(values)))
    spread = swing if swing > EQUAL_RTOL * size else size
    alike = [other for title, (_, other) in columns.items() if not known or unit_of(title) in ("", known)]
    largest = max(float(np.max(np.abs(other))) for other in alike)
    return 1e-2 * (spread if spread > ROUND_OFF_RTOL * largest else largest or 1.0)
