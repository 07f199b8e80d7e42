"""Runs as tables of pandas and xarray."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mbd.arrays import Vector
from mbd.bodies.values import among, is_number, names_of, shown
from mbd.errors import TrajectoryError
from mbd.joints.anatomy import ANATOMY, angles_of
from mbd.results.archive import named_file, write_whole
from mbd.results.interpolation import OneSide, Side
from mbd.results.units import EFFORTS, unit

if TYPE_CHECKING:
    from mbd.results.trajectory import Trajectory

WORDS = {
    "x": "place of {} along x", "y": "place of {} along y", "z": "place of {} along z",
    "vx": "velocity of {} along x", "vy": "velocity of {} along y", "vz": "velocity of {} along z",
    "ax": "acceleration of {} along x", "ay": "acceleration of {} along y", "az": "acceleration of {} along z",
    "rate": "rate of {}", "acceleration": "acceleration of {}", "angle": "angle of {}",
    "displacement": "displacement of {}", "gap": "gap of {}", "gap_rate": "rate of the gap of {}",
    "force": "force of {}", "torque": "torque of {}", "tension": "tension of {}", "length": "length of {}",
    "friction": "friction of {}", "multiplier": "multiplier of {}", "residual": "residual of {}",
    "net_moment": "net moment of {}", "net_force": "net force of {}", "power": "power of {}", "energy": "energy of {}",
    "reaction_force": "reaction force of {}", "reaction_torque": "reaction torque of {}",
}  # fmt: skip
"""Words for the last part of a name."""

ANGLES = {angle.name for part in ANATOMY for angles, _ in angles_of(part) for angle in angles}
"""Angles of joints of the body."""


FRAMES = {"": "in axes of the child", "parent": "in axes of the parent", "ground": "in axes of the ground"}
PLACES = {"1": "first", "2": "second", "3": "third"}

FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""With what a formula of a spreadsheet begins."""

SIDES: dict[str, Side] = {"after": "right", "before": "left"}

MAX_ROWS = 10_000_000
"""Most rows of a table that is asked for by a distance in time."""

Reader = Callable[[Sequence[str]], list[Vector]]
"""Gives named scalars at the times of a table."""


def library(name: str, extra: str, purpose: str) -> Any:
    """An optional library, or the error that says how to install it."""
    from importlib import import_module

    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        top = name.partition(".")[0]
        if error.name != top:
            raise
        text = f"{purpose} needs {top}, which is not installed; try: pip install 'mbd[{extra}]'"
        raise ModuleNotFoundError(text, name=top) from None


def dataframe(
    run: Trajectory, names: Sequence[str] | None = None, at: ArrayLike | None = None, side: OneSide | None = None
) -> Any:
    """A pandas DataFrame, see `Trajectory.to_dataframe`."""
    pandas = library("pandas", "data", "run.to_dataframe()")
    time, columns = columns_of(run, names, at, side)
    frame = pandas.DataFrame(columns, index=pandas.Index(time, name="time"))
    units = {name: unit(name, run.facts) for name in columns}
    frame.attrs["units"] = {"time": "s", **{name: text for name, text in units.items() if text}}
    frame.attrs["long_names"] = {name: long_name(name) for name in columns}
    return frame


def csv_file(
    run: Trajectory, path: str | Path, names: Sequence[str] | None, at: ArrayLike | None, side: OneSide | None
) -> Path:
    """See `Trajectory.to_csv`; the text is that which pandas writes of the same table, and needs no pandas."""
    target = named_file(path, ".csv")
    time, columns = columns_of(run, names, at, side)

    def write(partial: Path) -> None:
        cells = [["" if x != x else x for x in values.tolist()] for values in (time, *columns.values())]
        with partial.open("w", encoding="utf-8", newline="") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(["time", *columns])
            table.writerows(zip(*cells, strict=True))

    write_whole(target, write)
    return target


def columns_of(
    run: Trajectory, names: Sequence[str] | None, at: ArrayLike | None, side: OneSide | None, in_words: bool = True
) -> tuple[Vector, dict[str, Vector]]:
    """The times of a table and its columns, a vector's components each; of discrete states words, or numbers from 0."""
    time, read = _axis(run, at, side)
    wanted = _wanted(run, names)
    scalars = list(dict.fromkeys(part for name in wanted for part in run.columns.components(name)))
    found = zip(scalars, read(scalars), strict=True)
    return time, {name: run.facts.worded(name, values) if in_words else values for name, values in found}


def last_number(run: Trajectory, name: str) -> float:
    """A scalar at the end of a run, of a discrete state its number from 0."""
    values = run[name]
    return float(values[-1] if values.dtype.kind == "f" else run.columns.at_rows([name])[0][-1])


def dataset(
    run: Trajectory, names: Sequence[str] | None = None, at: ArrayLike | None = None, side: OneSide | None = None
) -> Any:
    """An xarray Dataset, see `Trajectory.to_xarray`."""
    xarray = library("xarray", "data", "run.to_xarray()")
    time, read = _axis(run, at, side)
    wanted = _wanted(run, names)
    parts = {name: run.columns.components(name) for name in wanted}
    scalars = list(dict.fromkeys(part for several in parts.values() for part in several))
    found = dict(zip(scalars, read(scalars), strict=True))
    variables: dict[str, Any] = {}
    axes: dict[str, list[str]] = {}
    for name, several in parts.items():
        about = {"units": unit(several[0], run.facts), "long_name": long_name(name)}
        about = {key: text for key, text in about.items() if text}
        values = [run.facts.worded(part, found[part]) for part in several]
        one = len(values) == 1
        endings = [part.rpartition(".")[2] for part in several]
        along = {"w": "part", "1": "turn"}.get(endings[0], "axis")
        axes |= {} if one else {along: endings}
        variables[name] = (("time",) if one else ("time", along), values[0] if one else np.column_stack(values), about)
    coordinates = {"time": ("time", time, {"units": "s", "long_name": "time"}), **axes}
    return xarray.Dataset(variables, coords=coordinates, attrs={"model": run.name, "message": run.message})


