"""Triples and rotations in plain Python on scalars, floats or traced; exact zeros fold away."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TypeAlias

from mbd.bodies.values import Vector3
from mbd.tape.derivatives import jvp, substitute
from mbd.tape.functions import cos, sin, sqrt
from mbd.tape.node import Node, Scalar, Tape

Triple: TypeAlias = tuple[Scalar, Scalar, Scalar]
Rotation: TypeAlias = tuple[Triple, Triple, Triple]

ZERO: Vector3 = (0.0, 0.0, 0.0)
IDENTITY: tuple[Vector3, Vector3, Vector3] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def total(a: Triple, b: Triple) -> Triple:
    """a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def difference(a: Triple, b: Triple) -> Triple:
    """a − b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scaled(factor: Scalar, a: Triple) -> Triple:
    """factor · a."""
    return (factor * a[0], factor * a[1], factor * a[2])


def dot(a: Triple, b: Triple) -> Scalar:
    """a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Triple, b: Triple) -> Triple:
    """a × b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def norm(a: Triple) -> Scalar:
    """|a|."""
    result: Scalar = sqrt(dot(a, a))
    return result


def rotate(R: Rotation, a: Triple) -> Triple:
    """R a; of a plane, whose rotations are most of what is traced, without the terms that are zero."""
    if R[0][0].__class__ is Node and _turns_about_z(R):
        return (R[0][0] * a[0] + R[0][1] * a[1], R[1][0] * a[0] + R[1][1] * a[1], R[2][2] * a[2])
    return (dot(R[0], a), dot(R[1], a), dot(R[2], a))


def _turns_about_z(R: Rotation) -> bool:
    (_, _, xz), (_, _, yz), (zx, zy, _) = R
    return all(part.is_zero if part.__class__ is Node else part == 0.0 for part in (xz, yz, zx, zy))


def transpose(R: Rotation) -> Rotation:
    """Rᵀ, the inverse of a rotation."""
    return ((R[0][0], R[1][0], R[2][0]), (R[0][1], R[1][1], R[2][1]), (R[0][2], R[1][2], R[2][2]))


def product(A: Rotation, B: Rotation) -> Rotation:
    """A B."""
    columns = transpose(B)
    return (rotate(columns, A[0]), rotate(columns, A[1]), rotate(columns, A[2]))


def sum_of(A: Rotation, B: Rotation) -> Rotation:
    """A + B."""
    return (total(A[0], B[0]), total(A[1], B[1]), total(A[2], B[2]))


def axis_rotation(axis: Vector3, angle: Scalar) -> Rotation:
    """Right-handed rotation about a unit axis (Rodrigues).

    ``R_ij = c (δ_ij − a_i a_j) + a_i a_j + s ε_ikj a_k``, so that the row of an axis along x, y or z stays exact.
    """
    c, s = cos(angle), sin(angle)
    (x, y, z) = axis
    skew = ((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))
    rows = [
        tuple(c * (IDENTITY[i][j] - axis[i] * axis[j]) + axis[i] * axis[j] + s * skew[i][j] for j in range(3))
        for i in range(3)
    ]
    return (rows[0], rows[1], rows[2])


def constant_rotation(axis: Vector3, angle: float) -> tuple[Vector3, Vector3, Vector3]:
    """A rotation of plain numbers, in which round-off beside 0 and ±1 is removed.

    >>> constant_rotation((0.0, 0.0, 1.0), math.pi / 2)
    ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    """

    def clean(value: Scalar) -> float:
        assert isinstance(value, float)
        whole = float(round(value))
        return whole + 0.0 if abs(value - whole) < 4e-16 else value

    rows = [(clean(row[0]), clean(row[1]), clean(row[2])) for row in axis_rotation(axis, angle)]
    return (rows[0], rows[1], rows[2])


def basis(axis: Vector3) -> tuple[Vector3, Vector3]:
    """Unit vectors b, c that make (b, c, axis) right-handed; (x, y) for the z axis.

    >>> basis((0.0, 0.0, 1.0))
    ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    """
    k = min(range(3), key=lambda i: abs(axis[i]))
    b = [IDENTITY[k][i] - axis[k] * axis[i] for i in range(3)]
    size = math.hypot(*b)
    b = [value / size + 0.0 for value in b]
    c = cross(axis, (b[0], b[1], b[2]))
    return (b[0], b[1], b[2]), (float(c[0]) + 0.0, float(c[1]) + 0.0, float(c[2]) + 0.0)


def derivatives_at(
    function: Callable[..., Scalar], arguments: Sequence[Scalar], tape: Tape
) -> tuple[Node, tuple[Node, ...]]:
    """Value and partial derivatives of a scalar function at some scalars.

    The function is recorded on fresh inputs and the scalars put in afterwards, since a scalar that folds
    (a constant, a negation) could not be told apart in the result.
    """
    fresh = [tape.input("argument", k) for k in range(len(arguments))]
    value = tape.lift(function(*fresh))
    slopes = [jvp([value], {x: 1.0})[0] for x in fresh]
    put = substitute([value, *slopes], dict(zip(fresh, arguments, strict=True)))
    return put[0], tuple(put[1:])
