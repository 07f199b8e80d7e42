"""Mass properties of simple solids and of the segments of a human body.

Each helper gives a `Solid` (mass, center, inertia), from which bodies are made:
``Link("rod", length=1.0, **rod(2.0, 1.0).link)``, ``RigidBody("box", **box(2.0, (1, 2, 3)).body)``.
"""

from dataclasses import field
from typing import Any

from mbd.bodies.values import Vector3, among, number, size, triple
from mbd.dataclass import dataclass
from mbd.errors import ModelError, nearest


@dataclass(frozen=True)
class Solid:
    """Mass m [kg], center of mass [m], principal moments about the center (Ixx, Iyy, Izz) [kg m²].

    form : as what pictures in space show it, 'box', 'cylinder' or 'ball'; '': whatever has its inertia
    """

    mass: float
    center: Vector3
    inertia: Vector3
    form: str = field(default="", compare=False, repr=False)

    @property
    def link(self) -> dict[str, Any]:
        """Arguments of `Link`: mass, center (metres below the start), inertia."""
        return {"mass": self.mass, "center": -self.center[1] + 0.0, "inertia": self.inertia}

    @property
    def body(self) -> dict[str, Any]:
        """Arguments of `RigidBody`: mass, inertia, center, and form where there is one."""
        form = {"form": self.form} if self.form else {}
        return {"mass": self.mass, "inertia": self.inertia, "center": self.center, **form}


def rod(mass: float, length: float) -> Solid:
    """A thin uniform rod along −y from its start: ``Izz = Ixx = m L²/12``, Iyy = 0.

    >>> rod(3.0, 2.0)
    Solid(mass=3.0, center=(0.0, -1.0, 0.0), inertia=(1.0, 0.0, 1.0))
    """
    m, L = size(mass, "mass of a rod"), size(length, "length of a rod")
    across = m * L * L / 12.0
    return Solid(m, (0.0, -L / 2.0, 0.0), (across, 0.0, across))


def box(mass: float, sides: Any) -> Solid:
    """A uniform box about its center, sides (a, b, c) along x, y, z: ``Ixx = m (b² + c²)/12``, …"""
    m = size(mass, "mass of a box")
    a, b, c = (size(side, "side of a box") for side in triple(sides, "sides of a box"))
    x, y, z = m * a * a / 12.0, m * b * b / 12.0, m * c * c / 12.0
    return Solid(m, (0.0, 0.0, 0.0), (y + z, x + z, x + y), "box")


def sphere(mass: float, radius: float) -> Solid:
    """A uniform ball: ``I = 2 m r²/5``."""
    m, r = size(mass, "mass of a sphere"), size(radius, "radius of a sphere")
    moment = 0.4 * m * r * r
    return Solid(m, (0.0, 0.0, 0.0), (moment, moment, moment), "ball")


def cylinder(mass: float, radius: float, length: float, axis: str = "z") -> Solid:
    """A uniform cylinder about its center: ``m r²/2`` about its axis, ``m (3 r² + L²)/12`` across."""
    m, r = size(mass, "mass of a cylinder"), size(radius, "radius of a cylinder")
    L = size(length, "length of a cylinder")
    if not among(axis, ("x", "y", "z")):
        raise ModelError(f"the axis of a cylinder is 'x', 'y' or 'z', got {axis!r}")
    along, across = m * r * r / 2.0, m * (3.0 * r * r + L * L) / 12.0
    x, y, z = (along if axis == name else across for name in "xyz")
    return Solid(m, (0.0, 0.0, 0.0), (x, y, z), "cylinder")


def disk(mass: float, radius: float, axis: str = "z") -> Solid:
    """A thin uniform disk about its center: ``m r²/2`` about its axis, half of it across."""
    return cylinder(mass, radius, 0.0, axis)


SEGMENTS: dict[str, tuple[float, float, float]] = {
    "hand": (0.006, 0.506, 0.297),
    "forearm": (0.016, 0.430, 0.303),
    "upper arm": (0.028, 0.436, 0.322),
    "foot": (0.0145, 0.500, 0.475),
    "shank": (0.0465, 0.433, 0.302),
    "thigh": (0.100, 0.433, 0.323),
    "foot and shank": (0.061, 0.606, 0.416),
    "leg": (0.161, 0.447, 0.326),
    "HAT": (0.678, 0.626, 0.496),
}
"""Mass over body mass; center of mass from the proximal end and radius of gyration about it, over segment length.

D. A. Winter, Biomechanics and Motor Control of Human Movement, 4th ed., Wiley 2009, table 4.1. Ends: thigh from
greater trochanter to femoral condyles, shank to medial malleolus, foot from lateral malleolus to the head of
metatarsal II, leg from greater trochanter to medial malleolus, HAT (head, arms, trunk) from greater trochanter to
glenohumeral joint.
"""


def segment(name: str, body_mass: float, length: float) -> Solid:
    """A segment of the human body as a link along −y from its proximal end.

    ``m = c_m M``, center ``c_c L`` from the proximal end, ``Izz = Ixx = m (c_r L)²``; the moment about the long axis is
    left out of Winter's table and taken as zero, as for a rod.

    Parameters
    ----------
    name : 'thigh', 'shank', 'foot', 'HAT', …: see `SEGMENTS`
    body_mass : M of the whole person [kg]
    length : of the segment [m]
    """
    if not among(name, SEGMENTS):
        raise ModelError(nearest(name, SEGMENTS, "body segment", "The table has"))
    M, L = number(body_mass, "body_mass"), number(length, f"length of '{name}'")
    fraction, center, gyration = SEGMENTS[name]
    m = fraction * M
    reach = gyration * L
    across = m * (reach * reach)
    return Solid(m, (0.0, -center * L, 0.0), (across, 0.0, across))
