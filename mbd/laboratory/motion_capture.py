"""Files ``.c3d`` through ezc3d: points, analog channels, force plates, events."""

from pathlib import Path
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.errors import TrajectoryError
from mbd.laboratory.axes import axis_of
from mbd.laboratory.c3d_parameters import check_parameters
from mbd.laboratory.recording import PlateRecord, Recording
from mbd.laboratory.units import factor_of
from mbd.results.tables import library

DERIVED = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS")
"""Groups of points that are no places but results of a model."""


def read_c3d(path: Path) -> Recording:
    """A trial in the axes of the file, in SI units.

    Frame n is at (n − 1)/rate. Points with a negative residual are gaps. Points that are angles, moments or powers
    become channels 'name.x' in radians and in the units of the file. Plates give force and moment about the file's
    origin.

    Raises
    ------
    TrajectoryError
        for a file that ezc3d does not read.
    """
    ezc3d = library("ezc3d", "c3d", "reading .c3d")
    check_parameters(path)
    try:
        file = ezc3d.c3d(str(path), extract_forceplat_data=True)
    except Exception:  # of any kind: the reader is C++, with words of its own
        try:
            file = ezc3d.c3d(str(path), ignore_bad_formatting=True)
        except Exception as error:
            raise TrajectoryError(f"{path.name} is no .c3d that ezc3d reads: {str(error)[:200]}") from None
    notes: list[str] = []
    point, header = file["parameters"]["POINT"], file["header"]["points"]
    points = np.asarray(file["data"]["points"], dtype=float)
    labels = _labels(point, "LABELS", points.shape[1])
    rate = float(_first(point, "RATE", header["frame_rate"]) or 0.0)
    frames = points.shape[2]
    if not rate > 0.0 or not np.isfinite(rate):
        raise TrajectoryError(f"{path.name}: the rate of its points is {rate:g} Hz; a positive one is expected")
    time: Vector = np.asarray((np.arange(frames) + float(header["first_frame"])) / rate, dtype=np.float64)
    unit = str(_first(point, "UNITS", "mm")) or "mm"
    factor = factor_of(unit)
    if factor is None:
        raise TrajectoryError(f"{path.name}: the unit {unit!r} of its points is not known")
    residuals = np.asarray(file["data"]["meta_points"]["residuals"]).reshape(-1, points.shape[1], frames)[0]
    derived = {label: kind for kind in DERIVED for label in _labels(point, kind, 0)}
    markers, channels, units = dict[str, Matrix](), dict[str, Vector](), dict[str, str]()
    for k, label in enumerate(labels):
        track = points[:3, k, :].T.copy()
        track[(residuals[k] < 0.0) | ~np.isfinite(track).all(axis=1)] = np.nan
        kind = derived.get(label)
        if kind is None:
            markers[label] = factor * track
            continue
        own = "deg" if kind == "ANGLES" else str(_first(point, f"{kind[:-1]}_UNITS", ""))
        scale = factor_of(own) if kind == "ANGLES" else 1.0
        for axis, values in zip("xyz", track.T, strict=True):
            channels[f"{label}.{axis}"] = values * (scale or 1.0)
            units[f"{label}.{axis}"] = "rad" if kind == "ANGLES" else own
    if factor != 1.0:
        notes.append(f"units: {unit} in the file")
    if derived:
        notes.append(f"{len(derived)} points are angles, forces or moments of another program: channels, not markers")
    analog_time, analog = _analog(file, time, frames)
    plates = _plates(file, time, path, notes)
    events = _events(file["parameters"])
    return Recording(time, markers, channels, plates, analog_time, analog, units, events, path.stem, tuple(notes))


def _first(group: Any, name: str, otherwise: Any) -> Any:
    value = group[name]["value"] if name in group else []
    return value[0] if len(value) else otherwise


