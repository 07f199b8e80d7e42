"""Orientations as users give them: a quaternion, a rotation of scipy, a matrix, an axis with an angle, Euler angles."""

import math
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.bodies.values import Vector3, is_number, number, shown, unit_vector
from mbd.equal import NOMINAL_RTOL
from mbd.errors import ModelError
from mbd.joints.euler import SEQUENCES, from_euler, second_from_singular, sequence_of
from mbd.joints.quaternions import normalised, of_rotation

SMALL_TURN = math.cos(math.radians(15.0))
"""Scalar of the quaternion of a turn by 30° [-]."""
ACCEPTED_FORMS = (
    "give a unit quaternion (w, x, y, z), scalar first, a scipy Rotation, a 3 × 3 rotation matrix, an axis with an "
    "angle such as ((0, 0, 1), 0.3), or Euler angles such as ('zxy', (0.1, 0.2, 0.3)), in radians"
)


def is_orientation(value: Any) -> bool:
    """Whether a value is more than one number, as an orientation or a vector is."""
    return hasattr(value, "as_quat") or (isinstance(value, list | tuple | np.ndarray) and np.ndim(_lengths(value)) > 0)


def _lengths(value: Any) -> Any:
    return [0] * len(value) if isinstance(value, list | tuple) else value


def quaternion_of(value: Any, what: str) -> tuple[float, ...]:
    """The unit quaternion (w, x, y, z) of an orientation.

    Raises
    ------
    ModelError
        for what is none, among it a quaternion whose length is off 1 by more than 1e-6 and a matrix that reflects.
    """
    if hasattr(value, "as_quat"):
        found = np.asarray(value.as_quat(), dtype=float)
        if found.shape != (4,):
            raise ModelError(f"{what} must be one orientation; the Rotation holds {len(found)}")
        return tuple(map(float, found[[3, 0, 1, 2]]))
    if isinstance(value, list | tuple) and len(value) == 2:
        return _of_pair(value, what)
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        array = np.zeros(0)
    if array.shape == (3, 3) and np.isfinite(array).all():
        return _of_matrix(array, what)
    if array.shape != (4,) or not np.isfinite(array).all():
        raise ModelError(f"{what} must be an orientation, not {shown(value)}; {ACCEPTED_FORMS}")
    length = float(np.linalg.norm(array))
    if not abs(length - 1.0) <= NOMINAL_RTOL:
        near = f"; the nearest is ({', '.join(f'{x:.9g}' for x in array / length)})" if length > 0.0 else ""
        raise ModelError(f"{what} must be a quaternion of length 1, got {shown(value)} of length {length:.9g}{near}")
    return tuple(map(float, normalised(array.tolist())))


def _of_pair(value: Any, what: str) -> tuple[float, ...]:
    """Of ('zxy', three angles), or of (axis, angle)."""
    head, rest = value
    if isinstance(head, str):
        sequence = sequence_of(head)
        if sequence is None:
            raise ModelError(f"{what}: {head!r} is no sequence of Euler angles; there are {', '.join(SEQUENCES)}")
        if not isinstance(rest, list | tuple | np.ndarray) or len(rest) != 3:
            raise ModelError(f"{what}: three angles about {head!r} are expected, got {shown(rest)}")
        angles = [number(angle, f"{what}, angle about {axis!r}") for axis, angle in zip(sequence, rest, strict=True)]
        return tuple(from_euler(sequence, angles))
    if not is_number(rest):
        raise ModelError(f"{what} must be an orientation, not {shown(value)}; {ACCEPTED_FORMS}")
    axis: Vector3 = unit_vector(head, f"axis of {what}")
    angle = number(rest, f"angle of {what}")
    return (math.cos(0.5 * angle), *(math.sin(0.5 * angle) * part for part in axis))


def _of_matrix(R: Vector, what: str) -> tuple[float, ...]:
    """Of a rotation matrix, whose columns are the child's axes in the parent's."""
    off = float(np.max(np.abs(R @ R.T - np.eye(3))))
    if off > NOMINAL_RTOL:
        raise ModelError(
            f"{what} must be a rotation matrix, of columns of length 1 across each other; R Rᵀ is off 1 by {off:.3g}"
        )
    if np.linalg.det(R) < 0.0:
        raise ModelError(f"{what} must be a rotation matrix; this one reflects (its determinant is −1): turn one axis")
    rows: Any = R.tolist()
    return tuple(map(float, normalised(of_rotation(rows))))


def _angles_in(value: Any) -> list[float]:
    """The angles of an axis with an angle, or of a sequence; none of any other orientation."""
    if not (isinstance(value, list | tuple) and len(value) == 2):
        return []
    return [float(value[1])] if is_number(value[1]) else [float(angle) for angle in value[1]]


def _scalar_last(value: Any, what: str) -> str | None:
    """A sentence on four numbers that are nearly half a turn about z, and a small turn if their scalar is the last."""
    if hasattr(value, "as_quat") or len(value) != 4:
        return None
    w, x, y, z = map(float, value)
    if abs(z) < SMALL_TURN:
        return None
    turn = math.degrees(2.0 * math.acos(min(1.0, abs(w))))
    return (
        f"{what}: ({w:.4g}, {x:.4g}, {y:.4g}, {z:.4g}) turns by {turn:.0f}°, nearly half a turn about z; the order is "
        f"(w, x, y, z), scalar first. If the scalar is the last number, as in scipy and ROS, give "
        f"({z:.4g}, {w:.4g}, {x:.4g}, {y:.4g}); half a turn about z without this warning is ((0, 0, 1), math.pi)"
    )


def orientation_doubt(value: Any, what: str) -> str | None:
    """A sentence on angles beyond a turn, quaternions in another order, and singular Euler angles."""
    if text := _scalar_last(value, what):
        return text
    beyond = max(map(abs, _angles_in(value)), default=0.0)
    if beyond > 2.0 * math.pi:
        return (
            f"{what}: an angle of {beyond:g} rad is more than a turn; angles are in radians, such as "
            "math.radians(30), and an orientation keeps no turns"
        )
    if not (isinstance(value, list | tuple) and len(value) == 2 and isinstance(value[0], str)):
        return None
    sequence = sequence_of(value[0])
    if sequence is None or second_from_singular(sequence, float(value[1][1])) > NOMINAL_RTOL:
        return None
    return (
        f"{what}: the second angle of {value[0]!r} is {float(value[1][1]):.6g} rad, the singularity of that sequence, "
        "where the first and the third turn about one axis; the orientation is the one that was given, but of the "
        "angles that are read off it the third is 0"
    )
