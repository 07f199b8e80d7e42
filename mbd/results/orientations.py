"""Rotation vectors and Euler angles of a run that was read from a file, from the quaternions in it."""

import re
from collections.abc import Callable, Sequence

import numpy as np

from mbd.arrays import Vector
from mbd.joints.anatomy import Angle
from mbd.joints.euler import ANGLE_SUFFIXES, euler_angles, second_from_singular, sequence_of
from mbd.joints.quaternions import rotation_of, rotation_vector
from mbd.notes import doubt
from mbd.results.facts import Facts

VECTOR = re.compile(r"(.+)\.rotation_vector\.([xyz])")
ANGLES = re.compile(r"(.+)\.euler\.([xyz]{3})(?:\.([123]))?")
SINGULARITY_ATOL = 1e-4
"""Distance of the second angle from the singularity within which the other two are in doubt [rad]."""

ReadOff = tuple[tuple[str, ...], Callable[[Sequence[Vector]], Vector]]
"""Names of the parts of a quaternion, and what gives the result of their values."""


def read_off(name: str) -> ReadOff | None:
    """How a result is read off a quaternion; None for any other."""
    vector, angles = VECTOR.fullmatch(name), ANGLES.fullmatch(name)
    found = vector or angles
    if found is None or (angles and (sequence_of(angles[2]) is None or angles[3] is None)):
        return None
    parts = tuple(f"{found[1]}.orientation.{part}" for part in "wxyz")
    if vector:
        place = "xyz".index(vector[2])
        return parts, lambda q: np.asarray(rotation_vector(q)[place])
    assert angles is not None
    sequence, place = angles[2], ANGLE_SUFFIXES.index(angles[3])
    return parts, lambda q: np.asarray(euler_angles(rotation_of(q), sequence)[place])


def doubt_singular(name: str, values: Vector, facts: Facts | None, read: Callable[[str], Vector]) -> None:
    """Warn where Euler angles (…, 3), or an angle of a joint of the body, come near the singularity of their sequence.

    read : gives another result at the same times
    """
    named = facts.angles.get(name) if facts is not None else None
    if named is not None:
        _doubt_named(name, named, values, read)
    angles = ANGLES.fullmatch(name)
    if angles is None or angles[3] is not None or not values.size:
        return
    second = np.atleast_2d(values)[:, 1]
    off = second_from_singular(angles[2], second)
    worst = int(np.argmin(off))
    if off[worst] < SINGULARITY_ATOL:
        doubt(
            f"{name!r}: its second angle comes to {second[worst]:.6g} rad, within {SINGULARITY_ATOL:g} rad of the "
            f"singularity of {angles[2]!r}, where the first and the third turn about one axis and jump; "
            f"use another sequence, or the quaternion {angles[1] + '.orientation'!r}"
        )


def _doubt_named(name: str, angle: Angle, values: Vector, read: Callable[[str], Vector]) -> None:
    """Warn where an angle of a joint of the body is undetermined; its second one never is."""
    if not angle.second or not values.size:
        return
    other = f"{name.rpartition('.')[0]}.{angle.second}"
    second = np.atleast_1d(read(other))
    off = second_from_singular(angle.sequence, second)
    worst = int(np.argmin(off))
    if off[worst] < SINGULARITY_ATOL:
        doubt(
            f"{name!r} is undetermined where {other!r} comes to {second[worst]:.6g} rad, within "
            f"{SINGULARITY_ATOL:g} rad of the singularity of its sequence: "
            "the first and the third angle turn about one axis there and jump; "
            "the orientation of the joint tells more"
        )
