"""Measures of joints and of points: flexion, extension, height, distance, separation."""

from typing import Any

from mbd.bodies.algebra import difference, dot, norm, rotate
from mbd.bodies.base import Frame
from mbd.bodies.scope import Scope
from mbd.bodies.values import Vector3, number, unit_vector
from mbd.constraints.measure import Measure
from mbd.dataclass import dataclass
from mbd.forces.base import frame_of, joint_of
from mbd.forces.quantities import Mention
from mbd.joints.base import Joint
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class JointMeasure(Measure):
    """``g = sign · q − offset`` of the one coordinate q of a joint."""

    joint: Joint
    sign: float = 1.0
    offset: float = 0.0

    reaction = "drive"

    def gap(self, scope: Scope) -> Scalar:
        """±q − offset."""
        (q,) = scope.joint(self.joint.name).coordinates
        return self.sign * q - self.offset

    @property
    def title(self) -> str:
        """'flexion' or 'extension'."""
        return "flexion" if self.sign < 0.0 else "extension"

    @property
    def unit(self) -> str:
        """That of the coordinate."""
        return self.joint.labels[0].unit

    def mentions(self) -> list[Mention]:
        """Its joint."""
        return [self.joint]


def flexion(joint: Joint, offset: float = 0.0) -> JointMeasure:
    """How far a joint is bent backwards, ``g = −q − offset``; a knee that bends backwards has a negative angle.

    Parameters
    ----------
    joint : with one coordinate q
    offset : flexion at which the gap is zero [rad or m]
    """
    joint_of(joint, "flexion: its joint")
    return JointMeasure(joint, -1.0, number(offset, f"offset of the flexion of '{joint.name}'"))


def extension(joint: Joint, offset: float = 0.0) -> JointMeasure:
    """How far a joint is bent forwards, ``g = q − offset``.

    Parameters
    ----------
    joint : with one coordinate q
    offset : extension at which the gap is zero [rad or m]
    """
    joint_of(joint, "extension: its joint")
    return JointMeasure(joint, 1.0, number(offset, f"offset of the extension of '{joint.name}'"))


@dataclass(frozen=True)
class Height(Measure):
    """``g = y`` of a point."""

    point: Frame

    unit = "m"

    def gap(self, scope: Scope) -> Scalar:
        """y."""
        return scope.frame(self.point).position[1]

    def mentions(self) -> list[Mention]:
        """Its point."""
        return [self.point]


def height(point: Frame) -> Height:
    """Height of a point over y = 0 of the ground [m]; `touchdown` is the same with a foot that can stick."""
    return Height(frame_of(point, "height: its point"))


@dataclass(frozen=True)
class Distance(Measure):
    """``g = |p_b − p_a|``; the multiplier of a Bilateral on it is the tension, positive where it pulls."""

    a: Frame
    b: Frame

    unit = "m"
    reaction = "tension"

    def gap(self, scope: Scope) -> Scalar:
        """|p_b − p_a|."""
        return norm(difference(scope.frame(self.b).position, scope.frame(self.a).position))

    def mentions(self) -> list[Mention]:
        """Its points."""
        return [self.a, self.b]

    def faults(self, owner: str) -> list[str]:
        """Points of one body."""
        return _one_body(self.a, self.b, owner)


def distance(a: Frame, b: Frame) -> Distance:
    """Distance of two points [m]; it has no direction, hence no force, where they meet."""
    return Distance(frame_of(a, "distance: its first point"), frame_of(b, "distance: its second point"))


@dataclass(frozen=True)
class Separation(Measure):
    """``g = d · (p_b − p_a)`` with d fixed in the axes of frame a."""

    a: Frame
    b: Frame
    direction: Vector3

    unit = "m"

    def gap(self, scope: Scope) -> Scalar:
        """d · (p_b − p_a)."""
        a = scope.frame(self.a)
        return dot(rotate(a.rotation, self.direction), difference(scope.frame(self.b).position, a.position))

    def mentions(self) -> list[Mention]:
        """Its points."""
        return [self.a, self.b]

    def faults(self, owner: str) -> list[str]:
        """Points of one body."""
        return _one_body(self.a, self.b, owner)


def separation(a: Frame, b: Frame, direction: Any) -> Separation:
    """How far b lies from a along a direction, signed [m].

    Parameters
    ----------
    a, b : frames
    direction : in the axes of a, which may turn; of any length
    """
    frame_of(a, "separation: its first point")
    frame_of(b, "separation: its second point")
    return Separation(a, b, unit_vector(direction, "direction of a separation"))


def _one_body(a: Frame, b: Frame, owner: str) -> list[str]:
    if a.body is not b.body:
        return []
    return [f"'{owner}': its two points are both on '{a.body.name}' and never move apart; give a point of another body"]
