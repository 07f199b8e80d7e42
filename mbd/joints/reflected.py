"""How the coordinates of a joint change their signs in a mirror.

A reflection σ across x, y or z takes a linear velocity v to σ v and an angular velocity ω, an axial vector, to −σ ω. A
joint whose partner on the other side moves by the mirrored twist for each of its velocities, or by the opposite of it,
exchanges coordinates with it up to signs.
"""

import re
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.equal import EQUAL_RTOL
from mbd.joints.base import Joint

ACROSS = {axis: np.where(np.arange(3) == "xyz".index(axis), -1.0, 1.0) for axis in "zyx"}
"""Reflections σ across axes, in the order in which they are tried: to the side first."""


class AsWritten:
    """A scope on which run-time parameters have the values that the words hold."""

    def parameter(self, owner: str, field: str, value: float) -> float:
        """The value."""
        return value


def mirrored_signs(joint: Joint, partner: Joint | None, sigma: Vector) -> tuple[Vector, Vector] | None:
    """Signs of a joint's coordinates and velocities in its partner; None where its motion is not mirrored there."""
    if partner is None or len(partner.labels) != len(joint.labels):
        return None
    mine, its = _twists(joint), _twists(partner)
    mirrored = np.hstack([-sigma * mine[:, :3], sigma * mine[:, 3:]])
    v = np.zeros(len(mine))
    for sign in (1.0, -1.0):
        v[np.all(np.abs(sign * its - mirrored) <= EQUAL_RTOL, axis=1)] = sign
    if not np.all(v):
        return None
    if joint.is_vector:
        return v, v
    first = joint.orientation
    if first is None:
        return None
    q = np.ones(len(joint.labels))
    q[: joint.adding], q[first + 1 : first + 4] = v[: joint.adding], v[-3:]
    return q, v


def _twists(joint: Joint) -> Matrix:
    """(angular, linear) velocity of the child for each velocity (n, 6), in axes of the child body, at rest."""
    scope: Any = AsWritten()
    turn = np.eye(3) if joint.child.rotation is None else np.array(joint.child.rotation)
    pairs: Sequence[Any] = joint.subspace(list(joint.defaults), scope)
    found = [np.concatenate([turn @ np.array(part, dtype=float) for part in pair]) for pair in pairs]
    return np.array(found).reshape(len(found), 6)


@lru_cache(maxsize=4096)  # gaits ask for the same names again and again
def exchanged(name: str, sides: tuple[str, str]) -> str:
    """A name with the words of the two sides exchanged.

    >>> exchanged("left hip.angle", ("left", "right"))
    'right hip.angle'
    """
    one, two = sides
    word = re.compile(rf"(?<![A-Za-z0-9])({re.escape(one)}|{re.escape(two)})(?![A-Za-z0-9])")
    return word.sub(lambda found: two if found.group() == one else one, name)


def signs_in_a_mirror(
    joints: Sequence[Joint], gravity: Sequence[float], sides: tuple[str, str] = ("left", "right")
) -> Mapping[str, float]:
    """Signs of coordinates and velocities by name, under the first reflection that every joint and gravity allow.

    Without any, or without names that have the words of the sides, there are none.
    """
    known = {joint.name: joint for joint in joints}
    if all(exchanged(name, sides) == name for name in known):
        return {}
    for sigma in ACROSS.values():
        if np.any(sigma * gravity != np.asarray(gravity, dtype=float)):
            continue
        signs = {name: mirrored_signs(joint, known.get(exchanged(name, sides)), sigma) for name, joint in known.items()}
        if all(each is not None for each in signs.values()):
            return {
                name: float(sign)
                for joint in joints
                for names, column in zip(
                    (joint.coordinate_names, joint.velocity_names), signs[joint.name] or (), strict=True
                )
                for name, sign in zip(names, column, strict=True)
            }
    return {}
