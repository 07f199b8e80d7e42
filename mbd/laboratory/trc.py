"""Marker files ``.trc``: five lines of header, then frame, time and three coordinates of each marker.

The first line is ``PathFileType 4 (X/Y/Z) name``, the second names the fields of the third (``DataRate``,
``NumFrames``, ``NumMarkers``, ``Units``), the fourth the markers, the fifth the axes (file formats of OpenSim's user's
guide).
"""

import re
from pathlib import Path

import numpy as np

from mbd.arrays import Matrix
from mbd.errors import TrajectoryError
from mbd.laboratory.recording import Recording
from mbd.laboratory.text import Lines, numbers_of, read_lines, times_of, with_tabs
from mbd.laboratory.units import factor_of, is_length

RATE_RTOL = 0.01
"""By how much the rate of the header and that of the times differ before a note says so [-]."""


def read_trc(path: Path) -> Recording:
    """Markers in the axes of the file, in meters.

    Cells that are empty or NaN are gaps, and so are three exact zeros. Times come from the file, or, where it has none,
    from the frames and the rate.

    Raises
    ------
    TrajectoryError
        for what is no such file, with the line.
    """
    source = with_tabs(read_lines(path))
    lines = source.lines
    if not lines or "pathfiletype" not in lines[0].lower():
        raise source.wrong(0, "a marker file begins with 'PathFileType'")
    notes: list[str] = []
    fields = _fields(source)
    units = fields.get("units", "")
    factor = factor_of(units) if units else None
    if factor is None or not is_length(units):
        raise source.wrong(2, f"units of length such as mm or m are expected under 'Units', got {units!r}")
    names, header = _names(source)
    rows = _rows(source, header + 1)
    if not rows:
        raise source.refused("no frames follow the header")
    comma = any("," in cell for _, cells in rows[:20] for cell in cells)
    table = numbers_of(source, rows, 2 + 3 * len(names), comma)
    time = _times(source, table, fields, rows, notes)
    markers: dict[str, Matrix] = {}
    blank = 0
    for k, name in enumerate(names):
        track = table[:, 2 + 3 * k : 5 + 3 * k] * factor
        zero = np.all(track == 0.0, axis=1)
        blank += int(zero.sum())
        track[zero | ~np.isfinite(track).all(axis=1)] = np.nan
        markers[name] = track
    if blank:
        notes.append(f"{blank} places of exactly (0, 0, 0) are taken as gaps")
    if factor != 1.0:
        notes.append(f"units: {units} in the file")
    expected = fields.get("nummarkers", "")
    if expected.isdigit() and int(expected) != len(names):
        notes.append(f"the header promises {expected} markers, the file names {len(names)}")
    expected = fields.get("numframes", "")
    if expected.isdigit() and int(expected) != len(rows):
        notes.append(f"the header promises {expected} frames, the file has {len(rows)}")
    return Recording(time, markers, name=path.stem, notes=tuple(notes))


def _split(line: str) -> list[str]:
    """Cells between tabs, or between spaces where there is no tab."""
    return [cell.strip() for cell in line.split("\t")] if "\t" in line else line.split()


def _fields(source: Lines) -> dict[str, str]:
    """The fields of the second and third line."""
    if len(source.lines) < 4:
        raise source.refused("the header has five lines, the file fewer")
    names, values = (_split(source.lines[k]) for k in (1, 2))
    if len(source.lines[1].split()) == len(source.lines[2].split()):  # whatever tabs stand between
        names, values = source.lines[1].split(), source.lines[2].split()
    return {name.lower(): value for name, value in zip(names, values, strict=False)}


def _names(source: Lines) -> tuple[list[str], int]:
    """Names of the markers, and the number of the line that holds the axes."""
    cells = _split(source.lines[3])
    if len(cells) < 2 or not cells[0].lower().startswith("frame"):
        raise source.wrong(3, "a line 'Frame#  Time  first marker  …' is expected")
    names = [cell for cell in cells[2:] if cell]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise source.wrong(3, f"two markers are called {twice[0]!r}")
    if not names:
        raise source.wrong(3, "no marker is named")
    axes = 4
    if len(source.lines) > 4 and re.search(r"[xyz]\d", source.lines[4], re.IGNORECASE):
        count = len(re.findall(r"[xyz]\d+", source.lines[4], re.IGNORECASE))
        if count != 3 * len(names):
            raise source.wrong(4, f"{count} columns of coordinates stand under {len(names)} markers, 3 each expected")
    else:
        axes = 3
    return names, axes


def _rows(source: Lines, first: int) -> list[tuple[int, list[str]]]:
    rows = []
    for number, line in enumerate(source.lines[first:], first):
        if line.strip():
            cells = line.split("\t") if "\t" in line else line.split()
            rows.append((number, cells))
    return rows


def _times(
    source: Lines, table: Matrix, fields: dict[str, str], rows: list[tuple[int, list[str]]], notes: list[str]
) -> Matrix:
    frames, time = table[:, 0], table[:, 1]
    try:
        rate = float(fields.get("datarate", "").replace(",", "."))
    except ValueError:
        rate = 0.0
    if not np.all(np.isfinite(time)):
        if not rate > 0.0 or not np.all(np.isfinite(frames)):
            wrong = int(np.flatnonzero(~np.isfinite(time))[0])
            raise source.wrong(rows[wrong][0], "the time is missing, and frames with a DataRate are not there either")
        time = (frames - 1.0) / rate
        notes.append(f"times follow from the frames at {rate:g} Hz")
    time = times_of(source, time, rows)
    found = (frames[-1] - frames[0]) / (time[-1] - time[0]) if len(time) > 1 else rate
    if rate > 0.0 and found > 0.0 and abs(found / rate - 1.0) > RATE_RTOL:
        notes.append(f"the header promises {rate:g} frames a second, the times tell {found:.4g}; the times count")
    return time


def write_trc(recording: Recording, target: Path) -> str:
    """The text of a marker file in meters, every number with all its digits, gaps as empty cells."""
    markers, time = recording.markers, recording.time
    if not markers:
        raise TrajectoryError(f"{target.name}: the recording has no markers; write channels as .mot or .sto")
    wrong = [name for name in markers if not name.strip() or "\t" in name or "\n" in name]
    if wrong:
        raise TrajectoryError(f"{target.name}: a marker cannot be called {wrong[0]!r} in such a file")
    rate = (len(time) - 1) / (time[-1] - time[0]) if len(time) > 1 else 100.0
    shown = f"{rate:.9g}"
    count = f"{len(time)}\t{len(markers)}\tm\t{shown}\t1\t{len(time)}"
    header = [
        f"PathFileType\t4\t(X/Y/Z)\t{target.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{shown}\t{shown}\t{count}",
        "\t".join(["Frame#", "Time", *(f"{name}\t\t" for name in markers)]),
        "\t".join(["", "", *(f"X{k}\tY{k}\tZ{k}" for k in range(1, len(markers) + 1))]),
        "",
    ]
    table = np.column_stack(list(markers.values()))
    lines = []
    for k, t in enumerate(time):
        cells = ("" if np.isnan(value) else repr(float(value)) for value in table[k])
        lines.append("\t".join([str(k + 1), repr(float(t)), *cells]))
    return "\n".join([*header, *lines]) + "\n"
