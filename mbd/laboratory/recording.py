"""A recording: what cameras, force plates and other instruments saw, in SI units and one frame."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from mbd.arrays import Matrix, Vector
from mbd.bodies.values import floats, number, shown
from mbd.dataclass import dataclass
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.forces.smoothing import smoothed
from mbd.laboratory.measured_gait import MeasuredGait, gait_of_recording

MIN_PLATE_LOAD = 10.0
"""Force along the vertical below which a plate is taken to be unloaded by default [N]."""


@dataclass(frozen=True, eq=False, repr=False)
class PlateRecord:
    """What a force plate measured, in ground axes.

    Attributes
    ----------
    name : 'plate 1', …
    time : (A,) [s], often finer than that of the markers
    force : (A, 3) of the plate on the foot [N], pushing up
    moment : (A, 3) of the plate on the foot about the origin of the ground [N m]
    corners : (4, 3) [m], or None where the file has none
    height : of the surface, on which the center of pressure lies [m]
    """

    name: str
    time: Vector
    force: Matrix
    moment: Matrix
    corners: Matrix | None = None
    height: float = 0.0

    def __repr__(self) -> str:
        most = float(np.nanmax(self.force[:, 1])) if len(self.time) and np.isfinite(self.force[:, 1]).any() else 0.0
        ends = f" from {self.time[0]:g} to {self.time[-1]:g} s" if len(self.time) else ""
        return f"<PlateRecord {self.name!r}: {len(self.time)} samples{ends}, up to {most:.4g} N>"

    def center(self, threshold: float = MIN_PLATE_LOAD) -> Matrix:
        """The center of pressure (A, 3) [m]: where on the surface the force has no moment but a vertical one.

        NaN where less than `threshold` [N] acts along the vertical.
        """
        F, M = self.force, self.moment
        up = np.where(np.abs(F[:, 1]) > threshold, F[:, 1], np.nan)
        x = (M[:, 2] + self.height * F[:, 0]) / up
        z = (-M[:, 0] + self.height * F[:, 2]) / up
        return np.column_stack([x, np.where(np.isfinite(x), self.height, np.nan), z])

    def free_moment(self, threshold: float = MIN_PLATE_LOAD) -> Vector:
        """The vertical moment about the center of pressure (A,) [N m]; 0 where nothing acts."""
        found = self.center(threshold)
        vertical = self.moment[:, 1] - (found[:, 2] * self.force[:, 0] - found[:, 0] * self.force[:, 2])
        return np.asarray(np.nan_to_num(vertical, nan=0.0))

    @classmethod
    def at(
        cls, name: str, time: Any, force: Any, center: Any, free_moment: Any = 0.0, height: float | None = None
    ) -> PlateRecord:
        """From force (A, 3), center of pressure (A, 3) and vertical free moment (A,); without a force the center counts
        for nothing, and may be NaN."""
        given = ("time", time), ("force", force), ("center", center), ("free_moment", free_moment)
        time, force, place, free = (floats(value, f"{what} of a PlateRecord") for what, value in given)
        fits = force.shape == place.shape == (*time.shape, 3) and free.shape in ((), time.shape)
        if time.ndim != 1 or not fits:
            raise ModelError(
                f"{name!r}: for times (n,), force and center need the shape (n, 3) and free_moment (n,) or one number; "
                f"got {time.shape}, {force.shape}, {place.shape} and {free.shape}"
            )
        level = height
        if level is None:
            seen = place[np.isfinite(place[:, 1]) & (np.abs(force[:, 1]) > MIN_PLATE_LOAD), 1]
            level = float(np.median(seen)) if len(seen) else 0.0
        known = np.nan_to_num(place, nan=0.0)
        moment = np.cross(known, force)
        moment[:, 1] += np.nan_to_num(free, nan=0.0)
        return cls(name, time, force, moment, None, level)


@dataclass(frozen=True, eq=False)
class Recording(Mapping[str, Any]):
    """Markers, angles, plates and other channels of a trial: SI units and radians, x forward, y up, z to the right.

    ``recording["RHEE"]`` is a marker (R, 3) [m] with NaN in gaps, ``recording["knee_angle_r"]`` a channel (R,),
    ``recording["plate 1.force"]``, ``'.moment'`` (about the ground's origin), ``'.center'`` and ``'.free_moment'`` are
    those of a plate at its own times, ``'plate 1.time'``.

    Attributes
    ----------
    time : (R,) times of the frames [s]
    markers : (R, 3) by name [m]
    channels : (R,) by name: angles [rad] and whatever else was measured at the frames
    plates : force plates, in order
    analog : (A,) by name, at `analog_time`, in the units of the file
    units : of channels and analog by name, where the file tells
    events : (time, label)
    name : of the trial
    notes : what was done to bring it here, a sentence each: units, axes, gaps
    """

    time: Vector
    markers: Mapping[str, Matrix] = field(default_factory=dict)
    channels: Mapping[str, Vector] = field(default_factory=dict)
    plates: tuple[PlateRecord, ...] = ()
    analog_time: Vector | None = None
    analog: Mapping[str, Vector] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    events: tuple[tuple[float, str], ...] = ()
    name: str = "recording"
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "time", _column(self.time, "time of a Recording"))
        for what in ("markers", "channels", "analog", "units"):
            if not isinstance(getattr(self, what), Mapping):
                raise ModelError(f"{what} of a Recording are given by name, got {shown(getattr(self, what))[:80]}")
        count = len(self.time)
        if np.any(np.diff(self.time) <= 0.0) or not np.all(np.isfinite(self.time)):
            raise ModelError("time of a Recording must be finite and increase from frame to frame")
        put(self, "markers", {name: _table(value, (count, 3), name) for name, value in self.markers.items()})
        put(self, "channels", {name: _table(value, (count,), name) for name, value in self.channels.items()})

    # by name ----------------------------------------------------------------------------------------------------
    def _ipython_key_completions_(self) -> list[str]:
        return list(self)

    def __getitem__(self, name: str) -> Any:
        if not isinstance(name, str):
            raise UnknownNameError(f"a recording is asked for one column by its name, not {shown(name)[:80]}")
        if name == "time":
            return self.time
        for known in (self.markers, self.channels, self.analog):
            if name in known:
                return known[name]
        stem, _, last = str(name).rpartition(".")
        plate = next((each for each in self.plates if each.name == stem), None)
        if plate is not None and last in ("time", "force", "moment"):
            return getattr(plate, last)
        if plate is not None and last in ("center", "free_moment"):
            return getattr(plate, last)()
        raise UnknownNameError(nearest(str(name), list(self), "signal", "The recording has"))

    def __iter__(self) -> Iterator[str]:
        yield "time"
        yield from self.markers
        yield from self.channels
        yield from self.analog
        for plate in self.plates:
            yield from (f"{plate.name}.{what}" for what in ("time", "force", "moment", "center", "free_moment"))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    # gaps and noise ---------------------------------------------------------------------------------------------
    @property
    def gaps(self) -> dict[str, list[tuple[float, float]]]:
        """(first, last) times of the frames that are missing, by marker or channel that has gaps."""
        found = {}
        for name, values in [*self.markers.items(), *self.channels.items()]:
            spans = _spans(_missing(values))
            if spans:
                found[name] = [(float(self.time[a]), float(self.time[b])) for a, b in spans]
        return found

    def filled(self, longest: float = 0.1) -> Recording:
        """With gaps of up to `longest` [s] filled by a cubic spline through the frames around.

        Longer ones, and those at the ends, stay. The notes say which.
        """
        limit = number(longest, "longest of filled")
        filled, left = list[str](), list[str]()

        def fill(name: str, values: Any) -> Any:
            missing = _missing(values)
            if not missing.any() or (~missing).sum() < 4:
                if missing.any():
                    left.append(name)
                return values
            curve = CubicSpline(self.time[~missing], values[~missing])
            out = np.array(values)
            for a, b in _spans(missing):
                inside = a > 0 and b < len(missing) - 1
                if inside and self.time[b + 1] - self.time[a - 1] <= limit * (1.0 + 1e-9):
                    out[a : b + 1] = curve(self.time[a : b + 1])
                    filled.append(f"{name!r} at {self.time[a]:.4g} s")
                else:
                    left.append(f"{name!r} from {self.time[a]:.4g} to {self.time[b]:.4g} s")
            return out

        markers = {name: fill(name, values) for name, values in self.markers.items()}
        channels = {name: fill(name, values) for name, values in self.channels.items()}
        notes = [f"{len(filled)} gaps filled: {_few(filled)}"] if filled else []
        notes += [f"{len(left)} gaps longer than {limit:g} s, or at an end, stay: {_few(left)}"] if left else []
        return replace(self, markers=markers, channels=channels, notes=(*self.notes, *notes))

    def smoothed(self, cutoff: float | None = None) -> Recording:
        """With markers and channels smoothed: by a Butterworth filter without lag at `cutoff` [Hz], or the spline that
        generalized cross-validation finds. What has gaps is smoothed piece by piece.

        Second derivatives are unreliable near the ends, for 0.5/cutoff, 0.08 s at 6 Hz, or three frames of a spline;
        record that much more than you need, and cut it with `between` afterwards.
        """

        cutoff = None if cutoff is None else number(cutoff, "cutoff of smoothed")

        def smooth(values: Any) -> Any:
            out = np.array(values)
            for a, b in _spans(~_missing(values)):
                if b - a >= 15:
                    piece = out[a : b + 1].reshape(b + 1 - a, -1)
                    columns = [smoothed(tuple(self.time[a : b + 1]), tuple(c), cutoff, False) for c in piece.T]
                    out[a : b + 1] = np.column_stack(columns).reshape(out[a : b + 1].shape)
            return out

        how = "generalized cross-validation" if cutoff is None else f"a Butterworth filter at {cutoff:g} Hz"
        return replace(
            self, markers={name: smooth(values) for name, values in self.markers.items()},
            channels={name: smooth(values) for name, values in self.channels.items()},
            notes=(*self.notes, f"markers and channels smoothed by {how}"),
        )  # fmt: skip

    def between(self, first: float, last: float) -> Recording:
        """The frames, samples and events from `first` to `last` [s]."""
        first, last = number(first, "first of between"), number(last, "last of between")
        if not first < last:
            raise ModelError(f"between: the first time must lie before the last, got {first!r} and {last!r}")
        part = (self.time >= first) & (self.time <= last)
        if not part.any():
            raise ModelError(
                f"between: no frame lies in it; the recording is from {self.time[0]:g} to {self.time[-1]:g} s"
            )

        def cut(plate: PlateRecord) -> PlateRecord:
            own = (plate.time >= first) & (plate.time <= last)
            return replace(plate, time=plate.time[own], force=plate.force[own], moment=plate.moment[own])

        fine = None if self.analog_time is None else (self.analog_time >= first) & (self.analog_time <= last)
        return replace(
            self, time=self.time[part], markers={name: values[part] for name, values in self.markers.items()},
            channels={name: values[part] for name, values in self.channels.items()},
            plates=tuple(map(cut, self.plates)),
            analog_time=None if self.analog_time is None else self.analog_time[fine],
            analog=dict(self.analog) if fine is None else {name: values[fine] for name, values in self.analog.items()},
            events=tuple(event for event in self.events if first <= event[0] <= last),
        )  # fmt: skip

    def save(self, path: str | Path) -> Path:
        """Write it as ``.trc`` (markers), ``.mot`` or ``.sto`` (channels and plates), ``.csv`` (all at the frames) or
        ``.c3d`` (all of it; needs ``pip install 'mbd[c3d]'``)."""
        from mbd.laboratory.write import write

        return write(self, path)

    def measured_gait(self) -> MeasuredGait:
        """Its strides and curves for `mbd.gait_report`: by events, with angles and plates that it has."""
        return gait_of_recording(self)

    def __repr__(self) -> str:
        span = f"{len(self.time)} frames from {self.time[0]:g} to {self.time[-1]:g} s" if len(self.time) else "no frame"
        parts = [f"{len(self.markers)} markers", f"{len(self.channels)} channels", f"{len(self.plates)} plates"]
        parts += [f"{len(self.analog)} analog"] if self.analog else []
        gaps = self.gaps
        parts += [f"gaps in {len(gaps)}"] if gaps else []
        lines = [f"Recording {self.name!r}: {span}; {', '.join(parts)}"]
        return "\n".join([*lines, *(f"  {note}" for note in self.notes)])


def _few(words: Sequence[str]) -> str:
    return ", ".join(words[:4]) + (", …" if len(words) > 4 else "")


def _column(value: Any, what: str) -> Vector:
    found = floats(value, what)
    if found.ndim != 1:
        raise ModelError(f"{what} must be one column of numbers, got an array of shape {found.shape}")
    return found


def _table(value: Any, shape: tuple[int, ...], name: str) -> Any:
    found = floats(value, f"{name!r} of a Recording")
    if found.shape != shape:
        raise ModelError(f"{name!r} of a Recording of {shape[0]} times needs the shape {shape}, got {found.shape}")
    return found


def _missing(values: Any) -> Any:
    """(R,) frames without a value."""
    return ~np.isfinite(values.reshape(len(values), -1)).all(axis=1)


def _spans(flags: Any) -> list[tuple[int, int]]:
    """(first, last) of each run of true flags."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]
