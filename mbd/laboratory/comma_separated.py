"""Tables ``.csv``: a line of names, then numbers between commas, semicolons or tabs."""

import csv
from pathlib import Path

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.errors import TrajectoryError
from mbd.laboratory.plates_by_column import plates_by_column
from mbd.laboratory.recording import Recording
from mbd.laboratory.storage import read_storage
from mbd.laboratory.text import MAX_HEADER, NUMBER, Lines, numbers_of, read_lines, times_of
from mbd.laboratory.units import factor_of, is_length, split_unit

TIMES = ("time", "t", "times", "zeit", "temps")
ENDS = ((".x", ".y", ".z"), ("_x", "_y", "_z"), (" x", " y", " z"), ("_X", "_Y", "_Z"), (" X", " Y", " Z"),
        (":X", ":Y", ":Z"), (".X", ".Y", ".Z"))  # fmt: skip
"""Endings of the three columns of a marker."""


def read_csv(path: Path) -> Recording:
    """Channels and markers in SI units where the header has units: 'knee [deg]', 'RHEE.x [mm]'.

    Three columns '.x', '.y', '.z' (or '_x', …) in a unit of length, or all in meters without units, are a marker. With
    semicolons or tabs between the cells a comma is the decimal sign.

    Raises
    ------
    TrajectoryError
        for a file without a column of times, and for cells that are no numbers, with the line.
    """
    source = read_lines(path)
    if any(line.strip(", \t").lower() == "endheader" for line in source.lines[:MAX_HEADER]):
        return read_storage(path)  # with commas between the cells, as OpenSim writes it too
    first = next((k for k, line in enumerate(source.lines) if line.strip() and not line.startswith("#")), None)
    if first is None:
        raise source.refused("the file is empty")
    mark = next((sign for sign in (";", "\t", ",") if sign in source.lines[first]), ",")
    labels = [split_unit(cell) for cell in _cells(source, first, mark)]
    names = [name for name, _ in labels]
    while names and not names[-1]:
        names.pop()
    if any(NUMBER.match(name) for name in names):
        raise source.wrong(first, "a line with the names of the columns is expected before the numbers")
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise source.wrong(first, f"two columns are called {twice[0]!r}")
    at = next((k for k, name in enumerate(names) if name.lower() in TIMES), None)
    if at is None:
        raise source.wrong(first, f"no column is called 'time'; there are {', '.join(map(repr, names[:6]))}")
    body = [(k, line) for k, line in enumerate(source.lines) if k > first and line.strip() and not line.startswith("#")]
    rows = [(number, _cells(source, number, mark)) for number, _ in body]
    if not rows:
        raise source.refused("no rows follow the names")
    table = numbers_of(source, rows, len(names), comma=mark != ",")
    factors = [_factor(source, first, *label) for label in labels[: len(names)]]
    table = table * np.array(factors)
    time = times_of(source, table[:, at], rows)
    units = {name: unit for name, unit in labels if unit}
    notes = [f"units in the file: {', '.join(sorted(set(units.values())))}"] if units else []
    columns = {name: table[:, k] for k, name in enumerate(names) if k != at and name}
    columns, plates, remarks = plates_by_column(time, columns)
    markers, channels = _markers(columns, units)
    return Recording(time, markers, channels, plates, name=path.stem, notes=(*notes, *remarks))


def _cells(source: Lines, number: int, mark: str) -> list[str]:
    try:
        return next(csv.reader([source.lines[number]], delimiter=mark), [])
    except csv.Error as error:
        raise source.wrong(number, f"no cells can be told apart ({error})") from None


def _factor(source: Lines, line: int, name: str, unit: str) -> float:
    factor = factor_of(unit)
    if factor is None:
        raise source.wrong(line, f"the unit {unit!r} of {name!r} is not known")
    return factor


def _markers(columns: dict[str, Vector], units: dict[str, str]) -> tuple[dict[str, Matrix], dict[str, Vector]]:
    """Columns that are three coordinates of a place, and the others."""
    markers, used = dict[str, Matrix](), set[str]()
    for name in columns:
        for ends in ENDS:
            stem = name.removesuffix(ends[0])
            parts = [stem + end for end in ends]
            if stem == name or not stem or not all(part in columns for part in parts):
                continue
            given = [units.get(part, "") for part in parts]
            if all(is_length(unit) for unit in given) or not any(given):
                track = np.column_stack([columns[part] for part in parts])
                track[~np.isfinite(track).all(axis=1)] = np.nan
                markers[stem] = track
                used |= set(parts)
    return markers, {name: values for name, values in columns.items() if name not in used}


def write_csv(recording: Recording, target: Path) -> str:
    """The text of a table: time, markers with their unit, channels."""
    columns: dict[str, Vector] = {"time [s]": recording.time}
    for name, track in recording.markers.items():
        columns |= {f"{name}.{axis} [m]": track[:, k] for k, axis in enumerate("xyz")}
    columns |= dict(recording.channels)
    wrong = [name for name in columns if any(sign in name for sign in ',;"\n\t\r')]
    if wrong:
        raise TrajectoryError(f"{target.name}: a column cannot be called {wrong[0]!r} in such a file")
    table = np.column_stack(list(columns.values()))
    lines = [",".join("" if np.isnan(x) else repr(float(x)) for x in row) for row in table]
    return "\n".join([",".join(columns), *lines]) + "\n"
