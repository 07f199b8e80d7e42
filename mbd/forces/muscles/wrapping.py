"""Surfaces that the path of a muscle wraps around: spheres and cylinders in closed form, ellipsoids in a plane."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import reduce
from operator import and_
from typing import Any, NamedTuple

import numpy as np

from mbd.bodies.algebra import Rotation, Triple, cross, difference, dot, norm, rotate, scaled, total, transpose
from mbd.bodies.base import Frame
from mbd.bodies.domains import Domain, positive
from mbd.bodies.scope import Scope
from mbd.bodies.values import Vector3, number, triple
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.base import frame_of
from mbd.forces.quantities import Mention
from mbd.tape.functions import atan2, clip, cos, maximum, minimum, sign, sin, sqrt, where
from mbd.tape.node import Scalar

MIN_TANGENT = 1e-15
"""Square of the tangent to a surface, in radii, below which a point counts as lying on it: round-off of a² − r² [-]."""
MAX_SWEEPS = 12
"""Corrections of the points between two surfaces; one surface needs none.

They leave 1e-11 of a length between cylinders, and between spheres too where the path stays clear of their middles;
at a tenth of a radius from a middle, where the way around turns fast, they leave up to 1e-6 and 1e-3 of a moment arm.
"""
MAX_SWEEPS_IN_PLANES = 5
"""The same where one of the surfaces is an ellipsoid."""
MAX_TILTS, MAX_TILTS_AGAIN, MAX_TILT = 8, 2, 0.4
"""Newton steps that tilt the plane of a path around an ellipsoid, after its ends have moved, and the longest [rad]."""
GAUSS = tuple(part.tolist() for part in np.polynomial.legendre.leggauss(12))
"""Places and weights of the quadrature of an arc on an ellipsoid."""


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
    toward: Triple | None = None
    """Across the line, to where the path lies; the next correction of the points begins there."""


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

    def __post_init__(self) -> None:
        frame_of(self.frame, f"frame of a {type(self).__name__}")

    @property
    @abstractmethod
    def sizes(self) -> dict[str, float]:
        """Its lengths [m], by the names of the parameters that they are."""

    def mentions(self) -> list[Mention]:
        """Its frame."""
        return [self.frame]

    def parameters(self, owner: str) -> dict[str, float]:
        """Its sizes by full name."""
        return {f"{owner}.{name}": value for name, value in self.sizes.items()}

    def domains(self, owner: str) -> dict[str, Domain]:
        """Sizes are positive."""
        return {f"{owner}.{name}": positive(unit="m") for name in self.sizes}

    def around(
        self, scope: Scope | InBody, owner: str, first: Triple, last: Triple, toward: Triple | None = None
    ) -> _Around:
        """The way from one point to another, both in ground axes, as are its entry and its exit."""
        motion = scope.frame(self.frame)
        R = transpose(motion.rotation)
        P, S = (rotate(R, difference(point, motion.position)) for point in (first, last))
        sizes = [scope.parameter(owner, name, value) for name, value in self.sizes.items()]
        found = self._around(P, S, sizes, toward)
        entry, leave = (total(motion.position, rotate(motion.rotation, p)) for p in (found.entry, found.exit))
        return _Around(found.touches, found.length, found.until_exit, entry, leave, found.toward)

    @abstractmethod
    def _around(self, P: Triple, S: Triple, sizes: Sequence[Scalar], toward: Triple | None) -> _Around:
        """The way from P to S in axes of the surface."""


@dataclass(frozen=True)
class _WithRadius(WrappingSurface):
    """A surface of one radius."""

    radius: float

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "radius", _size(self.radius, f"radius of a {type(self).__name__}"))

    @property
    def sizes(self) -> dict[str, float]:
        """The radius."""
        return {"radius": self.radius}


@dataclass(frozen=True)
class WrappingSphere(_WithRadius):
    """A sphere that the path of a muscle wraps around, along a great circle.

    Where the straight line would pass through the middle, the path may lie on every side: its moment arm is not
    continuous there.

    Parameters
    ----------
    frame : its center
    radius : r [m], the parameter 'muscle point k.radius' of the k-th point or surface of the path
    """

    def _around(self, P: Triple, S: Triple, sizes: Sequence[Scalar], toward: Triple | None) -> _Around:
        """In the plane of the two points and the center."""
        (radius,) = sizes
        normal = cross(P, S)
        size = sqrt(maximum(dot(normal, normal), 1e-300))
        a = norm(P)
        ahead = scaled(1.0 / a, P)
        aside = scaled(a / size, difference(S, scaled(dot(S, ahead) / a, P)))
        return _wrapped(P, S, ahead, aside, atan2(size, dot(P, S)), radius, 0.0, 0.0)


@dataclass(frozen=True)
class WrappingCylinder(_WithRadius):
    """A cylinder about the z axis of its frame that the path of a muscle wraps around, along a helix.

    Parameters
    ----------
    frame : a point on its axis, which is the z axis of the frame (`Frame.turned` turns it)
    radius : r [m], the parameter 'muscle point k.radius' of the k-th point or surface of the path
    side : direction in axes of the frame on whose side of the axis the path always passes, (1, 0, 0) in front of a
        knee, say; by default the shorter way around. Where one of the points passes behind the axis, seen from this
        side, the length jumps. Give it where two cylinders follow each other: the shorter way around each may follow
        from that around the other, so that there is none on which both agree.
    length : of the cylinder, whose middle the frame is then [m]; without ends by default. A path that would touch and
        leave it beyond its ends passes straight, so that the length of the path jumps where the second of these points
        comes onto the cylinder.

    >>> import mbd
    >>> leg = mbd.Link("leg", mass=3.0, length=0.4, center=0.2)
    >>> WrappingCylinder(leg.start, 0.03, side=(2.0, 0.0, 0.0)).side
    (1.0, 0.0, 0.0)
    """

    side: Vector3 | None = None
    length: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.length is not None:
            object.__setattr__(self, "length", _size(self.length, "length of a WrappingCylinder"))
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

    @property
    def sizes(self) -> dict[str, float]:
        """The radius, and the length if it has ends."""
        return super().sizes | ({} if self.length is None else {"length": self.length})

    def _around(self, P: Triple, S: Triple, sizes: Sequence[Scalar], toward: Triple | None) -> _Around:
        """Across the axis, and along it in proportion to the length across."""
        radius, *lengths = sizes
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
        return _wrapped(p, s, ahead, aside, angle, radius, P[2], S[2] - P[2], *lengths)


@dataclass(frozen=True)
class WrappingEllipsoid(WrappingSurface):
    """An ellipsoid that the path of a muscle wraps around, in a plane.

    The plane contains both points and, where the path is farthest from the line between them, the normal of the
    surface, as that of a geodesic does everywhere. Stretched to a unit sphere the path lies on a circle between its
    tangents; its length is that of the arc of an ellipse. A geodesic of an ellipsoid lies in no plane: of ellipsoids
    whose radii differ up to two times, 9 of 10 paths are longer than the shortest one by less than 3e-4 of the mean
    radius, half of them by less than 2e-6. Radii that are equal make it a sphere.

    Parameters
    ----------
    frame : its center, and the directions of its radii
    radii : along x, y and z of the frame [m], the parameters 'muscle point k.radii.x', … of the k-th point or surface
    side : direction in axes of the frame on whose side of the line between the points the path lies where that line
        cuts the ellipsoid; by default that on which the line passes the center. Where the line leaves the ellipsoid on
        the other side the length jumps.

    >>> import mbd
    >>> arm = mbd.Link("arm", mass=2.0, length=0.3, center=0.15)
    >>> WrappingEllipsoid(arm.start, (0.025, 0.02, 0.02), side=(0.0, -2.0, 0.0)).side
    (0.0, -1.0, 0.0)
    """

    radii: Vector3
    side: Vector3 | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        values = triple(self.radii, "radii of a WrappingEllipsoid")
        names = (f"the radius along {axis} of a WrappingEllipsoid" for axis in "xyz")
        x, y, z = map(_size, values, names)
        object.__setattr__(self, "radii", (x, y, z))
        if self.side is None:
            return
        direction = triple(self.side, "side of a WrappingEllipsoid")
        length = float(norm(direction))
        if length == 0.0:
            raise ModelError("side of a WrappingEllipsoid is a direction, such as (1, 0, 0), got (0, 0, 0)")
        object.__setattr__(self, "side", scaled(1.0 / length, direction))

    @property
    def sizes(self) -> dict[str, float]:
        """The three radii."""
        return {f"radii.{axis}": value for axis, value in zip("xyz", self.radii, strict=True)}

    def _around(self, P: Triple, S: Triple, sizes: Sequence[Scalar], toward: Triple | None) -> _Around:
        """In axes stretched to a unit sphere, with k along the line, m toward the path and n normal to the plane."""
        x, y, z = sizes
        squares = x * x, y * y, z * z
        p, s = (_on_or_outside(_divided(point, sizes)) for point in (P, S))
        apart = difference(s, p)
        k = scaled(1.0 / norm(apart), apart)
        foot = difference(p, scaled(dot(p, k), k))
        if toward is not None:
            aim = toward
        else:
            aim = foot if self.side is None else _multiplied(self.side, sizes)
        aim = difference(aim, scaled(dot(aim, k), k))
        m = scaled(1.0 / sqrt(maximum(dot(aim, aim), 1e-300)), aim)
        n = cross(k, m)
        tilt = _tilt(foot, m, n, squares, MAX_TILTS if toward is None else MAX_TILTS_AGAIN)
        m, n = _turned(tilt, m, n)
        # the circle in which the plane cuts the sphere, its height below the line, and angles from m toward k
        below = dot(foot, n)
        middle, height, square = scaled(below, n), dot(foot, m), 1.0 - below * below
        rho = sqrt(maximum(square, MIN_TANGENT))
        turns = []
        for along in -dot(p, k), dot(s, k):
            far = along * along + height * height
            tangent = sqrt(maximum(far - square, MIN_TANGENT * square))
            turns.append(atan2(along, height) - atan2(tangent, rho))
        first, last = -turns[0], turns[1]
        theta = last - first
        conditions: list[Any] = [dot(foot, foot) < 1.0, dot(p, k) < 0.0, dot(s, k) > 0.0, theta > 0.0]
        touches = reduce(and_, conditions)
        entry, leave = (
            _multiplied(total(middle, total(scaled(rho * cos(turn), m), scaled(rho * sin(turn), k))), sizes)
            for turn in (first, last)
        )
        ends = _multiplied(p, sizes), _multiplied(s, sizes)
        mm, mk, kk = (dot(a, _multiplied(b, squares)) for a, b in ((m, m), (m, k), (k, k)))
        half, arc = 0.5 * theta, 0.0
        for place, weight in zip(*GAUSS, strict=True):
            at = first + half * (1.0 + place)
            c, d = cos(at), sin(at)
            arc = arc + weight * sqrt(maximum(d * d * mm - 2.0 * d * c * mk + c * c * kk, 0.0))
        until = norm(difference(entry, ends[0])) + rho * half * arc
        bent, straight = until + norm(difference(ends[1], leave)), norm(difference(ends[1], ends[0]))
        return _Around(touches, where(touches, bent, straight), until, entry, leave, m)


def _tilt(foot: Triple, m: Triple, n: Triple, squares: tuple[Scalar, Scalar, Scalar], steps: int) -> Scalar:
    """The angle about the line at which the plane contains the normal of the ellipsoid at the top of its section.

    With n and m turned by φ the plane cuts the unit sphere in a circle about ``(foot·n) n`` of the radius ρ, whose top
    is ``(foot·n) n + ρ m``; the normal there is D⁻² of it. Newton's method on ``g = n·D⁻²((foot·n) n + ρ m)``, away
    from maxima, each step at most `MAX_TILT`.
    """
    nn, nm, mm = (dot(a, _divided(b, squares)) for a, b in ((n, n), (n, m), (m, m)))
    on_n, on_m = dot(foot, n), dot(foot, m)
    scale, phi = nn + mm, 0.0 * nn
    for _ in range(steps):
        c, d = cos(phi), sin(phi)
        below, height = on_n * c + on_m * d, on_m * c - on_n * d
        rho = sqrt(maximum(1.0 - below * below, MIN_TANGENT))
        own = nn * c * c + 2.0 * nm * c * d + mm * d * d
        mixed = (mm - nn) * c * d + nm * (c * c - d * d)
        top = nn + mm - own
        g = below * own + rho * mixed
        slope = height * own + 2.0 * below * mixed - below * height / rho * mixed + rho * (top - own)
        phi = phi - clip(g / (abs(slope) + 1e-9 * scale), -MAX_TILT, MAX_TILT)
    return phi


def _turned(phi: Scalar, m: Triple, n: Triple) -> tuple[Triple, Triple]:
    """m and n turned about their normal."""
    c, d = cos(phi), sin(phi)
    return difference(scaled(c, m), scaled(d, n)), total(scaled(c, n), scaled(d, m))


def _on_or_outside(point: Triple) -> Triple:
    """The nearest point that is not within the unit sphere."""
    size = norm(point)
    return scaled(maximum(size, 1.0) / size, point)


def _divided(a: Triple, b: Sequence[Scalar]) -> Triple:
    return a[0] / b[0], a[1] / b[1], a[2] / b[2]


def _multiplied(a: Triple, b: Sequence[Scalar]) -> Triple:
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


def _size(value: Any, what: str) -> float:
    found = number(value, what)
    if found <= 0.0:
        raise ModelError(f"{what} must be positive, got {found:g} m")
    return found


def _wrapped(
    P: Triple,
    S: Triple,
    ahead: Triple,
    aside: Triple,
    angle: Scalar,
    radius: Scalar,
    low: Scalar,
    rise: Scalar,
    length: Scalar | None = None,
) -> _Around:
    """Tangents and an arc in the plane of two unit vectors, or the straight line, with a rise across the plane.

    Parameters
    ----------
    P, S : the points, without the rise
    ahead, aside : unit vectors from the middle to P, and perpendicular to it in the sense of the arc
    angle : φ from P to S in that sense, from 0 to 2 π [rad]
    low, rise : z of the first point, and z from there to the last one
    length : of the surface along z, about 0
    """
    square = radius * radius
    tangents, angles, places = [], [], []
    for end in (P, S):
        size = norm(end)
        tangents.append(sqrt(maximum(dot(end, end) - square, MIN_TANGENT * square)))
        angles.append(atan2(tangents[-1], radius))
        places.append(scaled(maximum(size, radius) / size, end))
    theta = angle - angles[0] - angles[1]
    touches: Any = theta > 0.0
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
    if length is not None:
        touches = touches & (minimum(abs(entry[2]), abs(leave[2])) <= 0.5 * length)
    return _Around(touches, where(touches, bent, straight), bent * (way / across), entry, leave)


class InBody:
    """Frames of one body in the axes of that body, with the parameters of a scope or the values they have."""

    def __init__(self, scope: Scope | None = None) -> None:
        self.scope = scope

    def parameter(self, owner: str, field: str, value: float) -> Any:
        """The parameter in the scope, or its value."""
        return value if self.scope is None else self.scope.parameter(owner, field, value)

    def frame(self, frame: Frame) -> _Placed:
        """Where a frame is in its body."""
        return _Placed(*frame.placement(self))


class _Placed(NamedTuple):
    """A frame in axes of its body."""

    rotation: Rotation
    position: Triple


def bends(first: Frame, last: Frame, surface: WrappingSurface) -> bool:
    """Whether a surface bends the line between two points of its own body."""
    values = InBody()
    start, end = (frame.placement(values)[1] for frame in (first, last))
    return bool(surface.around(values, "", start, end).touches)


def taut(
    scope: Scope | InBody, owner: str, first: Triple, last: Triple, over: Sequence[tuple[int, WrappingSurface]]
) -> Scalar:
    """Length of the path from one point to another around surfaces, one after another [m].

    Between two surfaces the path runs from the exit of one to the entry of the next one. Both follow from each other:

    1. Every surface is met on the way from the exit of the surface before to the entry of the next one, of which the
       last point is the first guess.
    2. This is repeated `MAX_SWEEPS` times, fewer with ellipsoids, whose paths are no shortest ones; two circles in a
       plane converge quadratically, helices linearly.

    The length is least over these points, so that an error ε of theirs is ε² of it.

    Parameters
    ----------
    first, last : points in ground axes
    over : places of the surfaces within the path of the muscle `owner`, counted from 0, with the surfaces
    """
    entries: list[Triple] = [last] * (len(over) + 1)
    toward: list[Triple | None] = [None] * len(over)
    length: Scalar = 0.0
    roughly = any(isinstance(surface, WrappingEllipsoid) for _, surface in over)
    for _ in range(1 if len(over) == 1 else MAX_SWEEPS_IN_PLANES if roughly else MAX_SWEEPS):
        start, length = first, 0.0
        for k, (place, surface) in enumerate(over):
            around = surface.around(scope, f"{owner} point {place + 1}", start, entries[k + 1], toward[k])
            toward[k] = around.toward
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
