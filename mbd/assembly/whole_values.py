"""Orientations and vectors that a start names as a whole, spelled out as the numbers of their parts."""

import re
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from mbd.bodies.values import shown
from mbd.errors import ModelError, nearest
from mbd.joints.base import Joint
from mbd.joints.orientations import is_orientation, orientation_doubt, quaternion_of

QUATERNION_PARTS = "wxyz"
EULER = re.compile(r"(.+)\.euler\.([xyz]{3})")


def oriented(model: Any) -> dict[str, Joint]:
    """The joints of a model with a quaternion, by the name of their orientation."""
    joints: Iterable[Joint] = getattr(model, "joints", ())
    return {f"{joint.name}.orientation": joint for joint in joints if joint.orientation is not None}


def spelled_out(model: Any, values: Any, what: str) -> tuple[Any, list[str], list[str]]:
    """Values by the names of single numbers, what is wrong with them, and what is in doubt.

    'ball.orientation' is any form of `quaternion_of`, and any other name of three numbers a vector:
    {'ball.angular_velocity': (0, 0, 2)} is {'ball.angular_velocity.x': 0, …}.
    """
    if not isinstance(values, Mapping):
        return values, [], []
    known, faults, doubts = oriented(model), list[str](), list[str]()
    found: dict[Any, Any] = {}
    for name, value in values.items():
        parts = {name: value}
        if name in known and what == "position":
            try:
                quaternion = quaternion_of(value, f"position: {name!r}")
            except ModelError as error:
                faults += error.faults
                continue
            sentence = orientation_doubt(value, f"position: {name!r}")
            doubts += [] if sentence is None else [sentence]
            parts = {f"{name}.{part}": number for part, number in zip(QUATERNION_PARTS, quaternion, strict=True)}
        elif isinstance(name, str) and is_orientation(value) and len(np.atleast_1d(np.asarray(value, object))) == 3:
            angles = EULER.fullmatch(name)
            if angles is not None and f"{angles[1]}.orientation" in known:
                instead = f"{{'{angles[1]}.orientation': ('{angles[2]}', (first, second, third))}}"
                if what == "velocity":
                    instead = f"{{'{angles[1]}.angular_velocity': (x, y, z)}}, or the rate of one angle, '{name}.1'"
                faults.append(f"{what}: {name!r} is read off the orientation; give {instead}")
                continue
            parts = {f"{name}.{axis}": number for axis, number in zip("xyz", value, strict=True)}
        elif isinstance(name, str) and is_orientation(value):
            faults.append(_no_whole(name, value, what, known))
            continue
        faults += [f"{what}: {part!r} is given twice, by {name!r} too" for part in parts if part in found]
        found |= parts
    return found, faults, doubts


def as_given(names: Iterable[str]) -> list[str]:
    """Names, of the three parts of a vector its own: 'ball.omega' of 'ball.omega.x', '.y', '.z'."""
    several = list(names)
    stems = {name[:-2] for name in several if all(f"{name[:-2]}.{axis}" in several for axis in "xyz")}
    return list(dict.fromkeys(name[:-2] if name[:-2] in stems else name for name in several))


def _no_whole(name: str, value: Any, what: str, known: Mapping[str, Joint]) -> str:
    """Why a name cannot have several numbers that are no vector."""
    many = int(np.size(np.asarray(value, dtype=object))) if not hasattr(value, "as_quat") else 4
    joint, _, last = name.rpartition(".")
    if last == "orientation" and what == "velocity":
        return f"velocity: {name!r} is a place; its rate is '{joint}.angular_velocity', three numbers [rad/s]"
    if last == "orientation" or many == 4:
        if not known:
            return (
                f"position: no orientation named {name!r}; the model has no joint that turns freely (Spherical, Free)"
            )
        return "position: " + nearest(name, known, "orientation")
    return f"{what}: {name!r} takes one finite number, or three as a vector, not {many}: {shown(value)}"


def three_of_four(model: Any, values: Mapping[str, float]) -> dict[str, float]:
    """Without the largest part of each quaternion of a joint that is cut, and with the sign that is read off it.

    The other three hold the orientation; four would be one row too many.
    """
    found = dict(values)
    for name in oriented(model):
        own = [f"{name}.{part}" for part in QUATERNION_PARTS]
        if all(part in values for part in own):
            q = [values[part] for part in own]
            largest = next(k for k in range(4) if 4.0 * q[k] ** 2 > 0.9)  # the divisor of `of_rotation`
            sign = -1.0 if q[largest] < 0.0 else 1.0
            found |= {part: sign * number for part, number in zip(own, q, strict=True)}
            del found[own[largest]]
    return found
