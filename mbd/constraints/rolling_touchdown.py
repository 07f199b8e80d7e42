"""Where a foot meets the ground and rolls: a round one, and a convex sole of any shape."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import field
from math import pi
from typing import Any, ClassVar

from mbd.bodies.algebra import dot, rotate, transpose
from mbd.bodies.base import Frame
from mbd.bodies.domains import Domain, positive
from mbd.bodies.ground import Ground
from mbd.bodies.scope import Scope
from mbd.bodies.values import number
from mbd.constraints.measure import Measure
from mbd.constraints.soles import Sole, sole_of
from mbd.constraints.surfaces import Plane
from mbd.dataclass import dataclass
from mbd.errors import CapabilityError, ModelError
from mbd.forces.base import frame_of
from mbd.forces.quantities import Mention
from mbd.tape.functions import atan2, sin
from mbd.tape.node import Node, Scalar


class RollingSole(Measure):
    """A sole on a frame of a body that turns about z, over a plane on which it can roll.

    word : what users call it by; foot : the frame, in whose axes the sole is given
    """

    word: ClassVar[str]
    ground: Plane

    unit = "m"
    has_tangents = True

    @property
    @abstractmethod
    def foot(self) -> Frame:
        """Its frame."""

    def mentions(self) -> list[Mention]:
        """Its frame, and that of the plane."""
        return [self.foot] if self.ground.frame is None else [self.foot, self.ground.frame]

    def refuse(self, scope: Scope) -> None:
        """A frame that turns about other axes than z."""
        spin = scope.frame(self.foot).angular_velocity
        if any(isinstance(part, Node) and not part.is_zero for part in spin[:2]):
            raise CapabilityError(
                f"{self.word} of '{self.foot.full_name}' serves planar mechanisms, whose feet turn about z only; "
                "a foot that tilts in space touches the ground elsewhere: use mbd.touchdown of its points"
            )

    def faults(self, owner: str) -> list[str]:
        """A foot on the ground, or on the body that its plane is on."""
        if isinstance(self.foot.body, Ground):
            return [f"'{owner}': its foot '{self.foot.full_name}' is the ground; give a frame of the body that rolls"]
        if self.ground.frame is not None and self.ground.frame.body is self.foot.body:
            return [f"'{owner}': its foot and its plane are both on '{self.foot.body.name}' and never move apart"]
        return []


@dataclass(frozen=True)
class RollingTouchdown(RollingSole):
    """``g = n · s_C − r`` of a round foot, and the row that lets it roll without slip; see `rolling_touchdown`.

    The anchor is ``u = t · s_C / r + φ``, with s_C the place of the center on the plane and φ the angle of its frame
    against the direction forward t. Where the foot rolls u stays: the row is ``r sin(u − û)``, whose slope is r u̇, the
    velocity of the touching point along the plane, and which knows no difference between whole turns of a wheel.
    """

    center: Frame
    radius: float
    ground: Plane = field(default_factory=Plane)
    word: ClassVar[str] = "rolling_touchdown"

    @property
    def foot(self) -> Frame:
        """Its center."""
        return self.center

    def gap(self, scope: Scope) -> Scalar:
        """n · s_C − r."""
        return self.ground.gap(scope.frame(self.center).position, scope) - self._radius(scope)

    def captured(self, scope: Scope) -> Sequence[Scalar]:
        """u = t · s_C / r + φ [rad]."""
        along, angle = rolled(self.center, self.ground, scope)
        return [along / self._radius(scope) + angle]

    def tangents(self, scope: Scope, anchors: Sequence[Scalar]) -> Sequence[tuple[str, Scalar]]:
        """r sin(u − û)."""
        (u,) = self.captured(scope)
        return [("forward", self._radius(scope) * sin(u - anchors[0]))]

    def _radius(self, scope: Scope) -> Scalar:
        return scope.parameter(self.center.full_name, "radius", self.radius)

    def parameters(self) -> dict[str, float]:
        """The radius, under the name of the center."""
        return {f"{self.center.full_name}.radius": self.radius}

    def domains(self) -> dict[str, Domain]:
        """A radius > 0."""
        return {f"{self.center.full_name}.radius": positive(unit="m")}


@dataclass(frozen=True)
class ProfileTouchdown(RollingSole):
    """``g = n · s_O − h(ψ)`` of a convex sole, and the row that lets it roll without slip; see `profile_touchdown`.

    ψ = −φ is the tangent of the sole that lies on the plane, φ the angle of the frame against the direction forward t.
    The anchor is ``σ = t · s_O − ∫h dψ``, which stays where the sole rolls, since ``σ̇ = t · v_O + h φ̇`` is the velocity
    of the touching point along the plane. The row is ``(P/2π) sin(2π (σ − σ̂)/P)`` with the circumference P of the
    sole's hull, for which whole turns are alike.
    """

    frame: Frame
    sole: Sole
    ground: Plane = field(default_factory=Plane)
    word: ClassVar[str] = "profile_touchdown"

    @property
    def foot(self) -> Frame:
        """Its frame."""
        return self.frame

    def gap(self, scope: Scope) -> Scalar:
        """n · s_O − h(ψ)."""
        _, angle = rolled(self.frame, self.ground, scope)
        depth = scope.tape.lookup(self._table(scope), -angle, 1)
        return self.ground.gap(scope.frame(self.frame).position, scope) - depth

    def captured(self, scope: Scope) -> Sequence[Scalar]:
        """σ = t · s_O − ∫h dψ [m]."""
        along, angle = rolled(self.frame, self.ground, scope)
        return [along - scope.tape.lookup(self._table(scope), -angle)]

    def tangents(self, scope: Scope, anchors: Sequence[Scalar]) -> Sequence[tuple[str, Scalar]]:
        """(P/2π) sin(2π (σ − σ̂)/P)."""
        (sigma,) = self.captured(scope)
        size = self.sole.circumference / (2.0 * pi)
        return [("forward", size * sin((sigma - anchors[0]) / size))]

    def _table(self, scope: Scope) -> Any:
        """∫h dψ."""
        return scope.table(f"{self.frame.full_name} {self.sole.label}", *self.sole.pieces)


def rolling_touchdown(center: Frame, radius: float, ground: Any = None) -> RollingTouchdown:
    """Height of a round foot over a plane; the foot can roll where it comes down (McGeer's curved foot, or a wheel).

    ``g = n · s_C − r`` with the place s_C of the center on the plane. In a `Unilateral` with friction=None it rolls
    without slip from where it came down, ``t · v_C + r φ̇ = 0``; with μ it rolls, slips and grips again; with 0 it
    slides.

    T. McGeer, Passive dynamic walking, Int. J. Robotics Research 9 (1990) 62.

    Parameters
    ----------
    center : of the arc, a frame of the foot: ``shank.point(0, -0.7, name="arc")``
    radius : r > 0 [m]; the run-time parameter 'shank.arc.radius'
    ground : None for y = 0, or a `Plane` whose normal lies in the x-y plane; it may lie on another body, or run

    Raises
    ------
    ModelError
        where the center is no frame, the radius not positive, or the ground no plane of x-y.
    CapabilityError
        as equations are derived, where the foot turns about other axes than z.
    """
    frame_of(center, "rolling_touchdown: its center")
    size = number(radius, "radius of rolling_touchdown")
    if size <= 0.0:
        raise ModelError(f"radius of rolling_touchdown must be positive, got {size:g} m; for a point use mbd.touchdown")
    return RollingTouchdown(center, size, _plane(ground, "rolling_touchdown"))


def profile_touchdown(frame: Frame, sole: Any, ground: Any = None) -> ProfileTouchdown:
    """Height of a convex sole over a plane; the sole can roll where it comes down: a roll-over shape.

    ``g = n · s_O − h(ψ)`` with the support function ``h(ψ) = max over the sole of x sin ψ − y cos ψ``, its depth below
    the frame's origin O where the tangent (cos ψ, sin ψ) lies on the plane. In a `Unilateral` with friction=None the
    sole rolls without slip, with μ it rolls, slips and grips again, with 0 it slides.

    Given points are joined by a smooth sole that touches each of them, with the tangents of parabolas through
    neighbours; hollows are bridged, since they do not touch. Heel and toe end in corners over which it tips.

    A. H. Hansen, D. S. Childress & E. H. Knox, Roll-over shapes of human locomotor systems, Clinical Biomechanics 19
    (2004) 407. Support functions: T. Bonnesen & W. Fenchel, Theorie der konvexen Körper (1934), § 15.

    Parameters
    ----------
    frame : of the foot, in whose axes the sole lies
    sole : (n ≥ 3, 2) points from heel to toe, x increasing [m]; or h(ψ) [m], a function of one angle of period 2π that
        works on floats, such as ``lambda psi: 0.3 + 0.05 * mbd.sin(psi)``
    ground : None for y = 0, or a `Plane` whose normal lies in the x-y plane; it may lie on another body, or run

    Raises
    ------
    ModelError
        for a sole that is none of these, or not convex, and a ground that is no plane of x-y.
    CapabilityError
        as equations are derived, where the foot turns about other axes than z.
    """
    frame_of(frame, "profile_touchdown: its frame")
    return ProfileTouchdown(frame, sole_of(sole, "sole of profile_touchdown"), _plane(ground, "profile_touchdown"))


def rolled(frame: Frame, ground: Plane, scope: Scope) -> tuple[Scalar, Scalar]:
    """t · s of a frame on a plane [m], and the angle φ of its x axis against t [rad], between −π and π."""
    motion = scope.frame(frame)
    place = ground.place(motion.position, scope)
    forward, _ = ground.directions(place, scope)
    x_axis = (motion.rotation[0][0], motion.rotation[1][0], motion.rotation[2][0])
    if ground.frame is not None:
        x_axis = rotate(transpose(scope.frame(ground.frame).rotation), x_axis)
    return dot(forward, place), atan2(dot(ground.normal, x_axis), dot(forward, x_axis))


def _plane(ground: Any, what: str) -> Plane:
    if ground is None:
        return Plane()
    if not isinstance(ground, Plane):
        raise ModelError(f"{what}: the ground is a mbd.Plane (what is curved is the foot), got {ground!r}")
    if ground.normal[2] != 0.0 or (ground.frame is not None and not ground.frame.is_planar):
        raise ModelError(f"{what}: the normal of its plane must lie in the x-y plane, in which the foot rolls")
    return ground
