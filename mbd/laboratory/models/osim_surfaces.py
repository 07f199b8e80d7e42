"""Surfaces of ``.osim`` files that paths of muscles wrap around."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import field

import numpy as np

from mbd.bodies.base import Body
from mbd.dataclass import dataclass
from mbd.forces.muscles.wrapping import WrappingCylinder, WrappingSphere, WrappingSurface
from mbd.laboratory.models.osim_elements import flag_of, number_of, numbers_of, objects_in, plain, text_of
from mbd.laboratory.models.osim_file import OsimFile, framed
from mbd.laboratory.models.osim_joints import turned
from mbd.laboratory.models.xml import Element

__all__ = ["Surfaces", "surfaces_of"]

SIDES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "-x": (-1.0, 0.0, 0.0), "-y": (0.0, -1.0, 0.0)}
"""Sides of a cylinder on which a path stays."""
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
    endless: dict[str, float] = field(default_factory=dict)
    """Lengths of cylinders, which have no ends here, by name [m]."""

    def between(self, path: Element, muscle: str, bodies: Sequence[Body]) -> list[list[WrappingSurface]]:
        """Surfaces after each point of a path but the last, in the order in which the path meets them.

        Parameters
        ----------
        path : <GeometryPath>
        muscle : its name
        bodies : that carry the points, from origin to insertion
        """
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
            reach = range(max(first, 1) - 1, (last if last >= 1 else len(bodies)) - 1)
            for k in reach:
                # what moves with the surface does not come to touch it
                if k < len(found) and not bodies[k] is bodies[k + 1] is surface.frame.body:
                    found[k].append(surface)
                    self.used.add(name)
        for k, surfaces in enumerate(found):
            if len(surfaces) > 1:
                chains = [self._chain(bodies[end]) for end in (k, k + 1)]
                surfaces.sort(key=lambda surface: self._place(surface, *chains))
        return found

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


def surfaces_of(file: OsimFile) -> Surfaces:
    """Spheres and cylinders of bodies and the ground; others by the kind that they are."""
    found = Surfaces({}, {}, file)
    owners = [(file.body("ground"), ground) for ground in file.source.all("Ground")]
    for element in objects_in(file.source, "BodySet"):
        owners.append((file.body(plain(element.get("name"))), element))
    for body, owner in owners:
        for element in objects_in(owner, "WrapObjectSet"):
            name = element.get("name")
            if name in found.known or name in found.unread:
                continue  # paths mean the first one
            if element.tag not in ("WrapSphere", "WrapCylinder"):
                found.unread[name] = f"<{element.tag}>"
                continue
            if not flag_of(element, "active", True):
                found.unread[name] = ""
                continue
            turn = turned(numbers_of(element, "xyz_body_rotation", 3, ORIGIN))
            place = np.array(numbers_of(element, "translation", 3, ORIGIN))
            frame = framed(body, f"{name} surface", place, turn)
            radius = number_of(element, "radius")
            if not 0.0 < radius < math.inf:
                raise element.wrong(f"{name!r} needs a radius above 0 m, got {radius:g}")
            side = text_of(element, "quadrant", "all").lower().lstrip("+")
            if element.tag == "WrapSphere":
                found.known[name] = WrappingSphere(frame, radius)
                _report_side(file, name, "sphere", side, ("all",))
            else:
                found.known[name] = WrappingCylinder(frame, radius, SIDES.get(side))
                found.endless[name] = number_of(element, "length", math.inf)
                _report_side(file, name, "cylinder", side, ("all", *SIDES))
    return found


def _report_side(file: OsimFile, name: str, kind: str, side: str, kept: tuple[str, ...]) -> None:
    if side not in kept:
        file.report.approximated.append(
            f"{kind} {name!r} is wrapped around on the shorter side, not on its side {side!r}"
        )
