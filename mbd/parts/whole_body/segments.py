"""The bodies of a person, from a table of segments."""

from __future__ import annotations

from mbd.bodies.base import Body
from mbd.bodies.inertia import Solid
from mbd.bodies.link import Link
from mbd.bodies.rigid_body import RigidBody
from mbd.bodies.values import Vector3
from mbd.dataclass import dataclass
from mbd.parts.arguments import sizes
from mbd.parts.whole_body.table import DE_LEVA, HEIGHTS, SHOULDERS, Row

SIDES = {"left": -1.0, "right": 1.0}
"""Sign of z: x is forward, y up, z to the right."""
ANKLE = 0.039
"""Height of the ankle over the sole, over the body's (Drillis & Contini 1966)."""
SHOULDER = 0.129
"""From the middle to a shoulder joint, over the body's height (Drillis & Contini 1966)."""
HIP = 0.05
"""From the middle to a hip joint, over the body's height: 0.36 of the distance of the anterior iliac spines, which is
about 0.14 of it (A. L. Bell, D. R. Pedersen & R. A. Brand, J. Biomechanics 23 (1990) 617)."""
HEEL, BALL, BREADTH = 0.25, 0.48, 0.055
"""About: ankle ahead of the heel and ball ahead of the ankle, over the foot's length; breadth of the foot over the
body's height (Drillis & Contini 1966)."""


@dataclass(frozen=True)
class Segment:
    """A segment: mass, center and inertia, and the places of its joints and ends in its axes [m].

    length : along −y from its joint, of those that become a `Link`; None of those that become a `RigidBody`
    """

    name: str
    solid: Solid
    points: tuple[tuple[str, Vector3], ...] = ()
    length: float | None = None

    def scaled(self, mass: float = 1.0, length: float = 1.0) -> Segment:
        """Of other mass and size, with the same shape: ``m → a m``, places ``r → b r``, ``I → a b² I``."""
        a, b = sizes(f"scaled '{self.name}'", mass=mass, length=length)
        solid = Solid(a * self.solid.mass, _times(b, self.solid.center), _times(a * b * b, self.solid.inertia))
        points = tuple((name, _times(b, place)) for name, place in self.points)
        return Segment(self.name, solid, points, None if self.length is None else b * self.length)

    def body(self, prefix: str = "") -> Body:
        """The body, with its places as named points."""
        name = prefix + self.name
        body: Body
        if self.length is None:
            body = RigidBody(name, **self.solid.body)
        else:
            body = Link(name, length=self.length, **self.solid.link)
        for called, place in self.points:
            body.point(*place, name=called)
        return body


def segments_of(mass: float, height: float, sex: str) -> list[Segment]:
    """All segments, from the pelvis outwards; joints lie in the origins of their axes, in the order of their names."""
    table = DE_LEVA[sex]
    whole = sum(row.mass for name, row in table.items() if name in MIDDLE)
    whole += 2.0 * sum(row.mass for name, row in table.items() if name not in MIDDLE)
    share, size = mass / whole, height / HEIGHTS[sex]
    rows = {name: row._replace(mass=share * row.mass, length=size * row.length) for name, row in table.items()}
    found = _middle(rows, height, size * SHOULDERS[sex])
    for side in SIDES:
        limbs = [_limb(f"{side} {name}", rows[name]) for name in ("upper arm", "forearm", "hand", "thigh", "shank")]
        found += [*limbs, _foot(f"{side} foot", rows["foot"], height, SIDES[side])]
    return found


MIDDLE = ("head", "upper trunk", "middle trunk", "lower trunk")


def _middle(rows: dict[str, Row], height: float, shoulders: float) -> list[Segment]:
    """Pelvis at the middle of the hips, torso at the navel, head at the seventh cervical vertebra."""
    head, upper, middle, lower = (rows[name] for name in MIDDLE)
    legs = ANKLE * height + rows["shank"].length + rows["thigh"].length
    navel = lower.length
    neck = height - head.length - legs - navel
    chest, belly = _solid(upper, middle.length + upper.length), _solid(middle, middle.length)
    beside = {"hip": HIP * height, "shoulder": SHOULDER * height}
    hips = [(f"{side} hip", (0.0, 0.0, sign * beside["hip"])) for side, sign in SIDES.items()]
    arms = [(f"{side} shoulder", (0.0, shoulders - navel, sign * beside["shoulder"])) for side, sign in SIDES.items()]
    return [
        Segment("pelvis", _solid(lower, navel), (("back", (0.0, navel, 0.0)), *hips)),
        Segment("torso", _joined(chest, belly), (("neck", (0.0, neck, 0.0)), *arms)),
        Segment("head", _solid(head, head.length), (("top", (0.0, head.length, 0.0)),)),
    ]


def _solid(row: Row, top: float) -> Solid:
    """Of a segment that reaches down along −y from y = top."""
    x, y, z = (_moment(row, radius) for radius in (row.sagittal, row.long, row.transverse))
    return Solid(row.mass, (0.0, top - row.center * row.length, 0.0), (x, y, z))


def _moment(row: Row, radius: float) -> float:
    reach = radius * row.length
    return row.mass * reach * reach


def _limb(name: str, row: Row) -> Segment:
    return Segment(name, _solid(row, 0.0), (), row.length)


def _foot(name: str, row: Row, height: float, outwards: float) -> Segment:
    """At the ankle: its center halfway down to the sole, its long axis forward."""
    down, heel, half = -ANKLE * height, -HEEL * row.length, 0.5 * BREADTH * height * outwards
    upright, along, across = (_moment(row, radius) for radius in (row.sagittal, row.long, row.transverse))
    solid = Solid(row.mass, (heel + row.center * row.length, 0.5 * down, 0.0), (along, upright, across))
    ball = BALL * row.length
    places = {
        "sole": (0.0, down, 0.0), "heel": (heel, down, 0.0), "toe": (heel + row.length, down, 0.0),
        "inner ball": (ball, down, -half), "outer ball": (ball, down, half),
    }  # fmt: skip
    return Segment(name, solid, tuple(places.items()))


def _joined(a: Solid, b: Solid) -> Solid:
    """Two solids as one, both on the y axis (Huygens and Steiner)."""
    mass = a.mass + b.mass
    center = (a.mass * a.center[1] + b.mass * b.center[1]) / mass
    across = sum(part.mass * (part.center[1] - center) * (part.center[1] - center) for part in (a, b))
    (ax, ay, az), (bx, by, bz) = a.inertia, b.inertia
    return Solid(mass, (0.0, center, 0.0), (ax + bx + across, ay + by, az + bz + across))


def _times(factor: float, place: Vector3) -> Vector3:
    return (factor * place[0], factor * place[1], factor * place[2])