def _labels(group: Any, name: str, count: int) -> list[str]:
    """Names, those of further blocks too ('LABELS2'); numbers where there are fewer than points, or twice the same."""
    found: list[str] = []
    for block in (name, *(f"{name}{k}" for k in range(2, 10))):
        if block in group:
            found += [str(label).strip() for label in group[block]["value"]]
    if not count:
        return [label for label in found if label]
    found = [label or f"point {k + 1}" for k, label in enumerate(found[:count])]
    found += [f"point {k + 1}" for k in range(len(found), count)]
    seen: dict[str, int] = {}
    for k, label in enumerate(found):
        seen[label] = seen.get(label, 0) + 1
        if seen[label] > 1:
            found[k] = f"{label} ({seen[label]})"
    return found


def _analog(file: Any, time: Vector, frames: int) -> tuple[Vector | None, dict[str, Vector]]:
    values = np.asarray(file["data"]["analogs"], dtype=float)
    if values.ndim != 3 or not values.shape[1]:
        return None, {}
    labels = _labels(file["parameters"]["ANALOG"], "LABELS", values.shape[1])
    return _fine(time, frames, values.shape[2]), {name: values[0, k] for k, name in enumerate(labels)}


def _fine(time: Vector, frames: int, samples: int) -> Vector:
    """Times of analog samples, some for each frame."""
    step = (time[1] - time[0]) if frames > 1 else 0.0
    each = samples // frames if frames else 1
    return np.asarray(time[0] + np.arange(samples) * step / max(each, 1))


def _platforms(file: Any) -> Any:
    data = file["data"]  # which is no dictionary
    return data["platform"] if "platform" in data else ()  # noqa: SIM401


def _plates(file: Any, time: Vector, path: Path, notes: list[str]) -> tuple[PlateRecord, ...]:
    found = []
    for number, plate in enumerate(_platforms(file), 1):
        force = np.asarray(plate["force"], dtype=float).T
        moment = np.asarray(plate["moment"], dtype=float).T
        if not len(force):
            continue
        length = factor_of(str(plate["unit_position"])) or 1e-3
        force = np.nan_to_num(force, nan=0.0) * (factor_of(str(plate["unit_force"])) or 1.0)
        unit = str(plate["unit_moment"])
        moment = np.nan_to_num(moment, nan=0.0) * (factor_of(unit) or 1e-3)
        corners = np.asarray(plate["corners"], dtype=float).T * length
        middle = corners.mean(axis=0) if len(corners) else np.zeros(3)
        moment = moment + np.cross(middle, force)  # about the file's origin
        own = _fine(time, len(time), len(force))
        found.append(PlateRecord(f"plate {number}", own, force, moment, corners if len(corners) == 4 else None))
    return tuple(found)


def _events(parameters: Any) -> tuple[tuple[float, str], ...]:
    if "EVENT" not in parameters or "TIMES" not in parameters["EVENT"]:
        return ()
    group = parameters["EVENT"]
    times = np.atleast_2d(np.asarray(group["TIMES"]["value"], dtype=float))
    if times.shape[0] != 2:
        return ()
    labels, sides = _labels(group, "LABELS", times.shape[1]), _labels(group, "CONTEXTS", 0)
    found = []
    for k, label in enumerate(group["LABELS"]["value"] if "LABELS" in group else labels):
        if k < times.shape[1]:
            side = sides[k] if k < len(sides) else ""
            found.append((60.0 * float(times[0, k]) + float(times[1, k]), f"{side} {label}".strip()))
    return tuple(sorted(found))


