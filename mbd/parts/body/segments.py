"""Segments of a person, and of a side that differs."""

from __future__ import annotations

from typing import Any

from mbd.bodies.inertia import Solid, segment
from mbd.bodies.values import among
from mbd.dataclass import dataclass
from mbd.errors import ModelError, nearest
from mbd.parts.arguments import sizes

LENGTHS = {"thigh": 0.245, "shank": 0.246, "foot": 0.152}
"""Lengths over the body's height (R. Drillis & R. Contini, Body Segment Parameters, New York University, 1966; Winter
2009, fig. 4.1): hip to knee, knee to ankle, heel to toe."""

DE_LEVA: dict[str, dict[str, tuple[float, float, float, float, float, float]]] = {
    "de Leva male": {
        "thigh": (0.1416, 0.4095, 0.329, 0.329, 0.149, 0.4222 / 1.741),
        "shank": (0.0433, 0.4459, 0.255, 0.249, 0.103, 0.4340 / 1.741),
        "foot": (0.0137, 0.4415, 0.257, 0.245, 0.124, 0.2581 / 1.741),
    },
    "de Leva female": {
        "thigh": (0.1478, 0.3612, 0.369, 0.364, 0.162, 0.3685 / 1.735),
        "shank": (0.0481, 0.4416, 0.271, 0.267, 0.093, 0.4323 / 1.735),
        "foot": (0.0129, 0.4014, 0.299, 0.279, 0.139, 0.2283 / 1.735),
    },
}
"""Mass over body mass; center of mass, and radii of gyration about the sagittal (forward), transverse (sideways) and
long axis, over segment length; length over the height of the persons measured.

P. de Leva, Adjustments to Zatsiorsky-Seluyanov's segment inertia parameters, J. Biomechanics 29 (1996) 1223, table 4:
thigh from hip to knee joint center, shank from there to the lateral malleolus, foot from the heel to the tip of the
toes. To the center of the ankle, some 6 mm below the malleolus, the table has shanks of its own, which are not here.
"""

TABLES = ("Winter", *DE_LEVA)
"""Tables of segments."""


@dataclass(frozen=True)
class BodySegment:
    """A segment: its length [m] and its mass properties as a link along −y from its proximal end."""

    length: float
    solid: Solid

    @property
    def link(self) -> dict[str, Any]:
        """Arguments of `Link`: length, mass, center, inertia."""
        return {"length": self.length, **self.solid.link}

    def scaled(self, mass: float = 1.0, length: float = 1.0) -> BodySegment:
        """The same with other mass and length of the same shape: ``m → a m``, ``L → b L``, ``I → a b² I``.

        >>> light = person(70.0, 1.75).shank.scaled(mass=0.6)
        >>> round(light.solid.mass / person(70.0, 1.75).shank.solid.mass, 12)
        0.6
        """
        a, b = sizes("BodySegment.scaled", mass=mass, length=length)
        s = self.solid
        x, y, z = s.inertia
        size = a * b * b
        inertia = (size * x, size * y, size * z)
        center = (b * s.center[0], b * s.center[1], b * s.center[2])
        return BodySegment(b * self.length, Solid(a * s.mass, center, inertia))


@dataclass(frozen=True)
class Person:
    """Segments of one leg, and the mass of all the rest [kg]."""

    thigh: BodySegment
    shank: BodySegment
    foot: BodySegment
    rest: float

    def scaled(self, **factors: dict[str, float]) -> Person:
        """A leg of which some segments are scaled: ``person.scaled(shank={"mass": 0.6}, foot={"mass": 0.7})``."""
        own = {"thigh": self.thigh, "shank": self.shank, "foot": self.foot}
        for name in factors:
            if name not in own:
                raise ModelError("scaled: " + nearest(name, own, "segment", "A leg has"))
        own |= {name: own[name].scaled(**how) for name, how in factors.items()}
        return Person(own["thigh"], own["shank"], own["foot"], self.rest)


def person(mass: float, height: float, table: str = "Winter") -> Person:
    """A person's legs by a table of segments; `rest` is what is not legs, such as a point mass at the hip.

    ``m = c_m M``, ``L = c_L H``, center ``c_c L`` from the proximal end, ``I = m (c_r L)²``.

    Parameters
    ----------
    mass : M of the whole person [kg]
    height : H [m]
    table : 'Winter' (D. A. Winter, Biomechanics and Motor Control of Human Movement, 2009, table 4.1), 'de Leva male'
        or 'de Leva female' (1996). Winter's foot has the length from heel to toe and a radius of gyration for that from
        malleolus to metatarsal head, so that its inertia is about four times that of a foot

    Raises
    ------
    ModelError
        for a table that there is not, and numbers that are not positive.

    >>> sound = person(70.0, 1.75)
    >>> print(round(sound.thigh.solid.mass, 3), round(sound.shank.length, 4), round(sound.rest, 2))
    7.0 0.4305 47.46
    >>> prosthetic = sound.scaled(shank={"mass": 0.6}, foot={"mass": 0.7})
    >>> import mbd
    >>> mbd.Link("right shank", **prosthetic.shank.link).mass == 0.6 * sound.shank.solid.mass
    True
    """
    M, H = sizes("person", mass=mass, height=height)
    if not among(table, TABLES):
        raise ModelError("person: " + nearest(table, TABLES, "table", "There are"))
    parts = {name: _segment(name, M, H, table) for name in ("thigh", "shank", "foot")}
    return Person(**parts, rest=M - 2.0 * sum(part.solid.mass for part in parts.values()))


def _segment(name: str, mass: float, height: float, table: str) -> BodySegment:
    if table == "Winter":
        length = LENGTHS[name] * height
        return BodySegment(length, segment(name, mass, length))
    share, center, forward, sideways, along, size = DE_LEVA[table][name]
    m, L = share * mass, size * height
    x, y, z = (m * (radius * L) ** 2 for radius in (forward, along, sideways))
    return BodySegment(L, Solid(m, (0.0, -center * L, 0.0), (x, y, z)))