def _wanted(run: Trajectory, names: Sequence[str] | None) -> Sequence[str]:
    if isinstance(names, str):
        raise TrajectoryError(f"names are a list, such as [{names!r}]; got one text")
    return run.names if names is None else names_of(names, "names of a table")


def _axis(run: Trajectory, at: ArrayLike | None, side: OneSide | None) -> tuple[Vector, Reader]:
    """The times of a table, and what reads scalars there."""
    if side is not None and not among(side, SIDES):
        raise TrajectoryError(f"side is 'before' or 'after' an event, or None for both where at= is; got {side!r}")
    columns = run.columns
    if at is None:
        rows = _once(run.time, side)
        return run.time[rows], lambda names: [values[rows] for values in columns.at_rows(names)]
    times = _times(run.time, at)
    places = columns.grid.places(times, SIDES[side or "after"])
    return times, lambda names: [np.asarray(values) for values in columns.at_places(names, places)]


def _once(time: Vector, side: OneSide | None) -> Any:
    """The stored rows: all of them, or of those at one instant the last ('after') or the first ('before')."""
    if side is None:
        return slice(None)
    apart = np.diff(time) > 0.0
    ends = np.ones(min(1, len(time)), dtype=bool)
    return np.flatnonzero(np.concatenate([apart, ends] if side == "after" else [ends, apart]))


def _times(time: Vector, at: ArrayLike) -> Vector:
    """The times asked for: those given, in order, or every dt from the start of the run to its end."""
    if is_number(at):
        return _every(time, float(at))  # type: ignore[arg-type]
    try:
        times = np.asarray(at, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        times = np.zeros((0, 0))
    if times.ndim != 1:
        raise TrajectoryError(f"at is a distance in time or times in order [s], not {shown(at)}")
    wrong = np.flatnonzero(~(np.diff(times) > 0.0))
    if len(wrong):
        first = int(wrong[0])
        raise TrajectoryError(
            f"times of a table lie in order, each once; {times[first + 1]:g} s comes after {times[first]:g} s"
        )
    return times


def _every(time: Vector, dt: float) -> Vector:
    """t₀ + k dt; the end of the run belongs to them where it lies there to round-off."""
    if not dt > 0.0 or not np.isfinite(dt):
        raise TrajectoryError(
            f"at={dt:g}: a distance in time is a number above 0 s; times are a list, as in at=[{dt:g}]"
        )
    if not len(time):
        return np.zeros(0)
    steps = float(time[-1] - time[0]) / float(dt)
    if steps > MAX_ROWS:
        raise TrajectoryError(
            f"at={dt:g} s would make {steps:.3g} rows of a run of {time[-1] - time[0]:g} s; at most {MAX_ROWS}"
        )
    count = int(np.floor(steps * (1.0 + 1e-12) + 1e-9))
    return np.asarray(np.minimum(time[0] + dt * np.arange(count + 1), time[-1]))


def text_cell(value: Any) -> Any:
    """A cell of a CSV file: text that a spreadsheet would take for a formula begins with an apostrophe.

    >>> text_cell("=1+1"), text_cell("left knee"), text_cell(-1.0)
    ("'=1+1", 'left knee', -1.0)
    """
    return f"'{value}" if isinstance(value, str) and value.startswith(FORMULA) else value


def _of_orientation(name: str) -> str:
    """A part of an orientation or an angular velocity in words; '' for any other result."""
    joint, _, rest = name.partition(".")
    kind, *between = rest.split(".")
    last = between.pop() if between else ""
    which = between[0] if between else ""
    if kind == "angular_velocity" and which in FRAMES and last in ("x", "y", "z"):
        return f"angular velocity of {joint} about {last} {FRAMES[which]}"
    if kind == "orientation" and not between and last in ("w", "x", "y", "z"):
        return f"part {last} of the orientation of {joint}"
    if kind == "rotation_vector" and last in ("x", "y", "z"):
        return f"rotation vector of {joint} along {last}"
    if kind == "euler" and last in PLACES:
        return f"{PLACES[last]} angle of {joint} about {which}"
    return ""


def long_name(name: str) -> str:
    """A result in words; the name itself where its parts do not tell.

    >>> long_name("left hip.angle.rate"), long_name("shank.end.vx"), long_name("knee.reaction_force.y")
    ('rate of angle of left hip', 'velocity of shank.end along x', 'reaction force of knee along y')
    """
    stem, _, last = name.rpartition(".")
    if not stem:
        return "time" if name == "t" else name.replace("_", " ")
    owner, _, kind = stem.rpartition(".")
    if last in ("x", "y", "z") and owner and kind in EFFORTS:
        return f"{WORDS[kind].format(owner)} along {last}"
    turning = _of_orientation(name)
    if turning:
        return turning
    if last in ("rate", "acceleration") and owner:
        return WORDS[last].format(long_name(stem))
    if last in ANGLES:
        return f"{last.replace('_', ' ')} of {stem}"
    return WORDS[last].format(stem) if last in WORDS else name
