"""Recordings from files of other programs."""

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from mbd.errors import TrajectoryError
from mbd.forces.samples import in_degrees
from mbd.laboratory.axes import turn_of, turn_words
from mbd.laboratory.comma_separated import read_csv
from mbd.laboratory.motion_capture import read_c3d
from mbd.laboratory.recording import PlateRecord, Recording
from mbd.laboratory.storage import read_storage
from mbd.laboratory.trc import read_trc
from mbd.notes import doubt
from mbd.results.archive import file_to_read

READERS: dict[str, tuple[Callable[[Path], Recording], str]] = {
    ".c3d": (read_c3d, "z"), ".trc": (read_trc, "y"), ".mot": (read_storage, "y"), ".sto": (read_storage, "y"),
    ".csv": (read_csv, "y"),
}  # fmt: skip
"""Readers by the end of the name, and the axis that usually points up in such files."""
ANGLE = re.compile(
    r"(angle|flexion|extension|rotation|adduction|abduction|tilt|list|obliquity)(_[lr])?$", re.IGNORECASE
)
"""Channels that are angles by their names."""
JOINT = re.compile("hip|knee|ankle|subtalar|shoulder|elbow|wrist|lumbar|trunk", re.IGNORECASE)
"""Joints of a body, none of which turns by more than a turn."""


def read(path: str | Path, up: str | None = None, forward: str | None = None) -> Recording:
    """What cameras, force plates and other instruments saw, from ``.c3d``, ``.trc``, ``.mot``, ``.sto`` or ``.csv``.

    Lengths become meters, angles radians, forces newtons. Axes become x forward, y up, z to the right. Text files are
    taken to have these axes unless `up` or `forward` says otherwise; in ``.c3d`` z is up unless it is given. What is
    not given of the two: forward is the horizontal axis along which the markers move farthest, if that is half a meter,
    else the file's x. `Recording.notes` tells all that was done.

    Parameters
    ----------
    path : of the file; ``.c3d`` needs ``pip install 'mbd[c3d]'``
    up, forward : axes of the file that point there: 'x', '-x', 'y', …

    Raises
    ------
    TrajectoryError
        for a file that is none of these or is damaged, with the line.
    ModelError
        for an axis that is none.
    """
    target = file_to_read(path)
    found = READERS.get(target.suffix.lower())
    if found is None:
        raise TrajectoryError(f"a recording ends in {', '.join(READERS)}; got {str(path)!r}")
    if not target.is_file():
        raise TrajectoryError(f"there is no file '{target}'")
    reader, usual = found
    recording = reader(target)
    _doubt_units(recording)
    if usual == "y" and up is None and forward is None:
        return recording
    return _turned(recording, up, forward, usual)


def _turned(recording: Recording, up: str | None, forward: str | None, usual: str) -> Recording:
    """The recording in x forward, y up, z right."""
    turn, why = turn_of(recording.markers, up, forward, usual)
    markers = {name: turn_words(turn, track) for name, track in recording.markers.items()}
    plates = tuple(_plate(plate, turn) for plate in recording.plates)
    return replace(recording, markers=markers, plates=plates, notes=(*recording.notes, why))


def _plate(plate: PlateRecord, turn: np.ndarray) -> PlateRecord:
    """A plate in the turned axes, pushing up."""
    force, moment = turn_words(turn, plate.force), turn_words(turn, plate.moment)
    corners = None if plate.corners is None else turn_words(turn, plate.corners)
    height = plate.height if corners is None else float(corners[:, 1].mean())
    if force[:, 1].sum() < 0.0:  # the force of the foot on the plate
        force, moment = -force, -moment
    return replace(plate, force=force + 0.0, moment=moment + 0.0, corners=corners, height=height)


def _doubt_units(recording: Recording) -> None:
    for name, values in recording.channels.items():
        known = values[np.isfinite(values)]
        if not ANGLE.search(name) or not len(known):
            continue
        swing, how = in_degrees(known), "swings to and fro"
        if not swing and JOINT.search(name) and np.ptp(known) > math.tau:  # half of a swing, or a part of it
            swing, how = float(np.ptp(known)), "turns"
        if swing:
            doubt(
                f"{recording.name}: {name!r} {how} by {swing:.3g} rad, {swing / math.tau:.1f} turns; it is "
                "probably in degrees: say so by inDegrees=yes in the header, or by 'knee_angle [deg]' above the column"
            )
            break
    for name, track in recording.markers.items():
        seen = track[np.isfinite(track).all(axis=1)]
        if len(seen) and np.ptp(seen, axis=0).max() > 50.0:  # no laboratory is so large [m]
            doubt(
                f"{recording.name}: marker {name!r} moves over {np.ptp(seen, axis=0).max():.3g} m; the units of the "
                "file are probably others than its header says"
            )
            return
