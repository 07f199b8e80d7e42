"""The joints of a person."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, fields, replace
from typing import Any

from mbd.bodies.base import Body, Frame
from mbd.dataclass import dataclass
from mbd.errors import ModelError, nearest
from mbd.joints.base import Joint
from mbd.joints.revolute import Revolute
from mbd.joints.spherical import Spherical
from mbd.joints.universal import Universal
from mbd.joints.weld import Weld
from mbd.parts.whole_body.segments import SIDES

Z = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Articulation:
    """A joint by names: of its two segments, and of its place on the parent; on the child it lies in the origin."""

    name: str
    parent: str
    place: str
    child: str
    kind: type[Joint]
    how: Mapping[str, Any] = field(default_factory=dict, hash=False)

    def joint(self, prefix: str, bodies: Mapping[str, Body]) -> Joint:
        """The joint between the frames of two bodies."""
        parent, child = bodies[self.parent], bodies[self.child]
        made: Any = self.kind
        return made(prefix + self.name, _frame(parent, self.place, self.name), child.origin, **self.how)  # type: ignore[no-any-return]

    def changed(self, how: Mapping[str, Any]) -> Articulation:
        """With other values of some of its fields, such as loss and stiffness."""
        known = [each.name for each in fields(self.kind) if each.name not in ("name", "parent", "child", "_")]  # type: ignore[arg-type]
        for name in how:
            if name not in known:
                raise ModelError(
                    f"changed '{self.name}': " + nearest(name, known, "field", f"A {self.kind.__name__} has")
                )
        return replace(self, how={**self.how, **how})

    def welded(self) -> Articulation:
        """Held at zero."""
        return replace(self, kind=Weld, how={})


def _frame(body: Body, place: str, joint: str) -> Frame:
    points = {frame.name: frame for frame in body.points.values()} | body.frames
    if place not in points:
        raise ModelError(f"'{body.name}' holds the joint '{joint}': " + nearest(place, points, "point", "It has"))
    return points[place]


def articulations() -> list[Articulation]:
    """From the pelvis outwards: three freedoms of back, neck, shoulders and hips, two of ankles, one of the others.

    Elbow, knee and ankle turn about z, to the right: flexion of hip and elbow and dorsiflexion are positive, flexion of
    the knee is negative. Palms look at the thighs: flexion of the wrist turns them inwards. The second angle of the
    ankle turns the foot about its long axis.
    """
    found = [
        Articulation("back", "pelvis", "back", "torso", Spherical, {"anatomy": "back"}),
        Articulation("neck", "torso", "neck", "head", Spherical, {"anatomy": "neck"}),
    ]
    for side, sign in SIDES.items():

        def own(
            name: str, parent: str, place: str, child: str, kind: type[Joint], side: str = side, **how: Any
        ) -> None:
            upper = parent if parent in ("pelvis", "torso") else f"{side} {parent}"
            point = f"{side} {place}" if upper == parent else place
            named = {"anatomy": f"{side} {name}", **how}
            found.append(Articulation(f"{side} {name}", upper, point, f"{side} {child}", kind, named))

        own("shoulder", "torso", "shoulder", "upper arm", Spherical)
        own("elbow", "upper arm", "end", "forearm", Revolute)
        own("wrist", "forearm", "end", "hand", Revolute, axis=(sign, 0.0, 0.0))
        own("hip", "pelvis", "hip", "thigh", Spherical)
        own("knee", "thigh", "end", "shank", Revolute)
        own("ankle", "shank", "end", "foot", Universal, axis=Z, second_axis=(1.0, 0.0, 0.0))
    return found
