"""A person scaled to a patient: lengths from a static trial or by hand, masses by the tables."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from mbd.bodies.base import Body
from mbd.bodies.link import Link
from mbd.bodies.values import number, shown
from mbd.errors import ModelError, nearest
from mbd.laboratory.recording import Recording
from mbd.notes import doubt, note
from mbd.parts.whole_body.human import Human
from mbd.parts.whole_body.segments import Segment

ENDS = {
    "pelvis": ("left hip", "right hip"), "torso": ("origin", "neck"), "head": ("origin", "top"),
    "left foot": ("heel", "toe"), "right foot": ("heel", "toe"),
}  # fmt: skip
"""Points whose distance is the length of a segment that is no link."""
PLAUSIBLE = (0.7, 1.4)
"""Factors of length outside of which a measured length is in doubt [-]."""
PLAUSIBLE_MASS = (0.1, 5.0)
"""Factors of the whole mass outside of which a mass is in doubt: children to adults [-]."""


def scale(
    person: Human,
    lengths: Mapping[str, Any],
    recording: Recording | None = None,
    mass: float | None = None,
) -> Human:
    """A person whose segments have measured lengths, and the mass of the patient.

    A segment of length factor b and mass factor a has places ``b r``, mass ``a m`` and inertia ``a b² I``. The mass is
    shared as in the table of the person (`mbd.human`). A segment without a length of its own takes the factor of the
    same segment of the other side, else the mean of all factors given; the log says which. A body of one's own (a
    prosthesis) stays as it is.

    Parameters
    ----------
    person : from `mbd.human`
    lengths : by segment from joint to joint [m]: {'left thigh': 0.43}; or two markers at these joints,
        {'left thigh': ('LHIP', 'LKNE')}, whose median distance over the recording is taken. The pelvis is measured from
        hip to hip, a foot from heel to toe, torso and head from their lower joint to the upper end
    recording : static trial, where lengths are given by markers
    mass : of the whole person [kg]; None: that of `person`

    Raises
    ------
    ModelError
        for segments that the person lacks, markers that the recording lacks, and lengths that are not positive.

    Examples
    --------
    >>> import mbd
    >>> patient = mbd.scale(mbd.human(75.0, 1.80), {"left shank": 0.45}, mass=68.0)
    >>> print(f"{patient.bodies['right shank'].length:.2f} m, {patient.mass:.1f} kg")
    0.45 m, 68.0 kg
    """
    if not isinstance(person, Human):
        raise ModelError(f"scale: a person such as mbd.human(75.0, 1.8) is expected, got {shown(person)[:80]}")
    if not isinstance(lengths, Mapping) or not lengths:
        raise ModelError(f"lengths must map segments to lengths [m], {{'left thigh': 0.43}}, got {shown(lengths)[:80]}")
    total = person.mass if mass is None else number(mass, "mass of scale")
    if not total > 0.0:
        raise ModelError(f"mass of scale must be positive [kg], got {mass!r}")
    segments = {each.name.removeprefix(person.prefix): each for each in person.segments}
    factors: dict[str, float] = {}
    for name, given in lengths.items():
        if name not in segments:
            raise ModelError(f"lengths: {nearest(str(name), segments, 'segment', 'The person has')}")
        if not isinstance(segments[name], Segment):
            raise ModelError(f"lengths: {name!r} is a body of your own; make it of the length that you want")
        own = _length(name, person.bodies[name])
        factors[name] = _measured(name, given, recording) / own
        if not PLAUSIBLE[0] <= factors[name] <= PLAUSIBLE[1]:
            doubt(f"scale: {name!r} would be {factors[name]:.2f} times as long as before; are the lengths in meters?")
    doubt(*_bent_knees(lengths, recording))
    mean = float(np.mean(list(factors.values())))
    found, kept, proportion = person, list[str](), list[str]()
    weights = {name: each.solid.mass for name, each in segments.items() if isinstance(each, Segment)}
    foreign = person.mass - sum(weights.values())
    if total <= foreign:
        raise ModelError(f"mass of scale: {total:g} kg are less than the bodies of your own have, {foreign:g} kg")
    share = (total - foreign) / sum(weights.values())
    if not PLAUSIBLE_MASS[0] <= share <= PLAUSIBLE_MASS[1]:
        doubt(f"scale: {total:g} kg are {share:.3g} times the mass of before; is the mass in kilograms?")
    for name, segment in segments.items():
        if not isinstance(segment, Segment):
            kept.append(name)
            continue
        other = _other_side(name)
        factor = factors.get(name, factors.get(other, mean))
        if name not in factors:
            proportion.append(f"{name!r} as {other!r}" if other in factors else f"{name!r} by the mean {mean:.3f}")
        found = found.scaled(name, mass=share, length=factor)
    note(f"scale: measured {', '.join(f'{name!r} {factor:.3f}' for name, factor in factors.items())}")
    if proportion:
        note(f"scale: in proportion {', '.join(proportion)}")
    if kept:
        note(f"scale: kept as they are {', '.join(map(repr, kept))}")
    return found


def _bent_knees(lengths: Mapping[str, Any], recording: Recording | None) -> list[str]:
    """Sentences on knees that are bent in the static trial, where markers tell."""
    found = []
    for side in ("left", "right"):
        pairs = [lengths.get(f"{side} {part}") for part in ("thigh", "shank")]
        if recording is None or not all(isinstance(pair, tuple | list) and len(pair) == 2 for pair in pairs):
            continue
        (a, b), (c, d) = (tuple(recording.markers[name] for name in pair) for pair in pairs if pair is not None)
        thigh, shank = np.nanmedian(b - a, axis=0), np.nanmedian(d - c, axis=0)
        cosine = thigh @ shank / (np.linalg.norm(thigh) * np.linalg.norm(shank))
        bend = np.degrees(np.arccos(min(float(cosine), 1.0)))
        if bend > 12.0:  # a knee counts as bent from 12° on
            found.append(
                f"scale: the {side} knee is bent by {bend:.0f}° in the static trial; lengths between markers hold all "
                "the same, but marker places that are taken from this posture do not: let the patient stand straight"
            )
    return found


def _other_side(name: str) -> str:
    side, _, rest = name.partition(" ")
    return f"{'right' if side == 'left' else 'left'} {rest}" if rest and side in ("left", "right") else ""


def _length(name: str, body: Body) -> float:
    """From joint to joint."""
    if isinstance(body, Link):
        return float(body.length)
    points = {frame.name: frame.offset for frame in body.points.values()} | {"origin": (0.0, 0.0, 0.0)}
    a, b = (points[end] for end in ENDS[name])
    return math.dist(a, b)


def _measured(name: str, given: Any, recording: Recording | None) -> float:
    """A length as a number or as the distance of two markers."""
    if isinstance(given, tuple | list) and len(given) == 2 and all(isinstance(each, str) for each in given):
        if not isinstance(recording, Recording):
            raise ModelError(f"lengths: {name!r} is given by markers; give the recording of the static trial too")
        for marker in given:
            if marker not in recording.markers:
                raise ModelError(f"lengths: {nearest(marker, recording.markers, 'marker', 'The recording has')}")
        apart = np.linalg.norm(recording.markers[given[0]] - recording.markers[given[1]], axis=1)
        apart = apart[np.isfinite(apart)]
        if not len(apart):
            raise ModelError(f"lengths: {given[0]!r} and {given[1]!r} of {name!r} are never seen together")
        if np.std(apart) > 0.02:  # two markers of which that [m] is scatter do not lie on one rigid body
            doubt(
                f"scale: the distance of {given[0]!r} and {given[1]!r} varies by {1e3 * np.std(apart):.0f} mm; do both "
                f"lie on the {name}?"
            )
        length = float(np.median(apart))
    else:
        length = number(given, f"length of {name!r}")
    if not length > 0.0:
        raise ModelError(f"lengths: that of {name!r} must be positive [m], got {length:g}")
    return length
