"""Surfaces that the path of a muscle wraps around: spheres and cylinders, whose shortest paths have closed forms."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

from mbd.bodies.algebra import Triple, cross, difference, dot, norm, rotate, scaled, total, transpose
from mbd.bodies.base import Frame
from mbd.bodies.domains import Domain, positive
from mbd.bodies.scope import Scope
from mbd.bodies.values import Vector3, number, triple
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.base import frame_of
from mbd.forces.quantities import Mention
from mbd.tape.functions import atan2, cos, maximum, sign, sin, sqrt, where
from mbd.tape.node import Scalar

__all__ = ["WrappingCylinder", "WrappingSphere", "WrappingSurface", "taut"]

MIN_TANGENT = 1e-15
"""Square of the tangent to a surface, in radii, below which a point counts as lying on it: round-off of a² − r² [-]."""
MAX_SWEEPS = 12
"""Corrections of the points between two surfaces; one surface needs none.

They leave 1e-11 of a length between cylinders, and between spheres too where the path stays clear of their middles;
at a tenth of a radius from a middle, where the way around turns fast, they leave up to 1e-6 and 1e-3 of a moment arm.
"""


@dataclass(frozen=True)
class _Around:
    """The way around one surface, in its axes."""

    touches: Any
    """θ > 0: whether the path lies on the surface; else it is straight."""
    length: Scalar
    until_exit: Scalar
    """Length up to where the path leaves the surface."""
    entry: Triple
    exit: Triple


@dataclass(frozen=True)
class WrappingSurface(ABC):
    """A surface between two points of a path, around which the path lies where a straight line would cut it.

    In the plane of the path (a sphere) or across the axis (a cylinder), with the points at distances a and b from the
    middle and the angle φ between them, the path lies on the surface over ``θ = φ − acos(r/a) − acos(r/b)``. Where θ is
    positive its length there is ``l = √(a² − r²) + √(b² − r²) + r θ``, and along a cylinder with Δz between the points
    ``√(l² + Δz²)``: tangents, a great circle or a helix. Where θ is negative it is straight. Length and moment arms are
    continuous as the path lifts off, so that this is no event: the force of a muscle has a kink there, no jump. Steps
    of a fixed dt are of the second order across it; with `tol` their lengths follow.

    A point within the surface counts as its nearest point on the surface.
    """

    frame: Frame
    radius: float

    def __post_init__(self) -> None:
        frame_of(self.frame, f"frame of a {type(self).__name__}")
        value = number(self.radius, f"radius of a {type(self).__name__}")
        if value <= 0.0:
            raise ModelError(f"radius of a {type(self).__name__} must be positive, got {value:g} m")
        object.__setattr__(self, "radius", value)

    def mentions(self) -> list[Mention]:
        """Its frame."""
        return [self.frame]

    def parameters(self, owner: str) -> dict[str, float]:
        """Its radius by full name."""
        return {f"{owner}.radius": self.radius}

    def domains(self, owner: str) -> dict[str, Domain]:
        """The radius is positive."""
        return {f"{owner}.radius": positive(unit="m")}

    def around(self, scope: Scope, owner: str, first: Triple, last: Triple) -> _Around:
        """The way from one point to another, both in ground axes, as are its entry and its exit."""
        motion = scope.frame(self.frame)
        R = transpose(motion.rotation)
        P, S = (rotate(R, difference(point, motion.position)) for point in (first, last))
        found = self._around(P, S, scope.parameter(owner, "radius", self.radius))
        entry, leave = (total(motion.position, rotate(motion.rotation, p)) for p in (found.entry, found.exit))
        return _Around(found.touches, found.length, found.until_exit, entry, leave)

    @abstractmethod
    def _around(self, P: Triple, S: Triple, radius: Scalar) -> _Around:
        """The way from P to S in axes of the surface."""


@dataclass(frozen=True)
class WrappingSphere(WrappingSurface):
    """A sphere that the path of a muscle wraps around, along a great circle.

    Where the straight line would pass through the middle, the path may lie on every side: its moment arm is not
    continuous there.

    Parameters
    ----------
    frame : its center
    radius : r [m], the parameter 'muscle point k.radius' of the k-th point or surface of the path
    """

    def _around(self, P: Triple, S: Triple, radius: Scalar) -> _Around:
        """In the plane of the two points and the center."""
        normal = cross(P, S)
        size = sqrt(maximum(dot(normal, normal), 1e-300))
        a = norm(P)
        ahead = scaled(1.0 / a, P)
        aside = scaled(a / size, difference(S, scaled(dot(S, ahead) / a, P)))
        return _wrapped(P, S, ahead, aside, atan2(size, dot(P, S)), radius, 0.0, 0.0)


@dataclass(frozen=True)
class WrappingCylinder(WrappingSurface):
    """A cylinder about the z axis of its frame that the path of a muscle wraps around, along a helix.

    The cylinder has no ends.

    Parameters
    ----------
    frame : a point on its axis, which is the z axis of the frame (`Frame.turned` turns it)
    radius : r [m], the parameter 'muscle point k.radius' of the k-th point or surface of the path
    side : direction in axes of the frame on whose side of the axis the path always passes, (1, 0, 0) in front of a
        knee, say; by default the shorter way around. Where one of the points passes behind the axis, seen from this
        side, the length jumps. Give it where two cylinders follow each other: the shorter way around each may follow
        from that around the other, so that there is none on which both agree.

    >>> import mbd
    >>> leg = mbd.Link("leg", mass=3.0, length=0.4, center=0.2)
    >>> WrappingCylinder(leg.start, 0.03, side=(2.0, 0.0, 0.0)).side
    (1.0, 0.0, 0.0)
    """

    side: Vector3 | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.side is None:
            return
        x, y, _ = triple(self.side, "side of a WrappingCylinder")
        size = (x * x + y * y) ** 0.5
        if size == 0.0:
            raise ModelError(
                "side of a WrappingCylinder is a direction across its z axis, such as (1, 0, 0), got "
                f"{tuple(map(float, self.side))}"
            )
        object.__setattr__(self, "side", (x / size, y / size, 0.0))

    def _around(self, P: Triple, S: Triple, radius: Scalar) -> _Around:
        """Across the axis, and along it in proportion to the length across."""
        p, s = (P[0], P[1], 0.0), (S[0], S[1], 0.0)
        a = norm(p)
        if self.side is None:
            turn = p[0] * s[1] - p[1] * s[0]
            angle, sense = atan2(abs(turn), dot(p, s)), where(turn < 0.0, -1.0, 1.0)
        else:
            # polar angles about the axis from the side, whose jump is behind the axis, so that no way leads there
            c, d, _ = self.side
            first, last = (atan2(c * y - d * x, c * x + d * y) for x, y, _ in (p, s))
            angle, sense = abs(last - first), sign(last - first)
        ahead = scaled(1.0 / a, p)
        aside = (-sense * ahead[1], sense * ahead[0], 0.0)
        return _wrapped(p, s, ahead, aside, angle, radius, P[2], S[2] - P[2])


def _wrapped(
    P: Triple, S: Triple, ahead: Triple, aside: Triple, angle: Scalar, radius: Scalar, low: Scalar, rise: Scalar
) -> _Around:
    """Tangents and an arc in the plane of two unit vectors, or the straight line, with a rise across the plane.

    Parameters
    ----------
    P, S : the points, without the rise
    ahead, aside : unit vectors from the middle to P, and perpendicular to it in the sense of the arc
    angle : φ from P to S in that sense, from 0 to 2 π [rad]
    low, rise : z of the first point, and z from there to the last one
    """
    square = radius * radius
    tangents, angles, places = [], [], []
    for end in (P, S):
        size = norm(end)
        tangents.append(sqrt(maximum(dot(end, end) - square, MIN_TANGENT * square)))
        angles.append(atan2(tangents[-1], radius))
        places.append(scaled(maximum(size, radius) / size, end))
    theta = angle - angles[0] - angles[1]
    touches = theta > 0.0
    way = tangents[0] + radius * theta
    across = way + tangents[1]
    apart = difference(places[1], places[0])
    straight, bent = (sqrt(square_across + rise * rise) for square_across in (dot(apart, apart), across * across))
    entry, leave = (
        total(scaled(radius * cos(turn), ahead), scaled(radius * sin(turn), aside))
        for turn in (angles[0], angles[0] + theta)
    )
    entry = total(entry, (0.0, 0.0, low + rise * (tangents[0] / across)))
    leave = total(leave, (0.0, 0.0, low + rise * (way / across)))
    return _Around(touches, where(touches, bent, straight), bent * (way / across), entry, leave)


def taut(scope: Scope, owner: str, first: Triple, last: Triple, over: Sequence[tuple[int, WrappingSurface]]) -> Scalar:
    """Length of the path from one point to another around surfaces, one after another [m].

    Between two surfaces the path runs from the exit of one to the entry of the next one. Both follow from each other:

    1. Every surface is met on the way from the exit of the surface before to the entry of the next one, of which the
       last point is the first guess.
    2. This is repeated `MAX_SWEEPS` times; two circles in a plane converge quadratically, helices linearly.

    The length is least over these points, so that an error ε of theirs is ε² of it.

    Parameters
    ----------
    first, last : points in ground axes
    over : places of the surfaces within the path of the muscle `owner`, counted from 0, with the surfaces
    """
    entries: list[Triple] = [last] * (len(over) + 1)
    length: Scalar = 0.0
    for _ in range(1 if len(over) == 1 else MAX_SWEEPS):
        start, length = first, 0.0
        for k, (place, surface) in enumerate(over):
            around = surface.around(scope, f"{owner} point {place + 1}", start, entries[k + 1])
            if len(over) == 1:
                return around.length
            entries[k] = _either(around.touches, around.entry, entries[k + 1])
            start = _either(around.touches, around.exit, start)
            length = length + where(around.touches, around.until_exit, 0.0)
        length = length + norm(difference(last, start))
    return length


def _either(condition: Any, yes: Triple, no: Triple) -> Triple:
    x, y, z = (where(condition, a, b) for a, b in zip(yes, no, strict=True))
    return x, y, z
