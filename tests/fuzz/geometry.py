"""Placements in space and their rates: stacks of 4×4 matrices H, Ḣ, Ḧ along a motion, multiplied by Leibniz's rule.

Written apart from the equations of the library, which it judges: no code is shared.
"""

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array: TypeAlias = NDArray[np.float64]


class Signal(NamedTuple):
    """A coordinate along a motion, with its first and second derivative in time, (n,) each."""

    value: Array
    rate: Array
    second: Array


class Attitude(NamedTuple):
    """An orientation along a motion: quaternions (w, x, y, z) (n, 4), ω and ω̇ in the axes of what turns (n, 3)."""

    quaternion: Array
    angular: Array
    angular_second: Array


class Moving(NamedTuple):
    """A placement ``H = [[R, p], [0, 1]]`` along a motion, (n, 4, 4), with Ḣ and Ḧ."""

    H: Array
    first: Array
    second: Array


class Twist(NamedTuple):
    """Angular velocity and acceleration ω, ω̇, and velocity and acceleration of the origin, ground axes, (n, 3) each."""

    angular: Array
    angular_second: Array
    linear: Array
    linear_second: Array


def cross(a: Array, b: Array) -> Array:
    """a × b, row by row."""
    return np.asarray(np.cross(a, b))


def matrix_of(rotation: ArrayLike | None, place: ArrayLike) -> Array:
    """The constant placement (4, 4) of a frame with these axes (its columns) at this place."""
    H = np.eye(4)
    if rotation is not None:
        H[:3, :3] = rotation
    H[:3, 3] = place
    return H


def fixed(H: Array, n: int) -> Moving:
    """A placement that does not change."""
    nothing = np.zeros((n, 4, 4))
    return Moving(np.broadcast_to(H, (n, 4, 4)), nothing, nothing)


def product(a: Moving, b: Moving) -> Moving:
    """``AB``, ``ȦB + AḂ``, ``ÄB + 2ȦḂ + AB̈``."""
    H = a.H @ b.H
    return Moving(H, a.first @ b.H + a.H @ b.first, a.second @ b.H + 2.0 * a.first @ b.first + a.H @ b.second)


def inverse(a: Moving) -> Moving:
    """``A⁻¹``, and from ``A A⁻¹ = 1`` its derivatives."""
    R, p = a.H[:, :3, :3], a.H[:, :3, 3:]
    H = np.zeros_like(a.H)
    back = np.swapaxes(R, 1, 2)
    H[:, :3, :3], H[:, :3, 3:], H[:, 3, 3] = back, -back @ p, 1.0
    first = -H @ a.first @ H
    return Moving(H, first, -H @ (a.second @ H + 2.0 * a.first @ first))


def turn(axis: ArrayLike, q: Signal) -> Moving:
    """A right-handed rotation about a unit axis: ``Ḣ = q̇ K H``, ``Ḧ = (q̈ K + q̇² K²) H``."""
    x, y, z = np.asarray(axis, dtype=float)
    K = np.zeros((4, 4))
    K[:3, :3] = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
    K2 = K @ K
    c, s = np.cos(q.value)[:, None, None], np.sin(q.value)[:, None, None]
    H = np.eye(4) + s * K + (1.0 - c) * K2
    rate, second = q.rate[:, None, None], q.second[:, None, None]
    return Moving(H, rate * (K @ H), second * (K @ H) + rate**2 * (K2 @ H))


def shift(axis: ArrayLike, q: Signal) -> Moving:
    """A displacement along a unit axis."""
    found = []
    for values in q:
        H = np.zeros((len(values), 4, 4))
        H[:, :3, 3] = values[:, None] * np.asarray(axis, dtype=float)
        found.append(H)
    return Moving(found[0] + np.eye(4), found[1], found[2])


def of_quaternion(quaternion: Array) -> Array:
    """Rotation matrices (n, 3, 3) of quaternions (w, x, y, z), ``R = 1 + 2 w [u]× + 2 [u]×²`` over their length."""
    w, u = quaternion[:, :1], quaternion[:, 1:]
    size = np.linalg.norm(quaternion, axis=1)[:, None, None]
    across = hat(u)
    return np.asarray(np.eye(3) + (2.0 * w[:, :, None] * across + 2.0 * across @ across) / size**2)


def hat(u: Array) -> Array:
    """The matrices [u]× with ``[u]× v = u × v``, (n, 3, 3)."""
    x, y, z = u.T
    o = np.zeros_like(x)
    return np.stack([np.stack([o, -z, y], 1), np.stack([z, o, -x], 1), np.stack([-y, x, o], 1)], axis=1)


def ball(turning: Attitude) -> Moving:
    """A rotation: ``Ṙ = R [ω]×``, ``R̈ = R ([ω̇]× + [ω]×²)``, ω in the axes of what turns."""
    n = len(turning.quaternion)
    R, spin = of_quaternion(turning.quaternion), hat(turning.angular)
    H, first, second = np.tile(np.eye(4), (n, 1, 1)), np.zeros((n, 4, 4)), np.zeros((n, 4, 4))
    H[:, :3, :3] = R
    first[:, :3, :3] = R @ spin
    second[:, :3, :3] = R @ (hat(turning.angular_second) + spin @ spin)
    return Moving(H, first, second)


def twist(a: Moving) -> Twist:
    """Velocities and accelerations: ``[ω]× = Ṙ Rᵀ``, and ``[ω̇]×`` the antisymmetric part of ``R̈ Rᵀ``."""
    back = np.swapaxes(a.H[:, :3, :3], 1, 2)
    first, second = a.first[:, :3, :3] @ back, a.second[:, :3, :3] @ back
    return Twist(_axial(first), _axial(second), a.first[:, :3, 3], a.second[:, :3, 3])


def _axial(W: Array) -> Array:
    """The vector of the antisymmetric part."""
    return 0.5 * np.stack([W[:, 2, 1] - W[:, 1, 2], W[:, 0, 2] - W[:, 2, 0], W[:, 1, 0] - W[:, 0, 1]], axis=1)
