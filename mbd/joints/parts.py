"""Rows and angles that several joints share."""

from mbd.bodies.algebra import basis, dot, rotate
from mbd.bodies.scope import Rotation, Triple
from mbd.bodies.values import Vector3
from mbd.tape.functions import atan2
from mbd.tape.node import Scalar

Z: Vector3 = (0.0, 0.0, 1.0)


def place_rows(p: Triple) -> list[tuple[str, Scalar]]:
    """p = 0, in parent axes [m]."""
    return [("x", p[0]), ("y", p[1]), ("z", p[2])]


def across_rows(p: Triple, axis: Vector3) -> list[tuple[str, Scalar]]:
    """No place across the axis: b·p = c·p = 0 [m]."""
    b, c = basis(axis)
    return [("across 1", dot(b, p)), ("across 2", dot(c, p))]


def turn_rows(R: Rotation) -> list[tuple[str, Scalar]]:
    """R = 1: the axial vector of R, which is the small rotation itself [rad]."""
    return [
        ("turn x", 0.5 * (R[2][1] - R[1][2])),
        ("turn y", 0.5 * (R[0][2] - R[2][0])),
        ("turn z", 0.5 * (R[1][0] - R[0][1])),
    ]


def align_rows(R: Rotation, axis: Vector3) -> list[tuple[str, Scalar]]:
    """R axis = axis: its components along b and c vanish [rad]."""
    b, c = basis(axis)
    turned = rotate(R, axis)
    return [("turn 1", dot(b, turned)), ("turn 2", dot(c, turned))]


def sine_cosine(R: Rotation, axis: Vector3) -> tuple[Scalar, Scalar]:
    """sin and cos of the angle of a rotation about the axis."""
    b, c = basis(axis)
    turned = rotate(R, b)
    return dot(c, turned), dot(b, turned)


def angle_about(R: Rotation, axis: Vector3) -> Scalar:
    """The angle of a rotation about the axis, between −π and π [rad]."""
    sine, cosine = sine_cosine(R, axis)
    angle: Scalar = atan2(sine, cosine)
    return angle
