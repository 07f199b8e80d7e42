"""Storage files of OpenSim, ``.sto`` and ``.mot``: a header up to ``endheader``, labels, columns over time."""

import re
from pathlib import Path

import numpy as np

from mbd.arrays import Vector
from mbd.errors import TrajectoryError
from mbd.laboratory.plates_by_column import plates_by_column
from mbd.laboratory.recording import Recording
from mbd.laboratory.text import Lines, numbers_of, read_lines, times_of, with_tabs
from mbd.laboratory.units import split_unit
from mbd.results.opensim import write_storage

NO_ANGLE = re.compile(
    r"(_t[xyz]|_[vp][xyz]|\.[xyz]|\.[wxyz]|\.displacement|\.length|\.gap|force.*|moment.*|torque.*|.*activation"
    r"|.*fiber_length|.*fiber_velocity)$",
    re.IGNORECASE,
)
"""Columns that are no angles, by the ends of OpenSim's names and of those of mbd."""


def read_storage(path: Path) -> Recording:
    """Channels over time, angles in radians; forces with points and moments become plates.

    With ``inDegrees=yes`` all columns are turned into radians but those whose names say that they are none
    (``pelvis_tx``, ``ground_force_vx``, ``left shank.end.x``, activations).

    Raises
    ------
    TrajectoryError
        for what is no such file, with the line.
    """
    source = with_tabs(read_lines(path))
    header, first = _header(source)
    labels = _labels(source, first)
    notes: list[str] = []
    vectors = header.get("datatype", "double").lower()
    rows = [(number, _cells(line)) for number, line in enumerate(source.lines[first + 1 :], first + 1) if line.strip()]
    if not rows:
        raise source.refused("no rows follow the labels")
    if vectors == "vec3":
        return _of_vectors(source, rows, labels, header)
    if vectors not in ("double", "float"):
        raise source.refused(f"columns of type {header['datatype']!r} are not read; write them as numbers")
    comma = any("," in cell for _, cells in rows[:20] for cell in cells)
    table = numbers_of(source, rows, len(labels), comma)
    promised = header.get("nrows", header.get("datarows", ""))
    if promised.isdigit() and int(promised) != len(rows):
        notes.append(f"the header promises {promised} rows, the file has {len(rows)}")
    time = times_of(source, table[:, 0], rows)
    degrees = header.get("indegrees", "no").lower() in ("yes", "true", "1", "y")
    channels: dict[str, Vector] = {}
    turned = 0
    for k, label in enumerate(labels[1:], 1):
        name, unit = split_unit(label)
        values = table[:, k]
        if unit.lower() in ("deg", "°", "degrees") or (degrees and not unit and not NO_ANGLE.search(name)):
            values, turned = np.deg2rad(values), turned + 1
        channels[name] = values
    if turned:
        notes.append(f"{turned} of {len(channels)} columns are angles in degrees in the file")
    channels, plates, remarks = plates_by_column(time, channels)
    return Recording(time, {}, channels, plates, name=_title(source, path), notes=(*notes, *remarks))


def _title(source: Lines, path: Path) -> str:
    first = source.lines[0].strip() if source.lines else ""
    return first if first and "=" not in first and first.lower() != "endheader" else path.stem


def _header(source: Lines) -> tuple[dict[str, str], int]:
    """Fields, and the number of the line of labels."""
    fields: dict[str, str] = {}
    for number, line in enumerate(source.lines):
        text = line.strip()
        if text.lower() == "endheader":
            for later in range(number + 1, len(source.lines)):
                if source.lines[later].strip():
                    return fields, later
            raise source.wrong(number, "no labels follow 'endheader'")
        name, found, value = text.partition("=")
        if found:
            fields[name.strip().lower()] = value.strip()
        elif len(text.split()) == 2:  # of SIMM's motions: datacolumns 5
            fields.setdefault(text.split()[0].lower(), text.split()[1])
    raise source.refused("a header that ends with 'endheader' is expected in a storage file")


def _cells(line: str) -> list[str]:
    return line.split("\t") if "\t" in line.strip() else line.split()


def _labels(source: Lines, number: int) -> list[str]:
    labels = [label.strip() for label in _cells(source.lines[number])]
    while labels and not labels[-1]:
        labels.pop()
    if not labels or split_unit(labels[0])[0].lower() not in ("time", "t"):
        raise source.wrong(number, f"the first column must be called 'time', got {labels[0] if labels else ''!r}")
    twice = sorted({label for label in labels if labels.count(label) > 1})
    if twice:
        raise source.wrong(number, f"two columns are called {twice[0]!r}")
    return labels


def _of_vectors(
    source: Lines, rows: list[tuple[int, list[str]]], labels: list[str], header: dict[str, str]
) -> Recording:
    """Markers in columns of 'x,y,z'."""
    wide = []
    for line, cells in rows:
        flat = [cells[0]]
        for label, cell in zip(labels[1:], cells[1:], strict=False):
            parts = [part.strip() for part in cell.split(",")]
            if cell.strip() and len(parts) != 3:
                raise source.wrong(line, f"{label!r} holds {cell[:40]!r}; three numbers 'x,y,z' are expected")
            flat += parts if cell.strip() else ["", "", ""]
        wide.append((line, flat))
    table = numbers_of(source, wide, 1 + 3 * (len(labels) - 1))
    time = times_of(source, table[:, 0], rows)
    factor = 1e-3 if header.get("units", "m").lower() in ("mm", "millimeters") else 1.0
    unit = "m" if factor == 1.0 else "mm"
    note = f"{len(labels) - 1} columns of three numbers are markers in {unit}, whatever they hold"
    markers = {label: factor * table[:, 1 + 3 * k : 4 + 3 * k] for k, label in enumerate(labels[1:])}
    return Recording(time, markers, name=source.path.stem, notes=(note,))


def save_storage(recording: Recording, target: Path) -> Path:
    """Write a storage file: channels in radians ('.sto') or degrees ('.mot'), plates at the frames."""
    columns: dict[str, Vector] = dict(recording.channels)
    degrees = target.suffix == ".mot"
    if degrees:
        columns = {name: values if NO_ANGLE.search(name) else np.rad2deg(values) for name, values in columns.items()}
    for plate in recording.plates:
        stem = "_".join(plate.name.split())
        centers, free = plate.center(), plate.free_moment()
        for word, values in ("force_v", plate.force), ("force_p", centers):
            for k, axis in enumerate("xyz"):
                columns[f"{stem}_{word}{axis}"] = _at(recording.time, plate.time, values[:, k])
        for axis in "xyz":
            own = free if axis == "y" else np.zeros_like(free)
            columns[f"{stem}_torque_{axis}"] = _at(recording.time, plate.time, own)
    if not columns:
        raise TrajectoryError(f"{target.name}: the recording has no channels and no plates; write markers as .trc")
    return write_storage(target, recording.name or "recording", recording.time, columns, degrees)


def _at(time: Vector, own: Vector, values: Vector) -> Vector:
    """Samples at the times of frames; exactly themselves where the times are the same."""
    if len(time) == len(own) and np.array_equal(time, own):
        return values
    known = np.isfinite(values)
    if not known.any():
        return np.full(len(time), np.nan)
    found = np.interp(time, own[known], values[known])
    near = np.interp(time, own, known.astype(float))
    return np.where(near > 0.5, found, np.nan)
