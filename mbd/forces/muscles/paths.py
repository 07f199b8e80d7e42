"""Paths of muscles: lines through points and around surfaces, and polynomials of joint angles; lengths l(q).

A muscle acts on the rate of its length, so that its moment arm is exactly −∂l/∂q whatever the path is.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.bodies.algebra import Triple, difference, norm, rotate, total
from mbd.bodies.base import Frame
from mbd.bodies.domains import Domain
from mbd.bodies.scope import Scope
from mbd.bodies.values import is_several, number, shown, triple
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.base import frame_of, joint_of
from mbd.forces.muscles.wrapping import InBody, WrappingSurface, taut
from mbd.forces.quantities import (
    Mention,
    QuantityTriple,
    arguments_of,
    mentioned,
    triple_at,
    triple_of,
    value_parameters,
)
from mbd.joints.base import Joint
from mbd.tape.functions import where
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class ViaPoint:
    """A point of a path that moves over its body, or that the path meets in a part of a joint's range only.

    Parameters
    ----------
    frame : where it is, or the origin and axes of a place that moves
    joint : of a conditional point, the joint that decides
    between : (low, high) coordinate of the joint within which the path meets the point [rad or m]
    place : of a moving point, three functions of the arguments (or one that gives all three) [m], in axes of the frame
    arguments : what the functions are called with, as for `mbd.Applied`
    """

    frame: Frame
    joint: Joint | None = None
    between: tuple[float, float] | None = None
    place: QuantityTriple | None = None
    arguments: Any = ()

    def __post_init__(self) -> None:
        put = object.__setattr__
        frame_of(self.frame, "frame of a ViaPoint")
        put(self, "arguments", arguments_of(self.arguments, "ViaPoint"))
        if self.place is not None:
            put(self, "place", triple_of(self.place, "place of a ViaPoint"))
        if (self.joint is None) != (self.between is None):
            raise ModelError("a ViaPoint is conditional by joint= and between=(low, high) together; give both or none")
        if self.joint is not None:
            joint_of(self.joint, "joint of a ViaPoint")
            put(self, "between", _range(self.between))

    def mentions(self) -> list[Mention]:
        """Frame, joint and arguments."""
        return [self.frame, *([self.joint] if self.joint else []), *mentioned(self.arguments)]

    def parameters(self, owner: str) -> dict[str, float]:
        """Numbers among a place and its arguments, by full name."""
        return {} if self.place is None else value_parameters(self.place, self.arguments, owner, "place")

    def position(self, scope: Scope, owner: str) -> Triple:
        """Where it is, in ground axes."""
        motion = scope.frame(self.frame)
        if self.place is None:
            return motion.position
        x, y, z = triple_at(self.place, self.arguments, scope, owner, "place")
        return total(motion.position, rotate(motion.rotation, (x, y, z)))


class Path(ABC):
    """A length as a function of the posture."""

    @abstractmethod
    def length(self, scope: Scope, owner: str) -> Scalar:
        """l [m], recorded on the tape."""

    @abstractmethod
    def mentions(self) -> list[Mention]:
        """Frames, joints and names it refers to."""

    def parameters(self, owner: str) -> dict[str, float]:
        """Run-time parameters by full name; none by default."""
        return {}

    def domains(self, owner: str) -> dict[str, Domain]:
        """What its parameters may be, where they may not be any number."""
        return {}


@dataclass(frozen=True)
class PointPath(Path):
    """Straight lines from point to point, and around the surfaces between them.

    Conditional points join the path within their range; the surfaces before one are met where it is met.
    """

    points: tuple[Frame | ViaPoint | WrappingSurface, ...]

    def mentions(self) -> list[Mention]:
        """Of its points and surfaces."""
        found: list[Mention] = []
        for point in self.points:
            found += [point] if isinstance(point, Frame) else point.mentions()
        return found

    def parameters(self, owner: str) -> dict[str, float]:
        """Of points that move, and of surfaces."""
        found: dict[str, float] = {}
        for k, point in enumerate(self.points):
            found |= point.parameters(f"{owner} point {k + 1}") if not isinstance(point, Frame) else {}
        return found

    def domains(self, owner: str) -> dict[str, Domain]:
        """Radii are positive."""
        found: dict[str, Domain] = {}
        for k, point in enumerate(self.points):
            found |= point.domains(f"{owner} point {k + 1}") if isinstance(point, WrappingSurface) else {}
        return found

    def length(self, scope: Scope, owner: str) -> Scalar:
        """Σ over points k of the way from the point before, straight or around the surfaces between both."""
        whole: Scalar = 0.0
        last: Triple | None = None
        before: Frame | None = None
        over: list[tuple[int, WrappingSurface]] = []
        for k, point in enumerate(self.points):
            if isinstance(point, WrappingSurface):
                over.append((k, point))
                continue
            via = point if isinstance(point, ViaPoint) else ViaPoint(point)
            place = via.position(scope, f"{owner} point {k + 1}")
            still = via.frame if via.place is None else None
            if last is None:
                last, before = place, still
                continue
            bodies = {id(each.body) for each in (before, still, *(surface.frame for _, surface in over)) if each}
            if over and before is not None and still is not None and len(bodies) == 1:  # whatever the posture
                ends = before.placement(scope)[1], still.placement(scope)[1]
                piece, over = taut(InBody(scope), owner, *ends, over), []
            elif over:
                piece, over = taut(scope, owner, last, place, over), []
            elif before is not None and still is not None and before.body is still.body:  # whatever the posture
                piece = norm(difference(still.placement(scope)[1], before.placement(scope)[1]))
            else:
                piece = norm(difference(place, last))
            if via.joint is None or via.between is None:
                whole, last, before = whole + piece, place, still
                continue
            (q,) = scope.joint(via.joint.name).coordinates
            low, high = via.between
            met = (q - low) * (high - q) >= 0.0
            whole = whole + where(met, piece, 0.0)
            last = tuple(where(met, new, old) for new, old in zip(place, last, strict=True))
            before = None
        return whole


@dataclass(frozen=True, init=False)
class PolynomialPath(Path):
    """``l = Σ c Π q_k^p_k`` of the coordinates of joints; moment arms are polynomials too.

    A. J. van den Bogert, D. Blana and D. Heinrich, Procedia IUTAM 2 (2011) 297.

    Parameters
    ----------
    joints : each with one coordinate
    terms : coefficient c [m, rad] by powers, one for each joint: {(0, 0): 0.42, (1, 0): -0.05, (1, 2): 3e-3}

    >>> import mbd
    >>> knee = mbd.Revolute("knee", mbd.Link("thigh", 1.0, 0.4, 0.2).end, mbd.Link("shank", 1.0, 0.4, 0.2).start)
    >>> PolynomialPath(knee, {0: 0.4, 1: -0.05}).terms
    (((0,), 0.4), ((1,), -0.05))
    """

    joints: tuple[Joint, ...]
    terms: tuple[tuple[tuple[int, ...], float], ...]

    def __init__(self, joints: Any, terms: Mapping[Any, float]) -> None:
        several = tuple(joints) if is_several(joints) else (joints,)
        found = []
        if not isinstance(terms, Mapping) or not terms or not several:
            raise ModelError(
                "terms of a PolynomialPath are coefficients by powers, such as {(0,): 0.4, (1,): -0.05}, of one joint "
                f"at least; got {shown(terms)[:80]}"
            )
        for powers, value in terms.items():
            each = powers if isinstance(powers, tuple) else (powers,)
            whole = all(isinstance(p, int | np.integer) and not isinstance(p, bool) and 0 <= p <= 20 for p in each)
            if len(each) != len(several) or not whole:
                raise ModelError(
                    f"powers of a PolynomialPath are {len(several)} whole numbers from 0 to 20, one for each joint; "
                    f"got {shown(powers)[:80]}"
                )
            found.append((tuple(map(int, each)), number(value, f"coefficient {powers} of a PolynomialPath")))
        object.__setattr__(self, "joints", tuple(joint_of(each, "joint of a PolynomialPath") for each in several))
        object.__setattr__(self, "terms", tuple(found))

    @classmethod
    def fitted(
        cls, joints: Joint | Sequence[Joint], coordinates: Matrix, length: Vector, degree: int
    ) -> PolynomialPath:
        """The polynomial of a degree that is nearest to measured or computed lengths, by least squares.

        Parameters
        ----------
        joints : k joints, each with one coordinate
        coordinates : (R, k) of the joints [rad or m]
        length : (R,) l [m]
        degree : largest sum of powers, from 0 to 20

        Raises
        ------
        ModelError
            for tables of other shapes or with numbers that are not finite, and for more terms than postures.
        """
        if isinstance(joints, Joint):
            joints = (joints,)
        if not isinstance(degree, int | np.integer) or isinstance(degree, bool) or not 0 <= degree <= 20:
            raise ModelError(
                f"degree of PolynomialPath.fitted is a whole number from 0 to 20, got {shown(degree)[:80]}"
            )
        q, l_MT = np.asarray(coordinates, dtype=float), np.asarray(length, dtype=float)
        if q.ndim != 2 or q.shape[1] != len(joints) or l_MT.shape != (len(q),):
            raise ModelError(
                f"PolynomialPath.fitted needs coordinates (R, {len(joints)}) and as many lengths (R,), got {q.shape} "
                f"and {l_MT.shape}"
            )
        if not (np.isfinite(q).all() and np.isfinite(l_MT).all()):
            raise ModelError("PolynomialPath.fitted: coordinates and lengths must be finite; leave gaps out")
        powers = [p for p in np.ndindex(*(degree + 1,) * len(joints)) if sum(p) <= degree]
        if len(powers) > len(q):
            raise ModelError(
                f"PolynomialPath.fitted: {len(powers)} terms from {len(q)} postures; give more, or a lower degree"
            )
        table = np.column_stack([np.prod(q ** np.array(p), axis=1) for p in powers])
        found = np.linalg.lstsq(table, l_MT, rcond=None)[0]
        return cls(joints, {tuple(map(int, p)): float(c) for p, c in zip(powers, found, strict=True)})

    def mentions(self) -> list[Mention]:
        """Its joints."""
        return list(self.joints)

    def length(self, scope: Scope, owner: str) -> Scalar:
        """The polynomial."""
        q = [scope.joint(joint.name).coordinates[0] for joint in self.joints]
        powers = [[1.0, x] for x in q]
        whole: Scalar = 0.0
        for exponents, coefficient in self.terms:
            term: Scalar = coefficient
            for known, p in zip(powers, exponents, strict=True):
                while len(known) <= p:
                    known.append(known[-1] * known[1])
                term = term if p == 0 else term * known[p]
            whole = whole + term
        return whole


def path_of(value: Any, what: str) -> Path:
    """A path as users may give it: itself, or its points."""
    if isinstance(value, Path):
        return value
    points = tuple(value) if isinstance(value, Sequence) and not isinstance(value, str) else ()
    known = all(isinstance(point, Frame | ViaPoint | WrappingSurface) for point in points)
    if len(points) < 2 or not known or any(isinstance(points[k], WrappingSurface) for k in (0, -1)):
        raise ModelError(
            f"{what} is two points at least, such as (thigh.point(0.03, -0.1), shank.point(0.04, -0.05)), with "
            f"surfaces between points, or a mbd.PolynomialPath; got {shown(value)[:80]}"
        )
    for end in points[0], points[-1]:
        if isinstance(end, ViaPoint) and end.joint is not None:
            raise ModelError(f"{what}: its first and its last point cannot be conditional")
    return PointPath(points)


def _range(value: Any) -> tuple[float, float]:
    low, high = triple((*value, 0.0), "between of a ViaPoint")[:2] if _is_pair(value) else (1.0, 0.0)
    if not low < high:
        raise ModelError(f"between of a ViaPoint is (low, high) of the coordinate, got {shown(value)[:80]}")
    return low, high


def _is_pair(value: Any) -> bool:
    return isinstance(value, Sequence | np.ndarray) and len(value) == 2