def write_c3d(recording: Recording, target: Path, name: str) -> None:
    """A trial with z up in millimeters, numbers with the seven digits that the format has.

    Plates become six channels each, of a plate of type 2 whose origin is that of the ground.
    """
    ezc3d = library("ezc3d", "c3d", "writing .c3d")
    time = recording.time
    if len(time) < 2 or not np.allclose(np.diff(time), time[1] - time[0], rtol=1e-4):
        raise TrajectoryError(
            f"{name}: a .c3d has frames at equal distances in time, and two at least; take them from a spline first"
        )
    rate = 1.0 / float(np.diff(time).mean())
    back = np.array([axis_of("x", "x"), axis_of("-z", "z"), axis_of("y", "y")])  # (x, −z, y): z up
    file = ezc3d.c3d()
    names = list(recording.markers)
    points = np.ones((4, len(names), len(time)))
    for k, label in enumerate(names):
        points[:3, k, :] = 1e3 * (back @ recording.markers[label].T)
    file["header"]["points"]["first_frame"] = round(float(time[0]) * rate)
    parameters = file["parameters"]
    parameters["POINT"]["LABELS"]["value"] = tuple(names)
    parameters["POINT"]["UNITS"]["value"] = ("mm",)
    parameters["POINT"]["RATE"]["value"] = (rate,)
    residuals = np.where(np.isfinite(points[:3]).all(axis=0), 0.0, -1.0)
    file["data"]["points"] = points
    file["data"]["meta_points"]["residuals"] = residuals[np.newaxis]
    if recording.plates:
        _write_plates(file, recording, back, rate)
    if recording.events:
        file.add_parameter("EVENT", "USED", [len(recording.events)])
        file.add_parameter("EVENT", "CONTEXTS", [""] * len(recording.events))
        file.add_parameter("EVENT", "LABELS", [label for _, label in recording.events])
        file.add_parameter("EVENT", "TIMES", np.array([[0.0, t] for t, _ in recording.events]).T)
    try:
        file.write(str(target))
    except RuntimeError as error:
        raise TrajectoryError(f"'{name}' cannot be written: {error}") from None


def _write_plates(file: Any, recording: Recording, back: Matrix, rate: float) -> None:
    """Six analog channels for each plate: force and moment about the middle of its surface."""
    plates = recording.plates
    own = plates[0].time
    each = max(1, round((len(own) - 1) / (own[-1] - own[0]) / rate)) if len(own) > 1 else 1
    samples = len(recording.time) * each
    grid = recording.time[0] + np.arange(samples) / (rate * each)
    channels, labels, corners, origins = list[Vector](), list[str](), list[Matrix](), list[Vector]()
    for number, plate in enumerate(plates, 1):
        square = plate.corners
        if square is None:
            h = plate.height
            square = np.array([[0.3, h, 0.3], [0.3, h, -0.3], [-0.3, h, -0.3], [-0.3, h, 0.3]])
        middle = square.mean(axis=0)
        force = np.column_stack([np.interp(grid, plate.time, column) for column in plate.force.T])
        moment = np.column_stack([np.interp(grid, plate.time, column) for column in plate.moment.T])
        moment = moment - np.cross(middle, force)
        corners.append(1e3 * (back @ square.T))
        R = _plate_axes(corners[-1])
        channels += [*(R.T @ back @ force.T), *(1e3 * (R.T @ back @ moment.T))]
        labels += [f"{kind}{axis}{number}" for kind in "FM" for axis in "xyz"]
        origins.append(np.zeros(3))
    parameters, count = file["parameters"], len(labels)
    parameters["ANALOG"]["LABELS"]["value"] = tuple(labels)
    parameters["ANALOG"]["UNITS"]["value"] = tuple(["N"] * 3 + ["Nmm"] * 3) * len(plates)
    parameters["ANALOG"]["RATE"]["value"] = (rate * each,)
    parameters["ANALOG"]["SCALE"]["value"] = (1.0,) * count
    parameters["ANALOG"]["OFFSET"]["value"] = (0,) * count
    file["data"]["analogs"] = np.array(channels)[np.newaxis]
    group = parameters["FORCE_PLATFORM"]
    group["USED"]["value"] = (len(plates),)
    group["TYPE"]["value"] = (2,) * len(plates)
    group["CORNERS"]["value"] = np.stack(corners, axis=-1)
    group["ORIGIN"]["value"] = np.stack(origins, axis=-1)
    group["CHANNEL"]["value"] = np.arange(1, count + 1).reshape(len(plates), 6).T
    group["CAL_MATRIX"]["value"] = np.zeros((0,))


def _plate_axes(corners: Matrix) -> Matrix:
    """The axes of a plate by its corners (3, 4), as ezc3d has them: x from the second to the first, z off the plate."""
    x = corners[:, 0] - corners[:, 1]
    z = np.cross(x, corners[:, 0] - corners[:, 3])
    x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
    return np.column_stack([x, np.cross(z, x), z])
