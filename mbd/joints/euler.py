"""Three angles about axes that turn with the child: sequences of Euler (zxz, …), of Tait, Bryan and Cardan (zxy, …).

``R = R_i(first) R_j(second) R_k(third)``, each turn about an axis of what the turns before it have moved, as ISB's
joint angles are defined (Wu et al. 2002, 2005); scipy writes the same sequence in capitals. It has a singularity, at
second = ±π/2 where its axes are three and at 0 or π where they are two: first and third turn about one axis there, and
only their sum or difference is known. There `third` is 0, so that the three angles still give R.
"""

import math
from collections.abc import Sequence
from itertools import product as every
from typing import Any

from mbd.bodies.scope import Rotation
from mbd.joints.quaternions import quaternion_product
from mbd.tape.functions import atan2, sqrt, where

SEQUENCES = tuple("".join(s) for s in every("xyz", repeat=3) if s[0] != s[1] != s[2])
"""The twelve sequences."""
ANGLE_SUFFIXES = "123"
"""Endings of the names of three angles, in their order: 'hip.euler.zxy.1'."""


def sequence_of(value: Any) -> str | None:
    """'zxy' of 'zxy' or 'ZXY'; None for what is no sequence."""
    found = value.lower() if isinstance(value, str) else ""
    return found if found in SEQUENCES else None


def from_euler(sequence: str, angles: Sequence[float]) -> list[float]:
    """The unit quaternion of three angles [rad]."""
    found = [1.0, 0.0, 0.0, 0.0]
    for axis, angle in zip(sequence, angles, strict=True):
        turn = [math.cos(0.5 * angle), 0.0, 0.0, 0.0]
        turn[1 + "xyz".index(axis)] = math.sin(0.5 * angle)
        found = quaternion_product(found, turn)
    return found


def euler_angles(R: Rotation, sequence: str) -> list[Any]:
    """The three angles of a rotation [rad]: first and third in ±π, second in ±π/2, or in 0 … π of two axes."""
    i, j = "xyz".index(sequence[0]), "xyz".index(sequence[1])
    k = 3 - i - j
    e = 1.0 if (j - i) % 3 == 1 else -1.0
    two = sequence[0] == sequence[2]
    if two:  # R_ii = cos b, R_ij = sin b sin c, R_ik = e sin b cos c, R_ji = sin a sin b, R_ki = −e cos a sin b
        square = R[i][j] * R[i][j] + R[i][k] * R[i][k]
        first, third = (R[j][i], -e * R[k][i]), (R[i][j], e * R[i][k])
    else:  # R_ik = e sin b, R_jk = −e sin a cos b, R_kk = cos a cos b, R_ij = −e cos b sin c, R_ii = cos b cos c
        square = R[i][i] * R[i][i] + R[i][j] * R[i][j]
        first, third = (-e * R[j][k], R[k][k]), (-e * R[i][j], R[i][i])
    regular = square > 1e-14  # below, the other two angles are taken for one
    size = where(regular, sqrt(where(regular, square, 1.0)), 0.0)
    second = atan2(size, R[i][i]) if two else atan2(e * R[i][k], size)
    alone = atan2(e * R[k][j], R[j][j])  # of R_i(a) R_j(b)
    a = where(regular, atan2(where(regular, first[0], 0.0), where(regular, first[1], 1.0)), alone)
    c = where(regular, atan2(where(regular, third[0], 0.0), where(regular, third[1], 1.0)), 0.0)
    return [a, second, c]


def second_from_singular(sequence: str, second: Any) -> Any:
    """|sin| or |cos| of the second angle, 0 at the singularity of a sequence; of floats and arrays."""
    from numpy import abs as size, cos as cosine, sin as sine

    return size(sine(second) if sequence[0] == sequence[2] else cosine(second))
