"""Surfaces of ``.osim`` files that paths of muscles wrap around."""

import math
from collections.abc import Sequence
from dataclasses import field

import numpy as np

from mbd.bodies.base import Body, Frame
from mbd.dataclass import dataclass
from mbd.forces.muscles.paths import ViaPoint
from mbd.forces.muscles.wrapping import (
    WrappingCylinder,
    WrappingEllipsoid,
    WrappingSphere,
    WrappingSurface,
    bends,
)
from mbd.laboratory.models.osim_elements import flag_of, number_of, numbers_of, objects_in, plain, text_of
from mbd.laboratory.models.osim_file import OsimFile, framed
from mbd.laboratory.models.osim_joints import turned
from mbd.laboratory.models.xml import Element

SIDES = {
    "x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0),
    "-x": (-1.0, 0.0, 0.0), "-y": (0.0, -1.0, 0.0), "-z": (0.0, 0.0, -1.0),
}  # fmt: skip
"""Sides of a surface on which a path stays."""
ORIGIN = (0.0, 0.0, 0.0)


@dataclass
class Surfaces:
    """Surfaces by name, and the names of those that are not wrapped around, or not as the file says."""

    known: dict[str, WrappingSurface]
    unread: dict[str, str]
    """Kinds of surfaces that are not read, by name; empty where a surface is switched off."""
    file: OsimFile
    straight: dict[str, list[str]] = field(default_factory=dict)
    """By kind, muscles whose path passes a surface of it straight."""
    used: set[str] = field(default_factory=set)
    """Names of those that paths pass."""

    def between(self, path: Element, muscle: str, points: Sequence[Frame | ViaPoint]) -> list[list[WrappingSurface]]:
        """Surfaces after each point of a path but the last, in the order in which the path meets them.

        Parameters
        ----------
        path : <GeometryPath>
        muscle : its name
        points : from origin to insertion
        """
        bodies = [(point.frame if isinstance(point, ViaPoint) else point).body for point in points]
        found: list[list[WrappingSurface]] = [[] for _ in bodies[1:]]
        for element in objects_in(path, "PathWrapSet"):
            name = text_of(element, "wrap_object")
            if name in self.unread:
                if self.unread[name]:
                    self.straight.setdefault(self.unread[name], []).append(muscle)
                continue
            if name not in self.known:
                raise element.wrong(f"of muscle {muscle!r} names the surface {name!r}, which no body has")
            surface = self.known[name]
            first, last = (int(value) for value in numbers_of(element, "range", 2, (-1.0, -1.0)))
            reach = range(max(first, 1) - 1, min(last if last >= 1 else len(bodies), len(bodies)) - 1)
            # what moves with the surface is bent by it in each posture or in none
            still = [k for k in reach if bodies[k] is bodies[k + 1] is surface.frame.body]
            bent = [k for k in still if _bends(points[k], points[k + 1], surface)]
            for k in bent:
                found[k].append(surface)
                self.used.add(name)
            # a surface bends one piece of the path: of several those that the fewest joints are between
            moving = [] if bent else [k for k in reach if k not in still]
            apart = {k: sum(self._joints_to(surface, bodies[end]) for end in (k, k + 1)) for k in moving}
            for k in moving:
                if apart[k] == min(apart.values()):
                    found[k].append(surface)
                    self.used.add(name)
        for k, surfaces in enumerate(found):
            if len(surfaces) > 1:
                chains = [self._chain(bodies[end]) for end in (k, k + 1)]
                surfaces.sort(key=lambda surface: self._place(surface, *chains))
        return found

    def _joints_to(self, surface: WrappingSurface, body: Body) -> int:
        return _joints_between(self._chain(surface.frame.body), self._chain(body))

    def _place(self, surface: WrappingSurface, first: list[Body], last: list[Body]) -> int:
        """Joints to the first point less those to the last point."""
        own = self._chain(surface.frame.body)
        return _joints_between(own, first) - _joints_between(own, last)

    def _chain(self, body: Body) -> list[Body]:
        """The body and those that carry it, to the ground."""
        above = {joint.child.body.name: joint.parent.body for joint in self.file.joints.values()}
        chain = [body]
        while chain[-1].name in above and len(chain) <= len(above):
            chain.append(above[chain[-1].name])
        return chain


def _joints_between(a: list[Body], b: list[Body]) -> int:
    """Joints from the first body of a chain to that of another."""
    common = next((k for k, body in enumerate(a) if any(body is other for other in b)), len(a))
    return common + (next(k for k, other in enumerate(b) if other is a[common]) if common < len(a) else len(b))


def _bends(first: Frame | ViaPoint, last: Frame | ViaPoint, surface: WrappingSurface) -> bool:
    """Whether a surface bends the line between two points of its own body that do not move there."""
    start, end = (point.frame if isinstance(point, ViaPoint) else point for point in (first, last))
    moves = any(isinstance(point, ViaPoint) and point.place is not None for point in (first, last))
    return not moves and bends(start, end, surface)


def surfaces_of(file: OsimFile) -> Surfaces:
    """Spheres, cylinders and ellipsoids of bodies and the ground; others by the kind that they are."""
    found = Surfaces({}, {}, file)
    owners = [(file.body("ground"), ground) for ground in file.source.all("Ground")]
    for element in objects_in(file.source, "BodySet"):
        owners.append((file.body(plain(element.get("name"))), element))
    for body, owner in owners:
        for element in objects_in(owner, "WrapObjectSet"):
            name = element.get("name")
            if name in found.known or name in found.unread:
                continue  # paths mean the first one
            if element.tag not in ("WrapSphere", "WrapCylinder", "WrapEllipsoid"):
                found.unread[name] = f"<{element.tag}>"
                continue
            if not flag_of(element, "active", True):
                found.unread[name] = ""
                continue
            turn = turned(numbers_of(element, "xyz_body_rotation", 3, ORIGIN))
            place = np.array(numbers_of(element, "translation", 3, ORIGIN))
            frame = framed(body, f"{name} surface", place, turn)
            found.known[name] = _surface(found, element, frame, name)
    return found


def _surface(found: Surfaces, element: Element, frame: Frame, name: str) -> WrappingSurface:
    """A sphere, one with a side as an ellipsoid, a cylinder or an ellipsoid."""
    given = text_of(element, "quadrant", "all").lower().lstrip("+")
    side = SIDES.get(given)
    if element.tag == "WrapEllipsoid":
        sizes = numbers_of(element, "dimensions", 3)
    else:
        sizes = (number_of(element, "radius"),) * 3
    if not all(0.0 < size < math.inf for size in sizes):
        raise element.wrong(f"{name!r} needs a radius above 0 m, got {min(sizes):g}")
    kind = element.tag.removeprefix("Wrap").lower()
    if kind == "cylinder" and side is not None and side[2]:
        side = None
    if given != "all" and side is None:
        found.file.report.approximated.append(
            f"{kind} {name!r} is wrapped around on the shorter side, not on its side {given!r}"
        )
    if kind == "cylinder":
        length = number_of(element, "length", math.inf)
        return WrappingCylinder(frame, sizes[0], side, length if 0.0 < length < math.inf else None)
    if kind == "sphere" and side is None:
        return WrappingSphere(frame, sizes[0])
    return WrappingEllipsoid(frame, sizes, side)
