"""Tables of numbers in text files: cells, decimal commas, gaps, and errors that name the line."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.errors import TrajectoryError
from mbd.free_memory import available

MAX_HEADER = 100
"""Lines within which the header of a storage file ends."""
NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eEdD][-+]?\d{1,4})?$")
GAPS = {"", "nan", "+nan", "-nan", "na", "n/a", "null", "none", "-", "--", "1.#qnan", "-1.#ind", "-nan(ind)", "missing"}
"""What stands for a value that was not measured."""


@dataclass(frozen=True)
class Lines:
    """A text file line by line.

    path : for errors; lines : without their ends
    """

    path: Path
    lines: tuple[str, ...]

    def wrong(self, number: int, sentence: str) -> TrajectoryError:
        """An error about a line, counted from 0."""
        return TrajectoryError(f"{self.path.name}, line {number + 1}: {sentence}")

    def refused(self, sentence: str) -> TrajectoryError:
        """An error about the whole file."""
        return TrajectoryError(f"{self.path.name}: {sentence}")


def read_lines(path: Path) -> Lines:
    """The lines of a file in UTF-8, UTF-16 with a mark, or Latin-1.

    Raises
    ------
    TrajectoryError
        for a file that cannot be read, is no text, or is larger than the memory allows.
    """
    try:
        size = path.stat().st_size
        if size > 10_000_000 and size > 0.05 * available():
            raise TrajectoryError(f"{path.name} has {size / 1e6:.0f} MB, too large for the memory that is free")
        data = path.read_bytes()
    except OSError as error:
        raise TrajectoryError(f"'{path}' cannot be read: {error.strerror or error}") from None
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = data.decode("utf-16", errors="replace")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
    if "\0" in text:
        raise TrajectoryError(f"{path.name} is no text file: it holds zero bytes")
    return Lines(path, tuple(re.split(r"\r\n|\n|\r", text)))


def with_tabs(source: Lines) -> Lines:
    """A file with tabs between its cells, also where a spreadsheet or OpenSim has saved it with commas."""
    first = source.lines[0].rstrip().lower() if source.lines else ""
    labelled = any(line.lower().startswith("time,") for line in source.lines[:MAX_HEADER])
    if not labelled and not first.endswith(",,") and not first.startswith("pathfiletype,"):
        return source
    return replace(source, lines=tuple(line.replace(",", "\t") for line in source.lines))


def numbers_of(source: Lines, rows: Sequence[tuple[int, Sequence[str]]], width: int, comma: bool = False) -> Matrix:
    """Cells as numbers (R, width), NaN in gaps and behind rows that end early.

    Parameters
    ----------
    rows : (number of the line, its cells)
    comma : whether a comma is the decimal sign

    Raises
    ------
    TrajectoryError
        for a cell that is no number, and for cells behind the last column.
    """
    out = np.full((len(rows), width), np.nan)
    for k, (line, cells) in enumerate(rows):
        used = len(cells)
        while used > width and not cells[used - 1].strip():
            used -= 1
        if used > width:
            raise source.wrong(line, f"{used} cells where the header has {width} columns")
        for j in range(used):
            cell = cells[j].strip()
            if comma:
                cell = cell.replace(",", ".")
            if NUMBER.match(cell):
                value = float(cell.replace("d", "e").replace("D", "e"))
                if np.isinf(value):
                    raise source.wrong(line, f"column {j + 1} holds {cells[j].strip()!r}, which no float can hold")
                out[k, j] = value
            elif cell.lower() not in GAPS:
                shown = cells[j].strip()
                raise source.wrong(line, f"column {j + 1} holds {shown[:40]!r}; a number or a gap is expected")
    return out


def times_of(source: Lines, time: Vector, rows: Sequence[tuple[int, Sequence[str]]]) -> Vector:
    """Times of rows, of which each is there and later than the one before; the error has the line."""
    gap = np.flatnonzero(~np.isfinite(time))
    if len(gap):
        raise source.wrong(rows[int(gap[0])][0], "the time is missing")
    steps = np.flatnonzero(np.diff(time) <= 0.0)
    if len(steps):
        raise source.wrong(rows[int(steps[0]) + 1][0], "the time does not increase from the row before")
    return time
