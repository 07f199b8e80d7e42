"""Which foot stood on which plate, by where and when."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.bodies.base import Body, Frame
from mbd.bodies.values import number, shown
from mbd.errors import ModelError
from mbd.laboratory.force_plate import ForcePlate
from mbd.laboratory.recording import MIN_PLATE_LOAD, PlateRecord, Recording
from mbd.notes import doubt, note

MIN_DISTANCE_RATIO = 1.25
"""Times as far as the nearest foot from the center of pressure that another foot is, to have no part in the load."""


def assign_plates(
    motion: Any, recording: Recording, feet: Sequence[Frame | Body], threshold: float = 20.0
) -> tuple[ForcePlate, ...]:
    """Force plates with the feet that stood on them.

    Each span in which a plate is loaded belongs to the foot whose point is nearest to the center of pressure, on
    average over the span. What was found is logged, as ``plate 1 from 0.21 to 0.93 s: left foot``. Spans in which two
    feet are as near, or none is, are doubted by a warning: a plate under two feet at once cannot be told apart.

    Parameters
    ----------
    motion : the result of `mbd.inverse_kinematics`, or a run
    recording : with the plates
    feet : each foot, or a point near its middle
    threshold : vertical force below which a plate counts as unloaded [N]

    Raises
    ------
    ModelError
        where the recording has no plate, or no foot is given.
    """
    number(threshold, "threshold of assign_plates")
    if not hasattr(motion, "time") or not hasattr(motion, "names"):
        raise ModelError(
            f"assign_plates: motion is what mbd.inverse_kinematics gives, or a run; got {shown(motion)[:80]}"
        )
    if not isinstance(recording, Recording) or not recording.plates:
        raise ModelError(f"assign_plates: a recording with force plates is expected, got {shown(recording)[:80]}")
    if isinstance(feet, list | tuple):
        feet = [foot.center if isinstance(foot, Body) else foot for foot in feet]
    if not isinstance(feet, list) or not feet or not all(isinstance(foot, Frame) for foot in feet):
        raise ModelError(f"assign_plates: feet are points such as [left.origin, right.origin], got {shown(feet)[:80]}")
    found: list[ForcePlate] = []
    unloaded: list[str] = []
    for plate in recording.plates:
        spans = _loaded(plate, threshold)
        broken = np.isnan(plate.force.sum(axis=1))
        if broken.any():
            doubt(
                f"{plate.name} has no values in {broken.sum()} of {len(broken)} samples, the first at "
                f"{plate.time[int(np.argmax(broken))]:.3g} s; it counts as unloaded there"
            )
        if not spans:
            most = float(np.nanmax(plate.force[:, 1], initial=0.0))
            unloaded.append(f"{plate.name} is never loaded above {threshold:g} N (largest {most:.3g} N); left out")
        owners: dict[int, list[tuple[float, float]]] = {}
        for first, last in spans:
            distance = _distances(motion, plate, feet, first, last)
            mean = np.nanmean(distance, axis=1)
            best = int(np.argmin(mean))
            title = f"{plate.name} from {first:.3g} to {last:.3g} s"
            if mean[best] > 0.35:  # farther [m] from a point of the foot no center of pressure lies, along the ground
                doubt(f"{title}: no foot is nearer than {mean[best]:.2g} m to the center of pressure; left out")
                continue
            near = np.where(np.isnan(distance), np.inf, distance)
            others = np.delete(near, best, axis=0).min(axis=0, initial=np.inf)
            other = float(np.mean(others <= MIN_DISTANCE_RATIO * near[best]))
            if other > 0.2:
                doubt(
                    f"{title}: another foot than {feet[best].body.name!r} is as near during {100 * other:.0f} % of it; "
                    "two feet on one plate cannot be told apart, and all of it is given to the one"
                )
            note(f"{title}: {feet[best].body.name!r}")
            owners.setdefault(best, []).append((first, last))
        for best, own in owners.items():
            name = f"{plate.name} {feet[best].body.name}"
            found.append(ForcePlate(name, feet[best], plate, during=own, threshold=threshold))
    if len(unloaded) == len(recording.plates):
        doubt(*unloaded, "no plate is loaded; forces are in newtons, and push the foot up")
    for sentence in unloaded:
        note(sentence)
    return tuple(found)


def _loaded(plate: PlateRecord, threshold: float) -> list[tuple[float, float]]:
    acts = np.concatenate([[0], (plate.force[:, 1] > max(threshold, MIN_PLATE_LOAD * 0.1)).astype(int), [0]])
    edges = np.flatnonzero(np.diff(acts))
    spans = [(float(plate.time[a]), float(plate.time[b - 1])) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return [(a, b) for a, b in spans if b - a >= 0.03]  # shorter loads [s] are noise


def _distances(
    motion: Any, plate: PlateRecord, feet: Sequence[Frame], first: float, last: float
) -> NDArray[np.float64]:
    """Distances along the ground (feet, frames) between points of feet and the center of pressure within a span."""
    time = np.asarray(motion.time)
    inside = (time >= first) & (time <= last)
    if not inside.any():
        inside[int(np.argmin(np.abs(time - 0.5 * (first + last))))] = True
    center = plate.center()
    seen = np.isfinite(center).all(axis=1)
    x, z = (np.interp(time[inside], plate.time[seen], center[seen, k]) for k in (0, 2))
    places = [motion[foot.full_name][inside] for foot in feet]
    return np.array([np.hypot(place[:, 0] - x, place[:, 2] - z) for place in places])
