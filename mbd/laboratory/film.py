"""A run as a laboratory would record it: markers with errors, and a force plate under each foot."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.bodies.base import Frame
from mbd.bodies.values import is_number, number, shown
from mbd.errors import ModelError, nearest
from mbd.laboratory.recording import PlateRecord, Recording
from mbd.notes import doubt
from mbd.results.trajectory import Trajectory

MAX_FRAMES = 1e7
"""Frames of a film at most [-]."""


def film(
    run: Any, markers: Mapping[str, Any] | Sequence[Any], rate: float = 100.0, scatter: float = 0.0, seed: int = 0
) -> Recording:
    """What cameras and force plates record of a run, to try an evaluation on a motion whose truth is known.

    Each contact of a point with the ground has a plate of its own under it, which measures its normal force and its
    friction without errors. Plates lie in the level y = 0: where they carry other forces than those that act on the
    mechanism from outside, as on slopes and steps, `MbdWarning` says so.

    ``recording.save("walk.trc")`` writes the markers, ``recording.save("walk.mot")`` the plates,
    ``recording.save("walk.c3d")`` both.

    Parameters
    ----------
    run : of `mbd.simulate`
    markers : points by the laboratory's names: {'LKNE': 'left thigh.end', 'LTOE': left_foot.toe}, or points whose own
        names the markers get: ['left thigh.end', left_foot.toe]
    rate : frames a second [Hz]
    scatter : standard deviation of the errors of each coordinate of a marker [m]
    seed : of the errors, which are the same in each call

    Raises
    ------
    ModelError
        for points that the run lacks, and numbers that are not positive.

    Examples
    --------
    >>> import mbd
    >>> model = mbd.Model("ball")
    >>> ball = mbd.PointMass("ball", mass=1.0)
    >>> model.connect(mbd.Translation("air", model.ground.origin, ball.origin))
    >>> run = mbd.simulate(model, mbd.assemble(model), dt=1e-3, until=0.5)
    >>> film(run, {"BALL": ball.origin}, rate=10.0)["BALL"].shape
    (6, 3)
    """
    if not isinstance(run, Trajectory):
        raise ModelError(f"film: a run of mbd.simulate is expected, got {shown(run)[:80]}")
    for value, what, least in ((rate, "rate", 1e-9), (scatter, "scatter", 0.0)):
        if not is_number(value) or number(value, f"{what} of film") < least:
            raise ModelError(f"{what} of film is a number {'> 0' if least else '≥ 0'}, got {shown(value)[:80]}")
    if isinstance(markers, list | tuple):
        markers = {getattr(point, "full_name", str(point)): point for point in markers}
    if not isinstance(markers, Mapping) or not markers:
        raise ModelError(
            f"markers of film are points by name such as {{'LKNE': 'left thigh.end'}}, got {shown(markers)[:80]}"
        )
    if not isinstance(seed, int | np.integer) or isinstance(seed, bool) or seed < 0:
        raise ModelError(f"seed of film is a whole number ≥ 0, got {shown(seed)[:80]}")
    rate, scatter = float(rate), float(scatter)
    first, last = float(run.time[0]), float(run.time[-1])
    if (last - first) * rate > MAX_FRAMES:
        raise ModelError(
            f"rate of film: {rate:g} frames a second are more than {MAX_FRAMES:g} frames of this run; give a lower one"
        )
    time = first + np.arange(int((last - first) * rate * (1.0 + 1e-12)) + 1) / rate
    seen = run.at(np.minimum(time, last))
    rng = np.random.default_rng(seed)
    found = {}
    for name, point in markers.items():
        title = point.full_name if isinstance(point, Frame) else point
        if not isinstance(title, str) or f"{title}.x" not in run:
            points = [each.removesuffix(".x") for each in run.names if each.endswith(".x")]
            raise ModelError(f"markers of film: {nearest(str(title), points, 'point', 'The run has')}")
        found[name] = seen[title] + scatter * rng.standard_normal((len(time), 3))
    places = [contact for contact in run.facts.contacts if contact.place and contact.unit == "m"]
    plates = [_plate(run, seen, time, contact.name, contact.place) for contact in places]
    if plates:
        _doubt_other_forces(seen, plates)
    return Recording(time, found, plates=tuple(plates))


def _doubt_other_forces(seen: Any, plates: Sequence[PlateRecord]) -> None:
    """Warn where plates carry other forces, or moments about the origin, than those from outside."""
    for what, unit, carried in (
        ("force", "N", np.sum([plate.force for plate in plates], axis=0)),
        ("moment", "N m", np.sum([plate.moment for plate in plates], axis=0)),
    ):
        acts = np.asarray(seen[f"external {what}"])
        off = np.abs(carried - acts)
        if np.mean(off) > 0.01 * np.mean(np.abs(acts)):  # schemes err by less
            k, axis = np.unravel_index(int(np.argmax(off)), off.shape)
            has, should = (round(float(each[k, axis]), 9) + 0.0 for each in (carried, acts))
            doubt(
                f"film: at t = {seen.time[k]:.3g} s the plates carry a {what} of {has:.3g} {unit} along "
                f"{'xyz'[axis]}, and {should:.3g} {unit} acts from outside; plates lie in y = 0 and measure contacts "
                "alone: the ground slopes or lies higher, or something else holds the mechanism"
            )
            return


def _plate(run: Trajectory, seen: Any, time: Vector, contact: str, place: str) -> PlateRecord:
    """The plate under a contact, whose force acts where it touches the level y = 0."""
    along = "friction.forward" if f"{contact}.friction.forward" in run else "friction"
    parts: list[Any] = [
        np.nan_to_num(seen[f"{contact}.{part}"]) if f"{contact}.{part}" in run else np.zeros(len(time))
        for part in (along, "force", "friction.sideways")
    ]
    force: Matrix = np.column_stack(parts)
    return PlateRecord.at(f"{contact} plate", time, force, seen[place] * [1.0, 0.0, 1.0], height=0.0)
