"""Measures of joints that turn freely: how far inside a cone of directions, and how far from a limit of twist."""

import math
from typing import Any

from mbd.bodies.algebra import cross, dot, rotate
from mbd.bodies.scope import Rotation, Scope
from mbd.bodies.values import Vector3, number, unit_vector
from mbd.constraints.measure import Measure
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.quantities import Mention
from mbd.joints.base import Joint
from mbd.tape.functions import atan2, sqrt, where
from mbd.tape.node import Scalar

SQUARED_SINE_ATOL = 1e-24
"""Square of the sine of a tilt below which its direction is not asked for [-]."""


@dataclass(frozen=True)
class _OfRotation(Measure):
    """A measure of R of a joint."""

    joint: Joint
    limit: float
    axis: Vector3

    unit = "rad"
    reaction = "drive"

    def mentions(self) -> list[Mention]:
        """Its joint."""
        return [self.joint]

    def _rotation(self, scope: Scope) -> Rotation:
        return self.joint.transform(scope.joint(self.joint.name).coordinates, scope)[0]


@dataclass(frozen=True)
class Cone(_OfRotation):
    """``g = limit − ∠(R axis, direction)``."""

    direction: Vector3 = (0.0, 1.0, 0.0)

    def gap(self, scope: Scope) -> Scalar:
        """limit − ∠(R axis, direction)."""
        turned = rotate(self._rotation(scope), self.axis)
        across = cross(self.direction, turned)
        square = dot(across, across)
        sine = where(square > SQUARED_SINE_ATOL, sqrt(where(square > SQUARED_SINE_ATOL, square, 1.0)), 0.0)
        tilt: Scalar = atan2(sine, dot(self.direction, turned))
        return self.limit - tilt


@dataclass(frozen=True)
class Twist(_OfRotation):
    """``g = limit − τ`` of a positive limit, ``g = τ − limit`` of a negative one."""

    def gap(self, scope: Scope) -> Scalar:
        """±(limit − τ) with tan τ/2 = p/w, p = axis · u of the quaternion (w, u): τ = atan2(2 p w, w² − p²).

        Both are entries of R, and neither is small together with w alone, as 1 + tr R = 4 w² is.
        """
        R = self._rotation(scope)
        along = dot(self.axis, (R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1]))
        ahead = R[0][0] + R[1][1] + R[2][2] - dot(self.axis, rotate(R, self.axis))
        tau: Scalar = atan2(along, ahead)
        return self.limit - tau if self.limit > 0.0 else tau - self.limit


def cone(joint: Joint, limit: float, axis: Any = (0.0, 1.0, 0.0), direction: Any = None) -> Cone:
    """How far the axis of a joint's child is from the surface of a cone, ``g = limit − ∠(R axis, direction)`` [rad].

    A stop of a hip or a shoulder: ``mbd.Unilateral("hip stop", mbd.cone(hip, 1.2))``.

    Parameters
    ----------
    joint : that turns, such as a `Spherical`
    limit : half the angle of the cone, 0 < limit < π [rad]
    axis : in the child's frame; y by default
    direction : the middle of the cone in the parent's frame; by default the same as `axis`, where R = 1
    """
    found = _angle(joint, limit, "cone")
    if not 0.0 < found < math.pi:
        raise ModelError(
            f"limit of the cone of '{joint.name}' must be above 0 and below π rad, got {found:g}{_as_degrees(found)}"
        )
    own = unit_vector(axis, f"axis of the cone of '{joint.name}'")
    middle = own if direction is None else unit_vector(direction, f"direction of the cone of '{joint.name}'")
    return Cone(joint, found, own, middle)


def twist(joint: Joint, limit: float, axis: Any = (0.0, 1.0, 0.0)) -> Twist:
    """How far the twist τ of a joint about an axis is from a limit: ``g = limit − τ``, or τ − limit of a negative one.

    τ is what is left of the rotation, between −π and π, after the shortest one that carries the axis where it is has
    been taken off (swing and twist); it is not defined where the axis is turned half around. A joint that turns both
    ways has two stops: ``mbd.twist(hip, 0.7)`` and ``mbd.twist(hip, -0.9)``.

    Parameters
    ----------
    joint : that turns, such as a `Spherical`
    limit : −π < limit < π, not 0 [rad]
    axis : in both frames; y by default
    """
    found = _angle(joint, limit, "twist")
    if not 0.0 < abs(found) < math.pi:
        raise ModelError(
            f"limit of the twist of '{joint.name}' must lie within ±π rad and not be 0, got {found:g}"
            f"{_as_degrees(found)}"
        )
    return Twist(joint, found, unit_vector(axis, f"axis of the twist of '{joint.name}'"))


def _as_degrees(limit: float) -> str:
    """What a limit beyond π is in radians if it was meant in degrees."""
    return f"; {limit:g}° is {math.radians(limit):.3g} rad" if math.pi < abs(limit) <= 180.0 else ""


def _angle(joint: Any, limit: Any, what: str) -> float:
    """The limit of a joint that turns."""
    if not isinstance(joint, Joint):
        raise ModelError(f"{what}: its joint must be a joint that turns, such as an mbd.Spherical, got {joint!r}")
    if all(label.unit != "rad" for label in joint.freedoms):
        raise ModelError(f"{what}: '{joint.name}' does not turn; give a joint such as an mbd.Spherical")
    return number(limit, f"limit of the {what} of '{joint.name}'")
